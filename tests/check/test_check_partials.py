"""Rules held against partial reports come out as on the whole mesh, or are named as not decided."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh, PartialReport, io
from meshgauge.check import Check, State, check, check_partials, counting, metrics_of, rule
from meshgauge.cli.main import main
from meshgauge.errors import MeshgaugeError, ReadError
from meshgauge.kernels import path as kernels_path
from meshgauge.quality.summary import builder, tally

sys.path.insert(0, str(Path(__file__).parents[1] / "slices"))
from slice_meshes import garden

Captured = pytest.CaptureFixture[str]

RULES = (
    "nothing invalid",
    "nothing invalid inside",
    "nothing degenerate @ 50%",
    "nothing undecided",
    "nothing unmeasured",
    "nothing poor @ 90%",
    "nothing inverted @ 3",
    "nothing repeated_points",
    "nothing non_finite for hexahedron",
    "nothing invalid @ 1% for tetra, wedge in 'material 1', 'material 3'",
    "jens >= 0.2 @ 60%",
    "jens >= 0.2 @ 1%",
    "jens > -2",
    "jens >= 0 @ 40%",
    "jens < 0.9999",
    "jens <= 0.7",
    "jens >= 0.5 for hexahedron",
    "jens >= 0.3 @ 10% in 'material 2'",
    "scaled_jacobian >= 0.3 @ 30%",
    "edge_ratio >= 0.1 @ 1%",
    "nothing invalid for pyramid in 'material 9'",
)
OF_COUNTS_ONLY = ("scaled_jacobian >= 0.3 in 'material 1'", "jens >= 0.2 for elements 17-400")


@pytest.fixture(autouse=True)
def all_are_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 0)


def cut(mesh: Mesh, n: int = 3) -> list[Mesh]:
    return [mesh[some] for some in np.array_split(np.arange(mesh.n_cells), n)]


def parts_of(mesh: Mesh, rules: tuple[str, ...] = (), **how: Any) -> list[PartialReport]:
    how = {"by_region": True, "metrics": metrics_of([rule(one) for one in (*RULES, *OF_COUNTS_ONLY)]), **how}
    counter = counting(rules) if rules else None
    parts = cut(mesh)
    return [meshgauge.partial(one, part=(k, 3), counter=counter, **how) for k, one in enumerate(parts)]


def expected(mesh: Mesh, rules: tuple[str, ...]) -> Check:
    quality = meshgauge.measure(mesh, metrics=metrics_of([rule(one) for one in rules]))
    return check(quality, rules)


def assert_same(made: Check, whole: Check) -> None:
    """All but the ids of points, of which parts have their own."""
    for one, other in zip(made.outcomes, whole.outcomes, strict=True):
        assert (one.text, one.state) == (other.text, other.state), str(one.rule)
        assert (one.n_cells, one.n_failing, one.n_allowed) == (other.n_cells, other.n_failing, other.n_allowed)
        rows = [[str(replace(cell, point=None).to_dict()) for cell in which.cells] for which in (one, other)]
        assert rows[0] == rows[1]  # NaN as well


def test_rules_that_were_counted(tmp_path: Path) -> None:
    mesh, rules = garden(), (*RULES, *OF_COUNTS_ONLY)
    made = parts_of(mesh, rules)
    assert_same(check_partials(made, rules), expected(mesh, rules))
    points = np.vstack([part.points for part in cut(mesh)])
    for cell in (cell for one in check_partials(made, rules).outcomes for cell in one.cells):
        assert cell.point is not None
        np.testing.assert_array_equal(points[cell.point], cell.coordinates)
    for at, one in enumerate(made):
        one.save(tmp_path / f"{at}.mgp")
    whole = expected(mesh, ("jens >= 0.2 @ 7",))  # the same rule with another allowance
    assert_same(check_partials([tmp_path / f"{at}.mgp" for at in (2, 0, 1)], ["jens >= 0.2 @ 7"]), whole)


@pytest.mark.parametrize("kept", [tally.EXACT, 10], ids=["values", "bins"])
def test_rules_that_summaries_decide(kept: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (tally, builder):
        monkeypatch.setattr(module, "EXACT", kept)
    mesh = garden()
    made = check_partials(parts_of(mesh), RULES)
    whole = expected(mesh, RULES)
    assert {one.state for one in whole.outcomes} == {State.PASS, State.FAIL, State.UNCHECKED}
    for one, other in zip(made.outcomes, whole.outcomes, strict=True):
        assert (one.text, one.state) == (other.text, other.state), str(one.rule)
        assert one.n_failing == other.n_failing
        listed = [cell.cell for cell in one.cells]  # of the worst cells that are kept
        assert set(listed) <= set(range(mesh.n_cells))
    broken = made.outcomes[0].cells
    assert [cell.cell for cell in broken] == [cell.cell for cell in whole.outcomes[0].cells]
    assert all(cell.status in ("inverted", "inverted_inside") for cell in broken)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("nothing misoriented", "it depends on the cells beside"),
        ("nothing hanging", "it depends on the cells beside"),
        ("jens >= 0.2 for cells 3-5", "it names cells by number"),
        ("scaled_jacobian >= 0.2 in 'material 1'", "of regions scaled_jacobian is not kept"),
        ("aspect_ratio <= 3", "aspect_ratio was not measured"),
    ],
)
def test_what_is_not_decided_is_no_pass(text: str, why: str) -> None:
    made = check_partials(parts_of(garden(), worst=0), [text])
    assert made.state is State.UNCHECKED
    assert why in made.outcomes[0].text
    can_be_counted = "beside" not in why and "number" not in why
    assert ("--rule RULE" in made.outcomes[0].text) == can_be_counted
    assert ("--as-one" in made.outcomes[0].text) != can_be_counted


def test_between_edges_of_bins(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of cells in the bin of the bound it is not known whether they keep it; the others may decide."""
    for module in (tally, builder):
        monkeypatch.setattr(module, "EXACT", 10)
    points = np.tile([(0.0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], (90, 1))
    mesh = Mesh.from_arrays(points, {"tetra": np.arange(360).reshape(90, 4)})  # all are 0.5**0.5
    parts = [meshgauge.partial(one, part=(k, 3)) for k, one in enumerate(cut(mesh))]
    value = 0.5**0.5
    for text, state in (
        (f"jens >= {value - 1e-3}", State.PASS),
        (f"jens >= {value + 1e-3}", State.FAIL),
        ("jens >= 0.70708", State.PASS),  # as the least is known
        ("jens >= 0.70712 @ 100%", State.FAIL if value < 0 else State.PASS),
    ):
        assert check_partials(parts, [text]).state is state, text
    mixed = Mesh.from_arrays(np.vstack([points, points * [1, 1, 0.9]]), {"tetra": np.arange(720).reshape(180, 4)})
    moved = mixed.points.copy()
    moved[:120] *= [1, 1, 1.00005]
    parts = [meshgauge.partial(one, part=(k, 3)) for k, one in enumerate(cut(mixed.replace(points=moved)))]
    made = check_partials(parts, ["jens >= 0.70709 @ 55%"])
    assert made.state is State.UNCHECKED
    assert "between 90 and" in made.outcomes[0].text
    assert check_partials(parts, ["jens >= 0.70709 @ 10%"]).state is State.FAIL
    assert "of 180 cells break it" in check_partials(parts, ["jens >= 0.70709 @ 10%"]).outcomes[0].text


def test_what_is_refused() -> None:
    made = parts_of(garden())
    with pytest.raises(MeshgaugeError, match="measured for fem, not for fv"):
        check_partials(made, purpose="fv")
    with pytest.raises(MeshgaugeError, match="depends on the cells beside"):
        counting(["nothing hanging"])
    with pytest.raises(MeshgaugeError, match="names cells by position"):
        counting(["nothing invalid for cells 0-3"])
    with pytest.raises(MeshgaugeError, match="summaries are enough"):
        counting(["no worse than a.json"])
    spoiled = [replace(one, counts={"nothing invalid": "[]"}) for one in made]
    with pytest.raises(ReadError, match="counts is damaged"):
        check_partials(spoiled, ["nothing invalid"])


def test_the_command(tmp_path: Path, capsys: Captured) -> None:
    for number, part in enumerate(cut(garden())):
        io.write(tmp_path / f"p{number}.vtkhdf", part)
        partial = ["--partial", str(tmp_path / f"p{number}.mgp"), "--rule", "jens >= 0.2 for elements 10-50"]
        assert main(["report", str(tmp_path / f"p{number}.vtkhdf"), *partial, "-q"]) == 0
    files = [str(tmp_path / f"p{number}.mgp") for number in range(3)]
    assert main(["check", *files, "--fail", "nothing invalid @ 90%", "--fail", "jens >= 0.2 @ 90%"]) == 0
    assert main(["check", str(tmp_path / "p*.mgp"), "--fail", "nothing invalid"]) == 1
    assert main(["check", *files, "--warn", "nothing invalid"]) == 0
    assert main(["check", *files, "--fail", "jens >= 0.2 for elements 10-50", "--json"]) == 1
    counted = json.loads(_last_json(capsys))
    assert counted["files"][0]["outcomes"][0]["n_cells"] > 20
    assert main(["check", *files, "--fail", "nothing hanging"]) == 2
    assert "not decided by the partial reports" in " ".join(capsys.readouterr().out.split())
    assert main(["check", files[0], files[2], "--fail", "nothing invalid"]) == 2
    assert "a part is missing" in capsys.readouterr().err
    assert main(["check", files[0], files[2], "--fail", "nothing invalid", "--parts", "2"]) == 1
    assert main(["check", *files, "--write-baseline", str(tmp_path / "b.json")]) == 0
    assert main(["check", *files, "--fail", f"no worse than '{tmp_path / 'b.json'}'"]) == 0
    assert main(["report", str(tmp_path / "p0.vtkhdf"), "--rule", "nothing invalid"]) == 2
    assert "give --partial FILE" in capsys.readouterr().err
    assert main(["report", str(tmp_path / "p0.vtkhdf"), "--partial", str(tmp_path / "x.mgp"), "--rule", "what"]) == 2
    assert not (tmp_path / "x.mgp").exists()


def _last_json(capsys: Captured) -> str:
    out = capsys.readouterr().out
    return out[out.index("{") :]
