"""The nodes of a CGNS file in HDF5: each is a group with a label, a name and an array called " data"."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ...plumbing.budget import DENSEST


class Node:
    """One node.

    Parameters
    ----------
    group
        Of h5py.
    size
        Bytes of the file: no array is read that such a file cannot hold.
    """

    def __init__(self, group: Any, size: int) -> None:
        self.group, self.size = group, size
        self.name = str(group.name).rsplit("/", 1)[-1]

    def fail(self, what: str) -> ReadError:
        return ReadError(f"{str(self.group.name).lstrip('/')}: {what}")

    @property
    def label(self) -> str:
        value = self.group.attrs.get("label", b"")
        return value.decode("ascii", "replace") if isinstance(value, bytes) else str(value)

    def children(self, label: str) -> Iterator[Node]:
        """Those of a label, in the order in which they were made where the file has it."""
        import h5py

        for key in self.group:
            if key.startswith(" ") or not isinstance(self.group.get(key), h5py.Group):
                continue
            child = Node(self.group[key], self.size)
            if child.label == label:
                yield child

    def child(self, name: str) -> Node | None:
        import h5py

        return Node(self.group[name], self.size) if isinstance(self.group.get(name), h5py.Group) else None

    def first(self, label: str) -> Node | None:
        return next(self.children(label), None)

    def array(self) -> Any:
        """The data set of h5py, its axes in the opposite order of CGNS's, so that the first index runs fastest."""
        data = self.group.get(" data")
        if data is None or not hasattr(data, "shape"):
            raise self.fail("has no array")
        return data

    def values(self) -> NDArray[Any]:
        """What is in `array`."""
        data = self.array()
        if math.prod(data.shape) * data.dtype.itemsize > self.size * DENSEST:
            raise self.fail(f"states an array of shape {data.shape}, which a file of {self.size} bytes cannot hold")
        return np.asarray(data[...])

    def integers(self) -> NDArray[np.int64]:
        """All numbers in a row."""
        values = self.values()
        if values.dtype.kind not in "iu":
            raise self.fail(f"is of type {values.dtype}, expected integers")
        return values.ravel().astype(np.int64)

    def text(self) -> str:
        """The characters; none of a node without an array, as some programs write empty names."""
        if self.group.get(" data") is None:
            return ""
        values = self.values()
        raw = values.astype(np.uint8).tobytes() if values.dtype.kind in "iu" else b"".join(values.ravel().tolist())
        return raw.split(b"\0")[0].decode("utf-8", "replace").strip()
