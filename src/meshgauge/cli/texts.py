"""What ``--help`` says of each subcommand."""

from __future__ import annotations

from typing import NamedTuple

from ..look.bands import POOR_TEXT


class Text(NamedTuple):
    """The help of a subcommand. Paragraphs are one line each: Typer joins no lines."""

    short: str  #: its line in the list of subcommands
    full: str
    examples: tuple[str, ...] = ()


TEXTS = {
    "report": Text(
        "Measure every cell and report how good the mesh is.",
        f"""Measure every cell and report how good the mesh is.

Says how many cells of which type are invalid, degenerate, poor or good, the minimum, quantiles, mean and histogram of their quality by type, and the worst cells (10; 3 of each of several meshes) with the node that is worst. Quality is J_ENS: [green]1[/green] for the ideal cell of every type, [yellow]below {POOR_TEXT}[/yellow] poor, [magenta]0[/magenta] degenerate, [red]below 0[/red] inverted.

A mesh that is written has the metrics and the status of its cells, and the worst of each point, as data. JSON is described in docs/json-schema.md.

Exit codes: 0 done, 2 some file could not be read or written, 130 interrupted.""",
        (
            "meshgauge report wing.vtu",
            "meshgauge report coarse.msh fine.msh      [dim]which is better, and in what[/dim]",
            "meshgauge report 'runs/**/*.vtu' --json   [dim]for programs[/dim]",
            "meshgauge report wing.vtu -o out.vtu      [dim]to colour by jens in ParaView[/dim]",
            "meshgauge report wing.vtu --csv out.csv   [dim]every cell[/dim]",
            "meshgauge report wing.vtu --html out.html [dim]to look at, and to send[/dim]",
            "meshgauge report wing.vtu --by region     [dim]material by material[/dim]",
            "meshgauge report wing.vtu --compare-metric shape",
            "meshgauge report part_3.vtu --partial p3.mgp  [dim]one part, for 'meshgauge merge'[/dim]",
        ),
    ),
    "merge": Text(
        "Put together what was measured of the parts of a mesh.",
        """Report on a mesh of which every part was measured apart, as by the jobs of an array.

Each job measures its part with [bold]report --partial FILE[/bold]: a file of the mesh, or with [bold]--share K/N[/bold] some of the cells of one large file. The report is that of the whole, to the last bit, but for types of which it has few cells. A part that arrives twice counts once. A missing part, and parts that were measured differently, are an error.

Exit codes: 0 done, 2 some file could not be read, or the parts do not make a mesh, 130 interrupted.""",
        (
            "meshgauge report part_3.vtu --partial p3.mgp",
            "meshgauge merge p*.mgp",
            "meshgauge merge p*.mgp --parts 8 --json",
            "meshgauge report big.vtkhdf --share 3/8 --partial p3.mgp",
        ),
    ),
    "check": Text(
        "Hold meshes against rules, in CI or pre-commit.",
        f"""Hold meshes against rules: exit code 0 if they keep them, 1 if not.

Rules come from --fail and --warn, else from [bold]meshgauge.toml[/bold] or [bold]\\[tool.meshgauge.check][/bold] of pyproject.toml in this folder or above. Without any, every cell must be valid and measured, and more than 1 % below {POOR_TEXT} are a warning.

  METRIC >= NUMBER       [dim]or >, <=, <; a cell without a value never passes[/dim]

  nothing invalid        [dim]or invalid inside, degenerate, unmeasured, undecided, ...[/dim]

  no worse than FILE     [dim]a report stored by --write-baseline or report --json[/dim]

The first two may go on: [bold]@ 1%[/bold] or [bold]@ 5 cells[/bold] may break them; [bold]for tetra, wedge[/bold]; [bold]in inlet, 'layer*'[/bold]. The last: [bold]within 0.01[/bold].

Of each broken rule the worst cells are listed. JSON and the other outputs are described in docs/check.md.

Exit codes: 0 passed, also with warnings, 1 a rule is broken, 2 some mesh or rule could not be checked, 130 interrupted.""",
        (
            f"meshgauge check wing.vtu --fail 'jens >= {POOR_TEXT} @ 1%' --fail 'nothing invalid'",
            "meshgauge check 'meshes/*.vtu' --junit junit.xml --sarif mesh.sarif",
            "meshgauge check wing.vtu --write-baseline wing.json",
            "meshgauge check wing.vtu --fail 'no worse than wing.json within 0.01'",
        ),
    ),
    "compare": Text(
        "Compare meshes: which is better, and in what.",
        """Compare meshes of the same domain: which is better, in what, and for which type of cell.

Shows the quality of each type of cell of all meshes on one axis, the least value, quantiles and shares side by side, and how often a random cell of one is better than a random cell of the [bold]first[/bold] mesh. Where the cells correspond to those of the first, as before and after an improvement, they are compared one by one, and those that lose most are listed with their places. JSON is described in docs/compare.md.

Exit codes: 0 done, 2 some file could not be read, or fewer than two are left, 130 interrupted.""",
        (
            "meshgauge compare before.vtu after.vtu",
            "meshgauge compare gmsh.msh tetgen.vtu netgen.vol --plot meshes.svg",
            "meshgauge compare before.vtu after.vtu --html page.html",
            "meshgauge compare before.vtu after.vtu --json   [dim]for programs[/dim]",
        ),
    ),
    "trend": Text(
        "Show how meshes went over a history of reports.",
        """Show how meshes went over a history of stored reports: what became worse, and when.

Reports are what [bold]report --json[/bold] and [bold]check --write-baseline[/bold] write, oldest first; of a folder its .json files in the order of the numbers in their names. Of each mesh, by its path, the numbers of invalid and degenerate cells, the share that is not good, the least value, 1 % quantile and mean. With [bold]--git[/bold] a file is followed over the commits that changed it, at most 200: the baseline of [bold]check[/bold], renewed from time to time. [bold]--html[/bold] writes charts.

Exit codes: 0 done, 2 some file is no report, 130 interrupted.""",
        (
            "meshgauge report wing.vtu --json > history/2026-03-01.json",
            "meshgauge trend history --html trend.html",
            "meshgauge trend quality.json --git --html trend.html",
        ),
    ),
    "doctor": Text(
        "Say what is wrong with a mesh beside the shapes of its cells.",
        """Say what is wrong with a mesh beside the shapes of its cells.

Finds cells that are numbered in reverse, distinguished from cells that are really inverted; cells that have a point twice or are there twice; faces of three or more cells, and two triangles against a quadrilateral; parts that are not connected; points that coincide, and points of no cell. Nothing is repaired: for cells numbered in reverse see [bold]meshgauge orient[/bold]. JSON is described in docs/doctor.md.

Exit codes: 0 nothing is wrong, 1 something is (0 with [bold]--exit-zero[/bold]), 2 some file could not be read, 130 interrupted.""",
    ),
    "improve": Text(
        "Repair: mend the bad cells of a mesh, or raise all.",
        """Repair a mesh: mend the cells that are invalid or below the target by moving points near them; all else stays to the last bit.

Points move in rings around bad cells that grow only while it helps, and good cells keep their sizes. With [bold]--everywhere[/bold] all points move: the worst cells are made as good as they can be, and the mean is raised. Cells, their numbering, data and regions stay; with [bold]--topology[/bold] tetrahedra are joined anew, with [bold]--split-hopeless[/bold] cells that points cannot mend are split. The result is checked before it is written: no valid cell becomes invalid, inside too, and the worst never falls. What is still below the target is listed with the reason. JSON is described in docs/improve.md.

Of several meshes each is read, repaired and written in turn; one that fails does not stop the others.

[bold]Ctrl-C[/bold] stops at any time and writes the best so far, of several that of the current one; a second one ends the program, and nothing is written.

Exit codes: 0 no cell is invalid now, 1 some still are (what is better is written), 2 could not, 3 what was reached broke a claim, and nothing was written, 130 interrupted twice, 143 terminated (what is better is written).""",
        (
            "meshgauge improve wing.vtu -o better.vtu",
            "meshgauge improve wing.vtu -o better.vtu --everywhere         [dim]raise the worst and the mean of all[/dim]",
            "meshgauge improve wing.vtu -o better.vtu --boundary slide     [dim]points move on the surface, too[/dim]",
            "meshgauge improve wing.vtu -o better.vtu --topology           [dim]tetrahedra are joined anew, too[/dim]",
            "meshgauge improve wing.vtu -o better.vtu --undo undo.npz --html page.html",
            "meshgauge improve wing.inp -o better.inp                      [dim]the deck, its steps and comments; other coordinates[/dim]",
            "meshgauge improve a.vtu b.vtu --orient --output-dir better    [dim]several, renumbered first[/dim]",
        ),
    ),
    "orient": Text(
        "Renumber cells that are numbered in reverse.",
        """Renumber the cells that are numbered in reverse, so that all are right-handed.

Such cells have valid shapes, but solvers and quality tools take them for inverted: half the tetrahedra that FEniCS writes, wedges in the other order, left-handed files. Which they are is known from the faces that cells share; cells that are really inverted are named and left. Points and data stay as they are.

Exit codes: 0 done, 2 the file could not be read or written, 130 interrupted.""",
    ),
    "undo": Text(
        "Bring the file back that improve or orient changed.",
        """Bring the file back that [bold]meshgauge improve[/bold] or [bold]orient[/bold] changed, to its last byte.

UNDO is what --undo kept, or NAME.undo.npz beside a file that was changed with --in-place. It holds digests of the file before and after: one that was changed since is refused.

Exit codes: 0 done, 2 the file is not the one that was written, or could not be read or written, 130 interrupted.""",
        (
            "meshgauge undo wing.inp wing.inp.undo.npz --in-place",
            "meshgauge undo better.vtu undo.npz -o wing.vtu",
        ),
    ),
    "plot": Text(
        "Draw the quality of meshes: charts, the worst cells, a cut.",
        """Draw the quality of meshes: a chart of one or several, or a scene of one.

Charts: [bold]histogram[/bold], [bold]types[/bold] (one a type of cell), [bold]cumulative[/bold] (share of cells at or below each value). Scenes: [bold]worst[/bold] (where the worst cells are, and each from near), [bold]faces[/bold] (the worst faces for finite volumes), [bold]cut[/bold] (the mesh cut open, coloured by quality). Invalid cells are red, poor ones amber, good ones blue, the lighter the better.

Exit codes: 0 done, 2 some file could not be read or the picture not drawn, 130 interrupted.""",
        (
            "meshgauge plot wing.vtu -o wing.png",
            "meshgauge plot coarse.msh fine.msh --kind cumulative -o both.svg",
            "meshgauge plot wing.vtu --scene worst -o worst.png",
            "meshgauge plot wing.vtu --scene cut --normal 0 1 0 -o cut.pdf",
        ),
    ),
    "paraview-plugin": Text(
        "Print where the plugin for ParaView is.",
        "Print where the plugin for ParaView is (docs/integrations.md).",
    ),
    "view": Text(
        "Look at a mesh in a browser, or at two side by side.",
        """Look at a mesh in a browser, or at two side by side.

Cells are coloured by quality (J_ENS) and can be filtered by quality, type, status and region; slice the mesh, peel layers of cells off it, click a cell to see its nodes, and fly to the worst ones. The page's address brings the same view back. Two meshes share one camera and the same filters.

The program draws and the browser shows: nothing leaves this machine, and only its user can connect. It ends with Ctrl-C, or ten minutes after its last page was closed (--idle). Needs [bold]pip install 'meshgauge\\[view]'[/bold]; --screenshot does not.

Exit codes: 0 done, 2 some file could not be read or nothing can be drawn, 130 interrupted.""",
        (
            "meshgauge view wing.vtu",
            "meshgauge view before.vtu after.vtu",
            f"meshgauge view wing.vtu --link 'quality=-1,{POOR_TEXT}' --screenshot bad.png",
        ),
    ),
    "formats": Text(
        "List the formats: which are read, patched and written.",
        """List the formats: their extensions, and whether they are read, patched and written.

Patched: [bold]meshgauge improve[/bold] gives a file back with other coordinates and nothing else touched (docs/formats.md). Written: a mesh of another format is converted to it.""",
    ),
    "explain": Text(
        "Say what a rule, metric, status or purpose means.",
        """Say what a name means: a metric, a status of cells, a word of rules, what a mesh is for ([bold]fem[/bold], [bold]fv[/bold]: the rules that [bold]check[/bold] then holds without any), or a whole rule.""",
        examples=(
            "meshgauge explain inverted_inside",
            "meshgauge explain fv",
            "meshgauge explain 'jens >= 0.2 @ 1%'",
        ),
    ),
    "schema": Text(
        "Print the JSON Schema of what commands print with --json.",
        """Print the JSON Schema (draft 2020-12) of a document that a command prints with [bold]--json[/bold]; without a name those there are. docs/json-schema.md says the same in tables.""",
        ("meshgauge schema", "meshgauge schema report > report.schema.json"),
    ),
    "metrics": Text(
        "List the metrics: range, acceptable range, ideal, cells, reference.",
        "List the metrics: range, acceptable range, value on the ideal cell, cells, reference.",
    ),
}
"""The help of every subcommand, by its name."""
