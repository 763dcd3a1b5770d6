"""Meshes of surfaces in which everything occurs that may be wrong with them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from meshgauge import Mesh


def surface(
    *, height: float = 0.0, turned: float = 0.0, mirrored: bool = False, more: str = "", shuffled: bool = False
) -> Mesh:
    """Quads, triangles, polygons and pixels side by side, some of them the other way round, and what ``more`` says."""
    random, n = np.random.default_rng(7), 12
    i = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    points = np.stack([*np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij"), np.zeros(i.shape)], -1)
    points = points.reshape(-1, 3)
    points[:, :2] += random.normal(size=(len(points), 2)) * 0.25
    points[:, 2] = height * np.sin(points[:, 0])
    points[:, 1] *= -1 if mirrored else 1
    cells: list[tuple[int, np.ndarray]] = []
    for k, c in enumerate(np.stack([i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]], -1).reshape(-1, 4)):
        split = [(5, c[[0, 1, 2]]), (5, c[[0, 2, 3]])]
        cells += [[(9, c)], split, [(7, c)], [(8, c[[0, 1, 3, 2]])], [(9, c)]][k % 5]
    cells = [(t, c[::-1] if t != 8 and random.random() < turned else c) for t, c in cells]
    if "twice" in more:
        cells += cells[10:20]
    if "three" in more:
        points, cells = np.vstack([points, [[3.0, 3, 5]]]), [*cells, (5, np.array([i[3, 3], i[3, 4], len(points)]))]
    if "strip" in more:  # with a half turn
        at = np.linspace(0, 2 * np.pi, 40, endpoint=False)
        wide = np.array([[-0.3, 0.3]])
        out, up = 3 + wide * np.cos(at / 2)[:, None], wide * np.sin(at / 2)[:, None]
        strip = np.stack([out * np.cos(at)[:, None], out * np.sin(at)[:, None], up], -1).reshape(-1, 3) + 50
        rows = [(2 * k, *((2 * k + 2, 2 * k + 3) if k < 39 else (1, 0)), 2 * k + 1) for k in range(40)]
        cells += [(9, len(points) + np.array(row)) for row in rows]
        points = np.vstack([points, strip])
    if "hanging" in more:  # cells of twice the size along one side
        points[i[n]] = np.stack([np.full(n + 1, n), np.arange(n + 1), np.zeros(n + 1)], -1)
        b = len(points)
        cells += [(9, np.array([i[n, 2 * k], b + k, b + k + 1, i[n, 2 * k + 2]])) for k in range(n // 2)]
        points = np.vstack([points, points[i[n, ::2]] + [3, 0, 0]])
    if "book" in more:  # three pages at an edge; of the second the first cell runs against the others
        spine = len(points)
        points = np.vstack([points, [[30.0, 0, 0], [30, 1, 0]]])
        for length, out, first in ((3, (1, 0, 0), 1), (8, (-1, 0, 0), -1), (1, (0, 0, 1), 1)):
            edge = (spine, spine + 1)
            for k in range(1, length + 1):
                after = (len(points), len(points) + 1)
                points = np.vstack([points, points[[spine, spine + 1]] + np.multiply(out, k)])
                ring = np.array([*edge, *after[::-1]])
                cells.append((9, ring[::-1] if k == 1 and first < 0 else ring))
                edge = after
    if "island" in more:  # of its own, all of it the other way round
        points = np.vstack([points, [[40.0, 0, 0], [41, 0, 0], [41, 1, 0], [40, 1, 0]]])
        cells.append((9, np.arange(len(points))[[-1, -2, -3, -4]]))
    if "double" in more:
        cells += [(t, c + len(points)) for t, c in cells[:30]]
        points = np.vstack([points, points])
    if "repeated" in more:
        cells[3:5] = [(9, np.array([0, 1, 1, 2])), (5, np.array([4, 4, 4]))]
    if "lines" in more:
        cells = [*cells[:9], (3, np.array([0, 1])), *cells[9:], (1, np.array([5]))]
    cells = [cells[at] for at in random.permutation(len(cells))] if shuffled else cells
    is_ghost = (random.random(len(cells)) < (0.1 if "ghosts" in more else 0.0)).astype(np.uint8)
    return Mesh(
        points=points,
        types=np.array([t for t, _ in cells], np.uint8),
        offsets=np.concatenate([[0], np.cumsum([len(c) for _, c in cells])]),
        connectivity=np.concatenate([c for _, c in cells]),
        cell_data={"vtkGhostType": is_ghost} if "ghosts" in more else {},
    )


SURFACES: dict[str, Callable[[], Mesh]] = {
    "in a plane": surface,
    "from below": lambda: surface(mirrored=True),
    "some turned": lambda: surface(turned=0.1, shuffled=True),
    "most turned": lambda: surface(turned=0.8),
    "in space": lambda: surface(height=0.4),
    "in space, some turned": lambda: surface(height=0.4, turned=0.1, shuffled=True),
    "twice": lambda: surface(more="twice", shuffled=True),
    "an island": lambda: surface(more="island"),
    "twice, and turned": lambda: surface(turned=0.8, more="twice"),
    "pages at an edge": lambda: surface(height=0.4, more="book"),
    "three at an edge": lambda: surface(height=0.4, more="three"),
    "no two sides": lambda: surface(more="strip"),
    "no two sides, turned": lambda: surface(height=0.4, turned=0.1, more="strip"),
    "hanging in a plane": lambda: surface(more="hanging"),
    "double points": lambda: surface(more="double"),
    "a point twice": lambda: surface(more="repeated"),
    "with lines": lambda: surface(more="lines"),
    "some are ghosts": lambda: surface(more="ghosts", shuffled=True),
    "all of it": lambda: surface(
        height=0.4, turned=0.1, more="twice three strip hanging double repeated lines ghosts", shuffled=True
    ),
}
