"""Where its users already are: PyVista, ParaView, Gmsh. Each file loads the program that it is for, on use."""
