"""Meshes, and what the tests read in pages."""

from __future__ import annotations

import base64
import gzip
from pathlib import Path
from typing import Any

import numpy as np

import meshgauge
from meshgauge.report import html
from meshgauge.report.html.pack import NAMES

ROOT = Path(__file__).resolve().parents[3]
BRACKET = "examples/meshes/bracket.vtu"


def unpacked(section: html.Section) -> dict[str, np.ndarray[Any, Any]]:
    """The arrays of a section, as the script reads them."""
    assert section.model is not None
    raw = gzip.decompress(base64.b64decode(section.geometry))
    dtypes = {name: np.dtype(f"<{code}") for code, name in NAMES.items()}
    found, at = {}, 0
    for row in section.model["layout"]:
        dtype = dtypes[row["type"]]
        size = row["n"] * dtype.itemsize
        planes = np.frombuffer(raw[at : at + size], np.uint8).reshape(dtype.itemsize, -1)
        found[row["name"]] = np.ascontiguousarray(planes.T).view(dtype).reshape(-1)
        at += size
    assert at == len(raw)
    return found


def grid(n: int) -> meshgauge.Mesh:
    """n³ cubes."""
    i = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    points = np.stack(np.unravel_index(i.ravel(), i.shape), 1).astype(float)
    low = [i[:-1, :-1, :-1], i[1:, :-1, :-1], i[1:, 1:, :-1], i[:-1, 1:, :-1]]
    high = [i[:-1, :-1, 1:], i[1:, :-1, 1:], i[1:, 1:, 1:], i[:-1, 1:, 1:]]
    return meshgauge.Mesh.from_arrays(points, [("hexahedron", np.stack(low + high, -1).reshape(-1, 8))])


EVIL = "</script><script>alert(1)</script>\"'<img src=x onerror=alert(1)>&amp;\u2028\udce9"


def evil(quality: meshgauge.Quality) -> html.Section:
    names = np.array(["plain", EVIL])[np.arange(quality.n_cells) % 2]
    mesh = quality.mesh.replace(cell_data={"material": names}, path=EVIL, notes=(EVIL,))
    return html.section(meshgauge.Quality(mesh, quality.values, quality.status, quality.metrics))
