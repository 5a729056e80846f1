"""Pictures of traffic: where deflections are largest, and when vehicles came by there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pavefem.plotting.style import BINS, MM, colour, new_figure

if TYPE_CHECKING:
    from pavefem.traffic_result import TrafficResult

_KM: Final = 1e-3
_LONG: Final = 3000.0
"""Length from which a road is drawn in km, m."""
_CLOCK: Final = (
    (7200.0, 3600.0, "h"),
    (300.0, 60.0, "min"),
    (0.0, 1.0, "s"),
)
"""Spans from which times are drawn in a unit, s; and the unit, s."""


def plot_traffic_map(result: TrafficResult, n: int = 5) -> Figure:
    """Draw the largest deflection in each lane along the road, as colours and as lines.

    Parameters
    ----------
    result : TrafficResult
        The run.
    n : int
        How many of the worst places are marked.

    Returns
    -------
    matplotlib.figure.Figure
        Made without touching the current figure; ``figure.savefig(path)`` writes it.
    """
    dataset = result.dataset
    lanes, x = dataset["lane"].to_numpy(), dataset["x"].to_numpy()
    factor, unit = _along(dataset.attrs["road_length"])
    starts = np.unique(np.arange(BINS) * x.size // BINS)
    # Of what shares a pixel, the largest.
    peaks = np.maximum.reduceat(-dataset["lowest"].to_numpy(), starts, axis=1) * MM
    edges = np.append(x[starts], x[-1]) * factor
    if edges[-1] == edges[-2]:
        edges, peaks = edges[:-1], peaks[:, :-1]
    figure = new_figure(10.0, 4.2 + 0.35 * lanes.size)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[0.8 + 0.35 * lanes.size, 3.0])
    rows = np.arange(lanes.size + 1) - 0.5
    mesh = above.pcolormesh(edges, rows, peaks, cmap="magma_r", shading="flat", rasterized=True)
    figure.colorbar(mesh, ax=above, label="deflection [mm]")
    above.set_yticks(range(lanes.size), [f"{lane}" for lane in lanes])
    above.set(ylabel="lane", title="Largest deflection")
    middles = 0.5 * (edges[:-1] + edges[1:])
    for number, (lane, row) in enumerate(zip(lanes, peaks, strict=True)):
        below.plot(middles, row, color=colour(number), linewidth=0.9, label=f"lane {lane}")
    worst = result.worst(n)
    places = worst["x"].to_numpy() * factor
    above.plot(places, np.searchsorted(lanes, worst["lane"].to_numpy()), "v", color="#0072b2")
    below.plot(
        places, worst["max_deflection"].to_numpy() * MM, "v", color="black", label="worst places"
    )
    below.set(xlabel=f"x [{unit}]", ylabel="deflection [mm]")
    below.set_ylim(bottom=0.0)
    below.legend(fontsize="small", ncols=min(5, lanes.size + 1), loc="lower center")
    below.grid(alpha=0.3)
    return figure


def plot_time_distance(result: TrafficResult, n: int = 5) -> Figure:
    """Draw where each vehicle's front axle is over time, and the worst places when they are.

    Parameters
    ----------
    result : TrafficResult
        The run.
    n : int
        How many of the worst places are marked.

    Returns
    -------
    matplotlib.figure.Figure
        Made without touching the current figure; ``figure.savefig(path)`` writes it.
    """
    dataset = result.dataset
    lanes, attrs = dataset["lane"].to_numpy(), dataset.attrs
    factor, unit = _along(attrs["road_length"])
    second, clock = next(
        (1.0 / size, name) for span, size, name in _CLOCK if attrs["end"] - attrs["begin"] >= span
    )
    number = dataset["course_passage"].to_numpy()
    points = np.column_stack(
        [dataset["course_time"].to_numpy() * second, dataset["course_x"].to_numpy() * factor]
    )
    lines = np.split(points, np.flatnonzero(np.diff(number)) + 1)
    lane_of = dataset["passage_lane"].to_numpy()[number[_begins(number)]]
    figure = new_figure(10.0, 6.0)
    axes = figure.add_subplot()
    # The more lines there are, the thinner.
    width = float(np.clip(60.0 / max(1, len(lines)), 0.25, 1.0))
    for row, lane in enumerate(lanes):
        own = [line for line, of in zip(lines, lane_of, strict=True) if of == lane]
        axes.add_collection(
            LineCollection(own, colors=colour(row), linewidths=width, label=f"lane {lane}")
        )
    worst = result.worst(n)
    times, places = worst["time"].to_numpy() * second, worst["x"].to_numpy() * factor
    axes.plot(times, places, "o", color="black", fillstyle="none", label="worst places")
    peaks = worst["max_deflection"].to_numpy() * MM
    for time, place, peak in zip(times, places, peaks, strict=True):
        axes.annotate(
            f"{peak:.2f} mm", (time, place), (4, 4), textcoords="offset points", fontsize="small"
        )
    axes.set_xlim(attrs["begin"] * second, attrs["end"] * second)
    axes.set_ylim(0.0, attrs["road_length"] * factor)
    axes.set(title="Vehicles over time", xlabel=f"time [{clock}]", ylabel=f"x [{unit}]")
    legend = figure.legend(fontsize="small", loc="outside right upper")
    for handle in legend.get_lines():
        handle.set_linewidth(1.5)
    axes.grid(alpha=0.3)
    return figure


def _begins(number: NDArray[np.int64]) -> NDArray[np.int64]:
    """Where another number begins."""
    return np.append(0, np.flatnonzero(np.diff(number)) + 1)


def _along(length: float) -> tuple[float, str]:
    """Factor and unit of places on a road."""
    return (_KM, "km") if length >= _LONG else (1.0, "m")
