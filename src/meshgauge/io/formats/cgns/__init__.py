"""CGNS files."""
