"""Vehicles of which only the axles are known, as from weigh-in-motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pavefem._core import GRAVITY
from pavefem._validity import warn_validity
from pavefem.units import AxleGroup, Unit, from_units, part_groups
from pavefem.vehicle import Vehicle
from pavefem.vehicles.builder import builder
from pavefem.vehicles.running_gear import AIR_HEIGHT, DRIVE, STEER, TRAILER, Kind, RunningGear, air

PIN_PLACE: Final = 0.9
"""Place of a fifth wheel between the front and the rear support of the unit that carries it."""
PIN_PART: Final = 0.8
"""Load on it as a part of the load that would leave that unit no weight at one of its ends."""
MOST_AXLES: Final = 50
"""Most axles of a record."""
WIDEST_GAP: Final = 50.0
"""Largest distance from one axle to the next, m, that is believed."""
LIGHTEST: Final = 12e3
HEAVIEST: Final = 500e3
"""Loads, N, between which the heaviest axle of a heavy vehicle is believed to be."""
GYRATION: Final = 1.0 / 3.0
"""Radius of gyration of a unit as a part of the distance between its supports."""


@builder
def from_axles(
    weights: ArrayLike,
    spacings: ArrayLike,
    *,
    suspension: Kind = "steel",
    groups: ArrayLike | None = None,
    print_length: float = 0.0,
) -> Vehicle:
    """Build a vehicle that has the given static axle loads exactly.

    What a record does not say is chosen so:

    * Axles less than 2 m apart are a group (as of `metrics.axle_groups`). The first two groups
      carry the first unit, each further group a semitrailer on a fifth wheel of the unit ahead.
      Where all axles are one group, the first of them stands alone.
    * The first group has steer axles on single tires (700 kg an axle), the second drive axles on
      dual tires (1100 kg), the others trailer axles on dual tires (750 kg), all as in the table of
      `pavefem.vehicles.running_gear`.
    * A fifth wheel stands 90 % of the way from the front to the rear support of the unit that
      carries it (a group's centre of load, or that unit's own fifth wheel). It takes 80 % of the
      load that would leave the unit no weight at one of its ends. Masses and centres of gravity
      follow from equilibrium; a radius of gyration is a third of the distance between supports.
    * On steel, groups have walking beams with arms in the inverse ratio of the sprung loads, as the
      paper's tandem has. On air, each axle has springs of its own, just so stiff that the vehicle
      stands level: the sprung load over 0.11 m, or less where tires are deflected less than those
      of another axle.

    Parameters
    ----------
    weights : array_like, shape (axles,)
        Static load of each axle, N, from the front to the rear; at least two.
    spacings : array_like, shape (axles - 1,)
        Distance from each axle to the next, m.
    suspension : {"steel", "air"}
        Springs.
    groups : array_like, shape (axles,), optional
        Number of the group of each axle, where 2 m do not tell them apart: a spread tandem.
    print_length : float
        Length of the tire print, m.

    Returns
    -------
    Vehicle

    Raises
    ------
    ValueError
        If an array has another length, weights or spacings are not finite and above 0, an axle
        weighs no more than its unsprung mass, or groups do not go up one by one.

    Warns
    -----
    ValidityWarning
        If the heaviest axle weighs less than 12 kN or more than 500 kN, as if not in N.

    Examples
    --------
    >>> vehicle = from_axles(weights=[60e3, 80e3, 75e3, 70e3, 72e3], spacings=[4.1, 1.3, 8.9, 1.25])
    >>> vehicle.static_loads.round(6)
    array([60000., 80000., 75000., 70000., 72000.])
    """
    loads, gaps = _positive("weights", weights, "N"), _positive("spacings", spacings, "m")
    if not 2 <= loads.size <= MOST_AXLES:
        raise ValueError(f"weights has {loads.size} axles: must be 2 to {MOST_AXLES}")
    if gaps.size and gaps.max() > WIDEST_GAP:
        raise ValueError(
            f"spacings reach {gaps.max():g} m: must be at most {WIDEST_GAP:g} m (they are in m)"
        )
    if not LIGHTEST <= loads.max() <= HEAVIEST:
        warn_validity(
            f"the heaviest axle weighs {loads.max():g} N: weights are in N, and that of a heavy "
            f"vehicle has {LIGHTEST:g} to {HEAVIEST:g} N",
            stacklevel=3,
        )
    if gaps.size != loads.size - 1:
        raise ValueError(
            f"spacings has {gaps.size} numbers for {loads.size} axles: must be {loads.size - 1}"
        )
    if suspension not in get_args(Kind):
        raise ValueError(f"suspension = {suspension!r}: must be one of {list(get_args(Kind))}")
    cuts = _cuts(gaps, groups)
    places = np.split(np.concatenate([[0.0], np.cumsum(gaps)]), cuts)
    gears = [STEER, DRIVE, *[TRAILER] * (len(cuts) - 1)]
    bunches = list(map(_Bunch, gears, places, np.split(loads, cuts)))
    _check_sprung(bunches)
    if suspension == "steel":
        under = [bunch.on_steel(print_length) for bunch in bunches]
    else:
        sunk = AIR_HEIGHT + max(float(bunch.tire_deflection.max()) for bunch in bunches)
        under = [bunch.on_air(print_length, sunk) for bunch in bunches]
    return from_units(_units(bunches, under), name=f"{loads.size}-axle vehicle on {suspension}")


class _Bunch(NamedTuple):
    """A group of axles: their kind, places and static loads."""

    gear: RunningGear
    places: NDArray[np.float64]
    loads: NDArray[np.float64]

    @property
    def sprung(self) -> NDArray[np.float64]:
        """Sprung load of each axle, N."""
        return self.loads - GRAVITY * self.gear.axle_mass

    @property
    def tire_deflection(self) -> NDArray[np.float64]:
        """How far the tires of each axle are pressed in, m."""
        return self.loads / (self.gear.tires.count * self.gear.tires.stiffness)

    @property
    def resultant(self) -> tuple[float, float]:
        """Place and size of the sprung load."""
        whole = self.sprung.sum()
        return float(self.places @ self.sprung / whole), float(whole)

    def on_steel(self, print_length: float) -> list[AxleGroup]:
        """Put them on leaf springs, under walking beams that give each axle its load."""
        one = self.places.size == 1
        group = AxleGroup(
            x=(self.places[0] + self.places[-1]) / 2.0,
            axles=self.places.size,
            spacing=None if one else tuple(np.diff(self.places)),
            axle_mass=self.gear.axle_mass,
            suspension=self.gear.steel,
            tires=self.gear.tires_with(print_length),
            equalization="independent" if one else "walking-beam",
            shares=None if one else tuple(self.sprung),
        )
        return [group]

    def on_air(self, print_length: float, sunk: float) -> list[AxleGroup]:
        """Put each on air springs that, with its tires, let the unit sink by `sunk`."""
        heights = sunk - self.tire_deflection
        return [
            AxleGroup(
                x=x,
                axle_mass=self.gear.axle_mass,
                suspension=air(load, height),
                tires=self.gear.tires_with(print_length),
            )
            for x, load, height in zip(self.places, self.sprung, heights, strict=True)
        ]


def _positive(name: str, values: ArrayLike, unit: str) -> NDArray[np.float64]:
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be a list of numbers, {unit}") from None
    if array.ndim != 1:
        raise ValueError(f"{name} has shape {array.shape}: must be a list of numbers, {unit}")
    sound = np.isfinite(array) & (array > 0.0)
    if not sound.all():
        wrong = int((~sound).argmax())
        raise ValueError(f"{name}[{wrong}] = {array[wrong]:g} {unit}: must be finite and above 0")
    return array


def _cuts(gaps: NDArray[np.float64], groups: ArrayLike | None) -> NDArray[np.intp]:
    """Numbers of the axles, from 0, that begin the second and each further group."""
    if groups is None:
        apart = part_groups(gaps)
        apart[0] |= not apart.any()
        return np.flatnonzero(apart) + 1
    numbers = np.asarray(groups)
    steps = np.diff(numbers) if numbers.shape == (gaps.size + 1,) else np.array([-1])
    if not np.isin(steps, (0, 1)).all() or not steps.any():
        raise ValueError(
            f"groups = {numbers.tolist()}: must be a number for each of {gaps.size + 1} axles, "
            "going up one by one, at least two groups"
        )
    return np.flatnonzero(steps) + 1


def _check_sprung(bunches: Sequence[_Bunch]) -> None:
    axle = 0
    for bunch in bunches:
        for load, sprung in zip(bunch.loads, bunch.sprung, strict=True):
            axle += 1
            if not sprung > 0.0:
                raise ValueError(
                    f"weights: {load:g} N on axle {axle}, must be above the {load - sprung:g} N of "
                    f"its unsprung mass of {bunch.gear.axle_mass:g} kg"
                )


def _units(bunches: Sequence[_Bunch], under: Sequence[Sequence[AxleGroup]]) -> list[Unit]:
    """Put units on the groups, in equilibrium with what they carry behind."""
    units: list[Unit] = []
    front_x, front = bunches[0].resultant
    for number, bunch in enumerate(bunches[1:], start=1):
        rear_x, rear = bunch.resultant
        base = rear_x - front_x
        pin, on_pin = front_x + PIN_PLACE * base, 0.0
        if bunch is not bunches[-1]:
            on_pin = PIN_PART * min(rear / PIN_PLACE, front / (1.0 - PIN_PLACE))
        weight = front + rear - on_pin
        mass = weight / GRAVITY
        units.append(
            Unit(
                name=_name(number, len(bunches) - 1),
                mass=mass,
                x=(front * front_x + rear * rear_x - on_pin * pin) / weight,
                pitch_inertia=mass * (GYRATION * base) ** 2,
                hitch=None if number == 1 else front_x,
                groups=[*under[0], *under[1]] if number == 1 else under[number],
            )
        )
        front_x, front = pin, on_pin
    return units


def _name(number: int, count: int) -> str:
    if number == 1:
        return "truck" if count == 1 else "tractor"
    return "trailer" if count == 2 else f"trailer {number - 1}"
