"""Parts of a run of traffic, put together."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

ADDED: Final = ("passes", "pass_peaks", "deflection_sums", "strain_sums", "force_sums")
"""What adds up over passes."""
_FORCES: Final = ("instants", "dlc", "max_axle_force", "place_of_force", "axle_of_force")
"""What is of its way from the beginning, as far as a part has to follow it."""


def merged(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """Put parts together; see `TrafficResult.merge`."""
    if not parts:
        raise ValueError("nothing to merge: must be at least one result")
    for name, what in (("inputs", "inputs"), ("every", "every"), ("dt", "dt")):
        if len({part.attrs[name] for part in parts}) > 1:
            raise ValueError(f"these are of runs of different {what}, not parts of one")
    unfinished = [part for part in parts if not part.attrs["finished"]]
    if unfinished:
        raise ValueError(f"{len(unfinished)} of {len(parts)} parts are not finished")
    stretches: dict[tuple[float, ...], list[xr.Dataset]] = {}
    for part in parts:
        stretches.setdefault(tuple(part["x"].to_numpy().tolist()), []).append(part)
    periods = [
        sorted((part.attrs["begin"], part.attrs["end"]) for part in stretch)
        for stretch in stretches.values()
    ]
    if any(period != periods[0] for period in periods):
        raise ValueError("each stretch of the road must be there for the same periods")
    for (_, end), (begin, _) in pairwise(periods[0]):
        if begin < end - 1e-9:
            raise ValueError(f"periods overlap: one begins at {begin:g} s, one ends at {end:g} s")
    places = sorted(stretches)
    for before, after in pairwise(places):
        if after[0] <= before[-1]:
            raise ValueError(
                f"stretches overlap: one begins at {after[0]:g} m, one ends at {before[-1]:g} m"
            )
    whole = _end_to_end([_one_after_the_other(stretches[place]) for place in places])
    return whole.assign_attrs(_attributes(parts))


def _one_after_the_other(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """Put periods of one stretch together."""
    parts = sorted(parts, key=lambda part: float(part.attrs["begin"]))
    first = parts[0]
    lowest = np.stack([part["lowest"].to_numpy() for part in parts])
    times = np.stack([part["time_of_lowest"].to_numpy() for part in parts])
    which = lowest.argmin(axis=0)[np.newaxis]
    values: dict[str, Any] = {
        "lowest": lowest.min(axis=0),
        "time_of_lowest": np.take_along_axis(times, which, axis=0)[0],
        **{
            name: np.maximum.reduce([part[name].to_numpy() for part in parts])
            for name in ("highest", "max_strain", "max_force")
        },
        **{name: sum(part[name].to_numpy() for part in parts) for name in ADDED},
    }
    whole = _with_passages(first, parts).assign(
        {name: first[name].copy(data=found) for name, found in values.items()}
    )
    if "deflection" in first:
        histories = [part["deflection"] for part in parts]
        whole = whole.drop_dims("time")
        whole["deflection"] = xr.concat(
            histories, "time", coords="different", compat="equals", join="exact"
        )
    return whole


def _end_to_end(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """Lay stretches end to end."""
    along = {
        dim: xr.concat(
            [
                part[[name for name in part.data_vars if dim in part[name].dims]]
                for part in parts
                if dim in part.dims
            ],
            dim,
            data_vars="all",
            coords="different",
            compat="equals",
            join="exact",
        )
        for dim in ("x", "station")
        if any(dim in part.dims for part in parts)
    }
    first = parts[0].drop_dims([dim for dim in along if dim in parts[0].dims])
    return xr.merge([_with_passages(first, parts), *along.values()], compat="equals", join="exact")


def _with_passages(first: xr.Dataset, parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """Give the first of some parts what passages did in all of them."""

    def of_the_most(name: str, names: Sequence[str]) -> dict[str, NDArray[np.float64]]:
        most = np.stack([np.nan_to_num(part[name].to_numpy()) for part in parts]).argmax(axis=0)
        tables = [np.stack([part[each].to_numpy() for part in parts]) for each in names]
        found = [np.take_along_axis(table, most[np.newaxis], axis=0)[0] for table in tables]
        return dict(zip(names, found, strict=True))

    found = of_the_most("max_deflection", ("max_deflection", "place_of_deflection"))
    found |= of_the_most("max_passage_strain", ("max_passage_strain",))
    found |= of_the_most("instants", _FORCES)
    return first.assign({name: first[name].copy(data=values) for name, values in found.items()})


def _attributes(parts: Sequence[xr.Dataset]) -> dict[str, Any]:
    """Attributes of the whole; work adds up."""
    attrs = [part.attrs for part in parts]
    begin, end = min(each["begin"] for each in attrs), max(each["end"] for each in attrs)
    scenario = json.loads(attrs[0]["scenario"]) | {"period": [begin, end], "part": None}
    return {
        "begin": begin,
        "end": end,
        "done": end,
        "vehicle_seconds": sum(each["vehicle_seconds"] for each in attrs),
        "wall_time": sum(each["wall_time"] for each in attrs),
        "scenario": json.dumps(scenario),
    }
