"""MED files (Salome, Code_Aster)."""
