"""Bounds on the Jacobian determinant inside a cell, from its Bernstein coefficients."""
