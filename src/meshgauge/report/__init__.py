"""Reports for people and programs, from data: no reading, no measuring."""

from .record import FailedFile, FileReport

__all__ = ["FailedFile", "FileReport"]
