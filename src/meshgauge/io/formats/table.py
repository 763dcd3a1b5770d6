"""Every format, a row each, in the order in which they are asked whether a file is theirs.

A format is loaded when a file has one of its extensions, or when that of all others fails: loading all of them takes
longer than reading a small mesh.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib import import_module

from ..plumbing.format import Format

_ROWS: tuple[tuple[str, str, str], ...] = (
    ("collection", "PVD", ".pvd"),  # before VTK's others, whose mark it has
    ("vtk.xml", "VTU", ".vtu"),
    ("vtk.xml", "VTK_XML", ".pvtu .vtm .vtmb .vtpd .vtpc .vts .vtr .vti .pvtp .pvts .pvtr .pvti"),
    ("vtk.polydata", "VTP", ".vtp"),
    ("vtk.legacy", "VTK_LEGACY", ".vtk"),
    ("vtk.hdf", "VTKHDF", ".vtkhdf .hdf"),
    ("gmsh.format", "GMSH", ".msh"),
    ("medit.format", "MEDIT", ".mesh .meshb"),
    ("med.read", "MED", ".med"),
    ("mfem.read", "MFEM", ".mesh"),
    ("nastran.read", "NASTRAN", ".bdf .fem .nas .nastran .dat .blk .pch"),
    ("exodus", "EXODUS", ".exo .e .ex2 .exii"),
    ("cgns.read", "CGNS", ".cgns"),
    ("su2.read", "SU2", ".su2"),
    ("abaqus.format", "ABAQUS", ".inp"),
    ("ansys.read", "ANSYS", ".cdb"),
    ("tetgen", "RF", ".ele .node"),
    ("tetgen", "TETGEN", ".ele .node"),
    ("unv", "UNV", ".unv"),
    ("ugrid", "UGRID", ".ugrid"),
    ("fluent.read", "FLUENT", ".cas .msh"),
    ("openfoam.format", "OPENFOAM", ".foam"),
    ("hedra", "HEDRA", ".hedra"),
    ("ovm.read", "OVM", ".ovm .ovmb"),
    ("ensight", "ENSIGHT", ".case"),
    ("collection", "SERIES", ".series"),
    ("xdmf", "XDMF", ".xdmf .xmf .xdmf3"),
    ("gambit", "GAMBIT", ".neu"),
    ("mdpa", "MDPA", ".mdpa"),
    ("others", "OTHERS", ".dat .tec .plt .stl .ply .obj .inp .avs .ucd .h5m .vol .xml .f3grid .post .dato .off"),
    ("lsdyna.read", "LSDYNA", ".k .key .dyn"),
    ("tecplot_binary", "TECPLOT_BINARY", ".plt"),
    ("elmer", "ELMER", ".header .nodes .elements .boundary"),
    ("plot3d", "PLOT3D", ".xyz .p3d .x .g"),
    ("femap", "FEMAP", ".neu"),
    ("frontistr", "FRONTISTR", ".msh"),
    ("plusplus", "PLUSPLUS", ".feb .frd .mphtxt .mail .pat .xda .rad"),
)
"""Module below this folder, the format or formats in it, all of their extensions. Where formats share an extension or
a mark, the first that takes the file has it."""


@cache
def every() -> tuple[Format, ...]:
    """All formats."""
    return tuple(one for module, name, _ in _ROWS for one in _load(module, name))


@cache
def by_name() -> dict[str, Format]:
    """All formats, by name."""
    return {one.name: one for one in every()}


def extensions() -> frozenset[str]:
    """All extensions, in lower case and with the dot; no format is loaded."""
    return frozenset(one for *_, text in _ROWS for one in text.split())


def of_extension(extension: str) -> tuple[Format, ...]:
    """The formats of an extension, in lower case and with the dot."""
    here = (_load(module, name) for module, name, extensions in _ROWS if extension in extensions.split())
    return tuple(one for formats in here for one in formats if extension in one.extensions)


def _load(module: str, name: str) -> Iterator[Format]:
    given: Format | tuple[Format, ...] = getattr(import_module(f".{module}", __package__), name)
    yield from (given,) if isinstance(given, Format) else given
