"""One definition of what is invalid, degenerate, undecided, not measured: over every status, all consumers agree."""

from __future__ import annotations

import re

import numpy as np
import pytest

from meshgauge import Mesh, Quality, Status, measure
from meshgauge.cells import BY_NAME
from meshgauge.check import check
from meshgauge.check.judge import default_rules
from meshgauge.check.rules import Threshold
from meshgauge.compare.pairs import pair_cells
from meshgauge.compare.scores import scores
from meshgauge.look import colours
from meshgauge.quality.metrics import LIMITS
from meshgauge.quality.summary import summarise
from meshgauge.repair.acceptance import n_unusable, status_counts, violations
from meshgauge.report import FileReport
from meshgauge.report.html.page_cells import cells_to_show, drawable, drawing_code
from meshgauge.report.verdict import verdict
from meshgauge.status import (
    PURPOSES,
    STATUSES,
    Category,
    Purpose,
    category,
    is_degenerate,
    is_invalid,
    is_measured,
    is_solid,
    is_undecided,
    is_unmeasured,
    is_usable,
)
from meshgauge.view.filters import presets

INVALID = {Status.INVERTED, Status.INVERTED_INSIDE, Status.BROKEN, Status.CONCAVE}
DEGENERATE = {Status.DEGENERATE, Status.REPEATED_POINTS}
WITHOUT_VALUE = {Status.BROKEN, Status.NON_FINITE, Status.UNSUPPORTED}
APART = {Status.NOT_SOLID, Status.NOT_SURFACE, Status.GHOST}

every_status = pytest.mark.parametrize("status", Status, ids=lambda status: status.name)
every_purpose = pytest.mark.parametrize("purpose", PURPOSES)

CELL = 13


def invalid(status: Status, purpose: Purpose) -> bool:
    return status in INVALID and not (purpose == "fv" and status == Status.CONCAVE)


def value_of(status: Status) -> float:
    """A J_ENS that does not give the status away where it need not."""
    if status in WITHOUT_VALUE | APART:
        return np.nan
    return {Status.INVERTED: -0.5, Status.CONCAVE: -0.5, Status.REPEATED_POINTS: 0.0}.get(status, 0.9)


def grid(n: int = 3) -> Mesh:
    axis = np.arange(n + 1)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3).astype(float)
    corner = (axis[:n, None, None] * (n + 1) + axis[None, :n, None]) * (n + 1) + axis[None, None, :n]
    x, y = (n + 1) ** 2, n + 1
    steps = np.array([0, x, x + y, y, 1, x + 1, x + y + 1, y + 1])
    return Mesh.from_arrays(points, [("hexahedron", corner.reshape(-1, 1) + steps)])


def quality_of(status: Status, purpose: Purpose = "fem") -> Quality:
    """A grid of good hexahedra of which one is said to be of a status."""
    mesh = grid().replace(purpose=purpose)
    if status in {Status.NOT_SOLID, Status.NOT_SURFACE}:
        types = mesh.types.copy()
        types[CELL] = BY_NAME["polygon"].vtk_id
        mesh = mesh.replace(types=types)
    values, codes = np.ones(mesh.n_cells), np.zeros(mesh.n_cells, np.uint8)
    values[CELL], codes[CELL] = value_of(status), status
    return Quality(mesh, values, codes, {"jens": values})


def test_every_status_has_a_row() -> None:
    assert set(STATUSES) == set(Status)
    assert all(row.name == status.name.lower() for status, row in STATUSES.items())


@every_status
@every_purpose
def test_masks(status: Status, purpose: Purpose) -> None:
    codes = np.array([status], np.uint8)
    assert is_invalid(codes, purpose)[0] == invalid(status, purpose)
    assert is_degenerate(codes)[0] == (status in DEGENERATE)
    assert is_undecided(codes)[0] == (status == Status.UNDECIDED)
    assert is_unmeasured(codes)[0] == (status in WITHOUT_VALUE)
    assert is_measured(codes)[0] == (status not in WITHOUT_VALUE | APART)
    assert is_solid(codes)[0] == (status not in APART)
    concave = purpose == "fv" and status == Status.CONCAVE
    assert is_usable(codes, purpose)[0] == (status in {Status.OK, Status.UNDECIDED} or concave)


@every_status
@every_purpose
def test_summary_and_verdict(status: Status, purpose: Purpose) -> None:
    quality = quality_of(status, purpose)
    n = quality.n_cells
    tally = quality.summary().all
    counts = (tally.n_invalid, tally.n_degenerate, tally.n_undecided, tally.n_unmeasured, tally.n_poor)
    assert counts == (
        invalid(status, purpose),
        status in DEGENERATE,
        status == Status.UNDECIDED,
        status in {Status.NON_FINITE, Status.UNSUPPORTED},
        purpose == "fv" and status == Status.CONCAVE,
    )
    assert tally.n_good == n - (status != Status.OK)
    assert tally.n_cells == sum(counts) + tally.n_good == n - (status in APART)
    level, text = verdict(quality.summary())
    if invalid(status, purpose) or status in DEGENERATE:
        assert level == "bad"
        word = {Status.REPEATED_POINTS: "degenerate", Status.INVERTED_INSIDE: "inverted inside"}
        assert text.startswith(f"1 of {n} cells is {word.get(status, STATUSES[status].name)}")
    elif status in {Status.UNDECIDED, Status.NON_FINITE, Status.UNSUPPORTED}:
        assert level == "unknown"
    elif status == Status.CONCAVE:
        assert level == "poor"
    if status == Status.CONCAVE:  # never called inverted
        assert "inverted" not in text
        assert "usable for finite volumes, not for finite elements" in text
    if status in {Status.OK, Status.GHOST}:
        assert level == "good"


@every_status
@every_purpose
def test_check(status: Status, purpose: Purpose) -> None:
    quality = quality_of(status, purpose)
    broken = {
        str(outcome.rule)
        for outcome in check(quality, default_rules()).outcomes
        if outcome.n_failing > outcome.n_allowed
    }
    assert ("nothing invalid" in broken) == invalid(status, purpose)
    assert ("nothing degenerate" in broken) == (status in DEGENERATE)
    assert ("nothing undecided" in broken) == (status == Status.UNDECIDED)
    assert ("nothing unmeasured" in broken) == (status in WITHOUT_VALUE)
    # An invalid cell passes no threshold, however good its corners are; a flat one none that a flat cell fails.
    (above,) = check(quality, ["jens >= 0.2"]).outcomes
    concave = status == Status.CONCAVE
    assert above.n_failing == (invalid(status, purpose) or status in DEGENERATE | WITHOUT_VALUE or concave)
    (signed,) = check(quality, ["jens >= 0"]).outcomes
    assert signed.n_failing == (invalid(status, purpose) or status in WITHOUT_VALUE or concave)


@every_status
@every_purpose
def test_check_fails_by_default(status: Status, purpose: Purpose) -> None:
    passes = status in {Status.OK} | APART or (status == Status.CONCAVE and purpose == "fv")
    # The faces of the grid stay what they are, whatever a cell is said to be.
    rules = [rule for rule in default_rules(purpose) if not isinstance(rule, Threshold) or rule.metric not in LIMITS]
    assert len(rules) < len(default_rules("fv"))
    assert check(quality_of(status, purpose), rules).is_passed == passes


@every_status
@every_purpose
def test_compare(status: Status, purpose: Purpose) -> None:
    before, after = quality_of(Status.OK, purpose), quality_of(status, purpose)
    merit = scores(after)[CELL]
    if status in WITHOUT_VALUE | APART:
        assert np.isnan(merit)
    elif invalid(status, purpose):
        assert merit == -1
    elif status in DEGENERATE:
        assert merit == 0
    else:
        assert merit > 0
    usable = bool(is_usable(after.status[CELL : CELL + 1], purpose)[0])
    measured = status not in WITHOUT_VALUE | APART
    counts = pair_cells(before, after).all
    assert counts.n_broken == (measured and not usable)
    assert pair_cells(after, before).all.n_repaired == (measured and not usable)
    assert counts.n_unmeasured == (status in WITHOUT_VALUE)


@every_status
@every_purpose
def test_page_and_colours(status: Status, purpose: Purpose) -> None:
    quality = quality_of(status, purpose)
    drawn = drawing_code(status, purpose)
    assert drawn == (
        1 if invalid(status, purpose) else 2 if status in DEGENERATE else 3 if np.isnan(value_of(status)) else 0
    )
    code = quality.status[[CELL]]
    (colour,) = colours.cell_colours(quality.values[[CELL]], is_invalid(code, purpose), is_degenerate(code))
    expected = {1: colours.INVALID, 2: colours.DEGENERATE, 3: colours.UNKNOWN}
    if drawn:
        assert colour.tolist() == colours.rgb(expected[drawn]).tolist()
    else:
        assert colour.tolist() not in [colours.rgb(code).tolist() for code in expected.values()]
    first = cells_to_show(quality, drawable(quality), 1)
    if status not in {Status.OK, Status.UNDECIDED, Status.NOT_SOLID, Status.NOT_SURFACE}:
        assert first.tolist() == [CELL]


@every_status
@every_purpose
def test_view(status: Status, purpose: Purpose) -> None:
    name = STATUSES[status].name
    found = presets(purpose)
    assert (name in found["invalid"][2]) == invalid(status, purpose)
    assert (name in found["poor"][2]) == bool(is_usable(np.array(status, np.uint8), purpose))
    assert name in found["all"][2]
    assert found["invalid"][:2] == (-1, 1)  # whatever its value


@every_status
@every_purpose
def test_plot_and_pipeline(status: Status, purpose: Purpose) -> None:
    pytest.importorskip("pyvista")
    from vtkmodules.util.numpy_support import numpy_to_vtk

    from meshgauge.integrations.vtk import low_cells
    from meshgauge.io.plumbing.vtk import grid as vtk_grid
    from meshgauge.plot.pyvista_cells import bad

    quality = quality_of(status, purpose)
    measured = status not in WITHOUT_VALUE
    assert bad(quality)[CELL] == ((invalid(status, purpose) or status in DEGENERATE) and measured)
    data = vtk_grid(quality.mesh)[0]
    for key, values in quality.cell_data().items():
        array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
        array.SetName(key)
        data.GetCellData().AddArray(array)
    assert low_cells(data).GetNumberOfCells() == (status not in {Status.OK} | APART)


@every_status
@every_purpose
def test_repair(status: Status, purpose: Purpose) -> None:
    """Acceptance gives a valid cell for none that is less, and counts what is left to do as the masks do."""
    good, other = quality_of(Status.OK, purpose), quality_of(status, purpose)
    usable = bool(is_usable(np.array(status, np.uint8), purpose))
    assert n_unusable(other) == (not usable and status not in APART)
    assert sum(status_counts(other).values()) == other.n_cells - (status in APART)
    refused = violations(good, other, strict=False)
    assert refused[CELL] == (status != Status.OK)
    assert refused.sum() == refused[CELL]
    undecided = quality_of(Status.UNDECIDED, purpose)
    assert violations(undecided, other, strict=False)[CELL] == (status not in {Status.OK, Status.UNDECIDED})


@every_purpose
def test_a_purpose_given_to_measure_is_that_of_the_result(purpose: Purpose) -> None:
    quality = measure(grid(), purpose=purpose)
    assert quality.mesh.purpose == quality.summary().purpose == purpose
    assert quality.summary().all.purpose == purpose
    assert FileReport.of(quality).summary.to_dict()["purpose"] == purpose


def test_summaries_of_different_purposes_do_not_merge() -> None:
    a, b = (quality_of(Status.CONCAVE, purpose).summary() for purpose in PURPOSES)
    with pytest.raises(ValueError, match="for fem and for fv"):
        a.merge(b)
    with pytest.raises(ValueError, match="for fem and for fv"):
        a.all.merge(b.all)


@every_purpose
def test_many_cells_are_counted_as_few(purpose: Purpose) -> None:
    """Whole and in slices, over every status at once."""
    rng = np.random.default_rng(0)
    status = rng.choice(np.array(list(Status), np.uint8), 200_000)
    values = np.array([value_of(Status(code)) for code in range(len(Status))])[status]
    types = np.full(len(status), 12, np.uint8)
    whole = summarise(values, status, types, purpose=purpose, threads=2).all
    found = np.bincount(category(status, purpose), minlength=len(Category))
    assert whole.n_invalid == found[Category.INVALID]
    assert whole.n_degenerate == found[Category.DEGENERATE]
    assert whole.n_undecided == found[Category.UNDECIDED]
    assert whole.n_good + whole.n_poor == found[Category.VALID]
    assert whole.n_cells == len(status) - np.count_nonzero(status == Status.GHOST)
    parts = [
        summarise(*(a[i : i + 30_000] for a in (values, status, types)), purpose=purpose, threads=1)
        for i in range(0, 200_000, 30_000)
    ]
    merged = parts[0]
    for part in parts[1:]:
        merged = merged.merge(part)
    assert merged.all == whole


def test_no_module_decides_on_its_own(request: pytest.FixtureRequest) -> None:
    """What is invalid or solid is asked of `meshgauge.status`: no list of statuses stands elsewhere."""
    source = request.config.rootpath / "src" / "meshgauge"
    allowed = {"status.py", "check/words.py"}
    lists = [
        path.relative_to(source).as_posix()
        for path in sorted(source.rglob("*.py"))
        if any("np.isin(" in line and "Status." in line for line in path.read_text(encoding="utf-8").splitlines())
    ]
    assert set(lists) <= allowed
    texts = {path: path.read_text(encoding="utf-8") for path in source.rglob("*.py")}
    assert not [path for path, text in texts.items() if re.search(r"status\b.{0,30}[!=]= Status\.NOT_SOLID", text)]
