"""The matrices of `first_order` against those of scikit-fem (no pyramids) and NGSolve, which share no code with it."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import numpy as np
from first_order import LAMBDA, MU, NODES_OF_CUBE, Cells, Ids, Values, assemble
from grids import MAKE
from scipy import sparse

N_GAUSS = 8  # what is integrated is no polynomial on cells that are no parallelepipeds
CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
AT_NODES = {"tetra": CUBE[[0, 1, 3, 4]], "wedge": CUBE[[0, 1, 3, 4, 5, 7]], "hexahedron": CUBE}
"""Where the nodes of a type stand in its reference cell."""


def differences() -> list[tuple[str, str, float]]:
    """Library, type, and the largest difference, of those that are installed."""
    return [
        (library, name, max(difference(library, name)))
        for library in LIBRARIES
        for name in NODES_OF_CUBE
        if find_spec(library) is not None and (library, name) != ("skfem", "pyramid")
    ]


def difference(library: str, name: str, n: int = 2) -> tuple[float, float]:
    """The largest difference of an entry, relative to the largest, on n³ cubes moved at random and cut into a type: of
    the matrix of Poisson's problem, and of that of elasticity."""
    points, cells = MAKE[name][0](n)
    poisson, elastic = Cells.of(name, points[cells], N_GAUSS).stiffness()
    ours = [assemble(cells, poisson, len(points)), assemble(cells, elastic, len(points), 3)]
    if library == "ngsolve":
        by_axis = np.arange(3 * len(points)).reshape(-1, 3).T.ravel()
        ours[1] = ours[1][by_axis][:, by_axis]
    theirs = LIBRARIES[library](name, points, cells)
    one, three = (float(abs(a - b).max() / abs(a).max()) for a, b in zip(ours, theirs, strict=True))
    return one, three


def skfem(name: str, points: Values, cells: Ids) -> tuple[sparse.spmatrix, sparse.spmatrix]:
    """Of Poisson's problem, and of elasticity, x, y and z of a node together."""
    import skfem
    from skfem.models.elasticity import linear_elasticity
    from skfem.models.poisson import laplace

    mesh_class, element = {
        "tetra": (skfem.MeshTet1, skfem.ElementTetP1()),
        "wedge": (skfem.MeshWedge1, skfem.ElementWedge1()),
        "hexahedron": (skfem.MeshHex1, skfem.ElementHex1()),
    }[name]
    order = [int(np.flatnonzero((AT_NODES[name] == at).all(axis=1))[0]) for at in np.rint(element.doflocs)]
    mesh = mesh_class(np.ascontiguousarray(points.T), np.ascontiguousarray(cells[:, order].T))
    rule = None
    if name == "wedge":  # that of scikit-fem 12.0.2 is wrong: its weights sum to 1/4, not to the volume, 1/2
        x, weights = skfem.quadrature.get_quadrature_tri(2 * N_GAUSS - 2)
        z, heights = skfem.quadrature.get_quadrature_line(2 * N_GAUSS - 2)
        at = np.vstack([np.repeat(x, len(heights), axis=1), np.tile(z, len(weights))])
        rule = at, np.outer(weights, heights).ravel()
    bases = [
        skfem.Basis(mesh, one, quadrature=rule, intorder=2 if name == "tetra" else 2 * N_GAUSS - 2)
        for one in (element, skfem.ElementVector(element))
    ]
    return laplace.assemble(bases[0]), linear_elasticity(LAMBDA, MU).assemble(bases[1])


def ngsolve(name: str, points: Values, cells: Ids) -> tuple[sparse.spmatrix, sparse.spmatrix]:
    """Of Poisson's problem, and of elasticity, all x before all y before all z."""
    import netgen.meshing
    import ngsolve

    grid = netgen.meshing.Mesh(dim=3)
    ids = [grid.Add(netgen.meshing.MeshPoint(netgen.meshing.Pnt(*map(float, x)))) for x in points]
    grid.Add(netgen.meshing.FaceDescriptor(surfnr=1, domin=1, domout=0, bc=1))
    grid.SetMaterial(1, "all")
    for cell in cells:
        grid.Add(netgen.meshing.Element3D(1, [ids[i] for i in cell]))
    mesh = ngsolve.Mesh(grid)
    dx = ngsolve.dx(bonus_intorder=2 * N_GAUSS - 2)
    one, three = ngsolve.H1(mesh, order=1), ngsolve.VectorH1(mesh, order=1)
    (u, v), (d, e) = one.TnT(), three.TnT()
    strain = ngsolve.Sym(ngsolve.Grad(d))
    stress = 2 * MU * strain + LAMBDA * ngsolve.Trace(strain) * ngsolve.Id(3)
    forms: list[Any] = [
        ngsolve.BilinearForm(ngsolve.grad(u) * ngsolve.grad(v) * dx),
        ngsolve.BilinearForm(ngsolve.InnerProduct(stress, ngsolve.Sym(ngsolve.Grad(e))) * dx),
    ]
    out = []
    for form in forms:
        rows, columns, values = form.Assemble().mat.COO()
        size = (form.mat.height, form.mat.width)
        out.append(sparse.csr_matrix((np.array(values), (np.array(rows), np.array(columns))), shape=size))
    return out[0], out[1]


LIBRARIES = {"skfem": skfem, "ngsolve": ngsolve}
