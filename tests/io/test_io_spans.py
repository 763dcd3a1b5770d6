"""Where words stand in a text."""

from __future__ import annotations

from meshgauge.io.plumbing.spans import columns


def test_a_line_may_have_fewer_words_the_last_one_too() -> None:
    data = b"10 20 30\n\n 4\n5 6"
    starts, ends = columns(data, 0, len(data), 0, 3)
    assert starts.tolist() == [[0, 3, 6], [11, -1, -1], [13, 15, -1]]
    assert ends.tolist() == [[2, 5, 8], [12, -1, -1], [14, 16, -1]]
