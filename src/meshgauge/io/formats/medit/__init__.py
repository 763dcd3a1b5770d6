"""Medit meshes, text and binary."""
