"""Scenario files: complete and minimal, every error at once with its key, presets, paths."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pavefem as pf

COMPLETE = """
speed_kmh = 80.0
temperature_c = 25.0
run_in = 12.0
interpolation = "staircase"
lift_off = true

[road]
ends = "pinned"
[[road.sections]]
length = 10.0
[road.sections.pavement]
bar_mass = 340.0
bar_damping = 100000.0
[road.sections.pavement.asphalt]
vma = 18.0
softening_point_c = 55.0
penetration_index = -0.5
[[road.sections]]
length = 5.0
[road.sections.pavement]

[vehicle]
name = "two axles"
[[vehicle.bodies]]
name = "body"
mass = 8000.0
x = 2.0
pitch_inertia = 12000.0
[[vehicle.bodies]]
name = "axle"
mass = 500.0
x = 0.0
[[vehicle.springs]]
upper = "body"
lower = "axle"
x = 0.0
stiffness = 4e5
damping = 1e4
[[vehicle.tires]]
body = "axle"
x = 0.0
stiffness = 1.6e6
damping = 500.0
[[vehicle.tires]]
body = "body"
x = 4.0
stiffness = 2e6
damping = 600.0

[profile]
file = "profiles/site.csv"
name = "the site"

[scheme]
preset = "converged"
element_length = 0.25
dt = 5e-4
"""


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    def _write(text: str) -> Path:
        path = tmp_path / "case.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return _write


def test_complete_file(
    write: Callable[[str], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also: the profile is looked for beside the scenario file, not where one happens to be."""
    x = np.arange(0.0, 40.0, 0.5)
    (tmp_path / "profiles").mkdir()
    pf.Profile(x, 0.001 * np.sin(x)).to_csv(tmp_path / "profiles" / "site.csv")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    scenario = pf.Scenario.from_toml(write(COMPLETE))
    expected = pf.Scenario(
        road=pf.Road(
            sections=[
                (
                    pf.Pavement(
                        bar_mass=340.0,
                        bar_damping=1e5,
                        asphalt=pf.Asphalt(
                            vma=18.0, softening_point_c=55.0, penetration_index=-0.5
                        ),
                    ),
                    10.0,
                ),
                (pf.Pavement.paper(), 5.0),
            ],
            ends="pinned",
        ),
        vehicle=pf.Vehicle(
            name="two axles",
            bodies=[
                pf.Body(name="body", mass=8000.0, x=2.0, pitch_inertia=12_000.0),
                pf.Body(name="axle", mass=500.0, x=0.0),
            ],
            springs=[pf.Spring(upper="body", lower="axle", x=0.0, stiffness=4e5, damping=1e4)],
            tires=[
                pf.Tire(body="axle", x=0.0, stiffness=1.6e6, damping=500.0),
                pf.Tire(body="body", x=4.0, stiffness=2e6, damping=600.0),
            ],
        ),
        profile=pf.Profile(x, 0.001 * np.sin(x), name="the site"),
        speed_kmh=80.0,
        temperature_c=25.0,
        scheme=pf.Scheme.converged(element_length=0.25, dt=5e-4),
        run_in=12.0,
        interpolation="staircase",
        lift_off=True,
    )
    assert scenario == expected
    assert pf.run(scenario).max_deflection > 0.0


def test_empty_file_is_the_nominal_case(write: Callable[[str], Path], nominal: pf.Result) -> None:
    scenario = pf.Scenario.from_toml(write(""))
    assert scenario == pf.Scenario() == nominal.scenario
    assert pf.run(scenario).max_deflection == nominal.max_deflection


@pytest.mark.parametrize(
    ("text", "name", "expected"),
    [
        ("speed_kmh = 80", "speed_kmh", 80.0),
        ("[road]\nlength = 12.0", "road", pf.Road(length=12.0)),
        (
            "[road.pavement.asphalt]\nvma = 20.0",
            "road",
            pf.Road(pf.Pavement(asphalt=pf.Asphalt(vma=20.0))),
        ),
        (
            '[vehicle]\npreset = "tandem_truck"\naxle_spacing = 1.6\npayload = 9000.0',
            "vehicle",
            pf.vehicles.tandem_truck(axle_spacing=1.6, payload=9000.0),
        ),
        (
            '[vehicle]\npreset = "tandem_truck"\nrear_tires = [3e6, 2e4]',
            "vehicle",
            pf.vehicles.tandem_truck(rear_tires=(3e6, 2e4)),
        ),
        ('scheme = "converged"', "scheme", pf.Scheme.converged()),
        ('[scheme]\npreset = "converged"', "scheme", pf.Scheme.converged()),
        ('[scheme]\npreset = "paper"\ndt = 5e-4', "scheme", pf.Scheme.paper(dt=5e-4)),
        ("[scheme]\ndt = 5e-4", "scheme", pf.Scheme.paper(dt=5e-4)),
        (
            '[profile]\nmake = "iso8608"\nroad_class = "B"\nlength = 100.0\nseed = 4',
            "profile",
            pf.Profile.iso8608("B", 100.0, seed=4),
        ),
        ('[profile]\nmake = "smooth"\nlength = 50', "profile", pf.Profile.smooth(50.0)),
    ],
)
def test_each_table(text: str, name: str, expected: object, write: Callable[[str], Path]) -> None:
    scenario = pf.Scenario.from_toml(write(text))
    assert getattr(scenario, name) == expected
    assert scenario == pf.Scenario(**{name: expected})


def test_every_error_at_once_with_its_key(write: Callable[[str], Path]) -> None:
    path = write(
        """
speed_kmh = -65.0
temperature_c = "warm"
colour = "red"
interpolation = "cubic"

[road]
length = 0.0
[road.pavement]
element_mass = -1.0
[road.pavement.asphalt]
vma = 2.0

[vehicle]
preset = "bicycle"

[scheme]
preset = "paper"
dt = 0.0

[profile]
file = "missing.csv"
"""
    )
    with pytest.raises(pf.FormatError) as caught:
        pf.Scenario.from_toml(path)
    text = str(caught.value)
    head, *lines = text.splitlines()
    assert head == f"{path}: {len(lines)} errors in the scenario"
    assert caught.value.path == str(path)
    for key, fragment in {
        "speed_kmh": "greater than 0 (given -65.0)",
        "temperature_c": "(given 'warm')",
        "colour": "",
        "interpolation": "'linear' or 'staircase'",
        "road.sections.0.length": "greater than 0",
        "road.sections.0.pavement.element_mass": "(given -1.0)",
        "road.sections.0.pavement.asphalt.vma": "greater than 3",
        "vehicle": "preset = 'bicycle': must be one of ['quarter_car', 'rigid_truck', 'tandem_",
        "scheme": "dt",
        "profile": "missing.csv",
    }.items():
        found = [line for line in lines if line.startswith(f"  {key}")]
        assert found, (key, text)
        assert any(fragment in line for line in found), (key, fragment, text)
    assert "errors.pydantic.dev" not in text


def test_one_error_is_one(write: Callable[[str], Path]) -> None:
    with pytest.raises(pf.FormatError, match=r"1 error in the scenario\n  speed_kmh: "):
        pf.Scenario.from_toml(write("speed_kmh = 0"))


@pytest.mark.parametrize(
    ("text", "fragment"),
    [
        ("speed_kmh = ", "not a TOML file"),
        ("a = 1\na = 2", "not a TOML file"),
        ("speed_kmh = nan", "speed_kmh: "),
        ("temperature_c = inf", "temperature_c: "),
        ("profile = 5", "profile: "),
        ("vehicle = 5", "vehicle: "),
        ("road = 5", "road: "),
        ('scheme = "exact"', "must be one of ['paper', 'converged']"),
        ('[scheme]\npreset = "paper"\nsolver = "sparse"', "solver"),
        ('[scheme]\npreset = 5', "scheme"),
        ('[profile]\nmake = "waves"', "make = 'waves': must be one of"),
        ("[profile]\nlength = 5.0", "must be one of ['smooth', 'iso8608']"),
        ('[profile]\nmake = "smooth"\ncolour = "red"', "smooth has no colour; it has length"),
        ('[profile]\nmake = "iso8608"\nroad_class = "Z"\nlength = 100.0', "road_class must be one"),
        ('[profile]\nmake = "iso8608"\nlength = 100.0', "road_class"),
        ('[profile]\nmake = "smooth"\nlength = "long"', "profile"),
        ('[profile]\nfile = "a.xyz"', "'.xyz' is not a profile format"),
        ('[profile]\nfile = "a.csv"', "a.csv"),
        ("[profile]\nfile = 5", "profile"),
        ('[profile]\nmake = "smooth"\nlength = 20.0', "is 20 m long"),
        ('run_in = 30.0\n[profile]\nmake = "smooth"\nlength = 50.0', "need 55 m"),
        ('[vehicle]\npreset = "tandem_truck"\nwheels = 6', "tandem_truck has no wheels"),
        ('[vehicle]\npreset = "tandem_truck"\naxle_spacing = "wide"', "vehicle"),
        (
            '[vehicle]\npreset = "tandem_truck"\naxle_spacing = -1.0',
            "vehicle.axle_spacing: Input should be greater than 0 (given -1.0)",
        ),
        ('[vehicle]\npreset = "tandem_truck"\nrear_tires = 5.0', "vehicle"),
        ("[vehicle]\nname = 'nothing'", "vehicle.bodies"),
        (
            "[road]\nlength = 5.0\n[[road.sections]]\nlength = 5.0\n[road.sections.pavement]",
            "not both",
        ),
        ("[[road.sections]]\npavement = {}", "road.sections.0.length"),
        ("[road]\nsections = 5", "road"),
        ("[road]\nsections = []", "road.sections"),
    ],
)  # fmt: skip
def test_what_is_refused(text: str, fragment: str, write: Callable[[str], Path]) -> None:
    with pytest.raises(pf.FormatError, match=re.escape(fragment)) as caught:
        pf.Scenario.from_toml(write(text))
    assert "case.toml" in str(caught.value)


def test_broken_profile_is_told_with_its_line(write: Callable[[str], Path], tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text("0.0,0.0\n0.5,oops\n1.0,0.0\n")
    with pytest.raises(pf.FormatError, match=r"profile: .*bad\.csv, line 2"):
        pf.Scenario.from_toml(write('[profile]\nfile = "bad.csv"'))


def test_profile_options_go_to_the_reader(write: Callable[[str], Path], tmp_path: Path) -> None:
    (tmp_path / "mm.txt").write_text("\n".join(f"{i / 2} {i % 3}" for i in range(100)))
    scenario = pf.Scenario.from_toml(
        write('[profile]\nfile = "mm.txt"\nstation_unit = "m"\nelevation_unit = "mm"')
    )
    assert scenario.profile is not None
    assert scenario.profile.z.max() == pytest.approx(0.002)
    with pytest.raises(pf.FormatError, match="colour"):
        pf.Scenario.from_toml(write('[profile]\nfile = "mm.txt"\ncolour = "red"'))


def test_absolute_path_of_the_profile(write: Callable[[str], Path], tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    path = tmp_path / "far" / "p.csv"
    pf.Profile.smooth(60.0).to_csv(path)
    scenario = pf.Scenario.from_toml(write(f"[profile]\nfile = {str(path)!r}"))
    assert scenario.profile is not None
    assert scenario.profile.length == 60.0


def test_files_that_are_not_there_or_not_text(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        pf.Scenario.from_toml(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(pf.FormatError, match="not a TOML file"):
        pf.Scenario.from_toml(tmp_path / "binary.toml")


def test_round_trip_through_json(rough: pf.Profile) -> None:
    """What a result file keeps: everything but the profile, which goes beside it."""
    scenario = pf.Scenario(
        road=pf.Road(
            sections=[(pf.Pavement.paper(), 5.0), (pf.Pavement.paper(), 7.0)], ends="free"
        ),
        speed_kmh=33.3,
        scheme=pf.Scheme.converged(),
        lift_off=True,
    )
    assert pf.Scenario.model_validate_json(scenario.model_dump_json()) == scenario
    short = pf.Scenario(profile=rough).model_dump()["profile"]
    assert short == {"name": rough.name, "samples": rough.x.size, "length": rough.length}


def test_scenarios_are_frozen_values() -> None:
    scenario = pf.Scenario()
    with pytest.raises(ValueError, match="frozen"):
        scenario.speed_kmh = 5.0  # type: ignore[misc]
    assert scenario == pf.Scenario()
    assert scenario != pf.Scenario(speed_kmh=66.0)


def test_docstring_shows_a_file_that_works(write: Callable[[str], Path], tmp_path: Path) -> None:
    """The example in the docstring of `Scenario` is a scenario file."""
    doc = pf.Scenario.__doc__ or ""
    block = doc.split("::\n\n", 1)[1].split("Parameters\n", 1)[0]
    lines = [line for line in block.splitlines() if line.startswith("    ") or not line.strip()]
    pf.Profile.smooth(90.0).to_csv(tmp_path / "site.csv")
    scenario = pf.Scenario.from_toml(write("\n".join(line.strip() for line in lines)))
    assert scenario.run_in == 50.0
    assert scenario.profile is not None


def test_road_of_sections_or_of_one() -> None:
    one = pf.Road(pf.Pavement.paper(), length=9.0)
    assert one == pf.Road(sections=[(pf.Pavement.paper(), 9.0)])
    assert one == pf.Road(sections=[pf.Section(pavement=pf.Pavement.paper(), length=9.0)])
    assert pf.Road() == pf.Road.paper()
    with pytest.raises(ValueError, match="either sections or length, not both"):
        pf.Road(length=5.0, sections=[(pf.Pavement.paper(), 9.0)])


def test_scheme_presets() -> None:
    assert pf.Scheme.paper() == pf.Scheme() == pf.Scheme.named("paper")
    converged = pf.Scheme.converged()
    assert (converged.foundation, converged.element_length) == ("winkler", None)
    assert (converged.weights, converged.hold, converged.dt) == ("hermite", "first", 1e-3)
    assert pf.Scheme.converged(weights="linear").weights == "linear"


def scenario_with(**changes: Any) -> pf.Scenario:
    return pf.Scenario(**changes)


def test_profile_just_long_enough(truck: pf.Vehicle) -> None:
    """25.000 m of samples 0.1 m apart may be short by a rounding error."""
    x = np.cumsum(np.full(251, 0.1)) - 0.1
    assert scenario_with(profile=pf.Profile(x, np.zeros(251))).profile is not None
    with pytest.raises(ValueError, match="need 25 m"):
        scenario_with(profile=pf.Profile(x[:-1], np.zeros(250)))
