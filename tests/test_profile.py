"""Profiles: what they hold, how they are generated, and how they are read from text."""

from __future__ import annotations

import copy
import pickle
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pavefem.errors import FormatError, PavefemError, SolverError
from pavefem.formats import read_profile
from pavefem.profile import Profile, ProfileSource

IRI_SOREL = Path(__file__).parents[2] / "shared" / "data" / "iri_sorel"

needs_iri_sorel = pytest.mark.skipif(
    not IRI_SOREL.is_dir(), reason="measured profiles not beside the project (shared/data)"
)

same_file = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write text or bytes to a file and return its path."""

    def _write(content: str | bytes, name: str = "site.csv") -> Path:
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return _write


def source_of(profile: Profile) -> ProfileSource:
    assert profile.source is not None
    return profile.source


# --- errors -----------------------------------------------------------------------------------


def test_format_error_names_file_line_and_byte() -> None:
    error = FormatError("station 3.25 does not increase", path=Path("site.csv"), line=17)
    assert str(error) == "site.csv, line 17: station 3.25 does not increase"
    assert str(FormatError("cut short", path="a.crg", byte=120)) == "a.crg, byte 120: cut short"
    assert str(FormatError("cut short")) == "cut short"
    assert isinstance(error, ValueError) and isinstance(error, PavefemError)
    assert issubclass(SolverError, RuntimeError)


def test_format_error_survives_pickling() -> None:
    error = FormatError("bad", path="site.csv", line=17, byte=3)
    back = pickle.loads(pickle.dumps(error))
    assert (str(back), back.message, back.path, back.line, back.byte) == (
        str(error), "bad", "site.csv", 17, 3,
    )  # fmt: skip


# --- the class --------------------------------------------------------------------------------


def test_profile_copies_and_freezes_its_arrays() -> None:
    x, z = np.array([0, 1, 2]), np.array([0.0, 0.1, 0.0])
    profile = Profile(x, z, name="bump")
    z[1] = 9.0
    assert profile.z[1] == 0.1 and profile.x.dtype == np.float64
    with pytest.raises(ValueError, match="read-only"):
        profile.z[0] = 1.0
    with pytest.raises(AttributeError):
        profile.name = "other"  # type: ignore[misc]


def test_profile_equality_is_by_value() -> None:
    profile = Profile([0.0, 1.0], [0.0, 1.0], name="a")
    assert profile == Profile([0.0, 1.0], [-0.0, 1.0], name="a")
    assert hash(profile) == hash(Profile([0.0, 1.0], [-0.0, 1.0], name="a"))
    assert profile != Profile([0.0, 1.0], [0.0, 1.0], name="b")
    assert profile != Profile([0.0, 1.0], [0.0, 1.1], name="a")
    assert profile != "a"


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda p: pickle.loads(pickle.dumps(p))])
def test_clones_are_equal_and_still_frozen(clone: Callable[[Profile], Profile]) -> None:
    profile = Profile([0.0, 1.0], [0.0, 1.0], "a", ProfileSource("a.csv", rows=2))
    assert clone(profile) == profile and clone(profile).source == profile.source
    assert not clone(profile).x.flags.writeable


@pytest.mark.parametrize(
    ("x", "z", "message"),
    [
        ([0.0, 1.0], [0.0], "x has 2 values and z has 1"),
        ([0.0], [0.0], "at least 2 samples, got 1"),
        ([0.0, 1.0, 1.0], [0.0] * 3, r"x\[2\] = 1.0 does not increase \(x\[1\] = 1.0\)"),
        ([0.0, 2.0, 1.0], [0.0] * 3, r"x\[2\] = 1.0 does not increase"),
        ([0.0, 1.0], [0.0, np.nan], r"z\[1\] is nan"),
        ([0.0, np.inf], [0.0, 0.0], r"x\[1\] is inf"),
        ([[0.0, 1.0]], [[0.0, 1.0]], r"x must be one-dimensional, got shape \(1, 2\)"),
        (["0", "1"], [0.0, 1.0], "x must hold real numbers"),
        ([0.0, 1.0], [0.0, 1j], "z must hold real numbers, got dtype complex128"),
        ([[0.0], [0.0, 1.0]], [0.0, 1.0], "x must be a sequence of numbers"),
        ([0.0, 1.0], np.ma.masked_less([0.0, 1.0], 0.5), "z must hold real numbers, got masked"),
        ([-1.5e308, 1.5e308], [0.0, 0.0], "longer than a float can hold"),
    ],
)
def test_profile_says_what_is_wrong(x: object, z: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Profile(x, z)  # type: ignore[arg-type]


def test_name_must_be_a_string() -> None:
    with pytest.raises(ValueError, match="name must be a string, got 3"):
        Profile([0, 1], [0, 0], name=3)  # type: ignore[arg-type]


def test_spacing_and_uniformity() -> None:
    uniform = Profile(100.0 + 0.05 * np.arange(1001), np.zeros(1001))
    assert uniform.is_uniform
    assert uniform.spacing == pytest.approx(0.05) and uniform.length == pytest.approx(50.0)
    irregular = Profile([0.0, 0.1, 0.3, 0.4], np.zeros(4))
    assert not irregular.is_uniform and irregular.spacing == pytest.approx(0.1)
    assert "irregular, median 0.1 m" in repr(irregular)


def test_elevation_is_linear_inside_and_level_outside() -> None:
    profile = Profile([1.0, 2.0, 4.0], [0.0, 1.0, -1.0])
    assert profile.elevation(1.5) == 0.5
    assert profile.elevation([[0.0, 3.0], [4.0, 9.0]]).tolist() == [[0.0, 0.0], [-1.0, -1.0]]


def test_resampling_keeps_a_straight_line() -> None:
    x = np.array([10.0, 10.3, 10.7, 11.6, 12.0])
    resampled = Profile(x, 0.02 * x, name="ramp").resample(0.25)
    assert resampled.x.tolist() == [10.0, 10.25, 10.5, 10.75, 11.0, 11.25, 11.5, 11.75, 12.0]
    np.testing.assert_allclose(resampled.z, 0.02 * resampled.x, rtol=1e-14)
    assert resampled.name == "ramp"


@pytest.mark.parametrize("spacing", [0.0, -1.0, np.nan, np.inf, 5.0, 1e-12])
def test_resample_refuses_a_useless_spacing(spacing: float) -> None:
    with pytest.raises(ValueError, match="spacing"):
        Profile([0.0, 1.0, 3.0], np.zeros(3)).resample(spacing)


def test_slice_includes_both_ends() -> None:
    profile = Profile(0.1 * np.arange(11), np.arange(11.0))  # 0.30000000000000004 among them
    assert profile.slice(0.1, 0.3).z.tolist() == [1.0, 2.0, 3.0]
    with pytest.raises(ValueError, match=r"stay within the profile, 0 to 1 m"):
        profile.slice(0.5, 1.5)
    with pytest.raises(ValueError, match="must increase"):
        profile.slice(0.5, 0.5)
    with pytest.raises(ValueError, match="holds 1 samples"):
        profile.slice(0.5, 0.55)


# --- what there is to know of a profile -------------------------------------------------------


def test_summary_of_a_profile_that_was_made() -> None:
    z = [0.0, 0.0123, -0.2]
    assert Profile([100.0, 100.5, 101.5], z, "bump").summary() == {
        "name": "bump",
        "tracks": "one, without a name",
        "samples": "3",
        "stations": "100 to 101.5 m",
        "length": "1.5 m",
        "spacing": "irregular, 0.5 to 1 m, median 0.75 m",
        "elevation": "-0.2000 to 0.0123 m",
    }
    uniform = Profile([0.0, 0.25, 0.5], z, tracks={"left": z, "right": [1.0, 1.0, 1.5]}).summary()
    assert (uniform["name"], uniform["tracks"]) == ("none", "left, right")
    assert (uniform["spacing"], uniform["right elevation"]) == ("0.25 m", "1.0000 to 1.5000 m")
    assert "elevation" not in uniform


def test_summary_of_a_profile_from_a_file(write: Callable[..., Path]) -> None:
    path = write("Road;A12\nx [ft];Bemerkung;links [in];rechts [in]\n0;;1,5;2\n1;a;2;2\n2,5;;1;2\n")
    profile = read_profile(path)
    summary = profile.summary()
    assert list(summary.values())[-6:] == [
        str(path),
        "columns of text, semicolon and decimal comma",
        "3",
        "x [ft], links [in], rechts [in]",
        "station ft (the file says), elevation in (the file says)",
        "resampled, 0.3048 to 0.4572 m apart in the file",
    ]
    assert summary["samples"] == "3" and summary["spacing"] == "0.381 m"
    assert profile.track("right").summary()["columns read"] == "x [ft], rechts [in]"
    told = read_profile(write("0 1\n1 2\n", "a.txt"), elevation_unit="mm").summary()
    assert told["units in the file"] == "station m (by default), elevation mm (as told)"
    assert (told["columns read"], told["stations of the file"]) == ("without names", "as read")


# --- generated profiles -----------------------------------------------------------------------


def test_smooth_covers_its_length() -> None:
    profile = Profile.smooth(25.0)
    assert profile.x.size == 101 and profile.length == 25.0 and not profile.z.any()
    with pytest.raises(ValueError, match="length must be positive and finite, got -1"):
        Profile.smooth(-1.0)


def test_iso8608_is_reproducible() -> None:
    one, same, other = (Profile.iso8608("B", length=100.0, seed=s) for s in (1, 1, 2))
    assert one == same
    assert not np.array_equal(one.z, other.z)
    assert one.length == pytest.approx(100.0) and one.spacing == pytest.approx(0.05)


@pytest.mark.parametrize("length", [99.95, 100.0])  # an even and an odd number of samples
@pytest.mark.parametrize(("road_class", "centre"), [("A", 16e-6), ("B", 64e-6), ("E", 4096e-6)])
def test_iso8608_has_the_psd_of_its_class_and_nothing_else(
    road_class: str, centre: float, length: float
) -> None:
    profile = Profile.iso8608(road_class, length=length, seed=7)
    count = profile.x.size
    dn = 1.0 / (count * 0.05)
    n = dn * np.arange(count // 2 + 1)
    psd = 2.0 * np.abs(np.fft.rfft(profile.z) / count) ** 2 / dn
    in_band = (n >= 0.011) & (n <= 2.83)
    np.testing.assert_allclose(psd[in_band], centre * (n[in_band] / 0.1) ** -2, rtol=1e-6)
    assert psd[~in_band].max() < 1e-20


def test_iso8608_is_the_stated_sum_of_cosines() -> None:
    profile = Profile.iso8608("C", length=19.75, spacing=0.25, seed=3, n_min=0.1, n_max=0.5)
    dn = 1.0 / 20.0
    n = dn * np.arange(2, 11)
    phase = np.random.default_rng(3).uniform(0.0, 2.0 * np.pi, n.size)
    amplitude = np.sqrt(2.0 * 256e-6 * (n / 0.1) ** -2 * dn)
    expected = np.cos(2.0 * np.pi * np.outer(profile.x, n) + phase) @ amplitude
    np.testing.assert_allclose(profile.z, expected, atol=1e-15)


def test_iso8608_slope_variance_over_the_band() -> None:
    """Closed form for w = 2: the slope PSD is flat, (2 pi n0)^2 G_d(n0) over the band."""
    profile = Profile.iso8608("A", length=5000.0, spacing=0.02, seed=5)
    slope_variance = np.var(np.gradient(profile.z, profile.x))
    assert slope_variance == pytest.approx((2 * np.pi * 0.1) ** 2 * 16e-6 * 2.82, rel=0.02)


def test_iso8608_keeps_below_nyquist() -> None:
    coarse = Profile.iso8608("B", length=100.0, spacing=0.5, seed=1)
    assert np.isfinite(coarse.z).all() and coarse.x.size == 201


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"road_class": "Z"}, "road_class must be one of A, B, .* got 'Z'"),
        ({"length": 0.0}, "length must be positive"),
        ({"length": 0.1}, "no wave between"),
        ({"spacing": 50.0}, "no wave between"),
        ({"spacing": 200.0}, "gives 0.5 steps"),
        ({"seed": -1}, "seed must be an integer >= 0, got -1"),
        ({"seed": None}, "seed must be an integer >= 0, got None"),
        ({"n_min": 0.0}, "n_min must be positive"),
        ({"n_min": 3.0}, "no wave between n_min = 3.0 and n_max = 2.83"),
        ({"waviness": np.nan}, "waviness must be finite"),
    ],
)
def test_iso8608_says_what_is_wrong(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Profile.iso8608(**{"road_class": "B", "length": 100.0} | arguments)  # type: ignore[arg-type]


# --- reading text: what is understood ---------------------------------------------------------

Z = [583.1, 583.25, 583.0]


@pytest.mark.parametrize(
    ("content", "delimiter", "decimal"),
    [
        ("0.0,583.1\n0.5,583.25\n1.0,583\n", ",", "."),
        ("0.0, 583.1\n0.5, 583.25\n1.0, 583\n", ",", "."),
        ('"0.0","583.1"\n"0.5","583.25"\n"1.0","583"\n', ",", "."),
        ("0.0;583.1\n0.5;583.25\n1.0;583\n", ";", "."),
        ("0,0;583,1\n0,5;583,25\n1,0;583\n", ";", ","),
        ("0.0\t583.1\n0.5\t583.25\n1.0\t583\n", "\t", "."),
        ("0,0\t583,1\n0,5\t583,25\n1\t583\n", "\t", ","),
        ("  0.0   583.1\n  0.5   583.25\n\n  1.0   583\n", " ", "."),
        ("0 583,1\n0,5 583,25\n1 583\n", " ", ","),
        ("0e0 5.831e2\n5.0E-1 583.25\n1. +583\n", " ", "."),
        ("0.0 583.1\r\n0.5 583.25\r\n1.0 583", " ", "."),
        ("0.0 583.1\r0.5 583.25\r1.0 583\r", " ", "."),
        ("\ufeff0.0,583.1\n0.5,583.25\n1.0,583\n", ",", "."),
        ("# a\n% b\n\n0.0,583.1\n0.5,583.25\n# c\n1.0,583\n", ",", "."),
    ],
)
def test_delimiter_and_decimal_mark_are_detected(
    write: Callable[..., Path], content: str, delimiter: str, decimal: str
) -> None:
    profile = read_profile(write(content))
    assert profile.x.tolist() == [0.0, 0.5, 1.0] and profile.z.tolist() == Z
    assert profile.name == "site"
    source = source_of(profile)
    assert (source.delimiter, source.decimal, source.rows) == (delimiter, decimal, 3)
    assert (source.units, source.units_from) == (("m", "m"), ("default", "default"))
    assert (source.header, source.stations, source.resampled_from) == ((), "as read", None)


@pytest.mark.parametrize(
    ("header", "units", "factors"),
    [
        ("station [m];elevation [mm]", ("m", "mm"), (1.0, 1e-3)),
        ("Distance (km);Elevation (in)", ("km", "in"), (1e3, 0.0254)),
        ("DISTANCE_FT;ELEVATION_CM", ("ft", "cm"), (0.3048, 0.01)),
        ('"Chainage, mi";"Height/ft"', ("mi", "ft"), (1609.344, 0.3048)),
        ("Weg [m];Höhe 1 [ m ]", ("m", "m"), (1.0, 1.0)),
        ("m;mm", ("m", "mm"), (1.0, 1e-3)),
    ],
)
def test_units_of_the_header_are_applied(
    write: Callable[..., Path],
    header: str,
    units: tuple[str, str],
    factors: tuple[float, float],
) -> None:
    for encoding in ("utf-8", "latin-1"):
        content = f"{header}\n0,0;583,1\n0,5;583,25\n1,0;583,0\n".encode(encoding)
        profile = read_profile(write(content))
        np.testing.assert_allclose(profile.x, np.array([0.0, 0.5, 1.0]) * factors[0])
        np.testing.assert_allclose(profile.z, np.array(Z) * factors[1])
        assert source_of(profile).units == units
        assert source_of(profile).units_from == ("header", "header")
        assert source_of(profile).header == tuple(header.replace('"', "").split(";"))


def test_whitespace_header_with_units(write: Callable[..., Path]) -> None:
    profile = read_profile(write("station [m]  elevation (mm)\n0 1\n1 2\n", "site.txt"))
    assert profile.z.tolist() == [0.001, 0.002]
    assert source_of(profile).header == ("station [m]", "elevation (mm)")


def test_units_by_option(write: Callable[..., Path]) -> None:
    profile = read_profile(write("x,z\n0,1\n1,2\n"), station_unit="ft", elevation_unit="in")
    assert profile.x.tolist() == [0.0, 0.3048] and profile.z.tolist() == [0.0254, 0.0508]
    assert source_of(profile).units_from == ("option", "option")
    profile = read_profile(write("x [ft],z [furlong]\n0,1\n1,2\n"), elevation_unit="in")
    assert source_of(profile).units_from == ("header", "option")


def test_commented_header_counts_if_it_names_the_columns(write: Callable[..., Path]) -> None:
    profile = read_profile(write("# A12 left\n# station [m], elevation [mm]\n0.0,1\n0.5,2\n"))
    assert source_of(profile).units == ("m", "mm")
    profile = read_profile(write("# measured, wet\n0.0,1\n0.5,1.1\n"))
    assert source_of(profile).header == ()


def test_columns_are_found_by_header_name(write: Callable[..., Path]) -> None:
    content = "elevation_mm,remark,station_m\n10,start of bridge,0.0\n20,,0.5\n30,end,1.0\n"
    profile = read_profile(write(content))
    assert profile.x.tolist() == [0.0, 0.5, 1.0]
    assert profile.z.tolist() == [0.01, 0.02, 0.03]
    assert source_of(profile).columns == (2, 0)


@pytest.mark.parametrize("columns", [(0, 2), ("Station [m]", "z dry [mm]"), ("station", 2)])
def test_columns_are_chosen_by_option(
    write: Callable[..., Path], columns: tuple[int | str, int | str]
) -> None:
    path = write("station [m];z wet [mm];z dry [mm]\n0;1;5\n1;2;7\n")
    with pytest.raises(FormatError, match=r"which of 3 columns \(station \[m\], z wet"):
        read_profile(path)
    profile = read_profile(path, columns=columns)
    assert profile.z.tolist() == [0.005, 0.007] and source_of(profile).columns == (0, 2)


@pytest.mark.parametrize(
    ("content", "header"),
    [
        ("Road: A12\nx [ft],z [in]\n0.0,1.0\n1.0,2.0\n", ("x [ft]", "z [in]")),
        ("Road;A12\n\nDate;12.03.2021\n10:30\nx [ft];z [in]\n0;1,0\n1;2\n", ("x [ft]", "z [in]")),
        ("Run 3 of 5, wet\nx,z\nft,in\n0.0,1.0\n1.0,2.0\n", ("x", "z")),
        ("=======\nx\tz\n[ft]\t(in)\n-------\n0\t1\n1\t2\n", ("x", "z")),
        ("Lane;2\n# c\nx [ft];z;IRI\n;inch;[m/km]\n# c\n0;1;2\n1;2;2\n", ("x [ft]", "z", "IRI")),
        ("Road A12\n# x [ft] z [in]\n0 1\n1 2\n", ("x [ft]", "z [in]")),
        ("Units of z: in; see below\nx [ft]  z (in)\n0 1\n1 2\n", ("x [ft]", "z (in)")),
        ("Lane;1\nStation;Höhe\nft;in\n0;1\n1;2\n", ("Station", "Höhe")),
        ('"Road","A12"\n"x [ft]","z [in]"\n"0.0","1.0"\n"1.0","2.0"\n', ("x [ft]", "z [in]")),
        (",x [ft],z [in]\n0,0.0,1.0\n1,1.0,2.0\n", ("", "x [ft]", "z [in]")),
    ],
)
def test_metadata_and_units_above_the_numbers(
    write: Callable[..., Path], content: str, header: tuple[str, ...]
) -> None:
    profile = read_profile(write(content))
    np.testing.assert_allclose(profile.x, [0.0, 0.3048])
    np.testing.assert_allclose(profile.z, [0.0254, 0.0508])
    assert source_of(profile).header == header
    assert source_of(profile).units_from == ("header", "header")


@pytest.mark.parametrize(
    ("names", "tracks"),
    [
        ("Station [m];Höhe links [mm];Höhe rechts [mm]", ["left", "right"]),
        ("Distance (m);Right Elevation (mm);Left Elevation (mm)", ["left", "right"]),
        ("Abscisse [m];Altitude trace gauche [mm];Altitude trace droite [mm]", ["left", "right"]),
        ("Distancia (m);Cota izquierda (mm);Cota derecha (mm)", ["left", "right"]),
        ("Progressiva [m];Quota sinistra [mm];Quota destra [mm]", ["left", "right"]),
        ("Afstand [m];Hoogte links [mm];Hoogte rechts [mm]", ["left", "right"]),
        ("Chainage (m);LWP Elevation (mm);RWP Elevation (mm)", ["left", "right"]),
        ("x [m];Elevation (left) [mm];Elevation (right) [mm]", ["left", "right"]),
        ("s [m];Profil links [mm];Mitte [mm]", ["left", "center"]),
    ],
)
def test_languages_of_column_names(
    write: Callable[..., Path], names: str, tracks: list[str]
) -> None:
    profile = read_profile(write(f"{names}\n0,0;1,5;2,5\n0,5;1,0;2,0\n"))
    assert list(profile.tracks) == tracks
    numbers = {0.0015, 0.0025}
    assert {float(z[0]) for z in profile.tracks.values()} == numbers
    assert source_of(profile).units == ("m", "mm", "mm")


def test_side_in_brackets_is_no_unit(write: Callable[..., Path]) -> None:
    path = write("x,Elevation (left),Elevation (right)\n0.0,0.5,0.4\n1.0,0.5,0.4\n")
    profile = read_profile(path)
    assert list(profile.tracks) == ["left", "right"]
    assert source_of(profile).units_from == ("default",) * 3


def test_elevations_without_stations(write: Callable[..., Path]) -> None:
    """As published at github vsimko/rroad: two drives and their mean, every 0.1 m, in mm."""
    path = write("drive_1;drive_2;mean\n-0,186;-0,843;-0,5145\n-0,422;-1,102;-0,762\n0;1;2\n")
    with pytest.raises(FormatError, match=r"which of 3 columns .*; or step= if none has stations"):
        read_profile(path)
    with pytest.raises(FormatError, match=r"which of 3 columns \(drive_1, .*are elevations\?"):
        read_profile(path, step=0.1)
    options = {"step": 0.1, "elevation_unit": "mm"}
    one = read_profile(path, columns=["mean"], **options)
    assert one.x.tolist() == [0.0, 0.1, 0.2]
    np.testing.assert_allclose(one.z, [-0.5145e-3, -0.762e-3, 2e-3])
    source = source_of(one)
    assert (source.columns, source.units) == ((-1, 2), ("m", "mm"))
    assert (source.units_from, source.stations) == (("option", "option"), "as read")
    both = read_profile(path, columns=("drive_1", "drive_2"), **options)
    assert list(both.tracks) == ["drive_1", "drive_2"]
    assert read_profile(path, columns=(0,), spacing=0.2, **options).x.tolist() == [0.0, 0.2]

    named = write("Höhe rechts [mm]\tHöhe links [mm]\n2\t1\n2\t1\n", "named.txt")
    assert list(read_profile(named, step=0.25).tracks) == ["left", "right"]
    for content, more in (("z [mm]\n1,5\n2,5\n", {"decimal": ","}), ("1.5e-3\n2.5e-3\n", {})):
        alone = read_profile(write(content, "alone.txt"), step=0.25, **more)
        assert alone.z.tolist() == [0.0015, 0.0025]
    with pytest.raises(FormatError, match=r"names is 1 .*, of columns below it 2"):
        read_profile(write("z [mm]\n1,5\n2,5\n", "alone.txt"), step=0.25)
    with pytest.raises(FormatError, match="step= is given, but 'x' has stations"):
        read_profile(write("x,z\n0,1\n1,1\n", "x.txt"), step=0.25)
    with pytest.raises(FormatError, match=r"columns=.* must be elevations"):
        read_profile(path, columns=(), **options)
    with pytest.raises(FormatError, match="line 3: elevation 'x' is not a number"):
        read_profile(write("1.5\n2.5\nx\n", "alone.txt"), step=0.25)


def test_skipped_lines_and_name(write: Callable[..., Path]) -> None:
    path = write("Site 12, lane 3\nrun 4 of 5\nx,z\n0,1\n1,1.1\n", "a.dat")
    profile = read_profile(path, skip=2, name="lane 3")
    assert profile.name == "lane 3" and source_of(profile).header == ("x", "z")


def test_irregular_stations_are_resampled_and_said_so(write: Callable[..., Path]) -> None:
    content = "0.0,0.0\n0.25,0.01\n0.5,0.02\n0.9,0.036\n1.25,0.05\n"
    profile = read_profile(write(content))
    assert profile.is_uniform and profile.spacing == 0.3
    np.testing.assert_allclose(profile.z, 0.04 * profile.x)
    assert source_of(profile).stations == "resampled"
    assert source_of(profile).resampled_from == pytest.approx((0.25, 0.4))
    assert read_profile(write(content), spacing=0.125).x.size == 11
    kept = read_profile(write(content), spacing="file")
    assert kept.x.tolist() == [0.0, 0.25, 0.5, 0.9, 1.25]
    assert source_of(kept).stations == "as read"


def test_rounding_of_printed_stations_is_no_irregularity(write: Callable[..., Path]) -> None:
    """Every inch, printed to the millimetre: 0.025, 0.051, 0.076, ... is a grid of 25.4 mm."""
    inches = 0.0254 * np.arange(4001)
    content = "".join(f"{x:.3f} {0.01 * np.sin(x):.6f}\n" for x in inches)
    profile = read_profile(write(content, "inches.txt"))
    np.testing.assert_allclose(profile.x, inches, atol=1e-9)
    np.testing.assert_allclose(profile.z, 0.01 * np.sin(inches), atol=1e-6)
    assert source_of(profile).stations == "rounding removed"
    assert source_of(profile).resampled_from == pytest.approx((0.025, 0.026))


def test_spacing_of_the_file_by_option_changes_nothing(write: Callable[..., Path]) -> None:
    path = write("0.0,0\n0.1,1\n0.2,0\n0.3,0\n", "site.tsv")
    profile = read_profile(path, spacing=0.1, elevation_unit="mm", station_unit="m")
    assert profile.x.tolist() == [0.0, 0.1, 0.2, 0.3]
    assert source_of(profile).stations == "as read"


# --- reading text: what is refused, and why ---------------------------------------------------


@pytest.mark.parametrize(
    ("content", "line", "message"),
    [
        ("0,1\n1,1\n1,1\n", 3, r"station 1.0 does not increase \(previous 1.0\)"),
        ("# c\nx,z\n\n0,1\n2,1\n\n1.5,1\n", 7, r"station 1.5 does not increase \(previous 2.0\)"),
        ("0,1\n1,nan\n2,1\n", 2, "elevation is nan; it must be finite"),
        ("0,1\n-inf,1\n2,1\n", 2, "station is -inf"),
        ("nan nan\n1 2\n", 1, "station is nan"),
        ("0,1\n1,\n2,1\n", 2, "elevation '' is not a number"),
        ("0,1\n1,abc\n2,1\n", 2, "elevation 'abc' is not a number with decimal mark '.'"),
        ("x;z\n0,5;1,5\n1,0;1.234,5\n", 3, r"elevation '1.234,5' is not a number .* ','"),
        ("0,1\n1,2\n2\n", 3, "number of columns is 1, in line 1 it is 2"),
        ("0,1\n1,2\n2.0,1,5\n", 3, "number of columns is 3, in line 1 it is 2"),
        ("0,1\n1,2\n2,1,5\n", 3, "'2,1,5' has several readings"),
        ("0.0,1.0\n1.0,1.0 # joint\n", 2, "elevation '1.0 # joint' is not a number"),
        ("x,z\nm,mm\n0,1\n", 3, "one sample; a profile needs at least 2"),
        ("x,z\nm\n0,1\n1,1\n", 2, "number of units is 1, of columns 2"),
        ("x [m],z\nft,mm\n0,1\n1,1\n", 2, r"unit 'ft' contradicts that in 'x \[m\]'"),
        ("x,z\nfoo,1\n1,1\n", 2, "station 'foo' is not a number .* below this line, pass skip="),
        ("1,z\n1,1\n", 1, "elevation 'z' is not a number .* below this line, pass skip="),
        ("Run;3\n0,0;1,5\n0,5;1,5\n", 1, "'Run;3' stands above .* not name .* pass skip="),
        ("x;z\nRun;3;4\n0,0;1,5\n0,5;1,5\n", 2, "'Run;3;4' stands above the numbers"),
        ("12.03.2021\n0.0 1.5\n0.5 1.5\n", 1, "'12.03.2021' stands above the numbers"),
        ("s [ft];z [in]\nStart;wet\n0;1\n1;1\n", 2, "'Start;wet' stands above .* skip="),
        ("s [ft];z [in]\nx;Höhe\n0;1\n1;1\n", 1, "'s .ft.;z .in.' speaks of units"),
        ("Interval [m];0.5\nx;Höhe\n0;1\n1;1\n", 1, "'Interval .m.;0.5' speaks of units"),
        ("Units: ft\nx,z\n0.0,1.5\n0.5,1.5\n", 1, r"'Units: ft' speaks of units.*on_unit="),
        ("# Einheit ft\nx [m],z\n0,1\n1,1\n", 1, "speaks of units.* pass elevation_unit=$"),
        ("Road;A12\ns;l\nx;z\n1;0\n1;0\n", 5, "station 1.0 does not increase"),
        ("x,z\n1.0,1.0\n", 2, "one sample; a profile needs at least 2"),
        ("1.0\n2.0\n", 1, "'1.0' is one column at delimiter whitespace"),
        ("1,5,2,5\n2,5,3,5\n", 1, r"several readings: .*delimiter=.*decimal="),
        ("s,z\n1,5,2,5\n2,5,3,5\n", 2, "several readings"),
        ("s,z,left\n0.0,2.5\n", 1, r"names is 3 \(s, z, left\), of columns below it 2"),
        ("0.0,0\n0.1,0\n0.2,0\n50.0,0\n", 4, "gap of 49.8 m .* pass spacing="),
    ],
)
def test_the_line_is_blamed(
    write: Callable[..., Path], content: str, line: int, message: str
) -> None:
    path = write(content)
    with pytest.raises(FormatError, match=message) as caught:
        read_profile(path)
    assert (caught.value.line, caught.value.path) == (line, str(path))
    assert str(caught.value).startswith(f"{path}, line {line}: ")


@pytest.mark.parametrize(
    ("content", "options", "message"),
    [
        ("x [m],z [m]\n0,1\n1,2\n", {"elevation_unit": "mm"}, "'mm' contradicts the header, .m."),
        ("x [yd],z [m]\n0,1\n1,2\n", {}, r"station unit \[yd\] .* none of m, cm.*station_unit="),
        ("0;1,234\n1;2,345\n", {}, "could be a decimal mark or group thousands; pass decimal="),
        ("0;1,5\n1;2.5\n", {}, "'1,5' beside '2.5' could be a decimal mark"),
        ("z,x\n0,1\n1,1.1\n", {"columns": (0, 0)}, "twice the same column"),
        ("z,x\n0,1\n1,1.1\n", {"columns": ("y", "z")}, "'y' is 0 of the file's columns.* named z"),
        ("0,1\n1,1.1\n", {"columns": (0, 2)}, "2 is 0 of the file's columns.* 0 to 1, no header"),
        ("z,s,x\n0,1,2\n1,2,3\n", {}, r"which of 3 columns \(z, s, x\)"),
        ("0,1,2\n1.5,2,3\n", {}, "which of 3 columns without a header"),
        ("0.0,1.0\n", {"delimiter": ";"}, "one column at delimiter semicolon"),
        ("", {}, "empty or cut short"),
        ("\n \r\n", {}, "empty or cut short"),
        ("# only\nx,z\n", {}, "empty or cut short"),
        ("0.0,1.0\n1.0,1.0\n", {"skip": 5}, "empty or cut short"),
        (b"\xff\xfe0\x00,\x001\x00", {}, "UTF-16"),
        (b"0,1\n1,\x00\x01", {}, "byte 6: is not text: it holds the control byte 0x00"),
        ("0 0\n0.5 1e308\n1 1\n", {}, "slope of inf rms"),
        ("-1e308,0\n1e308,0\n", {"elevation_unit": "m", "station_unit": "m"}, "longer than"),
        ("0,0\n1e308,0\n", {"elevation_unit": "m", "station_unit": "km"}, r"x\[1\] is inf"),
    ],
)
def test_files_that_are_refused(
    write: Callable[..., Path], content: str | bytes, options: dict[str, object], message: str
) -> None:
    with pytest.raises(FormatError, match=message):
        read_profile(write(content), **options)


def test_options_decide_between_readings(write: Callable[..., Path]) -> None:
    path = write("0;1,234\n1;2,345\n")
    units = {"station_unit": "m", "elevation_unit": "m"}
    assert read_profile(path, decimal=",", **units).z.tolist() == [1.234, 2.345]
    path = write("1,5,2,5\n2,5,3,5\n")
    assert read_profile(path, delimiter=",", columns=(0, 3)).x.tolist() == [1.0, 2.0]
    named = read_profile(write("s,z,lane,run\n1,5,2,5\n2,5,3,5\n"))  # names settle it
    assert named.z.tolist() == [5.0, 5.0]


def test_elevations_that_cannot_be_metres_are_refused(write: Callable[..., Path]) -> None:
    road = Profile.iso8608("B", length=100.0, spacing=0.25, seed=1)
    rows = "".join(f"{x},{1000.0 * z}\n" for x, z in zip(road.x, road.z, strict=True))
    with pytest.raises(FormatError, match=r"slope of .* rms .*pass station_unit= and elevation_"):
        read_profile(write(rows))
    with pytest.raises(FormatError, match=r"pass elevation_unit=$"):
        read_profile(write("x [m],z\n" + rows))
    profile = read_profile(write(rows), station_unit="m", elevation_unit="mm")
    np.testing.assert_allclose(profile.z, road.z, rtol=1e-12)

    mountain = "".join(f"{x},{0.2 * x}\n" for x in range(1000))
    with pytest.raises(FormatError, match=r"a range of 199\.8 m over 999 m"):
        read_profile(write(mountain))
    assert read_profile(write("station_m,elevation_m\n" + mountain)).z[-1] == pytest.approx(199.8)


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ({"delimiter": "|"}, "delimiter must be one of"),
        ({"decimal": ";"}, "decimal must be"),
        ({"delimiter": ",", "decimal": ","}, "cannot both be ','"),
        ({"station_unit": "yd"}, "station_unit must be one of m, cm, .* got 'yd'"),
        ({"spacing": 0.0}, "spacing must be 'median', 'file' or positive"),
        ({"spacing": "mean"}, "spacing must be 'median', 'file' or positive"),
        ({"spacing": 9.0}, "gives 0.1111 steps"),
        ({"skip": -1}, "skip must be at least 0"),
        ({"skip": "1"}, "skip must be at least 0 lines, got '1'"),
        ({"step": 0.0}, r"step must be positive \(m\), got 0.0"),
        ({"step": "1"}, "step must be positive"),
        ({"step": 1.0, "station_unit": "ft"}, "step is in m, so that station_unit='ft' has no"),
    ],
)
def test_options_are_checked(
    write: Callable[..., Path], option: dict[str, object], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        read_profile(write("0.0,0.5\n1.0,0.5\n"), **option)


def test_missing_file_directory_and_suffix(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"none\.csv"):
        read_profile(tmp_path / "none.csv")
    folder = tmp_path / "folder.csv"
    folder.mkdir()
    with pytest.raises(FormatError, match="is a directory"):
        read_profile(folder)
    with pytest.raises(FormatError, match=r"suffix '.xlsx' .* supported are .*\.csv, .*\.txt"):
        read_profile(tmp_path / "site.xlsx")


# --- properties -------------------------------------------------------------------------------

elevations = st.floats(-1e4, 1e4, allow_subnormal=False)


@same_file
@given(
    start=st.floats(-1e5, 1e5),
    steps=st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=30),
    data=st.data(),
)
def test_csv_round_trip_is_exact(
    tmp_path: Path, start: float, steps: list[float], data: st.DataObject
) -> None:
    x = start + np.cumsum([0.0, *steps])
    z = data.draw(st.lists(elevations, min_size=x.size, max_size=x.size))
    profile = Profile(x, z, name="round")
    profile.to_csv(tmp_path / "round.csv")
    assert read_profile(tmp_path / "round.csv", spacing="file") == profile


@same_file
@given(z=st.lists(elevations, min_size=2, max_size=30), spacing=st.floats(1e-2, 10.0))
def test_csv_round_trip_of_uniform_stations_needs_no_option(
    tmp_path: Path, z: list[float], spacing: float
) -> None:
    profile = Profile(spacing * np.arange(len(z)), z, name="round")
    profile.to_csv(tmp_path / "round.csv")
    assert read_profile(tmp_path / "round.csv") == profile


tokens = st.sampled_from(
    [
        "0",
        "1",
        "2.5",
        "3,5",
        "-4",
        "1e400",
        "1e-320",
        "nan",
        "x",
        "z [mm]",
        "m",
        ",",
        ";",
        "\t",
        " ",
        "\n",
        "\r\n",
        "#",
        "%",
        '"',
        ".",
        "\x0b",
        "\x85",
        "\ufeff",
        "1_0",
        "٣",
        "0x1",
        "é",
    ]
)


@pytest.mark.filterwarnings("error")
@settings(same_file, max_examples=400)
@given(content=st.binary(max_size=80) | st.lists(tokens, max_size=40).map("".join))
def test_any_content_is_a_profile_or_a_format_error(tmp_path: Path, content: bytes | str) -> None:
    path = tmp_path / "any.txt"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    try:
        profile = read_profile(path)
    except FormatError as error:
        found = error.path
    else:
        found = str(path) if profile.is_uniform else None
    assert found == str(path)


# --- measured profiles and size ---------------------------------------------------------------


@needs_iri_sorel
def test_measured_profile() -> None:
    profile = read_profile(IRI_SOREL / "profile_1.txt")
    assert profile.x.size == 2177 and profile.x[0] == 478.0 and profile.length == 544.0
    assert profile.spacing == 0.25 and profile.is_uniform
    assert (profile.z[0], profile.z[-1]) == (583.1370, 583.0498)
    assert (source_of(profile).delimiter, source_of(profile).stations) == (" ", "as read")


@needs_iri_sorel
def test_measured_profile_at_irregular_spacing() -> None:
    uniform = read_profile(IRI_SOREL / "profile_1.txt")
    profile = read_profile(IRI_SOREL / "profile_2.txt", spacing=0.25)
    assert profile.x.size == 2177 and profile.is_uniform
    assert source_of(profile).resampled_from == pytest.approx((0.0246, 0.4938))
    assert np.abs(profile.z - uniform.z).max() < 0.01  # the same road, twice interpolated
    assert read_profile(IRI_SOREL / "profile_2.txt").spacing == pytest.approx(0.2395)


def test_a_hundred_kilometres_read_in_seconds(write: Callable[..., Path]) -> None:
    """2 million rows take about 2 s; the limit leaves room for a slow machine."""
    rows = "".join(f"{i * 0.05:.2f};{(i % 7) * 0.001:.3f}\n" for i in range(2_000_001))
    path = write("station [m];elevation [m]\n" + rows)
    begin = time.perf_counter()
    profile = read_profile(path)
    assert time.perf_counter() - begin < 20.0
    assert profile.length == pytest.approx(100e3) and profile.x.size == 2_000_001
