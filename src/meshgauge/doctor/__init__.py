"""The doctor: what is wrong with a mesh beside the shapes of its cells, and cells that are numbered in reverse."""

from .diagnosis import LIMIT, Diagnosis, diagnosis, not_diagnosed
from .findings import Finding
from .hanging import Hanging, hanging
from .misoriented import misoriented
from .orient import Changes, orient
from .orientation import BlockOrientation, Numbering, Orientation, orientation
from .reversal import reversal

__all__ = [
    "LIMIT",
    "BlockOrientation",
    "Changes",
    "Diagnosis",
    "Finding",
    "Hanging",
    "Numbering",
    "Orientation",
    "diagnosis",
    "hanging",
    "misoriented",
    "not_diagnosed",
    "orient",
    "orientation",
    "reversal",
]
