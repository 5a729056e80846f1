"""Trucks and combinations near legal weights, on steel or air springs.

Dimensions and masses are chosen, so that static loads come near the limits that each preset names.
Axles, tires and springs are those of `pavefem.vehicles.running_gear`.
"""

from __future__ import annotations

from pavefem._core import GRAVITY
from pavefem._model import NotNegative, Positive, checked
from pavefem.vehicle import Body, Vehicle
from pavefem.vehicles.builder import builder
from pavefem.vehicles.running_gear import (
    DRIVE,
    STEER,
    TRAILER,
    WIDE,
    DryFriction,
    Kind,
    Load,
    Options,
    laden,
    sprung,
)


@builder
@checked
def quarter_car(
    *,
    suspension: Kind = "steel",
    sprung_mass: Positive = 8900.0,
    dry_friction: DryFriction = 0.0,
    print_length: NotNegative = 0.0,
) -> Vehicle:
    """Build a quarter car: a drive axle and the mass that it carries, 2 degrees of freedom.

    Both sides together, as everywhere: two quarters of a vehicle side by side.

    ============  =============================
    sprung mass   8900 kg
    drive axle    at 0 m
    static loads  98.1 kN
    ============  =============================

    =====  ===========  ===========  =============  ===========
    on     body, Hz     damping      hop, Hz        damping
    =====  ===========  ===========  =============  ===========
    steel  1.91 - 1.91  0.09 - 0.09  11.24 - 11.24  0.37 - 0.37
    air    1.39 - 1.39  0.24 - 0.24  9.70 - 9.70    0.45 - 0.45
    =====  ===========  ===========  =============  ===========

    Parameters
    ----------
    suspension : {"steel", "air"}
        Springs.
    sprung_mass : float
        Sprung mass, kg.
    dry_friction : float
        Largest friction of steel springs, as a part of their load.
    print_length : float
        Length of the tire print, m.

    Raises
    ------
    ValueError
        If a value is out of range, or air springs are given dry friction.

    Examples
    --------
    >>> quarter_car(suspension="air").natural_frequencies().round(2)
    array([1.35, 9.96])
    """
    mass, axle = "sprung mass", "axle 1"
    springs = sprung(suspension, DRIVE.steel, GRAVITY * sprung_mass, dry_friction)
    tires = DRIVE.tires_with(print_length)
    return Vehicle(
        name=f"quarter car on {suspension}",
        bodies=(
            Body(name=mass, mass=sprung_mass, x=0.0),
            Body(name=axle, mass=DRIVE.axle_mass, x=0.0),
        ),
        springs=(springs.between(mass, axle, 0.0),),
        tires=(tires.under(axle, 0.0),),
    )


@builder
@checked
def rigid_truck(
    *,
    suspension: Kind = "steel",
    payload: NotNegative = 11_000.0,
    dry_friction: DryFriction = 0.0,
    print_length: NotNegative = 0.0,
) -> Vehicle:
    """Build a 2-axle truck of 18 t, the limit of Directive 96/53/EC, Annex I.

    ============  ==============================================
    sprung tare   5200 kg at 1.5 m, radius of gyration 1.8 m
    payload       11 000 kg, evenly spread over 0.9 to 6.9 m
    steer axle    at 0 m
    drive axle    at 5.0 m
    static loads  66.3, 110.3 kN
    ============  ==============================================

    =====  ===========  ===========  =============  ===========
    on     body, Hz     damping      hop, Hz        damping
    =====  ===========  ===========  =============  ===========
    steel  1.61 - 1.95  0.08 - 0.10  9.61 - 11.24   0.28 - 0.37
    air    1.37 - 1.60  0.22 - 0.25  8.80 - 9.77    0.50 - 0.53
    =====  ===========  ===========  =============  ===========

    Parameters
    ----------
    suspension : {"steel", "air"}
        Springs.
    payload : float
        Payload, kg.
    dry_friction : float
        Largest friction of steel springs, as a part of their load.
    print_length : float
        Length of the tire print, m.

    Raises
    ------
    ValueError
        If a value is out of range, or air springs are given dry friction.

    Examples
    --------
    >>> rigid_truck(payload=0.0).static_loads.round()
    array([42575., 26095.])
    """
    options = Options(suspension, dry_friction, print_length)
    truck = laden(
        "truck",
        [Load(5200.0, 1.5, 1.8), Load.spread(payload, 0.9, 6.9)],
        [options.group(STEER, 0.0), options.group(DRIVE, 5.0)],
    )
    return options.finish("2-axle truck", [truck])


@builder
@checked
def semitrailer(
    *,
    suspension: Kind = "steel",
    payload: NotNegative = 22_400.0,
    dry_friction: DryFriction = 0.0,
    print_length: NotNegative = 0.0,
) -> Vehicle:
    """Build a 5-axle tractor-semitrailer of 36.2 t: two tandems, as of 23 U.S.C. 127.

    (80 000 lb in all, 34 000 lb a tandem.)

    ==============  ==================================================
    tractor, tare   4900 kg sprung at 0.9 m, radius of gyration 1.6 m
    steer axle      at 0 m
    drive tandem    about 5.0 m, 1.3 m apart
    fifth wheel     at 4.7 m
    trailer, tare   4500 kg sprung at 11.2 m, radius of gyration 3.8 m
    payload         22 400 kg, evenly spread over 3.8 to 16.6 m
    trailer tandem  about 15.7 m, 1.25 m apart
    static loads    54.0, 75.2, 75.2, 75.3, 75.3 kN
    ==============  ==================================================

    =====  ===========  ===========  =============  ===========
    on     body, Hz     damping      hop, Hz        damping
    =====  ===========  ===========  =============  ===========
    steel  1.88 - 3.29  0.10 - 0.15  8.50 - 13.47   0.03 - 0.46
    air    1.41 - 2.20  0.25 - 0.40  8.56 - 11.35   0.35 - 0.45
    =====  ===========  ===========  =============  ===========

    Parameters
    ----------
    suspension, payload, dry_friction, print_length
        As of `rigid_truck`.

    Raises
    ------
    ValueError
        If a value is out of range, or air springs are given dry friction.

    Examples
    --------
    >>> semitrailer(suspension="air")
    Vehicle('5-axle tractor-semitrailer on air', 36.2 t, 5 axles, 8 degrees of freedom)
    """
    options = Options(suspension, dry_friction, print_length)
    tractor = laden(
        "tractor",
        [Load(4900.0, 0.9, 1.6)],
        [options.group(STEER, 0.0), options.group(DRIVE, 5.0, 2, 1.3)],
    )
    trailer = laden(
        "trailer",
        [Load(4500.0, 11.2, 3.8), Load.spread(payload, 3.8, 16.6)],
        [options.group(TRAILER, 15.7, 2, 1.25)],
        hitch=4.7,
    )
    return options.finish("5-axle tractor-semitrailer", [tractor, trailer])


@builder
@checked
def tridem_semitrailer(
    *,
    suspension: Kind = "steel",
    payload: NotNegative = 28_100.0,
    dry_friction: DryFriction = 0.0,
    print_length: NotNegative = 0.0,
) -> Vehicle:
    """Build a 6-axle tractor-semitrailer of 44 t: drive tandem, and a tridem on wide single tires.

    44 t is the limit of Directive 96/53/EC, Annex I, for a container in combined transport; it
    allows a drive tandem 18 t, or 19 t on air springs and dual tires, and a tridem 24 t.

    ==============  ==================================================
    tractor, tare   5500 kg sprung at 0.8 m, radius of gyration 1.5 m
    steer axle      at 0 m
    drive tandem    about 3.9 m, 1.35 m apart
    fifth wheel     at 3.4 m
    trailer, tare   5250 kg sprung at 8.4 m, radius of gyration 3.6 m
    payload         28 100 kg, evenly spread over 1.7 to 13.9 m
    tridem          about 11.1 m, 1.31 m apart
    static loads    67.2, 75.7, 75.7, 71.0, 71.0, 71.0 kN
    ==============  ==================================================

    =====  ===========  ===========  =============  ===========
    on     body, Hz     damping      hop, Hz        damping
    =====  ===========  ===========  =============  ===========
    steel  1.72 - 2.58  0.08 - 0.12  7.99 - 11.93   0.02 - 0.50
    air    1.38 - 1.84  0.23 - 0.35  8.59 - 9.44    0.35 - 0.54
    =====  ===========  ===========  =============  ===========

    Parameters
    ----------
    suspension, payload, dry_friction, print_length
        As of `rigid_truck`.

    Raises
    ------
    ValueError
        If a value is out of range, or air springs are given dry friction.
    """
    options = Options(suspension, dry_friction, print_length)
    tractor = laden(
        "tractor",
        [Load(5500.0, 0.8, 1.5)],
        [options.group(STEER, 0.0), options.group(DRIVE, 3.9, 2, 1.35)],
    )
    trailer = laden(
        "trailer",
        [Load(5250.0, 8.4, 3.6), Load.spread(payload, 1.7, 13.9)],
        [options.group(WIDE, 11.1, 3, 1.31)],
        hitch=3.4,
    )
    return options.finish("6-axle tractor-semitrailer", [tractor, trailer])


@builder
@checked
def b_double(
    *,
    suspension: Kind = "steel",
    payload: NotNegative = 38_000.0,
    dry_friction: DryFriction = 0.0,
    print_length: NotNegative = 0.0,
) -> Vehicle:
    """Build a 9-axle B-double of 62 t: a prime mover and two semitrailers on tridems.

    The general mass limits of the Australian Heavy Vehicle National Law are 6.0 t on the steer
    axle, 16.5 t on a tandem and 20 t on a tridem, 62.5 t together.

    ===================  ====================================================
    prime mover, tare    6100 kg sprung at 1.25 m, radius of gyration 1.6 m
    steer axle           at 0 m
    drive tandem         about 4.3 m, 1.3 m apart
    fifth wheel          at 4.0 m
    lead trailer, tare   5500 kg sprung at 6.6 m, radius of gyration 2.2 m
    its payload          37 % of 38 000 kg, evenly spread over 3.1 to 9.2 m
    its tridem           about 10.4 m, 1.25 m apart
    its fifth wheel      at 10.1 m
    rear trailer, tare   5000 kg sprung at 15.4 m, radius of gyration 3.4 m
    its payload          63 % of 38 000 kg, evenly spread over 9.0 to 21.7 m
    its tridem           about 18.7 m, 1.25 m apart
    static loads         58.3, 79.4, 79.4, 65.2, 65.2, 65.2, 65.2, 65.2, 65.2 kN
    ===================  ====================================================

    =====  ===========  ===========  =============  ===========
    on     body, Hz     damping      hop, Hz        damping
    =====  ===========  ===========  =============  ===========
    steel  1.84 - 3.19  0.10 - 0.15  8.50 - 13.53   0.03 - 0.47
    air    1.42 - 2.08  0.25 - 0.41  8.58 - 11.41   0.38 - 0.47
    =====  ===========  ===========  =============  ===========

    Parameters
    ----------
    suspension, payload, dry_friction, print_length
        As of `rigid_truck`.

    Raises
    ------
    ValueError
        If a value is out of range, or air springs are given dry friction.
    """
    options = Options(suspension, dry_friction, print_length)
    prime_mover = laden(
        "prime mover",
        [Load(6100.0, 1.25, 1.6)],
        [options.group(STEER, 0.0), options.group(DRIVE, 4.3, 2, 1.3)],
    )
    lead = laden(
        "lead trailer",
        [Load(5500.0, 6.6, 2.2), Load.spread(0.37 * payload, 3.1, 9.2)],
        [options.group(TRAILER, 10.4, 3, 1.25)],
        hitch=4.0,
    )
    rear = laden(
        "rear trailer",
        [Load(5000.0, 15.4, 3.4), Load.spread(0.63 * payload, 9.0, 21.7)],
        [options.group(TRAILER, 18.7, 3, 1.25)],
        hitch=10.1,
    )
    return options.finish("9-axle B-double", [prime_mover, lead, rear])
