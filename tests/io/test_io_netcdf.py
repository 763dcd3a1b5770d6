"""Classic netCDF files as SciPy writes them: every type, arrays of records alone and beside others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from meshgauge.errors import ReadError
from meshgauge.io.plumbing.netcdf import variables

scipy_io = pytest.importorskip("scipy.io")

CODES = ["i1", "S1", ">i2", ">i4", ">f4", ">f8"]


def written(path: Path, version: int, *recorded: tuple[str, int], n: int = 3) -> dict[str, np.ndarray]:
    """A file with a fixed array of each type, and arrays of ``n`` records of these types and widths."""
    rng = np.random.default_rng(0)
    arrays = {}
    with scipy_io.netcdf_file(path, "w", version=version) as file:
        file.createDimension("time", None)
        file.createDimension("five", 5)
        for code in CODES:
            arrays[f"fixed {code}"] = rng.integers(1, 100, 5).astype(code if code != "S1" else "u1")
        for number, (code, width) in enumerate(recorded):
            file.createDimension(f"width {number}", width)
            arrays[f"record {number}"] = rng.integers(1, 100, (n, width)).astype(code)
        for name, values in arrays.items():
            code = name.split()[1] if name.startswith("fixed") else recorded[int(name.split()[1])][0]
            axes = ("five",) if name.startswith("fixed") else ("time", f"width {name.split()[1]}")
            variable = file.createVariable(name, np.dtype(code), axes)
            arrays[name] = values.view("S1") if code == "S1" else values
            variable[:] = arrays[name]
            variable.elem_type = "HEX8"
    return arrays


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize(
    "recorded",
    [(), ((">i2", 3),), (("i1", 1),), ((">i2", 3), (">f8", 2)), (("i1", 5), (">i2", 1), (">i4", 1))],
    ids=["none", "one of odd size", "one byte", "two", "three of odd sizes"],
)
def test_every_array_is_scipys(tmp_path: Path, version: int, recorded: tuple[tuple[str, int], ...]) -> None:
    arrays = written(tmp_path / "a.nc", version, *recorded)
    with variables(tmp_path / "a.nc") as read:
        assert set(read) == set(arrays)
        for name, values in arrays.items():
            one = read[name]
            assert one.attributes == {"elem_type": "HEX8"}
            assert one.shape == values.shape
            np.testing.assert_array_equal(one.values(), values)
            for row in range(len(values)):
                np.testing.assert_array_equal(one.values(row), values[row])


def all_values(path: Path) -> list[np.ndarray]:
    with variables(path) as read:
        return [one.values() for one in read.values()]


def test_a_file_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    written(tmp_path / "a.nc", 1, (">f8", 2))
    whole = (tmp_path / "a.nc").read_bytes()
    assert len(all_values(tmp_path / "a.nc")) == len(CODES) + 1
    for size in (5, 40, len(whole) - 1):
        (tmp_path / "b.nc").write_bytes(whole[:size])
        with pytest.raises(ReadError, match="not a whole netCDF file"):
            all_values(tmp_path / "b.nc")


@pytest.mark.parametrize("version", [1, 2])
def test_a_number_of_records_that_was_never_written_is_none(tmp_path: Path, version: int) -> None:
    """Who writes record by record leaves all bits set; any other number of records that are not there is an error."""
    path = tmp_path / "a.nc"
    written(path, version, (">f8", 2))
    data = path.read_bytes()
    path.write_bytes(data[:4] + b"\xff" * 4 + data[8:])
    with variables(path) as read:
        assert read["record 0"].values().shape == (0, 2)
    path.write_bytes(data[:4] + b"\x7f" + b"\xff" * 3 + data[8:])
    with pytest.raises(ReadError), variables(path) as read:
        read["record 0"].values()
