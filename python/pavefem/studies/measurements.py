"""What was measured on a road, and what the model answers in its place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solveh_banded

from pavefem._model import finite_number
from pavefem.formats.units import METRES, known_unit
from pavefem.profile import Profile, real_array
from pavefem.road import Road
from pavefem.scheme import Scheme
from pavefem.simulate import simulate
from pavefem.vehicle import Vehicle

LARGEST_DEFLECTION: Final = 0.1
"""Deflection, m, beyond which numbers are taken for millimetres by mistake."""
SMALLEST_LOAD: Final = 1000.0
"""Force, N, below which the largest force of a test is taken for kilonewtons by mistake."""

_LENGTHS: Final = METRES | dict.fromkeys(("um", "µm", "μm", "micron"), 1e-6)
_FORCES: Final = {"N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605}
_TIMES: Final = {"s": 1.0, "ms": 1e-3}


@dataclass(frozen=True, init=False, eq=False)
class ForceDeflection:
    """Forces that rest or creep on one place of the road, and deflections beside them.

    The answer of the model is that of its mesh at rest, ``K u = f``, with the modulus that the
    asphalt has at `speed_kmh`.

    Parameters
    ----------
    force : array_like, shape (n,)
        Force on the wheel track, N: half of an axle's. Positive presses on the road.
    deflection : array_like, shape (n,)
        Deflection, m, positive downwards.
    speed_kmh : float
        Speed at which the load creeps, km/h: it makes the loading time.
    temperature_c : float
        Asphalt temperature, °C.
    offset : array_like, optional
        Distance from the load to the gauge, m, one for all or each; 0 is under the load.
    x : float, optional
        Place of the load, m; by default mid-length.
    noise : array_like, optional
        Standard deviation of the deflections, m, one for all or each: they weigh by its inverse.
        By default all weigh the same, and the fit estimates it.
    name : str
        What tables and plots call it.

    Raises
    ------
    ValueError
        If shapes do not fit, a number is not finite or a `noise` not above 0; if a ``units``
        attribute names another unit than of length or force; if deflections above 0.1 m or no force
        above 1 kN say that the numbers are not in metres and newtons; if deflections are upwards.

    Notes
    -----
    A `DataArray` whose ``units`` are, say, mm or kN is converted.
    """

    force: NDArray[np.float64]
    deflection: NDArray[np.float64]
    speed_kmh: float
    temperature_c: float
    offset: NDArray[np.float64]
    x: float | None
    noise: NDArray[np.float64] | None
    name: str

    def __init__(
        self,
        force: ArrayLike | xr.DataArray,
        deflection: ArrayLike | xr.DataArray,
        *,
        speed_kmh: float,
        temperature_c: float,
        offset: ArrayLike | xr.DataArray = 0.0,
        x: float | None = None,
        noise: ArrayLike | xr.DataArray | None = None,
        name: str = "force and deflection",
    ) -> None:
        forces = _quantity("force", force, "N", _FORCES)
        deflections = _deflections(deflection)
        if forces.ndim != 1 or forces.shape != deflections.shape or forces.size == 0:
            raise ValueError(
                f"force has shape {forces.shape} and deflection {deflections.shape}: each must be "
                "a list, of as many values"
            )
        if not np.abs(forces).max() >= SMALLEST_LOAD:
            raise ValueError(
                f"the largest force is {np.abs(forces).max():g} N, less than {SMALLEST_LOAD:g} N: "
                "give newtons, or units of kN in the attributes of a DataArray"
            )
        offsets = _spread("offset", offset, forces.shape)
        nearest = np.abs(offsets) == np.abs(offsets).min()
        if not (forces * deflections)[nearest].sum() > 0.0:
            raise ValueError(
                "deflection next to the load is against the force: force and deflection must both "
                "be positive downwards"
            )
        set_ = object.__setattr__
        set_(self, "force", forces)
        set_(self, "deflection", deflections)
        set_(self, "speed_kmh", finite_number("speed_kmh", speed_kmh))
        set_(self, "temperature_c", finite_number("temperature_c", temperature_c))
        set_(self, "offset", offsets)
        set_(self, "x", None if x is None else finite_number("x", x))
        set_(self, "noise", _noise(noise, deflections.shape))
        set_(self, "name", name)

    def predict(self, road: Road, scheme: Scheme) -> NDArray[np.float64]:
        """Deflection of the model at rest under each force, m, positive downwards."""
        x = road.length / 2.0 if self.x is None else self.x
        offsets, pair = np.unique(self.offset, return_inverse=True)
        per_newton = static_deflection(
            road,
            x,
            x + offsets,
            temperature_c=self.temperature_c,
            speed_kmh=self.speed_kmh,
            scheme=scheme,
        )
        return self.force * per_newton[pair]


@dataclass(frozen=True, init=False, eq=False)
class DeflectionHistory:
    """Deflections of places of the road over time, while a known vehicle passes.

    Parameters
    ----------
    deflection : array_like, shape (times,) or (times, stations)
        Deflection, m, up positive: a loaded pavement reads negative. A `DataArray` of ``time`` and
        ``station`` or ``x`` brings times and stations along.
    time : array_like, shape (times,), optional
        Time since the front axle was at x = 0, s.
    stations : array_like, optional
        Places of the gauges on the road, m.
    vehicle : Vehicle
        The vehicle.
    speed_kmh, temperature_c : float
        Its speed, km/h, and the asphalt temperature, °C.
    profile : Profile, optional
        Elevations; by default a smooth road.
    run_in : float
        Distance from the profile's first sample to x = 0, m.
    noise : array_like, optional
        Standard deviation of the deflections, m, one for all, for each station, or for each value:
        they weigh by its inverse. By default all weigh the same, and the fit estimates it.
    name : str
        What tables and plots call it.

    Raises
    ------
    ValueError
        As of `ForceDeflection`; if times do not increase.
    """

    deflection: NDArray[np.float64]
    time: NDArray[np.float64]
    stations: NDArray[np.float64]
    vehicle: Vehicle
    speed_kmh: float
    temperature_c: float
    profile: Profile | None
    run_in: float
    noise: NDArray[np.float64] | None
    name: str

    def __init__(
        self,
        deflection: ArrayLike | xr.DataArray,
        time: ArrayLike | None = None,
        stations: ArrayLike | None = None,
        *,
        vehicle: Vehicle,
        speed_kmh: float,
        temperature_c: float,
        profile: Profile | None = None,
        run_in: float = 0.0,
        noise: ArrayLike | xr.DataArray | None = None,
        name: str = "deflection history",
    ) -> None:
        if isinstance(deflection, xr.DataArray):
            if time is not None or stations is not None:
                raise ValueError("time and stations are those of the DataArray: give neither")
            deflection, time, stations = _labelled(deflection)
        if time is None or stations is None:
            raise ValueError("deflection has no labels: give time and stations")
        times = _quantity("time", time, "s", _TIMES)
        places = np.atleast_1d(_quantity("stations", stations, "m", _LENGTHS))
        history = _deflections(deflection)
        if history.ndim == 1:
            history = history[:, np.newaxis]
        if times.ndim != 1 or places.ndim != 1 or history.shape != (times.size, places.size):
            raise ValueError(
                f"deflection has shape {history.shape}: must be one row for each of the "
                f"{times.size} times, one column for each of the {places.size} stations"
            )
        if times.size == 0 or places.size == 0 or (np.diff(times) <= 0.0).any():
            raise ValueError("time must increase, and there must be a time and a station")
        if not history.max() < -history.min():
            raise ValueError(
                "the largest deflection is upwards: histories are up positive, a loaded pavement "
                "reads negative"
            )
        set_ = object.__setattr__
        set_(self, "deflection", history)
        set_(self, "time", times)
        set_(self, "stations", places)
        set_(self, "vehicle", vehicle)
        set_(self, "speed_kmh", finite_number("speed_kmh", speed_kmh))
        set_(self, "temperature_c", finite_number("temperature_c", temperature_c))
        set_(self, "profile", profile)
        set_(self, "run_in", run_in)
        set_(self, "noise", _noise(noise, history.shape))
        set_(self, "name", name)

    def predict(self, road: Road, scheme: Scheme) -> NDArray[np.float64]:
        """Deflection of the model at the same times and stations, m, linear between steps."""
        result = simulate(
            road,
            self.vehicle,
            profile=self.profile,
            run_in=self.run_in,
            speed_kmh=self.speed_kmh,
            temperature_c=self.temperature_c,
            scheme=scheme,
            keep=["deflection"],
            stations=self.stations.tolist(),
            cache=False,
        )
        first, last = float(self.time[0]), float(self.time[-1])
        end = float(result.time[-1]) + scheme.dt
        if first < 0.0 or last > end:
            raise ValueError(
                f"{self.name}: times go from {first:g} to {last:g} s, but the vehicle is on the "
                f"road from 0 to {end:g} s: give seconds since its front axle was at x = 0"
            )
        history = np.asarray(result.deflection)
        columns = [np.interp(self.time, result.time, column) for column in history.T]
        return np.stack(columns, axis=1)


Measurement: TypeAlias = ForceDeflection | DeflectionHistory


def static_deflection(
    road: Road,
    x: float,
    places: ArrayLike,
    *,
    temperature_c: float,
    speed_kmh: float,
    scheme: Scheme,
) -> NDArray[np.float64]:
    """Deflection of a road under a unit force at rest, ``K u = f``, by the mesh of a scheme.

    Parameters
    ----------
    road : Road
        The road.
    x : float
        Place of the force, m, shared between the nodes beside it as the scheme has it.
    places : array_like
        Where the deflection is wanted, m; between nodes by the element's shape functions.
    temperature_c, speed_kmh : float
        What makes the modulus.
    scheme : Scheme
        Element length, foundation and weights.

    Returns
    -------
    ndarray
        Deflection, m/N, positive downwards.

    Raises
    ------
    ValueError
        If a place is off the road, or the scheme has a tire print.
    """
    if scheme.tire_print > 0.0:
        raise ValueError(
            f"tire_print = {scheme.tire_print:g} m: a force at rest is a point here, use a scheme "
            "with tire_print=0"
        )
    strip = road.strip(
        temperature_c,
        speed_kmh,
        element_length=scheme.element_length,
        foundation=scheme.foundation,
    )
    nodes, stiffness = strip.nodes, strip.stiffness
    free = np.ones(2 * nodes.size, dtype=np.bool_)
    held = {"clamped": [0, 1, -2, -1], "pinned": [0, -2], "free": []}[road.ends]
    free[held] = False
    # Nodes of two unknowns are coupled to their neighbours only: three diagonals beside the main.
    band = np.zeros((4, len(stiffness)))
    for below in range(4):
        band[below, : len(stiffness) - below] = stiffness.diagonal(-below)
    load = _shares(nodes, np.array([x]), scheme.weights)[0]
    answer = np.zeros(2 * nodes.size)
    answer[free] = solveh_banded(band, load[free], lower=True)
    return _shares(nodes, np.asarray(places, dtype=np.float64), "hermite") @ answer


def _shares(
    nodes: NDArray[np.float64], places: NDArray[np.float64], weights: str
) -> NDArray[np.float64]:
    """Shares (place, unknown) of unit forces on w and theta of the nodes (Fig. 6, or Hermite)."""
    outside = ~((places >= nodes[0]) & (places <= nodes[-1]))
    if outside.any():
        raise ValueError(
            f"x = {places[outside][0]:g} m is off the road, {nodes[0]:g} to {nodes[-1]:g} m"
        )
    left = np.clip(np.searchsorted(nodes, places, side="right") - 1, 0, nodes.size - 2)
    h = np.diff(nodes)[left]
    s = (places - nodes[left]) / h
    if weights == "linear":
        zero = np.zeros_like(s)
        values = (1.0 - s, zero, s, zero)
    else:
        values = (
            1.0 - 3.0 * s**2 + 2.0 * s**3,
            h * s * (1.0 - s) ** 2,
            3.0 * s**2 - 2.0 * s**3,
            -h * s**2 * (1.0 - s),
        )
    shares = np.zeros((places.size, 2 * nodes.size))
    rows = np.arange(places.size)
    for unknown, value in enumerate(values):
        shares[rows, 2 * left + unknown] = value
    return shares


def _labelled(
    deflection: xr.DataArray,
) -> tuple[xr.DataArray, xr.DataArray, xr.DataArray]:
    """Part a labelled history into deflection (time, place), times and places."""
    place = next((name for name in ("station", "x") if name in deflection.coords), None)
    if place is None or "time" not in deflection.dims or "time" not in deflection.coords:
        raise ValueError(
            f"deflection is labelled by {list(deflection.coords)}: must be by time, and by station "
            "or x"
        )
    if place not in deflection.dims:
        deflection = deflection.expand_dims(place)
    if set(deflection.dims) != {"time", place}:
        raise ValueError(f"deflection has dimensions {deflection.dims}: must be time and {place}")
    return deflection.transpose("time", place), deflection["time"], deflection[place]


def _quantity(
    name: str, values: ArrayLike | xr.DataArray, unit: str, units: Mapping[str, float]
) -> NDArray[np.float64]:
    """Values in SI: as they are, or by the units that they carry."""
    factor = 1.0
    if isinstance(values, xr.DataArray) and "units" in values.attrs:
        given = str(values.attrs["units"]).strip()
        factor = units.get(given, units.get(known_unit(given), np.nan))
        if np.isnan(factor):
            raise ValueError(f"{name} has units {given!r}: must be {unit}, or one of {[*units]}")
    array = factor * real_array(name, values)
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite: leave out what was not measured")
    return array


def _deflections(values: ArrayLike | xr.DataArray) -> NDArray[np.float64]:
    deflections = _quantity("deflection", values, "m", _LENGTHS)
    largest = float(np.abs(deflections).max(initial=0.0))
    if largest > LARGEST_DEFLECTION:
        raise ValueError(
            f"deflection reaches {largest:g} m, more than {LARGEST_DEFLECTION:g} m: give metres, "
            "or units of mm in the attributes of a DataArray"
        )
    return deflections


def _spread(
    name: str, value: ArrayLike | xr.DataArray, shape: tuple[int, ...]
) -> NDArray[np.float64]:
    """Lengths for each of what was measured, m."""
    array = _quantity(name, value, "m", _LENGTHS)
    try:
        return np.broadcast_to(array, shape).copy()
    except ValueError:
        raise ValueError(
            f"{name} has shape {array.shape}: must be one number, or go with {shape}"
        ) from None


def _noise(
    value: ArrayLike | xr.DataArray | None, shape: tuple[int, ...]
) -> NDArray[np.float64] | None:
    if value is None:
        return None
    noise = _spread("noise", value, shape)
    if not (noise > 0.0).all():
        raise ValueError(f"noise = {noise.min():g} m: must be above 0")
    if not noise.max() <= LARGEST_DEFLECTION:
        raise ValueError(f"noise reaches {noise.max():g} m: give metres")
    return noise
