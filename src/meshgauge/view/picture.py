"""The scene as a PNG, with its legend: what the colours mean, and how many cells are shown of how many."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..files.output import replacing
from ..look.bands import POOR
from ..look.colours import DEGENERATE, FAINT, as_bytes, rgb
from ..look.style import share_of
from ..status import is_degenerate
from .link import View
from .model import QUALITY, Model
from .scene import BACKGROUNDS, INKS, Scene

STRIP = 0.075
"""Height of the legend, as a share of that of the picture; at least `LEAST` pixels."""
LEAST = 54


def png(scene: Scene, *, theme: str = "light") -> bytes:
    """The scene as it is, as a PNG of the size of its window."""
    from PIL import Image

    image = Image.fromarray(scene.picture())
    _legend(image, scene, theme)
    file = io.BytesIO()
    image.save(file, "PNG", optimize=True)
    return file.getvalue()


def save(path: Path, models: Sequence[Model], view: View, *, size: tuple[int, int]) -> tuple[int, ...]:
    """Write a picture of a view as PNG, without a window.

    Parameters
    ----------
    path
        Where to; an older file is replaced.
    models
        One, or two side by side.
    view
        What is shown of them, and from where.
    size
        Width and height in pixels.

    Returns
    -------
    tuple of int
        Of each model, how many cells are shown.

    Raises
    ------
    WriteError
        If the file cannot be written.
    ViewError
        If the view picks a cell that no model has.
    """
    scene = Scene(models, size=size)
    scene.show(view)
    with replacing(path) as temporary:
        temporary.write_bytes(png(scene))
    scene.close()
    return tuple(scene.n_shown)


def captions(scene: Scene) -> list[str]:
    """Of each mesh its name, and how many of its solid cells are shown."""
    return [
        f"{model.name}   {share_of(shown, model.n_cells, 'cell')}"
        + (f"   by {scene.view.colour}" if scene.view.colour != QUALITY else "")
        for model, shown in zip(scene.models, scene.n_shown, strict=True)
    ]


def has_undefined(scene: Scene) -> bool:
    """Whether a cell without a value is shown."""
    return any(bool(np.isnan(model.values[mask]).any()) for model, mask in zip(scene.models, scene.masks, strict=True))


def has_degenerate(scene: Scene) -> bool:
    """Whether a degenerate cell is shown."""
    pairs = zip(scene.models, scene.masks, strict=True)
    return any(bool(is_degenerate(model.quality.status[mask]).any()) for model, mask in pairs)


def _legend(image: Any, scene: Scene, theme: str) -> None:
    from PIL import ImageDraw, ImageFont

    draw, ink = ImageDraw.Draw(image), INKS[theme]
    width, height = image.size
    strip = max(round(STRIP * height), LEAST)
    size = max(round(strip * 0.27), 11)
    font = ImageFont.load_default(size)
    margin = round(strip * 0.4)
    page = BACKGROUNDS[theme]
    for n, caption in enumerate(captions(scene)):
        left = n * width // len(scene.models)
        _ground(image, page, left + margin, margin * 0.7, draw.textlength(caption, font=font), size)
        draw.text((left + margin, margin * 0.7), caption, fill=ink, font=font)
        if n:
            draw.line([(left, 0), (left, height)], fill=FAINT)
    y, tall = height - margin - size * 2, round(size * 0.8)
    x = float(margin)
    poor = scene.models[0].quality.poor_below.text
    if text := scene.models[0].legend(scene.view.colour):
        _ground(image, page, margin, y, draw.textlength(text, font=font), size)
        draw.text((margin, y), text, fill=ink, font=font)
        return
    entries: list[tuple[str, NDArray[Any]]] = [
        ("invalid", as_bytes(np.array([-1.0]))),
        *([("degenerate", 255 * rgb(DEGENERATE)[None])] if has_degenerate(scene) else []),
        (f"poor < {poor}", as_bytes(np.array([POOR / 2]))),
        (poor, as_bytes(np.linspace(POOR, 1.0, 64))),
        ("1 ideal", np.zeros((0, 3))),
    ]
    if has_undefined(scene):
        entries.append(("undefined", as_bytes(np.array([np.nan]))))
    wide = sum(draw.textlength(text, font=font) + size * (1.9 + _swatch(swatches)) for text, swatches in entries)
    _ground(image, page, margin, y, wide - size * 1.9, size)
    for text, swatches in entries:
        box = size * _swatch(swatches)
        if text == poor:
            draw.text((x, y + tall / 2), text, fill=ink, font=font, anchor="lm")
            x += draw.textlength(text, font=font) + size * 0.5
        for n, colour in enumerate(swatches):
            left = x + box * n / len(swatches)
            draw.rectangle(
                [left, y, x + box * (n + 1) / len(swatches), y + tall], fill=tuple(int(channel) for channel in colour)
            )
        x += box + size * 0.5
        if text != poor:
            draw.text((x, y + tall / 2), text, fill=ink, font=font, anchor="lm")
            x += draw.textlength(text, font=font) + size * 1.4


def _swatch(swatches: NDArray[Any]) -> float:
    """Width of the colours of an entry, in heights of its letters."""
    return 9.0 if len(swatches) > 1 else 1.6 if len(swatches) else 0.0


def _ground(image: Any, page: str, x: float, y: float, width: float, size: float) -> None:
    """Let text be read before whatever is drawn: the colour of the page, nearly opaque, about it."""
    from PIL import Image, ImageDraw

    mask = Image.new("L", image.size, 0)
    box = [x - size * 0.6, y - size * 0.5, x + width + size * 0.6, y + size * 1.5]
    ImageDraw.Draw(mask).rounded_rectangle(box, size * 0.5, fill=215)
    image.paste(page, (0, 0), mask)
