"""Surfaces in space, and curved cells in a plane, whose points are moved at random along what they are on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from meshgauge import Mesh

Place = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, ...]]


def dome(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, ...]:
    return u, v, 0.3 * np.sin(3 * u) * np.cos(2 * v)


def cylinder(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, ...]:
    return np.cos(2 * np.pi * v), np.sin(2 * np.pi * v), 3 * u


def roof(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, ...]:
    """Two planes at right angles."""
    return np.minimum(u, 0.5), v, np.maximum(u - 0.5, 0.0)


def shell(n: int, place: Place, kind: str, noise: float, *, seed: int = 0, ridge: bool = False) -> Mesh:
    """``n`` by ``n`` cells over the unit square, closed in v if the surface is; with a ridge at u = 1/2 kept straight.

    Points inside are moved along the surface by up to so much of a cell, those on the ridge along it.
    """
    rng = np.random.default_rng(seed)
    i, j = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    is_closed = place is cylinder
    inside = (i > 0) & (i < n) & (is_closed | (j > 0) & (j < n))
    di, dj = rng.uniform(-noise, noise, (2, n + 1, n + 1))
    on_ridge = ridge & (2 * i == n)
    i, j = i + np.where(inside & ~on_ridge, di, 0.0), j + np.where(inside, dj, 0.0)
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    if is_closed:
        at[:, -1] = at[:, 0]
    points = np.stack(np.broadcast_arrays(*place(i / n, j / n)), axis=-1).reshape(-1, 3)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    used, quads = np.unique(quads, return_inverse=True)
    quads = quads.reshape(-1, 4)
    cells = quads if kind == "quad" else np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
    return Mesh.from_arrays(points[used], {kind: cells})


def curved(mesh: Mesh, kind: str, bulge: float, *, seed: int = 1) -> Mesh:
    """A mesh of triangles or quads in a plane with nodes on its edges, those inside moved by up to so much."""
    rng = np.random.default_rng(seed)
    n = 3 if kind.startswith("triangle") else 4
    cells, points = mesh.connectivity.reshape(-1, n), np.asarray(mesh.points)
    sides = [0, 2] if kind == "quad6" else range(n)
    ends = np.stack([np.sort(cells[:, [m, (m + 1) % n]], axis=1) for m in sides], axis=1).reshape(-1, 2)
    edges, of, counts = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    middles = points[edges].mean(axis=1)
    middles[:, :2] += np.where(counts[:, None] == 2, rng.uniform(-bulge, bulge, (len(edges), 2)), 0.0)
    columns = [cells, len(points) + of.reshape(len(cells), -1)]
    new = [points, middles]
    if kind in ("triangle7", "quad9"):
        columns.append(len(points) + len(edges) + np.arange(len(cells))[:, None])
        new.append(points[cells].mean(axis=1))
    return Mesh.from_arrays(np.concatenate(new), {kind: np.concatenate(columns, axis=1)})
