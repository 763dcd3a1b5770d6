"""How a file is written: whole or not at all, through links, into streams, and never over what is read."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from meshgauge.errors import WriteError
from meshgauge.files import output, sources
from meshgauge.files.output import replacing

pytestmark = pytest.mark.skipif(os.name != "posix", reason="modes, links and pipes of POSIX")


def put(path: Path, content: str = "new", **options: bool) -> None:
    with replacing(path, **options) as beside:
        beside.write_text(content)


def test_a_file_appears_whole_and_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    with replacing(path) as beside:
        beside.write_text("new")
        assert not path.exists()
        assert beside.suffix == path.suffix
        assert stat.S_IMODE(beside.parent.stat().st_mode) == 0o700, "nobody else can put a link in its place"
        assert beside.parent.parent == tmp_path, "of the same disk, so that it can be renamed"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_a_failure_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")

    def fail() -> None:
        with replacing(path) as beside:
            beside.write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    with pytest.raises(WriteError, match=r"a\.txt: cannot be written: No such file"), replacing(path):
        pass  # a writer that wrote nothing
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664, 0o755])
def test_the_mode_of_a_file_is_kept(tmp_path: Path, mode: int) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    path.chmod(mode)
    before = os.umask(0o022)
    try:
        put(path)
        put(tmp_path / "new.txt")
    finally:
        os.umask(before)
    assert stat.S_IMODE(path.stat().st_mode) == mode
    assert stat.S_IMODE((tmp_path / "new.txt").stat().st_mode) == 0o644


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root may give files away")
def test_the_owner_of_a_file_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    os.chown(path, 12345, 54321)
    put(path)
    assert (path.stat().st_uid, path.stat().st_gid) == (12345, 54321)


def test_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    path, link, second = tmp_path / "data" / "a.txt", tmp_path / "link.txt", tmp_path / "second.txt"
    link.symlink_to(Path("data") / "a.txt")
    second.symlink_to(link)
    put(second, "through a link to nothing yet")
    assert path.read_text() == "through a link to nothing yet"
    put(second)
    assert path.read_text() == "new"
    assert link.is_symlink()
    assert second.is_symlink()
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "away").symlink_to(tmp_path / "no" / "file")
    with pytest.raises(WriteError, match="leads to itself"):
        put(tmp_path / "loop")
    with pytest.raises(WriteError, match="there is no folder"):
        put(tmp_path / "away")


def test_a_device_is_written_into(tmp_path: Path) -> None:
    link = tmp_path / "null"
    link.symlink_to("/dev/null")
    put(link)
    put(Path("/dev/null"))
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    assert link.is_symlink()


def test_a_pipe_is_written_into(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    got: list[bytes] = []
    reader = threading.Thread(target=lambda: got.append(path.read_bytes()))
    reader.start()
    put(path, "x" * 300_000)
    reader.join(10)
    assert got == [b"x" * 300_000]
    assert stat.S_ISFIFO(path.stat().st_mode)


@pytest.mark.parametrize("name", ["/dev/fd/{}", "/proc/self/fd/{}"])
def test_an_open_descriptor_is_written_into_where_it_stands(tmp_path: Path, name: str) -> None:
    path = tmp_path / "log"
    with path.open("wb", buffering=0) as file:
        file.write(b"before ")
        put(Path(name.format(file.fileno())), "new")
        file.write(b" after")
    assert path.read_text() == "before new after"


def test_standard_output_takes_text_only(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    print("first")
    put(Path("-"), "the table\n", text=True)
    print("last")
    assert capfd.readouterr().out == "first\nthe table\nlast\n"
    with pytest.raises(WriteError, match="text only"):
        put(Path("-"))
    output.check("-", text=True)
    with pytest.raises(WriteError, match="text only"):
        output.check("-")


def test_a_name_may_be_as_long_as_the_system_lets_it(tmp_path: Path) -> None:
    path = tmp_path / ("x" * 251 + ".txt")
    put(path)
    assert path.read_text() == "new"
    with pytest.raises(WriteError, match="too long"):
        put(tmp_path / ("x" * 252 + ".txt"))
    with pytest.raises(WriteError, match="too long"):
        put(tmp_path / ("é" * 126 + ".txt"))


def test_what_cannot_be_written_is_known_before(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for path, reason in (
        (tmp_path, "is a folder"),
        (tmp_path / "no" / "a", "no folder"),
        (tmp_path / "file" / "a", "no folder"),
    ):
        with pytest.raises(WriteError, match=reason):
            output.check(path)
        with pytest.raises(WriteError, match=reason):
            put(path)
    output.check(tmp_path / "file")
    output.check("/dev/null")


KILLED = """
import os, signal, sys
from meshgauge.files.output import replacing
with replacing(sys.argv[1]) as beside:
    beside.write_text("half")
    print("there", flush=True)
    os.kill(os.getpid(), signal.SIGKILL) if sys.argv[2] == "kill" else sys.stdin.read()
"""


def test_what_a_killed_process_leaves_is_removed_by_the_next(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    code = subprocess.run([sys.executable, "-c", KILLED, str(path), "kill"], stdout=subprocess.DEVNULL).returncode
    assert code == -signal.SIGKILL
    left = [p for p in tmp_path.iterdir() if p != path]
    assert len(left) == 1, "the test tests something"
    assert path.read_text() == "old"
    alive = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(path), "wait"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert alive.stdout is not None
    assert alive.stdin is not None
    assert alive.stdout.readline() == b"there\n"
    assert not left[0].exists()
    put(tmp_path / "b.txt")
    assert len(list(tmp_path.iterdir())) == 3, "what a living process works on stays"
    alive.stdin.close()
    alive.stdout.close()
    assert alive.wait(10) == 0
    assert path.read_text() == "half"
    assert {p.name for p in tmp_path.iterdir()} == {"a.txt", "b.txt"}


def test_what_was_read_is_not_written_to(tmp_path: Path) -> None:
    path, link = tmp_path / "a.txt", tmp_path / "link"
    path.write_text("old")
    link.symlink_to(path)
    with sources.guard():
        sources.note(path)
        for target in (path, link):
            with pytest.raises(WriteError, match="belongs to an input"):
                put(target)
        put(path, "asked for", overwrite=True)
    put(path)
    assert path.read_text() == "new"


def test_an_output_that_is_read_later_is_known_at_once(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")

    def read_while_writing(*, asks: bool) -> None:
        with sources.guard(), replacing(path) as beside:
            beside.write_text("new")
            sources.note(path)
            if asks:
                sources.check_pending([str(path)])
                raise AssertionError("not known at once")

    for asks in (True, False):
        with pytest.raises(WriteError, match="belongs to an input"):
            read_while_writing(asks=asks)
    assert path.read_text() == "old"


def test_reads_within_reads_are_of_both(tmp_path: Path) -> None:
    with sources.record() as outer:
        sources.note(tmp_path / "a")
        with sources.record() as inner:
            sources.note(tmp_path / "b")
    assert [Path(p).name for p in inner] == ["b"]
    assert [Path(p).name for p in outer] == ["a", "b"]
