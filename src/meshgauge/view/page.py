"""The page: what is on it and which value or action each part stands for. No logic."""

from __future__ import annotations

from collections.abc import Sequence
from string import Template
from typing import Any

import numpy as np

from ..look.colours import DEGENERATE, FAINT, INVALID, POOR, RAMP, UNKNOWN
from ..look.theme import DARK, LIGHT
from .controls import OBLIQUE, OFF, SLICES, Choices
from .filters import presets
from .link import MOST_SHRUNK
from .model import Model

STYLE = Template("""
html, body { overflow: hidden !important; }
.mg { display: grid; grid-template: "left view right" 100% / 336px minmax(0, 1fr) 352px; height: 100vh; height: 100dvh;
  font-size: 13px; position: relative;
  font-family: system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; font-variant-numeric: tabular-nums; }
.mg-side { grid-area: left; overflow-y: auto; padding: 14px 16px; border-right: 1px solid rgba(128,128,128,.22); }
.mg-side.right { grid-area: right; border-right: 0; border-left: 1px solid rgba(128,128,128,.22); }
.mg h1 { font-size: 16px; font-weight: 650; margin: 0; overflow-wrap: anywhere; }
.mg h2 { font-size: 12px; font-weight: 650; letter-spacing: .02em; margin: 18px 0 6px; }
.mg .faint { opacity: .68; }
.mg-verdict { margin: 2px 0 8px; line-height: 1.35; }
.mg .small { font-size: 11px; }
.mg-view { grid-area: view; position: relative; min-width: 0; min-height: 0; overflow: hidden; }
.mg-over { position: absolute; z-index: 2; pointer-events: none; padding: 3px 9px; border-radius: 6px;
  background: rgba(255,255,255,.82); color: $light; }
.v-theme--dark .mg-over { background: rgba(21,25,30,.8); color: $dark; }
.mg-bar { display: none; grid-area: bar; align-items: center; gap: 6px; padding: 6px 10px;
  border-bottom: 1px solid rgba(128,128,128,.22); }
.mg-bar b { flex: 1; min-width: 0; overflow: hidden; text-overflow: ellipsis; white-space: nowrap; }
.mg-ended { left: 50%; bottom: 18px; transform: translateX(-50%); z-index: 9; max-width: calc(100% - 24px);
  width: max-content; font-size: 14px; border: 1px solid currentColor; }
@media (max-width: 1100px) {
  .mg { grid-template: "bar" auto "view" minmax(0, 1fr) / minmax(0, 1fr); }
  .mg-bar { display: flex; }
  .mg-side, .mg-side.right { display: none; grid-area: view; z-index: 5; width: 340px; max-width: 100%;
    background: rgb(var(--v-theme-background)); }
  .mg-side.right { justify-self: end; }
  .mg-side.open { display: block; }
}
@media (max-width: 680px) {
  .mg.open { grid-template: "bar" auto "view" 45% "side" minmax(0, 1fr) / minmax(0, 1fr); }
  .mg-side, .mg-side.right { grid-area: side; width: 100%; border: 0; border-top: 1px solid rgba(128,128,128,.4); }
}
.mg-view img { object-fit: contain; } .mg-near { white-space: nowrap; }
.mg-bars { width: 100%; height: 116px; display: block; touch-action: none; cursor: crosshair; }
.mg-bars .hit { fill: transparent; } .mg-bars .hit:hover { fill: rgba(128,128,128,.16); }
.mg-axis { position: relative; height: 16px; font-size: 11px; opacity: .75; }
.mg-axis span { position: absolute; transform: translateX(-50%); }
.mg-legend { display: flex; align-items: center; gap: 4px 7px; font-size: 11.5px; margin: 6px 0 0; flex-wrap: wrap; }
.mg-legend > span { display: inline-flex; align-items: center; gap: 5px; white-space: nowrap; }
.mg-legend i { display: inline-block; width: 15px; height: 10px; border-radius: 2px; }
.mg-worst { width: 100%; border-collapse: collapse; }
.mg-worst td { padding: 2.5px 4px; } .mg-worst td.n { text-align: right; }
.mg-worst tr.go { cursor: pointer; } .mg-worst tr.go:hover, .mg-worst tr.on { background: rgba(128,128,128,.16); }
.mg-worst button { all: unset; cursor: pointer; } .mg-worst button:focus-visible { outline: 2px solid $focus; }
.mg-beyond { font-weight: 700; color: color-mix(in srgb, $invalid 80%, currentColor); }
.mg-dot { display: inline-block; width: 10px; height: 10px; border-radius: 50%; margin-right: 5px;
  box-shadow: 0 0 0 1px rgba(128,128,128,.5) inset; }
.mg-node td { padding: 2px; text-align: right; font-size: 11px; }
.mg-node th { font-weight: 500; opacity: .68; text-align: right; font-size: 11px; padding: 2px; }
.mg-node tr.worst td { font-weight: 700; background: color-mix(in srgb, $invalid 13%, transparent); }
.mg-tag { display: inline-block; padding: 1px 7px; border-radius: 9px; border: 1px solid rgba(128,128,128,.5); }
.mg-busy { right: 14px; bottom: 12px; }
.mg .v-slider.v-input--horizontal { margin-inline: 4px; } .mg .v-chip { margin: 2px 3px 2px 0 !important; }
.mg .v-slide-group__content { flex-wrap: wrap; } .mg .v-chip-group { padding: 0; }
""").substitute(light=LIGHT["ink"], dark=DARK["ink"], focus=RAMP[1], invalid=INVALID)

CLICK = """
  @pointerdown="window.mgPress = [$event.clientX, $event.clientY]"
  @click="window.mgBox = $event.currentTarget.getBoundingClientRect(), window.mgPress
    && Math.hypot($event.clientX - window.mgPress[0], $event.clientY - window.mgPress[1]) < 4
    && trigger('pick', [($event.clientX - window.mgBox.left) / window.mgBox.width,
      1 - ($event.clientY - window.mgBox.top) / window.mgBox.height])"
"""
"""A press and release at one place picks; a drag moves the camera."""

ENDED = "trame_error_report_msg"
"""State that trame sets in the browser when the program is gone."""

BARS = """
<svg class="mg-bars" viewBox="0 0 400 100" preserveAspectRatio="none" role="img"
  aria-label="Histogram of the quality of the cells that pass the other filters; drag to choose a range">
  <line x1="0" x2="400" y1="99.6" y2="99.6" stroke="currentColor" stroke-opacity="0.35" stroke-width="0.8" />
  <rect v-for="(bin, i) in bins" :key="i" :x="10 * i + 0.8" width="8.4" :y="99 - 96 * bin.heights[0]"
    :height="96 * bin.heights[0]" :fill="bin.colour" stroke="currentColor" stroke-opacity="0.55" stroke-width="0.5"
    :opacity="bin.low >= quality[0] - 1e-9 && bin.high <= quality[1] + 1e-9 ? 1 : 0.25" />
  <template v-for="(bin, i) in bins" :key="i + 200">
    <rect v-for="(layer, j) in bin.layers" :key="j" :x="10 * i + 0.8" width="8.4" :y="99 - 96 * layer.height"
      :height="96 * layer.height" :fill="layer.colour" :data-layer="i"
      :opacity="bin.low >= quality[0] - 1e-9 && bin.high <= quality[1] + 1e-9 ? 1 : 0.25" />
  </template>
  {line}
  <rect v-for="(bin, i) in bins" :key="i + 100" :x="10 * i" y="0" width="10" height="100" class="hit" :data-bin="i"
    @pointerdown="window.mgBin = i, quality = [bin.low, bin.high]"
    @pointerenter="$event.buttons && window.mgBin !== undefined && (quality =
      [bins[Math.min(i, window.mgBin)].low, bins[Math.max(i, window.mgBin)].high])"
    @pointerup="window.mgBin = undefined"><title>{{{{ bin.text }}}}</title></rect>
</svg>
"""
"""The histogram; its bins are 10 wide and 100 high."""

LINE = """<path fill="none" stroke="currentColor" stroke-width="1.6" vector-effect="non-scaling-stroke"
    :d="bins.map((bin, i) => (i ? 'L' : 'M') + 10 * i + ' ' + (99 - 96 * bin.heights[1]) + ' h 10').join(' ')" />"""
"""The second mesh in it."""


def build(server: Any, models: Sequence[Model], choices: Choices, window: Any) -> Any:
    """Make the page; returns the function that sends a new picture to it.

    Names of files and regions reach it as state, never as part of the template, which is a program.
    """
    from trame.ui.vuetify3 import VAppLayout
    from trame.widgets import client, html
    from trame.widgets import vtk as vtk_widgets
    from trame.widgets import vuetify3 as v

    gone = {"raw_attrs": [f''':inert="{ENDED} ? '' : null"''']}
    with VAppLayout(server) as layout:
        layout.root.theme = ("theme",)
        client.Style(STYLE)
        # The link of the page is followed when it is opened, and kept up to date afterwards.
        is_dark = "window.matchMedia('(prefers-color-scheme: dark)').matches"
        client.ClientTriggers(mounted=f"trigger('open_link', [window.location.hash, {is_dark}])")
        client.ClientStateChange(
            value="link", change="window.history.replaceState(null, '', window.location.pathname + '#' + link)"
        )
        with html.Div(classes=("'mg' + (panel ? ' open' : '')",)):
            with html.Div(classes="mg-bar"):
                html.B("{{ names.join(' | ') }}")
                for text, side in (("'Filters'", "left"), ("card ? card.cell_name : 'Cells'", "right")):
                    v.VBtn(
                        f"{{{{ {text} }}}}",
                        click=f"panel = panel === '{side}' ? '' : '{side}'",
                        size="small",
                        variant=(f"panel === '{side}' ? 'flat' : 'tonal'",),
                        classes="text-none",
                        **_raw(data_panel=side),
                    )
            with html.Div(classes=("'mg-side' + (panel === 'left' ? ' open' : '')",), **gone):
                for n in range(len(models)):
                    html.H1(f"{{{{ names[{n}] }}}}")
                    html.Div(f"{{{{ verdicts[{n}] }}}}", classes="mg-verdict faint")
                    html.Div(f"{{{{ notes[{n}] }}}}", v_if=f"notes[{n}]", classes="mg-verdict faint small")
                undefined = any(np.isnan(model.values[model.is_solid]).any() for model in models)
                _histogram(v, html, len(models), undefined, choices, models[0])
                _filters(v, html, choices, max(model.n_layers for model in models))
            with html.Div(classes="mg-view", raw_attrs=[CLICK]):
                remote = vtk_widgets.VtkRemoteView(
                    window, ref="scene", interactive_ratio=0.5, interactive_quality=75, still_quality=95
                )
                for n in range(len(models)):
                    share = 100 / len(models)
                    # Between the left of its pane and the axes at the right.
                    place = f"left: calc({share * n}% + 12px); top: 12px; max-width: calc({share}% - 96px)"
                    with html.Div(classes="mg-over", style=place):
                        if len(models) > 1:
                            html.Span(f"{{{{ names[{n}] }}}}", classes="mr-2")
                        html.Span(
                            f"{{{{ shown[{n}] }}}}", classes="font-weight-bold", **_raw(data_shown=f"{{counts[{n}]}}")
                        )
                if len(models) > 1:
                    html.Div(style=f"position:absolute;left:50%;top:0;bottom:0;width:1px;background:{FAINT};z-index:1")
                html.Div(
                    "{{ note }}",
                    v_if="note",
                    classes="mg-over",
                    style="left: 12px; bottom: 12px",
                    **_raw(role="status"),
                )
                html.Div("drawing", v_if=f"trame__busy && !{ENDED}", classes="mg-over mg-busy")
                html.Div(
                    "The program has ended: this is its last picture. Start meshgauge view again to go on.",
                    v_if=ENDED,
                    classes="mg-over mg-ended",
                    **_raw(role="alert", data_ended=""),
                )
            with html.Div(classes=("'mg-side right' + (panel === 'right' ? ' open' : '')",), **gone):
                _buttons(v, html)
                _card(v, html, len(models))
                if any(model.hard_faces for model in models):
                    _faces(html, len(models))
                _worst(html, len(models))
    # What is shown once the connection is lost: the page as it is, which then says so.
    server.state.trame__template_error = server.state.trame__template_main
    return remote.update


def _raw(**attributes: str) -> dict[str, list[str]]:
    """Attributes that trame does not know of a tag: ``data_x`` is ``data-x``; a value in braces is an expression."""
    raw = []
    for key, value in attributes.items():
        is_bound = value.startswith("{") and value.endswith("}")
        raw.append(f'{":" * is_bound}{key.replace("_", "-")}="{value[1:-1] if is_bound else value}"')
    return {"raw_attrs": raw}


def _histogram(v: Any, html: Any, n_models: int, with_undefined: bool, choices: Choices, model: Model) -> None:
    mesh, poor = model.mesh, model.quality.poor_below
    html.H2("Quality (J_ENS)")
    html.Div(BARS.format(line=LINE if n_models > 1 else ""))
    with html.Div(classes="mg-axis"):
        # Where on the axis, in percent, which number stands.
        for at, text in ((0.0, "−1"), (50.0, "0"), (50.0 * (1 + poor.all), f"{poor.all:g}"), (100.0, "1")):
            shift = {0.0: "translateX(0)", 100.0: "translateX(-100%)"}.get(at, "translateX(-50%)")
            html.Span(text, style=f"left: {at}%; transform: {shift}")
    v.VRangeSlider(
        v_model=("quality",),
        min=-1,
        max=1,
        step=0.01,
        hide_details=True,
        density="compact",
        thumb_size=14,
        track_size=3,
        **_raw(aria_label="Range of quality", data_control="quality"),
    )
    with html.Div(classes="d-flex align-center"):
        html.Span(
            "{{ quality[0].toFixed(2).replace('-', '−') }} ≤ quality {{ quality[1] < 1 ? '<' : '≤' }} "
            "{{ quality[1].toFixed(2).replace('-', '−') }}"
        )
        v.VSpacer()
        for text, (low, high, statuses) in presets(mesh.purpose, poor.all).items():
            chosen = [name for name in choices.statuses if name in statuses]
            v.VBtn(
                text,
                click=f"quality = [{low:g}, {high:g}]; statuses = {chosen}",
                size="x-small",
                variant="tonal",
                classes="ml-1 text-none",
                **_raw(data_range=text),
            )
    with html.Div(classes="mg-legend"):
        for colour, text in ((INVALID, "invalid"), (DEGENERATE, "degenerate"), (POOR, "poor")):
            with html.Span():
                html.I(style=f"background: {colour}")
                html.Span(text)
        with html.Span():
            html.I(style=f"width: 60px; background: linear-gradient(90deg, {', '.join(RAMP)})")
            html.Span(f"{poor.text} to 1")
        if with_undefined:
            html.I(style=f"background: {UNKNOWN}")
            html.Span("undefined")
            v.VBtn(
                "{{ with_undefined ? 'hide' : 'show' }}",
                click="with_undefined = !with_undefined",
                size="x-small",
                variant="tonal",
                classes="text-none",
                **_raw(data_range="undefined"),
            )
    html.H2("Colour by")
    v.VSelect(
        v_model=("colour_by",),
        items=("colourings",),
        density="compact",
        variant="outlined",
        hide_details=True,
        **_raw(aria_label="Colour by", data_control="colour_by"),
    )
    html.Div("{{ legend }}", v_if="legend", classes="faint small", **_raw(data_legend=""))
    html.Div(
        "Bar heights grow as the square root." + (" The line is the second mesh." if n_models > 1 else ""),
        classes="faint small",
    )


def _filters(v: Any, html: Any, choices: Choices, n_layers: int) -> None:
    for title, name, known in (("Type", "types", choices.types), ("Status", "statuses", choices.statuses)):
        html.H2(title)
        with v.VChipGroup(v_model=(name,), multiple=True, column=True, **_raw(data_control=name)):
            for one, n in known.items():
                v.VChip(f"{one.replace('_', ' ')}  {n:,}", value=one, filter=True, size="small", variant="outlined")
    if len(choices.regions) > 1:
        html.H2("Region")
        v.VAutocomplete(
            v_model=("regions",),
            items=(
                "region_items",
                [{"title": f"{name}  ({n:,})", "value": name} for name, n in choices.regions.items()],
            ),
            multiple=True,
            chips=True,
            closable_chips=True,
            density="compact",
            variant="outlined",
            hide_details=True,
            placeholder="all",
            persistent_placeholder=True,
            **_raw(aria_label="Regions"),
        )
    html.H2("Slices")
    for n, names in enumerate(SLICES):
        _slice(v, html, names, n, before=SLICES[n - 1][0] if n else "")
    html.H2(f"Peel {{{{ peel }}}} of {n_layers} layers")
    _slider(v, "peel", "Layers of cells taken off the surface", max(n_layers - 1, 1), 1)
    html.H2("Shrink cells by {{ Math.round(100 * shrink) }} %")
    _slider(v, "shrink", "How much smaller each cell is drawn", MOST_SHRUNK, 0.05)


def _slice(v: Any, html: Any, names: tuple[str, ...], n: int, *, before: str) -> None:
    """The controls of a slice; of a further one once there is the one before it."""
    axis, flipped, at = names
    is_offered = {"v_if": f"{before} !== 'off' || {axis} !== 'off'"} if before else {}
    with html.Div(classes="d-flex align-center mt-1", **is_offered):
        with v.VBtnToggle(v_model=(axis,), mandatory=True, density="compact", variant="outlined", divided=True):
            for value in (OFF, "x", "y", "z", OBLIQUE):
                v.VBtn(value, value=value, size="small", classes="text-none", **_raw(data_axis=f"{value}{n or ''}"))
        v.VSpacer()
        v.VBtn(
            "flip",
            v_if=f"{axis} !== 'off' && {axis} !== 'view'",
            click=f"{flipped} = !{flipped}",
            size="small",
            variant="text",
            classes="text-none",
        )
    _slider(v, at, f"Position of slice {n + 1}", 1, 0.005, v_if=f"{axis} !== 'off'")


def _slider(v: Any, name: str, label: str, most: float, step: float, **attributes: str) -> None:
    v.VSlider(
        v_model=(name,),
        min=0,
        max=most,
        step=step,
        hide_details=True,
        density="compact",
        thumb_size=14,
        track_size=3,
        **attributes,
        **_raw(aria_label=label, data_control=name),
    )


def _buttons(v: Any, html: Any) -> None:
    v.VTextField(
        v_model=("wanted_cell",),
        density="compact",
        variant="outlined",
        hide_details=True,
        placeholder="Go to a cell by its number",
        append_inner_icon="mdi-crosshairs-gps",
        classes="mb-2",
        raw_attrs=["@keydown.enter=\"trigger('find', [wanted_cell])\"", 'aria-label="Go to a cell by its number"'],
    )
    with html.Div(classes="d-flex", style="gap: 4px; flex-wrap: wrap"):
        for icon, text, action in (
            ("mdi-fit-to-page-outline", "Whole mesh", "trigger('whole')"),
            ("mdi-filter-off-outline", "Clear filters", "trigger('reset')"),
            ("mdi-grid", "Edges", "edges = !edges"),
            ("mdi-box-shadow", "Darker hollows", "hollows = !hollows"),
            ("mdi-theme-light-dark", "Dark or light", "theme = theme === 'light' ? 'dark' : 'light'"),
            (
                "mdi-link-variant",
                "Copy the link to this view",
                "window.navigator.clipboard.writeText(window.location.href)",
            ),
            ("mdi-camera-outline", "Picture (PNG)", "utils.download('meshgauge.png', trigger('picture'), 'image/png')"),
        ):
            v.VBtn(icon=icon, click=action, size="small", variant="text", **_raw(title=text, aria_label=text))


def _card(v: Any, html: Any, n_models: int) -> None:
    with html.Div(v_if="card", **_raw(data_card="{card.cell}")):
        with html.Div(classes="d-flex align-center mt-2"):
            html.Span(classes="mg-dot", style=("{background: card.colour}",))
            html.H1("{{ card.cell_name }}", style="flex: 1; text-transform: capitalize")
            v.VBtn(
                icon="mdi-crosshairs-gps",
                click="trigger('fly', [card.mesh, card.cell])",
                size="x-small",
                variant="text",
                **_raw(title="Fly to the cell", aria_label="Fly to the cell"),
            )
            v.VBtn(
                icon="mdi-close",
                click="trigger('forget')",
                size="x-small",
                variant="text",
                **_raw(title="Forget the cell", aria_label="Forget the cell"),
            )
        if n_models > 1:
            html.Div("{{ card.name }}", classes="faint")
        with html.Div(classes="my-1"):
            html.Span("{{ card.type }}  ")
            html.Span("quality {{ card.quality }}", classes="font-weight-bold", **_raw(data_quality="{card.quality}"))
            html.Span("{{ card.status }}", classes="mg-tag ml-2", title=("card.text",))
        html.Div("{{ card.region }}, layer {{ card.layer }}", classes="faint")
        with html.Div(v_if="card.face", classes="mt-2", **_raw(data_of_face="{card.slot}")):
            html.Div("Face of {{ card.face.name }}", classes="font-weight-bold")
            html.Div(
                "{{ one.measure }} {{ one.value }}{{ one.beyond ? ', beyond its limit' : '' }}",
                v_for="one in card.face.measures",
                key=("one.measure",),
                classes=("one.beyond ? 'mg-beyond' : ''",),
            )
        with html.Table(classes="mg-node mt-2", style="width: 100%; border-collapse: collapse"):
            with html.Tr():
                for text in ("node", "J_ENS", "point", "x", "y", "z"):
                    html.Th(text)
            with html.Tr(
                v_for="row in card.nodes",
                key=("row.node",),
                classes=("row.worst ? 'worst' : ''",),
                **_raw(data_node="{row.node}"),
            ):
                html.Td("{{ row.node }}")
                html.Td("{{ row.quality }}")
                html.Td("{{ row.point_name }}")
                for n in range(3):
                    html.Td(f"{{{{ row.x[{n}] }}}}")
        with html.Div(classes="mt-2 small", v_if="card.neighbours.length"):
            html.Span("neighbours ", classes="faint")
            with html.Span(v_for="one in card.neighbours", key=("one.cell",), classes="mg-near mr-2"):
                html.Span(classes="mg-dot", style=("{background: one.colour}",))
                html.Button(
                    "{{ one.name }} ({{ one.quality }})",
                    click="trigger('fly', [card.mesh, one.cell])",
                    **_raw(data_neighbour="{one.cell}"),
                )
        html.Div(
            "The worst node is in bold here, and ringed in the picture.", classes="faint mt-1", style="font-size: 11px"
        )


def _faces(html: Any, n_models: int) -> None:
    """The worst faces for finite volumes; a click goes to one."""
    for n in range(n_models):
        html.H2("Worst faces" + (f" of {{{{ names[{n}] }}}}" if n_models > 1 else ""))
        with (
            html.Table(classes="mg-worst"),
            html.Tr(
                v_for=f"row in faces[{n}]",
                key=("row.key",),
                classes=(f"card && card.mesh === {n} && card.slot === row.slot ? 'go on' : 'go'",),
                click=f"trigger('face', [{n}, row.slot])",
                **_raw(data_face="{row.slot}"),
            ),
        ):
            with html.Td():
                html.Button("{{ row.name }}")
            html.Td("{{ row.measure }}", classes="faint")
            html.Td("{{ row.value }}", classes=("row.beyond ? 'n mg-beyond' : 'n'",))


def _worst(html: Any, n_models: int) -> None:
    for n in range(n_models):
        html.H2("Worst cells" + (f" of {{{{ names[{n}] }}}}" if n_models > 1 else ""))
        with (
            html.Table(classes="mg-worst"),
            html.Tr(
                v_for=f"row in worst[{n}]",
                key=("row.cell",),
                classes=(f"card && card.mesh === {n} && card.cell === row.cell ? 'go on' : 'go'",),
                click=f"trigger('fly', [{n}, row.cell])",
                **_raw(data_worst="{row.cell}"),
            ),
        ):
            with html.Td():
                html.Span(classes="mg-dot", style=("{background: row.colour}",))
                html.Button("{{ row.cell_name }}")
            html.Td("{{ row.type }}")
            html.Td("{{ row.status }}", classes="faint")
            html.Td("{{ row.quality }}", classes="n")
