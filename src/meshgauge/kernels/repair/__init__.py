"""Energies, steps and surfaces for moving points."""
