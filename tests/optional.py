"""Programs that some tests ask and that need not be there."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import pytest


def gmsh() -> Any:
    """Gmsh; skips where it is not installed, or lacks the libraries of the system that it is linked to."""
    try:
        return import_module("gmsh")
    except ImportError:
        pytest.skip("Gmsh is not installed")
    except OSError as error:
        pytest.skip(f"Gmsh lacks a library of the system: {error}")
