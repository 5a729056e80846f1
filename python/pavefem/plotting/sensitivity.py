"""Pictures of what matters: one parameter at a time, Morris' effects, Sobol's indices."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pavefem.plotting.style import KN, MM, colour, new_figure, plain

_SCALES: Final = {"m": (MM, "mm"), "N": (KN, "kN")}
"""How outputs of some units are shown."""


def plot_tornado(found: xr.Dataset, output: str | None = None) -> Figure:
    """Draw what each parameter does on its own, the one that does most on top.

    Parameters
    ----------
    found : Dataset
        As `studies.tornado` gives it.
    output : str, optional
        Which output; needed where there are several.

    Raises
    ------
    ValueError
        If it is something else, or has no such output.
    """
    shown = _of_output(found, "at_low", output)
    factor, label = _scale(shown)
    shown = shown.sortby(abs(shown["at_high"] - shown["at_low"]))
    middle = factor * float(shown["middle"])
    figure, axes = _bars(shown, f"{_name(shown)}, one parameter at a time")
    for number, end in enumerate(("low", "high")):
        change = factor * shown[f"at_{end}"].to_numpy() - middle
        # Side by side: both ends may lie on one side of the middle.
        _half_bars(axes, number, change, left=middle, label=f"at the {end} end")
    axes.axvline(middle, color="black", linewidth=1.0)
    axes.legend(fontsize="small", loc="lower right")
    axes.set_xlabel(label)
    return figure


def plot_morris(found: xr.Dataset, output: str | None = None) -> Figure:
    """Draw Morris' effects: bars of mu* with confidence, and sigma over mu*.

    Parameters
    ----------
    found : Dataset
        As `studies.morris` gives it.
    output : str, optional
        Which output; needed where there are several.

    Raises
    ------
    ValueError
        If it is something else, or has no such output.
    """
    shown = _of_output(found, "mu_star", output).sortby("mu_star")
    factor, label = _scale(shown)
    mu_star, sigma = (factor * shown[name].to_numpy() for name in ("mu_star", "sigma"))
    confidence = factor * shown["mu_star_confidence"].to_numpy()
    figure, axes = _bars(shown, f"{_name(shown)}: mean effect of a whole range", columns=2)
    axes.barh(np.arange(mu_star.size), mu_star, xerr=confidence, color=colour(0), capsize=3.0)
    axes.set_xlabel(f"mu*, {label}")
    beside = figure.add_subplot(1, 2, 2)
    for number, name in enumerate(shown["parameter"].to_numpy()):
        beside.plot(mu_star[number], sigma[number], "o", color=colour(number), label=plain(name))
    most = 1.1 * max(mu_star.max(), sigma.max())
    beside.plot([0.0, most], [0.0, most], color="black", linewidth=0.8, linestyle=":")
    beside.set(xlabel=f"mu*, {label}", ylabel=f"sigma, {label}", xlim=(0, most), ylim=(0, most))
    beside.set_title("above: depends on the others, or curved")
    beside.legend(fontsize="small")
    beside.grid(alpha=0.3)
    return figure


def plot_sobol(found: xr.Dataset, output: str | None = None) -> Figure:
    """Draw Sobol's first-order and total indices as bars with their confidence intervals.

    Parameters
    ----------
    found : Dataset
        As `studies.sobol` gives it.
    output : str, optional
        Which output; needed where there are several.

    Raises
    ------
    ValueError
        If it is something else, or has no such output.
    """
    shown = _of_output(found, "first_order", output).sortby("total")
    figure, axes = _bars(shown, f"{_name(shown)}: parts of the variance")
    bars = (("total", "total: with all interactions"), ("first_order", "first order: on its own"))
    for number, (name, text) in enumerate(bars):
        error = shown[f"{name}_confidence"].to_numpy()
        values = shown[name].to_numpy()
        _half_bars(axes, 1 - number, values, xerr=error, capsize=3.0, label=text)
    axes.set_xlim(left=min(0.0, axes.get_xlim()[0]))
    level = 100.0 * found.attrs["level"]
    axes.set_xlabel(f"Sobol index, with {level:g} % interval")
    axes.legend(fontsize="small", loc="lower right")
    return figure


def _half_bars(axes: Axes, number: int, values: NDArray[np.float64], **style: Any) -> None:
    """Draw one of two bars of each parameter, the first above the second."""
    places = np.arange(values.size) + 0.2 - 0.4 * number
    axes.barh(places, values, height=0.4, color=colour(number), **style)


def _of_output(found: xr.Dataset, variable: str, output: str | None) -> xr.Dataset:
    """Part of a study that is of one output."""
    if not isinstance(found, xr.Dataset) or variable not in found:
        raise ValueError(f"found must be a Dataset with {variable}, as the study gives it")
    names = found["output"].to_numpy().tolist()
    if output is None and len(names) == 1:
        [output] = names
    if output not in names:
        raise ValueError(f"output = {output!r}: must be one of {names}")
    return found.sel(output=output)


def _bars(shown: xr.Dataset, title: str, columns: int = 1) -> tuple[Figure, Axes]:
    """Begin a figure of horizontal bars, one for each parameter and its range."""
    figure = new_figure(8.0 if columns == 1 else 11.0, 0.55 * shown.sizes["parameter"] + 1.5)
    axes = figure.add_subplot(1, columns, 1)
    labels = [
        f"{plain(name)}\n{low:g} to {high:g} {units}".rstrip()
        for name, low, high, units in zip(
            *(shown[key].to_numpy() for key in ("parameter", "low", "high", "units")), strict=True
        )
    ]
    axes.set_yticks(np.arange(len(labels)), labels, fontsize="small")
    axes.set_title(title)
    axes.set_axisbelow(True)
    axes.grid(axis="x", alpha=0.3)
    return figure, axes


def _name(shown: xr.Dataset) -> str:
    return plain(str(shown["output"].item())).replace("_", " ")


def _scale(shown: xr.Dataset) -> tuple[float, str]:
    """Factor and label of an output."""
    units = str(shown["output_units"].item())
    factor, units = _SCALES.get(units, (1.0, units))
    return factor, f"{_name(shown)} [{units}]" if units else _name(shown)
