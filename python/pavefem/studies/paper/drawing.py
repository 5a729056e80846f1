"""Figures and Table III as pictures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pavefem.plotting.style import MM, colour, new_figure, plain
from pavefem.studies.paper.cases import SPEEDS
from pavefem.studies.paper.figures import Curve, Panel, PaperFigure
from pavefem.studies.paper.numbers import PRINTED, TableIII
from pavefem.studies.paper.wording import HEADS, difference, sensitivity

WIDTHS: Final = {1: 7.2, 2: 9.6, 3: 11.0}
"""Of a figure by its panels, inches."""
STYLES: Final[dict[str, dict[str, Any]]] = {
    "line": {"linewidth": 1.3},
    "dashed": {"linewidth": 1.2, "linestyle": "--"},
    "points": {"linestyle": "none", "marker": "o", "markersize": 3.5, "alpha": 0.7},
    "faint points": {"linestyle": "none", "marker": "o", "markersize": 3.0, "color": "0.65"},
    "line and points": {"linewidth": 1.3, "marker": "o", "markersize": 3.5},
}


def draw_figure(figure: PaperFigure) -> Figure:
    """Draw the panels of a figure side by side, with one legend where they have the same curves."""
    panels = figure.panels
    drawn = new_figure(WIDTHS[len(panels)], 3.8)
    shared = len({panel.y_label for panel in panels}) == 1
    axes = drawn.subplots(1, len(panels), sharey=shared, squeeze=False)[0]
    for number, (panel, each) in enumerate(zip(panels, axes, strict=True)):
        _draw_panel(each, panel)
        if number == 0 or not shared:
            each.set_ylabel(f"{panel.y_label} [mm]")
    if shared:
        handles, labels = axes[0].get_legend_handles_labels()
        drawn.legend(
            handles, labels, loc="outside lower center", ncols=len(labels), fontsize="small"
        )
    else:
        for each in axes:
            each.legend(fontsize="small")
    return drawn


def _draw_panel(axes: Axes, panel: Panel) -> None:
    printed = [value * MM for value in panel.printed]
    if len(printed) == 2:
        axes.axhspan(*printed, color="0.9", zorder=0, label="printed range")
    elif printed:
        axes.axhline(printed[0], color="0.5", linestyle=":", label="highest printed")
    for number, curve in enumerate(panel.curves):
        _draw_curve(axes, curve, colour(number))
    axes.set(title=plain(panel.title), xlabel=panel.x_label)
    axes.grid(alpha=0.3)


def _draw_curve(axes: Axes, curve: Curve, shade: str) -> None:
    style: dict[str, Any] = {"color": shade, "label": plain(curve.name)} | STYLES[curve.marks]
    if curve.spread is not None:
        bars: dict[str, Any] = {
            "yerr": curve.spread * MM,
            "capsize": 4.0,
            "elinewidth": 1.0,
            "zorder": 3,
        }
        axes.errorbar(curve.x, curve.y * MM, **bars, **style)
    else:
        axes.plot(curve.x, curve.y * MM, **style)


def draw_table(tables: Mapping[str, TableIII]) -> Figure:
    """Draw Table III: as printed, and by each reading with the difference in percent."""
    figure = new_figure(10.5, 4.6)
    axes = figure.add_subplot()
    axes.set_axis_off()
    named = {"printed": PRINTED} | {f"{name} reading": table for name, table in tables.items()}
    lines = len(HEADS) * len(named)
    axes.set(xlim=(0.0, 6.55), ylim=(lines + 0.3, -1.2))
    places = (2.85, 3.9, 4.95, 6.0)
    heads = [*(f"{speed:g} km/h" for speed in SPEEDS), "mean"]
    for place, head in zip(places, heads, strict=True):
        axes.text(place, -0.5, head, ha="center", va="center", weight="bold")
    axes.text(0.0, -0.5, "Sensitivity of the peak to", va="center", weight="bold")
    line = 0
    for row, label in HEADS.items():
        axes.axhline(line, color="0.3" if line == 0 else "0.75", linewidth=0.8)
        axes.text(0.0, line + 0.5, label, va="center")
        for name, table in named.items():
            grey = "0.4" if table is PRINTED else "black"
            axes.text(1.45, line + 0.5, name, va="center", color=grey)
            for place, text in zip(places, _entries(row, table), strict=True):
                axes.text(place, line + 0.5, text, ha="center", va="center", color=grey)
            line += 1
    axes.axhline(line, color="0.3", linewidth=0.8)
    return figure


def _entries(row: str, table: TableIII) -> list[str]:
    """Entries of a row at each speed, and their mean; with differences where not the printed."""
    values = [*table.rows[row], table.means[row]]
    printed = [*PRINTED.rows[row], PRINTED.means[row]]
    texts = [sensitivity(value) for value in values]
    if table is not PRINTED:
        pairs = zip(texts, values, printed, strict=True)
        texts = [f"{text}  ({difference(ours, theirs)})" for text, ours, theirs in pairs]
    return texts if len(texts) == len(SPEEDS) + 1 else [*texts[:-1], "", texts[-1]]
