"""``meshgauge paraview-plugin``: where the plugin for ParaView is."""

from __future__ import annotations

from pathlib import Path


def paraview_plugin() -> None:
    """Print the path of the file to load in ParaView."""
    print(Path(__file__).resolve().parent.parent / "integrations" / "paraview_plugin.py")
