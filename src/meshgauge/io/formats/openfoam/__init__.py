"""OpenFOAM."""
