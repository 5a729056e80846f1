"""The truck of the paper (section IV, Table II)."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import Field

from pavefem._core import GRAVITY
from pavefem._model import NotNegative, Number, Positive, checked
from pavefem.vehicle import Body, Spring, Tire, Vehicle
from pavefem.vehicles.builder import builder

STATIC_LOADS: Final = (38_925.0, 76_335.0, 80_938.0)
"""Static axle loads of the paper's truck at the nominal payload, N."""
AXLE_MASSES: Final = (600.0, 1000.0, 1000.0)
"""Masses of its steer axle and two tandem axles, kg (Table II)."""
NOMINAL_PAYLOAD: Final = 12_400.0
"""Payload that makes the paper's 20 t truck, kg (section VI.C)."""
TARE: Final = sum(STATIC_LOADS) / GRAVITY - sum(AXLE_MASSES) - NOMINAL_PAYLOAD
"""Sprung mass without payload, kg: what the printed axle loads weigh, 4999.8 (Table II: 5000)."""

SpringAndDamper = tuple[Positive, NotNegative]
"""Stiffness, N/m, and damping, N s/m."""


@builder
@checked
def tandem_truck(
    *,
    axle_spacing: Positive = 1.3,
    payload: Annotated[Number, Field(gt=-TARE)] = NOMINAL_PAYLOAD,
    wheelbase: Positive = 5.2,
    front_suspension: SpringAndDamper = (1.0e6, 1.0e4),
    rear_suspension: SpringAndDamper = (2.0e6, 5.0e4),
    front_tires: SpringAndDamper = (1.75e6, 1.0e4),
    rear_tires: SpringAndDamper = (3.5e6, 1.0e4),
    pitch_inertia: Positive = 8.0e4,
    beam_inertia: Positive = 100.0,
) -> Vehicle:
    """Build the paper's three-axle truck: 6 DOF, with a walking-beam tandem (Fig. 4, Table II).

    Unknowns are bounce and pitch of the sprung mass, bounce of the three axles, and pitch of the
    equalizing beam, which is pinned to the sprung mass; the rear springs stand between its ends and
    the axles. The centre of gravity and the pin follow from the static axle loads at the nominal
    payload, the beam's arms being in the inverse ratio of the sprung loads. A change of the axle
    spacing keeps the tandem's centre and the static loads; a change of payload keeps the geometry.

    Parameters
    ----------
    axle_spacing : float
        Distance between the tandem axles, m.
    payload : float
        Payload, kg; the paper's 20 t truck carries 12 400 kg.
    wheelbase : float
        Front axle to the centre of the tandem, m.
    front_suspension, rear_suspension : (float, float)
        Stiffness, N/m, and damping, N s/m, of an axle.
    front_tires, rear_tires : (float, float)
        Stiffness, N/m, and damping, N s/m, of an axle (not in the paper).
    pitch_inertia, beam_inertia : float
        Pitch moments of inertia of the sprung mass and the beam, kg m² (not in the paper).

    Returns
    -------
    Vehicle

    Raises
    ------
    ValueError
        If the spacing is not above 0, puts an axle ahead of the front one, or another value is out
        of range.

    Examples
    --------
    >>> tandem_truck().static_loads.round()
    array([38925., 76335., 80938.])
    """
    first, last = wheelbase - axle_spacing / 2.0, wheelbase + axle_spacing / 2.0
    if not first > 0.0:
        raise ValueError(
            f"axle_spacing = {axle_spacing:g} m with a wheelbase of {wheelbase:g} m: must be below "
            "twice the wheelbase"
        )
    steer, leading, trailing = (
        load - GRAVITY * mass for load, mass in zip(STATIC_LOADS, AXLE_MASSES, strict=True)
    )
    pin = first + axle_spacing * trailing / (leading + trailing)
    centre = pin * (leading + trailing) / (steer + leading + trailing)
    steer_mass, leading_mass, trailing_mass = AXLE_MASSES
    sprung, beam = "sprung mass", "equalizing beam"
    axles = ("steer axle", "leading tandem axle", "trailing tandem axle")

    def spring(upper: str, lower: str, x: float, given: SpringAndDamper) -> Spring:
        stiffness, damping = given
        return Spring(upper=upper, lower=lower, x=x, stiffness=stiffness, damping=damping)

    def tire(axle: str, x: float, given: SpringAndDamper) -> Tire:
        stiffness, damping = given
        return Tire(body=axle, x=x, stiffness=stiffness, damping=damping)

    return Vehicle(
        name="three-axle tandem truck",
        bodies=(
            Body(name=sprung, mass=TARE + payload, x=centre, pitch_inertia=pitch_inertia),
            Body(name=axles[0], mass=steer_mass, x=0.0),
            Body(name=axles[1], mass=leading_mass, x=first),
            Body(name=axles[2], mass=trailing_mass, x=last),
            Body(name=beam, mass=0.0, x=pin, pitch_inertia=beam_inertia, pinned_to=sprung, pin=pin),
        ),
        springs=(
            spring(sprung, axles[0], 0.0, front_suspension),
            spring(beam, axles[1], first, rear_suspension),
            spring(beam, axles[2], last, rear_suspension),
        ),
        tires=(
            tire(axles[0], 0.0, front_tires),
            tire(axles[1], first, rear_tires),
            tire(axles[2], last, rear_tires),
        ),
    )
