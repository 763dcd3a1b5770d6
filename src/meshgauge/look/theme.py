"""Colours of pages and windows, light and dark: grounds, text, lines, and words about bands on them."""

from __future__ import annotations

from .colours import GHOST, INVALID

LIGHT = {
    "page": "#fbfaf8",
    "card": "#fff",
    "ink": "#1c1e22",
    "soft": "#565b64",
    "border": "#dcdad4",
    "weak": "#f1efea",
    "accent": "#1f5e9e",
    "focus": "#1f5e9e",
    "stage": "linear-gradient(#f4f3ef, #e4e6e8)",
    "bad": "#a3230a",
    "bad-weak": "#fcebe7",
    "poor": "#805300",
    "poor-weak": "#fdf3dc",
    "good": "#1d5c3a",
    "good-weak": "#e7f3ec",
    "zone": "#fae3de",
    "zone-weak": "#fdf3dc",
}
"""By role; text has at least 4.5 : 1 on its ground."""

DARK = {
    "page": "#15171a",
    "card": "#1d2024",
    "ink": "#e9e8e4",
    "soft": "#a5a9b1",
    "border": "#363a41",
    "weak": "#24282d",
    "accent": "#84b6e8",
    "focus": "#9cc5f0",
    "stage": "linear-gradient(#2a2e34, #17191d)",
    "bad": "#ff9c85",
    "bad-weak": "#3b1710",
    "poor": "#f5b46b",
    "poor-weak": "#37260f",
    "good": "#83d3a5",
    "good-weak": "#143021",
    "zone": "#3b1b14",
    "zone-weak": "#2f2712",
}
"""By role, as `LIGHT`."""

PRINT = LIGHT | {
    "page": "#fff",
    "ink": "#000",
    "soft": "#444",
    "border": "#bbb",
    "weak": "#f3f3f3",
    "accent": "#000",
    "stage": "none",
    "bad-weak": "#fff",
    "poor-weak": "#fff",
    "good-weak": "#fff",
}
"""On paper: no ground but white."""

ALWAYS = {"invalid": INVALID, "seam": "#fff", "ghost": GHOST, "outline": DARK["page"]}
"""Of drawings, the same in light and dark."""


def css() -> str:
    """The colours as custom properties of a page (``var(--ink)``): light or dark as the system or the reader has it."""
    return (
        f":root {{ color-scheme: light dark; {_properties(ALWAYS | LIGHT)} }}\n"
        f'@media (prefers-color-scheme: dark) {{ :root:not([data-theme="light"]) {{ {_properties(DARK)} }} }}\n'
        f':root[data-theme="dark"] {{ color-scheme: dark; {_properties(DARK)} }}\n'
        ':root[data-theme="light"] { color-scheme: light; }\n'
        '@media print { :root, :root:not([data-theme="light"]), :root[data-theme="dark"] { '
        f"{_properties(PRINT)} }} }}\n"
    )


def _properties(colours: dict[str, str]) -> str:
    return " ".join(f"--{role}: {colour};" for role, colour in colours.items())
