"""A view as text: the part of an address after the ``#``, so that a link brings the same view back."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from urllib.parse import quote, unquote

from .camera import Camera
from .filters import AXES, Filters, Plane, ViewError

LONGEST = 20_000
"""Characters of a link that are read; names of regions can make it long."""


MOST_SHRUNK = 0.9
"""Of cells that are drawn apart."""


@dataclass(frozen=True, slots=True)
class View:
    """Everything that says what a scene shows."""

    filters: Filters = field(default_factory=Filters)
    camera: Camera | None = None  #: None: from where the whole mesh is seen
    cell: int | None = None  #: the cell that is picked
    mesh: int = 0  #: of which mesh: 0, or 1 for the second
    face: int | None = None  #: the face that is picked, of that mesh: its half-face in the topology
    edges: bool = True  #: whether the edges of cells are drawn
    colour: str = "quality"  #: by what cells are coloured: one of `Model.colourings`
    shrink: float = 0.0  #: by what share of itself each cell is drawn smaller, so that all are seen apart
    hollows: bool = True  #: whether hollows are darker than what stands out (ambient occlusion)

    def __post_init__(self) -> None:
        if not 0.0 <= self.shrink <= MOST_SHRUNK:
            raise ViewError(f"cells are to shrink by {self.shrink:g}, expected 0 to {MOST_SHRUNK:g}")


def fragment(view: View) -> str:
    """The view as text; what is as it is at the start is left out."""
    filters = view.filters
    parts: list[tuple[str, str]] = []
    if (filters.low, filters.high) != (-1.0, 1.0):
        parts.append(("quality", _numbers((filters.low, filters.high))))
    if not filters.undefined:
        parts.append(("undefined", "0"))
    for key, names in (("types", filters.types), ("status", filters.statuses), ("regions", filters.regions)):
        if names is not None:
            parts.append((key, ",".join(quote(name, safe=" ").replace(" ", "+") for name in sorted(names))))
    for plane in filters.planes:
        axis = next((name for name, axis in AXES.items() if axis == plane.normal), None)
        parts.append(("plane", f"{axis or _numbers(plane.normal)},{_numbers((plane.at,))}"))
    if filters.peel:
        parts.append(("peel", str(filters.peel)))
    if view.cell is not None:
        parts.append(("cell", f"{view.cell},{view.mesh}" if view.mesh else str(view.cell)))
    if view.face is not None:
        parts.append(("face", str(view.face)))
    if not view.edges:
        parts.append(("edges", "0"))
    if view.shrink:
        parts.append(("shrink", _numbers((view.shrink,))))
    if not view.hollows:
        parts.append(("hollows", "0"))
    if view.colour != "quality":
        parts.append(("colour", quote(view.colour, safe="")))
    if view.camera is not None:
        parts.append(("camera", _numbers((*view.camera.position, *view.camera.focus, *view.camera.up))))
    return "&".join(f"{key}={value}" for key, value in parts)


def view(link: str) -> View:
    """The view that a link, or its part after the ``#``, stands for.

    Raises
    ------
    ViewError
        If it is not understood.
    """
    text = link.rpartition("#")[2] if "#" in link else ("" if "://" in link else link)
    if len(text) > LONGEST:
        raise ViewError(f"a link of {len(text)} characters; {LONGEST} are read at most")
    state = View()
    for part in filter(None, text.split("&")):
        key, equals, value = part.partition("=")
        if key not in _READ or not equals:
            raise ViewError(f"{part[:60]!r} in a link is not understood; known are {', '.join(_READ)}")
        try:
            state = _READ[key](state, value)
        except ViewError:
            raise
        except ValueError as error:
            raise ViewError(f"{part[:60]!r} in a link is not understood") from error
    return state


def _numbers(values: Iterable[float]) -> str:
    return ",".join(f"{value:.7g}" for value in values)


def _floats(text: str, n: int) -> tuple[float, ...]:
    values = tuple(float(part) for part in text.split(","))
    if len(values) != n:
        raise ValueError(text)
    return values


def _names(text: str) -> frozenset[str]:
    return frozenset(unquote(name.replace("+", " ")) for name in text.split(",") if name)


def _flag(text: str) -> bool:
    if text not in ("0", "1"):
        raise ValueError(text)
    return text == "1"


def _plane(state: View, text: str) -> View:
    """One more plane."""
    parts = text.split(",")
    if parts[0] in AXES:
        plane = Plane(AXES[parts[0]], *_floats(",".join(parts[1:]), 1))
    else:
        x, y, z, at = _floats(text, 4)
        plane = Plane((x, y, z), at)
    return replace(state, filters=replace(state.filters, planes=(*state.filters.planes, plane)))


def _camera(text: str) -> Camera:
    n = _floats(text, 9)
    return Camera((n[0], n[1], n[2]), (n[3], n[4], n[5]), (n[6], n[7], n[8]))


def _cell(state: View, text: str) -> View:
    cell, _, mesh = text.partition(",")
    if int(cell) < 0 or mesh not in ("", "0", "1"):
        raise ValueError(text)
    return replace(state, cell=int(cell), mesh=int(mesh or 0))


def _face(state: View, text: str) -> View:
    if not text.isdecimal():
        raise ValueError(text)
    return replace(state, face=int(text))


def _filter(name: str, read: Callable[[str], object]) -> Callable[[View, str], View]:
    return lambda state, text: replace(state, filters=replace(state.filters, **{name: read(text)}))  # type: ignore[arg-type]


def _range(state: View, text: str) -> View:
    low, high = _floats(text, 2)
    return replace(state, filters=replace(state.filters, low=low, high=high))


_READ: dict[str, Callable[[View, str], View]] = {
    "quality": _range,
    "undefined": _filter("undefined", _flag),
    "types": _filter("types", _names),
    "status": _filter("statuses", _names),
    "regions": _filter("regions", _names),
    "plane": _plane,
    "peel": _filter("peel", int),
    "cell": _cell,
    "face": _face,
    "edges": lambda state, text: replace(state, edges=_flag(text)),
    "shrink": lambda state, text: replace(state, shrink=_floats(text, 1)[0]),
    "hollows": lambda state, text: replace(state, hollows=_flag(text)),
    "colour": lambda state, text: replace(state, colour=unquote(text)),
    "camera": lambda state, text: replace(state, camera=_camera(text)),
}
