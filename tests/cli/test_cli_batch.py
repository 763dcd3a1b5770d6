"""Files one after another: what is read and measured how, and what becomes of one that fails."""

from __future__ import annotations

import weakref
from pathlib import Path

import pytest

from meshgauge.cli.batch import Batch
from meshgauge.cli.options import Purposes, Reading
from meshgauge.errors import FailedFile, MeshError, ReadError, WriteError
from meshgauge.quality.measure import Quality

Captured = pytest.CaptureFixture[str]


@pytest.fixture
def batch() -> Batch:
    return Batch(reading=Reading(), quiet=True)


def test_a_file_that_fails_is_reported_and_the_others_go_on(
    batch: Batch, good: Path, tmp_path: Path, capsys: Captured
) -> None:
    seen: list[FailedFile] = []
    batch.on_failure = seen.append
    paths = [str(tmp_path / "none.vtu"), str(good), str(tmp_path)]
    assert [path for path, _ in batch.each(paths, batch.read)] == [str(good)]
    assert batch.failures == seen
    assert [failure.path for failure in seen] == [paths[0], paths[2]]
    assert batch.exit_code == 2
    lines = capsys.readouterr().err.splitlines()
    assert [line.startswith(f"meshgauge: error: {path}: ") for line, path in zip(lines, paths[::2], strict=True)]
    assert not any(path in failure.reason for path, failure in zip(paths[::2], seen, strict=True))


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (ReadError("a.vtu: is broken"), "is broken"),
        (ReadError("a.vtu, line 3: is broken"), "line 3: is broken"),
        (ReadError("a.vtu/owner, line 3: is broken"), "owner, line 3: is broken"),
        (ReadError("a.vtu2: is broken"), "a.vtu2: is broken"),
        (MeshError("no cells"), "no cells"),
        (OSError(28, "No space left on device"), "No space left on device"),
        (MemoryError(), "does not fit into memory"),
        (KeyError("x"), "unexpected KeyError: 'x'"),
    ],
)
def test_reasons(batch: Batch, error: Exception, reason: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MESHGAUGE_TRACEBACK", raising=False)

    def fail(path: str) -> None:
        raise error

    assert batch.attempt("a.vtu", fail) == FailedFile("a.vtu", reason)
    if isinstance(error, KeyError):
        monkeypatch.setenv("MESHGAUGE_TRACEBACK", "1")
        with pytest.raises(KeyError):
            batch.attempt("a.vtu", fail)


def test_an_output_that_cannot_be_written_ends_all(batch: Batch) -> None:
    def fail(path: str) -> None:
        raise WriteError("out.vtu: no")

    with pytest.raises(WriteError):
        batch.attempt("a.vtu", fail)
    assert batch.failures == []


def test_one_mesh_is_held_at_a_time(batch: Batch, good: Path, bad: Path) -> None:
    held: list[weakref.ref[Quality]] = []

    def measure(path: str) -> Quality:
        assert not any(reference() for reference in held)
        quality = batch.measure(path)
        held.append(weakref.ref(quality))
        return quality

    for _, quality in batch.each([str(good), str(bad)], measure):
        del quality
    assert len(held) == 2


@pytest.mark.parametrize("purpose", Purposes)
def test_the_purpose_asked_for_replaces_that_of_the_format(batch: Batch, good: Path, purpose: Purposes) -> None:
    assert batch.read(str(good)).purpose == "fem"
    batch.purpose = purpose
    assert batch.read(str(good)).purpose == purpose.of_mesh
    assert batch.measure(str(good)).mesh.purpose == purpose.of_mesh
