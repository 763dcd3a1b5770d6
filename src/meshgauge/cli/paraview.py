"""``meshgauge paraview-plugin``: where the plugin for ParaView is."""

from __future__ import annotations

from pathlib import Path

import typer


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command(name="paraview-plugin", help="Print where the plugin for ParaView is (docs/integrations.md).")(where)


def where() -> None:
    """Print the path of the file to load in ParaView."""
    typer.echo(str(Path(__file__).resolve().parent.parent / "integrations" / "paraview_plugin.py"))
