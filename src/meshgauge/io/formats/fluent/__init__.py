"""Fluent cases, text, binary and HDF5."""
