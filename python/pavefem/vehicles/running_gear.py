"""Axles, tires and springs of the ready-made vehicles.

All of these numbers are chosen, and round; per axle, both sides together:

=============================  ======  ======  =======  ====
quantity                       steer   drive   trailer  wide
=============================  ======  ======  =======  ====
unsprung mass, kg              700     1100    750      750
tires                          2       4       4        2
stiffness of a tire, MN/m      0.875   0.875   0.875    1.1
damping of a tire, kN s/m      1       1       1        1
steel springs, MN/m            0.8     2.0     2.0      2.0
their damping, kN s/m          20      50      50       50
=============================  ======  ======  =======  ====

*Steel* is a linear spring, with a viscous damping that stands for the friction of its leaves: 8 to
15 % of critical in the body modes of a loaded vehicle. Drive and trailer axles have the spring and
damping of the paper's tandem (Table II). Groups have walking beams that share equally. Without its
payload a vehicle bounces faster, up to 7 Hz. Where dry friction is asked for, it takes the place of
that damping but for 10 kN s/m of dampers, and takes effect over 2 mm.

*Air* springs keep their height: their stiffness is the sprung load over 0.11 m (1.5 Hz on rigid
tires), and their dampers have 32 % of critical on rigid tires, both at the load that the vehicle
has. Over a loaded driving axle they are as good as Directive 96/53/EC asks of air suspensions
(Annex II, points 2.3 and 2.5): the sprung mass swings at 2.0 Hz at most and is damped by more than
20 %. Groups are load-sharing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Final, Literal, NamedTuple

import numpy as np
from pydantic import Field

from pavefem._core import GRAVITY
from pavefem._model import Number
from pavefem.units import AxleGroup, Suspension, Tires, Unit, from_units
from pavefem.vehicle import Friction, Vehicle

Kind = Literal["steel", "air"]
DryFriction = Annotated[Number, Field(ge=0, lt=1)]
"""Largest force of dry friction as a part of the sprung load."""

AIR_HEIGHT: Final = 0.11
"""Sprung load over the stiffness of an air spring, m."""
AIR_DAMPING: Final = 0.32
"""Damping of an air suspension on rigid tires, a part of the critical one."""
DAMPERS: Final = 1e4
"""What dampers add to dry friction, N s/m."""
FRICTION_TRAVEL: Final = 2e-3
"""Stretch over which dry friction takes effect, m."""


class RunningGear(NamedTuple):
    """Axle, tires and steel springs of one kind."""

    axle_mass: float
    tires: Tires
    steel: Suspension

    def tires_with(self, print_length: float) -> Tires:
        """Give the tires a print, m long."""
        return self.tires.model_copy(update={"print_length": print_length})


_SINGLE: Final = Tires(stiffness=0.875e6, damping=1e3)
_DUAL: Final = _SINGLE.model_copy(update={"dual": True})
_LEAVES: Final = Suspension(stiffness=2.0e6, damping=5e4)

STEER: Final = RunningGear(700.0, _SINGLE, Suspension(stiffness=0.8e6, damping=2e4))
DRIVE: Final = RunningGear(1100.0, _DUAL, _LEAVES)
TRAILER: Final = RunningGear(750.0, _DUAL, _LEAVES)
WIDE: Final = RunningGear(750.0, Tires(stiffness=1.1e6, damping=1e3), _LEAVES)


def air(load: float, height: float = AIR_HEIGHT) -> Suspension:
    """Give the air springs and dampers under a sprung load, N."""
    stiffness = load / height
    critical = 2.0 * math.sqrt(stiffness * load / GRAVITY)
    return Suspension(stiffness=stiffness, damping=AIR_DAMPING * critical)


def sprung(kind: Kind, leaves: Suspension, load: float, dry_friction: float) -> Suspension:
    """Give the springs under a sprung load, N."""
    if kind == "air" and dry_friction > 0.0:
        raise ValueError(f"dry_friction = {dry_friction:g}: only steel springs have any, air has 0")
    if kind == "air":
        return air(load)
    if dry_friction == 0.0:
        return leaves
    friction = Friction(force=dry_friction * load, travel=FRICTION_TRAVEL)
    return leaves.model_copy(update={"damping": DAMPERS, "friction": friction})


class Options(NamedTuple):
    """What all axles of a vehicle have in common."""

    kind: Kind
    dry_friction: float
    print_length: float

    def group(
        self, gear: RunningGear, x: float, axles: int = 1, spacing: float | None = None
    ) -> AxleGroup:
        """Make a group of axles, on steel springs so far."""
        shared = "walking-beam" if self.kind == "steel" else "load-sharing"
        return AxleGroup(
            x=x,
            axles=axles,
            spacing=spacing,
            axle_mass=gear.axle_mass,
            suspension=gear.steel,
            tires=gear.tires_with(self.print_length),
            equalization="independent" if axles == 1 else shared,
        )

    def finish(self, name: str, units: Sequence[Unit]) -> Vehicle:
        """Give each group the springs for its static load."""
        # Each unit has two supports, so that loads do not depend on the springs.
        loads = iter(from_units(units).static_loads)
        finished = []
        for unit in units:
            groups = []
            for group in unit.groups:
                mean = float(np.mean([next(loads) for _ in range(group.axles)]))
                load = mean - GRAVITY * group.axle_mass
                springs = sprung(self.kind, group.suspension, load, self.dry_friction)
                groups.append(group.model_copy(update={"suspension": springs}))
            finished.append(unit.model_copy(update={"groups": tuple(groups)}))
        return from_units(finished, name=f"{name} on {self.kind}")


class Load(NamedTuple):
    """A mass on a unit: kg, its centre of gravity and its radius of gyration, m."""

    mass: float
    x: float
    radius: float

    @classmethod
    def spread(cls, mass: float, front: float, rear: float) -> Load:
        """Spread a mass evenly between two places."""
        return cls(mass, (front + rear) / 2.0, (rear - front) / math.sqrt(12.0))


def laden(
    name: str,
    loads: Sequence[Load],
    groups: Sequence[AxleGroup],
    hitch: float | None = None,
) -> Unit:
    """Make a unit of its tare and payload, which add up in mass and inertia."""
    mass = sum(load.mass for load in loads)
    x = sum(load.mass * load.x for load in loads) / mass
    inertia = sum(load.mass * (load.radius**2 + (load.x - x) ** 2) for load in loads)
    return Unit(name=name, mass=mass, x=x, pitch_inertia=inertia, hitch=hitch, groups=groups)
