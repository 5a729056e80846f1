"""Pictures of a fit: what was measured, what the model answers, what is left."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pavefem.plotting.style import KN, MM, colour, new_figure, plain
from pavefem.studies.measurements import ForceDeflection, Measurement

if TYPE_CHECKING:
    from pavefem.studies.calibration import Calibration

UM: Final = 1e6


def plot_calibration(fit: Calibration) -> Figure:
    """Draw each measurement with its fit, and beside it the residuals.

    Parameters
    ----------
    fit : Calibration
        As `calibrate` gives it.
    """
    rows = len(fit.measurements)
    figure = new_figure(10.0, 3.0 * rows + 0.4)
    parts = zip(fit.measurements, fit.fitted, fit.residuals, fit.noise, strict=True)
    for row, (measured, fitted, residuals, noise) in enumerate(parts):
        left = figure.add_subplot(rows, 2, 2 * row + 1)
        right = figure.add_subplot(rows, 2, 2 * row + 2)
        for number, (name, place, chosen) in enumerate(_series(measured)):
            ink = colour(number)
            value, model = measured.deflection[chosen] * MM, fitted[chosen] * MM
            left.plot(place, value, ".", color=ink, markersize=4.0, alpha=0.6, label=name)
            left.plot(place, model, color=ink, linewidth=1.2)
            right.plot(place, residuals[chosen] * UM, ".", color=ink, markersize=4.0)
        _finish(left, measured, "deflection [mm]")
        _finish(right, measured, "measured less fitted [µm]")
        left.set_title(f"{plain(measured.name)}, {measured.temperature_c:g} °C")
        left.legend(fontsize="small", title="lines: fitted", title_fontsize="small")
        band = 2.0 * UM * float(np.sqrt(np.mean(noise**2)))
        right.axhspan(-band, band, color="black", alpha=0.08, linewidth=0.0)
        right.set_title(f"residuals (band: twice the noise, {band:.3g} µm)")
    return figure


def _series(measured: Measurement) -> Iterator[tuple[str, NDArray[np.float64], Any]]:
    """Yield name, abscissa and choice of the deflections that make one line."""
    if isinstance(measured, ForceDeflection):
        order = np.argsort(measured.force)
        for offset in np.unique(measured.offset):
            chosen = order[measured.offset[order] == offset]
            yield f"{offset:g} m from the load", measured.force[chosen] * KN, chosen
    else:
        for number, place in enumerate(measured.stations):
            yield f"x = {place:g} m", measured.time, (slice(None), number)


def _finish(axes: Axes, measured: Measurement, label: str) -> None:
    of = "force [kN]" if isinstance(measured, ForceDeflection) else "time [s]"
    axes.set(xlabel=of, ylabel=label)
    axes.grid(alpha=0.3)
