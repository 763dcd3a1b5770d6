"""Meshes of any size: repaired in a unit of their own, a power of two of what they are given in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..doctor.points import size
from ..mesh import Mesh
from .report import Displacement, RepairReport

USUAL = 40
"""Meshes whose size is between 2 to minus this power and 2 to this power are repaired as they are."""

SAMPLE = 20_000
"""Points that are looked at for the size of a mesh."""

Points = NDArray[np.float64]


def power_of(mesh: Mesh) -> int:
    """The power of two by which the points of a mesh are to be multiplied: 0 unless it is very small or very large.

    Energies hold lengths to the sixth power, which 1e-60 and 1e60 already take out of range.
    """
    return power_of_sample(np.asarray(mesh.points[:: max(mesh.n_points // SAMPLE, 1)], np.float64))


def power_of_sample(sample: Points) -> int:
    """The same from evenly spaced points of a mesh."""
    with np.errstate(over="ignore", under="ignore"):
        exponent = int(np.frexp(size(np.ldexp(sample, -2)))[1]) + 2
    return 0 if abs(exponent) <= USUAL else -exponent


def scaled(mesh: Mesh, power: int) -> Mesh:
    """The mesh with its points multiplied by 2 to a power."""
    return mesh.replace(points=np.ldexp(np.asarray(mesh.points, np.float64), power))


def restored(given: Mesh, moved: Mesh, power: int) -> Mesh:
    """A mesh made from one that was `scaled` back in the unit of that given; points that did not move are its own."""
    points = np.ldexp(np.asarray(moved.points, np.float64), -power)
    if moved.n_points == given.n_points:
        was = np.asarray(given.points, np.float64)
        stays = (np.ldexp(was, power) == moved.points) | np.isnan(was)
        points = np.where(stays, was, points)  # numbers too small for the other unit have lost digits on the way
    return moved.replace(points=points)


def rescaled(report: RepairReport, power: int) -> RepairReport:
    """The report in the unit of the mesh given; lengths, areas and volumes beyond all numbers are infinite."""

    def times(values: tuple[float, float], dimension: int) -> tuple[float, float]:
        with np.errstate(over="ignore"):
            first, second = np.ldexp(values, -dimension * power).tolist()
        return first, second

    way: Displacement = report.displacement
    largest, mean = times((way.largest, way.mean), 1)
    at_boundary, _ = times((way.boundary_largest, 0.0), 1)
    off, off_mean = times((way.deviation, way.deviation_mean), 1)
    return replace(
        report,
        displacement=replace(
            way, largest=largest, mean=mean, boundary_largest=at_boundary, deviation=off, deviation_mean=off_mean
        ),
        volume=times(report.volume, 3),
        surface=times(report.surface, 2),
        region_volumes={name: times(pair, 3) for name, pair in report.region_volumes.items()},
    )
