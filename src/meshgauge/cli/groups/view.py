"""Options of ``meshgauge view``: the web application, or a picture instead."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from ...errors import OptionError
from .. import options
from ..options import option

SMALLEST, LARGEST = 200, 8000
"""Pixels of a side of a picture."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """What is shown, and where."""

    link: Annotated[
        str, option("--link", "LINK", "Start with this view: an address of before, or its part after the '#'.")
    ] = ""
    cell: options.Cell = None
    port: Annotated[int, option("--port", "N", "Listen on this port; 0: any that is free.", least=0, most=65535)] = 0
    browser: Annotated[bool, option("--browser/--no-browser", None, "Open the browser.")] = True
    idle: Annotated[
        int, option("--idle", "S", "End after so many seconds without an open page; 0: never.", least=0, most=10**6)
    ] = 600
    screenshot: Annotated[
        Path | None, option("--screenshot", "PNG", "Write a picture of the view instead, and end.")
    ] = None
    size: Annotated[str, option("--size", "WxH", "Size of that picture.")] = "1200x800"

    def pixels(self) -> tuple[int, int]:
        """Width and height of the picture. Raises `OptionError`, also if its name is none of a PNG."""
        if self.screenshot is not None and self.screenshot.suffix.lower() != ".png":
            raise OptionError(f"{self.screenshot}: pictures of a view are written as PNG; the name must end in .png")
        try:
            width, height = (int(part) for part in self.size.lower().split("x"))
        except ValueError:
            raise OptionError(f"--size is {self.size!r}, expected for example 1200x800") from None
        if not (SMALLEST <= width <= LARGEST and SMALLEST <= height <= LARGEST):
            raise OptionError(f"--size is {self.size!r}, expected {SMALLEST} to {LARGEST} pixels a side")
        return width, height
