"""Exceptions. The library raises these; only the command line prints and exits."""

from __future__ import annotations


class MeshgaugeError(Exception):
    """Base of every exception that meshgauge raises on purpose."""


class MeshError(MeshgaugeError, ValueError):
    """Arrays that do not make a mesh: index out of range, wrong node count, wrong shape, no cells."""


class ReadError(MeshgaugeError):
    """A file could not be read. The message names the file and says what to do."""


class WriteError(MeshgaugeError):
    """A file could not be written; nothing was left half-written and no input was touched."""


class MetricError(MeshgaugeError, ValueError):
    """No such metric, or it is not defined for what was asked."""
