"""Tires that leave the road, and springs that rub: against other integrators and closed forms.

Goal: the motion of a quarter car that lifts off, or has dry friction, agrees with those of scipy to
the stated tolerance; a force that does not act changes nothing; momentum is kept, and the
hysteresis loop of dry friction has its closed form.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from oracle import Array
from scipy.integrate import solve_ivp

import pavefem as pf

G = 9.81
SPRUNG, AXLE, KS, CS, KT, CT = 4500.0, 500.0, 4e5, 1.5e4, 2e6, 2e3
WEIGHT = (SPRUNG + AXLE) * G


def quarter_car(friction: pf.Friction | None = None) -> pf.Vehicle:
    return pf.Vehicle(
        name="quarter car",
        bodies=[pf.Body(name="sprung", mass=SPRUNG, x=0.0), pf.Body(name="axle", mass=AXLE, x=0.0)],
        springs=[
            pf.Spring(
                upper="sprung", lower="axle", x=0.0, stiffness=KS, damping=CS, friction=friction
            )
        ],
        tires=[pf.Tire(body="axle", x=0.0, stiffness=KT, damping=CT)],
    )


def road(height: float, length: float = 30.0) -> pf.Profile:
    """Give a hole of smooth sides, 3 m long, and level road behind it."""
    x = np.arange(0.0, length, 0.01)
    inside = (x > 3.0) & (x < 6.0)
    return pf.Profile(x, np.where(inside, -height / 2 * (1 - np.cos(2 * np.pi * (x - 3) / 3)), 0.0))


def by_scipy(
    profile: pf.Profile, speed: float, times: Array, friction: pf.Friction | None = None
) -> Array:
    """Tire force by an implicit Runge-Kutta method, the road being the same straight lines."""
    slopes = np.append(np.diff(profile.z) / np.diff(profile.x), 0.0)

    def tire(t: float, axle: float, rate: float) -> float:
        x = speed * t
        slope = slopes[np.searchsorted(profile.x, x, side="right") - 1]
        road = profile.elevation(x)
        return float(max(0.0, WEIGHT + KT * (road - axle) + CT * (slope * speed - rate)))

    def rates(t: float, y: Array) -> list[float]:
        us, ua, vs, va, rub = y
        stretch = vs - va
        spring = KS * (us - ua) + CS * stretch + rub
        change = 0.0
        if friction is not None:
            change = (friction.force * np.sign(stretch) - rub) * abs(stretch) / friction.travel
        return [vs, va, -spring / SPRUNG, (spring + tire(t, ua, va) - WEIGHT) / AXLE, change]

    solved = solve_ivp(
        rates, (0.0, times[-1]), np.zeros(5), "DOP853", times, rtol=1e-9, atol=1e-11, max_step=5e-4
    )
    assert solved.success
    states = zip(times, solved.y[1], solved.y[3], strict=True)
    return np.array([tire(t, axle, rate) for t, axle, rate in states])


# --- lift-off ---------------------------------------------------------------------------------


def test_lift_off_against_scipy() -> None:
    """A hole of 12 cm at 72 km/h: the tire leaves the road, falls, and lands hard."""
    profile, speed = road(0.12), 20.0
    found = pf.tire_forces(quarter_car(), profile, speed * 3.6, lift_off=True)
    expected = by_scipy(profile, speed, found.time)
    assert (expected == 0.0).sum() > 50
    assert expected.max() > 2.0 * WEIGHT
    # At kinks the damper's force jumps: either side of one may be reported.
    error = np.abs(found.force[:, 0] - expected)
    assert np.sqrt(np.mean(error**2)) < 1e-3 * WEIGHT
    assert error.max() < 1e-2 * WEIGHT
    linear = pf.tire_forces(quarter_car(), profile, speed * 3.6)
    assert np.abs(np.maximum(linear.force[:, 0], 0.0) - expected).max() > 0.2 * WEIGHT


def test_a_smaller_tolerance_comes_nearer() -> None:
    profile = road(0.12)

    def force(tolerance: float) -> Array:
        run = pf.tire_forces(
            quarter_car(), profile, 72.0, dt=1e-2, lift_off=True, tolerance=tolerance
        )
        return run.force[:, 0]

    finest = force(1e-7)
    errors = [np.abs(force(tolerance) - finest).max() / WEIGHT for tolerance in (1e-2, 1e-4, 1e-6)]
    # Of the whole run: a step may add as much as the tolerance.
    assert errors[0] < 1e-2
    assert errors[1] < 1e-3
    assert errors[2] < 1e-4


def test_no_momentum_is_made_or_lost() -> None:
    """At rest before and after: the road's force less the weight has no impulse."""
    profile = road(0.12, length=200.0)
    found = pf.tire_forces(quarter_car(), profile, 72.0, dt=2e-4, lift_off=True)
    assert (found.force == 0.0).any()
    above = found.force[:, 0] - WEIGHT
    assert abs(float(above[-1])) < 1e-5 * WEIGHT
    impulse, whole = np.trapezoid(above, found.time), np.trapezoid(np.abs(above), found.time)
    assert abs(float(impulse)) < 1e-4 * float(whole)


def test_a_tire_that_stays_on_the_road_moves_as_before(truck: pf.Vehicle) -> None:
    profile = pf.Profile.iso8608("A", 150.0, seed=3)
    for interpolation in ("linear", "staircase"):
        runs = [
            pf.tire_forces(truck, profile, 80.0, interpolation=interpolation, lift_off=lift_off)
            for lift_off in (False, True)
        ]
        assert runs[0].force.min() > 0.0
        assert np.ptp(runs[0].force[:, 0]) > 0.3 * truck.static_loads[0]
        np.testing.assert_allclose(
            runs[1].force, runs[0].force, rtol=0, atol=1e-9 * truck.static_loads.max()
        )


def test_lift_off_counts_what_is_off() -> None:
    found = pf.tire_forces(quarter_car(), road(0.12), 72.0, lift_off=True)
    off = found.force[:, 0] == 0.0
    assert found.force.min() == 0.0
    [lift] = found.lift_off
    assert (lift.axle, lift.instants) == (1, int(off.sum()))
    assert lift.position == found.position[off.argmax(), 0]


# --- dry friction -----------------------------------------------------------------------------


@pytest.mark.parametrize("travel", [1e-3, 5e-3])
def test_friction_against_scipy(travel: float) -> None:
    friction = pf.Friction(force=0.1 * WEIGHT, travel=travel)
    profile, speed = road(0.03), 20.0
    found = pf.tire_forces(quarter_car(friction), profile, speed * 3.6)
    expected = by_scipy(profile, speed, found.time, friction)
    error = np.abs(found.force[:, 0] - expected)
    assert np.sqrt(np.mean(error**2)) < 1e-3 * WEIGHT
    assert error.max() < 1e-2 * WEIGHT
    plain = pf.tire_forces(quarter_car(), profile, speed * 3.6)
    assert np.abs(plain.force[:, 0] - expected).max() > 0.05 * WEIGHT


def test_friction_and_lift_off_together_against_scipy() -> None:
    friction = pf.Friction(force=0.1 * WEIGHT, travel=2e-3)
    profile, speed = road(0.12), 20.0
    found = pf.tire_forces(quarter_car(friction), profile, speed * 3.6, lift_off=True)
    expected = by_scipy(profile, speed, found.time, friction)
    assert (expected == 0.0).any()
    error = np.abs(found.force[:, 0] - expected)
    assert np.sqrt(np.mean(error**2)) < 1e-3 * WEIGHT


def test_hysteresis_loop_has_its_closed_form() -> None:
    """An axle that follows the road exactly, under a body that does not move.

    Over a triangle wave of amplitude a the stretch goes to and fro between -a and a, and once the
    loop is closed the friction at its ends is F_c tanh(a / travel), from
    F(u) = F_c + (F(-a) - F_c) exp(-(u + a) / travel).
    """
    force, travel, amplitude, stiffness = 6e3, 4e-3, 6e-3, 2e5
    anvil = pf.Vehicle(
        bodies=[pf.Body(name="anvil", mass=4e8, x=0.0), pf.Body(name="axle", mass=1.0, x=0.0)],
        springs=[
            pf.Spring(
                upper="anvil", lower="axle", x=0.0, stiffness=stiffness, damping=0.0,
                friction=pf.Friction(force=force, travel=travel),
            )
        ],
        tires=[pf.Tire(body="axle", x=0.0, stiffness=1e10, damping=1e6)],
    )  # fmt: skip
    x = np.arange(0.0, 60.5, 1.0)
    z = amplitude * np.array([0.0, 1.0, 0.0, -1.0])[np.arange(x.size) % 4]
    # The tolerance is a part of the anvil's weight.
    found = pf.tire_forces(anvil, pf.Profile(x, z), 3.6, dt=0.01, tolerance=1e-8)
    place, above = found.position[:, 0], found.force[:, 0] - anvil.static_loads[0]
    stretch = -np.interp(place, x, z)
    rubbing = -above - stiffness * stretch
    settled = (place > 40.0) & (place < 59.9) & (np.abs(place % 2.0 - 1.0) > 0.02)
    up = np.sign(np.gradient(stretch))
    expected = (
        up
        * force
        * (1.0 - (1.0 + np.tanh(amplitude / travel)) * np.exp(-(amplitude + up * stretch) / travel))
    )
    scale = np.abs(rubbing[settled] - expected[settled]).max() / force
    assert scale < 5e-3, scale


def test_little_friction_is_little_change() -> None:
    profile = road(0.03)
    plain = pf.tire_forces(quarter_car(), profile, 72.0).force
    changes = []
    for force in (100.0, 10.0, 1.0):
        rubbing = quarter_car(pf.Friction(force=force, travel=1e-3))
        changes.append(np.abs(pf.tire_forces(rubbing, profile, 72.0).force - plain).max())
    assert np.all(np.array(changes) < 3.0 * np.array([100.0, 10.0, 1.0]) + 1e-4 * WEIGHT)


# --- what is refused --------------------------------------------------------------------------


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 1e-12, 0.5, np.nan, np.inf])
def test_tolerances_that_are_refused(tolerance: float) -> None:
    with pytest.raises(ValueError, match="tolerance"):
        pf.tire_forces(quarter_car(), road(0.1), lift_off=True, tolerance=tolerance)


@pytest.mark.parametrize(
    "values", [{"force": 0.0}, {"force": -1.0}, {"travel": 0.0}, {"travel": np.nan}]
)
def test_frictions_that_are_refused(values: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(values))):
        pf.Friction(**{"force": 1e3, "travel": 1e-3} | values)


def test_friction_too_stiff_for_the_step_is_a_solver_error() -> None:
    hard = pf.Friction(force=1e6, travel=1e-12)
    with pytest.raises(pf.SolverError, match=r"do not settle .* at .* m in steps of .* s"):
        pf.tire_forces(quarter_car(hard), road(0.1), 72.0, dt=0.1)
