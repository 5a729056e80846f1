"""Pictures of a run: deflections, envelope and tire forces."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pavefem.plotting.style import (
    KN,
    MM,
    MOST_POINTS,
    colour,
    dashes,
    draw_line,
    heading,
    new_figure,
)

if TYPE_CHECKING:
    from pavefem.quantities import Quantity
    from pavefem.result import Result

AROUND: Final = 1.0
"""What is shown of a long history before the first axle and behind the last one, s."""
_SHOWN: Final = {
    "deflection": (MM, "mm"),
    "velocity": (MM, "mm/s"),
    "curvature": (1e3, "1/km"),
    "moment": (KN, "kN m"),
    "strain": (1e6, "µm/m"),
    "pressure": (KN, "kPa"),
}
"""Factor and unit that a quantity is drawn in."""


def plot_result(result: Result, x: float | None = None) -> Figure:
    """Draw a run: history at `x`, worst instant, envelope, tire forces along the road.

    Parameters
    ----------
    result : Result
        The run; panels whose history it did not keep are left out.
    x : float, optional
        Place of the history, m; by default the node or station nearest to mid-length.

    Returns
    -------
    matplotlib.figure.Figure
        Made without touching the current figure; ``figure.savefig(path)`` writes it.
    """
    panels: list[Callable[[Axes, Result], None]] = []
    places = result.places
    middle = places[np.abs(places - result.scenario.road.length / 2.0).argmin()]
    place = float(middle if x is None else x)
    for name in result.histories:
        panels.append(partial(draw_history, x=place, quantity=name))
    if result.deflection is not None and result.stations is None and result.forces is not None:
        panels.append(draw_worst_instant)
    panels.append(draw_envelope)
    if result.forces is not None:
        panels.append(draw_forces)
    columns = 1 if len(panels) == 1 else 2
    rows = -(-len(panels) // columns)
    figure = new_figure(6.0 * columns, 3.4 * rows + 0.5)
    for number, panel in enumerate(panels, start=1):
        panel(figure.add_subplot(rows, columns, number), result)
    figure.suptitle(heading(result.scenario))
    return figure


def draw_history(axes: Axes, result: Result, x: float, quantity: Quantity = "deflection") -> None:
    """Draw a quantity at `x` over time, marking when each axle passes.

    Of a long run, what is within a second of that: there is nothing else to be seen.
    """
    factor, unit = _SHOWN[quantity]
    time, history = result.time, result.history(x, quantity).to_numpy() * factor
    passes = _passes(result, x)
    if passes and time.size > MOST_POINTS:
        near = (time > min(passes.values()) - AROUND) & (time < max(passes.values()) + AROUND)
        time, history = time[near], history[near]
    draw_line(axes, time, history, "black")
    for axle, instant in passes.items():
        label = f"axle {axle + 1} passes"
        axes.axvline(instant, color=colour(axle), linewidth=0.9, linestyle="--", label=label)
    if result.forces is not None:
        axes.legend(fontsize="small")
    title = f"{quantity.capitalize()} at x = {x:g} m"
    axes.set(title=title, xlabel="time [s]", ylabel=f"{quantity} [{unit}]")
    axes.grid(alpha=0.3)


def _passes(result: Result, x: float) -> dict[int, float]:
    """When each axle, counted from 0, passes a place, s, as far as that is known."""
    if result.forces is None:
        return {}
    return {
        axle: float(np.interp(x, position, result.forces.time))
        for axle, position in enumerate(result.forces.position.T)
        if position[0] <= x <= position[-1]
    }


def draw_worst_instant(axes: Axes, result: Result) -> None:
    """Draw the deflected shape when the deflection is largest, with the axles on the road."""
    deflection, forces = result.deflection, result.forces
    if deflection is None or forces is None:
        raise ValueError("the deflected shape needs the histories of all nodes and the forces")
    instant = int(np.abs(result.time - result.time_of_lowest[result.lowest.argmin()]).argmin())
    marker = "." if result.x.size <= 101 else ""
    axes.plot(result.x, deflection[instant] * MM, color="black", marker=marker, linewidth=1.2)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.4 * (high - low))  # room for the forces, written above the axles
    label = high + 0.38 * (high - low)
    for axle, (place, force) in enumerate(
        zip(forces.position[instant], forces.force[instant], strict=True)
    ):
        if result.x[0] <= place <= result.x[-1]:
            axes.annotate(
                f"{force * KN:.0f} kN",
                (place, np.interp(place, result.x, deflection[instant]) * MM),
                (place, label),
                ha="center",
                va="top",
                rotation=90,
                fontsize="small",
                color=colour(axle),
                arrowprops={"arrowstyle": "->", "color": colour(axle)},
            )
    title = f"Deflected shape at t = {result.time[instant]:.3f} s"
    axes.set(title=title, xlabel="x [m]", ylabel="deflection [mm]")
    axes.grid(alpha=0.3)


def draw_envelope(axes: Axes, result: Result) -> None:
    """Draw the extremes of every node, its lowest as each axle passes, the largest deflection."""
    worst = int(result.lowest.argmin())
    axes.fill_between(
        result.x, result.lowest * MM, result.highest * MM, alpha=0.25, color=colour(0)
    )
    for axle, peaks in enumerate(result.peak_deflection):
        label = f"lowest as axle {axle + 1} passes"
        draw_line(
            axes,
            result.x,
            -peaks * MM,
            colour(axle),
            linewidth=0.8,
            linestyle=dashes(axle),
            label=label,
        )
    draw_line(axes, result.x, result.highest * MM, "black", label="highest")
    axes.plot(
        result.x[worst],
        result.lowest[worst] * MM,
        "v",
        color="black",
        label=f"largest deflection {result.max_deflection * MM:.3f} mm",
    )
    axes.set(title="Envelope of the deflection", xlabel="x [m]", ylabel="deflection [mm]")
    rows = (len(axes.get_legend_handles_labels()[1]) + 1) // 2
    room = 0.05 + 0.07 * rows  # of the height, below the lines, for the legend
    low, high = axes.get_ylim()
    axes.set_ylim(low - room / (1.0 - room) * (high - low), high)
    axes.legend(fontsize="small", ncols=2, loc="lower center")
    axes.grid(alpha=0.3)


def draw_forces(axes: Axes, result: Result) -> None:
    """Draw the tire force of each axle along the road, and its static load."""
    forces = result.forces
    if forces is None:
        raise ValueError("the tire forces were not kept")
    for axle, static in enumerate(forces.static_loads):
        place = forces.position[:, axle]
        on_road = (place >= result.x[0]) & (place <= result.x[-1])
        draw_line(
            axes,
            place[on_road],
            forces.force[on_road, axle] * KN,
            colour(axle),
            linewidth=1.0,
            linestyle=dashes(axle),
            label=f"axle {axle + 1}",
        )
        axes.axhline(static * KN, color=colour(axle), linewidth=0.7, linestyle=":")
    title = "Tire forces of each axle (dotted: static)"
    axes.set(title=title, xlabel="x [m]", ylabel="tire force [kN]")
    columns = min(5, forces.static_loads.size)
    rows = -(-forces.static_loads.size // columns)
    axes.legend(fontsize="small", ncols=columns, loc="upper center")
    axes.set_ylim(top=axes.get_ylim()[1] + (0.04 + 0.08 * rows) * np.ptp(axes.get_ylim()))
    axes.grid(alpha=0.3)
