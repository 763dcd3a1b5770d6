"""Numba kernels: arrays in, arrays out. Kernels never see a `Mesh`."""
