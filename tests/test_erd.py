"""ERD files and profiles with several tracks: what is read, what is written, what is refused."""

from __future__ import annotations

import copy
import pickle
import struct
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pavefem.errors import FormatError
from pavefem.formats import read_profile
from pavefem.formats.tracks import track_of
from pavefem.profile import Profile, ProfileSource

LTPP = """ERDFILEV2.00
      3,      4,     -1,      1,      5,       0.0250,     -1,
TITLE   LTPP SPS Section 06B410SF: Run 1
SHORTNAMLElev.  RElev.  CElev.
UNITSNAMmm      mm      mm
XLABEL  Distance
XUNITS  m
DATE    11/Apr/1997
 Section No: 06B410

END
   0.00    1.00    2.00
  -0.50    1.25    2.00
  -1.00    1.50    2.00
  -1.50    1.75    2.50
"""
"""Header as in LTPP's files (25 mm samples, mm), with numbers of our own."""


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write text or bytes to a file and return its path."""

    def _write(content: str | bytes, name: str = "site.erd") -> Path:
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return _write


def header(
    channels: int = 1, samples: int = 3, key: int = 5, keywords: str = "", records: str = "-1, 1"
) -> bytes:
    """Return a header whose elevations are in m, every 0.25 m."""
    units = "UNITSNAM" + "m       " * channels
    line = f"{channels}, {samples}, {records}, {key}, 0.25, -1,"
    return f"ERDFILEV2.00\n{line}\n{units}\nXUNITS  m\n{keywords}END\n".encode()


def source_of(profile: Profile) -> ProfileSource:
    assert profile.source is not None
    return profile.source


# --- a profile with several tracks ------------------------------------------------------------


def two_tracks(name: str = "site") -> Profile:
    x, left = 0.25 * np.arange(9), np.linspace(0.0, 0.02, 9)
    return Profile(x, left, name, tracks={"left": left, "right": left[::-1]})


def test_first_track_is_z_and_each_can_be_taken() -> None:
    profile = two_tracks()
    assert list(profile.tracks) == ["left", "right"]
    assert profile.tracks["left"] is profile.z
    assert not profile.tracks["right"].flags.writeable
    assert repr(profile).endswith("0 to 2 m every 0.25 m, tracks left, right)")
    right = profile.track("right")
    assert right == Profile(profile.x, profile.z[::-1], "site, right")
    assert not right.tracks
    with pytest.raises(ValueError, match=r"track 'mid' is not in .* tracks left, right"):
        profile.track("mid")
    with pytest.raises(ValueError, match="one track, without a name"):
        right.track("right")
    with pytest.raises(TypeError):
        profile.tracks["left"] = right.z  # type: ignore[index]


def test_tracks_follow_slices_and_resampling() -> None:
    profile = two_tracks()
    cut, fine = profile.slice(0.5, 1.0), profile.resample(0.125)
    assert cut.track("right").z.tolist() == profile.z[::-1][2:5].tolist()
    np.testing.assert_allclose(fine.tracks["right"], fine.z[::-1], atol=1e-17)


def test_tracks_count_in_equality_and_survive_copies() -> None:
    profile = two_tracks()
    alone = Profile(profile.x, profile.z, "site")
    other = Profile(profile.x, profile.z, "site", tracks={"left": profile.z, "right": profile.z})
    renamed = Profile(profile.x, profile.z, "site", tracks={"left": profile.z, "r": profile.z})
    assert profile == two_tracks()
    assert hash(profile) == hash(two_tracks())
    assert len({profile, alone, other, renamed}) == 4
    for clone in (copy.deepcopy(profile), pickle.loads(pickle.dumps(profile))):
        assert clone == profile
        assert not clone.tracks["right"].flags.writeable


@pytest.mark.parametrize(
    ("tracks", "message"),
    [
        ({"left": [0.0, 1.0], "right": [0.0]}, "track 'right' has 1 values and z has 2"),
        ({"left": [0.0, 2.0]}, "z must be the first track, 'left'"),
        ({"left": [0.0, 1.0], "right": [0.0, np.nan]}, r"track 'right'\[1\] is nan"),
        ({"": [0.0, 1.0]}, "name of a track must be printable text, got ''"),
        ({" left": [0.0, 1.0]}, "got ' left'"),
        ({"a\nb": [0.0, 1.0]}, "name of a track"),
    ],
)
def test_tracks_are_checked(tracks: dict[str, list[float]], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Profile([0.0, 1.0], [0.0, 1.0], tracks=tracks)


@pytest.mark.parametrize(
    ("name", "track"),
    [
        ("Left Elevation", "left"),
        ("RElev.", "right"),
        ("left_elevation", "left"),
        ("Right Profile", "right"),
        ("Höhe rechts", "right"),
        ("Center wheel path", "center"),
        ("L", "left"),
        ("elevation", ""),
        ("Profile elevation", ""),
        ("elevation right of left track", ""),
        ("Left IRI", None),
        ("profile", None),
        ("Velocity", None),
    ],
)
def test_names_of_tracks(name: str, track: str | None) -> None:
    assert track_of(name) == track


# --- tracks in text ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    "content",
    [
        "Distance (ft),Left Elevation (in),Right Elevation (in)\n0.0,1.0,2.0\n1.0,1.5,2.5\n",
        "Distance (feet),Right Elevation (in),Left Elevation (inches)\n0,2.0,1.0\n1,2.5,1.5\n",
        "Station [ft];Höhe links [in];Höhe rechts [in]\n0,0;1,0;2,0\n1,0;1,5;2,5\n",
        "Weg [ft];links [mil];rechts [in];Bemerkung\n0,0;1000;2,0;Fuge\n1,0;1500;2,5;\n",
        "Distance [ft]\tLElev [in]\tRElev [in]\tLeft IRI [in/mi]\n0\t1\t2\t90\n1\t1.5\t2.5\t90\n",
    ],
)
def test_both_wheel_paths_of_a_text_file(write: Callable[..., Path], content: str) -> None:
    profile = read_profile(write(content, "site.csv"))
    assert list(profile.tracks) == ["left", "right"]
    np.testing.assert_allclose(profile.x, [0.0, 0.3048])
    np.testing.assert_allclose(profile.z, [0.0254, 0.0381])
    np.testing.assert_allclose(profile.track("right").z, [0.0508, 0.0635])
    right = source_of(profile.track("right"))
    assert len(right.columns) == 2
    assert right.units == ("ft", "in")


def test_tracks_of_a_text_file_by_option(write: Callable[..., Path]) -> None:
    path = write("s,z wet,z dry\n0.0,0.5,1.0\n1.0,0.5,1.0\n", "a.csv")
    with pytest.raises(FormatError, match="which of 3 columns"):
        read_profile(path)
    profile = read_profile(path, columns=("s", "z dry", "z wet"))
    assert list(profile.tracks) == ["z dry", "z wet"]
    assert profile.z.tolist() == [1.0, 1.0]
    path = write("0.0 0.5 1.0\n1.0 0.5 1.0\n", "a.txt")
    assert list(read_profile(path, columns=(0, 1, 2)).tracks) == ["track 1", "track 2"]


@pytest.mark.parametrize(
    ("content", "options", "message"),
    [
        ("s,z left,z right\n0.0,1.0,1.0\n1.0,1.0,x\n", {}, "line 3: right elevation 'x' is not"),
        ("s,z left,z right\n0.0,1.0,1.0\n1.0,1.0,inf\n", {}, "line 3: right elevation is inf"),
        ("s,z left,z right,z\n0.0,1.0,1.0,1.0\n", {}, "which of 4 columns"),
        ("s,z left,left\n0.0,1.0,1.0\n", {}, "which of 3 columns"),
        ("s,z left,z right\n0.0,1.0,1.0\n1.0,1.0,9.0\n", {}, "slope of 8 rms .*elevation_unit="),
        ("s,z\n0.0,1.0\n", {"columns": (0,)}, "must be a station and at least one elevation"),
        ("s,z\n0.0,1.0\n", {"columns": (0, 1, 1)}, "twice the same column"),
    ],
)
def test_damaged_tracks_of_a_text_file(
    write: Callable[..., Path], content: str, options: dict[str, object], message: str
) -> None:
    with pytest.raises(FormatError, match=message):
        read_profile(write(content, "a.csv"), **options)


def test_csv_keeps_all_tracks(tmp_path: Path) -> None:
    profile = two_tracks("round")
    profile.to_csv(tmp_path / "round.csv")
    assert read_profile(tmp_path / "round.csv") == profile


# --- ERD: what is understood ------------------------------------------------------------------


def test_ltpp_layout(write: Callable[..., Path]) -> None:
    profile = read_profile(write(LTPP))
    assert profile.name == "LTPP SPS Section 06B410SF: Run 1"
    assert profile.x.tolist() == [0.0, 0.025, 0.05, 0.025 * 3]
    assert list(profile.tracks) == ["left", "right", "center"]
    np.testing.assert_allclose(profile.z, [0.0, -0.5e-3, -1e-3, -1.5e-3])
    np.testing.assert_allclose(profile.track("center").z, [2e-3, 2e-3, 2e-3, 2.5e-3])
    source = source_of(profile)
    assert source.columns == (-1, 0, 1, 2)
    assert source.header == ("LElev.", "RElev.", "CElev.")
    assert source.units == ("m", "mm", "mm", "mm")
    assert source.rows == 4
    assert source_of(profile.track("right")).columns == (-1, 1)


@pytest.mark.parametrize(
    ("xunits", "step"), [("m", 0.025), ("mm", 25.0), ("ft", 0.025 / 0.3048), ("in", 0.025 / 0.0254)]
)
def test_a_section_of_ltpp_at_full_length(
    write: Callable[..., Path], xunits: str, step: float
) -> None:
    """6295 samples of 25 mm, as its files have; the units of channels and of XUNITS are free."""
    z = np.round(np.random.default_rng(4).normal(0.0, 5.0, (6295, 3)), 2)  # mm
    content = LTPP[: LTPP.index("   0.00")].replace("      4,", "   6295,")
    content = content.replace("0.0250", f"{step:.12g}").replace("XUNITS  m", f"XUNITS  {xunits}")
    content = content.replace("UNITSNAMmm      mm      mm", "UNITSNAMmm      in      mil")
    rows = z / [1.0, 25.4, 0.0254]
    content += "".join("".join(f"{number:12.6f}" for number in row) + "\n" for row in rows)
    profile = read_profile(write(content))
    assert profile.x.size == 6295 and profile.is_uniform
    np.testing.assert_allclose(profile.x, 0.025 * np.arange(6295), rtol=1e-11)
    for track, expected in zip(("left", "right", "center"), z.T, strict=True):
        np.testing.assert_allclose(profile.track(track).z, expected * 1e-3, atol=2e-8)
    source = source_of(profile)
    assert source.units == (xunits, "mm", "in", "mil")
    assert source.units_from == ("header",) * 4
    assert profile.summary()["format"] == "ERD, text numbers"
    path = write(content[: -len("x" * 36)], "cut.erd")
    with pytest.raises(FormatError, match=r"cut short: 18882 numbers .* 6295 samples of 3"):
        read_profile(path)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends_and_the_end_of_file_mark_of_dos(write: Callable[..., Path], end: str) -> None:
    expected = read_profile(write(LTPP))
    assert read_profile(write(LTPP.replace("\n", end) + "\x1a", "dos.ERD")) == expected


def test_feet_inches_and_a_right_track_first(write: Callable[..., Path]) -> None:
    keywords = (
        "LONGNAMERight Elevation                 Left Elevation\n"
        "UNITSNAMin      in\nXUNITS  ft\nXSTART  100.0\n"
    )
    content = f"ERDFILEV2.00\n2, -1, -1, 1, 5, 0.5\n{keywords}END\n1.0D0, 2.0\n1.5, 2.5\n"
    profile = read_profile(write(content))
    assert list(profile.tracks) == ["left", "right"]
    assert profile.name == "site"
    np.testing.assert_allclose(profile.x, [30.48, 30.48 + 0.1524])
    np.testing.assert_allclose(profile.z, [2 * 0.0254, 2.5 * 0.0254])
    assert source_of(profile).columns == (-1, 1, 0)


def test_channels_by_name_and_by_number(write: Callable[..., Path]) -> None:
    content = header(3, 2, keywords="SHORTNAMLElev.  Speed   RElev.\n") + b"1 20 3\n1 20 3\n"
    content = content.replace(b"m       m       m", b"m       m/s     m")
    profile = read_profile(write(content))
    assert list(profile.tracks) == ["left", "right"]
    assert source_of(profile).columns == (-1, 0, 2)
    for channels in (["right"], ["relev."], [2]):
        profile = read_profile(write(content), channels=channels)
        assert profile.z.tolist() == [3.0, 3.0]
        assert not profile.tracks
    assert list(read_profile(write(content), channels=[2, 0]).tracks) == ["right", "left"]


def test_lines_may_hold_several_samples(write: Callable[..., Path]) -> None:
    names = "SHORTNAMLElev.  RElev.\n"
    content = header(2, 5, keywords=names) + b"1 2 3 4\n5 6 7 8\n9 10\n"
    profile = read_profile(write(content))
    assert profile.z.tolist() == [1.0, 3.0, 5.0, 7.0, 9.0]


@pytest.mark.parametrize("inside", [True, False])
@pytest.mark.parametrize("order", ["<", ">"])
def test_reals(write: Callable[..., Path], inside: bool, order: str) -> None:
    names = "SHORTNAMLElev.  RElev.\n"
    numbers = np.array([[1.0, 2.0], [1.5, 2.5], [-1.0, 0.25]])
    head, data = header(2, 3, 1, names), numbers.astype(order + "f4").tobytes()
    path = write(head + data if inside else head)
    if not inside:
        write(data, "site.bin")
    byte_order = {"<": "little", ">": "big"}[order]
    profile = read_profile(path, byte_order=byte_order)
    assert [z.tolist() for z in profile.tracks.values()] == numbers.T.tolist()


def test_integers_with_gain_and_offset(write: Callable[..., Path]) -> None:
    keywords = "GAIN    0.5 0.001\nOFFSET  0, 1.0\nSHORTNAMLElev.  RElev.\n"
    data = struct.pack("<6h", 4, 1000, -4, -1000, 0, 32767)
    profile = read_profile(write(header(2, -1, 0, keywords) + data))
    np.testing.assert_allclose(profile.z, [2.0, -2.0, 0.0])
    np.testing.assert_allclose(profile.track("right").z, [2.0, 0.0, 33.767])


@pytest.mark.parametrize("records", ["3, 4", "2, 8", "1, 16", "1, 12", "-1, -1"])
def test_binary_records(write: Callable[..., Path], records: str) -> None:
    """Three samples of 4 bytes, the last record padded."""
    size = max(12, int(np.prod([int(n) for n in records.split(",")])))
    data = struct.pack("<3f", 1.0, 2.0, 3.0).ljust(size, b"\0")
    profile = read_profile(write(header(1, 3, 1, records=records) + data))
    assert profile.z.tolist() == [1.0, 2.0, 3.0]


def test_continued_keyword_and_unknown_ones(write: Callable[..., Path]) -> None:
    keywords = "SHORTNAMLElev.  \n&1000   RElev.\nPROFINSTDipstick\nHISTORY a\nHISTORY b\n"
    assert list(read_profile(write(header(2, 2, 5, keywords) + b"0 0\n0 0\n")).tracks) == [
        "left",
        "right",
    ]


def test_units_by_option(write: Callable[..., Path]) -> None:
    content = b"ERDFILEV2.00\n1, 3, -1, 1, 5, 1.0, -1\nEND\n0\n12\n24\n"
    with pytest.raises(FormatError, match=r"slope of 12 rms .*station_unit= and elevation_unit="):
        read_profile(write(content))
    profile = read_profile(write(content), station_unit="ft", elevation_unit="mil", name="run 3")
    np.testing.assert_allclose(profile.x, 0.3048 * np.arange(3))
    np.testing.assert_allclose(profile.z, 12 * 25.4e-6 * np.arange(3))
    assert profile.name == "run 3"
    assert source_of(profile).units_from == ("option", "option")


# --- ERD: what is refused, and why ------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("ERDFILEV2.00", "ERDFILE", 1, "an ERD file starts with ERDFILEV2.00"),
        ("      3,   ", "    3.5,  ", 2, "NCHAN '3.5' is not an integer"),
        ("      3,   ", "    " + "9" * 5000 + ",", 2, "NCHAN '9999.* is not an integer"),
        ("      3,   ", "      0,  ", 2, "NCHAN is 0, must be 1 to 10000"),
        ("      3,   ", "  99999,  ", 2, "NCHAN is 99999, must be"),
        ("      4,   ", "      1,  ", 2, "NSAMP is 1; a profile needs at least 2"),
        ("      4,   ", "     -2,  ", 2, "NSAMP is -2"),
        ("      4,   ", "1000000000000,", 2, "cut short: .* 1000000000000 samples of 3"),
        ("      5,   ", "      7,  ", 2, "KEYNUM is 7; supported are 0"),
        ("0.0250", "abc", 2, "STEP 'abc' is not a finite number"),
        ("0.0250", "-0.025", 2, "STEP is -0.025; a profile needs a positive distance"),
        ("0.0250", "1e999", 2, "STEP '1e999' is not a finite number"),
        ("     0.0250,     -1,", "", 2, "5 numbers; NCHAN, .* are needed"),
        ("DATE ", "GAIN ", 8, "GAIN has 1 numbers, not 3"),
        ("DATE    11/Apr/1997", "OFFSET  1 2 x", 8, "OFFSET 'x' is not a finite number"),
        ("DATE    11/Apr/1997", "XSTART  here", 8, "XSTART 'here' is not a finite number"),
        ("  -0.50 ", "  -0.5O ", 13, "'-0.5O' is not a finite number"),
        ("  -0.50 ", "    nan ", 13, "'nan' is not a finite number"),
        ("  -0.50 ", "        ", 13, "2 numbers, lines before it have 3"),
        ("  -0.50 ", "  1  2 3", 13, "5 numbers, lines before it have 3"),
        ("    1.75    2.50", "    1.75", 15, "cut short: 11 numbers .* 4 samples of 3 channels"),
        ("   2.50\n", "   2.50\n1 1 1\n", 16, "damaged: 15 numbers .* 4 samples of 3 channels"),
    ],
)
def test_the_line_is_blamed(
    write: Callable[..., Path], old: str, new: str, line: int, message: str
) -> None:
    assert old in LTPP
    path = write(LTPP.replace(old, new, 1))
    with pytest.raises(FormatError, match=message) as caught:
        read_profile(path)
    assert (caught.value.line, caught.value.path) == (line, str(path))


TWO = "SHORTNAMLElev.  RElev.\n"


@pytest.mark.parametrize(
    ("content", "place", "message"),
    [
        (header(2, 3, 1, TWO) + bytes(23), 23, "cut short: 23 bytes .* samples of 8 bytes are 24"),
        (header(2, 3, 1, TWO) + bytes(32), 24, "32 bytes of numbers, 3 samples of 8 bytes are 24"),
        (header(2, -1, 1, TWO) + bytes(20), 16, "20 bytes .* no whole number, 2 or more"),
        (header(2, 10**12, 1, TWO) + bytes(24), 24, "cut short: .* 1000000000000 samples"),
        (header(2, 2, 1, TWO) + struct.pack("<4f", 0, 0, np.nan, 0), 8, "sample 1 is nan"),
        (header(2, 3, 1, TWO), 0, r"numbers, site\.bin, is missing"),
        (header(2, 3, 5, TWO) + b"1 2\n1 \x012\n3 4\n", 6, "control byte 0x01"),
        (header(1, 3, 5, "TITLE   R\0n\n"), -7, "control byte 0x00"),
    ],
)
def test_the_byte_is_blamed(
    write: Callable[..., Path], content: bytes, place: int, message: str
) -> None:
    """Each byte is counted from the end of the header."""
    with pytest.raises(FormatError, match=message) as caught:
        read_profile(write(content))
    assert caught.value.byte == content.index(b"END\n") + 4 + place


def test_the_file_of_binary_numbers_is_blamed(write: Callable[..., Path]) -> None:
    path = write(header(1, 3, 1))
    beside = write(bytes(11), "site.bin")
    with pytest.raises(FormatError, match="cut short") as caught:
        read_profile(path)
    assert (caught.value.path, caught.value.byte) == (str(beside), 11)


@pytest.mark.parametrize(
    ("content", "options", "message"),
    [
        (b"", {}, "line is b''; an ERD file starts"),
        (b"PK\x03\x04" + bytes(50), {}, "an ERD file starts"),
        (header(1, -1)[:-1], {}, "line 5: cut short: 0 numbers"),
        (b"ERDFILEV2.00\n1, 3", {}, "no line END in the first 17 bytes: .* cut short"),
        (b"ERDFILEV2.00\n" + b"x" * 2_000_000 + b"\nEND\n", {}, "longer than 1000000 bytes"),
        (b"ERDFILEV2.00\nEND\n", {}, "1 numbers; NCHAN"),
        (header() + b"\n", {}, "cut short"),
        (header(2) + b"1 2\n1 2\n1 2\n", {}, r"which of 2 channels \(without a name, without"),
        (header(3, -1) + b"1 2\n1 2\n1 2\n", {"channels": [0]}, "damaged: 6 .*, 2 in a line"),
        (header() + b"1\n1\n1\n", {"channels": ["left"]}, "'left' is 0 of the file's channels"),
        (header() + b"1\n1\n1\n", {"channels": [1]}, "1 is 0 of .* 0 to 0"),
        (header(2) + b"1 2\n1 2\n1 2\n", {"channels": [0, 0]}, "same channel twice"),
        (header().replace(b"UNITS  m", b"UNITS  s") + b"1\n1\n1\n", {}, r"station unit \[s\]"),
        (header().replace(b"NAMm", b"NAMg") + b"1\n1\n1\n", {}, r"elevation unit \[g\]"),
        (header() + b"1\n1\n1\n", {"elevation_unit": "mm"}, "contradicts the header"),
        (header(1, 3, 1) + struct.pack(">3f", 1.1, 2.2, 3.3), {}, "pass byte_order="),
        (header(1, 3, 1, records="3, 5") + bytes(15), {}, "NBYTES is 5: records of 5 bytes"),
        (header(keywords="XSTART  1e300\n") + b"1\n1\n1\n", {}, r"x\[1\] = 1e\+300 does not incr"),
        (header().replace(b"0.25", b"1e308") + b"1\n" * 3, {}, "longer than a float|is inf"),
    ],
)
def test_files_that_are_refused(
    write: Callable[..., Path], content: bytes, options: dict[str, object], message: str
) -> None:
    path = write(content)
    with pytest.raises(FormatError, match=message) as caught:
        read_profile(path, **options)
    assert caught.value.path == str(path)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"byte_order": "middle"}, "byte_order must be 'little' or 'big'"),
        ({"station_unit": "yd"}, "station_unit must be one of m, cm"),
        ({"channels": []}, "channels must be numbers or names, one or more"),
        ({"channels": "left"}, "channels must be numbers or names"),
    ],
)
def test_options_are_checked(
    write: Callable[..., Path], options: dict[str, object], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        read_profile(write(LTPP), **options)


def test_missing_file_and_directory(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"none\.erd"):
        read_profile(tmp_path / "none.erd")
    (tmp_path / "folder.erd").mkdir()
    with pytest.raises(FormatError, match="is a directory"):
        read_profile(tmp_path / "folder.erd")


# --- ERD: written -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "profile",
    [
        two_tracks(),
        Profile.iso8608("B", length=100.0, seed=1),
        Profile.iso8608("C", length=50.0, spacing=0.0254).slice(10.16, 20.32),
        Profile.smooth(25.0),
    ],
    ids=lambda profile: profile.name,
)
def test_erd_round_trip(tmp_path: Path, profile: Profile) -> None:
    profile.to_erd(tmp_path / "a.erd")
    back = read_profile(tmp_path / "a.erd")
    assert back.name == profile.name
    assert list(back.tracks) == list(profile.tracks)
    assert np.array_equal(back.z, profile.z)
    np.testing.assert_allclose(back.x, profile.x, rtol=1e-14)
    text = (tmp_path / "a.erd").read_text(encoding="utf-8")
    assert text.startswith("ERDFILEV2.00\n")
    assert "UNITSNAMm" in text
    assert "XUNITS  m\n" in text


def test_stations_of_a_generated_profile_come_back_exactly(tmp_path: Path) -> None:
    profile = Profile.iso8608("B", length=500.0, seed=1)
    profile.to_erd(tmp_path / "a.erd")
    assert read_profile(tmp_path / "a.erd") == profile


def test_tracks_of_any_name(tmp_path: Path) -> None:
    z = np.zeros(3)
    tracks = {"laser 7": z, "a name that takes all 32 columns": z + 0.5}
    profile = Profile([0.0, 1.0, 2.0], z, "a; b\n c", tracks=tracks)
    profile.to_erd(tmp_path / "a.erd")
    with pytest.raises(FormatError, match="which of 2 channels"):
        read_profile(tmp_path / "a.erd")
    back = read_profile(tmp_path / "a.erd", channels=[0, 1])
    assert list(back.tracks) == list(tracks)
    assert back.name == "a; b c"
    with pytest.raises(ValueError, match="longer than 32 characters"):
        Profile([0, 1], [0, 0], tracks={"x" * 33: [0, 0]}).to_erd(tmp_path / "b.erd")
    assert not (tmp_path / "b.erd").exists()


def test_irregular_stations_are_not_written(tmp_path: Path) -> None:
    profile = Profile([0.0, 0.1, 0.3], np.zeros(3))
    with pytest.raises(ValueError, match=r"irregular .* write profile\.resample\(spacing\)"):
        profile.to_erd(tmp_path / "a.erd")


# --- properties and size ----------------------------------------------------------------------

elevations = st.floats(-1e4, 1e4, allow_subnormal=False)


@given(
    z=st.lists(st.tuples(elevations, elevations), min_size=2, max_size=30),
    start=st.floats(-1e5, 1e5),
    spacing=st.floats(1e-2, 10.0),
)
def test_elevations_come_back_exactly(
    tmp_path: Path, z: Sequence[tuple[float, float]], start: float, spacing: float
) -> None:
    left, right = np.array(z).T
    x = start + spacing * np.arange(len(z))
    profile = Profile(x, left, "round", tracks={"left": left, "right": right})
    for name in ("round.erd", "round.csv"):
        getattr(profile, f"to_{name[-3:]}")(tmp_path / name)
        back = read_profile(tmp_path / name)
        assert list(back.tracks) == ["left", "right"]
        assert np.array_equal(back.z, left)
        assert np.array_equal(back.tracks["right"], right)
        np.testing.assert_allclose(back.x, x, rtol=1e-12, atol=1e-9)


VALID: list[bytes] = [
    LTPP.encode(),
    header(1, 4, 1) + np.arange(4, dtype="<f4").tobytes(),
    header(2, -1, 0, "GAIN    1 1\nSHORTNAMLElev.  RElev.\n") + np.arange(8, dtype="<i2").tobytes(),
    header(1, -1, 5, "XSTART  7\n&1000   0\n") + b"1.0D-1 2\n3 4\n5\n",
]

edits = st.lists(
    st.tuples(
        st.integers(0, 400),
        st.integers(0, 8),
        st.binary(max_size=6)
        | st.sampled_from([b"\n", b"\r", b" ", b",", b"-1", b"999999999999", b"1e400", b"END\n"])
        | st.sampled_from([b"nan", b"\x85", b"\xa0", b"\x0b", b"\x1a", b"&", b"1_0", b"0x1", b"5"]),
    ),
    min_size=1,
    max_size=6,
)


def check_any_content(path: Path, content: bytes) -> None:
    """Check that `content` is a whole profile, or an error that names the file."""
    path.write_bytes(content)
    profile, blamed = None, str(path)
    try:
        profile = read_profile(path)
    except FormatError as error:
        blamed = str(error.path)
    assert blamed == str(path)
    assert profile is None or all(np.isfinite(z).all() for z in profile.tracks.values())


@settings(max_examples=500)
@given(valid=st.sampled_from(VALID), changes=edits)
def test_a_damaged_file_is_a_profile_or_a_format_error(
    tmp_path: Path, valid: bytes, changes: list[tuple[int, int, bytes]]
) -> None:
    content = valid
    for place, length, new in changes:
        content = content[:place] + new + content[place + length :]
    check_any_content(tmp_path / "any.erd", content)


@pytest.mark.parametrize("valid", VALID)
def test_a_file_cut_anywhere_is_refused_up_to_its_last_number(tmp_path: Path, valid: bytes) -> None:
    path = tmp_path / "cut.erd"
    for length in range(len(valid)):
        check_any_content(path, valid[:length])
    path.write_bytes(valid)
    whole = read_profile(path)
    for length in range(len(valid) - 6):
        path.write_bytes(valid[:length])
        try:
            assert read_profile(path).x.size < whole.x.size
        except FormatError:
            continue
        assert b", -1, -1, 1," in valid  # the header does not say how many there are


@settings(max_examples=300)
@given(content=st.binary(max_size=200), head=st.sampled_from([b"", b"ERDFILEV2.00\n", *VALID]))
@example(content=b"\x0b,\n", head=header())
@example(content=b"\xc2\xa0\n1\n", head=header())
def test_any_content_is_a_profile_or_a_format_error(
    tmp_path: Path, content: bytes, head: bytes
) -> None:
    check_any_content(tmp_path / "any.erd", head + content)


def test_a_hundred_kilometres_read_in_seconds(write: Callable[..., Path]) -> None:
    """4 million samples of 25 mm in two tracks; the limit leaves room for a slow machine."""
    rows = np.arange(4_000_000) % 7
    content = header(2, 4_000_000, 5, "SHORTNAMLElev.  RElev.\n")
    path = write(content + "".join(f"{z:.3f} {z:.2f}\n" for z in rows.tolist()).encode())
    begin = time.perf_counter()
    profile = read_profile(path)
    assert time.perf_counter() - begin < 30.0
    assert profile.x.size == 4_000_000
    assert profile.track("right").z[-1] == rows[-1]
