"""Whose settings count, and what they may reach."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from meshgauge.check.settings import LARGEST, SettingsError, load, nearest
from meshgauge.check.sources import baselines_of, meshes_of, rules_of
from meshgauge.errors import BaselineError

RULES = "[check]\nfail = ['nothing invalid']\n"


@pytest.fixture
def deep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder two below one with settings; outside of the home folder and of any repository."""
    monkeypatch.setattr(Path, "home", lambda: tmp_path / "nobody")
    (tmp_path / "meshgauge.toml").write_text(RULES)
    deep = tmp_path / "a" / "b"
    deep.mkdir(parents=True)
    return deep


def test_settings_above_count_within_a_repository_only(deep: Path, tmp_path: Path) -> None:
    assert nearest(tmp_path) == tmp_path / "meshgauge.toml"
    assert nearest(deep) is None
    (tmp_path / "a" / ".git").mkdir()
    assert nearest(deep) is None  # they are above its root
    (tmp_path / ".git").mkdir()
    assert nearest(deep) is None  # the inner repository ends the search
    (tmp_path / "a" / ".git").rmdir()
    assert nearest(deep) == tmp_path / "meshgauge.toml"


def test_settings_above_count_within_the_home_folder(
    deep: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    assert nearest(deep) == tmp_path / "meshgauge.toml"


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="the system knows no owners")
@pytest.mark.parametrize("name", ["meshgauge.toml", "pyproject.toml"])
def test_settings_of_somebody_else_are_named_not_used(
    name: str, deep: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / ".git").mkdir()
    (tmp_path / "meshgauge.toml").unlink()
    (tmp_path / name).write_text(RULES.replace("[check]", "[tool.meshgauge.check]") if "py" in name else RULES)
    owner, real = os.geteuid() + 1, Path.stat
    monkeypatch.setattr(
        Path, "stat", lambda path, **how: os.stat_result((*real(path, **how)[:4], owner, *real(path, **how)[5:10]))
        if path.name == name else real(path, **how)
    )  # fmt: skip
    with pytest.raises(SettingsError, match=r"belongs to another user .*--config"):
        nearest(deep)
    assert nearest(tmp_path) == tmp_path / name  # the working folder's own count whoever laid them there
    assert load(tmp_path / name).fail == ("nothing invalid",)  # and so do those that are named


@pytest.mark.parametrize("mesh", ["../x.vtu", "/etc/*.vtu", "a/../../x.vtu"])
def test_meshes_stay_below_the_settings(mesh: str, tmp_path: Path) -> None:
    path = tmp_path / "meshgauge.toml"
    path.write_text(f"[check]\nmeshes = ['ok.vtu', '{mesh}']\n")
    with pytest.raises(SettingsError, match="outside of the folder of the settings"):
        meshes_of(load(path))
    path.write_text("[check]\nmeshes = ['ok.vtu', 'a/../b/*.vtu']\n")
    assert len(meshes_of(load(path))) == 2


@pytest.mark.skipif(os.name != "posix", reason="devices are files")
def test_a_stored_report_is_a_file_of_bounded_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    start = time.monotonic()
    os.mkfifo(tmp_path / "pipe")
    for name in ("/dev/zero", tmp_path / "pipe", tmp_path):
        with pytest.raises(BaselineError, match="is no regular file"):
            baselines_of(rules_of(None, [f"no worse than {name}"]) or ())
    assert time.monotonic() - start < 30
    (tmp_path / "large.json").write_bytes(b" " * 100)
    monkeypatch.setattr("meshgauge.check.baseline.LARGEST", 10)
    with pytest.raises(BaselineError, match="is larger than"):
        baselines_of(rules_of(None, [f"no worse than {tmp_path}/large.json"]) or ())
    (tmp_path / "meshgauge.toml").write_bytes(b"#" * (LARGEST + 1))
    with pytest.raises(SettingsError, match="is larger than 1 MiB"):
        load(tmp_path / "meshgauge.toml")
