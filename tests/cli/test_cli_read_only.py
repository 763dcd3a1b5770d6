"""A read-only installation and home, as on clusters and in containers, without the rights of root."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import meshgauge

PACKAGE = Path(meshgauge.__file__).parent
RUN = """
import sys
from meshgauge.cli.main import main
codes = [main([*line.split(), sys.argv[1]]) for line in ("report -q", "check -q", "doctor --json --exit-zero")]
from meshgauge.kernels import jit
jit.warm_up()  # a kernel, whose cache must go elsewhere
sys.exit(codes != [0, 1, 0])
"""
SEALED = (
    'for one in "$1" "$2"; do mount --bind "$one" "$one" && mount -o remount,ro,bind "$one" || exit 1; done; '
    "shift 2 && exec setpriv --bounding-set=-all --inh-caps=-all --no-new-privs "
    '"$@"'
)
"""For a shell with mounts of its own: two folders read-only for it, and no rights but those of a user."""


@pytest.mark.skipif(
    os.name != "posix" or getattr(os, "geteuid", lambda: 1)() != 0, reason="only root can make mounts of its own"
)
def test_a_read_only_installation_and_home(tmp_path: Path, bad: Path) -> None:
    if shutil.which("unshare") is None or shutil.which("setpriv") is None:
        pytest.skip("no unshare, or no setpriv")
    home, temporary = tmp_path / "home", tmp_path / "tmp"
    home.mkdir()
    temporary.mkdir()
    sealed = ["unshare", "--mount", "sh", "-c", SEALED, "sh", str(PACKAGE), str(home)]
    environment = {key: value for key, value in os.environ.items() if key not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    environment |= {"HOME": str(home), "TMPDIR": str(temporary)}

    def run(*command: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*sealed, *command], env=environment, capture_output=True, text=True, timeout=300, check=False
        )

    probe = run(sys.executable, "-c", f"open({str(PACKAGE / 'x')!r}, 'w')")
    if "Read-only file system" not in probe.stderr:
        pytest.skip(f"no mounts of its own: {probe.stderr.strip()[-100:]}")
    done = run(sys.executable, "-c", RUN, str(bad))
    assert (done.returncode, done.stderr) == (0, "")
    kept = [entry for entry in temporary.iterdir() if entry.name.startswith("meshgauge-kernels-")]
    assert len(kept) == 1
    assert kept[0].stat().st_mode & 0o777 == 0o700, "a cache is code"
    assert list(home.iterdir()) == []
