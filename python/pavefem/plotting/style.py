"""What all figures share: units, colours, how one is begun, and names as they are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pavefem.scenario import Scenario

MM: Final = 1e3
KN: Final = 1e-3
COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Told apart by colour-blind readers too."""

BINS: Final = 800
"""Into which the points of a long line go: as many as the pixels that a panel is wide."""
MOST_POINTS: Final = 4 * BINS
"""Up to which a line is drawn as it is."""


def colour(number: int) -> str:
    """Colour of an axle, a track or a vehicle, counted from 0."""
    return COLOURS[number % len(COLOURS)]


def dashes(number: int) -> str:
    """Line style of an axle, counted from 0: it tells apart those that share a colour."""
    return ("-", "--", ":")[number // len(COLOURS) % 3]


def new_figure(width: float, height: float) -> Figure:
    """Begin a figure, inches; pyplot knows nothing of it."""
    return Figure(figsize=(width, height), layout="constrained")


def draw_line(
    axes: Axes,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    ink: str,
    *,
    linewidth: float = 1.2,
    linestyle: str = "-",
    label: str | None = None,
) -> None:
    """Draw a line; of one with more points than a picture has pixels, what is between its extremes.

    There each bin of points spans from its lowest to its highest, as a line would, but what is
    drawn above another remains to be seen, and so does the mean of the bins.
    """
    if x.size <= MOST_POINTS:
        axes.plot(x, y, color=ink, linewidth=linewidth, linestyle=linestyle, label=label)
        return
    starts = np.arange(BINS) * x.size // BINS
    low, high = np.minimum.reduceat(y, starts), np.maximum.reduceat(y, starts)
    means = np.add.reduceat(y, starts) / np.diff(np.append(starts, x.size))
    middles = x[(starts + np.append(starts[1:], x.size)) // 2]
    axes.fill_between(middles, low, high, step="mid", color=ink, alpha=0.35, linewidth=0.0)
    axes.plot(middles, means, color=ink, linewidth=linewidth, linestyle=linestyle, label=label)


def heading(scenario: Scenario) -> str:
    """Say which vehicle runs over what, how fast and how warm."""
    profile = "smooth road" if scenario.profile is None else plain(scenario.profile.name)
    return (
        f"{plain(scenario.vehicle.name)}, {scenario.speed_kmh:g} km/h, "
        f"{scenario.temperature_c:g} °C, {profile}"
    )


def plain(text: str) -> str:
    """Keep a dollar in a name from beginning a formula."""
    return text.replace("$", r"\$")
