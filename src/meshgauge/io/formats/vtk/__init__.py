"""VTK's formats: legacy, XML, HDF."""
