"""``meshgauge paraview-plugin``: where the plugin for ParaView is, and its colours."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from ..errors import OptionError
from .options import option


def paraview_plugin(
    preset: Annotated[
        Path | None,
        option("--preset", "FILE", "Write colour maps for ParaView (.json) instead: of jens and of status."),
    ] = None,
) -> None:
    """Print the path of the file to load in ParaView."""
    if preset is not None:
        if str(preset) != "-" and preset.suffix.lower() != ".json":
            raise OptionError(f"{preset}: ParaView imports presets from .json files")
        from ..files import output
        from ..plot.paraview_preset import presets_json

        output.write_text(preset, presets_json())
        return
    print(Path(__file__).resolve().parent.parent / "integrations" / "paraview_plugin.py")
