"""Models of small meshes; scenes and browsers where the system has what they need, else a visible skip."""

from __future__ import annotations

import pytest

import meshgauge
from meshgauge.view.model import Model


@pytest.fixture(scope="session")
def bracket(pytestconfig: pytest.Config) -> Model:
    """The bracket of the examples: four types, four regions, three inverted cells."""
    return Model.of(meshgauge.read(pytestconfig.rootpath / "examples/meshes/bracket.vtu"), "bracket.vtu")


@pytest.fixture(scope="session")
def drawing() -> None:
    """Skips where VTK cannot draw."""
    from meshgauge.view import opengl
    from meshgauge.view.filters import ViewError

    try:
        opengl.render_window()
    except ViewError as error:
        pytest.skip(str(error))
