"""Pictures of load measures: of one vehicle, of several, of a fleet."""

from __future__ import annotations

from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from pavefem.plotting.style import COLOURS, colour, new_figure, plain

MOST_VEHICLES: Final = len(COLOURS)
"""Most vehicles that are drawn one by one."""


def plot_dlc(dlc: xr.DataArray) -> Figure:
    """Draw dynamic load coefficients: bars for each axle, vehicles side by side.

    Of a fleet of more than six vehicles, boxes show the spread between them.

    Parameters
    ----------
    dlc : DataArray, (axle) or (vehicle, axle)
        As `metrics.dlc` gives it.

    Raises
    ------
    ValueError
        If it has other dimensions.
    """
    rows = _rows("dlc", dlc, "axle")
    places, count = np.arange(rows.sizes["axle"]), rows.sizes["vehicle"]
    figure = new_figure(7.0, 3.6)
    axes = figure.add_subplot()
    title = "Dynamic load coefficient"
    if count > MOST_VEHICLES:
        title += f" of {count} vehicles"
        columns = [column[np.isfinite(column)] for column in rows.to_numpy().T]
        axes.boxplot(columns, positions=places, medianprops={"color": "black"})
    else:
        width = 0.8 / count
        for number, row in enumerate(rows):
            offset = (number + 0.5) * width - 0.4
            axes.bar(places + offset, row, width, color=colour(number), label=_name(row))
        if count > 1:
            axes.legend(fontsize="small")
    axes.set_xticks(places, [str(axle) for axle in rows["axle"].to_numpy()])
    axes.set(title=title, xlabel="axle", ylabel="standard deviation / static load")
    axes.set_ylim(bottom=0.0)
    axes.set_axisbelow(True)
    axes.grid(axis="y", alpha=0.3)
    return figure


def plot_aggregate_force(aggregate: xr.Dataset) -> Figure:
    """Draw the aggregate force along the road over that of the static loads.

    Parameters
    ----------
    aggregate : Dataset
        As `metrics.aggregate_force` gives it: of one vehicle, of several, or of a fleet's sum.

    Raises
    ------
    ValueError
        If it is something else, or of more than six vehicles.
    """
    if not isinstance(aggregate, xr.Dataset) or not {"ratio", "percentile_95"} <= set(aggregate):
        raise ValueError("aggregate must be a Dataset as metrics.aggregate_force gives it")
    rows = _rows("aggregate", aggregate["ratio"], "station")
    count = rows.sizes["vehicle"]
    if count > MOST_VEHICLES:
        raise ValueError(
            f"{count} vehicles are too many for one picture, the limit is {MOST_VEHICLES}: choose "
            "some, or draw aggregate_force(..., fleet=True)"
        )
    percentiles = np.atleast_1d(aggregate["percentile_95"] / aggregate["static"])
    figure = new_figure(9.0, 3.6)
    axes = figure.add_subplot()
    for number, (row, percentile) in enumerate(zip(rows, percentiles, strict=True)):
        name = _name(row) if count > 1 else "along the road"
        axes.plot(rows["station"], row, color=colour(number), linewidth=1.0, label=name)
        axes.axhline(
            percentile,
            color=colour(number),
            linewidth=1.0,
            linestyle="--",
            label=f"95th percentile {percentile:.2f}",
        )
    axes.axhline(1.0, color="black", linewidth=1.4, linestyle=":", label="static loads")
    power = f"$F^{{{aggregate.attrs['power']:g}}}$"
    title = f"Aggregate force: sum of {power} over the axles that pass"
    axes.set(title=title, xlabel="station [m]", ylabel="dynamic sum / static sum")
    axes.legend(fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    axes.grid(alpha=0.3)
    return figure


def plot_spatial_repeatability(sri: xr.DataArray) -> Figure:
    """Draw the spatial repeatability index of every two vehicles of a fleet.

    Parameters
    ----------
    sri : DataArray, (vehicle, other)
        As `metrics.spatial_repeatability` gives it for a fleet.

    Raises
    ------
    ValueError
        If it has other dimensions.
    """
    if not isinstance(sri, xr.DataArray) or set(sri.dims) != {"vehicle", "other"}:
        raise ValueError("sri must be labelled by vehicle and other, as of a fleet")
    matrix = sri.transpose("vehicle", "other").to_numpy()
    figure = new_figure(5.6, 4.6)
    axes = figure.add_subplot()
    image = axes.imshow(matrix, vmin=-1.0, vmax=1.0, cmap="RdBu_r")
    figure.colorbar(image, label="correlation of aggregate forces")
    names = [str(vehicle) for vehicle in sri["vehicle"].to_numpy()]
    every = -(-len(names) // 12)
    ticks = range(0, len(names), every)
    axes.set_xticks(ticks, names[::every], rotation=45.0, ha="right")
    axes.set_yticks(ticks, names[::every])
    if every == 1:
        for (row, column), value in np.ndenumerate(matrix):
            ink = "white" if abs(value) > 0.6 else "black"
            axes.text(column, row, f"{value:.2f}", color=ink, ha="center", va="center")
    axes.set(title="Spatial repeatability index", xlabel="vehicle", ylabel="vehicle")
    return figure


def _rows(name: str, values: xr.DataArray, along: str) -> xr.DataArray:
    """Values of one vehicle or of several, as (vehicle, along)."""
    if not isinstance(values, xr.DataArray) or {*values.dims, "vehicle"} != {along, "vehicle"}:
        raise ValueError(f"{name} must be labelled by {along}, or by vehicle and {along}")
    if "vehicle" not in values.dims:
        values = values.expand_dims("vehicle")
    return values.transpose("vehicle", along)


def _name(row: xr.DataArray) -> str:
    names = [row[name].item() for name in ("vehicle_name", "vehicle") if name in row.coords]
    return plain(str(names[0])) if names else "vehicle"
