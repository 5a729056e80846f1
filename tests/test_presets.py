"""Ready-made vehicles, and those from measured axles: modes, loads, and forces by scipy.

Goal: what the docstrings say of modes and static loads is so; body modes lie in 1-3.5 Hz and hop in
7-16 Hz; air suspensions are as Directive 96/53/EC wants them; tire forces over a random road are
those of scipy from matrices assembled another way; a vehicle from measured axles has their loads.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import oracle
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracle import Array
from scipy.linalg import eig

import pavefem as pf
from pavefem import vehicles

G = 9.81
T = 1e3 * G
"""Weight of a tonne, N."""

SPRUNG = {name: make for name, make in vehicles.PRESETS.items() if name != "tandem_truck"}
"""Presets that come on steel or air."""
EACH = [(name, kind) for name in SPRUNG for kind in ("steel", "air")]
LOADED = [*EACH, ("tandem_truck", None)]


def preset(name: str, kind: str | None = None, **options: Any) -> pf.Vehicle:
    suspension = {} if kind is None else {"suspension": kind}
    return vehicles.named(name, **suspension, **options)


def modes(vehicle: pf.Vehicle) -> dict[str, Array]:
    """Frequency and damping of the modes that axles, walking beams, and other bodies lead."""
    found = vehicle.modes()
    movers = found["mover"].to_numpy()
    axles = {f"{tire.body} bounce" for tire in vehicle.tires}
    kinds = np.array(["hop" if m in axles else "beam" if "beam" in m else "body" for m in movers])
    pairs = np.column_stack([found["frequency"], found["damping_ratio"]])
    return {kind: pairs[kinds == kind] for kind in ("body", "hop", "beam")}


def words(text: str | None) -> str:
    return " ".join((text or "").split())


# --- modes and static loads -------------------------------------------------------------------


@pytest.mark.parametrize(("name", "kind"), LOADED)
def test_modes_of_loaded_vehicles(name: str, kind: str | None) -> None:
    found = modes(preset(name, kind))
    assert found["body"].shape[0] >= 1
    assert found["hop"].shape[0] >= 1
    for what, (low, high) in {"body": (1.0, 3.5), "hop": (7.0, 16.0)}.items():
        frequency, damping = found[what].T
        assert (frequency > low).all()
        assert (frequency < high).all()
        assert (damping > 0.0).all()
        assert (damping < 1.0).all()
    assert (found["beam"].size > 0) == any(
        "beam" in body.name for body in preset(name, kind).bodies
    )


@pytest.mark.parametrize(("name", "kind"), EACH)
def test_docstrings_tell_modes_and_loads(name: str, kind: str) -> None:
    vehicle = preset(name, kind)
    found = modes(vehicle)
    cells = [
        f"{column.min():.2f} - {column.max():.2f}"
        for what in ("body", "hop")
        for column in found[what].T
    ]
    doc = words(SPRUNG[name].__doc__)
    assert f"{kind} {' '.join(cells)}" in doc
    loads = ", ".join(f"{load / 1e3:.1f}" for load in vehicle.static_loads)
    assert f"static loads {loads} kN" in doc


@pytest.mark.parametrize(("name", "kind"), LOADED)
def test_static_loads_carry_the_weight(name: str, kind: str | None) -> None:
    vehicle = preset(name, kind)
    assert vehicle.static_loads.sum() == pytest.approx(G * vehicle.total_mass, rel=1e-12)
    assert vehicle.static_loads.sum() == pytest.approx(
        G * sum(body.mass for body in vehicle.bodies), rel=1e-12
    )


@pytest.mark.parametrize("kind", ["steel", "air"])
@pytest.mark.parametrize(
    ("name", "limits", "gross"),
    [
        ("rigid_truck", [10.0 * T, 11.5 * T], 18.0 * T),
        ("semitrailer", [20e3 * 4.4482, *[17e3 * 4.4482] * 4], 80e3 * 4.4482),
        ("tridem_semitrailer", [10.0 * T, *[9.0 * T] * 2, *[8.0 * T] * 3], 44.0 * T),
        ("b_double", [6.0 * T, *[8.25 * T] * 2, *[20.0 / 3 * T] * 6], 62.5 * T),
    ],
)
def test_loads_come_near_legal_limits(
    name: str, kind: str, limits: list[float], gross: float
) -> None:
    """Directive 96/53/EC, Annex I; 23 U.S.C. 127; general mass limits of the Australian law."""
    loads = preset(name, kind).static_loads
    assert (loads <= np.array(limits)).all()
    assert 0.98 * gross < loads.sum() < gross * (1.0 + 1e-9)


@pytest.mark.parametrize("name", SPRUNG)
def test_air_suspension_as_the_directive_defines_it(name: str) -> None:
    """Directive 96/53/EC, Annex II: over a driving axle at most 2.0 Hz, and over 20 % damped.

    For the sprung mass over one axle, its springs and dampers, its own mass and its tires: the slow
    root of their characteristic polynomial.
    """
    vehicle = preset(name, "air")
    bodies = {body.name: body for body in vehicle.bodies}
    driving = {"quarter_car": [0], "rigid_truck": [1]}.get(name, [1, 2])
    for axle in driving:
        tire = vehicle.tires[axle]
        unsprung = bodies[tire.body].mass
        load = vehicle.static_loads[axle] / G - unsprung
        springs = [s for s in vehicle.springs if tire.body in dict(s.lower_ends)]
        stiffness = sum(s.stiffness / len(s.lower_ends) for s in springs)
        damping = sum(s.damping / len(s.lower_ends) for s in springs)
        above = [load, damping, stiffness]
        below = [unsprung, damping + tire.damping, stiffness + tire.stiffness]
        both = [damping, stiffness]
        roots = np.roots(np.polysub(np.polymul(above, below), np.polymul(both, both)))
        slow = roots[np.abs(roots).argmin()]
        assert abs(slow.imag) / (2.0 * np.pi) < 2.0
        assert -slow.real / abs(slow) > 0.20


def test_steel_is_no_such_suspension() -> None:
    assert (modes(preset("rigid_truck", "steel"))["body"][:, 1] < 0.2).all()


@pytest.mark.parametrize("name", [name for name in SPRUNG if name != "quarter_car"])
def test_air_keeps_its_frequency_without_payload(name: str) -> None:
    frequency, damping = modes(preset(name, "air", payload=0.0))["body"].T
    assert (frequency > 1.0).all()
    assert (frequency < 2.3).all()
    assert (damping > 0.2).all()
    assert (damping < 0.5).all()


@pytest.mark.parametrize("name", SPRUNG)
def test_dry_friction_is_a_part_of_the_sprung_load(name: str) -> None:
    vehicle = preset(name, "steel", dry_friction=0.1)
    masses = {body.name: body.mass for body in vehicle.bodies}
    for tire, load in zip(vehicle.tires, vehicle.static_loads, strict=True):
        [spring] = [s for s in vehicle.springs if tire.body in dict(s.lower_ends)]
        assert spring.friction is not None
        assert spring.friction.force == pytest.approx(0.1 * (load - G * masses[tire.body]))
        assert spring.damping == 1e4
    np.testing.assert_allclose(vehicle.static_loads, preset(name, "steel").static_loads, rtol=1e-12)


# --- against scipy ----------------------------------------------------------------------------


def forces_by_scipy(vehicle: pf.Vehicle, profile: pf.Profile, speed: float) -> tuple[Array, Array]:
    """Tire forces of ours and of scipy."""
    ours = pf.tire_forces(vehicle, profile, speed * 3.6)
    lengths = np.array([tire.print_length for tire in vehicle.tires])
    elevation, rate = oracle.road_under(profile, ours.position, lengths, speed)
    return ours.force, oracle.tire_forces(vehicle, elevation, rate, ours.time)


@pytest.mark.parametrize(("name", "kind"), LOADED)
def test_tire_forces_against_scipy(name: str, kind: str | None) -> None:
    """A random road at a speed that brings no axle to a sample at the instant of a step."""
    profile = pf.Profile.iso8608("C", length=70.0, spacing=0.25, seed=11)
    ours, expected = forces_by_scipy(preset(name, kind), profile, 19.317)
    assert np.ptp(ours, axis=0).min() > 2e4
    np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-10 * np.ptp(expected))


@pytest.mark.parametrize(("name", "kind"), [("rigid_truck", "steel"), ("semitrailer", "air")])
def test_tire_forces_with_prints_against_scipy(name: str, kind: str) -> None:
    profile = pf.Profile.iso8608("C", length=70.0, spacing=0.1, seed=12)
    printed = preset(name, kind, print_length=0.23)
    assert {tire.print_length for tire in printed.tires} == {0.23}
    ours, expected = forces_by_scipy(printed, profile, 19.317)
    np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-10 * np.ptp(expected))
    points = pf.tire_forces(preset(name, kind), profile, 19.317 * 3.6).force
    assert np.abs(points - ours).max() > 0.02 * np.ptp(ours)


@pytest.mark.parametrize(("name", "kind"), LOADED)
def test_matrices_and_loads_by_constraints(name: str, kind: str | None) -> None:
    vehicle = preset(name, kind)
    mass, damping, stiffness, _, loads = oracle.vehicle_matrices(vehicle)
    for ours, expected in (
        (vehicle.mass_matrix, mass),
        (vehicle.damping_matrix, damping),
        (vehicle.stiffness_matrix, stiffness),
    ):
        np.testing.assert_allclose(ours, expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max())
    np.testing.assert_allclose(vehicle.static_loads, loads, rtol=1e-10)


# --- the quarter car in closed form -----------------------------------------------------------


def quarter_car_gain(vehicle: pf.Vehicle, frequency: float) -> complex:
    """Tire force over the elevation of the road, N/m, from the two equations of motion."""
    [spring], [tire] = vehicle.springs, vehicle.tires
    sprung, axle = (body.mass for body in vehicle.bodies)
    w = 2.0 * np.pi * frequency
    ks, kt = spring.stiffness + 1j * w * spring.damping, tire.stiffness + 1j * w * tire.damping
    # -w² m_s z_s = -k_s (z_s - z_u) gives z_s; what the axle feels of it is a mass
    carried = sprung * ks / (ks - w**2 * sprung)
    # -w² (m_u + carried) z_u = k_t (z - z_u)
    follows = kt / (kt - w**2 * (axle + carried))
    return complex(kt * (1.0 - follows))


@pytest.mark.parametrize("kind", ["steel", "air"])
@pytest.mark.parametrize("frequency", [0.5, 1.0, 1.4, 1.9, 3.0, 5.0, 8.0, 9.7, 11.2, 15.0, 20.0])
def test_gain_and_phase_of_the_quarter_car(kind: str, frequency: float) -> None:
    """Over a sine wave at 72 km/h, ten periods after the start has died away."""
    vehicle, speed, amplitude, dt = preset("quarter_car", kind), 20.0, 2e-3, 2e-4
    w, run_in = 2.0 * np.pi * frequency, 300.0
    spacing = min(0.02, speed / frequency / 400.0)
    x = np.arange(0.0, run_in + 10.0 * speed / frequency + 1.0, spacing)
    profile = pf.Profile(x, amplitude * np.sin(w * x / speed))
    found = pf.tire_forces(
        vehicle, profile, speed * 3.6, dt=dt, run_in=run_in, distance=10.0 * speed / frequency
    )
    angle = w * found.position[:, 0] / speed
    waves = np.column_stack([np.sin(angle), np.cos(angle), np.ones_like(angle)])
    (sine, cosine, mean), *_ = np.linalg.lstsq(waves, found.force[:, 0], rcond=None)
    ours, expected = (sine + 1j * cosine) / amplitude, quarter_car_gain(vehicle, frequency)
    assert mean == pytest.approx(10.0 * T, rel=1e-4)
    assert abs(ours) == pytest.approx(abs(expected), rel=5e-4)
    assert np.angle(ours / expected) == pytest.approx(0.0, abs=5e-4)


def test_gain_of_the_quarter_car_has_its_two_peaks() -> None:
    """What the sweep above compares with is not flat: resonances of the body and of the axle."""
    vehicle = preset("quarter_car", "steel")
    frequencies = np.linspace(0.2, 25.0, 2000)
    gain = np.array([abs(quarter_car_gain(vehicle, f)) for f in frequencies])
    peaks = frequencies[1:-1][(gain[1:-1] > gain[:-2]) & (gain[1:-1] > gain[2:])]
    assert peaks == pytest.approx(vehicle.modes()["frequency"].to_numpy(), rel=0.2)


# --- a 2-axle vehicle by hand -----------------------------------------------------------------


def rigid_truck_by_hand() -> tuple[Array, Array, Array, Array]:
    """M, C, K and static loads of the 2-axle truck on steel by Lagrange, from its docstring.

    Unknowns are the bounce z and the pitch th (tail up) of the body about its centre of gravity, a
    behind the front axle and b ahead of the rear one, and the heights of the axles:

    T = 1/2 M z'^2 + 1/2 J th'^2 + 1/2 m1 z1'^2 + 1/2 m2 z2'^2
    V = 1/2 k1 (z - a th - z1)^2 + 1/2 k2 (z + b th - z2)^2 + 1/2 kt1 z1^2 + 1/2 kt2 z2^2
    """
    M = 5200.0 + 11_000.0
    a = (5200.0 * 1.5 + 11_000.0 * (0.9 + 6.9) / 2) / M
    b = 5.0 - a
    J = 5200.0 * (1.8**2 + (a - 1.5) ** 2) + 11_000.0 * (6.0**2 / 12 + (3.9 - a) ** 2)

    def matrix(k1: float, k2: float, kt1: float, kt2: float) -> Array:
        return np.array(
            [
                [k1 + k2, -a * k1 + b * k2, -k1, -k2],
                [-a * k1 + b * k2, a**2 * k1 + b**2 * k2, a * k1, -b * k2],
                [-k1, a * k1, k1 + kt1, 0.0],
                [-k2, -b * k2, 0.0, k2 + kt2],
            ]
        )

    stiffness = matrix(0.8e6, 2.0e6, 2 * 0.875e6, 4 * 0.875e6)
    damping = matrix(20e3, 50e3, 2 * 1e3, 4 * 1e3)
    loads = G * np.array([700.0 + M * b / 5.0, 1100.0 + M * a / 5.0])
    return np.diag([M, J, 700.0, 1100.0]), damping, stiffness, loads


def test_rigid_truck_by_hand() -> None:
    truck = vehicles.rigid_truck()
    mass, damping, stiffness, loads = rigid_truck_by_hand()
    assert truck.unknowns == [
        "truck bounce",
        "truck pitch",
        "truck axle 1 bounce",
        "truck axle 2 bounce",
    ]
    for ours, expected in (
        (truck.mass_matrix, mass),
        (truck.damping_matrix, damping),
        (truck.stiffness_matrix, stiffness),
    ):
        np.testing.assert_allclose(ours, expected, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(truck.static_loads, loads, rtol=1e-12)


def test_modes_of_the_rigid_truck_by_hand() -> None:
    """Against scipy's generalised eigenvalues of A u' = B u, both matrices symmetric."""
    mass, damping, stiffness, _ = rigid_truck_by_hand()
    zero = np.zeros_like(mass)
    values, vectors = eig(
        np.block([[-stiffness, zero], [zero, mass]]), np.block([[damping, mass], [mass, zero]])
    )
    order = np.argsort(np.abs(values))
    order = order[values[order].imag > 0.0]
    found = vehicles.rigid_truck().modes()
    np.testing.assert_allclose(found["frequency"], np.abs(values[order]) / 2 / np.pi, rtol=1e-9)
    np.testing.assert_allclose(
        found["damping_ratio"], -values[order].real / np.abs(values[order]), rtol=1e-9
    )
    for ours, expected in zip(found["shape"].to_numpy(), vectors[:4, order].T, strict=True):
        at = np.abs(expected).argmax()
        np.testing.assert_allclose(ours, expected / expected[at], rtol=0, atol=1e-9)


# --- from measured axles ----------------------------------------------------------------------

RECORDS: dict[str, tuple[list[float], list[float]]] = {
    "2 axles": ([62e3, 108e3], [5.1]),
    "close axles": ([40e3, 50e3], [1.4]),
    "tandem": ([60e3, 85e3, 79e3], [4.3, 1.35]),
    "twin steer": ([58e3, 55e3, 90e3, 84e3], [1.9, 3.6, 1.38]),
    "2-S3": ([64e3, 104e3, 71e3, 73e3, 68e3], [3.7, 5.6, 1.31, 1.33]),
    "3-S2": ([52e3, 74e3, 72e3, 75e3, 69e3], [4.4, 1.31, 9.6, 1.24]),
    "empty 3-S2": ([47e3, 27e3, 24e3, 19e3, 18e3], [4.4, 1.31, 9.6, 1.24]),
    "truck and trailer": ([60e3, 80e3, 75e3, 70e3, 78e3], [4.2, 1.35, 4.9, 5.3]),
    "B-double": (
        [57e3, 80e3, 78e3, 66e3, 63e3, 65e3, 64e3, 66e3, 61e3],
        [4.2, 1.32, 5.1, 1.26, 1.24, 5.3, 1.25, 1.27],
    ),
    "13 axles": ([55e3, 60e3, *[95e3] * 11], [1.8, 3.4, 1.35, 4.0, *[1.4] * 3, 9.0, *[1.4] * 4]),
}


@pytest.mark.parametrize("kind", ["steel", "air"])
@pytest.mark.parametrize("record", RECORDS)
def test_measured_loads_are_met_exactly(record: str, kind: Any) -> None:
    weights, spacings = RECORDS[record]
    vehicle = vehicles.from_axles(weights, spacings, suspension=kind)
    np.testing.assert_allclose(vehicle.static_loads, weights, rtol=1e-9)
    np.testing.assert_allclose(np.diff(vehicle.axle_positions), spacings, rtol=1e-12)
    assert vehicle.axle_positions[0] == pytest.approx(0.0, abs=1e-12)
    assert vehicle.total_mass == pytest.approx(sum(weights) / G, rel=1e-12)


@pytest.mark.parametrize("kind", ["steel", "air"])
@pytest.mark.parametrize("record", ["2 axles", "tandem", "twin steer", "2-S3", "3-S2", "B-double"])
def test_measured_loaded_vehicles_ride_as_vehicles_do(record: str, kind: Any) -> None:
    found = modes(vehicles.from_axles(*RECORDS[record], suspension=kind))
    frequency, damping = found["body"].T
    assert (frequency > 1.0).all()
    assert (frequency < 4.0).all()
    assert (damping > (0.07 if kind == "steel" else 0.2)).all()
    assert ((found["hop"][:, 0] > 7.0) & (found["hop"][:, 0] < 16.0)).all()


@st.composite
def records(draw: st.DrawFn) -> tuple[list[float], list[float]]:
    count = draw(st.integers(2, 13))
    weights = draw(st.lists(st.floats(12e3, 160e3), min_size=count, max_size=count))
    spacings = draw(st.lists(st.floats(0.9, 15.0), min_size=count - 1, max_size=count - 1))
    return weights, spacings


@given(records(), st.sampled_from(["steel", "air"]))
def test_any_record_is_met_exactly(record: tuple[list[float], list[float]], kind: Any) -> None:
    weights, spacings = record
    vehicle = vehicles.from_axles(weights, spacings, suspension=kind)
    np.testing.assert_allclose(vehicle.static_loads, weights, rtol=1e-9)
    assert (vehicle.modes()["damping_ratio"] > 0.0).all()
    units = [
        body for body in vehicle.bodies if body.pitch_inertia > 0.0 and "beam" not in body.name
    ]
    assert all(body.mass > 0.0 for body in units)
    places = vehicle.axle_positions
    assert all(places[0] <= body.x <= places[-1] for body in units)


def test_groups_make_units() -> None:
    def units(record: str, **options: Any) -> list[str]:
        vehicle = vehicles.from_axles(*RECORDS[record], **options)
        names = (body.name for body in vehicle.bodies)
        return [name for name in names if "axle" not in name]

    assert units("2 axles") == ["truck"]
    assert units("close axles") == ["truck"]
    assert units("tandem", suspension="air") == ["truck"]
    assert units("2-S3", suspension="air") == ["tractor", "trailer"]
    assert units("B-double", suspension="air") == ["tractor", "trailer 1", "trailer 2"]
    # A spread tandem is one group only if told so.
    assert units("truck and trailer", suspension="air") == ["tractor", "trailer 1", "trailer 2"]
    one = [1, 2, 2, 3, 3]
    assert units("truck and trailer", suspension="air", groups=one) == ["tractor", "trailer"]


@pytest.mark.parametrize("record", RECORDS)
def test_groups_are_those_of_the_metrics(record: str) -> None:
    weights, spacings = RECORDS[record]
    groups = pf.metrics.axle_groups(np.cumsum([0.0, *spacings])).to_numpy()
    if record == "close axles":
        groups = np.array([1, 2])
    given = vehicles.from_axles(weights, spacings, groups=groups)
    assert vehicles.from_axles(weights, spacings) == given


def test_axles_of_measured_vehicles() -> None:
    vehicle = vehicles.from_axles(*RECORDS["3-S2"], suspension="air", print_length=0.2)
    masses = {body.name: body.mass for body in vehicle.bodies}
    assert [masses[tire.body] for tire in vehicle.tires] == [700.0, 1100.0, 1100.0, 750.0, 750.0]
    assert [tire.dual for tire in vehicle.tires] == [False, True, True, True, True]
    assert {tire.print_length for tire in vehicle.tires} == {0.2}


def test_a_measured_record_may_be_arrays() -> None:
    weights, spacings = RECORDS["3-S2"]
    assert vehicles.from_axles(np.array(weights), np.array(spacings)) == vehicles.from_axles(
        tuple(weights), spacings
    )


@pytest.mark.parametrize("kind", ["steel", "air"])
def test_measured_vehicle_against_scipy(kind: Any) -> None:
    profile = pf.Profile.iso8608("B", length=70.0, spacing=0.25, seed=13)
    vehicle = vehicles.from_axles(*RECORDS["B-double"], suspension=kind)
    ours, expected = forces_by_scipy(vehicle, profile, 19.317)
    np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-10 * np.ptp(expected))


# --- what is refused --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "fragment"),
    [
        ({"weights": [60e3]}, "weights has 1 axles: must be 2 to 50"),
        ({"weights": []}, "weights has 0 axles"),
        ({"weights": 60e3}, "weights has shape ()"),
        ({"weights": [[60e3, 90e3]]}, "weights has shape (1, 2)"),
        ({"weights": ["heavy", 90e3]}, "weights must be a list of numbers, N"),
        ({"weights": [60e3, -90e3]}, "weights[1] = -90000 N: must be finite and above 0"),
        ({"weights": [60e3, 0.0]}, "weights[1] = 0 N"),
        ({"weights": [np.nan, 90e3]}, "weights[0] = nan N"),
        ({"weights": [60e3, np.inf]}, "weights[1] = inf N"),
        ({"weights": [60e3, 9e3]}, "9000 N on axle 2, must be above the 10791 N of its unsprung"),
        ({"weights": [60e3, 90e3, 90e3]}, "spacings has 1 numbers for 3 axles: must be 2"),
        ({"spacings": [4.0, 1.3]}, "spacings has 2 numbers for 2 axles: must be 1"),
        ({"spacings": []}, "spacings has 0 numbers"),
        ({"spacings": [0.0]}, "spacings[0] = 0 m"),
        ({"spacings": [-4.0]}, "spacings[0] = -4 m"),
        ({"spacings": [np.nan]}, "spacings[0] = nan m"),
        ({"suspension": "rubber"}, "suspension = 'rubber': must be one of ['steel', 'air']"),
        ({"groups": [1, 1]}, "groups = [1, 1]: must be a number for each of 2 axles"),
        ({"groups": [1, 3]}, "groups = [1, 3]"),
        ({"groups": [2, 1]}, "groups = [2, 1]"),
        ({"groups": [1, 2, 3]}, "groups = [1, 2, 3]"),
        ({"groups": 1}, "groups = 1"),
        ({"print_length": -0.1}, "print_length"),
    ],
)
def test_records_that_are_refused(changes: dict[str, Any], fragment: str) -> None:
    values: dict[str, Any] = {"weights": [60e3, 90e3], "spacings": [4.5]}
    with pytest.raises(ValueError, match=re.escape(fragment)):
        vehicles.from_axles(**values | changes)


@pytest.mark.parametrize("make", SPRUNG.values(), ids=list(SPRUNG))
@pytest.mark.parametrize(
    ("options", "fragment"),
    [
        ({"suspension": "rubber"}, "suspension"),
        ({"dry_friction": -0.1}, "dry_friction"),
        ({"dry_friction": 1.0}, "dry_friction"),
        ({"dry_friction": 0.1, "suspension": "air"}, "dry_friction = 0.1: only steel springs"),
        ({"print_length": np.nan}, "print_length"),
        ({"payload": -1.0}, "payload"),
        ({"payload": np.inf}, "payload"),
        ({"sprung_mass": "heavy"}, "sprung_mass"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_options_that_are_refused(
    make: Callable[..., pf.Vehicle], options: dict[str, Any], fragment: str
) -> None:
    with pytest.raises(ValueError, match=fragment):
        make(**options)


def test_named_presets() -> None:
    for name in vehicles.PRESETS:
        assert vehicles.named(name) == vehicles.PRESETS[name]()
    with pytest.raises(ValueError, match=r"preset = 'bicycle': must be one of \['quarter_car'"):
        vehicles.named("bicycle")
    with pytest.raises(ValueError, match="b_double has no axle_spacing; it has suspension"):
        vehicles.named("b_double", axle_spacing=1.3)


@pytest.mark.parametrize("weights", [[7500.0, 11_500.0], [9e5, 8e5]])
def test_weights_as_if_not_in_newtons_are_warned_of(weights: list[float]) -> None:
    with pytest.warns(pf.ValidityWarning, match="weights are in N"):
        pf.vehicles.from_axles(weights, [4.0])


def test_spacings_in_millimetres_are_refused() -> None:
    with pytest.raises(ValueError, match=r"spacings reach 4000 m: must be at most 50 m"):
        pf.vehicles.from_axles([6e4, 8e4], [4000.0])
