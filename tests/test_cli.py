"""``pavefem run``: what it writes, what it prints, how options change the inputs, how it fails."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA, Run

import pavefem as pf
from pavefem import cli, store

PNG = b"\x89PNG\r\n\x1a\n"
IRI_SOREL = DATA / "iri_sorel" / "profile_1.txt"


# --- what it does -----------------------------------------------------------------------------


@pytest.mark.draws
def test_default_run(pavefem: Run, tmp_path: Path) -> None:
    done = pavefem("run")
    assert done.code == 0, done.err
    assert done.err == ""
    assert {path.name for path in tmp_path.iterdir()} == {"out"}
    files = {path.name: path for path in (tmp_path / "out").iterdir()}
    assert set(files) == {"result.nc", "response.png", "profile.png"}
    for name in ("response.png", "profile.png"):
        assert files[name].read_bytes().startswith(PNG)
    result = pf.load_result(files["result.nc"])
    for key, value in result.summary().items():
        assert key in done.out
        assert value in done.out
    assert "wrote result.nc, response.png, profile.png in out" in done.out
    scenario = result.scenario
    assert scenario.profile == pf.Profile.iso8608("B", length=100.0, seed=1)
    assert (scenario.speed_kmh, scenario.temperature_c, scenario.run_in) == (65.0, 20.0, 50.0)
    assert scenario.vehicle == pf.vehicles.tandem_truck()
    assert scenario.road == pf.Road.paper()
    assert scenario.scheme == pf.Scheme.paper()


def test_default_run_is_the_api(pavefem: Run, tmp_path: Path) -> None:
    pavefem("run")
    expected = pf.simulate(
        pf.Road.paper(),
        pf.vehicles.tandem_truck(),
        profile=pf.Profile.iso8608("B", length=100.0, seed=1),
        run_in=50.0,
    )
    found = pf.load_result(tmp_path / "out" / "result.nc")
    assert found.deflection is not None
    assert expected.deflection is not None
    np.testing.assert_array_equal(found.deflection, expected.deflection)


@pytest.mark.parametrize(
    ("options", "check"),
    [
        (["--speed", "80"], lambda s: s.speed_kmh == 80.0),
        (["--temperature", "12.5"], lambda s: s.temperature_c == 12.5),
        (["--vma", "20"], lambda s: s.road == pf.Road.paper().with_asphalt(vma=20.0)),
        (
            ["--axle-spacing", "1.6"],
            lambda s: s.vehicle == pf.vehicles.tandem_truck(axle_spacing=1.6),
        ),
        (["--payload", "5000"], lambda s: s.vehicle == pf.vehicles.tandem_truck(payload=5000.0)),
        (
            ["--payload", "5000", "--axle-spacing", "1.6"],
            lambda s: s.vehicle == pf.vehicles.tandem_truck(payload=5000.0, axle_spacing=1.6),
        ),
        (["--vehicle", "b_double"], lambda s: s.vehicle == pf.vehicles.b_double()),
        (
            ["--vehicle", "semitrailer", "--suspension", "air", "--payload", "9000"],
            lambda s: s.vehicle == pf.vehicles.semitrailer(suspension="air", payload=9000.0),
        ),
        (["--vehicle", "lorry.toml"], lambda s: s.vehicle == pf.vehicles.rigid_truck()),
        (
            ["case.toml", "--vehicle", "rigid_truck"],
            lambda s: s.speed_kmh == 50.0 and s.vehicle == pf.vehicles.rigid_truck(),
        ),
        (["--run-in", "30"], lambda s: s.run_in == 30.0),
        (["--smooth"], lambda s: s.profile is None and s.run_in == 0.0),
        (["--scheme", "paper"], lambda s: s.scheme == pf.Scheme.paper()),
        (["--no-cache"], lambda s: s.speed_kmh == 65.0),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_options_change_the_inputs(
    options: list[str], check: Callable[[pf.Scenario], bool], pavefem: Run, tmp_path: Path
) -> None:
    (tmp_path / "lorry.toml").write_text('preset = "rigid_truck"')
    (tmp_path / "case.toml").write_text('speed_kmh = 50.0\nvehicle = { preset = "b_double" }')
    done = pavefem("run", *options)
    assert done.code == 0, done.err
    assert check(pf.load_result(tmp_path / "out" / "result.nc").scenario)


def test_smooth_run_is_the_nominal_case_of_the_paper(pavefem: Run, tmp_path: Path) -> None:
    done = pavefem("run", "--smooth")
    assert "0.6611 mm" in done.out
    assert "0.6436 mm" in done.out
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"result.nc", "response.png"}


def test_converged_scheme(pavefem: Run, tmp_path: Path) -> None:
    (tmp_path / "short.toml").write_text("[road]\nlength = 6.0")
    done = pavefem("run", "short.toml", "--scheme", "converged")
    assert done.code == 0, done.err
    scheme = pf.load_result(tmp_path / "out" / "result.nc").scenario.scheme
    assert scheme == pf.Scheme.converged()


def test_no_cache_writes_none(pavefem: Run, cache_folder: Path) -> None:
    assert pavefem("run", "--smooth", "--no-cache").code == 0
    assert not cache_folder.exists()
    assert pavefem("run", "--smooth").code == 0
    assert cache_folder.exists()


def test_out_folder_is_made(pavefem: Run, tmp_path: Path) -> None:
    assert pavefem("run", "--smooth", "--out", "a/b c").code == 0
    assert (tmp_path / "a" / "b c" / "result.nc").is_file()


@pytest.mark.skipif(not IRI_SOREL.is_file(), reason="no measured profile beside the project")
def test_measured_profile(pavefem: Run, tmp_path: Path) -> None:
    done = pavefem("run", "--profile", str(IRI_SOREL), "--run-in", "20")
    assert done.code == 0, done.err
    scenario = pf.load_result(tmp_path / "out" / "result.nc").scenario
    expected = pf.read_profile(IRI_SOREL)
    assert scenario.profile == expected
    assert scenario.run_in == 20.0
    assert expected.name in done.out


def test_elevation_unit_of_the_profile(pavefem: Run, tmp_path: Path) -> None:
    site = pf.Profile.iso8608("B", 30.0, seed=1)
    np.savetxt(tmp_path / "site.csv", np.column_stack([site.x, 1e3 * site.z]), "%.17g", ",")
    done = pavefem("run", "--profile", "site.csv", "--elevation-unit", "mm")
    assert done.code == 0, done.err
    profile = pf.load_result(tmp_path / "out" / "result.nc").scenario.profile
    assert profile is not None
    np.testing.assert_allclose(profile.z, site.z, rtol=1e-12)


def test_a_track_of_the_profile(pavefem: Run, tmp_path: Path) -> None:
    """The first unless another is named; columns, too, say which."""
    site = pf.Profile.iso8608("B", 30.0, track_width=1.8, seed=1)
    site.to_csv(tmp_path / "site.csv")
    for options, track in (
        ([], "left"),
        (["--track", "right"], "right"),
        (["--columns", "0,2"], "right"),
    ):
        done = pavefem("run", "--profile", "site.csv", *options)
        assert done.code == 0, done.err
        profile = pf.load_result(tmp_path / "out" / "result.nc").scenario.profile
        assert profile is not None
        np.testing.assert_allclose(profile.z, site.tracks[track], atol=1e-12)
    done = pavefem("run", "--profile", "site.csv", "--track", "middle")
    assert "left, right" in done.error()


@pytest.mark.parametrize(("length", "run_in"), [(25.0, 0.0), (30.0, 5.0), (400.0, 50.0)])
def test_a_vehicle_settles_on_what_the_profile_has_ahead_of_the_road(
    pavefem: Run, tmp_path: Path, length: float, run_in: float
) -> None:
    pf.Profile.iso8608("A", length).to_csv(tmp_path / "site.csv")
    assert pavefem("run", "--profile", "site.csv").code == 0
    found = pf.load_result(tmp_path / "out" / "result.nc").scenario.run_in
    assert found == pytest.approx(run_in)


def test_a_long_road_keeps_its_envelope(pavefem: Run, tmp_path: Path) -> None:
    options = ["--length", "600", "--scheme", "converged", "--envelope", "--lift-off"]
    done = pavefem("run", *options)
    assert done.code == 0, done.err
    result = pf.load_result(tmp_path / "out" / "result.nc")
    assert result.scenario.road.length == 600.0
    assert result.scenario.lift_off
    assert result.deflection is None
    assert "axle 3" in done.out


def test_length_is_for_one_section(pavefem: Run, tmp_path: Path) -> None:
    section = "[[road.sections]]\nlength = 9.0\n[road.sections.pavement]\n"
    (tmp_path / "two.toml").write_text(2 * section)
    done = pavefem("run", "two.toml", "--length", "30")
    assert done.code == 2
    assert "--length is for a road of one section, two.toml has several" in done.err


def test_scenario_file_and_options_on_top(pavefem: Run, tmp_path: Path) -> None:
    (tmp_path / "case").mkdir()
    pf.Profile.iso8608("A", 30.0).to_csv(tmp_path / "case" / "site.csv")
    (tmp_path / "case" / "case.toml").write_text(
        'speed_kmh = 50.0\ntemperature_c = 15.0\n[road]\nlength = 8.0\n[profile]\nfile = "site.csv"'
    )
    done = pavefem("run", "case/case.toml", "--speed", "90", "--vma", "22")
    assert done.code == 0, done.err
    scenario = pf.load_result(tmp_path / "out" / "result.nc").scenario
    assert (scenario.speed_kmh, scenario.temperature_c) == (90.0, 15.0)
    assert scenario.road == pf.Road(length=8.0).with_asphalt(vma=22.0)
    assert scenario.profile is not None
    assert scenario.profile.length == pytest.approx(30.0)
    pavefem("run", "case/case.toml", "--smooth")
    assert pf.load_result(tmp_path / "out" / "result.nc").scenario.profile is None


@pytest.mark.filterwarnings("default")
def test_warnings_are_one_line(pavefem: Run) -> None:
    """At 40 °C the asphalt formulas are outside their range: said, and done."""
    done = pavefem("run", "--smooth", "--temperature", "45")
    assert done.code == 0
    lines = done.err.strip().splitlines()
    assert lines
    assert all(line.startswith("warning: ") for line in lines)
    assert any("binder stiffness" in line and "MPa" in line for line in lines)
    assert len(set(lines)) == len(lines)
    assert "ValidityWarning" not in done.err


# --- help -------------------------------------------------------------------------------------


def test_help_names_the_units(pavefem: Run) -> None:
    done = pavefem("run", "--help")
    assert done.code == 0
    text = re.sub(r"\s+", " ", done.out)
    for words in (
        "Speed, km/h",
        "temperature, °C",
        "aggregate, %",
        "tandem_truck, m",
        "vehicle, kg",
    ):
        assert words in text
    assert "--no-cache" in text
    assert ", ".join(pf.vehicles.PRESETS) in text
    top = pavefem("--help")
    assert top.code == 0
    assert "km/h" in top.out
    assert "°C" in top.out
    assert "run" in top.out


def test_version(pavefem: Run) -> None:
    assert pavefem("--version").out == f"pavefem {pf.__version__}\n"


def test_no_arguments_is_help(pavefem: Run) -> None:
    done = pavefem()
    assert "Usage" in done.out + done.err


# --- failures ---------------------------------------------------------------------------------

FAILURES: list[tuple[list[str], str]] = [
    (["--speed", "0"], "speed_kmh: .*greater than 0"),
    (["--speed", "-65"], "speed_kmh"),
    (["--speed", "nan"], "speed_kmh"),
    (["--speed", "inf"], "speed_kmh"),
    (["--temperature", "60"], "temperature"),
    (["--temperature", "nan"], "temperature_c"),
    (["--vma", "2"], "vma: .*greater than 3"),
    (["--axle-spacing", "0"], "axle_spacing: Input should be greater than 0"),
    (["--axle-spacing", "12"], "axle_spacing = 12 m"),
    (["--payload", "-9000"], "payload: Input should be greater than -4999"),
    (["--payload", "nan"], "payload"),
    (["--run-in", "-1"], "run_in"),
    (["--run-in", "90"], "need 115 m"),
    (["--scheme", "exact"], "must be one of"),
    (["--profile", "none.csv"], "none.csv"),
    (["--profile", "bad.csv"], "bad.csv, line 2"),
    (["--profile", "short.csv"], "is 10 m long"),
    (["--profile", "picture.xyz"], "not a profile format"),
    (["--profile", "site.csv", "--smooth"], "exclude each other"),
    (["--elevation-unit", "mm"], "--elevation-unit: for the file of --profile, and none is given"),
    (["--smooth", "--track", "left", "--skip", "0"], "--track and --skip: for the file of --prof"),
    (["--profile", "site.csv", "--elevation-unit", "ell"], "elevation_unit must be one of m, cm"),
    (["none.toml"], "none.toml"),
    (["broken.toml"], "not a TOML file"),
    (["own.toml", "--payload", "5"], "--payload: own.toml has a vehicle of its own"),
    (["--vehicle", "lorry"], "--vehicle lorry: neither a file nor one of quarter_car, .*b_double"),
    (["--vehicle", "none.toml"], "--vehicle none.toml: neither a file nor one of"),
    (["--vehicle", "semitrailer", "--axle-spacing", "1.2"], "semitrailer has no axle_spacing"),
    (["--vehicle", "quarter_car", "--payload", "5"], "quarter_car has no payload"),
    (["--vehicle", "semitrailer", "--suspension", "wood"], "suspension: .*'steel' or 'air'"),
    (["--vehicle", "b_double", "--payload", "-1"], "payload: .*greater than or equal to 0"),
    (["--suspension", "air"], "tandem_truck has no suspension"),
    (
        ["--vehicle", "lorry.toml", "--payload", "5", "--suspension", "air"],
        "--suspension and --payload: for ready-made vehicles only; lorry.toml is a file",
    ),
    (["--vehicle", "bad.csv"], "bad.csv: not a TOML file"),
    (["--vehicle", "."], "directory"),
    (["--out", "file/out"], "cannot write to the folder file/out"),
    (["--out", "file"], "cannot write to the folder file"),
    (["."], ""),
]


@pytest.mark.parametrize(
    ("arguments", "pattern"), FAILURES, ids=lambda v: " ".join(v) if isinstance(v, list) else ""
)
def test_failures_are_one_clear_line(
    arguments: list[str], pattern: str, pavefem: Run, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "bad.csv").write_text("0.0,0.0\n0.5,oops\n1.0,0.0\n")
    pf.Profile.smooth(10.0).to_csv(tmp_path / "short.csv")
    pf.Profile.smooth(30.0).to_csv(tmp_path / "site.csv")
    (tmp_path / "picture.xyz").write_bytes(PNG)
    (tmp_path / "broken.toml").write_text("speed_kmh = ")
    (tmp_path / "lorry.toml").write_text('preset = "rigid_truck"')
    (tmp_path / "own.toml").write_text(
        '[vehicle]\nbodies = [{name = "m", mass = 5e3, x = 0.0}]\n'
        'tires = [{body = "m", x = 0.0, stiffness = 1e6, damping = 0.0}]'
    )
    message = pavefem("run", *arguments).error()
    assert re.search(pattern, message), message
    assert "pydantic" not in message
    # Nothing is left behind of a run that did not take place.
    assert not (tmp_path / "out" / "result.nc").exists()


def test_several_errors_are_a_line_each(pavefem: Run, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("speed_kmh = -1\nrun_in = -2\n")
    done = pavefem("run", "bad.toml")
    assert done.code == 2
    assert "2 errors in the scenario" in done.err
    assert "speed_kmh: " in done.err
    assert "run_in: " in done.err
    assert "Traceback" not in done.err


def test_errors_in_a_vehicle_file_are_a_line_each(pavefem: Run, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text('preset = "b_double"\npayload = -1\nsuspension = "wood"')
    done = pavefem("run", "--vehicle", "bad.toml")
    assert done.code == 2
    first, *lines = done.err.splitlines()
    assert first == "error: bad.toml: 2 errors in the vehicle"
    assert sorted(line.strip().split(":")[0] for line in lines) == ["payload", "suspension"]
    assert not (tmp_path / "out").exists()


def test_unknown_option(pavefem: Run) -> None:
    done = pavefem("run", "--colour", "red")
    assert done.code == 2
    assert "--colour" in done.err
    assert "Traceback" not in done.err


def test_markup_in_a_name_is_text(pavefem: Run, tmp_path: Path) -> None:
    """Square brackets are no formatting, neither in errors nor in tables."""
    assert "[/red]none.csv" in pavefem("run", "--profile", "[/red]none.csv").error()
    pf.Profile.smooth(30.0).to_csv(tmp_path / "a[bold]b[x].csv")
    done = pavefem("run", "--profile", "a[bold]b[x].csv")
    assert done.code == 0, done.err
    assert "a[bold]b[x]" in done.out


def test_markup_in_a_vehicle_name_is_text(pavefem: Run, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(
        '[vehicle]\nname = "the [/b] truck"\nbodies = [{name = "m", mass = 5e3, x = 0.0}]\n'
        'tires = [{body = "m", x = 0.0, stiffness = 1e6, damping = 0.0}]'
    )
    done = pavefem("run", "own.toml")
    assert done.code == 0, done.err
    assert "the [/b] truck" in done.out


def test_ctrl_c_says_stopped(pavefem: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def interrupt(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli.run, "run_scenario", interrupt)
    done = pavefem("run", "--smooth")
    assert done.code == 130
    assert done.err == "error: stopped\n"


def test_a_long_road_goes_into_a_store(pavefem: Run, tmp_path: Path) -> None:
    command = ("run", "--length", "300", "--scheme", "converged", "--store", "run.zarr")
    done = pavefem(*command)
    assert done.code == 0, done.err
    assert "wrote run.zarr" in done.out
    assert [path.name for path in tmp_path.iterdir()] == ["run.zarr"]
    result = pf.load_result(tmp_path / "run.zarr")
    assert result.forces is not None and result.deflection is None
    assert pavefem(*command).out == done.out
    info = pavefem("info", "run.zarr")
    for value in result.summary().values():
        assert value in done.out and value in info.out
    assert "holds the run of other inputs" in pavefem(*command, "--speed", "60").error()
    envelope = pavefem(*command[:-1], "other.zarr", "--envelope")
    assert envelope.code == 0, envelope.err
    assert pf.load_result(tmp_path / "other.zarr").forces is None
    assert 'use a Scheme with solver="window"' in pavefem("run", "--store", "new.zarr").error()


def test_a_store_without_zarr_says_how_to_get_it(
    pavefem: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "zarr", None)
    done = pavefem("run", "--smooth", "--scheme", "converged", "--store", "run.zarr")
    assert done.error() == "stores need zarr: pip install 'pavefem[zarr]'"


def test_ctrl_c_says_what_a_store_holds(pavefem: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(store.Store, "write", interrupt)
    done = pavefem("run", "--length", "300", "--scheme", "converged", "--store", "run.zarr")
    assert done.code == 130
    assert done.err.startswith("error: stopped; run.zarr holds 0 s of 16.")
    error = pavefem("info", "run.zarr").error()
    assert error == "run.zarr: not a sound store of a run: no block of its run is done"


# --- a real process ---------------------------------------------------------------------------


def test_as_a_process(run_python: Callable[..., Any], tmp_path: Path) -> None:
    """Without a terminal or a display: exit code, plain text, files."""
    main = "import sys; from pavefem.cli import app; sys.argv[0] = 'pavefem'; app()"
    done = run_python("-c", main, "run", "--smooth")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "0.6611 mm" in done.stdout
    assert "\x1b[" not in done.stdout
    assert (tmp_path / "out" / "response.png").read_bytes().startswith(PNG)
    assert pf.load_result(tmp_path / "out" / "result.nc").scenario.profile is None

    failed = run_python("-c", main, "run", "--speed", "-5")
    assert failed.returncode == 2
    assert failed.stderr.count("\n") == 1
    assert failed.stderr.startswith("error: speed_kmh: ")
    assert failed.stdout == ""
