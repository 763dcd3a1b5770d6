"""A few hundred broken files of every format, in bounded time; thousands with ``--long`` or by `many.py`."""

from __future__ import annotations

import time
from pathlib import Path

import fuzzing
import numpy as np
import pytest

from meshgauge import io
from meshgauge.io import registry


@pytest.fixture(scope="module")
def seeds(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[str, Path, list[Path]]]:
    return list(fuzzing.seeds(tmp_path_factory.mktemp("seeds")))


def test_what_is_broken_was_whole(seeds: list[tuple[str, Path, list[Path]]]) -> None:
    for kind, path, _ in seeds:
        assert registry.detect(path, path.read_bytes()[:4096]).name == kind
        assert io.read(path).n_cells > 0, path


def test_every_own_reader_is_fuzzed(seeds: list[tuple[str, Path, list[Path]]]) -> None:
    own = {
        name
        for name, f in registry.FORMATS.items()
        if (reader := f.read or f.read_step) is not None and not reader.__qualname__.startswith("_refused")
    }
    assert own == set(fuzzing.OWN)
    assert own <= {kind for kind, _, _ in seeds}


def tried(seeds: list[tuple[str, Path, list[Path]]], n: int, seconds: float, seed: int) -> list[str]:
    """Outcomes that are neither a mesh nor a refusal, of at most ``n`` broken files."""
    rng, end, wrong = np.random.default_rng(seed), time.monotonic() + seconds, []
    for number in range(n):
        if time.monotonic() > end:
            break
        kind, path, files = seeds[number % len(seeds)]
        victim = files[int(rng.integers(len(files)))]
        whole = victim.read_bytes()
        data = fuzzing.broken(rng, whole)
        victim.write_bytes(data)
        try:
            outcome = fuzzing.attempt(path)
        finally:
            victim.write_bytes(whole)
        if outcome not in ("read", "refused"):
            wrong.append(f"{kind} {victim.name}: {outcome}\n{data[:2000]!r}")
    return wrong


def test_broken_files_of_own_readers(seeds: list[tuple[str, Path, list[Path]]]) -> None:
    assert tried([s for s in seeds if s[0] in fuzzing.OWN], 200, 8.0, 1) == []


def test_broken_files_of_other_readers(seeds: list[tuple[str, Path, list[Path]]]) -> None:
    assert tried([s for s in seeds if s[0] not in fuzzing.OWN], 8, 8.0, 2) == []


@pytest.mark.long
@pytest.mark.parametrize("seed", range(10))
def test_many_broken_files(seeds: list[tuple[str, Path, list[Path]]], seed: int) -> None:
    assert tried(seeds, 1000, 600.0, 100 + seed) == []
