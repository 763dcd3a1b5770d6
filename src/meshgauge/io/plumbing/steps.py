"""Time steps: which a file holds, which one is read, and the deformed shape of a step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ...mesh import Mesh

StepChoice = int | Literal["first", "last"] | None
"""Which time step: its number, from 1; None reads the first and leaves a note."""


@dataclass(frozen=True, slots=True)
class Step:
    """One time step of a file.

    Attributes
    ----------
    number
        Its place in the file, from 1.
    time
        What the file says of its time; None if nothing.
    name
        What the format calls it, where that is no number.
    geometry
        Steps with the same number have the same points and cells, and differ in data only.
    """

    number: int
    time: float | None = None
    name: str = ""
    geometry: int = 0

    def __str__(self) -> str:
        what = self.name or (f"time {self.time:.10g}" if self.time is not None else "")
        return f"step {self.number}{f' ({what})' if what else ''}"


def number_steps(
    times: Sequence[float | None], *, names: Sequence[str] | None = None, geometries: Sequence[object] | None = None
) -> tuple[Step, ...]:
    """Steps in their order; ``geometries`` are equal where points and cells are the same, all differ if None."""
    known: dict[object, int] = {}
    keys = geometries if geometries is not None else range(len(times))
    return tuple(
        Step(number, time, names[number - 1] if names else "", known.setdefault(key, len(known)))
        for number, (time, key) in enumerate(zip(times, keys, strict=True), 1)
    )


def position(steps: Sequence[Step], choice: StepChoice, path: Path) -> int:
    """The index of a step that is asked for.

    Raises
    ------
    ReadError
        If there is no such step.
    """
    n = max(len(steps), 1)
    if choice is None or choice == "first":
        return 0
    if choice == "last":
        return n - 1
    if isinstance(choice, bool) or not isinstance(choice, int):
        raise ReadError(f"{path}: step is {choice!r}, expected 'first', 'last' or a number from 1")
    if not 1 <= choice <= n:
        held = f"holds {n} time steps" if n > 1 else "holds one state"
        raise ReadError(f"{path}: {held}, step {choice} is not among them")
    return choice - 1


def note(steps: Sequence[Step], at: int, choice: StepChoice) -> tuple[str, ...]:
    """A sentence on which of several steps was read."""
    if len(steps) < 2:
        return ()
    which = str(steps[at])
    if choice is None:
        which = f"the first{which[len('step 1') :]}"
    return (f"The file holds {len(steps)} time steps; {which} was read.",)


_SUFFIXES = tuple(
    tuple(f"{separator}{letter}" for letter in letters) for separator in ("_", "", ":", " ", ".") for letters in
    ("xyz", "XYZ", "123", "012")
)  # fmt: skip


def displace(mesh: Mesh, name: str) -> Mesh:
    """The mesh with its points moved by point data: vectors, or scalars of that name with ``_x``, ``_y``, ``_z``.

    Raises
    ------
    ReadError
        If there are no such data; the message names those that could be meant.
    """
    moved = _vectors(mesh, name)
    if moved is None:
        known = ", ".join(_candidates(mesh)) or "no vectors on points"
        raise ReadError(f"{mesh.path}: has no displacement {name!r}; it has {known}")
    points = np.asarray(mesh.points, np.float64) + moved
    return mesh.replace(points=points, notes=(*mesh.notes, f"The points are displaced by {name!r}."))


def _vectors(mesh: Mesh, name: str) -> NDArray[np.float64] | None:
    data = mesh.point_data
    values = data.get(name)
    if values is not None and _is_vector(values):
        return _three(values)
    for letters in _SUFFIXES:
        columns = [data[name + letter] for letter in letters if name + letter in data]
        if len(columns) >= 2 and all(c.ndim == 1 and c.dtype.kind in "fiu" for c in columns):
            return _three(np.stack(columns, axis=1))
    return None


def _is_vector(values: NDArray[np.generic]) -> bool:
    return values.ndim == 2 and values.shape[1] in (2, 3) and values.dtype.kind in "fiu"


def _three(values: NDArray[np.generic]) -> NDArray[np.float64]:
    return np.pad(values.astype(np.float64), ((0, 0), (0, 3 - values.shape[1])))


def _candidates(mesh: Mesh) -> list[str]:
    """Names of point data that could be displacements."""
    names = [name for name, values in mesh.point_data.items() if _is_vector(values)]
    for letters in _SUFFIXES:
        stems = {name[: -len(letters[0])] for name in mesh.point_data if name.endswith(letters[0])}
        stems -= {stem for stem in stems if not stem or not stem[-1].isalnum()}
        names += [stem for stem in sorted(stems) if stem not in names and _vectors(mesh, stem) is not None]
    return names
