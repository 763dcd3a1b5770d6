"""Where the coordinates of each point stand in a file, and a copy of it with other numbers in their places."""

from __future__ import annotations

import gzip
import itertools
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ...files.hunks import Hunks
from ...mesh import Mesh
from ...mesh.labels import labels_of
from .numerals import Form, Ints, Raw, Reals, Writing

GZIP = b"\x1f\x8b"
_NONE, _NO_LINES, _NO_SPANS = np.empty(0, np.int64), np.empty((0, 2), np.int64), np.empty((0, 3), np.int64)


@dataclass(frozen=True, eq=False)
class Places:
    """Where the coordinates of points stand.

    Attributes
    ----------
    pieces
        The files, and how numbers are held in each: a file may be named more than once.
    starts, ends
        ``(n, 3)`` the bytes of each coordinate in its file, end excluded; -1 where it has no place. The third column of
        points in a plane is -1.
    piece
        ``(n,)`` which of the pieces each point is in.
    labels
        ``(n,)`` the numbers that the file gives to the points; None if they are in the order of the mesh.
    copies
        Further places of points, whose labels are their positions in the mesh: all must be the same.
    """

    pieces: tuple[tuple[Path, Form], ...]
    starts: Ints
    ends: Ints
    piece: Ints
    labels: Ints | None = None
    copies: Places | None = None
    lines: Ints | None = None  #: ``(n, 2)`` the bytes of lines that can be given wider fields; -1 for others
    why: tuple[str, ...] = ()  #: what keeps points from having a place, a phrase each
    width: int = 3  #: coordinates that the file gives for each point; of two the third is 0

    @classmethod
    def of(cls, path: Path, form: Form, starts: Ints, ends: Ints, labels: Ints | None = None) -> Places:
        """All points in one file and one form; ``starts`` and ``ends`` ``(n, 3)``, or ``(n, 2)`` in a plane."""
        width = starts.shape[1]
        if width == 2:
            starts, ends = (np.pad(one, ((0, 0), (0, 1)), constant_values=-1) for one in (starts, ends))
        return cls(((path, form),), starts, ends, np.zeros(len(starts), np.int64), labels, width=width)

    @classmethod
    def joined(cls, parts: Sequence[Places]) -> Places:
        """One after another; labels only if all have some."""
        sizes = [len(part.pieces) for part in parts]
        shifts = np.cumsum([0, *sizes])[:-1].tolist()
        labels = [part.labels for part in parts if part.labels is not None]
        return cls(
            tuple(piece for part in parts for piece in part.pieces),
            np.concatenate([_NO_SPANS, *(part.starts for part in parts)]),
            np.concatenate([_NO_SPANS, *(part.ends for part in parts)]),
            np.concatenate([_NONE, *(part.piece + shift for part, shift in zip(parts, shifts, strict=True))]),
            np.concatenate([_NONE, *labels]) if len(labels) == len(parts) > 0 else None,
            lines=np.concatenate([_NO_LINES, *(part._lines for part in parts)]),
            why=tuple(dict.fromkeys(one for part in parts for one in part.why)),
            width=max((part.width for part in parts), default=3),
        )

    def rows(self, some: Ints) -> Places:
        """Some of the places."""
        labels = None if self.labels is None else self.labels[some]
        own = self.starts[some], self.ends[some], self.piece[some]
        return Places(self.pieces, *own, labels, lines=self._lines[some], width=self.width)

    def labelled(self, labels: Ints) -> Places:
        """The same with numbers."""
        return replace(self, labels=labels)

    def each_once(self, points: Ints) -> Places:
        """The last place of each point as its own, and the others as copies.

        Parameters
        ----------
        points
            ``(n,)`` the point of a mesh that each of the places is of, -1 if it is of none.
        """
        last = np.full(int(points.max(initial=-1)) + 1, -1, np.int64)
        known = np.flatnonzero(points >= 0)
        last[points[known]] = known
        is_other = points >= 0
        is_other[last[last >= 0]] = False
        copies = self.rows(np.flatnonzero(is_other)).labelled(points[is_other])
        return self.rows(np.maximum(last, 0)).without(last < 0).with_copies(copies)

    def renamed(self, path: Path, new: Path) -> Places:
        """The same in another file in the place of one."""
        pieces = tuple((new if one == path else one, form) for one, form in self.pieces)
        copies = None if self.copies is None else self.copies.renamed(path, new)
        return replace(self, pieces=pieces, copies=copies)

    def with_copies(self, copies: Places) -> Places:
        """The same with further places."""
        return replace(self, copies=copies)

    @property
    def files(self) -> tuple[Path, ...]:
        """Each file once."""
        return tuple(dict.fromkeys(path for path, _ in self.pieces))

    @property
    def has_place(self) -> NDArray[np.bool_]:
        """``(n,)`` True for points of which every coordinate that the file gives has one."""
        return np.asarray((self.starts[:, : self.width] >= 0).all(axis=1))

    def aligned(self, mesh: Mesh) -> Places:
        """The places of the points of a mesh that was read from the file, those only whose numbers are its coordinates.

        What the file gives in another system, generates, or gives twice has no place.
        """
        n = mesh.n_points
        rows = np.full(n, -1, np.int64)
        numbers = labels_of(mesh, "point")
        if self.labels is None or numbers is None:
            n_given = min(n, len(self.starts))
            rows[:n_given] = np.arange(n_given)
        else:
            known, last = np.unique(self.labels[::-1], return_index=True)  # a point given again replaces the first
            one, counts = np.unique(numbers, return_counts=True)
            if len(known):
                at = np.minimum(np.searchsorted(known, numbers), len(known) - 1)
                is_one = (counts == 1)[np.searchsorted(one, numbers)]
                rows = np.where((known[at] == numbers) & is_one, len(self.labels) - 1 - last[at], -1)
        starts, ends = np.full((n, 3), -1, np.int64), np.full((n, 3), -1, np.int64)
        piece, lines = np.zeros(n, np.int64), np.full((n, 2), -1, np.int64)
        given = np.flatnonzero(rows >= 0)
        starts[given], ends[given], piece[given] = (all_[rows[given]] for all_ in (self.starts, self.ends, self.piece))
        lines[given] = self._lines[rows[given]]
        places = replace(self, starts=starts, ends=ends, piece=piece, labels=None, lines=lines)
        ids = np.flatnonzero(places.has_place)
        points = np.asarray(mesh.points)
        here = places._values(ids).astype(points.dtype)
        places = places.without(ids[(here != points[ids]).any(axis=1)]).without(_at_middles(mesh))
        copies = self.copies
        if copies is None or copies.labels is None:
            return places
        here = copies.values().astype(points.dtype)
        return places.without(copies.labels[(here != points[copies.labels]).any(axis=1)])

    def without(self, points: NDArray[Any]) -> Places:
        """The same, but some points (ids or a mask) have no place."""
        starts = self.starts.copy()
        starts[points] = -1
        return replace(self, starts=starts)

    def values(self) -> Reals:
        """``(n, 3)`` the numbers that stand in the files."""
        return self._values(np.arange(len(self.starts)))

    def _values(self, ids: Ints) -> Reals:
        """``(n, 3)`` the numbers that stand in the files at the places of some points."""
        values = np.full((len(ids), 3), np.nan)
        values[:, self.width :] = 0.0
        for path in self.files:
            data = contents(path)
            for number, (file, form) in enumerate(self.pieces):
                own = np.flatnonzero(self.piece[ids] == number) if file == path else _NONE
                if len(own):
                    starts, ends = (spans[ids[own], : self.width].ravel() for spans in (self.starts, self.ends))
                    there = form.values(data, starts, ends).reshape(-1, self.width)
                    values[own, : self.width] = there if (system := system_of(form)) is None else system.basic(there)
        return values

    @property
    def _lines(self) -> Ints:
        return np.full((len(self.starts), 2), -1, np.int64) if self.lines is None else self.lines

    @property
    def can_widen(self) -> bool:
        """True if the fields of some points can be given more digits."""
        return bool((self._lines >= 0).any())

    def rounded(self, ids: Ints, points: Reals, *, widens: bool = False) -> Reals:
        """``(n, 3)`` coordinates of some points as the file will hold them; ``widens``: in wider fields."""
        result = np.array(points, np.float64)
        near = self._near(ids)
        for number, (_, form) in enumerate(self.pieces):
            own = np.flatnonzero(self.piece[ids] == number)
            system = system_of(form)
            if system is not None:
                result[own] = system.own(result[own], near[own])
            every = own
            if widens and isinstance(form, Widening):
                can = self._lines[ids[own], 0] >= 0
                wide = own[can]
                result[wide] = form.wide.rounded(result[wide].ravel()).reshape(-1, 3)
                own = own[~can]
            result[own] = form.rounded(result[own].ravel()).reshape(-1, 3)
            if system is not None:
                result[every] = system.basic(result[every])
        return result

    def _near(self, ids: Ints) -> Reals:
        """``(n, 3)`` what stands in the files for some points, in the systems that they are given in, if any are."""
        near = np.zeros((len(ids), 3))
        if any(system_of(form) is not None for _, form in self.pieces):
            plain = tuple((path, _Plain(form)) for path, form in self.pieces)
            near = replace(self, pieces=plain, copies=None)._values(ids)
        return near

    def edit(self, path: Path, before: Reals, after: Reals) -> Edit:
        """What changes in one of the files if points move.

        Only coordinates that change are written: the others keep their characters.
        """
        data = contents(path)
        own = replace(self, copies=None, labels=np.arange(len(self.starts)))
        every = own if self.copies is None else Places.joined([own, self.copies])
        points = every.labels
        is_here = np.isin(every.piece, [number for number, (file, _) in enumerate(every.pieces) if is_same(file, path)])
        is_moved = is_here[:, None] & (before.view(np.int64) != after.view(np.int64))[points]
        there = every._in_own_systems(path, is_moved, after[points])
        spans, texts = every._widened(data, is_moved, there)
        starts, ends, new = every.starts[is_moved], every.ends[is_moved], there[is_moved]
        piece = np.broadcast_to(every.piece[:, None], is_moved.shape)[is_moved]
        order = np.argsort(starts, kind="stable")
        starts, ends, new, piece = starts[order], ends[order], new[order], piece[order]
        puts: list[tuple[Putting, Ints, Reals]] = []
        for number in np.unique(piece).tolist():
            form, rows = every.pieces[number][1], np.flatnonzero(piece == number)
            if isinstance(form, Putting):
                puts.append((form, starts[rows], new[rows]))
                continue
            begins, stops = starts[rows], ends[rows]
            if isinstance(form, Raw):  # numbers side by side are one piece
                cuts = np.concatenate([[0], np.flatnonzero(begins[1:] != stops[:-1]) + 1, [len(rows)]])
                size, encoded = int(stops[0] - begins[0]), form.encoded(new[rows])
                texts += [encoded[size * a : size * b] for a, b in itertools.pairwise(cuts.tolist())]
                begins, stops = begins[cuts[:-1]], stops[cuts[1:] - 1]
            else:
                assert isinstance(form, Writing)  # it is one of the three
                texts += form.written(new[rows], partial(_between, data, begins, stops))
            spans += zip(begins.tolist(), stops.tolist(), strict=True)
        return Edit(Hunks.replacing(_NONE, _NONE, []), [], puts).also(spans, texts)

    def _in_own_systems(self, path: Path, is_moved: NDArray[np.bool_], after: Reals) -> Reals:
        """``(n, 3)`` the numbers of points that moved as they are to stand; ``is_moved`` becomes those that change."""
        after = after.copy()
        for number, (file, form) in enumerate(self.pieces):
            system = system_of(form)
            if system is None or not is_same(file, path):
                continue
            rows = np.flatnonzero((self.piece == number) & is_moved.any(axis=1))
            near = self._near(rows)
            after[rows] = system.own(after[rows], near)
            wide = form.wide if isinstance(form, Widening) else form
            is_moved[rows] = wide.rounded(after[rows].ravel()).reshape(-1, 3) != near
        return after

    def _widened(
        self, data: bytes, is_moved: NDArray[np.bool_], after: Reals
    ) -> tuple[list[tuple[int, int]], list[bytes]]:
        """Lines, and what they become, of points whose fields are too narrow; these are taken out of ``is_moved``."""
        spans, texts = [], []
        for number, (_, form) in enumerate(self.pieces):
            if not isinstance(form, Widening):
                continue
            rows = np.flatnonzero((self.piece == number) & (self._lines[:, 0] >= 0) & is_moved.any(axis=1))
            narrow = form.rounded(after[rows].ravel()).reshape(-1, 3)
            for row in rows[((narrow != after[rows]) & is_moved[rows]).any(axis=1)].tolist():
                start, end = self._lines[row].tolist()
                spans.append((start, end))
                texts.append(form.widened(data[start:end], after[row], is_moved[row]))
                is_moved[row] = False
        return spans, texts


@runtime_checkable
class Putting(Form, Protocol):
    """A form whose numbers are put into a copy of the file by a library."""

    def put(self, path: Path, starts: Ints, values: Reals) -> None:
        """Change the numbers at some places."""
        ...


class System(Protocol):
    """A system of coordinates that points are given in."""

    def basic(self, given: Reals, /) -> Reals:
        """Points ``(n, 3)`` in the basic system."""
        ...

    def own(self, points: Reals, near: Reals, /) -> Reals:
        """Points of the basic system in this one; angles near those that are."""
        ...


@runtime_checkable
class InSystem(Form, Protocol):
    """A form of points that are given in a system of their own."""

    @property
    def system(self) -> System | None:
        """It; None: the basic one."""
        ...


def system_of(form: Form) -> System | None:
    """The system that points are given in, if it is not the basic one."""
    return form.system if isinstance(form, InSystem) else None


@dataclass(frozen=True, slots=True)
class _Plain:
    """A form without its system."""

    form: Form

    def values(self, data: bytes, starts: Ints, ends: Ints) -> Reals:
        return self.form.values(data, starts, ends)

    def rounded(self, values: Reals) -> Reals:
        return self.form.rounded(values)


@runtime_checkable
class Widening(Form, Protocol):
    """A form in fields that can be made wider, with the line that they stand in."""

    @property
    def wide(self) -> Form:
        """The form in such fields."""
        ...

    def widened(self, line: bytes, point: Reals, changes: NDArray[np.bool_]) -> bytes:
        """The line with wider fields, in which some coordinates are others."""
        ...


@dataclass(frozen=True, eq=False)
class Edit:
    """What changes in a file: pieces of its bytes (unpacked, if it is gzipped), and numbers that are put into it."""

    hunks: Hunks
    texts: list[bytes]
    puts: list[tuple[Putting, Ints, Reals]]

    def also(self, spans: Sequence[tuple[int, int]], texts: Sequence[bytes]) -> Edit:
        """The same with further pieces of text."""
        starts = np.array([*self.hunks.old[:, 0].tolist(), *(a for a, _ in spans)], np.int64)
        ends = np.array([*self.hunks.old[:, 1].tolist(), *(b for _, b in spans)], np.int64)
        order = np.argsort(starts, kind="stable")
        every = [*self.texts, *texts]
        every = [every[at] for at in order.tolist()]
        return Edit(Hunks.replacing(starts[order], ends[order], list(map(len, every))), every, self.puts)

    @property
    def is_empty(self) -> bool:
        """True if nothing changes."""
        return not (self.texts or self.puts)

    def copy(self, old: Path, new: Path, *, packs: bool = True) -> Hunks | None:
        """Write the file as it is to be; returns where its bytes differ, None if that is not known.

        One that is packed by gzip stays so, unless it is not to be (``packs``).
        """
        data = old.read_bytes()
        if data.startswith(GZIP):
            if packs and self.is_empty:
                new.write_bytes(data)
                return None
            new.write_bytes(b"".join(_pieces(gzip.decompress(data), self.hunks, self.texts)))
            self._put(new)
            if packs:
                new.write_bytes(gzip.compress(new.read_bytes(), mtime=0))
            return None
        with new.open("wb") as file:
            file.writelines(_pieces(data, self.hunks, self.texts))
        self._put(new)
        return None if self.puts else self.hunks

    def _put(self, path: Path) -> None:
        for form, starts, values in self.puts:
            form.put(path, starts, values)


def _between(data: bytes, starts: Ints, ends: Ints, row: int) -> bytes:
    return data[int(starts[row]) : int(ends[row])]


def is_same(a: Path, b: Path) -> bool:
    """Whether two paths lead to one file."""
    return a == b or os.path.realpath(a) == os.path.realpath(b)


def contents(path: Path) -> bytes:
    """The bytes of a file, unpacked if it is gzipped."""
    data = path.read_bytes()
    return gzip.decompress(data) if data.startswith(GZIP) else data


def _at_middles(mesh: Mesh) -> Ints:
    """Points of cells of which the file leaves nodes out, which are taken halfway between others."""
    labels = labels_of(mesh, "point")
    if labels is None or not (labels < 0).any():
        return _NONE
    sizes = np.diff(mesh.offsets)
    lacks = np.add.reduceat(labels[mesh.connectivity] < 0, mesh.offsets[:-1][sizes > 0]) > 0
    owner = np.repeat(lacks, sizes[sizes > 0])
    return np.unique(mesh.connectivity[owner]).astype(np.int64)


def _pieces(data: bytes, hunks: Hunks, texts: Sequence[bytes]) -> list[bytes]:
    """A file with other texts in the places of some of its pieces."""
    starts, ends = [*hunks.old[:, 0].tolist(), len(data)], [0, *hunks.old[:, 1].tolist()]
    pieces = [b""] * (2 * len(texts) + 1)
    pieces[::2] = [data[a:b] for a, b in zip(ends, starts, strict=True)]
    pieces[1::2] = texts
    return pieces
