"""Vehicles from their units: rigid bodies on groups of axles, coupled by fifth wheels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Annotated, Any, Final, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from pavefem._model import Model, NotNegative, Number, Positive, checked
from pavefem.vehicle import Body, Friction, PrintLength, Spring, Tire, Vehicle

Equalization = Literal["independent", "walking-beam", "load-sharing"]

GROUP_SPACING: Final = 2.0
"""Spacing from which axles are no group, m, where only their places are known: Directive 96/53/EC
limits the weight of tandems and tridems by spacings up to 1.8 m."""

BEAM_INERTIA: Final = 100.0
"""Pitch moment of inertia of a walking beam where none is given, kg m²: chosen, as that of the
paper's truck."""


def part_groups(gaps: NDArray[np.float64], within: float = GROUP_SPACING) -> NDArray[np.bool_]:
    """Whether axles that are `gaps` apart, m, are of different groups."""
    return np.abs(gaps) >= within


def _listed(value: Any) -> Any:
    """Take a number for a list of one."""
    return value if isinstance(value, list | tuple) else (value,)


Spacing = Annotated[tuple[Positive, ...], Field(min_length=1), BeforeValidator(_listed)]


class Suspension(Model):
    """Springs and dampers of one axle, both sides of the vehicle together."""

    stiffness: Positive
    """Spring constant, N/m."""
    damping: NotNegative
    """Damping constant, N s/m."""
    friction: Friction | None = None
    """Dry friction beside them."""

    def between(self, upper: str, lower: str, x: float) -> Spring:
        """Give the spring between two bodies."""
        return Spring(upper=upper, lower=lower, x=x, **dict(self))


class Tires(Model):
    """Tires of one axle, all alike."""

    stiffness: Positive
    """Spring constant of one tire, N/m."""
    damping: NotNegative
    """Damping constant of one tire, N s/m."""
    dual: bool = False
    """Whether the axle has two tires on each side, or one."""
    print_length: PrintLength = 0.0
    """Length of the tire print, over which the elevation of the road is averaged, m; 0 for a
    point."""

    @property
    def count(self) -> int:
        """Number of tires of the axle."""
        return 4 if self.dual else 2

    def under(self, body: str, x: float) -> Tire:
        """Give the tires of an axle together."""
        return Tire(
            body=body,
            x=x,
            stiffness=self.count * self.stiffness,
            damping=self.count * self.damping,
            print_length=self.print_length,
            dual=self.dual,
        )


class AxleGroup(Model):
    """A single axle, a tandem, a tridem or more: axles alike under one unit.

    ``equalization`` says how the axles share their load:

    ``"independent"``
        Each stands under the unit on springs of its own.
    ``"load-sharing"``
        Their springs are connected, as air springs are by wide pipes: all axles carry the same,
        whatever the road, and the force follows their mean height. Dampers stay on their own.
    ``"walking-beam"``
        Springs stand between the axles and the ends of a beam that is pinned to the unit, as in
        the paper's truck (Fig. 4). Where one half of a group has several axles, the end of the beam
        carries another beam: a tridem has one with arms 2:1 that carries its first axle, and one
        for the other two.
    """

    x: Number
    """Middle between its first and its last axle, m behind the vehicle's front axle."""
    axles: Annotated[int, Field(ge=1, le=50)] = 1
    """Number of axles."""
    spacing: Spacing | None = None
    """Distance from one axle to the next, m, one for all or each; for more axles than one."""
    axle_mass: Positive
    """Unsprung mass of each axle, kg."""
    suspension: Suspension
    """Springs and dampers of each axle."""
    tires: Tires
    """Tires of each axle."""
    equalization: Equalization = "independent"
    """How the axles share their load."""
    shares: Annotated[tuple[Positive, ...], Field(min_length=1)] | None = None
    """What walking beams give to each axle of the sprung load, front to rear, in any unit; by
    default the same. Arms are in the inverse ratio."""
    beam_mass: NotNegative = 0.0
    """Mass of each walking beam, kg, with its centre of gravity at the pin."""
    beam_inertia: Positive = BEAM_INERTIA
    """Pitch moment of inertia of each walking beam, kg m²."""

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        spacings = 0 if self.spacing is None else len(self.spacing)
        if spacings not in {min(1, self.axles - 1), self.axles - 1}:
            allowed = ["none", "one", f"one for all, or {self.axles - 1}"][min(self.axles, 3) - 1]
            raise ValueError(f"{spacings} spacings for {self.axles} axles: must be {allowed}")
        if self.axles == 1 and self.equalization != "independent":
            raise ValueError(f"equalization = {self.equalization!r} needs more axles than one")
        beams = self.shares, self.beam_mass, self.beam_inertia
        if self.equalization != "walking-beam" and beams != (None, 0.0, BEAM_INERTIA):
            raise ValueError(
                "shares, beam_mass and beam_inertia are for equalization = 'walking-beam' only "
                f"(it is {self.equalization!r})"
            )
        if self.shares is not None and len(self.shares) != self.axles:
            raise ValueError(f"{len(self.shares)} shares for {self.axles} axles: must be one each")
        return self

    @property
    def places(self) -> tuple[float, ...]:
        """Places of the axles, m behind the vehicle's front axle."""
        gaps = self.spacing or ()
        if len(gaps) == 1:
            gaps *= self.axles - 1
        return tuple(accumulate(gaps, initial=self.x - sum(gaps) / 2.0))


class Unit(Model):
    """A rigid body on its groups of axles: a truck, a tractor, a trailer or a dolly.

    The first unit bounces and pitches. Each one after it rests on a fifth wheel (or hangs on a
    drawbar) of the unit before it, about which it pitches.
    """

    name: Annotated[str, Field(min_length=1)]
    """What bodies, tables and plots call it."""
    mass: Positive
    """Sprung mass with its load, kg."""
    x: Number
    """Centre of gravity of the sprung mass, m behind the vehicle's front axle."""
    pitch_inertia: Positive
    """Moment of inertia of the sprung mass about its centre of gravity, kg m²."""
    hitch: Number | None = None
    """Place of the fifth wheel on the unit before this one, m behind the vehicle's front axle."""
    groups: Annotated[tuple[AxleGroup, ...], Field(min_length=1)]
    """Groups of axles, from the front to the rear."""


@checked
def from_units(units: Sequence[Unit], *, name: str = "vehicle") -> Vehicle:
    """Build a vehicle from its units.

    Bodies are called as the units, ``"<unit> axle 3"`` with axles numbered through the vehicle, and
    ``"<unit> beam of axles 2-3"``.

    Parameters
    ----------
    units : sequence of Unit
        Units from the front to the rear; all but the first have a `hitch`.
    name : str
        What tables and plots call the vehicle.

    Returns
    -------
    Vehicle

    Raises
    ------
    ValueError
        If there are no units, or two share a name; if the first has a hitch, or a later one has
        none; if the first one's axles would not hold it up; if axles do not go from the front to
        the rear, beginning at 0 m; or if a static load is not above zero.

    Examples
    --------
    A two-axle lorry:

    >>> springs, tires = Suspension(stiffness=8e5, damping=2e4), Tires(stiffness=9e5, damping=1e3)
    >>> front, rear = (
    ...     AxleGroup(x=x, axle_mass=700.0, suspension=springs, tires=tires) for x in (0.0, 4.0)
    ... )
    >>> body = Unit(name="lorry", mass=8000.0, x=2.0, pitch_inertia=2e4, groups=[front, rear])
    >>> from_units([body]).static_loads.round()
    array([46107., 46107.])
    """
    _check_chain(units)
    parts = _Parts()
    for unit, ahead in zip(units, [None, *units[:-1]], strict=True):
        parts.add(unit, ahead)
    return Vehicle(name=name, bodies=parts.bodies, springs=parts.springs, tires=parts.tires)


def _check_chain(units: Sequence[Unit]) -> None:
    """Check what goes beyond one unit."""
    if not units:
        raise ValueError("there are no units: must be at least one")
    names = [unit.name for unit in units]
    for number, unit in enumerate(units):
        if unit.name in names[:number]:
            raise ValueError(f"two units are called {unit.name!r}: each needs a name of its own")
        if number == 0 and unit.hitch is not None:
            raise ValueError(f"unit {unit.name!r} is the first: it has no unit to be hitched to")
        if number > 0 and unit.hitch is None:
            raise ValueError(f"unit {unit.name!r} has no hitch: one is needed behind the first")
    first = units[0]
    supports = [g.axles if g.equalization == "independent" else 1 for g in first.groups]
    if sum(supports) < 2:
        raise ValueError(
            f"unit {first.name!r} would tip over: the first unit needs two supports, and a group "
            "is one unless its axles are independent"
        )
    before: float | None = None
    for unit in units:
        for number, group in enumerate(unit.groups, start=1):
            for place in group.places:
                where = f"unit {unit.name!r}, group {number}: an axle stands at {place:g} m"
                if before is None and abs(place) > 1e-9:
                    raise ValueError(f"{where}, but places count from the front axle: must be 0")
                if before is not None and not place > before:
                    raise ValueError(
                        f"{where}, not behind the axle before it at {before:g} m: units and their "
                        "groups go from the front to the rear"
                    )
                before = place


class _Axle(NamedTuple):
    """An axle that is to be hung up."""

    number: int
    body: str
    x: float
    share: float


@dataclass
class _Parts:
    """The bodies, springs and tires of the units so far."""

    bodies: list[Body] = field(default_factory=list)
    springs: list[Spring] = field(default_factory=list)
    tires: list[Tire] = field(default_factory=list)

    def add(self, unit: Unit, ahead: Unit | None) -> None:
        """Add a unit, coupled to the one ahead."""
        self.bodies.append(
            Body(
                name=unit.name,
                mass=unit.mass,
                x=unit.x,
                pitch_inertia=unit.pitch_inertia,
                pinned_to=None if ahead is None else ahead.name,
                pin=unit.hitch,
            )
        )
        for group in unit.groups:
            shares = group.shares or (1.0,) * group.axles
            axles = [
                self._axle(unit, group, x, share)
                for x, share in zip(group.places, shares, strict=True)
            ]
            if group.equalization == "walking-beam":
                self._hang(unit, group, unit.name, axles)
            elif group.equalization == "load-sharing":
                self._connect(unit, group, axles)
            else:
                for axle in axles:
                    self.springs.append(group.suspension.between(unit.name, axle.body, axle.x))

    def _axle(self, unit: Unit, group: AxleGroup, x: float, share: float) -> _Axle:
        number = len(self.tires) + 1
        axle = _Axle(number, f"{unit.name} axle {number}", x, share)
        self.bodies.append(Body(name=axle.body, mass=group.axle_mass, x=x))
        self.tires.append(group.tires.under(axle.body, x))
        return axle

    def _connect(self, unit: Unit, group: AxleGroup, axles: Sequence[_Axle]) -> None:
        """Put the axles under one spring as stiff as theirs together, and dampers of their own."""
        suspension = group.suspension
        self.springs.append(
            Spring(
                upper=unit.name,
                lower=tuple(axle.body for axle in axles),
                x=tuple(axle.x for axle in axles),
                stiffness=group.axles * suspension.stiffness,
                damping=0.0,
            )
        )
        if suspension.damping == 0.0 and suspension.friction is None:
            return
        for axle in axles:
            spring = suspension.between(unit.name, axle.body, axle.x)
            self.springs.append(spring.model_copy(update={"stiffness": 0.0}))

    def _hang(self, unit: Unit, group: AxleGroup, upper: str, axles: Sequence[_Axle]) -> None:
        """Hang one axle under `upper` on its spring, several under a beam pinned to it."""
        if len(axles) == 1:
            self.springs.append(group.suspension.between(upper, axles[0].body, axles[0].x))
            return
        pin = sum(axle.share * axle.x for axle in axles) / sum(axle.share for axle in axles)
        beam = f"{unit.name} beam of axles {axles[0].number}-{axles[-1].number}"
        self.bodies.append(
            Body(
                name=beam,
                mass=group.beam_mass,
                x=pin,
                pitch_inertia=group.beam_inertia,
                pinned_to=upper,
                pin=pin,
            )
        )
        half = len(axles) // 2
        self._hang(unit, group, beam, axles[:half])
        self._hang(unit, group, beam, axles[half:])
