"""The diagnosis of a mesh that is not in memory: its cells pass by several times, and what may be wrong is kept.

What needs kernels, `diagnose`, is imported where it is called: a report of a small mesh loads none.
"""

from .marks import MarkCounter, Marks, bytes_needed
from .source import Source

__all__ = ["MarkCounter", "Marks", "Source", "bytes_needed"]
