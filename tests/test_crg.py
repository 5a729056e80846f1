"""OpenCRG roads: what is read from small files of every encoding, what is refused, real files."""

from __future__ import annotations

import re
import struct
import time
import tracemalloc
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pavefem.errors import FormatError
from pavefem.formats import read_profile
from pavefem.formats.crg import MAX_HEADER, CrgSource, read_crg
from pavefem.profile import Profile

DATA = Path(__file__).parents[2] / "shared" / "data"
OPENCRG, CHRONO = DATA / "opencrg", DATA / "chrono_crg"

needs_opencrg = pytest.mark.skipif(
    not OPENCRG.is_dir(), reason="OpenCRG sample roads not beside the project (shared/data)"
)
needs_chrono = pytest.mark.skipif(
    not CHRONO.is_dir(), reason="proving-ground roads not beside the project (shared/data)"
)

NAN = float("nan")
SECTIONS = ("long section 1,m", "long section 2,m", "long section 3,m")
ROAD = {
    "REFERENCE_LINE_INCREMENT": 0.5,
    "LONG_SECTION_V_RIGHT": -1.0,
    "LONG_SECTION_V_LEFT": 1.0,
}
ROWS = [[0.0, 0.1, 0.3], [0.01, 0.11, 0.31], [0.02, 0.14, 0.32], [0.03, 0.13, 0.33]]
ENCODINGS = ("KRBI", "KDBI", "LRFI", "LDFI")


def crg(
    rows: Sequence[Sequence[float]] = ROWS,
    encoding: str = "LDFI",
    *,
    road: dict[str, float] | None = None,
    channels: Sequence[str] = SECTIONS,
    more: str = "",
    end_of_line: str = "\n",
    end_u: bool = True,
) -> bytes:
    """Make an OpenCRG file; `road` are its parameters, `more` further sections of the header."""
    parameters = dict(ROAD if road is None else road)
    if end_u:
        length = parameters["REFERENCE_LINE_INCREMENT"] * (len(rows) - 1)
        start = parameters.get("REFERENCE_LINE_START_U", 0.0)
        parameters.setdefault("REFERENCE_LINE_END_U", start + length)
    lines = [
        "$CT",
        "made by a test",
        "$",
        "$ROAD_CRG   ! comment",
        *(f"{key} = {value!r}" for key, value in parameters.items()),
        "$!*****",
        *more.splitlines(),
        "$KD_Definition",
        f"#:{encoding} ! comment",
        "* comment",
        *(f"D:{channel}   ! comment" for channel in channels),
        "$",
        "$$$$",
    ]
    header = "".join(line + end_of_line for line in lines).encode("ascii")
    return header + payload(rows, encoding, end_of_line)


def payload(rows: Sequence[Sequence[float]], encoding: str, end_of_line: str = "\n") -> bytes:
    if encoding[0] == "K":
        size, code = (4, "f") if encoding == "KRBI" else (8, "d")
        numbers = [number for row in rows for number in row]
        numbers += [NAN] * (-len(numbers) % (80 // size))
        return struct.pack(f">{len(numbers)}{code}", *numbers)
    width = 10 if encoding == "LRFI" else 20
    per_record = 80 // width
    records = [row[i : i + per_record] for row in rows for i in range(0, len(row), per_record)]
    lines = ("".join(field(number, width) for number in record) for record in records)
    return "".join(line + end_of_line for line in lines).encode("ascii")


def field(number: float, width: int) -> str:
    if np.isnan(number):
        return "*missing*".rjust(width)
    return f"{number: .{width - 3}f}"[:width].rjust(width)


@pytest.fixture
def write(tmp_path: Path) -> Callable[[bytes], Path]:
    def _write(content: bytes) -> Path:
        path = tmp_path / "site.crg"
        path.write_bytes(content)
        return path

    return _write


def source_of(profile: Profile) -> CrgSource:
    assert isinstance(profile.source, CrgSource)
    return profile.source


# --- what is read -----------------------------------------------------------------------------


@pytest.mark.parametrize("end_of_line", ["\n", "\r\n"])
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_every_encoding(write: Callable[[bytes], Path], encoding: str, end_of_line: str) -> None:
    profile = read_profile(write(crg(encoding=encoding, end_of_line=end_of_line)))
    assert profile.x.tolist() == [0.0, 0.5, 1.0, 1.5]
    np.testing.assert_allclose(profile.z, [0.1, 0.11, 0.14, 0.13], rtol=6e-8)
    assert profile.name == "site"
    assert not profile.tracks
    source = source_of(profile)
    assert (source.encoding, source.rows, source.trimmed) == (encoding, 4, (0, 0))
    assert (source.header, source.columns) == (SECTIONS, (-1, 1))
    assert (source.v, source.sections) == ((0.0,), ((0.0, 0.0),))
    assert (source.units, source.units_from) == (("m", "m"), ("default", "header"))


@pytest.mark.parametrize("end_u", [True, False])
@pytest.mark.parametrize("channels", [1, 2, 3, 4, 7, 8, 9, 10, 19, 20, 21, 40, 43])
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_records_wrap(
    write: Callable[[bytes], Path], encoding: str, channels: int, end_u: bool
) -> None:
    rows = np.round(np.random.default_rng(channels).normal(size=(11, channels)), 6)
    content = crg(
        rows.tolist(),
        encoding,
        road={"REFERENCE_LINE_INCREMENT": 0.1, "LONG_SECTION_V_INCREMENT": 0.5},
        channels=[f"long section {i + 1},m" for i in range(channels)],
        end_u=end_u,
    )
    v = 0.5 * (np.arange(channels) - (channels - 1) / 2)
    profile = read_crg(write(content), v=v.tolist())
    tracks = np.array(list(profile.tracks.values()))
    np.testing.assert_allclose(tracks.T, rows, rtol=1e-7, atol=1e-7)


def test_binary_is_the_default_encoding(write: Callable[[bytes], Path]) -> None:
    content = crg(encoding="KRBI").replace(b"#:KRBI ! comment\n", b"")
    assert source_of(read_crg(write(content))).encoding == "KRBI"


@pytest.mark.parametrize(
    ("v", "expected", "sections"),
    [
        (-1.0, [0.0, 0.01, 0.02, 0.03], (-1.0, -1.0)),
        (-0.25, [0.075, 0.085, 0.11, 0.105], (-1.0, 0.0)),
        (0.5, [0.2, 0.21, 0.23, 0.23], (0.0, 1.0)),
        (1.0, [0.3, 0.31, 0.32, 0.33], (1.0, 1.0)),
        (1.0 + 1e-9, [0.3, 0.31, 0.32, 0.33], (1.0, 1.0)),
        (-1e-9, [0.1, 0.11, 0.14, 0.13], (0.0, 0.0)),
    ],
)
def test_between_long_sections_it_is_linear(
    write: Callable[[bytes], Path], v: float, expected: list[float], sections: tuple[float, float]
) -> None:
    profile = read_crg(write(crg()), v=v, name="lane 1")
    np.testing.assert_allclose(profile.z, expected, rtol=1e-12, atol=1e-12)
    assert profile.name == "lane 1"
    assert source_of(profile).sections == (sections,)


def test_tracks_by_name_and_by_position(write: Callable[[bytes], Path]) -> None:
    path = write(crg())
    profile = read_profile(path, v={"left": 0.5, "right": -0.5})
    assert list(profile.tracks) == ["left", "right"]
    assert profile.track("right").z.tolist() == read_crg(path, v=-0.5).z.tolist()
    assert profile.z.tolist() == read_crg(path, v=0.5).z.tolist()
    assert source_of(profile).columns == (-1, 1, 0)
    assert list(read_crg(path, v=[0.5, -0.5]).tracks) == ["v = 0.5 m", "v = -0.5 m"]
    one = read_crg(path, v=np.array([0.5]))  # type: ignore[arg-type]
    assert list(one.tracks) == ["v = 0.5 m"]


def test_sections_by_position_in_any_order(write: Callable[[bytes], Path]) -> None:
    channels = ["long section at v = 1.5,m", "friction,1", "Long Section  at v =-1e0, m"]
    content = crg([[0.3, 9.0, 0.1], [0.5, 9.0, 0.2]], channels=channels, road={
        "REFERENCE_LINE_INCREMENT": 0.5})  # fmt: skip
    profile = read_crg(write(content), v=0.25)
    np.testing.assert_allclose(profile.z, [0.2, 0.35])
    assert source_of(profile).sections == ((-1.0, 1.5),)
    assert source_of(profile).columns == (-1, 2)


@pytest.mark.parametrize(
    ("road", "first", "last"),
    [
        ({"V_INCREMENT": 0.8}, -0.8, 0.8),
        ({"V_RIGHT": -0.5, "V_INCREMENT": 0.8}, -0.5, 1.1),
        ({"V_LEFT": 2.0, "V_INCREMENT": 0.5}, 1.0, 2.0),
        ({"V_RIGHT": -0.5, "V_LEFT": 1.5}, -0.5, 1.5),
        ({"V_RIGHT": -0.5, "V_LEFT": 1.5, "V_INCREMENT": 1.0}, -0.5, 1.5),
    ],
)
def test_positions_of_numbered_sections(
    write: Callable[[bytes], Path], road: dict[str, float], first: float, last: float
) -> None:
    parameters = {f"LONG_SECTION_{key}": value for key, value in road.items()}
    path = write(crg(road={"REFERENCE_LINE_INCREMENT": 0.5} | parameters))
    assert read_crg(path, v=first).z[0] == 0.0
    assert read_crg(path, v=last).z[0] == 0.3
    with pytest.raises(FormatError, match=re.escape(f"outside the road, {first:g} to {last:g} m")):
        read_crg(path, v=last + 0.01)


# --- the reference line -----------------------------------------------------------------------


def test_slope_and_banking_are_added(write: Callable[[bytes], Path]) -> None:
    """By hand: z = z_grid + z_ref + v b; a slope holds on the step that ends at its row."""
    channels = ["reference line slope,m/m", "reference line phi,rad", *SECTIONS]
    channels.append("reference line banking,m/m")
    slopes, bankings = [NAN, 0.02, -0.04, 0.1], [0.0, 0.01, 0.02, 0.03]
    rows = [[s, 0.1, *row, b] for s, row, b in zip(slopes, ROWS, bankings, strict=True)]
    road = ROAD | {"REFERENCE_LINE_START_Z": 7.0, "REFERENCE_LINE_START_U": 100.0}
    for encoding in ENCODINGS:
        profile = read_crg(write(crg(rows, encoding, road=road, channels=channels)), v=0.5)
        reference = 7.0 + np.array([0.0, 0.01, -0.01, 0.04])
        expected = np.array([0.2, 0.21, 0.23, 0.23]) + reference + 0.5 * np.array(bankings)
        np.testing.assert_allclose(profile.z, expected, rtol=1e-7)
        assert profile.x.tolist() == [100.0, 100.5, 101.0, 101.5]


def test_constant_slope_and_banking_of_the_header(write: Callable[[bytes], Path]) -> None:
    line = {"START_S": 0.02, "END_S": 0.02, "START_B": -0.05, "START_Z": 1.0, "END_Z": 1.03}
    road = ROAD | {f"REFERENCE_LINE_{key}": value for key, value in line.items()}
    road["REFERENCE_LINE_OFFSET_Z"] = 500.0  # of global elevations
    profile = read_crg(write(crg(road=road)), v=1.0)
    expected = np.array([0.3, 0.31, 0.32, 0.33]) + 1.0 + 0.02 * profile.x - 0.05
    np.testing.assert_allclose(profile.z, expected, rtol=1e-12)


def test_rounding_of_the_slope_is_spread(write: Callable[[bytes], Path]) -> None:
    rows = [[0.0333333, *row] for row in ROWS]
    channels = ["reference line slope,m/m", *SECTIONS]
    content = crg(rows, road=ROAD | {"REFERENCE_LINE_END_Z": 0.05}, channels=channels)
    np.testing.assert_allclose(
        read_crg(write(content)).z, np.array(ROWS)[:, 1] + np.linspace(0.0, 0.05, 4), rtol=1e-14
    )


def test_modifiers_that_scale(write: Callable[[bytes], Path]) -> None:
    more = (
        "$ROAD_CRG_MODS\nSCALE_Z_GRID = 2\nscale_slope = 3 ! steeper\nSCALE_BANKING = -1\n"
        "SCALE_LENGTH = 10\nSCALE_WIDTH = 2\nREFPOINT_Z = 50\nGRID_NAN_MODE = 2\n$\n"
        "$ROAD_CRG_OPTS\nBORDER_MODE_U = 3\nBORDER_SMOOTH_UBEG = 0.5\n$\n"
        "$ROAD_CRG_MPRO\nPROJ_NM = 'UTM'\n$\n"
    )
    line = {"START_S": 0.02, "START_B": 0.05, "START_Z": 1.0}
    road = ROAD | {f"REFERENCE_LINE_{key}": value for key, value in line.items()}
    profile = read_crg(write(crg(road=road, more=more)), v=2.0)
    assert profile.x.tolist() == [0.0, 5.0, 10.0, 15.0]
    grid = 2.0 * np.array([0.3, 0.31, 0.32, 0.33])
    np.testing.assert_allclose(profile.z, grid + 1.0 + 0.06 * profile.x - 2.0 * 0.05)


def test_virtual_channels_and_stations_in_the_data(write: Callable[[bytes], Path]) -> None:
    rows = [[0.5 * i, *row] for i, row in enumerate(ROWS)]
    content = crg(rows, channels=["reference line u,m", *SECTIONS])
    content = content.replace(b"* comment", b"U:reference line u,m,0,0.5")
    assert read_crg(write(content)).z.size == 4
    rows[2][0] = 1.1
    content = crg(rows, "LRFI", channels=["reference line u,m", *SECTIONS])
    with pytest.raises(FormatError, match=r"station 1.1 m should be 1 m by the header") as caught:
        read_crg(write(content))
    assert caught.value.line == content.count(b"\n") - 1


# --- missing elevations -----------------------------------------------------------------------


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_missing_elevations_at_the_ends_are_left_out(
    write: Callable[[bytes], Path], encoding: str
) -> None:
    rows = [[NAN, NAN, 1.0], [NAN, 2.0, 1.0], [3.0, 2.5, 1.0], [NAN, 2.0, 1.0]]
    path = write(crg(rows, encoding))
    middle = read_crg(path)
    assert (middle.x.tolist(), middle.z.tolist()) == ([0.5, 1.0, 1.5], [2.0, 2.5, 2.0])
    assert source_of(middle).trimmed == (1, 0)
    assert source_of(middle).rows == 4
    left = read_crg(path, v=1.0)
    assert source_of(left).trimmed == (0, 0)
    both = read_crg(path, v=[1.0, 0.0])
    assert both.x.tolist() == [0.5, 1.0, 1.5]
    assert source_of(both).trimmed == (1, 0)
    with pytest.raises(FormatError, match="at least 2 samples, got 1"):
        read_crg(path, v=-1.0)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_missing_elevations_inside_are_refused(
    write: Callable[[bytes], Path], encoding: str
) -> None:
    rows = [row.copy() for row in ROWS]
    rows[1][0] = NAN
    content = crg(rows, encoding)
    path = write(content)
    assert read_crg(path, v=0.5).x.size == 4  # away from it
    message = "station 0.5 m and v = -0.5 m is missing, .* sections from 0 to 1 m are complete"
    with pytest.raises(FormatError, match=message) as caught:
        read_crg(path, v=-0.5)
    start = content.index(b"$$$$\n") + 5
    size = {"KRBI": 4, "KDBI": 8}.get(encoding)
    if size is None:
        assert caught.value.line == content[:start].count(b"\n") + 2
    else:
        assert caught.value.byte == start + 3 * size


def test_no_elevation_at_all(write: Callable[[bytes], Path]) -> None:
    rows = [[NAN, 0.0, 0.0], [NAN, 0.0, 0.0]]
    with pytest.raises(FormatError, match="no station has an elevation at v = -1 m"):
        read_crg(write(crg(rows)), v=-1.0)
    more = "$ROAD_CRG_MODS\nGRID_NAN_OFFSET = 0.2\n$"
    path = write(crg([[0.0, NAN, NAN], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], more=more))
    assert read_crg(path, v=-1.0).z.size == 3
    with pytest.raises(FormatError, match=r"1 of 3 stations .* GRID_NAN_MODE 2 .* make one up"):
        read_crg(path)


# --- what is refused, and where ---------------------------------------------------------------


def replaced(old: str, new: str, **arguments: Any) -> bytes:
    content = crg(**arguments)
    assert content.count(old.encode()) == 1, old
    return content.replace(old.encode(), new.encode())


@pytest.mark.parametrize(
    ("content", "message", "line"),
    [
        (replaced("$$$$\n", ""), "no line with \\$\\$ ends the header", None),
        (b"", "no line with \\$\\$", 1),
        (b"\x89PNG\r\n\x1a\n" + bytes(1000), "no line with \\$\\$", 3),
        (b"$$\n", "no section \\$ROAD_CRG: no OpenCRG road", None),
        (b"x,z\n0,1\n1,2\n$$\n", "no section \\$ROAD_CRG: no OpenCRG road", None),
        (replaced("$KD_Definition", "$KD_OTHER"), "no section \\$KD_DEFINITION", None),
        (replaced("$!*****\n", ""), "\\$ROAD_CRG of line 4 is not closed by a line with \\$", 9),
        (replaced("D:long section 3,m   ! comment\n$\n", ""), "KD_DEFINITION of line 10", 15),
        (crg(more="$ROAD_CRG\n$"), "a second section \\$ROAD_CRG", 10),
        (replaced("LONG_SECTION_V_RIGHT = -1.0", "long_section_v_left = 1"), "second value", 7),
        (replaced("LONG_SECTION_V_RIGHT = -1.0", "LONG_SECTION_V_RIGHT"), "is not PARAM", 6),
        (replaced("INCREMENT = 0.5", "INCREMENT = 0,5"), "'0,5' is not a finite number", 5),
        (replaced("INCREMENT = 0.5", "INCREMENT = 1e999"), "'1e999' is not a finite number", 5),
        (replaced("INCREMENT = 0.5", "INCREMENT = nan"), "'nan' is not a finite number", 5),
        (replaced("INCREMENT = 0.5", "INCREMENT = -0.5"), "must be positive, got -0.5 m", 5),
        (replaced("INCREMENT = 0.5", "INCREMENT = 0.4"), "is no whole number of REFERENCE", 8),
        (replaced("REFERENCE_LINE_INCREMENT", "INCREMENT"), "no REFERENCE_LINE_INCREMENT", None),
        (replaced("END_U = 1.5", "END_U = -1.5"), "must be at least 0.5 m after the start", 8),
        (replaced("END_U = 1.5", "END_U = 1e300"), "must be at least", 8),
        (replaced("END_U = 1.5", "END_U = 2"), "says 5 cross sections: damaged or cut short", 21),
        (replaced("END_U = 1.5", "END_U = 1"), "says 3 cross sections: damaged or cut short", 21),
        (replaced("#:LDFI", "#:KRFI"), "encoding 'KRFI' must be one of", 11),
        (replaced("* comment", "#:LRFI"), "must be one of KRBI, KDBI, LRFI, LDFI, once", 12),
        (replaced("* comment", "U:reference line u,ft,0,0.5"), "unit 'ft' .* must be m", 12),
        (replaced("section 2,m", "section 2,mm"), "unit 'mm' of 'long section 2' must be m", 14),
        (replaced("section 2,m", "section 2"), "unit '' of 'long section 2' must be m", 14),
        (replaced("section 2,m", "section 5,m"), "numbered from 1 to 3, each once", 13),
        (replaced("section 2,m", "section 1,m"), "numbered from 1 to 3, each once", 13),
        (replaced("section 2,m", "section at v = 1,m"), "some .* by number, some by", 13),
        (replaced("section 2,m", "section two,m"), "neither a number nor 'at v = '", 14),
        (replaced("long section 2,m", "reference line z,m"), "not a channel of the ref", 14),
        (replaced("long section 2,m", "reference line phi,deg"), "must be rad", 14),
        (crg(more="$ROAD_CRG_FILE\n../data/\nroad.crg\n$"), "refers to '../data/road.crg'", 11),
        (b"$ROAD_CRG_FILE\nroad.crg\n$\n", "refers to 'road.crg', which is not followed", 2),
        (crg(more="$ROAD_CRG_MODS\nSCALE_WIDTH = -1\n$"), "SCALE_WIDTH -1 has no clear", 11),
        (crg(more="$ROAD_CRG_MODS\nSCALE_Z_GRID = 0\n$"), "SCALE_Z_GRID 0 has no clear", 11),
        (crg(road=ROAD | {"REFERENCE_LINE_END_S": 0.1}), "slope is 0 at the start and 0.1", 8),
        (crg(road=ROAD | {"REFERENCE_LINE_END_B": 0.1}), "banking is 0 at the start", 8),
        (crg(road=ROAD | {"REFERENCE_LINE_END_Z": 0.1}), "end 0.1 m from REFERENCE_LINE_END_Z", 8),
        (crg(road=ROAD | {"LONG_SECTION_V_INCREMENT": 0.5}), "end at 0 m, not at LONG_SEC", 7),
        (crg(road=ROAD | {"LONG_SECTION_V_INCREMENT": 0.0}), "must be positive, got 0 m", 8),
        (crg(road={"REFERENCE_LINE_INCREMENT": 0.5}), "numbered long sections need LONG_", None),
        (crg([ROWS[0]], end_u=False), "has 1 cross sections, at least 2 are needed", None),
        (crg([], end_u=False), "has 0 cross sections, at least 2 are needed", None),
    ],
)  # fmt: skip
def test_the_line_is_blamed(
    write: Callable[[bytes], Path], content: bytes, message: str, line: int | None
) -> None:
    path = write(content)
    with pytest.raises(FormatError, match=message) as caught:
        read_crg(path)
    assert caught.value.path == str(path)
    assert line is None or caught.value.line == line


def test_positions_that_contradict_each_other(write: Callable[[bytes], Path]) -> None:
    channels = [f"long section at v = {v},m" for v in (-1, 0, 1)]
    road = ROAD | {"LONG_SECTION_V_LEFT": 1.5}
    with pytest.raises(FormatError, match=r"LONG_SECTION_V_LEFT 1.5 m contradicts .* at 1 m"):
        read_crg(write(crg(road=road, channels=channels)))
    with pytest.raises(FormatError, match="finite and distinct"):
        read_crg(write(crg(channels=[channels[0], channels[2], channels[2]])))
    with pytest.raises(FormatError, match="a second channel 'reference line slope'"):
        read_crg(write(crg(channels=["reference line slope,m/m"] * 2 + [channels[1]])))
    with pytest.raises(FormatError, match="no long section is defined"):
        read_crg(write(crg(channels=["reference line slope,m/m", "friction,1", "colour,1"])))


def test_slope_and_banking_must_be_complete(write: Callable[[bytes], Path]) -> None:
    for name in ("slope", "banking"):
        rows = [[0.0, *row] for row in ROWS]
        rows[2][0] = NAN
        content = crg(rows, "KDBI", channels=[f"reference line {name},m/m", *SECTIONS])
        with pytest.raises(FormatError, match=f"{name} .* cross section 3 is missing") as caught:
            read_crg(write(content))
        assert caught.value.byte == content.index(b"$$$$\n") + 5 + 8 * 8


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (" 0.0100000", " 0.01x0000", "' 0.01x0000' is not a number"),
        (" 0.0100000", " 0.01 0000", "' 0.01 0000' is not a number"),
        (" 0.0100000", " 1_0000000", "' 1_0000000' is not a number"),
        (" 0.0100000", "       nan", "'       nan' is not a number"),
        (" 0.0100000", "          ", "'          ' is not a number"),
        (" 0.0100000", "  0.01000000", "record of 32 characters; it must hold 3 fields of 10"),
        (" 0.1100000", "", "record of 20 characters; it must hold 3 fields of 10"),
        (" 0.0100000", " 0.0100\x00", "is not text: it holds the byte 0x00"),
        (" 0.0100000", " 0.01\t000", "is not text: it holds the byte 0x09"),
        (" 0.0100000", "\n\n", "record of 0 characters|REFERENCE_LINE_END_U says"),
    ],
)
def test_damaged_text(write: Callable[[bytes], Path], old: str, new: str, message: str) -> None:
    content = crg(encoding="LRFI")
    line = content[: content.index(old.encode())].count(b"\n") + 1
    with pytest.raises(FormatError, match=message) as caught:
        read_crg(write(content.replace(old.encode(), new.encode())))
    if "\n" not in new and len(new) == 10:
        assert caught.value.line == line


def test_numbers_too_large_are_refused(write: Callable[[bytes], Path]) -> None:
    content = crg(encoding="LRFI")
    path = write(content.replace(b" 0.1100000", b"    +1e999"))
    assert read_crg(path, v=1.0).z.size == 4
    with pytest.raises(FormatError, match=r"station 0.5 m and v = 0 m is infinite") as caught:
        read_crg(path)
    assert caught.value.line == content.count(b"\n") - 2
    with pytest.raises(FormatError, match=r"increase|longer|finite"):
        read_crg(write(crg(road=ROAD | {"REFERENCE_LINE_START_U": 1e300}, end_u=False)))


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_file_cut_short_anywhere_is_refused(
    write: Callable[[bytes], Path], encoding: str
) -> None:
    content = crg(ROWS * 5, encoding)
    complete = {len(content), len(content) - 1} if encoding[0] == "L" else {len(content)}
    for end in range(len(content) + 1):
        if end not in complete:
            with pytest.raises(FormatError):
                read_crg(write(content[:end]))


@pytest.mark.parametrize("encoding", ["LRFI", "LDFI"])
def test_text_may_end_without_a_line_end(write: Callable[[bytes], Path], encoding: str) -> None:
    content = crg(encoding=encoding)
    assert read_crg(write(content[:-1])).z.tolist() == read_crg(write(content)).z.tolist()
    assert read_crg(write(content + b"\n \n")).z.size == 4


@pytest.mark.parametrize("encoding", ["KRBI", "KDBI"])
def test_binary_must_fill_its_records(write: Callable[[bytes], Path], encoding: str) -> None:
    content = crg(encoding=encoding)
    with pytest.raises(FormatError, match="not a multiple of 80") as caught:
        read_crg(write(content + b"\n"))
    assert caught.value.byte == len(content) + 1
    with pytest.raises(FormatError, match=r"4 cross sections of 3 channels, .* fill"):
        read_crg(write(content + content[-80:]))
    with pytest.raises(FormatError, match="not filled with NaN"):
        read_crg(write(content[:-8] + struct.pack(">d", 1.0)))
    many = crg([[0.0] * 342] * 3, encoding, road={"REFERENCE_LINE_INCREMENT": 0.01,
        "LONG_SECTION_V_INCREMENT": 0.01}, end_u=False,
        channels=[f"long section {i + 1},m" for i in range(342)])  # fmt: skip
    assert read_crg(write(many)).z.size == 3
    with pytest.raises(FormatError, match="ends within cross section 3 of 342 channels"):
        read_crg(write(many[:-80]))


def test_sizes_are_checked_before_memory_is_taken(write: Callable[[bytes], Path]) -> None:
    """A header may call for any number of cross sections, and need not end."""
    absurd = replaced("INCREMENT = 0.5", "INCREMENT = 1e-9", encoding="KRBI")
    endless = b"$CT\n" + b"x" * (MAX_HEADER + 1000)
    for content in (absurd, endless, b"\n" * (MAX_HEADER + 1000)):
        path = write(content)
        tracemalloc.start()
        try:
            with pytest.raises(FormatError, match=r"damaged or cut short|within 1048576 bytes"):
                read_crg(path)
            assert tracemalloc.get_traced_memory()[1] < 3 * MAX_HEADER
        finally:
            tracemalloc.stop()


@pytest.mark.parametrize(
    ("v", "message"),
    [
        (NAN, "finite lateral positions in m, got nan"),
        ([0.0, float("inf")], "got inf"),
        ("left", "got 'left'"),
        (None, "got None"),
        ([], "no position"),
        ({}, "no position"),
        ([0.5, 0.5], "a position twice"),
        ({"": 0.5}, "must be printable text, got ''"),
        ({1: 0.5}, "must be printable text, got 1"),
    ],
)
def test_positions_are_checked(write: Callable[[bytes], Path], v: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        read_crg(write(crg()), v=v)
    assert not isinstance(caught.value, FormatError)


def test_missing_file_and_directory(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"none\.crg"):
        read_crg(tmp_path / "none.crg")
    folder = tmp_path / "folder.crg"
    folder.mkdir()
    with pytest.raises(FormatError, match="is a directory"):
        read_profile(folder)


# --- properties -------------------------------------------------------------------------------


@given(
    z=st.lists(st.floats(-1e3, 1e3), min_size=6, max_size=60),
    channels=st.integers(1, 3),
    start=st.floats(-1e5, 1e5),
    step=st.floats(1e-3, 10.0),
)
def test_what_is_written_in_double_precision_is_read_back(
    tmp_path: Path, z: list[float], channels: int, start: float, step: float
) -> None:
    rows = np.array(z[: len(z) // channels * channels]).reshape(-1, channels)
    road = {
        "REFERENCE_LINE_START_U": start,
        "REFERENCE_LINE_INCREMENT": step,
        "LONG_SECTION_V_INCREMENT": 1.0,
    }
    path = tmp_path / "round.crg"
    path.write_bytes(crg(rows.tolist(), "KDBI", road=road, channels=SECTIONS[:channels]))
    v = [i - (channels - 1) / 2 for i in range(channels)]
    profile = read_crg(path, v=v)
    assert np.array(list(profile.tracks.values())).T.tolist() == rows.tolist()
    np.testing.assert_allclose(profile.x, start + step * np.arange(len(rows)), rtol=1e-12)


FILES = [
    crg(encoding=encoding, end_u=end_u, more="$ROAD_CRG_MODS\nSCALE_Z_GRID = 2\n$")
    for encoding in ENCODINGS
    for end_u in (True, False)
]
FRAGMENTS = st.sampled_from(
    [
        *(b"$", b"$$", b"$$\n", b"\n", b"=", b"9", b"-", b"e9", b".", b",", b"*", b"!", b" "),
        *(b"\x00", b"\xff\xff\xff\xff", b"\x7f\x80\x00\x00", b"nan", b"D:", b"#:KDBI\n"),
        b"long section 9,m\n",
    ]
)


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """Draw an OpenCRG file of which pieces are cut out, repeated or replaced."""
    content = draw(st.sampled_from(FILES))
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(content)))
        stop = draw(st.integers(start, min(len(content), start + 90)))
        piece = draw(st.binary(max_size=9) | FRAGMENTS | st.just(2 * content[start:stop]))
        content = content[:start] + piece + content[stop:]
    return content


@pytest.mark.filterwarnings("error")
@settings(max_examples=1000)
@given(content=st.binary(max_size=300) | damaged(), v=st.floats(-2.0, 2.0))
def test_any_content_is_a_profile_or_a_format_error(
    tmp_path: Path, content: bytes, v: float
) -> None:
    path = tmp_path / "any.crg"
    path.write_bytes(content)
    try:
        profile = read_crg(path, v=v)
    except FormatError as error:
        blamed = error.path
    else:
        assert profile.is_uniform
        blamed = source_of(profile).path
    assert blamed == str(path)


# --- roads of others --------------------------------------------------------------------------


@needs_opencrg
def test_belgian_block() -> None:
    """Measured paving stones: 10 m at 10 mm, 341 long sections from -1.7 to 1.7 m."""
    path = OPENCRG / "belgian_block.crg"
    profile = read_crg(path)
    assert profile.x.size == 1001
    assert (profile.x[0], profile.x[-1]) == (730.0, pytest.approx(740.0))
    source = source_of(profile)
    assert (source.encoding, source.rows, source.trimmed) == ("KRBI", 1001, (0, 0))
    assert source.header[source.columns[1]] == "long section 171,m"
    inside = read_crg(path, v=np.round(np.arange(-1.37, 1.701, 0.01), 2).tolist())
    z = np.array(list(inside.tracks.values()))
    assert 2.035 < z.min() < z.max() < 2.1831
    assert z.max() == pytest.approx(2.18303, abs=1e-5)
    between = read_crg(path, v=0.005).z
    np.testing.assert_allclose(between, 0.5 * (profile.z + read_crg(path, v=0.01).z), rtol=1e-12)


@needs_opencrg
def test_belgian_block_has_no_elevation_at_its_right_border() -> None:
    path = OPENCRG / "belgian_block.crg"
    with pytest.raises(FormatError, match=r"no station has an elevation at v = -1.65 m; long"):
        read_crg(path, v=-1.65)
    with pytest.raises(FormatError, match=r"v = 1.71 m is outside the road, -1.7 to 1.7 m"):
        read_crg(path, v=1.71)


@needs_opencrg
def test_belgian_block_cut_short(tmp_path: Path) -> None:
    content = (OPENCRG / "belgian_block.crg").read_bytes()
    path = tmp_path / "cut.crg"
    for end in (len(content) - 1, len(content) - 80, len(content) // 2, 5000):
        path.write_bytes(content[:end])
        with pytest.raises(FormatError, match=r"damaged or cut short|no line with"):
            read_crg(path)


@needs_opencrg
def test_handmade_roads_are_one_road() -> None:
    """The sample files say so: the same road commented, bare, and in double precision."""
    straight, bare, double = (
        read_crg(OPENCRG / f"handmade_straight{kind}.crg", v=[-1.0, -0.5, 0.0, 0.5, 1.0], name="")
        for kind in ("", "_minimalist", "_double")
    )
    assert straight == bare == double
    assert straight.x.tolist() == list(range(23))
    assert straight.tracks["v = 0.0 m"][[0, 1, 10, 19]].tolist() == [
        0.0, 0.0111111, 0.0222222, 0.0333333,
    ]  # fmt: skip


@needs_opencrg
def test_handmade_road_misses_elevations_inside() -> None:
    path = OPENCRG / "handmade_straight.crg"
    with pytest.raises(FormatError, match=r"station 7 m and v = -1.5 m is missing") as caught:
        read_crg(path, v=-1.5)
    line = path.read_bytes().splitlines()[(caught.value.line or 0) - 1]
    assert line.lstrip().startswith(b"*missing*")
    with pytest.raises(FormatError, match=r"station 7 m and v = 1.5 m is missing"):
        read_crg(path, v=1.5)


@needs_opencrg
def test_handmade_sloped_road() -> None:
    """Its slope channel rises by 0.011 a metre up to 0.11 and back to 0, its v are irregular."""
    path = OPENCRG / "handmade_sloped.crg"
    flat = read_crg(OPENCRG / "handmade_straight.crg")
    slope = 0.011 * np.array([0, *range(11), *range(10, -1, -1)])
    np.testing.assert_allclose(read_crg(path).z, flat.z + np.cumsum(slope), atol=1e-9)
    assert source_of(read_crg(path, v=0.5)).sections == ((0.0, 1.0),)
    assert source_of(read_crg(path, v=1.1)).sections == ((1.0, 1.25),)


@needs_chrono
def test_half_round_obstacle() -> None:
    """A half-round of 10 in: a circular arc, 0.254 m high, symmetric, on a level road."""
    profile = read_crg(CHRONO / "halfround_10in.crg", v={"left": 3.0, "right": -1.0})
    assert profile.x.size == 10_001
    assert profile.length == pytest.approx(100.0)
    assert profile.z.max() == pytest.approx(0.254, abs=5e-5)
    on = np.flatnonzero(profile.z > 0.0)
    assert np.diff(on).max() == 1
    top = profile.x[np.argmax(profile.z)]
    height = profile.z[on]
    np.testing.assert_allclose(height, height[::-1], atol=0.02)
    radius = np.hypot(profile.x[on] - 0.5 * (profile.x[on[0]] + profile.x[on[-1]]), height)
    assert radius == pytest.approx(0.254, abs=0.01)
    assert top == pytest.approx(0.5 * (profile.x[on[0]] + profile.x[on[-1]]), abs=0.011)
    assert np.array_equal(profile.z, profile.tracks["right"])


@needs_chrono
def test_proving_ground_course() -> None:
    """Its comments: undulated for 304.8 m from 100 m on, 0.96944 in rms about its trend."""
    profile = read_crg(CHRONO / "detrended_rms_course_1in.crg")
    assert profile.x.size == 10_096
    assert profile.x[-1] == pytest.approx(504.75)
    rough = np.flatnonzero(profile.z)
    assert profile.x[rough[0]] == pytest.approx(100.0, abs=0.1)
    assert profile.x[rough[-1]] - profile.x[rough[0]] == pytest.approx(
        304.8, abs=0.3
    )  # resampled to 0.05 m
    rms = float(np.sqrt(np.mean(profile.z[rough[0] : rough[-1] + 1] ** 2)))
    assert rms == pytest.approx(0.96944 * 0.0254, rel=0.02)


# --- size -------------------------------------------------------------------------------------


@pytest.mark.parametrize("encoding", ["KRBI", "LRFI"])
def test_ten_kilometres_read_in_seconds(write: Callable[[bytes], Path], encoding: str) -> None:
    """A million numbers take 0.1 s as binary and about 1 s as text; slow machines get 20 s."""
    z = np.round(np.random.default_rng(1).normal(0.0, 0.01, (100_001, 10)), 6)
    road = {"REFERENCE_LINE_INCREMENT": 0.1, "LONG_SECTION_V_INCREMENT": 0.25}
    channels = [f"long section {i + 1},m" for i in range(10)]
    path = write(crg(z.tolist(), encoding, road=road, channels=channels))
    begin = time.perf_counter()
    profile = read_crg(path, v={"left": 1.125, "right": -1.125})
    assert time.perf_counter() - begin < 20.0
    assert profile.length == pytest.approx(10e3)
    np.testing.assert_allclose(profile.tracks["right"], z[:, 0], atol=1e-7)
