"""The diagnosis of a mesh that is not in memory: its cells pass by several times, and what may be wrong is kept."""

from .diagnose import bytes_needed, diagnosis_of
from .marks import MarkCounter, Marks
from .source import Source

__all__ = ["MarkCounter", "Marks", "Source", "bytes_needed", "diagnosis_of"]
