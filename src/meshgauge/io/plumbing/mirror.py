"""The nodes of a solid as seen in a mirror that exchanges its first two directions; node 0 stays where it is."""

from __future__ import annotations

from functools import cache

from ...cells import BY_NAME, Place


def mirror_places(places: tuple[Place, ...]) -> tuple[Place, ...]:
    """Places of nodes in the reference cell, its first two coordinates exchanged."""
    return tuple((s, r, t) for r, s, t in places)


def order(ours: tuple[Place, ...], theirs: tuple[Place, ...]) -> tuple[int, ...]:
    """For each of our nodes the position of the node in the same place of theirs."""
    at = {place: node for node, place in enumerate(theirs)}
    return tuple(at[place] for place in ours)


@cache
def mirror(name: str) -> tuple[int, ...] | None:
    """For each node of a solid, the node that comes to its place; its own inverse. None where it is not known."""
    row = BY_NAME[name]
    if not row.places or row.n_nodes is None:
        return None
    places = row.places[: row.n_nodes]
    return order(places, mirror_places(places))
