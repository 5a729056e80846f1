"""How hard vehicles load a road: measures of their tire forces.

What is measured is a run (`TireForces` or a `Result`) or an `xarray.Dataset` with the variables of
`TireForces.dataset`, any leading dimension such as ``vehicle`` going through. A fleet may have its
statistics only: ``static_load``, ``mean_force`` and ``std_force`` (vehicle, axle), and
``station_force`` (vehicle, station, axle), the force with which an axle passes a station. Its
coordinate ``axle_offset`` (vehicle, axle), the place of an axle behind the front one, tells groups
of axles apart where there are no histories. An axle that a vehicle does not have is NaN in all of
them, and NaN in what is returned; after the end of a run, histories may be filled with NaN.

Sources
-------
Sweatman, A study of dynamic wheel forces in axle group suspensions of heavy vehicles (1983):
    dynamic load coefficient, load sharing coefficient.
Eisenmann, Dynamic wheel load fluctuations: road stress (1975): road stress factor.
Cebon, Handbook of Vehicle-Road Interaction (1999): aggregate force and its 95th percentile.
Cole, Collop, Potter and Cebon, Spatial repeatability of measured and simulated vehicle tyre forces
    (1996): spatial repeatability index.
Potter, Cebon and Cole, Assessing 'road-friendliness': a review (1997): load sharing coefficient.
de Pont, Assessing heavy vehicle suspensions for road wear (1997): dynamic load sharing.
AASHO Road Test (1962): the fourth power of axle loads.
"""

from __future__ import annotations

import math
from numbers import Real
from typing import Final, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from pavefem.forces import TireForces
from pavefem.profile import MAX_SAMPLES, finite_vector
from pavefem.result import Result
from pavefem.units import GROUP_SPACING, part_groups
from pavefem.vehicle import Vehicle

Forces = TireForces | Result | xr.Dataset
_Numbers = TypeVar("_Numbers", float, NDArray[np.float64], xr.DataArray)

STATION_SPACING: Final = 0.25
"""Spacing of stations where none are given, m: a tire print is hardly longer, and the wave that an
axle hopping at 15 Hz leaves on the road at 80 km/h is six times as long."""

_VARIABLES: Final = {
    "tire_force": ("N", ("time", "axle")),
    "axle_position": ("m", ("time", "axle")),
    "axle_offset": ("m", ("axle",)),
    "static_load": ("N", ("axle",)),
    "mean_force": ("N", ("axle",)),
    "std_force": ("N", ("axle",)),
    "station_force": ("N", ("station", "axle")),
}
"""Units and trailing dimensions of what is read from a dataset."""


def station_forces(forces: Forces, stations: ArrayLike | None = None) -> xr.DataArray:
    """Force with which each axle passes each station.

    Parameters
    ----------
    forces : TireForces, Result or Dataset
        A run, or a fleet; one that has no histories but a ``station_force`` gives that.
    stations : array_like, shape (stations,), optional
        Places along the road, m, increasing; by default every 0.25 m that all axles pass.

    Returns
    -------
    DataArray, (..., station, axle)
        Force, N, linear between instants; NaN at a station that the axle does not pass.

    Raises
    ------
    ValueError
        If stations do not increase, a variable is missing, of other units or not finite, a history
        has fewer than two instants, or an axle does not go forward.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.array([0.0, 0.1])
    >>> place = np.array([[5.0, 1.0], [7.0, 3.0]])
    >>> force = np.array([[50e3, 80e3], [54e3, 90e3]])
    >>> run = TireForces(time, place, force, static_loads=np.array([52e3, 85e3]))
    >>> station_forces(run, [2.0, 5.5]).to_numpy()
    array([[   nan, 85000.],
           [51000.,    nan]])
    """
    dataset = _dataset(forces)
    static = _static(dataset)
    places = _default_stations(dataset) if stations is None else _stations("stations", stations)
    if _kept_at_stations(dataset):
        kept = _of_axles(dataset, static, "station_force")
        if np.isinf(kept).any():
            raise ValueError("station_force is infinite somewhere: must be finite, or NaN")
        index = _nearest(_default_stations(dataset), places)
        passing = kept.isel(station=index)
    else:
        if "axle_position" not in dataset:
            raise ValueError(
                "the dataset has neither station_force nor axle_position: give stations to "
                "fleet_forces"
            )
        passing = xr.apply_ufunc(
            _passing,
            _history(dataset, static, "axle_position"),
            _history(dataset, static, "tire_force"),
            input_core_dims=[["time"], ["time"]],
            output_core_dims=[["station"]],
            vectorize=True,
            kwargs={"stations": places},
        ).transpose(..., "station", "axle")
    metres = {"units": "m", "long_name": "place along the road"}
    passing = passing.assign_coords(station=("station", places, metres))
    return _labelled(passing, "station_force", "N", "force of an axle as it passes a station")


def dlc(forces: Forces) -> xr.DataArray:
    """Dynamic load coefficient of each axle: ``std(F) / F_static`` (Sweatman 1983).

    Parameters
    ----------
    forces : TireForces, Result or Dataset
        A run, all of whose instants count (its run-in is not among them), or a fleet, by its
        ``std_force`` where it has no histories.

    Returns
    -------
    DataArray, (..., axle)

    Raises
    ------
    ValueError
        If a variable is missing, of other units or not finite, or a history has fewer than two
        instants.

    Examples
    --------
    >>> import pavefem as pf
    >>> profile = pf.Profile.iso8608("B", length=300.0, seed=1)
    >>> run = pf.tire_forces(pf.vehicles.tandem_truck(), profile, speed_kmh=65.0, run_in=50.0)
    >>> dlc(run).to_numpy().round(3)
    array([0.172, 0.177, 0.167])
    """
    dataset = _dataset(forces)
    static = _static(dataset)
    if "tire_force" in dataset:
        force = _history(dataset, static, "tire_force")
        spread = ((force - force.mean("time")) ** 2).mean("time") ** 0.5
    elif "std_force" in dataset:
        spread = _statistic(dataset, static, "std_force")
    else:
        raise ValueError("the dataset has neither tire_force nor std_force")
    return _labelled(spread / static, "dlc", "1", "dynamic load coefficient")


def road_stress_factor(dlc: _Numbers) -> _Numbers:
    """Road stress factor ``1 + 6 DLC² + 3 DLC⁴`` (Eisenmann 1975).

    It is the mean fourth power of a Gaussian force over the fourth power of the static load,
    ``E[F⁴] / F_static⁴``, exactly.

    Parameters
    ----------
    dlc : float, ndarray or DataArray
        Dynamic load coefficients; NaN in a DataArray stands for an axle that is not there.

    Returns
    -------
    float, ndarray or DataArray
        As given.

    Raises
    ------
    ValueError
        If a coefficient is negative or not finite.

    Examples
    --------
    >>> round(road_stress_factor(0.2), 4)
    1.2448
    """
    values = np.asarray(dlc, dtype=np.float64)
    # NaN is an axle that is not there, where axles have labels.
    allowed = np.isfinite(values) & (values >= 0.0)
    if isinstance(dlc, xr.DataArray):
        allowed |= np.isnan(values)
    if not allowed.all():
        raise ValueError(f"dlc = {values[~allowed].flat[0]:g}: must be finite and not below 0")
    factor = 1.0 + 6.0 * values**2 + 3.0 * values**4
    if isinstance(dlc, xr.DataArray):
        return _labelled(dlc.copy(data=factor), "road_stress_factor", "1", "road stress factor")
    return float(factor) if factor.ndim == 0 else factor  # type: ignore[return-value]


def aggregate_force(
    forces: Forces,
    stations: ArrayLike | None = None,
    power: float = 4.0,
    *,
    fleet: bool = False,
) -> xr.Dataset:
    """Aggregate force along the road: ``A = sum_j F_j^n`` over the axles j that pass a station.

    With n = 4 it measures the fatigue that a passage takes from each piece of the road; its 95th
    percentile over the stations stands for the worst of them (Cebon 1999). A force below zero, of a
    linear tire that would pull at the road, counts as zero.

    Parameters
    ----------
    forces : TireForces, Result or Dataset
        A run or a fleet.
    stations : array_like, shape (stations,), optional
        Places along the road, m, increasing; by default those of the fleet's ``station_force``, or
        every 0.25 m (`STATION_SPACING`) that all axles of all vehicles pass.
    power : float
        n: 4 for fatigue, 1 for permanent deformation.
    fleet : bool
        Sum over the vehicles too: what each station takes when every vehicle passes once.

    Returns
    -------
    Dataset
        ``aggregate`` (..., station), N^n; ``static`` (...), the same sum of the static loads;
        ``ratio`` (..., station), the one over the other; ``percentile_95`` (...), of ``aggregate``
        over the stations. Only stations that every axle passes count; those that were given and
        do not are listed in ``left_out``.

    Raises
    ------
    ValueError
        If no station is passed by every axle, the power is not above 0 or too high to compute, or
        for what `station_forces` refuses.

    Examples
    --------
    >>> import pavefem as pf
    >>> profile = pf.Profile.iso8608("B", length=300.0, seed=1)
    >>> run = pf.tire_forces(pf.vehicles.tandem_truck(), profile, speed_kmh=65.0, run_in=50.0)
    >>> found = aggregate_force(run)
    >>> found.sizes["station"], found["aggregate"].attrs["units"]
    (977, 'N^4')
    >>> round(float(found["percentile_95"] / found["static"]), 2)
    2.55
    """
    dataset = _dataset(forces)
    static = _static(dataset)
    passing = station_forces(dataset, stations)
    alongside = [dim for dim in passing.dims if dim != "station"]
    passed = (passing.notnull() | static.isnull()).all(alongside).to_numpy()
    left_out = passing["station"].to_numpy()[~passed]
    if not passed.any():
        raise ValueError(
            f"no station is passed by every axle: not one of the {left_out.size} "
            f"from {left_out[0]:g} to {left_out[-1]:g} m"
        )
    passing = passing.isel(station=np.flatnonzero(passed))
    static = static.broadcast_like(passing.isel(station=0, drop=True))
    aggregate = _raised(passing.clip(min=0.0), power, "power").sum("axle")
    still = _raised(static, power, "power").sum("axle")
    if fleet:
        if "vehicle" not in aggregate.dims:
            raise ValueError("fleet=True sums over vehicles, and the forces have no such dimension")
        aggregate, still = aggregate.sum("vehicle"), still.sum("vehicle")
    percentile = aggregate.quantile(0.95, "station").drop_vars("quantile")
    units, what = "N" if power == 1 else f"N^{power:g}", f"sum of F^{power:g} over the axles"
    return xr.Dataset(
        {
            "aggregate": _labelled(aggregate, "aggregate", units, what),
            "static": _labelled(still, "static", units, f"{what}, static loads"),
            "ratio": _labelled(aggregate / still, "ratio", "1", f"{what} over its static value"),
            "percentile_95": _labelled(
                percentile, "percentile_95", units, f"95th percentile over stations of the {what}"
            ),
        },
        coords={
            "left_out": (
                "left_out",
                left_out,
                {"units": "m", "long_name": "stations left out: not every axle passes them"},
            )
        },
        attrs={"power": float(power)},
    )


def spatial_repeatability(
    a: Forces,
    b: Forces | None = None,
    *,
    stations: ArrayLike | None = None,
    power: float = 1.0,
) -> xr.DataArray:
    """Spatial repeatability index: whether two vehicles press on the same places.

    It is the correlation coefficient of the aggregate forces of two vehicles, or of two runs of
    one, over the stations that all axles pass: 1 if their peaks fall on the same places, 0 if they
    have nothing to do with each other, -1 if one presses where the other does not (Cole, Collop,
    Potter and Cebon 1996).

    Parameters
    ----------
    a, b : TireForces, Result or Dataset
        Runs over the same road, places counted from the same origin. Where both have vehicles,
        these are the same, and each is compared with itself. Without `b`, every vehicle of the
        fleet `a` is compared with every other.
    stations : array_like, shape (stations,), optional
        Places along the road, m, increasing; by default those of a ``station_force``, or every
        0.25 m.
    power : float
        Power to which forces are raised before they are summed, as in `aggregate_force`; by default
        it is the forces themselves that are compared.

    Returns
    -------
    DataArray
        (...), or for a fleet (..., vehicle, other): symmetric, with ones on its diagonal.

    Raises
    ------
    ValueError
        If an aggregate force does not vary, as on a smooth road; if fewer than three stations are
        passed by all axles; or for what `aggregate_force` refuses.

    Examples
    --------
    >>> import pavefem as pf
    >>> profile = pf.Profile.iso8608("B", length=300.0, seed=1)
    >>> light, heavy = (
    ...     pf.tire_forces(pf.vehicles.tandem_truck(payload=payload), profile, run_in=50.0)
    ...     for payload in (8000.0, 12_400.0)
    ... )
    >>> round(float(spatial_repeatability(light, heavy)), 2)
    0.97
    """
    runs = {"a": _dataset(a)} if b is None else {"a": _dataset(a), "b": _dataset(b)}
    places = _default_stations(*runs.values()) if stations is None else stations
    sums = [aggregate_force(run, places, power)["aggregate"] for run in runs.values()]
    common = sums[0]["station"].to_numpy()
    common = common[np.isin(common, sums[-1]["station"].to_numpy())]
    if common.size < 3:
        raise ValueError(f"{common.size} stations are passed by all axles: must be at least 3")
    scores = []
    for name, aggregate in zip(runs, sums, strict=True):
        along = aggregate.sel(station=common)
        mean, spread = along.mean("station"), along.std("station")
        # Below this it is rounding that varies.
        if not (spread > 1e-9 * mean).all():
            who = f"a vehicle of {name}" if mean.ndim else name
            raise ValueError(
                f"the aggregate force of {who} does not vary along the road, as on a smooth "
                "profile: it has no spatial repeatability"
            )
        scores.append((along - mean) / spread)
    first, second = scores[0], scores[-1]
    if b is None:
        if "vehicle" not in first.dims:
            raise ValueError(
                "a is one run: give another one to compare it with, or a fleet with a vehicle "
                "dimension"
            )
        second = first.reset_coords(drop=True).rename(vehicle="other")
    try:
        first, second = xr.align(first, second, join="exact")
    except ValueError:
        raise ValueError(
            "a and b have different vehicles: must have the same, or one of them a single one"
        ) from None
    # Rounding may leave the last digit beyond 1.
    index = (xr.dot(first, second, dim="station") / common.size).clip(-1.0, 1.0)
    return _labelled(index, "sri", "1", "spatial repeatability index")


def esal(
    loads: ArrayLike | xr.DataArray | Vehicle | Forces,
    standard_axle: float = 80e3,
    exponent: float = 4.0,
) -> xr.Dataset:
    """Equivalent standard axle loads of a vehicle: ``(W / 80 kN)^4`` for each axle.

    Every axle counts by its own static load, also within a tandem or a tridem. (Design guides give
    groups factors of their own; those depend on the pavement's structure and are not used here.)

    Parameters
    ----------
    loads : array_like (..., axles), DataArray (..., axle), Vehicle, TireForces, Result or Dataset
        Static axle loads, N. An array of two dimensions has vehicles as its rows; NaN in labelled
        loads stands for an axle that is not there.
    standard_axle : float
        Load of the standard axle, N.
    exponent : float
        Exponent of the power law.

    Returns
    -------
    Dataset
        ``per_axle`` (..., axle) and ``total`` (...), the sum over the axles.

    Raises
    ------
    ValueError
        If a load is not finite and above 0, the heaviest is a hundred times heavier or lighter than
        the standard axle (as happens when one is in N and the other in kN), or the standard axle or
        the exponent is not above 0.

    Examples
    --------
    >>> found = esal([60e3, 80e3, 80e3])
    >>> found["per_axle"].to_numpy().round(3), round(float(found["total"]), 3)
    (array([0.316, 1.   , 1.   ]), 2.316)
    """
    static = _loads(loads)
    standard = _positive("standard_axle", standard_axle, " N")
    heaviest = float(static.max())
    if not 1e-2 <= heaviest / standard <= 1e2:
        raise ValueError(
            f"the heaviest axle of {heaviest:g} N is {heaviest / standard:.3g} times the standard "
            f"axle of {standard:g} N: must be 0.01 to 100 times; both are in N"
        )
    per_axle = _raised(static / standard, exponent, "exponent")
    return xr.Dataset(
        {
            "per_axle": _labelled(per_axle, "per_axle", "1", "equivalent standard axle loads"),
            "total": _labelled(
                per_axle.sum("axle"), "total", "1", "equivalent standard axle loads of a vehicle"
            ),
        },
        attrs={"standard_axle": standard, "exponent": float(exponent)},
    )


def axle_groups(positions: ArrayLike | xr.DataArray, within: float = GROUP_SPACING) -> xr.DataArray:
    """Find groups of axles: one nearer than `within` to the axle ahead of it joins its group.

    Parameters
    ----------
    positions : array_like (..., axles) or DataArray (..., axle)
        Places of the axles, m, from the front to the rear; an array of two dimensions has vehicles
        as its rows, and NaN in a DataArray stands for an axle that is not there.
    within : float
        Spacing from which groups part, m; by default 2 m, which keeps tandems and tridems together.

    Returns
    -------
    DataArray, (..., axle)
        Number of the group of each axle, from 1; 0 for an axle that is not there.

    Raises
    ------
    ValueError
        If places do not go from the front to the rear, are not finite, or `within` is not above 0.

    Examples
    --------
    >>> import pavefem as pf
    >>> axle_groups(pf.vehicles.tandem_truck(axle_spacing=1.3).axle_positions).to_numpy()
    array([1, 2, 2])
    """
    places = _by_axle("positions", positions, "m")
    limit = _positive("within", within, " m")
    values = places.to_numpy()
    there = np.isfinite(values)
    gaps = np.diff(values, axis=-1)
    if np.isinf(values).any() or (there[..., 1:] > there[..., :-1]).any():
        raise ValueError("positions must be finite, and NaN only behind a vehicle's last axle")
    with np.errstate(invalid="ignore"):
        rising, falling = (gaps > 0.0) | ~there[..., 1:], (gaps < 0.0) | ~there[..., 1:]
        apart = part_groups(gaps, limit)
    if not (rising.all(axis=-1) | falling.all(axis=-1)).all():
        raise ValueError("positions must go from the front axle to the rear one, no two alike")
    numbers = np.ones(values.shape, dtype=np.int64)
    numbers[..., 1:] += np.cumsum(apart, axis=-1)
    groups = places.copy(data=np.where(there, numbers, 0))
    return _labelled(groups, "group", "1", "number of the axle's group")


def load_sharing(forces: Forces, groups: ArrayLike | xr.DataArray | None = None) -> xr.DataArray:
    """Load sharing coefficient of each axle: its mean force over the mean of its group.

    ``LSC_i = n mean(F_i) / sum_j mean(F_j)`` over the n axles j of the group (Sweatman 1983;
    Potter, Cebon and Cole 1997): 1 where the load is shared evenly.

    Parameters
    ----------
    forces : TireForces, Result or Dataset
        A run, or a fleet, by its ``mean_force`` where it has no histories.
    groups : array_like (axles,) or DataArray (..., axle), optional
        Number of the group of each axle; by default that of `axle_groups`.

    Returns
    -------
    DataArray, (..., axle)
        1 for a single axle.

    Raises
    ------
    ValueError
        If groups are not whole numbers, one an axle; if they have to be given, a fleet without
        histories having no places of axles; if the load of a group is not above zero; or if a
        variable is missing, of other units or not finite.

    Examples
    --------
    >>> import pavefem as pf
    >>> run = pf.tire_forces(pf.vehicles.tandem_truck(), None, distance=10.0)
    >>> load_sharing(run).to_numpy().round(3)
    array([1.   , 0.971, 1.029])
    """
    dataset = _dataset(forces)
    static = _static(dataset)
    if "tire_force" in dataset:
        mean = _history(dataset, static, "tire_force").mean("time")
    elif "mean_force" in dataset:
        mean = _statistic(dataset, static, "mean_force")
    else:
        raise ValueError("the dataset has neither tire_force nor mean_force")
    shares = _shares(mean, _groups(dataset, static, groups))
    return _labelled(shares, "load_sharing", "1", "load sharing coefficient")


def dynamic_load_sharing(
    forces: Forces, groups: ArrayLike | xr.DataArray | None = None
) -> xr.DataArray:
    """Load sharing at every instant: ``n F_i(t) / sum_j F_j(t)`` over the n axles j of a group.

    Its standard deviation over time is the dynamic load sharing coefficient (de Pont 1997). A force
    below zero, of a linear tire that would pull at the road, counts as zero.

    Parameters
    ----------
    forces : TireForces, Result or Dataset
        A run, or several, with histories.
    groups : array_like (axles,) or DataArray (..., axle), optional
        Number of the group of each axle; by default that of `axle_groups`.

    Returns
    -------
    DataArray, (..., time, axle)

    Raises
    ------
    ValueError
        As `load_sharing`, and if all axles of a group have left the road at an instant.

    Examples
    --------
    >>> import pavefem as pf
    >>> profile = pf.Profile.iso8608("B", length=300.0, seed=1)
    >>> run = pf.tire_forces(pf.vehicles.tandem_truck(), profile, speed_kmh=65.0, run_in=50.0)
    >>> dynamic_load_sharing(run).std("time").to_numpy().round(3)
    array([0.   , 0.133, 0.133])
    """
    dataset = _dataset(forces)
    static = _static(dataset)
    force = _history(dataset, static, "tire_force").clip(min=0.0)
    shares = _shares(force, _groups(dataset, static, groups))
    return _labelled(
        shares.transpose(..., "time", "axle"), "load_sharing", "1", "load sharing at an instant"
    )


# --- what is read and refused -------------------------------------------------------------------


def _dataset(forces: Forces) -> xr.Dataset:
    if isinstance(forces, Result):
        if forces.forces is None:
            raise ValueError('tire forces were not kept: run with keep=["tire_force", ...]')
        forces = forces.forces
    if isinstance(forces, TireForces):
        return forces.dataset
    if isinstance(forces, xr.Dataset):
        return forces
    raise ValueError(
        f"forces is a {type(forces).__name__}: must be TireForces, a Result or an xarray.Dataset"
    )


def _checked(name: str, values: xr.DataArray, units: str, dims: tuple[str, ...]) -> xr.DataArray:
    """Real numbers in the units and with the trailing dimensions that are expected."""
    if not set(dims) <= set(values.dims):
        raise ValueError(f"{name} has the dimensions {values.dims}: must have {dims}")
    if 0 in values.shape:
        raise ValueError(f"{name} is empty: its dimensions are {dict(values.sizes)}")
    if values.dtype.kind not in "iuf":
        raise ValueError(f"{name} must hold real numbers, got dtype {values.dtype}")
    given = values.attrs.get("units", units)
    if given != units:
        raise ValueError(f"{name} is in {given!r}: must be in {units!r}")
    return values.astype(np.float64).transpose(..., *dims)


def _variable(dataset: xr.Dataset, name: str) -> xr.DataArray:
    if name not in dataset:
        raise ValueError(f"the dataset has no {name}, only {[str(v) for v in dataset.data_vars]}")
    return _checked(name, dataset[name], *_VARIABLES[name])


def _static(dataset: xr.Dataset) -> xr.DataArray:
    return _above_zero("static_load", _variable(dataset, "static_load"))


def _above_zero(name: str, loads: xr.DataArray) -> xr.DataArray:
    """Check static loads: NaN for an axle that is not there, else finite and above 0."""
    values = loads.to_numpy()
    wrong = ~np.isnan(values) & ~(np.isfinite(values) & (values > 0.0))
    if wrong.any():
        raise ValueError(f"{name} = {values[wrong].flat[0]:g} N: must be finite and above 0")
    if np.isnan(values).all(axis=-1).any():
        raise ValueError(f"{name} is NaN for every axle of a vehicle: must have at least one axle")
    return loads


def _of_axles(dataset: xr.Dataset, static: xr.DataArray, name: str) -> xr.DataArray:
    """Values of the axles that are there, NaN for the others, which must not have any."""
    values, there = xr.broadcast(_variable(dataset, name), static.notnull())
    # Places may be shared by vehicles of different numbers of axles.
    if name != "axle_position" and (values.notnull() & ~there).any():
        raise ValueError(f"{name} is given for an axle whose static_load is NaN")
    return values.where(there).transpose(..., *_VARIABLES[name][1])


def _statistic(dataset: xr.Dataset, static: xr.DataArray, name: str) -> xr.DataArray:
    """Check a statistic of each axle: finite and not below 0."""
    values = _of_axles(dataset, static, name)
    wrong = (static.notnull() & ~(np.isfinite(values) & (values >= 0.0))).transpose(*values.dims)
    if wrong.any():
        value = values.to_numpy()[wrong.to_numpy()].flat[0]
        raise ValueError(f"{name} = {value:g} N: must be finite and not below 0")
    return values


def _history(dataset: xr.Dataset, static: xr.DataArray, name: str) -> xr.DataArray:
    """Check a history of each axle: of two instants or more, finite to the end of a fleet's run."""
    history = _of_axles(dataset, static, name)
    values = history.to_numpy()
    known = np.isfinite(values)
    first = history.isel(time=0, drop=True)
    there = static.notnull().broadcast_like(first).transpose(*first.dims).to_numpy()
    running = known.any(axis=-1, keepdims=True)
    if history.ndim == 2:
        running[:] = True
    else:
        running = np.logical_or.accumulate(running[..., ::-1, :], axis=-2)[..., ::-1, :]
    wrong = (running & there[..., np.newaxis, :] & ~known) | np.isinf(values)
    if wrong.any():
        *_, instant, axle = np.argwhere(wrong)[0]
        raise ValueError(
            f"{name} is {values[wrong].flat[0]} at instant {instant} of axle {axle + 1}: must be "
            "finite"
        )
    instants = running.sum(axis=-2).min()
    if instants < 2:
        raise ValueError(f"the number of instants of {name} is {instants}: must be at least 2")
    return history


def _by_axle(name: str, values: ArrayLike | xr.DataArray, units: str) -> xr.DataArray:
    """Numbers given for each axle, in an array of a vehicle or of several, or labelled."""
    if not isinstance(values, xr.DataArray):
        try:
            array = np.asarray(values)
        except ValueError as error:  # nested sequences of unequal length
            raise ValueError(f"{name} must be an array of numbers: {error}") from None
        if array.ndim not in (1, 2):
            raise ValueError(
                f"{name} has shape {array.shape}: must be (axles,) or (vehicles, axles)"
            )
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            wrong = array[~np.isfinite(array)].flat[0]
            raise ValueError(f"{name} holds {wrong}: every value must be finite")
        dims = ("vehicle", "axle")[-array.ndim :]
        labelled = xr.DataArray(array, {"axle": np.arange(1, array.shape[-1] + 1)}, dims)
        return _checked(name, labelled, units, ("axle",))
    return _checked(name, values, units, ("axle",))


def _loads(loads: ArrayLike | xr.DataArray | Vehicle | Forces) -> xr.DataArray:
    if isinstance(loads, Result):
        loads = loads.scenario.vehicle
    if isinstance(loads, TireForces | xr.Dataset):
        return _static(_dataset(loads))
    if isinstance(loads, Vehicle):
        loads = loads.static_loads
    return _above_zero("loads", _by_axle("loads", loads, "N"))


def _positive(name: str, value: float, units: str = "") -> float:
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ValueError(f"{name} = {value!r}: must be a number")
    number = float(value)
    if not (math.isfinite(number) and number > 0.0):
        raise ValueError(f"{name} = {number:g}{units}: must be finite and above 0")
    return number


def _raised(values: xr.DataArray, power: float, name: str) -> xr.DataArray:
    exponent = _positive(name, power)
    with np.errstate(over="ignore"):
        raised = values**exponent
    if np.isinf(raised).any():
        raise ValueError(
            f"{name} = {exponent:g}: {float(values.max()):g} to it is no finite number"
        )
    return raised


# --- stations -----------------------------------------------------------------------------------


def _stations(name: str, stations: ArrayLike) -> NDArray[np.float64]:
    places = finite_vector(name, stations)
    if places.size == 0:
        raise ValueError(f"{name} is empty: must hold at least one place, m")
    if not (np.diff(places) > 0.0).all():
        step = int(np.argmin(np.diff(places) > 0.0))
        raise ValueError(
            f"{name} must increase: {places[step]:g} m is followed by {places[step + 1]:g} m"
        )
    return places


def _kept_at_stations(dataset: xr.Dataset) -> bool:
    return "station_force" in dataset


def _default_stations(*datasets: xr.Dataset) -> NDArray[np.float64]:
    """Stations of the first fleet that knows forces there only, or a grid that all axles pass."""
    starts, ends = [], []
    for dataset in datasets:
        if _kept_at_stations(dataset):
            kept = _variable(dataset, "station_force")
            if "station" not in kept.coords:
                raise ValueError("station_force has no station coordinate: must have places, m")
            return _stations("station", kept["station"].to_numpy())
        place = _history(dataset, _static(dataset), "axle_position")
        starts.append(float(place.min("time").max()))
        ends.append(float(place.max("time").min()))
    start, end = max(starts), min(ends)
    # An end that is a whole number of spacings but for rounding counts as one.
    first = math.ceil(start / STATION_SPACING - 1e-9)
    last = math.floor(end / STATION_SPACING + 1e-9)
    if last < first:
        raise ValueError(
            f"no station every {STATION_SPACING:g} m is passed by every axle: the last of them "
            f"starts at {start:g} m, and the first ends at {end:g} m"
        )
    if last - first >= MAX_SAMPLES:
        raise ValueError(f"{start:g} to {end:g} m is too long a stretch: give stations")
    return STATION_SPACING * np.arange(first, last + 1, dtype=np.float64)


def _slack(stations: NDArray[np.float64]) -> float:
    """How far a place may be off by rounding, m."""
    return 1e-9 * max(1.0, float(np.abs(stations).max()))


def _nearest(kept: NDArray[np.float64], wanted: NDArray[np.float64]) -> NDArray[np.intp]:
    """Find stations among those at which forces are known."""
    index = np.searchsorted(0.5 * (kept[1:] + kept[:-1]), wanted)
    missing = np.abs(kept[index] - wanted) > _slack(wanted)
    if missing.any():
        raise ValueError(
            f"no forces are known at station {wanted[missing][0]:g} m, the nearest is at "
            f"{kept[index][missing][0]:g} m"
        )
    return index


def _passing(
    place: NDArray[np.float64], force: NDArray[np.float64], stations: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Force of one axle at stations, NaN where it does not pass."""
    known = np.isfinite(force)
    if (known != np.isfinite(place)).any():
        raise ValueError("tire_force and axle_position of an axle end at different instants")
    place, force = place[known], force[known]
    if place.size == 0:  # an axle that is not there
        return np.full(stations.shape, np.nan)
    if not (np.diff(place) > 0.0).all():
        step = int(np.argmin(np.diff(place) > 0.0))
        raise ValueError(
            f"axle_position must increase with time: {place[step]:g} m is followed by "
            f"{place[step + 1]:g} m"
        )
    passing = np.interp(stations, place, force)
    slack = _slack(stations)
    passing[(stations < place[0] - slack) | (stations > place[-1] + slack)] = np.nan
    return passing


# --- groups of axles ----------------------------------------------------------------------------


def _groups(
    dataset: xr.Dataset, static: xr.DataArray, groups: ArrayLike | xr.DataArray | None
) -> xr.DataArray:
    """Group of each axle that is there."""
    if groups is None:
        if "axle_offset" in dataset.coords:
            groups = axle_groups(_variable(dataset, "axle_offset"))
        elif "axle_position" in dataset:
            groups = axle_groups(_history(dataset, static, "axle_position").isel(time=0, drop=True))
        else:
            raise ValueError(
                "the dataset has neither axle_offset nor axle_position: give groups, as from "
                "axle_groups"
            )
    numbers = _by_axle("groups", groups, "1")
    if not isinstance(groups, xr.DataArray):
        numbers = numbers.drop_vars("axle")  # as many as the static loads, whatever their labels
    try:
        numbers, _ = xr.align(numbers, static, join="exact")
    except ValueError:
        raise ValueError(
            f"groups are of {dict(numbers.sizes)}, static_load of {dict(static.sizes)}: must have "
            "the same axles and vehicles"
        ) from None
    numbers = numbers.reset_coords(drop=True).where(static.notnull())
    if (numbers != np.round(numbers)).where(static.notnull(), False).any():
        raise ValueError("groups must be whole numbers, one for each axle")
    return numbers


def _shares(force: xr.DataArray, groups: xr.DataArray) -> xr.DataArray:
    """Each force as a multiple of the mean of its group."""
    other = {"axle": "other"}
    together = (groups == groups.rename(other)).astype(np.float64)  # never where NaN
    count = together.sum("other")
    forces = force.reset_coords(drop=True).rename(other).fillna(0.0)
    total: xr.DataArray = xr.dot(together, forces, dim="other")
    # A single axle carries its share whatever its force.
    shared = force.notnull() & (count > 1)
    if (shared & ~(total > 0.0)).any():
        raise ValueError(
            "the axles of a group press on the road with no force at all: none to share"
        )
    shares = count * force / total.where(shared)
    return shares.where(shared | force.isnull(), 1.0)


def _labelled(values: xr.DataArray, name: str, units: str, what: str) -> xr.DataArray:
    labelled = values.rename(name)
    labelled.attrs = {"units": units, "long_name": what}
    return labelled
