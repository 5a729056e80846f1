"""Vehicles and their tire forces: matrices by hand, forces against other integrators.

Goal: M, C, K of the paper's truck equal a hand-derived 6x6; tire forces agree with
scipy.signal.lsim and solve_ivp; a sine, a step and a ramp have closed forms; what a user can get
wrong is refused by name.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracle import Array, state_matrices
from scipy.integrate import solve_ivp
from scipy.signal import lsim

import pavefem as pf

G = 9.81


def quarter_car(**changes: Any) -> pf.Vehicle:
    """Build a sprung mass of 4500 kg over an axle of 500 kg."""
    values = {"ks": 4e5, "cs": 1.5e4, "kt": 2e6, "ct": 2e3} | changes
    return pf.Vehicle(
        name="quarter car",
        bodies=[
            pf.Body(name="sprung", mass=4500.0, x=0.0),
            pf.Body(name="axle", mass=500.0, x=0.0),
        ],
        springs=[
            pf.Spring(
                upper="sprung", lower="axle", x=0.0, stiffness=values["ks"], damping=values["cs"]
            )
        ],
        tires=[pf.Tire(body="axle", x=0.0, stiffness=values["kt"], damping=values["ct"])],
    )


def hand_truck() -> tuple[Array, Array, Array]:
    """Derive M, C, K of the tandem truck by Lagrange, unknowns (z_s, th_s, z_F, z_TF, z_TR, th_e).

    Heights of the springs' upper ends: z_s - c th_s at the front, and the beam's ends
    z_s + (p - c) th_s -+ (arms) th_e, with c the CG and p the pivot, m behind the front axle.
    """
    sprung = np.array([38_925.0, 76_335.0, 80_938.0]) - G * np.array([600.0, 1000.0, 1000.0])
    pivot = (4.55 * sprung[1] + 5.85 * sprung[2]) / (sprung[1] + sprung[2])
    cg = pivot * (sprung[1] + sprung[2]) / sprung.sum()
    ms, inertia = sprung.sum() / G, 8.0e4
    front, rear = pivot - 4.55, 5.85 - pivot
    mass = np.diag([ms, inertia, 600.0, 1000.0, 1000.0, 100.0])
    # Stretch of each spring in the unknowns, and of each tire.
    stretch = np.array(
        [
            [1.0, -cg, -1.0, 0.0, 0.0, 0.0],
            [1.0, pivot - cg, 0.0, -1.0, 0.0, -front],
            [1.0, pivot - cg, 0.0, 0.0, -1.0, rear],
        ]
    )
    stiffness = stretch.T @ np.diag([1e6, 2e6, 2e6]) @ stretch
    damping = stretch.T @ np.diag([1e4, 5e4, 5e4]) @ stretch
    stiffness[[2, 3, 4], [2, 3, 4]] += [1.75e6, 3.5e6, 3.5e6]
    damping[[2, 3, 4], [2, 3, 4]] += [1e4, 1e4, 1e4]
    return mass, damping, stiffness


# --- matrices ---------------------------------------------------------------------------------


def test_truck_matrices_by_hand(truck: pf.Vehicle) -> None:
    assert truck.unknowns == [
        "sprung mass bounce",
        "sprung mass pitch",
        "steer axle bounce",
        "leading tandem axle bounce",
        "trailing tandem axle bounce",
        "equalizing beam pitch",
    ]
    found = truck.mass_matrix, truck.damping_matrix, truck.stiffness_matrix
    for name, ours, expected in zip("MCK", found, hand_truck(), strict=True):
        np.testing.assert_allclose(
            ours, expected, rtol=1e-11, atol=1e-9 * np.abs(expected).max(), err_msg=name
        )


def test_matrices_of_any_spacing_and_payload_are_symmetric_and_definite() -> None:
    for spacing in (0.7, 1.3, 2.2):
        for payload in (-2000.0, 0.0, 20_000.0):
            truck = pf.vehicles.tandem_truck(axle_spacing=spacing, payload=payload)
            for matrix in (truck.mass_matrix, truck.stiffness_matrix):
                np.testing.assert_allclose(matrix, matrix.T, rtol=0, atol=1e-6)
                assert np.linalg.eigvalsh(matrix).min() > 0.0


def test_quarter_car_matrices() -> None:
    car = quarter_car()
    np.testing.assert_array_equal(car.mass_matrix, np.diag([4500.0, 500.0]))
    np.testing.assert_array_equal(car.stiffness_matrix, [[4e5, -4e5], [-4e5, 2.4e6]])
    np.testing.assert_array_equal(car.damping_matrix, [[1.5e4, -1.5e4], [-1.5e4, 1.7e4]])
    assert car.static_loads == pytest.approx([5000.0 * G])
    assert car.total_mass == 5000.0
    assert car.length == 0.0


def test_returned_matrices_are_the_callers_own(truck: pf.Vehicle) -> None:
    truck.mass_matrix[:] = 0.0
    truck.static_loads[:] = 0.0
    truck.natural_frequencies()[:] = 0.0
    assert truck.mass_matrix.any()
    assert truck.static_loads.all()
    assert truck.natural_frequencies().all()


# --- static loads -----------------------------------------------------------------------------


@pytest.mark.parametrize("spacing", [0.6, 1.3, 1.6, 2.2])
def test_spacing_keeps_tandem_centre_and_static_loads(spacing: float) -> None:
    truck = pf.vehicles.tandem_truck(axle_spacing=spacing)
    np.testing.assert_allclose(truck.static_loads, [38_925.0, 76_335.0, 80_938.0], rtol=1e-10)
    assert truck.axle_positions[1:].mean() == pytest.approx(5.2, rel=1e-14)
    assert np.diff(truck.axle_positions)[1] == pytest.approx(spacing, rel=1e-12)


@pytest.mark.parametrize("payload", [0.0, 5000.0, 20_000.0])
def test_payload_keeps_the_geometry(payload: float) -> None:
    nominal, truck = pf.vehicles.tandem_truck(), pf.vehicles.tandem_truck(payload=payload)
    assert [body.x for body in truck.bodies] == [body.x for body in nominal.bodies]
    assert truck.total_mass - nominal.total_mass == pytest.approx(payload - 12_400.0)
    assert truck.static_loads.sum() == pytest.approx(G * truck.total_mass, rel=1e-12)
    # The sprung load is shared as before, because the centre of gravity stays.
    unsprung = G * np.array([600.0, 1000.0, 1000.0])
    shares = [
        (v.static_loads - unsprung) / (v.static_loads - unsprung).sum() for v in (nominal, truck)
    ]
    np.testing.assert_allclose(shares[1], shares[0], rtol=1e-10)


@given(
    st.floats(1e3, 3e4),
    st.floats(2.0, 8.0),
    st.floats(0.1, 0.9),
    st.floats(1e5, 5e6),
    st.floats(1e5, 5e6),
)
def test_two_axles_share_by_the_lever(
    mass: float, base: float, fraction: float, front: float, rear: float
) -> None:
    """Statics: the loads do not depend on the springs, and balance weight and moment."""
    car = pf.Vehicle(
        bodies=[pf.Body(name="body", mass=mass, x=fraction * base, pitch_inertia=mass)],
        tires=[
            pf.Tire(body="body", x=0.0, stiffness=front, damping=0.0),
            pf.Tire(body="body", x=base, stiffness=rear, damping=0.0),
        ],
    )
    expected = mass * G * np.array([1.0 - fraction, fraction])
    np.testing.assert_allclose(car.static_loads, expected, rtol=1e-9)


def test_pinned_beam_shares_by_its_arms() -> None:
    """A walking beam gives both axles the same sprung load when its arms are equal."""
    truck = pf.Vehicle(
        bodies=[
            pf.Body(name="frame", mass=10_000.0, x=2.0, pitch_inertia=2e4),
            pf.Body(name="beam", mass=200.0, x=4.0, pitch_inertia=50.0, pinned_to="frame", pin=4.0),
        ],
        tires=[
            pf.Tire(body="frame", x=0.0, stiffness=1e6, damping=0.0),
            pf.Tire(body="beam", x=3.4, stiffness=2e6, damping=0.0),
            pf.Tire(body="beam", x=4.6, stiffness=9e5, damping=0.0),
        ],
    )
    half = 10_000.0 * G / 2
    np.testing.assert_allclose(
        truck.static_loads, [half, (half + 200 * G) / 2, (half + 200 * G) / 2], rtol=1e-12
    )


# --- tire forces ------------------------------------------------------------------------------


def road_under(profile: pf.Profile, places: Array, speed: float) -> tuple[Array, Array]:
    """Elevation above the first sample, and its rate, under points at `places`."""
    elevation = profile.elevation(places) - profile.z[0]
    segment = np.searchsorted(profile.x, places, side="right") - 1
    slopes = np.concatenate([np.diff(profile.z) / np.diff(profile.x), [0.0]])
    inside = (places >= profile.x[0]) & (segment < profile.x.size - 1)
    return elevation, np.where(inside, slopes[np.maximum(segment, 0)], 0.0) * speed


def test_tire_forces_against_lsim(truck: pf.Vehicle) -> None:
    """scipy.signal.lsim, which takes its input as linear in time, on a profile of few kinks.

    The stations are whole steps apart for every axle, so that lsim's input is exact. At the very
    instant of a kink the slope under a tire is either of two: those instants are left out.
    """
    dt, speed = 1e-3, 20.0
    truck = pf.vehicles.tandem_truck(axle_spacing=1.2, wheelbase=5.0)
    rng = np.random.default_rng(2)
    x = np.arange(0.0, 40.0, 0.4)
    profile = pf.Profile(x, 0.004 * rng.normal(size=x.size).cumsum() / 3)
    forces = pf.tire_forces(truck, profile, speed * 3.6, dt=dt)
    mass, damping, stiffness = hand_matrices(truck)
    a, _ = state_matrices(mass, damping, stiffness)
    kt, ct = np.array([1.75e6, 3.5e6, 3.5e6]), np.array([1e4, 1e4, 1e4])
    select = np.zeros((6, 3))
    select[[2, 3, 4], [0, 1, 2]] = 1.0
    # The damper's part of the input is the derivative of the elevation: shift it into the state,
    # so that the whole input is the elevation, which is continuous and linear in each step:
    # with v = v' + M^-1 S ct z, both halves of the state equation see z alone.
    inverse = np.linalg.inv(mass)
    shift = inverse @ select @ np.diag(ct)
    inputs = np.vstack([shift, inverse @ select @ np.diag(kt) - inverse @ damping @ shift])
    elevation, rate = road_under(profile, forces.position, speed)
    system = a, inputs, np.eye(12), np.zeros((12, 3))
    _, states, _ = lsim(system, elevation, forces.time)
    u = states[:, :6]
    v = states[:, 6:] + elevation @ shift.T
    expected = truck.static_loads + kt * (elevation - u @ select) + ct * (rate - v @ select)
    kink = np.abs(forces.position / 0.4 - np.round(forces.position / 0.4)) < 1e-6
    assert 0.5 < (~kink).mean() < 1.0
    np.testing.assert_allclose(
        forces.force[~kink], expected[~kink], rtol=0, atol=1e-7 * np.ptp(expected)
    )


def hand_matrices(truck: pf.Vehicle) -> tuple[Array, Array, Array]:
    return truck.mass_matrix, truck.damping_matrix, truck.stiffness_matrix


def test_tire_forces_against_solve_ivp() -> None:
    """A quarter car over a smooth bump, sampled finely, by an adaptive Runge-Kutta method."""
    car, speed = quarter_car(), 15.0

    def bump(x: Array | float) -> Any:
        return np.where((x > 3.0) & (x < 6.0), 0.005 * (1 - np.cos(2 * np.pi * (x - 3) / 3)), 0.0)

    def slope(x: Array | float) -> Any:
        inside = (x > 3.0) & (x < 6.0)
        return np.where(inside, 0.005 * 2 * np.pi / 3 * np.sin(2 * np.pi * (x - 3) / 3), 0.0)

    x = np.arange(0.0, 15.0001, 0.0025)
    found = pf.tire_forces(car, pf.Profile(x, bump(x)), speed * 3.6)

    def rate(t: float, y: Array) -> list[float]:
        us, ua, vs, va = y
        spring = 4e5 * (us - ua) + 1.5e4 * (vs - va)
        tire = 2e6 * (bump(speed * t) - ua) + 2e3 * (slope(speed * t) * speed - va)
        return [vs, va, -spring / 4500, (spring + tire) / 500]

    solved = solve_ivp(
        rate, (0.0, found.time[-1]), np.zeros(4), "DOP853", found.time, rtol=1e-10, atol=1e-12,
        max_step=2e-3,
    )  # fmt: skip
    place = speed * found.time
    expected = (
        5000 * G + 2e6 * (bump(place) - solved.y[1]) + 2e3 * (slope(place) * speed - solved.y[3])
    )
    swing = np.ptp(expected)
    assert swing > 2e3
    # A profile of straight lines has its slope off by half a sample: the damper's share of that.
    np.testing.assert_allclose(found.force[:, 0], expected, rtol=0, atol=2e-3 * swing)


@pytest.mark.parametrize("wavelength", [2.0, 6.0, 15.0])
def test_sine_profile_closed_form(wavelength: float) -> None:
    """Steady state over z = A sin(2 pi x / L): the complex gain of the quarter car."""
    car, speed, amplitude = quarter_car(), 20.0, 0.003
    x = np.arange(0.0, 220.0, 0.01)
    profile = pf.Profile(x, amplitude * np.sin(2 * np.pi * x / wavelength))
    found = pf.tire_forces(car, profile, speed * 3.6, run_in=150.0)
    w = 2 * np.pi * speed / wavelength
    mass, damping, stiffness = hand_matrices(car)
    tire = 2e6 + 1j * w * 2e3
    motion = np.linalg.solve(-(w**2) * mass + 1j * w * damping + stiffness, [0.0, tire])
    gain = tire * (1.0 - motion[1]) * amplitude
    expected = 5000 * G + (gain * np.exp(1j * w * (150.0 / speed + found.time))).imag
    np.testing.assert_allclose(found.force[:, 0], expected, rtol=0, atol=2e-3 * abs(gain))


def test_lateral_wavelength_of_two_axles() -> None:
    """A rigid bar on two equal tires over a sine of its wheelbase only bounces: equal forces."""
    car = pf.Vehicle(
        bodies=[pf.Body(name="bar", mass=2000.0, x=2.0, pitch_inertia=3000.0)],
        tires=[
            pf.Tire(body="bar", x=0.0, stiffness=1e6, damping=1e4),
            pf.Tire(body="bar", x=4.0, stiffness=1e6, damping=1e4),
        ],
    )
    x = np.arange(-10.0, 200.0, 0.02)
    z = 0.002 * np.sin(2 * np.pi * x / 4.0)
    found = pf.tire_forces(car, pf.Profile(x, z), 72.0, run_in=150.0)
    np.testing.assert_allclose(found.force[:-1, 0], found.force[:-1, 1], rtol=1e-6)
    assert np.ptp(found.force[:, 0]) > 1e3


def test_step_and_new_level() -> None:
    """Up a ramp onto a higher level: at last the static load again."""
    car = quarter_car()
    profile = pf.Profile([0.0, 5.0, 5.5, 300.0], [0.0, 0.0, 0.05, 0.05])
    found = pf.tire_forces(car, profile, 72.0)
    before = found.position[:, 0] < 5.0 - 1e-9
    np.testing.assert_allclose(found.force[before], 5000 * G, rtol=1e-12)
    assert np.ptp(found.force) > 1e4
    assert found.force[-1, 0] == pytest.approx(5000 * G, rel=1e-6)


def test_staircase_has_jumps_and_no_slope() -> None:
    """A step of 2 cm met by a rigidly held axle: k h at once, and nothing from the damper."""
    heavy = pf.Vehicle(
        bodies=[pf.Body(name="anvil", mass=1e9, x=0.0)],
        tires=[pf.Tire(body="anvil", x=0.0, stiffness=1e6, damping=5e4)],
    )
    profile = pf.Profile([0.0, 1.0, 2.0, 4.0], [0.0, 0.0, 0.02, 0.02])
    stairs = pf.tire_forces(heavy, profile, 36.0, interpolation="staircase")
    extra = stairs.force[:, 0] - heavy.static_loads[0]
    place = stairs.position[:, 0]
    np.testing.assert_allclose(extra[place < 2.0 - 1e-9], 0.0, atol=1e-2)
    np.testing.assert_allclose(extra[place > 2.0 + 1e-9], 1e6 * 0.02, rtol=1e-3)
    line = pf.tire_forces(heavy, profile, 36.0)
    halfway = (line.position[:, 0] > 1.0 + 1e-9) & (line.position[:, 0] < 2.0 - 1e-9)
    rise = line.position[halfway, 0] - 1.0
    np.testing.assert_allclose(
        line.force[halfway, 0] - heavy.static_loads[0],
        1e6 * 0.02 * rise + 5e4 * 0.02 * 10.0,
        rtol=0,
        atol=50.0,
    )


def test_fine_stairs_without_tire_damping_are_straight_lines() -> None:
    car = quarter_car(ct=0.0)
    x = np.arange(0.0, 30.0, 0.5)
    coarse = pf.Profile(x, 0.01 * np.sin(x))
    fine = coarse.resample(0.001)
    stairs = pf.tire_forces(car, fine, 72.0, interpolation="staircase")
    lines = pf.tire_forces(car, coarse, 72.0, distance=stairs.position[-1, 0])
    n = min(stairs.time.size, lines.time.size)
    np.testing.assert_allclose(stairs.force[:n], lines.force[:n], rtol=0, atol=25.0)
    assert np.ptp(lines.force) > 3e3


def test_run_in_is_the_same_run_with_its_head_cut_off(truck: pf.Vehicle, rough: pf.Profile) -> None:
    whole = pf.tire_forces(truck, rough, 72.0)  # 0.02 m a step
    settled = pf.tire_forces(truck, rough, 72.0, run_in=30.0)
    assert settled.time[0] == 0.0
    assert settled.position[0, 0] == pytest.approx(30.0)
    skip = 1500
    np.testing.assert_allclose(settled.position, whole.position[skip:], rtol=0, atol=1e-9)
    np.testing.assert_allclose(settled.force, whole.force[skip:], rtol=0, atol=1e-3)


def test_starts_and_ends_where_it_should(truck: pf.Vehicle, rough: pf.Profile) -> None:
    found = pf.tire_forces(truck, rough, 65.0)
    np.testing.assert_allclose(found.position[0], [0.0, -4.55, -5.85], rtol=1e-14)
    np.testing.assert_allclose(found.force[0], truck.static_loads, rtol=0.2)
    reach = 65.0 / 3.6 * 1e-3
    assert rough.x[-1] - reach < found.position[-1, 0] <= rough.x[-1] + 1e-9
    partial = pf.tire_forces(truck, rough, 65.0, distance=20.0)
    assert 20.0 - reach < partial.position[-1, 0] <= 20.0
    np.testing.assert_array_equal(partial.force, found.force[: partial.time.size])


def test_stations_need_not_start_at_zero(truck: pf.Vehicle, rough: pf.Profile) -> None:
    # At this speed no axle is at a station at the very instant of a step.
    speed_kmh = 64.321
    moved = pf.Profile(rough.x + 1234.5, rough.z)
    here, there = (pf.tire_forces(truck, profile, speed_kmh) for profile in (rough, moved))
    n = min(here.time.size, there.time.size)
    np.testing.assert_allclose(there.force[1:n], here.force[1:n], rtol=0, atol=1e-2)
    assert there.position[0, 0] == 1234.5


@given(st.floats(-500.0, 500.0))
def test_level_offset_changes_nothing(offset: float) -> None:
    car = quarter_car()
    x = np.linspace(0.0, 20.0, 81)
    z = 0.003 * np.sin(2.0 * x)
    plain = pf.tire_forces(car, pf.Profile(x, z), 60.0)
    lifted = pf.tire_forces(car, pf.Profile(x, z + offset), 60.0)
    # Adding the offset rounds the elevations by up to 1e-13 m; the tire has 2e6 N/m.
    np.testing.assert_allclose(lifted.force, plain.force, rtol=0, atol=1e-4)


@given(st.floats(-3.0, 3.0))
def test_forces_are_linear_in_the_profile(factor: float) -> None:
    car = quarter_car()
    x = np.linspace(0.0, 20.0, 81)
    z = 0.003 * np.sin(2.0 * x)
    one = pf.tire_forces(car, pf.Profile(x, z), 60.0).force - 5000 * G
    other = pf.tire_forces(car, pf.Profile(x, factor * z), 60.0).force - 5000 * G
    np.testing.assert_allclose(other, factor * one, rtol=0, atol=1e-6)


def test_level_road_is_the_smooth_road(truck: pf.Vehicle) -> None:
    level = pf.tire_forces(truck, pf.Profile.smooth(50.0), 65.0)
    smooth = pf.tire_forces(truck, None, 65.0, distance=50.0)
    np.testing.assert_allclose(level.force, smooth.force, rtol=1e-12)
    np.testing.assert_array_equal(level.time, smooth.time)
    np.testing.assert_allclose(level.position, smooth.position, rtol=0, atol=1e-12)


def test_time_step_of_the_forces_is_second_order(truck: pf.Vehicle) -> None:
    x = np.arange(0.0, 40.0, 0.01)
    profile = pf.Profile(x, 0.004 * np.sin(2 * np.pi * x / 3.0) ** 2)
    # 0.08, 0.04, 0.02 m a step at 72 km/h, against one of 0.0025 m.
    runs = {n: pf.tire_forces(truck, profile, 72.0, dt=1e-3 / 8 * n).force for n in (1, 8, 16, 32)}
    errors = []
    for n in (32, 16, 8):
        same = min(runs[n].shape[0], (runs[1].shape[0] - 1) // n + 1)
        errors.append(np.abs(runs[n][:same] - runs[1][::n][:same]).max())
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (rates > 1.6).all(), (errors, rates)


# --- lift-off ---------------------------------------------------------------------------------


def test_lift_off_is_reported_with_count_and_place() -> None:
    """A pothole of 20 cm: the linear tire pulls; instants and first place are the force's own."""
    car = quarter_car()
    x = np.linspace(0.0, 40.0, 401)
    z = np.where((x > 10.0) & (x < 12.0), -0.20, 0.0)
    found = pf.tire_forces(car, pf.Profile(x, z), 72.0)
    below = found.force[:, 0] < 0.0
    assert below.any()
    assert len(found.lift_off) == 1
    lift = found.lift_off[0]
    assert (lift.axle, lift.instants) == (1, int(below.sum()))
    assert lift.position == found.position[below.argmax(), 0]
    assert 10.0 <= lift.position <= 12.5


def test_only_the_axle_that_lifts_is_reported(truck: pf.Vehicle) -> None:
    found = pf.tire_forces(truck, pf.Profile.iso8608("H", 60.0, seed=1), 90.0)
    lifted = {lift.axle: lift for lift in found.lift_off}
    for axle in (1, 2, 3):
        below = found.force[:, axle - 1] < 0.0
        assert (axle in lifted) == below.any()
        if axle in lifted:
            assert lifted[axle].instants == below.sum()
    assert lifted


def test_no_lift_off_on_a_good_road(truck: pf.Vehicle) -> None:
    assert pf.tire_forces(truck, pf.Profile.iso8608("A", 60.0), 65.0).lift_off == ()


def test_forces_dataset_has_units(truck: pf.Vehicle, rough: pf.Profile) -> None:
    dataset = pf.tire_forces(truck, rough, 65.0, distance=10.0).dataset
    assert dataset["tire_force"].dims == ("time", "axle")
    assert dataset["tire_force"].attrs["units"] == "N"
    assert dataset["axle_position"].attrs["units"] == "m"
    assert dataset["static_load"].attrs["units"] == "N"
    assert dataset["time"].attrs["units"] == "s"
    np.testing.assert_array_equal(dataset["axle"], [1, 2, 3])


# --- what is refused --------------------------------------------------------------------------


def mass_on_tire(**changes: Any) -> pf.Vehicle:
    fields: dict[str, Any] = {
        "bodies": [pf.Body(name="mass", mass=1000.0, x=0.0)],
        "tires": [pf.Tire(body="mass", x=0.0, stiffness=1e6, damping=0.0)],
    }
    return pf.Vehicle(**fields | changes)


@pytest.mark.parametrize(
    ("changes", "fragment"),
    [
        (
            {"tires": [pf.Tire(body="ghost", x=0.0, stiffness=1e6, damping=0.0)]},
            "body of tire 0 names no body: 'ghost' is none of ['mass']",
        ),
        (
            {"springs": [pf.Spring(upper="roof", lower="mass", x=0.0, stiffness=1e5, damping=0.0)]},
            "upper end of spring 0 names no body: 'roof'",
        ),
        (
            {"springs": [pf.Spring(upper="mass", lower="road", x=0.0, stiffness=1e5, damping=0.0)]},
            "lower end of spring 0 names no body: 'road'",
        ),
        (
            {
                "bodies": [
                    pf.Body(name="mass", mass=1.0, x=0.0),
                    pf.Body(name="b", mass=1.0, x=0.0, pitch_inertia=1.0, pinned_to="c", pin=0.0),
                ]
            },
            "pinned_to of body 'b' names no body: 'c'",
        ),
        (
            {
                "bodies": [
                    pf.Body(
                        name="b", mass=1.0, x=0.0, pitch_inertia=1.0, pinned_to="mass", pin=0.0
                    ),
                    pf.Body(name="mass", mass=1.0, x=0.0),
                ]
            },
            "earlier body",
        ),
        ({"bodies": [pf.Body(name="mass", mass=1.0, x=0.0)] * 2}, "two bodies share a name"),
        ({"bodies": []}, "bodies"),
        ({"tires": []}, "tires"),
        (
            {"tires": [pf.Tire(body="mass", x=x, stiffness=1e6, damping=0.0) for x in (1.0, 0.0)]},
            "each must be behind the one before it",
        ),
        (
            {"tires": [pf.Tire(body="mass", x=0.0, stiffness=1e6, damping=0.0)] * 2},
            "each must be behind the one before it",
        ),
        ({"colour": "red"}, "colour"),
    ],
)
def test_vehicles_that_are_refused(changes: dict[str, Any], fragment: str) -> None:
    with pytest.raises(ValueError, match=re.escape(fragment)):
        mass_on_tire(**changes)


def test_unsupported_body_is_a_solver_error() -> None:
    with pytest.raises(pf.SolverError, match="not held up"):
        mass_on_tire(
            bodies=[
                pf.Body(name="mass", mass=1000.0, x=0.0),
                pf.Body(name="loose", mass=5.0, x=0.0),
            ]
        )


def test_body_that_would_tip_over_is_a_solver_error() -> None:
    with pytest.raises(pf.SolverError, match="not held up"):
        mass_on_tire(bodies=[pf.Body(name="mass", mass=1000.0, x=0.0, pitch_inertia=10.0)])


def test_tire_that_would_pull_at_rest_is_refused() -> None:
    with pytest.raises(ValueError, match=r"tire 1: static load = -"):
        pf.Vehicle(
            bodies=[pf.Body(name="body", mass=1000.0, x=-1.0, pitch_inertia=500.0)],
            tires=[
                pf.Tire(body="body", x=0.0, stiffness=1e6, damping=0.0),
                pf.Tire(body="body", x=3.0, stiffness=1e6, damping=0.0),
            ],
        )


@pytest.mark.parametrize("changes", [{"pin": 1.0}, {"pinned_to": "mass"}])
def test_half_a_pin_is_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="pinned_to and pin go together"):
        pf.Body(name="beam", mass=1.0, x=0.0, pitch_inertia=1.0, **changes)


def test_vehicles_are_values() -> None:
    assert pf.vehicles.tandem_truck() == pf.vehicles.tandem_truck()
    assert pf.vehicles.tandem_truck() != pf.vehicles.tandem_truck(payload=1.0)
    assert pf.Vehicle.model_validate_json(pf.vehicles.tandem_truck().model_dump_json()) == (
        pf.vehicles.tandem_truck()
    )
