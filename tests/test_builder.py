"""Vehicles from units, their modes and pictures, and vehicle files.

Goal: units compile to the bodies, springs and tires that they mean (the paper's truck among them);
statics follow from levers; beams and connected springs share equally; modes are those of closed
forms; a file gives what Python gives; what a user can get wrong is refused by name.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from oracle import Array

import pavefem as pf
from pavefem import vehicles

G = 9.81

SUSPENSION = pf.Suspension(stiffness=1.2e6, damping=3e4)
TIRES = pf.Tires(stiffness=0.9e6, damping=1.5e3)


def group(x: float, axles: int = 1, spacing: Any = None, **changes: Any) -> pf.AxleGroup:
    fields: dict[str, Any] = {"axle_mass": 800.0, "suspension": SUSPENSION, "tires": TIRES}
    return pf.AxleGroup(x=x, axles=axles, spacing=spacing, **fields | changes)


def unit(name: str, mass: float, x: float, *groups: pf.AxleGroup, **changes: Any) -> pf.Unit:
    return pf.Unit(name=name, mass=mass, x=x, pitch_inertia=3.0 * mass, groups=groups, **changes)


def truck(*rear: pf.AxleGroup) -> pf.Vehicle:
    """Build a truck of a front axle and the groups given, its centre of gravity at 3 m."""
    return vehicles.from_units([unit("truck", 20_000.0, 3.0, group(0.0), *rear)])


def sprung_loads(vehicle: pf.Vehicle, mass: float = 800.0) -> Array:
    return vehicle.static_loads - G * mass


# --- what units compile to --------------------------------------------------------------------


def test_the_papers_truck_from_units() -> None:
    """The tandem truck of section IV: one unit, a walking beam that shares 76 335 to 80 938 N."""
    expected = vehicles.tandem_truck()
    loads = np.array([38_925.0, 76_335.0, 80_938.0]) - G * np.array([600.0, 1000.0, 1000.0])
    pivot = 4.55 + 1.3 * loads[2] / loads[1:].sum()
    front = group(
        0.0,
        axle_mass=600.0,
        suspension=pf.Suspension(stiffness=1.0e6, damping=1.0e4),
        tires=pf.Tires(stiffness=1.75e6 / 2, damping=1.0e4 / 2),
    )
    rear = group(
        5.2,
        2,
        1.3,
        axle_mass=1000.0,
        suspension=pf.Suspension(stiffness=2.0e6, damping=5.0e4),
        tires=pf.Tires(stiffness=3.5e6 / 4, damping=1.0e4 / 4, dual=True),
        equalization="walking-beam",
        shares=tuple(loads[1:]),
    )
    sprung = pf.Unit(
        name="sprung mass",
        mass=loads.sum() / G,
        x=pivot * loads[1:].sum() / loads.sum(),
        pitch_inertia=8.0e4,
        groups=[front, rear],
    )
    found = vehicles.from_units([sprung], name="three-axle tandem truck")
    for ours, paper in (
        (found.mass_matrix, expected.mass_matrix),
        (found.damping_matrix, expected.damping_matrix),
        (found.stiffness_matrix, expected.stiffness_matrix),
    ):
        np.testing.assert_allclose(ours, paper, rtol=1e-11, atol=1e-9 * np.abs(paper).max())
    np.testing.assert_allclose(found.static_loads, expected.static_loads, rtol=1e-11)


def test_names_are_those_of_units_and_axles() -> None:
    vehicle = vehicles.from_units(
        [
            unit(
                "tractor", 6000.0, 1.0, group(0.0), group(4.0, 2, 1.3, equalization="load-sharing")
            ),
            unit(
                "trailer",
                25_000.0,
                9.0,
                group(13.0, 3, 1.3, equalization="walking-beam"),
                hitch=3.8,
            ),
        ],
        name="artic",
    )
    assert vehicle.name == "artic"
    assert [body.name for body in vehicle.bodies] == [
        "tractor",
        "tractor axle 1",
        "tractor axle 2",
        "tractor axle 3",
        "trailer",
        "trailer axle 4",
        "trailer axle 5",
        "trailer axle 6",
        "trailer beam of axles 4-6",
        "trailer beam of axles 5-6",
    ]
    np.testing.assert_allclose(vehicle.axle_positions, [0.0, 3.35, 4.65, 11.7, 13.0, 14.3])


def test_tires_of_an_axle_add_up() -> None:
    dual = TIRES.model_copy(update={"dual": True, "print_length": 0.2})
    vehicle = truck(group(5.0, tires=dual))
    front, rear = vehicle.tires
    assert (front.stiffness, front.damping, front.dual) == (2 * 0.9e6, 2 * 1.5e3, False)
    assert (rear.stiffness, rear.damping, rear.dual) == (4 * 0.9e6, 4 * 1.5e3, True)
    assert (front.print_length, rear.print_length) == (0.0, 0.2)


def test_spacings_may_differ() -> None:
    found = truck(group(6.0, 3, (1.2, 1.6))).axle_positions
    np.testing.assert_allclose(found, [0.0, 4.6, 5.8, 7.4], rtol=1e-14)
    same = group(6.0, 3, 1.4)
    assert same == group(6.0, 3, [1.4])
    np.testing.assert_allclose(same.places, group(6.0, 3, (1.4, 1.4)).places, rtol=1e-15)


def test_friction_goes_with_each_axle() -> None:
    rubbing = SUSPENSION.model_copy(update={"friction": pf.Friction(force=4e3, travel=2e-3)})
    for equalization in ("independent", "walking-beam", "load-sharing"):
        vehicle = truck(group(5.0, 2, 1.3, suspension=rubbing, equalization=equalization))
        frictions = [s.lower for s in vehicle.springs if s.friction is not None]
        assert frictions == ["truck axle 2", "truck axle 3"]


def test_connected_springs_need_no_dampers() -> None:
    bare = pf.Suspension(stiffness=1e6, damping=0.0)
    vehicle = truck(group(6.0, 3, 1.3, suspension=bare, equalization="load-sharing"))
    assert [spring.stiffness for spring in vehicle.springs] == [1.2e6, 3e6]


# --- statics ----------------------------------------------------------------------------------


@given(st.floats(0.5, 1.0), st.floats(0.2, 0.8), st.floats(2e3, 8e3), st.floats(5e3, 40e3))
def test_tractor_and_semitrailer_by_levers(
    pin: float, centre: float, tractor: float, trailer: float
) -> None:
    """The trailer shares its weight between fifth wheel and axle, the tractor that and its own."""
    base, length = 3.8, 7.6
    fifth_wheel = pin * base
    vehicle = vehicles.from_units(
        [
            unit("tractor", tractor, 1.2, group(0.0), group(base)),
            unit(
                "trailer",
                trailer,
                fifth_wheel + centre * length,
                group(fifth_wheel + length),
                hitch=fifth_wheel,
            ),
        ]
    )
    on_pin = trailer * G * (1.0 - centre)
    expected = [
        tractor * G * (1.0 - 1.2 / base) + on_pin * (1.0 - pin),
        tractor * G * 1.2 / base + on_pin * pin,
        trailer * G * centre,
    ]
    np.testing.assert_allclose(sprung_loads(vehicle), expected, rtol=1e-9)


def test_drawbar_trailer_on_a_dolly() -> None:
    """A dolly hangs on the truck's drawbar, with its centre of gravity over its axle."""
    vehicle = vehicles.from_units(
        [
            unit("truck", 9000.0, 2.0, group(0.0), group(4.5)),
            unit("dolly", 900.0, 9.0, group(9.0), hitch=6.0),
            unit("trailer", 12_000.0, 11.0, group(14.0), hitch=9.0),
        ]
    )
    expected = G * np.array([9000.0 * 2.5 / 4.5, 9000.0 * 2.0 / 4.5, 900.0 + 7200.0, 4800.0])
    np.testing.assert_allclose(sprung_loads(vehicle), expected, rtol=1e-12)


@pytest.mark.parametrize("equalization", ["walking-beam", "load-sharing"])
@pytest.mark.parametrize("axles", [2, 3, 4, 5])
def test_axles_share_equally(equalization: str, axles: int) -> None:
    """Whatever the springs, which the independent group of the same place shows to matter."""
    shared = sprung_loads(truck(group(6.0, axles, 1.3, equalization=equalization)))[1:]
    np.testing.assert_allclose(shared, 20_000.0 * G * 3.0 / 6.0 / axles, rtol=1e-12)
    alone = sprung_loads(truck(group(6.0, axles, 1.3)))[1:]
    assert np.ptp(alone) > 0.01 * alone.mean()


def test_tridem_beam_has_arms_of_two_to_one() -> None:
    vehicle = truck(group(6.0, 3, 1.3, equalization="walking-beam"))
    bodies = {body.name: body for body in vehicle.bodies}
    first, second = bodies["truck beam of axles 2-4"], bodies["truck beam of axles 3-4"]
    assert (first.pinned_to, second.pinned_to) == ("truck", first.name)
    assert first.pin == pytest.approx(4.7 + 1.3)
    assert second.pin == pytest.approx(4.7 + 1.3 + 1.3 / 2.0)


def test_shares_are_what_axles_carry() -> None:
    shares = (2.0, 3.0, 1.0, 4.0)
    rear = group(6.0, 4, (1.2, 1.5, 1.3), equalization="walking-beam", shares=shares)
    loads = sprung_loads(truck(rear))[1:]
    np.testing.assert_allclose(loads / loads.sum(), np.array(shares) / 10.0, rtol=1e-12)


def test_mass_of_beams_is_carried() -> None:
    rear = group(6.0, 3, 1.3, equalization="walking-beam", beam_mass=120.0)
    vehicle = truck(rear)
    assert vehicle.total_mass == 20_000.0 + 4 * 800.0 + 2 * 120.0
    assert vehicle.static_loads.sum() == pytest.approx(G * vehicle.total_mass, rel=1e-12)


# --- load sharing on a bump -------------------------------------------------------------------


def loads_on_a_block(vehicle: pf.Vehicle, axle: int, height: float) -> Array:
    """Sprung loads at rest with one axle on a block: K u = k_t h r, beside the weights."""
    tire = vehicle.tires[axle]
    unknowns = [vehicle.unknowns.index(f"{other.body} bounce") for other in vehicle.tires]
    push = np.zeros(len(vehicle.unknowns))
    push[unknowns[axle]] = tire.stiffness * height
    moved = np.linalg.solve(vehicle.stiffness_matrix, push)[unknowns]
    blocks = np.where(np.arange(len(vehicle.tires)) == axle, height, 0.0)
    stiffness = np.array([other.stiffness for other in vehicle.tires])
    return np.asarray(sprung_loads(vehicle) + stiffness * (blocks - moved))


@pytest.mark.parametrize("axles", [2, 3])
@pytest.mark.parametrize("equalization", ["walking-beam", "load-sharing"])
def test_springs_of_a_group_pull_alike_with_one_axle_on_a_block(
    equalization: str, axles: int
) -> None:
    for axle in range(1, axles + 1):
        vehicle = truck(group(6.0, axles, 1.3, equalization=equalization))
        found = loads_on_a_block(vehicle, axle, 0.03)[1:]
        # The truck has two supports: what they carry is a matter of levers.
        np.testing.assert_allclose(found, sprung_loads(vehicle)[1:], rtol=1e-10)
        apart = truck(group(6.0, axles, 1.3))
        change = (loads_on_a_block(apart, axle, 0.03) - sprung_loads(apart))[1:]
        assert change.argmax() == axle - 1
        assert change.max() > 5e3


def test_at_a_crawl_connected_axles_keep_their_loads() -> None:
    """The same by runs: onto a block of 2 cm at 0.1 m/s, axle by axle."""
    profile = pf.Profile([0.0, 20.0, 22.0, 60.0], [0.0, 0.0, 0.02, 0.02])

    def unevenness(vehicle: pf.Vehicle) -> float:
        run = pf.tire_forces(vehicle, profile, 0.36, dt=0.01, run_in=19.5, distance=10.0)
        return float(np.abs(run.force / run.static_loads - 1.0).max())

    for equalization in ("walking-beam", "load-sharing"):
        assert unevenness(truck(group(6.0, 2, 1.3, equalization=equalization))) < 0.01
    assert unevenness(vehicles.semitrailer(suspension="air")) < 0.01
    assert unevenness(truck(group(6.0, 2, 1.3))) > 0.05


# --- modes ------------------------------------------------------------------------------------


@pytest.mark.parametrize("damping", [0.0, 5e3, 4e4, 3e5])
def test_modes_of_a_quarter_car_by_its_polynomial(damping: float) -> None:
    """Roots of (m_s s² + c s + k)(m_u s² + (c + c_t) s + k + k_t) - (c s + k)², by numpy."""
    ms, mu, k, kt, ct = 4500.0, 500.0, 4e5, 2e6, 2e3
    car = pf.Vehicle(
        bodies=[pf.Body(name="sprung", mass=ms, x=0.0), pf.Body(name="axle", mass=mu, x=0.0)],
        springs=[pf.Spring(upper="sprung", lower="axle", x=0.0, stiffness=k, damping=damping)],
        tires=[pf.Tire(body="axle", x=0.0, stiffness=kt, damping=ct)],
    )
    own = np.polymul([ms, damping, k], [mu, damping + ct, k + kt])
    roots = np.roots(np.polysub(own, np.polymul([damping, k], [damping, k])))
    roots = roots[roots.imag >= 0.0]
    roots = roots[np.abs(roots).argsort()]
    found = car.modes()
    np.testing.assert_allclose(found["frequency"], np.abs(roots) / (2.0 * np.pi), rtol=1e-9)
    np.testing.assert_allclose(
        found["damping_ratio"], -roots.real / np.abs(roots), rtol=1e-9, atol=1e-12
    )
    # Of the axle's equation: -k_s'(z_s - z_u) + ... gives the ratio of the two heights.
    heights = (damping * roots + k) / (ms * roots**2 + damping * roots + k)
    shape = found["shape"].to_numpy()
    np.testing.assert_allclose(shape[:, 0], heights * shape[:, 1], rtol=1e-8)
    np.testing.assert_allclose(np.abs(shape).max(axis=1), 1.0, rtol=1e-12)


def test_overdamped_modes_stand_each_for_itself() -> None:
    body = pf.Body(name="mass", mass=1000.0, x=0.0)
    tire = pf.Tire(body="mass", x=0.0, stiffness=1e6, damping=1e5)
    found = pf.Vehicle(bodies=[body], tires=[tire]).modes()
    # 1000 s² + 1e5 s + 1e6 = 0
    roots = np.array([50.0 - np.sqrt(1500.0), 50.0 + np.sqrt(1500.0)])
    np.testing.assert_allclose(found["frequency"], roots / (2.0 * np.pi), rtol=1e-12)
    np.testing.assert_array_equal(found["damping_ratio"], [1.0, 1.0])
    assert list(found["mover"].to_numpy()) == ["mass bounce", "mass bounce"]


def test_modes_without_damping_are_the_natural_frequencies() -> None:
    still: dict[str, Any] = {
        "suspension": pf.Suspension(stiffness=1e6, damping=0.0),
        "tires": pf.Tires(stiffness=1e6, damping=0.0),
    }
    vehicle = vehicles.from_units(
        [
            unit("tractor", 6000.0, 1.0, group(0.0, **still), group(4.0, **still)),
            unit(
                "trailer",
                25_000.0,
                9.0,
                group(13.0, 3, 1.3, equalization="walking-beam", **still),
                hitch=3.8,
            ),
        ]
    )
    found = vehicle.modes()
    np.testing.assert_allclose(found["frequency"], vehicle.natural_frequencies(), rtol=1e-9)
    np.testing.assert_allclose(found["damping_ratio"], 0.0, atol=1e-9)
    # Shapes of an undamped vehicle are real, and orthogonal in M and K.
    shape = found["shape"].to_numpy()
    np.testing.assert_allclose(shape.imag, 0.0, atol=1e-9)
    for matrix in (vehicle.mass_matrix, vehicle.stiffness_matrix):
        products = shape.real @ matrix @ shape.real.T
        scale = np.sqrt(np.diag(products))
        np.testing.assert_allclose(
            products / np.outer(scale, scale), np.eye(scale.size), rtol=0, atol=1e-8
        )
    np.testing.assert_allclose(found["kinetic_share"].sum("unknown"), 1.0, rtol=1e-12)


def test_modes_are_labelled(truck: pf.Vehicle) -> None:
    found = truck.modes()
    assert dict(found.sizes) == {"mode": 7, "unknown": 6}
    assert list(found["unknown"].to_numpy()) == truck.unknowns
    assert found["frequency"].attrs["units"] == "Hz"
    assert found["damping_ratio"].attrs["units"] == "1"
    assert (np.diff(found["frequency"]) >= 0.0).all()
    assert list(found["mover"].to_numpy())[:3] == [
        "sprung mass pitch",
        "sprung mass bounce",
        "equalizing beam pitch",
    ]


# --- files ------------------------------------------------------------------------------------

FILE = """
name = "tipper and trailer"

[[units]]
name = "tipper"
mass = 17000.0
x = 3.1
pitch_inertia = 60e3
[[units.groups]]
x = 0.0
axle_mass = 700
suspension = { stiffness = 8e5, damping = 2e4, friction = { force = 3e3, travel = 2e-3 } }
tires = { stiffness = 0.9e6, damping = 1e3 }
[[units.groups]]
x = 4.6
axles = 2
spacing = 1.35
equalization = "walking-beam"
shares = [1, 1.1]
beam_mass = 80
beam_inertia = 60
axle_mass = 1000
suspension = { stiffness = 2e6, damping = 5e4 }
tires = { stiffness = 0.9e6, damping = 1e3, dual = true, print_length = 0.2 }

[[units]]
name = "trailer"
mass = 12000
x = 8.9
pitch_inertia = 40e3
hitch = 5.5
[[units.groups]]
x = 10.5
axles = 3
spacing = [1.3, 1.4]
equalization = "load-sharing"
axle_mass = 750
suspension = { stiffness = 6e5, damping = 3e4 }
tires = { stiffness = 0.9e6, damping = 1e3 }
"""


def tipper() -> pf.Vehicle:
    single = pf.Tires(stiffness=0.9e6, damping=1e3)
    leaves = pf.Suspension(stiffness=8e5, damping=2e4, friction=pf.Friction(force=3e3, travel=2e-3))
    return vehicles.from_units(
        [
            pf.Unit(
                name="tipper",
                mass=17_000.0,
                x=3.1,
                pitch_inertia=60e3,
                groups=[
                    pf.AxleGroup(x=0.0, axle_mass=700.0, suspension=leaves, tires=single),
                    pf.AxleGroup(
                        x=4.6,
                        axles=2,
                        spacing=1.35,
                        equalization="walking-beam",
                        shares=(1.0, 1.1),
                        beam_mass=80.0,
                        beam_inertia=60.0,
                        axle_mass=1000.0,
                        suspension=pf.Suspension(stiffness=2e6, damping=5e4),
                        tires=pf.Tires(stiffness=0.9e6, damping=1e3, dual=True, print_length=0.2),
                    ),
                ],
            ),
            pf.Unit(
                name="trailer",
                mass=12_000.0,
                x=8.9,
                pitch_inertia=40e3,
                hitch=5.5,
                groups=[
                    pf.AxleGroup(
                        x=10.5,
                        axles=3,
                        spacing=(1.3, 1.4),
                        equalization="load-sharing",
                        axle_mass=750.0,
                        suspension=pf.Suspension(stiffness=6e5, damping=3e4),
                        tires=single,
                    )
                ],
            ),
        ],
        name="tipper and trailer",
    )


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    def _write(text: str) -> Path:
        path = tmp_path / "lorry.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return _write


def test_vehicle_file_gives_what_python_gives(write: Callable[[str], Path]) -> None:
    assert pf.Vehicle.from_toml(write(FILE)) == tipper()


def test_scenario_takes_units_too(write: Callable[[str], Path]) -> None:
    table = FILE.replace("[[units", "[[vehicle.units")
    scenario = pf.Scenario.from_toml(write(f"speed_kmh = 70\n[vehicle]\n{table}"))
    assert scenario.vehicle == tipper()
    assert pf.Scenario.model_validate_json(scenario.model_dump_json()) == scenario


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('preset = "b_double"', vehicles.b_double()),
        (
            'preset = "semitrailer"\nsuspension = "air"\npayload = 9000',
            vehicles.semitrailer(suspension="air", payload=9000.0),
        ),
        (
            """
            bodies = [{ name = "mass", mass = 5000, x = 0 }]
            tires = [{ body = "mass", x = 0, stiffness = 1e6, damping = 0, dual = true }]
            """,
            pf.Vehicle(
                bodies=[pf.Body(name="mass", mass=5000.0, x=0.0)],
                tires=[pf.Tire(body="mass", x=0.0, stiffness=1e6, damping=0.0, dual=True)],
            ),
        ),
    ],
)
def test_vehicle_files_of_other_kinds(
    text: str, expected: pf.Vehicle, write: Callable[[str], Path]
) -> None:
    assert pf.Vehicle.from_toml(write(text)) == expected


def toml(value: Any) -> str:
    """Write a value as TOML has it on one line."""
    if isinstance(value, dict):
        pairs = (f"{key} = {toml(item)}" for key, item in value.items() if item is not None)
        return f"{{ {', '.join(pairs)} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    return f"'{value}'" if isinstance(value, str) else repr(value)


@pytest.mark.parametrize("name", vehicles.PRESETS)
def test_round_trip_of_any_vehicle(name: str, write: Callable[[str], Path]) -> None:
    vehicle = vehicles.named(name)
    fields = vehicle.model_dump()
    text = "\n".join(f"{key} = {toml(value)}" for key, value in fields.items())
    assert pf.Vehicle.from_toml(write(text)) == vehicle


def test_docstring_shows_a_file_that_works(write: Callable[[str], Path]) -> None:
    block = (pf.Vehicle.from_toml.__doc__ or "").split("::\n\n", 1)[1].split("Raises", 1)[0]
    vehicle = pf.Vehicle.from_toml(write(block))
    assert len(vehicle.tires) == 3


def test_every_error_of_a_file_at_once_with_its_key(write: Callable[[str], Path]) -> None:
    text = FILE.replace("mass = 17000.0", "mass = -1.0").replace("spacing = 1.35", "")
    text = text.replace("axles = 3", 'axles = "three"').replace('name = "trailer"', "colour = 3")
    path = write(text)
    with pytest.raises(pf.FormatError) as caught:
        pf.Vehicle.from_toml(path)
    head, *lines = str(caught.value).splitlines()
    assert head == f"{path}: 5 errors in the vehicle"
    for key, fragment in {
        "units.0.mass": "greater than 0 (given -1.0)",
        "units.0.groups.1": "0 spacings for 2 axles: must be one",
        "units.1.name": "required",
        "units.1.groups.0.axles": "(given 'three')",
        "units.1.colour": "",
    }.items():
        assert any(line.startswith(f"  {key}: ") and fragment in line for line in lines), key


@pytest.mark.parametrize(
    ("text", "fragment"),
    [
        ("name = ", "not a TOML file"),
        ("", "bodies: Field required"),
        ('preset = "bicycle"', "preset = 'bicycle': must be one of ['quarter_car'"),
        ('preset = "b_double"\naxle_spacing = 1.3', "b_double has no axle_spacing"),
        ('preset = "b_double"\npayload = -1', "payload: Input should be greater than or equal"),
        ('preset = "b_double"\nsuspension = "air"\ndry_friction = 0.1', "only steel springs"),
        ("units = 5", "units: "),
        ("units = []", "there are no units"),
        ("units = []\nwheels = 3", "wheels: "),
        (FILE.replace("hitch = 5.5", ""), "unit 'trailer' has no hitch"),
        (FILE.replace("x = 8.9", "x = 30.0"), "tipper axle"),
        (
            'bodies = [{ name = "a", mass = 1, x = 0 }, { name = "b", mass = 1, x = 0 }]\n'
            'tires = [{ body = "a", x = 0, stiffness = 1e6, damping = 0 }]',
            "not held up",
        ),
    ],
)
def test_files_that_are_refused(text: str, fragment: str, write: Callable[[str], Path]) -> None:
    with pytest.raises(pf.FormatError, match=re.escape(fragment)) as caught:
        pf.Vehicle.from_toml(write(text))
    assert "lorry.toml" in str(caught.value)


def test_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        pf.Vehicle.from_toml(tmp_path / "none.toml")


# --- what is refused --------------------------------------------------------------------------

REAR = group(4.0)
TRAILER = unit("trailer", 9000.0, 9.0, group(12.0), hitch=3.5)


@pytest.mark.parametrize(
    ("units", "fragment"),
    [
        ([], "there are no units"),
        (
            [unit("truck", 9e3, 2.0, group(0.0), REAR, hitch=1.0)],
            "unit 'truck' is the first: it has no unit to be hitched to",
        ),
        (
            [
                unit("truck", 9e3, 2.0, group(0.0), REAR),
                TRAILER.model_copy(update={"hitch": None}),
            ],
            "unit 'trailer' has no hitch",
        ),
        ([unit("trailer", 9e3, 2.0, group(0.0), REAR), TRAILER], "two units are called 'trailer'"),
        ([unit("truck", 9e3, 0.0, group(0.0))], "unit 'truck' would tip over"),
        (
            [unit("truck", 9e3, 0.0, group(0.65, 2, 1.3, equalization="walking-beam"))],
            "unit 'truck' would tip over",
        ),
        (
            [unit("truck", 9e3, 2.0, REAR, group(0.0))],
            "unit 'truck', group 1: an axle stands at 4 m, but places count from the front axle",
        ),
        (
            [unit("truck", 9e3, 2.0, group(0.0), REAR, group(3.0))],
            "unit 'truck', group 3: an axle stands at 3 m, not behind the axle before it at 4 m",
        ),
        (
            [unit("truck", 9e3, 2.0, group(0.0), REAR, group(4.5, 2, 1.3))],
            "unit 'truck', group 3: an axle stands at 3.85 m, not behind",
        ),
        (
            [
                unit("truck", 9e3, 2.0, group(0.0), REAR),
                unit("trailer", 9e3, 5.0, group(4.0), hitch=3.0),
            ],
            "unit 'trailer', group 1: an axle stands at 4 m, not behind",
        ),
        (
            [unit("truck", 9e3, -1.0, group(0.0), REAR)],
            "N: must be finite and above 0; tire 1 carries 'truck axle 2'",
        ),
        (
            [unit("truck", 9e3, 2.0, group(0.0), REAR), TRAILER.model_copy(update={"x": 20.0})],
            "carries 'truck axle 2'",
        ),
    ],
)
def test_units_that_are_refused(units: list[pf.Unit], fragment: str) -> None:
    with pytest.raises(ValueError, match=re.escape(fragment)):
        vehicles.from_units(units)


@pytest.mark.parametrize(
    ("changes", "fragment"),
    [
        ({"axles": 2}, "0 spacings for 2 axles: must be one"),
        ({"spacing": 1.3}, "1 spacings for 1 axles: must be none"),
        ({"axles": 4, "spacing": (1.3, 1.3)}, "2 spacings for 4 axles: must be one for all, or 3"),
        ({"axles": 2, "spacing": ()}, "spacing"),
        ({"axles": 2, "spacing": -1.3}, "spacing.0"),
        ({"axles": 2, "spacing": "wide"}, "spacing.0"),
        ({"axles": 0}, "axles"),
        ({"axles": 1.5}, "axles"),
        ({"equalization": "walking-beam"}, "needs more axles than one"),
        ({"equalization": "magic", "axles": 2, "spacing": 1.3}, "equalization"),
        ({"axles": 2, "spacing": 1.3, "shares": (1.0, 2.0)}, "'walking-beam' only"),
        ({"beam_inertia": 50.0}, "'walking-beam' only"),
        (
            {"axles": 2, "spacing": 1.3, "equalization": "walking-beam", "shares": (1.0,)},
            "1 shares for 2 axles",
        ),
        (
            {"axles": 2, "spacing": 1.3, "equalization": "walking-beam", "shares": (1.0, 0.0)},
            "shares.1",
        ),
        ({"axle_mass": 0.0}, "axle_mass"),
        ({"x": np.nan}, "x"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_groups_that_are_refused(changes: dict[str, Any], fragment: str) -> None:
    with pytest.raises(ValueError, match=re.escape(fragment)):
        group(**{"x": 4.0} | changes)


@pytest.mark.parametrize(
    ("changes", "fragment"),
    [
        ({"mass": 0.0}, "mass"),
        ({"pitch_inertia": 0.0}, "pitch_inertia"),
        ({"name": ""}, "name"),
        ({"groups": []}, "groups"),
        ({"hitch": np.inf}, "hitch"),
    ],
)
def test_bodies_of_units_that_are_refused(changes: dict[str, Any], fragment: str) -> None:
    with pytest.raises(ValueError, match=fragment):
        unit("truck", 9e3, 2.0, group(0.0)).model_copy(update=changes)


def test_core_names_the_body_that_is_wrong() -> None:
    with pytest.raises(ValueError, match=r"body 1: .*; body 1 is 'beam'"):
        pf.Vehicle(
            bodies=[
                pf.Body(name="mass", mass=1e3, x=0.0),
                pf.Body(name="beam", mass=1.0, x=0.0, pinned_to="mass", pin=0.0),
            ],
            tires=[pf.Tire(body="mass", x=0.0, stiffness=1e6, damping=0.0)],
        )


# --- pictures ---------------------------------------------------------------------------------


def texts(figure: Figure) -> list[str]:
    [axes] = figure.axes
    return [text.get_text() for text in axes.texts]


@pytest.mark.parametrize("kind", ["steel", "air"])
@pytest.mark.parametrize("name", [name for name in vehicles.PRESETS if name != "tandem_truck"])
def test_plot_tells_loads_and_masses(name: str, kind: str) -> None:
    vehicle = vehicles.named(name, suspension=kind)
    figure = vehicle.plot()
    figure.canvas.draw()
    found = texts(figure)
    for load in vehicle.static_loads:
        assert f"{load / 1e3:.1f} kN" in found
    units = [b for b in vehicle.bodies if "axle" not in b.name]
    assert [text for text in found if text.endswith(" t")] == [
        f"{body.mass / 1e3:.1f} t" for body in units
    ]
    [legend] = figure.legends
    entries = {text.get_text() for text in legend.get_texts()}
    assert ("load-sharing spring" in entries) == any(len(s.lower_ends) > 1 for s in vehicle.springs)
    assert ("pin" in entries) == any(body.pinned_to is not None for body in vehicle.bodies)
    assert ("dual tires" in entries) == any(tire.dual for tire in vehicle.tires)
    assert ("single tires" in entries) == any(not tire.dual for tire in vehicle.tires)


def test_plot_is_to_scale_along_the_vehicle(truck: pf.Vehicle) -> None:
    [axes] = truck.plot().axes
    arrows = [text for text in axes.texts if text.get_text().endswith("kN")]
    np.testing.assert_allclose([text.get_position()[0] for text in arrows], truck.axle_positions)
    assert axes.get_aspect() == 1.0


def test_plot_of_bodies_right_on_their_tires() -> None:
    bar = pf.Vehicle(
        bodies=[pf.Body(name="bar", mass=2000.0, x=2.0, pitch_inertia=3000.0)],
        tires=[
            pf.Tire(body="bar", x=0.0, stiffness=1e6, damping=1e4),
            pf.Tire(body="bar", x=4.0, stiffness=1e6, damping=1e4),
        ],
    )
    assert texts(bar.plot()) == ["2.0 t", "", "9.8 kN", "", "9.8 kN"]
