"""Reports for people and programs, from data: no reading, no measuring."""

from ..errors import FailedFile
from .record import FileReport

__all__ = ["FailedFile", "FileReport"]
