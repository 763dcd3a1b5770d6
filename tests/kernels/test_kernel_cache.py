"""Where compiled kernels are kept: in a folder that only this user writes to, and without one they run all the same."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from meshgauge.kernels import cache_folder as module
from meshgauge.kernels.cache_folder import cache_folder

NOWHERE = "/proc/none"
"""A path at which nothing can be made, whoever tries."""

RUN = """
import sys, tempfile
if sys.argv[1]:
    tempfile.tempdir = sys.argv[1]
import numba
from meshgauge.kernels import jit
before = numba.config.CACHE_DIR
jit.warm_up()
assert numba.config.CACHE_DIR == before
print(jit._nothing.stats.cache_path)
"""


@pytest.fixture(autouse=True)
def afresh() -> None:
    cache_folder.cache_clear()


def run(temporary: str, **environment: str) -> str:
    full = {**os.environ, "NUMBA_DISABLE_JIT": "0", **environment}
    done = subprocess.run([sys.executable, "-c", RUN, temporary], capture_output=True, text=True, env=full)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout.strip()


@pytest.mark.skipif(sys.platform != "linux", reason="made of /proc")
def test_kernels_run_where_nothing_can_be_written(tmp_path: Path) -> None:
    """A read-only installation and home: first with a temporary folder, then without."""
    none = {"HOME": NOWHERE, "XDG_CACHE_HOME": NOWHERE, "NUMBA_CACHE_DIR": NOWHERE}
    assert run(str(tmp_path), **none).startswith(str(tmp_path))
    assert run(NOWHERE, **none) == "None"


def test_the_folder_that_is_asked_for_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_own", lambda: iter([tmp_path / "own"]))
    assert cache_folder(str(tmp_path / "asked")) == str(tmp_path / "asked")
    assert cache_folder("") == str(tmp_path / "own")
    (tmp_path / "file").touch()
    cache_folder.cache_clear()
    assert cache_folder(str(tmp_path / "file")) == str(tmp_path / "own")  # no folder, hence none to write to


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="the system knows no owners")
@pytest.mark.parametrize("fault", ["writable", "link", "owner"])
def test_a_folder_that_others_can_write_to_is_not_trusted(
    fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, last = tmp_path / "own", tmp_path / "last"
    folder.mkdir(mode=0o700)
    monkeypatch.setattr(module, "_own", lambda: iter([folder, last]))
    assert cache_folder("") == str(folder)
    cache_folder.cache_clear()
    if fault == "writable":
        folder.chmod(0o777)
    elif fault == "link":
        folder.rename(tmp_path / "real")
        folder.symlink_to(tmp_path / "real")
    else:
        monkeypatch.setattr(os, "geteuid", lambda: folder.stat().st_uid + 1)
    assert cache_folder("") == (None if fault == "owner" else str(last))


def test_a_cache_that_fails_costs_time_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    jit = pytest.importorskip("meshgauge.kernels.jit")
    if jit.JIT_DISABLED:
        pytest.skip("nothing is compiled")

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    kernel = jit.kernel(fail_twice)
    kernel._cache._impl.locator.ensure_cache_path = fail
    assert kernel(2.0) == 4.0


def fail_twice(x: float) -> float:
    return 2.0 * x


def test_a_kernel_from_the_cache_loads_no_compiler() -> None:
    """Half of what the first kernel of a process takes."""
    jit = pytest.importorskip("meshgauge.kernels.jit")
    jit.warm_up()
    if jit.JIT_DISABLED or not jit._nothing.stats.cache_path:
        pytest.skip("nothing is kept")
    told = "print(sum(jit._nothing.stats.cache_hits.values()), 'numba.np.linalg' in sys.modules)"
    code = f"import sys; from meshgauge.kernels import jit; jit.warm_up(); {told}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["1", "False"]


def test_another_numba_is_taken_as_it_is() -> None:
    jit = pytest.importorskip("meshgauge.kernels.jit")

    class Cache:
        """One without the method that is called elsewhere."""

        def load_overload(self, signature: object, context: object) -> str:
            return f"{signature} {context}"

    assert jit._from_cache(Cache())(1, 2) == "1 2"
