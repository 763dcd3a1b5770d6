"""Cases of OpenFOAM with hanging nodes, and their pieces as decomposePar leaves them."""

from __future__ import annotations

import gzip
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

N = 4
"""Small cells along each axis."""

FaceOf = tuple[tuple[int, ...], int, int, str]
"""Points, owner, neighbour or -1, patch or nothing."""


@dataclass(frozen=True)
class Case:
    """A mesh by its faces; the first points of each out of its owner."""

    points: np.ndarray
    faces: list[FaceOf]
    n_cells: int


def refined(seed: int = 0, noise: float = 0.04) -> Case:
    """A cube of which a half is of cells of twice the size: those beside the others have hanging nodes."""
    index = np.arange((N + 1) ** 3).reshape((N + 1,) * 3)
    cell_of: dict[tuple[int, ...], int] = {}  # of each small cube
    seen: dict[tuple[int, ...], int] = {}
    for at in itertools.product(range(N), repeat=3):
        key = tuple(x // 2 * 2 for x in at) if at[0] < N // 2 else (*at, 1)
        cell_of[at] = seen.setdefault(key, len(seen))
    small: dict[tuple[int, int, int, int], list[tuple[tuple[int, ...], int]]] = {}  # faces between two cells, by plane
    for at in cell_of:
        for axis in range(3):
            for side in (0, 1):
                beside = tuple(x + (side * 2 - 1) * (a == axis) for a, x in enumerate(at))
                own, other = cell_of[at], cell_of.get(beside, -1)
                if own == other or (other >= 0 and other < own):
                    continue
                key = (own, other, axis, side)
                small.setdefault(key, []).append((at, at[axis] + side))
    used = set()
    rings = []
    for (own, other, axis, side), squares in small.items():
        low, high = (np.array([f([at[a] for at, _ in squares]) for a in range(3)]) for f in (min, max))
        high = high + 1
        low[axis] = high[axis] = squares[0][1]
        rings.append((own, other, axis, side, low, high))
        a, b = (k for k in range(3) if k != axis)
        for x, y in itertools.product((low[a], high[a]), (low[b], high[b])):
            corner = low.copy()
            corner[a], corner[b] = x, y
            used.add(int(index[tuple(corner)]))
    faces: list[FaceOf] = []
    for own, other, axis, side, low, high in rings:
        a, b = (axis + 1) % 3, (axis + 2) % 3
        walk = [(x, low[b]) for x in range(low[a], high[a])] + [(high[a], y) for y in range(low[b], high[b])]
        walk += [(x, high[b]) for x in range(high[a], low[a], -1)] + [(low[a], y) for y in range(high[b], low[b], -1)]
        ring = []
        for x, y in walk if side else walk[::-1]:
            corner = low.copy()
            corner[a], corner[b] = x, y
            point = int(index[tuple(corner)])
            if point in used:
                ring.append(point)
        patch = "" if other >= 0 else "inlet" if axis == 0 and not side else "walls"
        faces.append((tuple(ring), own, other, patch))
    xyz = np.stack(np.meshgrid(*[np.arange(N + 1.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    kept = np.array(sorted(used))
    rank = {int(point): at for at, point in enumerate(kept)}
    xyz = xyz[kept] + np.random.default_rng(seed).normal(size=(len(kept), 3)) * noise
    faces = [(tuple(rank[p] for p in ring), own, other, patch) for ring, own, other, patch in faces]
    return Case(xyz, sorted(faces, key=lambda one: (one[2] < 0, one[3], one[1], one[2])), len(seen))


def _list(items: Iterable[str], kind: str, name: str) -> str:
    rows = list(items)
    head = f"FoamFile\n{{ version 2.0; format ascii; class {kind}; object {name}; }}\n"
    return head + f"{len(rows)}\n(\n" + "\n".join(rows) + "\n)\n"


def write(folder: Path, points: np.ndarray, faces: Sequence[FaceOf], *, packed: bool = False) -> None:
    """A polyMesh; faces of one patch follow one another, those called ``processor...`` lie between pieces."""
    mesh = folder / "constant" / "polyMesh"
    mesh.mkdir(parents=True)
    texts = {
        "points": _list((f"({x!r} {y!r} {z!r})" for x, y, z in points.tolist()), "vectorField", "points"),
        "faces": _list((f"{len(ring)}({' '.join(map(str, ring))})" for ring, *_ in faces), "faceList", "faces"),
        "owner": _list((str(own) for _, own, _, _ in faces), "labelList", "owner"),
        "neighbour": _list((str(other) for _, _, other, _ in faces if other >= 0), "labelList", "neighbour"),
    }
    patches, at = [], 0
    for patch, own in itertools.groupby(faces, key=lambda one: one[3]):
        n = len(list(own))
        kind = "processor" if patch.startswith("processor") else "patch"
        if patch:
            patches.append(f"{patch} {{ type {kind}; nFaces {n}; startFace {at}; }}")
        at += n
    texts["boundary"] = _list(patches, "polyBoundaryMesh", "boundary")
    for name, text in texts.items():
        if packed and name != "boundary":
            (mesh / f"{name}.gz").write_bytes(gzip.compress(text.encode()))
        else:
            (mesh / name).write_text(text)


def decompose(folder: Path, case: Case, part: np.ndarray, *, packed: bool = False, has_ids: bool = True) -> None:
    """A folder for each part of the cells, as decomposePar leaves them; points in no order of theirs."""
    for number in range(int(part.max()) + 1):
        local = np.cumsum(part == number) - 1
        own: list[FaceOf] = []
        for ring, owner, other, patch in case.faces:
            if part[owner] == number and other >= 0 and part[other] == number:
                own.append((ring, int(local[owner]), int(local[other]), ""))
            elif part[owner] == number:
                own.append((ring, int(local[owner]), -1, patch or f"processor{number}to{part[other]}"))
            elif other >= 0 and part[other] == number:
                own.append((ring[::-1], int(local[other]), -1, f"processor{number}to{part[owner]}"))
        own.sort(key=lambda one: (one[2] < 0, one[3].startswith("processor"), one[3], one[1], one[2]))
        ids = np.unique(np.concatenate([ring for ring, *_ in own]))
        ids = np.random.default_rng(number).permutation(ids)
        rank = {int(point): at for at, point in enumerate(ids)}
        faces = [(tuple(rank[p] for p in ring), *rest) for ring, *rest in own]
        processor = folder / f"processor{number}"
        write(processor, case.points[ids], faces, packed=packed)  # type: ignore[arg-type]
        if has_ids:
            text = _list(map(str, ids.tolist()), "labelList", "pointProcAddressing")
            (processor / "constant" / "polyMesh" / "pointProcAddressing").write_text(text)
