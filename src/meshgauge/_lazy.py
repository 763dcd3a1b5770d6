"""Modules of ours found by name, on use.

The way for the package's door, whose names are loaded when they are first asked for, and for methods of records that
lead to a higher floor (``quality.report()``). Imports say everything else; a test lists the callers.
"""

from __future__ import annotations

from importlib import import_module
from sys import modules as loaded

TYPE_CHECKING = False  # see the package's __init__
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any

PACKAGE = __package__


def find(module: str, name: str) -> Any:
    """What has this name in a module of ours, given below the package: ``find("io.objects", "to_pyvista")``."""
    return getattr(import_module(f"{PACKAGE}.{module}"), name)


def door(
    package: str, names: Mapping[str, str], modules: tuple[str, ...] = ()
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """``__getattr__`` and ``__dir__`` of a package whose names are loaded when they are asked for.

    Parameters
    ----------
    package
        Its ``__name__``.
    names
        The module, below the package, of each public name.
    modules
        Modules below the package that are public as such.
    """
    own = loaded[package].__dict__

    def getattribute(name: str) -> Any:
        if name in names:
            value = getattr(import_module(f"{package}.{names[name]}"), name)
        elif name in modules:
            value = import_module(f"{package}.{name}")
        else:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        own[name] = value
        return value

    return getattribute, lambda: sorted({*own, *names, *modules})
