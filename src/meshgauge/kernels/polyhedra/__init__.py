"""Node values of polyhedra: vertex links, shapes, hanging nodes, matching with known solids."""
