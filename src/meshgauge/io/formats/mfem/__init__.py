"""MFEM meshes."""
