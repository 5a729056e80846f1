"""Tire forces of a vehicle that runs over a profile."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Literal, NamedTuple, Self

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pavefem import _core
from pavefem._progress import progress_bar
from pavefem.asphalt import kmh
from pavefem.profile import Profile
from pavefem.vehicle import Vehicle

Interpolation = Literal["linear", "staircase"]
Progress = Callable[[int, int], object]

MEMORY_LIMIT: Final = 8 * 2**30
"""Most bytes that what is kept of a run may take."""

TOLERANCE: Final = 1e-4
"""Error that a step may add to a tire force where lift-off or dry friction act, as a part of the
static load."""


@dataclass(frozen=True)
class LiftOff:
    """Where one axle's tires left the road."""

    axle: int
    """Number of the axle, from 1."""
    instants: int
    """Instants at which it did not press on the road."""
    position: float
    """Place of the first of them, m."""


@dataclass(frozen=True)
class TireForces:
    """Tire forces of each axle over time.

    Attributes
    ----------
    time : ndarray, shape (times,)
        Time, s.
    position : ndarray, shape (times, axles)
        Place of each axle, m: a station of the profile, or x on the road in a simulation.
    force : ndarray, shape (times, axles)
        Force on the road, N, of both wheel tracks together; positive presses on it.
    static_loads : ndarray, shape (axles,)
        Static axle loads, N.
    lift_off : tuple of LiftOff
        Axles that left the road, or whose linear tires would have pulled at it, with count and
        place.
    """

    time: NDArray[np.float64]
    position: NDArray[np.float64]
    force: NDArray[np.float64]
    static_loads: NDArray[np.float64]
    lift_off: tuple[LiftOff, ...] = ()

    def seen_from(self, origin: float) -> TireForces:
        """Count all places from another one, m."""
        lifted = tuple(
            replace(lift_off, position=lift_off.position - origin) for lift_off in self.lift_off
        )
        return replace(self, position=self.position - origin, lift_off=lifted)

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The same as an `xarray.Dataset`, with units."""
        return xr.Dataset(
            {
                "tire_force": (
                    ("time", "axle"),
                    self.force,
                    {"units": "N", "long_name": "tire force of an axle"},
                ),
                "axle_position": (
                    ("time", "axle"),
                    self.position,
                    {"units": "m", "long_name": "place of an axle"},
                ),
                "static_load": (
                    ("axle",),
                    self.static_loads,
                    {"units": "N", "long_name": "static axle load"},
                ),
            },
            coords={
                "time": ("time", self.time, {"units": "s"}),
                "axle": ("axle", np.arange(1, self.static_loads.size + 1)),
            },
        )


@dataclass(frozen=True)
class AxleForces:
    """Tire force of each axle over all instants of a run, whatever of it is kept.

    Attributes
    ----------
    static_loads, lowest, highest : ndarray, shape (axles,)
        Static load, smallest and largest force, N.
    lift_off : tuple of LiftOff
        As of `TireForces`.
    """

    static_loads: NDArray[np.float64]
    lowest: NDArray[np.float64]
    highest: NDArray[np.float64]
    lift_off: tuple[LiftOff, ...] = ()

    @classmethod
    def of(cls, forces: TireForces) -> Self:
        """Take the extremes of a run."""
        force = forces.force
        return cls(forces.static_loads, force.min(axis=0), force.max(axis=0), forces.lift_off)

    @classmethod
    def none(cls, static_loads: NDArray[np.float64]) -> Self:
        """Build what holds for no instants."""
        infinite = np.full(static_loads.shape, np.inf)
        return cls(static_loads, infinite, -infinite)

    def followed_by(self, other: Self) -> Self:
        """Take what comes after these instants of the same run along."""
        lifted = {lift.axle: lift for lift in self.lift_off}
        for lift in other.lift_off:
            first = lifted.get(lift.axle, replace(lift, instants=0))
            lifted[lift.axle] = replace(first, instants=first.instants + lift.instants)
        return replace(
            self,
            lowest=np.minimum(self.lowest, other.lowest),
            highest=np.maximum(self.highest, other.highest),
            lift_off=tuple(lifted[axle] for axle in sorted(lifted)),
        )


def tire_forces(
    vehicle: Vehicle,
    profile: Profile | None = None,
    speed_kmh: float = 65.0,
    *,
    dt: float = 1e-3,
    run_in: float = 0.0,
    distance: float | None = None,
    interpolation: Interpolation = "linear",
    lift_off: bool = False,
    tolerance: float = TOLERANCE,
    progress: bool = False,
) -> TireForces:
    """Run a vehicle over a profile at constant speed.

    The vehicle starts at rest with its front axle on the first sample; beyond both ends the profile
    goes on level. ``F = F_static + k (z_p - z) + c (dz_p/dt - dz/dt)``.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    profile : Profile, optional
        Elevations; None is a smooth road, which leaves the static forces.
    speed_kmh : float
        Speed, km/h.
    dt : float
        Time step, s.
    run_in : float
        Distance from the first sample, m, over which the vehicle settles before time zero.
    distance : float, optional
        How far the front axle goes after that, m; by default to the end of the profile.
    interpolation : {"linear", "staircase"}
        Straight lines between samples, or the elevation of a sample up to the next one.
    lift_off : bool
        Whether a tire that would pull leaves the road, and the vehicle moves on without its force.
        Otherwise tires are linear, and forces may be negative: `lift_off` of the answer says where.
    tolerance : float
        Where tires lift off or springs rub, a step is divided until it adds no more than this part
        of the static load to the error of a tire force at its end. Over a run errors may come to
        more, most of all where a tire lands after a long flight; halve dt to see. What begins and
        ends within one step is not seen. A linear vehicle needs no such division.
    progress : bool
        Show progress when it takes over a second.

    Returns
    -------
    TireForces

    Raises
    ------
    ValueError
        If the profile is shorter than the vehicle or than `run_in`, or a number is out of range.
    SolverError
        If a force is not finite, or does not settle to the tolerance.
    """
    run = plan(vehicle, profile, speed_kmh, dt, run_in, distance)
    with progress_bar(progress, "vehicle") as report:
        return roll(vehicle, profile, run, interpolation, lift_off, tolerance, report)


def roll(
    vehicle: Vehicle,
    profile: Profile | None,
    run: Run,
    interpolation: Interpolation,
    lift_off: bool,
    tolerance: float,
    report: Progress | None,
) -> TireForces:
    """Do a run, as `tire_forces`; `report` is called with the steps done and the steps in all."""
    # Places and forces, and what is made of them on the way.
    size = 8.0 * 4.0 * run.steps * len(vehicle.tires)
    if not size < MEMORY_LIMIT:
        raise ValueError(
            f"{run.steps} steps of {len(vehicle.tires)} axles would take {size / 2**30:.3g} GiB, "
            f"the limit is {MEMORY_LIMIT / 2**30:g}: use a longer dt, a shorter distance, or "
            "fleet_forces"
        )
    if profile is None:
        return with_places(run, vehicle, np.tile(vehicle.static_loads, (run.steps + 1, 1)))
    [(force, _, _)] = _core.fleet_forces(
        vehicles=[vehicle.core],
        runs=np.array([run.row]),
        x=profile.x,
        z=profile.z,
        interpolation=interpolation,
        dt=run.dt,
        lift_off=lift_off,
        tolerance=tolerance,
        every=1,
        stations=np.array([]),
        threads=1,
        progress=report,
    )
    return with_places(run, vehicle, force)


def forces_in_blocks(
    run: Run,
    vehicle: Vehicle,
    profile: Profile | None,
    instants: int,
    take: Callable[[TireForces], object],
    *,
    interpolation: Interpolation,
    lift_off: bool,
    tolerance: float = TOLERANCE,
) -> None:
    """Run a vehicle as `tire_forces` does; `take` gets its forces so many instants at a time."""
    first = 0

    def hand_over(force: NDArray[np.float64]) -> None:
        nonlocal first
        forces = with_places(run, vehicle, force, first)
        first += force.shape[0]
        take(forces)

    if profile is None:
        while first <= run.steps:
            rows = min(instants, run.steps + 1 - first)
            hand_over(np.tile(vehicle.static_loads, (rows, 1)))
        return
    _core.forces_in_blocks(
        vehicle=vehicle.core,
        run=run.row,
        x=profile.x,
        z=profile.z,
        interpolation=interpolation,
        dt=run.dt,
        lift_off=lift_off,
        tolerance=tolerance,
        instants=instants,
        take=hand_over,
    )


def with_places(
    run: Run, vehicle: Vehicle, force: NDArray[np.float64], first: int = 0
) -> TireForces:
    """Put time and places to the forces of the instants from `first` on."""
    time = run.dt * np.arange(first, first + force.shape[0], dtype=np.float64)
    position = run.origin + run.speed * time[:, np.newaxis] - vehicle.axle_positions
    lifted = tuple(
        LiftOff(axle + 1, int(off.sum()), float(position[off.argmax(), axle]))
        for axle, off in enumerate((force <= 0.0).T)
        if off.any()
    )
    return TireForces(time, position, force, vehicle.static_loads, lifted)


class Run(NamedTuple):
    """A run over a profile, in whole steps."""

    speed: float  # m/s
    origin: float  # station of the front axle at time zero, m
    dt: float  # s
    skip: int
    steps: int

    @property
    def row(self) -> tuple[float, float, int, int]:
        """The run as the core has it: it starts `skip` steps ahead of time zero."""
        return self.speed, self.origin - self.skip * self.speed * self.dt, self.skip, self.steps

    @property
    def end(self) -> float:
        """Station of the front axle after the last step, m."""
        return self.origin + self.speed * self.dt * self.steps


def plan(
    vehicle: Vehicle,
    profile: Profile | None,
    speed_kmh: float,
    dt: float,
    run_in: float,
    distance: float | None,
) -> Run:
    """Check a run, and count its steps."""
    if not isinstance(vehicle, Vehicle):
        raise ValueError(f"vehicle is a {type(vehicle).__name__}: must be a Vehicle")
    if not isinstance(profile, Profile | None):
        raise ValueError(f"profile is a {type(profile).__name__}: must be a Profile")
    if np.ndim(speed_kmh) != 0:
        raise ValueError("speed_kmh must be one number")
    speed = float(kmh(speed_kmh))
    if not (math.isfinite(dt) and dt > 0.0):
        raise ValueError(f"dt = {dt:g} s: must be finite and above 0")
    if not (math.isfinite(run_in) and run_in >= 0.0):
        raise ValueError(f"run_in = {run_in:g} m: must be finite and not below 0")
    if profile is None:
        if distance is None:
            raise ValueError("a smooth road has no end: give the distance to run")
        first = 0.0
    else:
        first = float(profile.x[0])
        if profile.length < vehicle.length:
            raise ValueError(
                f"profile {profile.name!r} is {profile.length:g} m long, shorter than the "
                f"{vehicle.name}, {vehicle.length:g} m from the first to the last axle"
            )
        if not run_in < profile.length:
            raise ValueError(
                f"run_in = {run_in:g} m: must be below the length of the profile, "
                f"{profile.length:g} m"
            )
    origin = first + run_in
    if distance is None and profile is not None:
        distance = float(profile.x[-1]) - origin
    if distance is None or not (math.isfinite(distance) and distance > 0.0):
        raise ValueError(f"distance = {distance} m: must be finite and above 0")
    # A distance that is a whole number of steps but for rounding takes just those.
    steps = math.floor(distance / (speed * dt) + 1e-9)
    if not 1 <= steps <= 100_000_000:
        raise ValueError(
            f"{distance:g} m at {speed_kmh:g} km/h take {steps} steps of {dt:g} s: "
            "must be 1 to 100 million"
        )
    return Run(speed, origin, dt, math.ceil(run_in / (speed * dt) - 1e-9), steps)
