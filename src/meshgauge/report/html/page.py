"""Sections made into a page: one text with its styles, scripts, shapes and licences."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._version import __version__
from ...errors import FailedFile
from ...files import output
from ...look import bands, colours, style, theme
from ...look.names import cell_entry, listed, point_entry, point_name
from ...quality.poor import limit_of
from .. import beside
from ..finite_volume import face_text, place
from ..over_time import Trend, trends_of
from ..record import FileReport, StepOf
from . import charts
from .over_time_charts import OverTime
from .section import BUDGET, NOT_DRAWN, Section, section, section_in_slices, section_without_model
from .sketch import sketch

if TYPE_CHECKING:
    import jinja2

    from ...doctor.streamed.passes import Share
    from ...quality.measure import Quality
    from ...quality.summary import Tally
    from ...quality.worst import StatusCells
    from ...slices import Job, Partial

SCRIPTS = ("shaders.js", "model.js", "hollows.js", "stage.js", "cards.js", "meshview.js", "wipe.js", "page.js")
"""Our own, in the order in which they are run."""

LIBRARY = "vendor/three.min.js"


def page(
    sections: Sequence[Section],
    failures: Sequence[FailedFile] = (),
    *,
    title: str = "",
    lead: Any = None,
    templates: str | None = None,
    over_time: Sequence[Trend] = (),
) -> str:
    """A page of sections: the whole text of an HTML file that needs nothing else.

    Parameters
    ----------
    sections
        One for each mesh, from `section`.
    failures
        Files that could not be read or measured; they are named.
    title
        Of the page; by default the names of the files.
    lead
        What comes before the sections of several meshes: anything with a ``template``, a name in ``templates``.
    templates
        A package with a folder ``templates`` of its own, where the template of a section may be: ``{kind}.html.jinja``.
    over_time
        How the time steps of files go that are among the sections.
    """
    scripts = [_file(LIBRARY), "\n".join(_file(f"assets/{name}") for name in SCRIPTS)]
    limits = list(dict.fromkeys(one.summary.poor_below.text for one in sections))
    has_models = any(one.model is not None or one.cards for one in sections)
    text = (
        _environment(templates)
        .get_template("page.html.jinja")
        .render(
            title=title or _title(sections, failures),
            sections=sections,
            failures=[(failure.path, failure.reason) for failure in failures],
            version=__version__,
            theme=theme.css(),
            style=_file("assets/page.css"),
            scripts=scripts if has_models else scripts[1:],
            hashes=[_hash(script) for script in scripts],
            licences=[_file(f"vendor/{name}.LICENSE.txt") for name in ("three", "fflate")] if has_models else [],
            stops=colours.STOPS,
            overlay=charts.overlay([(one.path, one.summary) for one in sections], 40),
            lead=lead,
            over_time=[OverTime.of(one) for one in over_time if len(one.numbers) > 1],
            poor_text=style.enumeration(limits) or bands.POOR_TEXT,
        )
    )
    # Names of files and of regions are bytes that need not be text: lone surrogates are no UTF-8.
    return text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")


def write(path: str | Path, text: str) -> None:
    """Write a page.

    Raises
    ------
    WriteError
        If it cannot be written; nothing is left half-written then.
    """
    output.write_text(path, text)


class HtmlWriter:
    """Gathers a section for each mesh; the page appears, whole, when the ``with`` block ends without an exception.

    An older page stays if no mesh was added. ``-`` means standard output.

    Raises
    ------
    WriteError
        If the file cannot be written.
    """

    def __init__(self, path: str | Path, *, n_files: int = 1, bins: int = 20) -> None:
        self.path = Path(path)
        self.bins = bins
        self.budget = BUDGET // max(n_files, 1)
        self._sections: list[Section] = []
        self._failures: list[FailedFile] = []
        self._steps: list[tuple[StepOf, Tally]] = []

    def __enter__(self) -> HtmlWriter:
        output.check(self.path, text=True)  # known before an hour of measuring, not after
        return self

    def add(self, quality: Quality, report: FileReport) -> None:
        """Append a mesh; nothing of it is kept but its section."""
        self._add(section(quality, report, bins=self.bins, budget=self.budget), report)

    def add_without_model(self, report: FileReport, why: str = NOT_DRAWN) -> None:
        """Append a mesh that was measured slice by slice or in parts, see `section_without_model`."""
        self._add(section_without_model(report, bins=self.bins, why=why), report)

    def add_in_slices(
        self,
        job: Job,
        partial: Partial,
        *,
        path: str,
        step: StepOf | None,
        with_diagnosis: bool,
        memory: int | None,
        tell: Share | None = None,
    ) -> FileReport:
        """Append a mesh that was measured slice by slice, with its picture, see `section_in_slices`; the report."""
        made, report = section_in_slices(
            job,
            partial,
            path=path,
            step=step,
            with_diagnosis=with_diagnosis,
            memory=memory,
            tell=tell,
            bins=self.bins,
            budget=self.budget,
        )
        self._add(made, report)
        return report

    def _add(self, made: Section, report: FileReport) -> None:
        self._sections.append(made)
        if report.step is not None:
            self._steps.append((report.step, report.summary.all))

    def fail(self, failure: FailedFile) -> None:
        """Name a file that could not be reported."""
        self._failures.append(failure)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None and self._sections:
            write(self.path, page(self._sections, self._failures, over_time=trends_of(self._steps)))


def _title(sections: Sequence[Section], failures: Sequence[FailedFile]) -> str:
    paths = [one.path for one in sections] or [failure.path for failure in failures]
    names = [Path(path).name or path for path in paths]
    return f"{', '.join(names[:3])}{', …' if len(names) > 3 else ''} – mesh quality"


@cache
def _file(name: str) -> str:
    """A file that is shipped beside this one."""
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def _hash(script: str) -> str:
    """What the page's own policy allows to run: this script, and nothing that a file name might smuggle in."""
    return base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")


@cache
def _environment(package: str | None) -> jinja2.Environment:
    import jinja2

    packages = [name for name in (__package__, package) if name is not None]

    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(name) for name in packages]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "number": style.number,
        "quality": style.quality,
        "place": place,
        "face_text": face_text,
        "beside_nodes": beside.nodes,
        "beside_edges": beside.edges,
        "percent": style.percent,
        "plural": style.plural,
        "spark": charts.spark,
        "sketch": sketch,
        "cell_entry": cell_entry,
        "point_entry": point_entry,
        "point_name": point_name,
        "cells_listed": _cells_listed,
        "coordinates": style.coordinates,
        "band": bands.name,
        "colour": colours.colour,
        "shade": _shade,
        "limit_of": limit_of,
        "finite": _finite,
    }
    environment.globals |= {
        "marks": style.MARKS,
        "beside_legend": beside.LEGEND,
        "poor_below": bands.POOR_TEXT,
        "usual_poor": bands.POOR,
        "chart_height": charts.HEIGHT,
        "chart_width": charts.WIDTH,
    }
    environment.policies["json.dumps_kwargs"] = {"sort_keys": False, "allow_nan": False, "separators": (",", ":")}
    return environment


def _shade(value: float, poor: float) -> float:
    return float(colours.shade(np.array([float(value)]), poor)[0])


def _cells_listed(finding: StatusCells) -> str:
    """The first cells of a status: ``cells 0, 1, ...``, with the numbers of the file, if it has any."""
    return listed("cell", finding.cells, finding.labels, more=finding.n_cells > len(finding.cells))


def _finite(item: Any) -> Any:
    """A copy in which every float that JSON cannot hold is None."""
    if isinstance(item, dict):
        return {key: _finite(value) for key, value in item.items()}
    if isinstance(item, (list, tuple)):
        return [_finite(value) for value in item]
    return None if isinstance(item, float) and (item != item or item in (float("inf"), float("-inf"))) else item
