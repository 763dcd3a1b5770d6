"""Coordinate systems of Nastran: rectangular, cylindrical and spherical ones, defined in one another or by points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from .cards import Card

Reals = NDArray[np.float64]
KINDS = ("CORD2R", "CORD2C", "CORD2S", "CORD1R", "CORD1C", "CORD1S")


@dataclass(frozen=True, slots=True, eq=False)
class System:
    """An origin and the axes x, y, z as rows, in the basic system; the letter says how coordinates are meant."""

    letter: str
    origin: Reals
    axes: Reals

    def basic(self, given: Reals) -> Reals:
        """Points ``(n, 3)`` in the basic system."""
        own = given.copy()
        if self.letter == "C":  # r, degrees, z
            angle = np.radians(given[:, 1])
            own[:, 0], own[:, 1] = given[:, 0] * np.cos(angle), given[:, 0] * np.sin(angle)
        elif self.letter == "S":  # r, degrees from z, degrees about z
            theta, phi = np.radians(given[:, 1]), np.radians(given[:, 2])
            own[:, 0] = given[:, 0] * np.sin(theta) * np.cos(phi)
            own[:, 1] = given[:, 0] * np.sin(theta) * np.sin(phi)
            own[:, 2] = given[:, 0] * np.cos(theta)
        x, y, z = own.T[:, :, None] * self.axes[:, None]  # not as a matrix: a point alone is rounded as among others
        return np.asarray(self.origin + (x + y + z))

    def own(self, points: Reals, near: Reals) -> Reals:
        """Points of the basic system in this one, ``(n, 3)``; angles within half a turn of those that are near."""
        x, y, z = self.axes @ (points - self.origin).T
        if self.letter == "R":
            return np.stack([x, y, z], axis=1)
        flat = np.hypot(x, y)
        turn = np.degrees(np.arctan2(y, x))
        if self.letter == "C":
            return np.stack([flat, turn + 360.0 * np.round((near[:, 1] - turn) / 360.0), z], axis=1)
        turn += 360.0 * np.round((near[:, 2] - turn) / 360.0)
        return np.stack([np.hypot(flat, z), np.degrees(np.arctan2(flat, z)), turn], axis=1)


class Systems:
    """All systems of a file, resolved when they are asked for: each may refer to others, or to points.

    Parameters
    ----------
    cards
        The card of each system by its number, and the place of its first field: two may stand on one card.
    point
        Gives a point of a number in the basic system.
    """

    def __init__(self, cards: dict[int, tuple[Card, int]], point: Callable[[int, Card], Reals]) -> None:
        self.cards, self.point = cards, point
        self.known = {0: System("R", np.zeros(3), np.eye(3))}
        self.open: set[int] = set()

    def of(self, number: int, asks: Card) -> System:
        """The system of a number.

        Raises
        ------
        ReadError
            If there is none, it refers to itself, or its three points are on one line.
        """
        if number in self.known:
            return self.known[number]
        if number not in self.cards:
            raise asks.fail(f"refers to the coordinate system {number}, which does not exist")
        card, place = self.cards[number]
        if number in self.open:
            raise card.fail(f"{number} refers to itself")
        self.open.add(number)
        if card.name.startswith("CORD1"):
            a, b, c = (self.point(card.integer(place + k), card) for k in (1, 2, 3))
        else:
            reference = self.of(card.integer(1, 0), card)
            a, b, c = reference.basic(np.array([[card.real(2 + 3 * k + i) for i in range(3)] for k in range(3)]))
        self.open.discard(number)
        self.known[number] = System(card.name[5], a, _axes(a, b, c, card))
        return self.known[number]


def _axes(a: Reals, b: Reals, c: Reals, card: Card) -> Reals:
    """Axes of a system with its origin in a, b on its z axis and c in its plane of x and z."""
    z, side = b - a, c - a
    y = np.cross(z, side)
    lengths = float(np.linalg.norm(z)), float(np.linalg.norm(y))
    if not (np.isfinite(lengths).all() and min(lengths) > 0):
        raise _flat(card)
    z, y = z / lengths[0], y / lengths[1]
    return np.stack([np.cross(y, z), y, z])


def _flat(card: Card) -> ReadError:
    return card.fail("has three points on one line")
