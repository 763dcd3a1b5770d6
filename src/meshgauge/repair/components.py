"""Connected components, by arrays."""

from __future__ import annotations

import numpy as np

from .problem import Ids


def components(n: int, a: Ids, b: Ids) -> Ids:
    """``(n,)`` for each item its component, numbered from 0, where a and b belong together."""
    parent = np.arange(n)
    while True:
        ra, rb = parent[a], parent[b]
        low, high = np.minimum(ra, rb), np.maximum(ra, rb)
        if np.array_equal(low, high):
            break
        np.minimum.at(parent, high, low)
        while not np.array_equal(parent, jumped := parent[parent]):
            parent = jumped
    return np.unique(parent, return_inverse=True)[1].reshape(-1)
