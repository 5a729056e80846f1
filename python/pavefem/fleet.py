"""Tire forces of many vehicles at a time."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from pavefem import _core
from pavefem._model import whole_number
from pavefem._progress import progress_bar
from pavefem.forces import MEMORY_LIMIT, TOLERANCE, Interpolation, plan
from pavefem.profile import Profile
from pavefem.vehicle import Vehicle

_STATISTICS: Final = {
    "mean_force": ("N", "mean tire force of an axle"),
    "std_force": ("N", "standard deviation of the tire force of an axle"),
    "min_force": ("N", "smallest tire force of an axle"),
    "max_force": ("N", "largest tire force of an axle"),
    "lift_off_instants": ("1", "instants at which an axle did not press on the road"),
}
"""Columns of what the core gives for each axle: units, and what they are."""


def fleet_forces(
    vehicles: Sequence[Vehicle],
    profile: Profile,
    speed_kmh: ArrayLike = 65.0,
    *,
    dt: float = 1e-3,
    run_in: float = 0.0,
    every: int | None = None,
    stations: ArrayLike | None = None,
    interpolation: Interpolation = "linear",
    lift_off: bool = False,
    tolerance: float = TOLERANCE,
    threads: int | None = None,
    progress: bool = False,
) -> xr.Dataset:
    """Run many vehicles over a profile, each on its own and at its own constant speed.

    The same forces as of `tire_forces`, many vehicles side by side. Memory grows with what is
    kept: statistics of each axle always, histories and forces at stations on request.

    Parameters
    ----------
    vehicles : sequence of Vehicle
        The vehicles, of any kinds.
    profile : Profile
        Elevations.
    speed_kmh : float or array_like
        Speed, km/h, of all vehicles or of each.
    dt : float
        Time step, s.
    run_in : float
        Distance from the first sample, m, over which vehicles settle before anything is kept.
    every : int, optional
        Keep every n-th instant of the forces.
    stations : array_like, optional
        Places, m, in increasing order: keep the force with which each axle passes them (linear
        between instants). Each axle must pass them within the run: from `run_in` on, up to the
        length of the longest vehicle before the end of the profile.
    interpolation, lift_off, tolerance
        As of `tire_forces`.
    threads : int, optional
        Threads to use; by default as many as the machine has processors. They change no number.
    progress : bool
        Show progress when it takes over a second.

    Returns
    -------
    xarray.Dataset
        `static_load`, `mean_force`, `std_force`, `min_force`, `max_force` (N) and
        `lift_off_instants`, of (vehicle, axle); `station_force` (N) of (vehicle, station, axle)
        and `tire_force` (N) of (vehicle, time, axle), if kept; coordinates `vehicle_name`,
        `speed_kmh` of (vehicle) and `axle_offset` (m behind the front axle) of (vehicle, axle).
        NaN stands for an axle that a vehicle has not, and for the time after it has left the
        profile.

    Raises
    ------
    ValueError
        If there is no vehicle, `speed_kmh` is not one for each, a station is not passed by all
        axles, what is to be kept takes over 8 GiB, or as of `tire_forces`.
    SolverError
        As of `tire_forces`.
    """
    if isinstance(vehicles, Vehicle) or not vehicles:
        raise ValueError("vehicles must be a sequence of at least one Vehicle")
    if not isinstance(profile, Profile):
        raise ValueError(f"profile is a {type(profile).__name__}: must be a Profile")
    speeds = np.asarray(speed_kmh, dtype=np.float64)
    if speeds.shape not in ((), (len(vehicles),)):
        raise ValueError(
            f"speed_kmh has shape {speeds.shape}: must be one number, or one for each of "
            f"{len(vehicles)} vehicles"
        )
    speeds = np.broadcast_to(speeds, len(vehicles))
    runs = [
        plan(vehicle, profile, float(speed), dt, run_in, None)
        for vehicle, speed in zip(vehicles, speeds, strict=True)
    ]
    every = None if every is None else whole_number("every", every)
    threads = os.cpu_count() or 1 if threads is None else whole_number("threads", threads)
    ends = [run.end - v.axle_positions[-1] for run, v in zip(runs, vehicles, strict=True)]
    places = _check_stations(stations, runs[0].origin, min(ends))
    axles = max(len(vehicle.tires) for vehicle in vehicles)
    times = 0 if every is None else max(run.steps for run in runs) // every + 1
    # Once as the core has it, and once as the dataset.
    size = 2 * 8 * len(vehicles) * (times + places.size) * axles
    if not size < MEMORY_LIMIT:
        raise ValueError(
            f"{len(vehicles)} vehicles at {times} instants and {places.size} stations would keep "
            f"{size / 2**30:.3g} GiB, the limit is {MEMORY_LIMIT / 2**30:g}: use a larger every, "
            "fewer stations or fewer vehicles at a time"
        )
    with progress_bar(progress, "vehicles") as report:
        found = _core.fleet_forces(
            vehicles=[vehicle.core for vehicle in vehicles],
            runs=np.array([run.row for run in runs]),
            x=profile.x,
            z=profile.z,
            interpolation=interpolation,
            dt=dt,
            lift_off=lift_off,
            tolerance=tolerance,
            every=every,
            stations=places,
            threads=threads,
            progress=report,
        )
    dataset = xr.Dataset(
        coords={
            "axle": ("axle", np.arange(1, axles + 1)),
            "vehicle_name": ("vehicle", [vehicle.name for vehicle in vehicles]),
            "speed_kmh": ("vehicle", np.array(speeds), {"units": "km/h"}),
            "axle_offset": (
                ("vehicle", "axle"),
                _stack([vehicle.axle_positions for vehicle in vehicles], (axles,)),
                {"units": "m", "long_name": "place of an axle behind the front axle"},
            ),
        },
        attrs={"profile": profile.name, "dt": dt, "run_in": run_in},
    )
    newton = {"units": "N"}
    per_axle = _stack([statistics for _, _, statistics in found], (axles, len(_STATISTICS)))
    loads = _stack([vehicle.static_loads for vehicle in vehicles], (axles,))
    dataset["static_load"] = ("vehicle", "axle"), loads, newton | {"long_name": "static axle load"}
    for column, (name, (units, words)) in enumerate(_STATISTICS.items()):
        attributes = {"units": units, "long_name": words}
        dataset[name] = ("vehicle", "axle"), per_axle[..., column], attributes
    if stations is not None:
        dataset = dataset.assign_coords(station=("station", places, {"units": "m"}))
        values = _stack([at_stations for _, at_stations, _ in found], (places.size, axles))
        attributes = newton | {"long_name": "tire force of an axle as it passes"}
        dataset["station_force"] = ("vehicle", "station", "axle"), values, attributes
    if every is not None:
        time = dt * every * np.arange(times, dtype=np.float64)
        dataset = dataset.assign_coords(time=("time", time, {"units": "s"}))
        values = _stack([history for history, _, _ in found], (times, axles))
        attributes = newton | {"long_name": "tire force of an axle"}
        dataset["tire_force"] = ("vehicle", "time", "axle"), values, attributes
    return dataset


def _check_stations(stations: ArrayLike | None, start: float, end: float) -> NDArray[np.float64]:
    """Places that every axle passes, in order; none for None."""
    if stations is None:
        return np.array([])
    places = np.asarray(stations, dtype=np.float64)
    if places.ndim != 1 or places.size == 0:
        raise ValueError(f"stations has shape {places.shape}: must be a list of places, m")
    if not np.isfinite(places).all():
        raise ValueError("stations must be places that are finite, m")
    outside = (places < start) | (places > end)
    if outside.any():
        raise ValueError(
            f"station {places[outside.argmax()]:g} m is not passed by all axles: "
            f"must be within {start:g} to {end:g} m"
        )
    if (np.diff(places) <= 0.0).any():
        raise ValueError("stations must increase")
    return places


def _stack(tables: Sequence[NDArray[np.float64]], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Tables of different sizes in one, filled up with NaN to `shape`."""
    stacked = np.full((len(tables), *shape), np.nan)
    for row, table in zip(stacked, tables, strict=True):
        row[tuple(slice(0, size) for size in table.shape)] = table
    return stacked
