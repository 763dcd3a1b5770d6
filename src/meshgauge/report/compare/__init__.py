"""A comparison of meshes, for people and for programs. Data in, text out."""
