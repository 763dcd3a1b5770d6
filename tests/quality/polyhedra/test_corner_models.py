"""Constants of corners: one for all numberings of the faces around a corner, and right for each."""

from __future__ import annotations

import numpy as np
import pytest

from meshgauge.quality.polyhedra import LONG, _least_form, _unique_rows


@pytest.mark.parametrize("n", [3, 4, 5, 6])
def test_turned_and_mirrored_corners_have_one_form_the_least(n: int) -> None:
    rng = np.random.default_rng(n)
    for sizes in rng.integers(3, 7, (40, n)):
        forms = [np.roll(way, turn) for way in (sizes, sizes[::-1]) for turn in range(n)]
        if n == 3:
            forms = [np.sort(sizes)] * 6  # three faces: every order is a turned or mirrored one
        least = min(form.tolist() for form in forms)
        assert _least_form(np.array(forms)).tolist() == [least] * len(forms)


def test_long_corners_stay_as_they_are() -> None:
    sizes = np.arange(LONG + 1, 0, -1)[None, :]
    assert np.array_equal(_least_form(sizes), sizes)


@pytest.mark.parametrize("width", [3, 40])
def test_different_rows_and_which_of_them_each_is(width: int) -> None:
    rows = np.random.default_rng(1).integers(3, 5, (200, 3))
    rows = np.concatenate([rows, np.full((200, width - 3), 7)], axis=1)
    unique, inverse = _unique_rows(rows)
    assert len(unique) == len({tuple(row) for row in rows.tolist()}) <= 8
    assert np.array_equal(unique[inverse], rows)
