"""SU2 meshes."""
