"""``pavefem iri`` and ``pavefem info``: figures of files, and files that have none."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Run

import pavefem as pf
from pavefem import roughness

CRG = """$ROAD_CRG
REFERENCE_LINE_INCREMENT = 0.25
$
$KD_DEFINITION
#:LRFI
D:long section at v = -1.0,m
D:long section at v =  1.0,m
$
$$
"""


@pytest.fixture
def two_tracks(tmp_path: Path) -> pf.Profile:
    """Write a profile of two wheel tracks, of 5 segments of 100 m and half of one, to two.csv."""
    profile = pf.Profile.iso8608("B", 550.0, track_width=1.8, seed=1)
    profile.to_csv(tmp_path / "two.csv")
    return pf.read_profile(tmp_path / "two.csv")


@pytest.fixture
def one_track(tmp_path: Path) -> pf.Profile:
    """Write a profile of one track to one.csv."""
    profile = pf.Profile.iso8608("C", 230.0, seed=2)
    profile.to_csv(tmp_path / "one.csv")
    return pf.read_profile(tmp_path / "one.csv")


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(StringIO(text)))


def whole_iri(pavefem: Run, *arguments: str) -> dict[str, float]:
    """Ask for JSON, and give what the whole of the one profile has."""
    done = pavefem("iri", *arguments, "--format", "json")
    assert done.code == 0, done.err
    [found] = json.loads(done.out)
    return {key: value for key, value in found["whole"].items() if key.endswith("per_km")}


# --- pavefem iri: what it writes --------------------------------------------------------------


def test_table_has_segments_tracks_and_the_whole(pavefem: Run, two_tracks: pf.Profile) -> None:
    done = pavefem("iri", "two.csv")
    assert (done.code, done.err) == (0, "")
    title, _, head, _, *lines = done.out.splitlines()
    assert title.strip() == "two.csv"
    assert re.findall(r"[^┃]+?(?= ┃)", head) == [
        *(" from [m]", " to [m]", " IRI left [m/km]", " IRI right [m/km]", " MRI [m/km]")
    ]
    numbers = [[float(n) for n in re.findall(r"[\d.]+", line)] for line in lines if "│" in line]
    starts = [0.0, 100.0, 200.0, 300.0, 400.0, 500.0]
    rows = roughness.iri(two_tracks, segment=100.0).to_numpy()
    means = roughness.mri(two_tracks, segment=100.0).to_numpy()
    expected = np.column_stack([starts, [*starts[1:], 550.0], *rows, means])
    whole = [0.0, 550.0, *roughness.iri(two_tracks).to_numpy(), float(roughness.mri(two_tracks))]
    np.testing.assert_allclose(numbers, np.vstack([expected, whole]), atol=0.005)


def test_csv_is_exact_and_alone(
    pavefem: Run, two_tracks: pf.Profile, one_track: pf.Profile
) -> None:
    done = pavefem("iri", "two.csv", "one.csv", "--segment", "200", "--format", "csv")
    assert (done.code, done.err) == (0, "")
    rows = rows_of(done.out)
    assert list(rows[0]) == [
        *("file", "part", "start_m", "end_m"),
        *("left_iri_m_per_km", "right_iri_m_per_km", "mri_m_per_km", "iri_m_per_km"),
    ]
    assert [(row["file"], row["part"]) for row in rows] == [
        *(("two.csv", part) for part in ("segment 1", "segment 2", "segment 3", "whole")),
        *(("one.csv", part) for part in ("segment 1", "segment 2", "whole")),
    ]
    index = roughness.iri(two_tracks, segment=200.0)
    for name in ("left", "right"):
        found = [float(row[f"{name}_iri_m_per_km"]) for row in rows[:3]]
        assert found == index.sel(track=name).to_numpy().tolist()
    assert float(rows[3]["mri_m_per_km"]) == float(roughness.mri(two_tracks))
    assert float(rows[-1]["iri_m_per_km"]) == one_track.iri()
    assert [rows[-2][key] for key in ("start_m", "end_m")] == ["200.0", "230.0"]
    assert rows[-1]["left_iri_m_per_km"] == rows[0]["iri_m_per_km"] == ""


def test_json_is_exact_and_alone(pavefem: Run, two_tracks: pf.Profile) -> None:
    done = pavefem("iri", "two.csv", "--segment", "300", "--format", "json")
    assert (done.code, done.err) == (0, "")
    [found] = json.loads(done.out)
    assert found["file"] == "two.csv"
    assert [(part["start_m"], part["end_m"]) for part in found["segments"]] == [
        *((0.0, 300.0), (300.0, 550.0))
    ]
    expected = roughness.iri(two_tracks, segment=300.0).sel(track="right").to_numpy()
    assert [part["right_iri_m_per_km"] for part in found["segments"]] == expected.tolist()
    assert found["whole"]["mri_m_per_km"] == float(roughness.mri(two_tracks))


@pytest.mark.parametrize("form", ["csv", "json"])
def test_out_is_what_would_be_printed(
    form: str, pavefem: Run, two_tracks: pf.Profile, tmp_path: Path
) -> None:
    printed = pavefem("iri", "two.csv", "--format", form)
    for arguments in (["--out", f"new/a.{form}"], ["--out", "new/b.txt", "--format", form]):
        done = pavefem("iri", "two.csv", *arguments)
        assert (done.code, done.err) == (0, "")
        assert done.out == f"wrote {arguments[1]}\n"
        assert (tmp_path / arguments[1]).read_text("utf-8") == printed.out
    assert len(list((tmp_path / "new").iterdir())) == 2


def test_one_track_of_several(pavefem: Run, two_tracks: pf.Profile) -> None:
    assert whole_iri(pavefem, "two.csv", "--track", "right") == {
        "right_iri_m_per_km": two_tracks.track("right").iri()
    }


def test_info_of_one_track(pavefem: Run, two_tracks: pf.Profile) -> None:
    done = pavefem("info", "two.csv", "--track", "right")
    assert done.code == 0, done.err
    assert f"{two_tracks.track('right').iri():.2f} m/km" in done.out
    assert "MRI" not in done.out


def test_moving_average_can_be_left_out(pavefem: Run, one_track: pf.Profile) -> None:
    expected = one_track.iri(moving_average=False)
    assert expected > 1.01 * one_track.iri()
    assert whole_iri(pavefem, "one.csv", "--no-moving-average") == {"iri_m_per_km": expected}


def test_reader_options(pavefem: Run, one_track: pf.Profile, tmp_path: Path) -> None:
    """Each way of writing the same profile that needs an option gives the same index."""
    x, z = one_track.x, one_track.z

    def write(name: str, *columns: Any, head: str = "", delimiter: str = ",") -> None:
        text = StringIO()
        np.savetxt(text, np.column_stack(columns), "%.17g", delimiter, header=head, comments="")
        (tmp_path / name).write_text(text.getvalue())

    write("mm.csv", x, 1e3 * z)
    write("km.txt", x / 1e3, 1e3 * z)
    write("many.csv", 0.0 * x, x, 7.0 * z, z, head="mark,place,other,surface")
    write("notes.csv", x, z, head="a drive of a morning\nin fine weather")
    write("elevations.txt", z)
    write("comma.csv", x, z, delimiter=";")
    text = (tmp_path / "comma.csv").read_text().replace(".", ",")
    (tmp_path / "comma.csv").write_text(text)
    erd = pf.Profile(x, z, tracks={"outer": z, "inner": 7.0 * z})
    erd.to_erd(tmp_path / "named.erd")
    for arguments in (
        ["mm.csv", "--elevation-unit", "mm"],
        ["km.txt", "--elevation-unit", "mm", "--station-unit", "km"],
        ["many.csv", "--columns", "1,3"],
        ["many.csv", "--columns", "place, surface"],
        ["notes.csv", "--skip", "2"],
        ["elevations.txt", "--step", "0.05"],
        ["comma.csv", "--decimal", ","],
        ["named.erd", "--channels", "0"],
    ):
        [found] = whole_iri(pavefem, *arguments).values()
        assert found == pytest.approx(one_track.iri(), rel=1e-9), arguments


def test_lateral_positions(pavefem: Run, tmp_path: Path) -> None:
    right, left = (pf.Profile.iso8608("B", 60.0, spacing=0.25, seed=s).z for s in (1, 2))
    table = "\n".join(f"{a:10.7f}{b:10.7f}" for a, b in zip(right, left, strict=True))
    (tmp_path / "road.crg").write_text(CRG + table + "\n")
    middle = pf.read_profile(tmp_path / "road.crg", v=0.0).iri()
    assert whole_iri(pavefem, "road.crg") == {"iri_m_per_km": middle}
    both = pf.read_profile(tmp_path / "road.crg", v=[0.5, -0.5])
    found = whole_iri(pavefem, "road.crg", "--lateral", "0.5", "--lateral", "-0.5")
    assert list(found.values()) == [*roughness.iri(both).to_numpy(), float(roughness.mri(both))]
    one = whole_iri(pavefem, "road.crg", "--lateral", "-1")
    expected = pf.read_profile(tmp_path / "road.crg", v=-1.0)
    assert one == {"iri_m_per_km": expected.iri()}
    done = pavefem("run", "--profile", "road.crg", "--lateral", "-1")
    assert done.code == 0, done.err
    assert pf.load_result(tmp_path / "out" / "result.nc").scenario.profile == expected


@pytest.mark.filterwarnings("default")
def test_warnings_name_their_file(pavefem: Run, tmp_path: Path) -> None:
    for name, spacing in (("a.csv", 0.5), ("b.csv", 0.5), ("c.csv", 0.25)):
        pf.Profile.iso8608("B", 150.0, spacing=spacing).to_csv(tmp_path / name)
    done = pavefem("iri", "a.csv", "b.csv", "c.csv", "--format", "csv")
    assert done.code == 0
    first, second = done.err.splitlines()
    assert re.match(r"warning: a.csv: the samples of the profile are .*0.5 m apart", first)
    assert second.startswith("warning: b.csv: ")
    assert len(rows_of(done.out)) == 9


# --- pavefem iri: what it refuses -------------------------------------------------------------


def test_a_bad_file_does_not_lose_the_others(
    pavefem: Run, one_track: pf.Profile, two_tracks: pf.Profile, tmp_path: Path
) -> None:
    (tmp_path / "bad.csv").write_text("0.0,0.0\n0.5,oops\n1.0,0.0\n")
    files = ("none.csv", "one.csv", ".", "bad.csv", "two.csv")
    for form in ("table", "csv", "json"):
        done = pavefem("iri", *files, "--format", form)
        assert done.code == 2
        assert "Traceback" not in done.err
        missing, folder, bad = done.err.splitlines()
        assert missing == "error: none.csv: no such file"
        assert folder.startswith("error: .: is a directory")
        assert bad.startswith("error: bad.csv, line 2: ")
        assert done.out.index("one.csv") < done.out.index("two.csv")
        assert "bad.csv" not in done.out
    assert [item["file"] for item in json.loads(done.out)] == ["one.csv", "two.csv"]
    assert pavefem("iri", *files, "--out", "iri.csv").code == 2
    assert len(rows_of((tmp_path / "iri.csv").read_text())) == 4 + 7


FAILURES: list[tuple[list[str], str]] = [
    (["one.csv", "--segment", "0"], "--segment is 0 m: must be above 0"),
    (["one.csv", "--segment", "-5"], "--segment is -5 m"),
    (["one.csv", "--segment", "nan"], "--segment is nan m"),
    (["one.csv", "--segment", "inf"], "--segment is inf m"),
    (["one.csv", "--segment", "0.01"], "one.csv: .*segment"),
    (["one.csv", "--track", "left"], "one.csv: track 'left' is not .*one track"),
    (["two.csv", "--track", "middle"], "two.csv: track 'middle' is not .*left, right"),
    (["none.csv"], "none.csv: no such file"),
    (["none"], "none: no such file"),
    (["."], "is a directory"),
    (["picture.png"], "picture.png, byte 0: is a picture.*supported are .crg"),
    (["text.xyz"], "text.xyz.*not a profile format"),
    (["empty.csv"], "empty.csv: .*empty"),
    (["mm.csv"], "mm.csv.*pass .*elevation_unit="),
    (["one.csv", "--elevation-unit", "yard"], "one.csv: elevation_unit must be one of m, cm"),
    (["one.csv", "--elevation-unit", "mm"], "one.csv.*contradicts the header"),
    (["one.csv", "--lateral", "1"], "one.csv is columns of text.*no option v"),
    (["one.csv", "--columns", "0,9"], "one.csv"),
    (["one.csv", "--step", "-1"], "one.csv: step must be positive"),
    (["one.csv", "--out", "iri.xlsx"], "--out iri.xlsx: give --format csv or json"),
    (["one.csv", "--out", "iri.csv", "--format", "table"], "give --format csv or json"),
    (["one.csv", "--out", "one.csv"], "--out one.csv is one of the profiles"),
    (["one.csv", "--out", "./one.csv"], "is one of the profiles"),
    (["one.csv", "--out", "folder.csv"], "folder.csv is a directory"),
    (["one.csv", "--out", "one.csv/iri.csv"], "cannot write to the folder one.csv"),
    (["one.csv", "--out", os.devnull, "--format", "csv"], "is a directory or a device"),
]


@pytest.mark.parametrize(
    ("arguments", "pattern"), FAILURES, ids=lambda v: " ".join(v) if isinstance(v, list) else ""
)
def test_failures_are_one_clear_line(
    arguments: list[str],
    pattern: str,
    pavefem: Run,
    one_track: pf.Profile,
    two_tracks: pf.Profile,
    tmp_path: Path,
) -> None:
    before = (tmp_path / "one.csv").read_bytes()
    (tmp_path / "picture.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    (tmp_path / "text.xyz").write_text("a rainy day\n")
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "folder.csv").mkdir()
    np.savetxt(tmp_path / "mm.csv", np.column_stack([one_track.x, 1e3 * one_track.z]), "%.9g", ",")
    files = sorted(tmp_path.iterdir())
    done = pavefem("iri", *arguments)
    message = done.error()
    assert re.search(pattern, message), message
    assert done.out == ""
    assert sorted(tmp_path.iterdir()) == files
    assert (tmp_path / "one.csv").read_bytes() == before


def test_a_file_that_may_not_be_read(
    pavefem: Run, one_track: pf.Profile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "secret.csv").write_text("0,0\n1,0\n")
    (tmp_path / "secret.csv").chmod(0)
    if os.access(tmp_path / "secret.csv", os.R_OK):  # of a user whom no mode keeps out
        really_open = Path.open

        def refuse(path: Path, *arguments: Any, **options: Any) -> Any:
            if path.name == "secret.csv":
                raise PermissionError(13, "Permission denied", str(path))
            return really_open(path, *arguments, **options)

        monkeypatch.setattr(Path, "open", refuse)
    for command in ("iri", "info"):
        done = pavefem(command, "secret.csv", "one.csv")
        assert done.error() == "secret.csv: permission denied"
        assert "one.csv" in done.out


def test_no_memory_and_ctrl_c(
    pavefem: Run, one_track: pf.Profile, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(error: type[BaseException]) -> None:
        def read(*_: Any, **__: Any) -> None:
            raise error

        monkeypatch.setattr("pavefem.cli.profiles.read_profile", read)

    fail(MemoryError)
    assert pavefem("iri", "one.csv").error().startswith("one.csv: no memory")
    fail(KeyboardInterrupt)
    done = pavefem("iri", "one.csv")
    assert (done.code, done.err) == (130, "error: stopped\n")


def test_unknown_format_is_refused_with_the_known_ones(pavefem: Run, one_track: pf.Profile) -> None:
    done = pavefem("iri", "one.csv", "--format", "xml")
    assert done.code == 2
    assert all(name in done.err for name in ("xml", "table", "csv", "json"))


def test_no_file_is_refused(pavefem: Run) -> None:
    for command in ("iri", "info"):
        done = pavefem(command)
        assert done.code == 2
        assert "FILE" in done.err


@pytest.mark.skipif(sys.platform == "win32", reason="pipes there do not break")
@pytest.mark.parametrize("form", ["table", "csv", "json"])
def test_a_reader_that_leaves_is_no_error(form: str, tmp_path: Path) -> None:
    """As of ``pavefem iri long.csv | head -1``, which has gone when the rest is printed."""
    pf.Profile.iso8608("A", 50.0).to_csv(tmp_path / "a.csv")
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-m", "pavefem", "iri", "a.csv", "--format", form],
        cwd=tmp_path,
        stdout=writer,
        stderr=subprocess.PIPE,
        check=False,
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (1, b"")


# --- pavefem info -----------------------------------------------------------------------------


def test_info_of_a_profile(pavefem: Run, two_tracks: pf.Profile) -> None:
    done = pavefem("info", "two.csv")
    assert (done.code, done.err) == (0, "")
    assert "two.csv: profile" in done.out
    left, right = roughness.iri(two_tracks).to_numpy()
    found = roughness.iso8608_class(two_tracks)
    figures = two_tracks.summary() | {
        "IRI": f"left {left:.2f} m/km, right {right:.2f} m/km",
        "MRI": f"{float(roughness.mri(two_tracks)):.2f} m/km",
        "ISO 8608 class": f"{found.road_class}, G_d(n0) = {found.gd_n0:.3g} m³, "
        f"waviness {found.waviness:.2f}, of track left",
    }
    del figures["file"]  # there it has its folder
    for name, value in figures.items():
        assert re.search(rf"{re.escape(name)} +│ {re.escape(value)} ", done.out), name


@pytest.mark.filterwarnings("default")
def test_info_takes_the_options_of_readers(pavefem: Run, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("".join(f"{i},{i % 5}\n" for i in range(40)))
    assert "pass station_unit= and elevation_unit=" in pavefem("info", "a.csv").error()
    done = pavefem("info", "a.csv", "--elevation-unit", "mm")
    assert (done.code, done.err.count("warning: a.csv: ")) == (0, 1)
    assert "elevation mm (as told)" in done.out
    assert "0.0000 to 0.0040 m" in done.out


@pytest.mark.filterwarnings("default")
def test_info_says_what_a_profile_is_too_short_or_smooth_for(pavefem: Run, tmp_path: Path) -> None:
    pf.Profile([0.0, 20.0, 40.0], [0.0, 0.1, 0.0]).to_csv(tmp_path / "coarse.csv")
    pf.Profile.smooth(100.0).to_csv(tmp_path / "smooth.csv")
    done = pavefem("info", "coarse.csv", "smooth.csv")
    assert done.code == 0
    assert re.search(r"IRI +│ none: .*11 m", done.out)
    assert re.search(r"ISO 8608 class +│ none: a PSD needs more than 8 samples", done.out)
    assert re.search(r"IRI +│ 0.00 m/km", done.out)
    assert "none: a class needs a rough profile" in done.out


def test_info_of_a_scenario_and_of_its_result(
    pavefem: Run, two_tracks: pf.Profile, tmp_path: Path
) -> None:
    (tmp_path / "case.toml").write_text(
        'speed_kmh = 72.0\nrun_in = 30.0\n[profile]\nfile = "two.csv"\n[road]\nlength = 8.0'
    )
    scenario = pf.Scenario.from_toml(tmp_path / "case.toml")
    done = pavefem("info", "case.toml")
    assert (done.code, done.err) == (0, "")
    assert "case.toml: scenario" in done.out
    for words in ("72 km/h", "20 °C", "8 m", "two, 550 m, run-in 30 m", "foundation='bars'"):
        assert words in done.out
    for load in scenario.vehicle.static_loads:
        assert f"static load {load / 1e3:.2f} kN" in done.out
    pf.run(scenario).to_netcdf(tmp_path / "result.nc")
    done = pavefem("info", "result.nc")
    assert "result.nc: result" in done.out
    for name, value in pf.load_result(tmp_path / "result.nc").summary().items():
        assert re.search(rf"{re.escape(name)} +│ {re.escape(value)} ", done.out), name


def test_info_of_a_vehicle(pavefem: Run, tmp_path: Path) -> None:
    (tmp_path / "lorry.toml").write_text('preset = "rigid_truck"\nsuspension = "air"')
    (tmp_path / "own.toml").write_text(
        'name = "cart"\nbodies = [{name = "m", mass = 5e3, x = 0.0}]\n'
        'tires = [{body = "m", x = 0.0, stiffness = 1e6, damping = 2e4}]'
    )
    done = pavefem("info", "lorry.toml", "own.toml")
    assert (done.code, done.err) == (0, "")
    assert "lorry.toml: vehicle" in done.out
    lorry = pf.vehicles.rigid_truck(suspension="air")
    for place, load in zip(lorry.axle_positions, lorry.static_loads, strict=True):
        assert f"at {place:g} m, static load {load / 1e3:.2f} kN" in done.out
    for frequency in lorry.modes()["frequency"].to_numpy():
        assert f"{frequency:.2f} Hz" in done.out
    # One mass on one spring: sqrt(k/m) and c / 2 sqrt(k m).
    frequency, damping = np.sqrt(1e6 / 5e3) / (2 * np.pi), 2e4 / (2 * np.sqrt(1e6 * 5e3))
    assert f"{frequency:.2f} Hz, damping {100 * damping:.0f} %, m bounce" in done.out
    assert "cart, 5.00 t" in done.out


def test_info_reports_each_file_that_it_cannot_take(
    pavefem: Run, one_track: pf.Profile, tmp_path: Path
) -> None:
    (tmp_path / "bad.toml").write_text("speed_kmh = -1\nrun_in = -2\n")
    (tmp_path / "bad.nc").write_text("no netCDF")
    (tmp_path / "text.xyz").write_text("a rainy day\n")
    done = pavefem("info", "none.csv", "bad.toml", "bad.nc", "text.xyz", "one.csv")
    assert done.code == 2
    assert "one.csv: profile" in done.out
    assert "Traceback" not in done.err
    lines = done.err.splitlines()
    assert lines[0] == "error: none.csv: no such file"
    assert lines[1].startswith("error: bad.toml: 2 errors in the scenario")
    assert lines[2].strip().startswith("speed_kmh: ")
    assert lines[3].strip().startswith("run_in: ")
    assert lines[4].startswith("error: bad.nc: not a sound netCDF file")
    assert lines[5].startswith("error: text.xyz")
    assert lines[5].endswith(
        "info also takes vehicles and scenarios (.toml) and results (.nc, .zarr)"
    )
    assert len(lines) == 6


@pytest.mark.parametrize("command", ["iri", "info"])
def test_markup_in_a_name_is_text(command: str, pavefem: Run, tmp_path: Path) -> None:
    pf.Profile.iso8608("A", 50.0).to_csv(tmp_path / "a[bold]b[x].csv")
    done = pavefem(command, "a[bold]b[x].csv", "[/red]none.csv")
    assert "a[bold]b[x].csv" in done.out
    assert done.error() == "[/red]none.csv: no such file"


@pytest.mark.parametrize("command", ["iri", "info"])
def test_as_a_process(command: str, run_python: Callable[..., Any], tmp_path: Path) -> None:
    pf.Profile.iso8608("A", 50.0).to_csv(tmp_path / "a.csv")
    done = run_python("-m", "pavefem", command, "a.csv")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "IRI" in done.stdout
    assert "\x1b[" not in done.stdout


def test_help_names_units_and_formats(pavefem: Run) -> None:
    done = pavefem("iri", "--help")
    text = re.sub(r"\s+", " ", done.out)
    for words in ("m/km", ".crg, .erd, .csv", "m, cm, mm, km, in, ft, mi, mil", "--lateral"):
        assert words in text
    text = re.sub(r"\s+", " ", pavefem("info", "--help").out)
    assert "vehicles and scenarios (.toml) and results (.nc, .zarr)" in text
