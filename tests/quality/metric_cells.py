"""Random cells of every shape, the metrics that are defined for them, and an independent value of each."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import oracle
import pytest
from numpy.typing import NDArray

import meshgauge
from meshgauge.cells import SHAPES, Shape
from meshgauge.quality.metrics import METRICS, Metric

Floats = NDArray[np.float64]
OURS = [row for row in METRICS.values() if row.source == "meshgauge" and row.of_faces is None]
PAIRS = [(row, shape) for row in OURS for shape in SHAPES.values() if row.is_defined_for(shape.name)]

OF_CELLS = {name: row for name, row in METRICS.items() if row.of_faces is None}
"""Those that a cell has by itself."""

rows = pytest.mark.parametrize("row", METRICS.values(), ids=METRICS)
shapes = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)


def of_pairs(chosen: list[tuple[Metric, Shape]]) -> pytest.MarkDecorator:
    names = [f"{row.name}-{shape.name}" for row, shape in chosen]
    return pytest.mark.parametrize(("row", "shape"), chosen, ids=names)


pairs = of_pairs(PAIRS)
node_pairs = of_pairs([(row, shape) for row, shape in PAIRS if "node" in row.where])
signed_pairs = of_pairs([(row, shape) for row, shape in PAIRS if row.is_signed])
array_pairs = of_pairs([(row, shape) for row, shape in PAIRS if row.name in meshgauge.__all__])
"""Metrics that have a function on arrays."""

N = 400


def one_by_one(x: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Points and connectivity of cells that share no point."""
    return x.reshape(-1, 3), np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2])


def cell_values(row: Metric, shape: str, x: Floats, threads: int | None = 1) -> Floats:
    """The metric of each cell ``(n_cells, n_nodes, 3)``, measured on a mesh of them."""
    points, cells = one_by_one(np.asarray(x, float))
    mesh = meshgauge.Mesh.from_arrays(points, {shape: cells})
    return meshgauge.measure(mesh, metrics=row, threads=threads).values_of(row.name)


def public_values(row: Metric, shape: str, x: Floats, ids: NDArray[np.integer] | None = None) -> Floats:
    """The same, through the public function on arrays that has the metric's name."""
    points, cells = one_by_one(x)
    function: Callable[..., Floats] = getattr(meshgauge, row.name)
    return function(points, cells if ids is None else ids, *(() if row.shapes == ("tetra",) else (shape,)))


def node_values(row: Metric, shape: str, x: Floats) -> Floats:
    function: Callable[..., Floats] = getattr(meshgauge, row.name)
    return function(*one_by_one(np.asarray(x, float)), shape, nodes=True)


def random_cells(shape: Shape, n: int = N, seed: int = 0, noise: float = 0.8) -> Floats:
    return oracle.random_cells(shape.name, shape.points, n, seed, noise=noise)


def symmetries(shape: Shape) -> list[tuple[int, ...]]:
    """Renumberings of the nodes that map the outward faces on themselves: the cell's own rotations."""

    def canonical(face: tuple[int, ...]) -> tuple[int, ...]:
        at = face.index(min(face))
        return face[at:] + face[:at]

    faces = {canonical(face) for face in shape.faces}
    neighbours = {a: {b for edge in shape.edges if a in edge for b in edge if b != a} for a in range(shape.n_nodes)}
    found = []

    def extend(images: tuple[int, ...]) -> None:
        a = len(images)
        if a == shape.n_nodes:
            if {canonical(tuple(images[m] for m in face)) for face in shape.faces} == faces:
                found.append(images)
            return
        for image in set(range(shape.n_nodes)) - set(images):
            if all((images[b] in neighbours[image]) == (b in neighbours[a]) for b in range(a)):
                extend((*images, image))

    extend(())
    return found


def _shape(name: str, x: Floats) -> Floats:
    """The mean ratio of the worst corner, by singular values."""
    one = SHAPES[name]
    ideal = np.array(one.points)
    by_node: dict[int, list[Floats]] = {}
    for o, *ends in one.triples:
        w = ideal[ends] - ideal[o]
        d = x[:, ends] - x[:, [o]]
        m = np.linalg.solve(w / np.linalg.norm(w, axis=1, keepdims=True), d / np.abs(d).max(axis=(1, 2), keepdims=True))
        s = np.linalg.svd(m, compute_uv=False)
        ratio = 3 * s.prod(axis=1) ** (2 / 3) / (s**2).sum(axis=1)
        by_node.setdefault(o, []).append(np.sign(np.linalg.det(m)) * ratio)
    return oracle.fold(np.stack([oracle.fold(np.stack(values, axis=1)) for values in by_node.values()], axis=1))


def _edge_ratio(name: str, x: Floats) -> Floats:
    """Shortest over longest edge."""
    lengths = np.stack([np.linalg.norm(x[:, a] - x[:, b], axis=1) for a, b in SHAPES[name].edges])
    return lengths.min(axis=0) / lengths.max(axis=0)


def _warpage(name: str, x: Floats) -> Floats:
    """Verdict's, of the worst face, corner by corner."""
    worst = np.zeros(len(x))
    for face in (face for face in SHAPES[name].faces if len(face) == 4):
        p = x[:, list(face)]
        normals = [np.cross(p[:, n] - p[:, n - 1], p[:, (n + 1) % 4] - p[:, n]) for n in range(4)]
        n0, n1, n2, n3 = (normal / np.linalg.norm(normal, axis=1, keepdims=True) for normal in normals)
        both = np.minimum((n0 * n2).sum(axis=1) ** 3, (n1 * n3).sum(axis=1) ** 3)
        worst = np.maximum(worst, 1 - both)
    return worst


ORACLES: dict[str, Callable[[str, Floats], Floats]] = {
    "jens": oracle.cell_jens,
    "scaled_jacobian": oracle.cell_scaled_jacobian,
    "aspect_ratio_gamma": lambda _, x: 1 / oracle.scaled_aspect_ratio_gamma(x),
    "scaled_aspect_ratio_gamma": lambda _, x: oracle.scaled_aspect_ratio_gamma(x),
    "jens_mean": lambda name, x: oracle.node_jens(name, x).mean(axis=1),
    "shape": _shape,
    "edge_ratio": _edge_ratio,
    "warpage": _warpage,
}
"""An independent value of each metric of ours, by name."""


def oracle_nodes(row: Metric, shape: str, x: Floats) -> Floats:
    return (oracle.node_jens if row.name == "jens" else oracle.node_scaled_jacobian)(shape, x)
