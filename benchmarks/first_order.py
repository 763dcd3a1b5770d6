"""First-order finite elements for tetrahedra, pyramids, wedges and hexahedra, and what cells and meshes cost with them.

Two model problems: Poisson's (∇u · ∇v) and linear elasticity (E = 1, ν = 0.3). A cell is a trilinear hexahedron some
of whose nodes coincide: that gives the linear tetrahedron, the wedge that is linear over its triangles, and the usual
rational functions of the pyramid; Gauss points lie inside, so that nothing is singular.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg

from meshgauge.cells import SHAPES

Values = NDArray[np.float64]
Ids = NDArray[np.int64]

NODES_OF_CUBE = {
    "tetra": (0, 1, 2, 2, 3, 3, 3, 3),
    "pyramid": (0, 1, 2, 3, 4, 4, 4, 4),
    "wedge": (0, 1, 2, 2, 3, 4, 5, 5),
    "hexahedron": (0, 1, 2, 3, 4, 5, 6, 7),
}
"""Which node of the cell stands at each node of the cube, by type."""

LAMBDA, MU = 0.3 / (1.3 * 0.4), 1.0 / 2.6  # of E = 1, ν = 0.3
N_GAUSS = 3  # a direction: exact for what is integrated on parallelepipeds

# The quadratics ½x², ½y², ½z², yz, xz, xy with these weights: the mean square over them is the mean over Hessians whose
# distribution no rotation changes, so that no direction of space is preferred.
PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
WEIGHTS = np.array([1.0, 1.0, 1.0, 0.5, 0.5, 0.5])

LOSSES = ("condition", "elastic condition", "error", "elastic error", "steps", "elastic steps")
"""Condition number of the stiffness matrix, error of the gradient (stress) of a smooth solution, number of explicit
time steps for a given time: 1 over the longest stable one. The lower the better."""


class Element(NamedTuple):
    """Functions at the Gauss points of a type."""

    values: Values  #: (n_gauss, n_nodes)
    derivatives: Values  #: (n_gauss, n_nodes, 3) along the axes of the cube
    weights: Values  #: (n_gauss,)


@cache
def element(name: str, n_gauss: int = N_GAUSS) -> Element:
    """The functions of a type at ``n_gauss``³ points."""
    places, weights = np.polynomial.legendre.leggauss(n_gauss)
    places, weights = 0.5 * (places + 1.0), 0.5 * weights
    at = np.stack(np.meshgrid(places, places, places, indexing="ij"), -1).reshape(-1, 3)
    corner = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
    sides = np.where(corner == 1, at[:, None], 1.0 - at[:, None])  # (n_gauss, 8, 3)
    slopes = np.where(corner == 1, 1.0, -1.0)
    values = sides.prod(axis=2)
    derivatives = np.stack([slopes[:, a] * np.delete(sides, a, axis=2).prod(axis=2) for a in range(3)], -1)
    to_node = np.eye(max(NODES_OF_CUBE[name]) + 1)[list(NODES_OF_CUBE[name])]
    return Element(
        values @ to_node,
        np.einsum("qca,cn->qna", derivatives, to_node),
        np.einsum("i,j,k->ijk", weights, weights, weights).reshape(-1),
    )


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of one type at their Gauss points.

    Attributes
    ----------
    x
        ``(n, n_nodes, 3)`` where their nodes are.
    gradients
        ``(n, n_gauss, n_nodes, 3)`` of their functions, in space.
    weights
        ``(n, n_gauss)``: volume that a Gauss point stands for.
    values
        ``(n_gauss, n_nodes)`` of their functions.
    """

    x: Values
    gradients: Values
    weights: Values
    values: Values

    @classmethod
    def of(cls, name: str, x: Values, n_gauss: int = N_GAUSS) -> Cells:
        functions = element(name, n_gauss)
        jacobian = np.einsum("mna,qnr->mqar", x, functions.derivatives)
        gradients = np.einsum("qnr,mqra->mqna", functions.derivatives, np.linalg.inv(jacobian))
        return cls(x, gradients, np.linalg.det(jacobian) * functions.weights, functions.values)

    @property
    def volumes(self) -> Values:
        return np.asarray(self.weights.sum(axis=1))

    @property
    def masses(self) -> Values:
        """``(n, n_nodes)``: lumped, the volume that a node stands for."""
        return self.weights @ self.values

    def stiffness(self) -> tuple[Values, Values]:
        """``(n, n_nodes, n_nodes)`` of Poisson's problem and ``(n, 3 n_nodes, 3 n_nodes)`` of elasticity, x, y and z of
        a node together."""
        n, n_gauss, n_nodes, _ = self.gradients.shape
        flat = self.gradients.reshape(n, n_gauss, -1)
        products = np.matmul((flat * self.weights[..., None]).transpose(0, 2, 1), flat)
        products = products.reshape(n, n_nodes, 3, n_nodes, 3)
        poisson = np.einsum("miaja->mij", products)
        elastic = LAMBDA * products + MU * products.transpose(0, 1, 4, 3, 2)
        elastic += MU * np.einsum("mij,ab->miajb", poisson, np.eye(3))
        return poisson, elastic.reshape(n, 3 * n_nodes, 3 * n_nodes)

    def slopes(self) -> Values:
        """``(n, n_gauss, 6, 3)``: gradients of the quadratics."""
        x = np.einsum("qn,mna->mqa", self.values, self.x)
        out = np.zeros((*x.shape[:2], len(PAIRS), 3))
        for p, (a, b) in enumerate(PAIRS):
            out[:, :, p, b] = x[:, :, a]
            out[:, :, p, a] = x[:, :, b]
        return out


def quadratics(x: Values) -> Values:
    """``(..., 6)``: the quadratics at places."""
    return np.stack([x[..., a] * x[..., b] * (0.5 if a == b else 1.0) for a, b in PAIRS], -1)


def ideal(name: str) -> Values:
    """``(n_nodes, 3)`` of the cell all of whose faces are regular, edges of length 1."""
    return np.array(SHAPES[name].points)


def cell_losses(name: str, x: Values) -> dict[str, Values]:
    """What each of ``(n, n_nodes, 3)`` cells costs, alone, relative to the ideal cell of its type and of its volume.

    For the condition number stands the largest eigenvalue of the cell's stiffness matrix: that of a mesh follows the
    largest of its cells (J. Shewchuk, What is a good linear element?, 2002), and its smallest belongs to the domain.
    The error is that of interpolation of quadratics; the elastic one, in the mean over directions, is the same number.
    The time step is that of a cell alone, with lumped masses; that of a mesh is no shorter than the shortest.
    """
    found = _cell_losses(name, x)
    best = _cell_losses(name, ideal(name)[None])
    return {loss: values / best[loss] for loss, values in found.items()}


def _cell_losses(name: str, x: Values) -> dict[str, Values]:
    cells = Cells.of(name, x - x.mean(axis=1, keepdims=True))
    size = np.cbrt(cells.volumes)
    poisson, elastic = cells.stiffness()
    errors = np.einsum("mqia,mip->mqpa", cells.gradients, quadratics(cells.x)) - cells.slopes()
    square = np.einsum("mqpa,mqpa,mq,p->m", errors, errors, cells.weights, WEIGHTS)
    error = np.sqrt(square / cells.volumes) / size
    return {
        "condition": np.linalg.eigvalsh(poisson)[:, -1] / size,
        "elastic condition": np.linalg.eigvalsh(elastic)[:, -1] / size,
        "error": error,
        "elastic error": error,
        "steps": _frequency(poisson, cells.masses) * size,
        "elastic steps": _frequency(elastic, np.repeat(cells.masses, 3, axis=1)) * size,
    }


def _frequency(stiffness: Values, masses: Values) -> Values:
    """Highest of each cell."""
    scale = 1.0 / np.sqrt(masses)
    return np.sqrt(np.linalg.eigvalsh(stiffness * scale[:, :, None] * scale[:, None])[:, -1])


def assemble(cells: Ids, matrices: Values, n_points: int, size: int = 1) -> sparse.csc_matrix:
    """Matrices of cells, with ``size`` unknowns a node, as that of the mesh."""
    unknowns = (cells[:, :, None] * size + np.arange(size)).reshape(len(cells), -1)
    rows = np.broadcast_to(unknowns[:, :, None], matrices.shape)
    columns = np.broadcast_to(unknowns[:, None], matrices.shape)
    whole = (matrices.ravel(), (rows.ravel(), columns.ravel()))
    return sparse.coo_matrix(whole, shape=(n_points * size,) * 2).tocsc()


def mesh_losses(name: str, points: Values, cells: Ids, fixed: NDArray[np.bool_]) -> dict[str, float]:
    """What a mesh of one type costs: as `cell_losses`, with errors of the solution with quadratics on the boundary.

    Errors and steps are for cells of the mean volume 1, absolute: divide by those of another mesh.
    """
    n = len(points)
    points = points - points.mean(axis=0)
    of = Cells.of(name, points[cells])
    volume = float(of.volumes.sum())
    size = np.cbrt(volume / len(cells))
    poisson, elastic = of.stiffness()
    masses = np.bincount(cells.ravel(), of.masses.ravel(), n)
    slopes, exact = of.slopes(), quadratics(points)
    one = _Problem(assemble(cells, poisson, n), ~fixed)
    loads = _gathered(cells, np.einsum("mqia,mqpa,mq->mip", of.gradients, slopes, of.weights), n)
    solution = one.solve(exact, loads)
    errors = np.einsum("mqia,mip->mqpa", of.gradients, solution[cells]) - slopes
    square = np.einsum("mqpa,mqpa,mq,p->", errors, errors, of.weights, WEIGHTS)

    three = _Problem(assemble(cells, elastic, n, 3), np.repeat(~fixed, 3))
    # displacements e_c q: gradient H[c, b] = ∂_b q
    identity = np.eye(3)
    wanted = np.einsum("mqpb,dc->mqcpdb", slopes, identity)  # direction c, quadratic p, component d
    loads = np.einsum("mqib,mqcpdb,mq->midcp", of.gradients, _stress(wanted), of.weights)
    displacements = np.einsum("np,dc->ndcp", exact, identity)
    found = three.solve(
        displacements.reshape(3 * n, -1),
        _gathered(cells, loads.reshape(*cells.shape, -1), n).reshape(3 * n, -1),
    ).reshape(n, 3, 3, len(PAIRS))
    strains = np.einsum("mqib,midcp->mqcpdb", of.gradients, found[cells]) - wanted
    energy = np.einsum("mqcpdb,mqcpdb,mq,p->", strains, _stress(strains), of.weights, WEIGHTS)
    return {
        "condition": one.condition(),
        "elastic condition": three.condition(),
        "error": float(np.sqrt(square / volume) / size),
        "elastic error": float(np.sqrt(energy / volume) / size),
        "steps": one.frequency(masses) * size,
        "elastic steps": three.frequency(np.repeat(masses, 3)) * size,
    }


def _stress(gradient: Values) -> Values:
    """Of gradients of displacements, in the last two axes."""
    trace = np.einsum("...aa->...", gradient)
    return MU * (gradient + gradient.swapaxes(-1, -2)) + LAMBDA * trace[..., None, None] * np.eye(3)


def _gathered(cells: Ids, of_nodes: Values, n_points: int) -> Values:
    out = np.zeros((n_points, of_nodes.shape[-1]))
    np.add.at(out, cells.ravel(), of_nodes.reshape(-1, of_nodes.shape[-1]))
    return out


class _Problem:
    """A stiffness matrix with some unknowns free."""

    def __init__(self, matrix: sparse.csc_matrix, free: NDArray[np.bool_]) -> None:
        self.matrix, self.free = matrix, np.flatnonzero(free)
        self.inner = matrix[self.free][:, self.free].tocsc()
        self.factor = linalg.splu(self.inner)

    def solve(self, values: Values, loads: Values) -> Values:
        """Values that stay where they are fixed; loads are of all unknowns."""
        out = values.copy()
        out[self.free] += self.factor.solve((loads - self.matrix @ values)[self.free])
        return out

    def condition(self) -> float:
        inverse = linalg.LinearOperator(self.inner.shape, self.factor.solve, dtype=float)
        return float(_largest(self.inner) * _largest(inverse))

    def frequency(self, masses: Values) -> float:
        """The highest, no unknown fixed."""
        scale = sparse.diags(1.0 / np.sqrt(masses))
        return float(np.sqrt(_largest(scale @ self.matrix @ scale)))


def _largest(operator: sparse.spmatrix | linalg.LinearOperator) -> float:
    start = np.random.default_rng(0).random(operator.shape[0])
    return float(linalg.eigsh(operator, 1, which="LA", tol=1e-4, v0=start, return_eigenvectors=False)[0])
