"""The table of formats: each is loaded for the extensions that it has, and asked in the order of the table."""

from __future__ import annotations

import pytest

from meshgauge.io import registry
from meshgauge.io.formats import table


def test_rows_state_the_extensions_of_their_formats() -> None:
    extensions = {e for one in table.every() for e in one.extensions}
    for extension in (*extensions, ".none", ""):
        assert table.of_extension(extension) == tuple(f for f in table.every() if extension in f.extensions)
    assert {e for *_, stated in table._ROWS for e in stated.split()} == extensions


def test_names_are_unique_and_no_others_are_there() -> None:
    assert registry.FORMATS is registry.FORMATS
    assert list(registry.FORMATS.values()) == list(registry.ALL)
    with pytest.raises(AttributeError, match="no attribute 'OTHER'"):
        _ = registry.OTHER
