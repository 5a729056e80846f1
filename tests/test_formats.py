"""All readers of profiles: which one takes a file, what comes back, and that no file harms."""

from __future__ import annotations

import gzip
import io
import itertools
import random
import string
import time
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.io import netcdf_file

from pavefem.errors import FormatError
from pavefem.formats import PROFILE_READERS, read_profile
from pavefem.formats.crg import CrgSource
from pavefem.profile import Profile

DATA = Path(__file__).parents[2] / "shared" / "data"

ERD = b"""ERDFILEV2.00
1, 3, -1, 1, 5, 0.25, -1
SHORTNAMElev.
UNITSNAMmm
XUNITS  m
END
1.0
2.0
3.0
"""
CRG = b"""$CT
made by a test
$
$ROAD_CRG
REFERENCE_LINE_INCREMENT = 0.25
REFERENCE_LINE_END_U = 0.5
$
$KD_DEFINITION
#:LRFI
D:long section at v = 0,m
$
$$
 0.0010000
 0.0020000
 0.0030000
"""
TEXT = "Road: A12\nStation [m];Höhe [mm]\n0,00;1,0\n0,25;2,0\n0,50;3,0\n".encode()
RISING = Profile([0.0, 0.25, 0.5], [0.001, 0.002, 0.003])


@pytest.fixture
def write(tmp_path: Path) -> Callable[[bytes, str], Path]:
    """Write bytes to a file of some name and return its path."""

    def _write(content: bytes, name: str) -> Path:
        path = tmp_path / name
        path.write_bytes(content)
        return path

    return _write


def is_rising(profile: Profile) -> bool:
    return bool(np.allclose(profile.x, RISING.x) and np.allclose(profile.z, RISING.z))


# --- content and suffix -----------------------------------------------------------------------


@pytest.mark.parametrize("name", ["a.erd", "a.CRG", "a.txt", "a.csv", "a.log", "a.erd.bak", "a"])
@pytest.mark.parametrize(
    ("content", "kind"),
    [
        (ERD, "ERD, text numbers"),
        (b"\xef\xbb\xbf" + ERD, "ERD, text numbers"),
        (CRG, "OpenCRG, LRFI"),
        (b"* editor: a comment ahead of the first section\n" + CRG[21:], "OpenCRG, LRFI"),
        (CRG.replace(b"$CT\n", b"$ct   ! comment\n"), "OpenCRG, LRFI"),
    ],
)
def test_content_that_is_unmistakable_decides(
    write: Callable[[bytes, str], Path], content: bytes, kind: str, name: str
) -> None:
    profile = read_profile(write(content, name))
    assert is_rising(profile)
    assert profile.source is not None and profile.source.format == kind
    assert isinstance(profile.source, CrgSource) == kind.startswith("OpenCRG")


@pytest.mark.parametrize("name", ["a.txt", "a.CSV", "a.dat", "a.tsv", "a.log", "a.prf", "a"])
def test_columns_of_text_of_any_suffix(write: Callable[[bytes, str], Path], name: str) -> None:
    profile = read_profile(write(TEXT, name))
    assert is_rising(profile)
    assert profile.source is not None
    assert profile.source.format == "columns of text, semicolon and decimal comma"


def test_columns_of_text_longer_than_what_is_looked_at(
    write: Callable[[bytes, str], Path],
) -> None:
    for end in ("\n", "\r\n", "\r"):
        rows = "".join(f"{0.25 * i:.2f} {0.001 * (i % 9):.3f}{end}" for i in range(20_000))
        assert read_profile(write(rows.encode(), "a.log")).x.size == 20_000


@pytest.mark.parametrize("content", [TEXT, b"0 1\n1 2\n2 3\n", b"# x, z\n0.0,1.0\n1.0,1.0\n"])
def test_columns_of_text_named_otherwise_are_told_as_such(
    write: Callable[[bytes, str], Path], content: bytes
) -> None:
    for suffix, start in ((".erd", "starts with ERDFILEV2.00"), (".crg", r"\$CT and \$ROAD_CRG")):
        path = write(content, f"a{suffix}")
        message = rf"line 1: holds columns of text, and an .* {start}; give .* \.txt or \.csv"
        with pytest.raises(FormatError, match=message) as caught:
            read_profile(path)
        assert caught.value.path == str(path)


def xlsx() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr("xl/workbook.xml", "<workbook/>")
    return file.getvalue()


def zipped() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("site.csv", TEXT)
    return file.getvalue()


def netcdf4() -> bytes:
    file = io.BytesIO()
    with h5netcdf.File(file, "w") as dataset:
        dataset.dimensions = {"x": 3}
        dataset.create_variable("z", ("x",), data=np.arange(3.0))
    return file.getvalue()


def netcdf() -> bytes:
    file = io.BytesIO()
    dataset = netcdf_file(file, "w")
    dataset.createDimension("x", 3)
    dataset.createVariable("z", "f8", ("x",))[:] = np.arange(3.0)
    dataset.flush()
    return file.getvalue()


@pytest.mark.parametrize("name", ["a.erd", "a.crg", "a.txt", "a.csv", "a.other"])
@pytest.mark.parametrize(
    ("make", "what"),
    [
        (xlsx, "an Excel workbook: save its sheet as CSV"),
        (zipped, "a ZIP archive: unpack it"),
        (lambda: gzip.compress(TEXT), "a gzip archive"),
        (netcdf4, "HDF5, or netCDF-4"),
        (netcdf, "netCDF: export"),
        (lambda: b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(504), "an old Excel workbook"),
        (lambda: b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n", "a PDF document"),
        (lambda: b"\x89PNG\r\n\x1a\n" + bytes(30), "a picture"),
        (lambda: b"PAR1\x15\x04" + bytes(30), "a Parquet file"),
        (lambda: b"SQLite format 3\0" + bytes(30), "an SQLite database"),
        (lambda: b'<?xml version="1.0"?>\n<a>1 2</a>\n', "XML or HTML"),
        (lambda: b"<html><table><tr><td>0<td>1</table>", "XML or HTML"),
        (lambda: b'{"station": [0, 1], "elevation": [0, 0]}', "JSON"),
    ],
)
def test_other_files_are_named(
    write: Callable[[bytes, str], Path], make: Callable[[], bytes], what: str, name: str
) -> None:
    path = write(make(), name)
    with pytest.raises(FormatError, match=f"is {what}.*; ") as caught:
        read_profile(path)
    assert (caught.value.path, caught.value.byte) == (str(path), 0)
    assert (".erd, .csv" in caught.value.message) == (name == "a.other")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.ppf", b"\x08\0\0\0" + bytes(40), "ASTM E2560: export it as ERD from ProVAL"),
        ("a.bin", bytes(range(256)), r"byte 0: suffix '.bin' is not .*\.txt; .* control byte 0x00"),
        ("a.md", b"# Title\n\nSome words.\n", r"suffix '.md' is not .* \(no line with numbers"),
        ("a.log", b"a\n1,5,2,5\n1,6,2,5\n", r"line 2: suffix '.log' .*has several readings"),
        ("a.log", b"", "the file is empty or cut short"),
        ("a.txt", bytes(range(256)), "byte 0: is not text: it holds the control byte 0x00"),
        ("a.erd", bytes(range(256)), "line 1: line is b'.*an ERD file starts with ERDFILEV2.00"),
        ("a.crg", bytes(range(256)), r"no line with \$\$ ends the header"),
        ("a.erd", b"Some words.\n", "an ERD file starts with"),
        ("a.crg", b"Some words.\n", "no OpenCRG file"),
        ("a.crg", b"", "no OpenCRG file"),
    ],
)
def test_files_that_are_nothing_known(
    write: Callable[[bytes, str], Path], name: str, content: bytes, message: str
) -> None:
    path = write(content, name)
    with pytest.raises(FormatError, match=message) as caught:
        read_profile(path)
    assert caught.value.path == str(path)


@pytest.mark.parametrize("suffix", [".erd", ".crg", ".txt", ".other"])
def test_what_is_no_file(tmp_path: Path, suffix: str) -> None:
    folder = tmp_path / f"folder{suffix}"
    folder.mkdir()
    with pytest.raises(FormatError, match="is a directory or a device; a file is needed"):
        read_profile(folder)
    device = tmp_path / f"device{suffix}"
    device.symlink_to("/dev/zero")
    if device.exists():
        with pytest.raises(FormatError, match="is a directory or a device"):
            read_profile(device)


@pytest.mark.parametrize(
    ("content", "options", "message"),
    [
        (ERD, {"v": 0.5}, "a.txt is an ERD file, .* no option v; it has channels, station_unit"),
        (CRG, {"skip": 1, "step": 1.0}, "is an OpenCRG file, .* no option skip, step; .* v, name$"),
        (TEXT, {"channels": [0]}, "is columns of text, .* no option channels; it has columns, del"),
        (TEXT, {"path": "b.txt"}, "no option path"),
    ],
)
def test_options_of_another_reader(
    write: Callable[[bytes, str], Path], content: bytes, options: dict[str, Any], message: str
) -> None:
    path = write(content, "a.txt")
    if "path" in options:
        with pytest.raises(TypeError):
            read_profile(path, **options)
        return
    with pytest.raises(ValueError, match=message) as caught:
        read_profile(path, **options)
    assert not isinstance(caught.value, FormatError)


# --- writers ----------------------------------------------------------------------------------

GRID: NDArray[np.float64] = 0.25 * np.arange(12, dtype=np.float64)
IRREGULAR = np.array([3.0, 3.1, 3.4, 3.65, 3.75, 3.75 + 1.0 / 3.0, 5.0])


def with_tracks(x: NDArray[np.float64], *names: str) -> Profile:
    """Profile with numbers of full length in each of its tracks."""
    z = np.random.default_rng(len(names)).normal(0.0, 0.01, (max(1, len(names)), x.size))
    return Profile(x, z[0], "round", tracks=dict(zip(names, z, strict=True)) if names else None)


TRACKS: list[tuple[str, ...]] = [
    (),
    ("left", "right"),
    ("left", "right", "center"),
    ("v = 0.5 m", "v = -0.5 m"),
    ("track 1", "track 2", "left lane"),
]


@pytest.mark.parametrize("names", TRACKS)
@pytest.mark.parametrize("x", [GRID, IRREGULAR], ids=["uniform", "irregular"])
def test_csv_comes_back_number_for_number(
    tmp_path: Path, x: NDArray[np.float64], names: tuple[str, ...]
) -> None:
    profile = with_tracks(x, *names)
    profile.to_csv(tmp_path / "round.csv")
    options: dict[str, Any] = {} if x is GRID else {"spacing": "file"}
    if not {"left", "right"}.issuperset(names[:2]):
        with pytest.raises(FormatError, match="which of"):
            read_profile(tmp_path / "round.csv", **options)
        options["columns"] = ("station", *names)
    back = read_profile(tmp_path / "round.csv", **options)
    assert back == profile
    assert back.source is not None and set(back.source.units_from) == {"header"}


@pytest.mark.parametrize("names", TRACKS)
def test_erd_comes_back_number_for_number(tmp_path: Path, names: tuple[str, ...]) -> None:
    profile = with_tracks(GRID, *names)
    profile.to_erd(tmp_path / "round.erd")
    known = {"left", "right"}.issuperset(names[:2])
    options = {} if known else {"channels": list(names)}
    assert read_profile(tmp_path / "round.erd", **options) == profile
    assert read_profile(tmp_path / "round.erd", **options).track(names[-1]) if names else True
    with pytest.raises(ValueError, match=r"irregular .* write profile\.resample\(spacing\)"):
        with_tracks(IRREGULAR, *names).to_erd(tmp_path / "not.erd")
    assert not (tmp_path / "not.erd").exists()


def test_one_track_of_an_erd_file_goes_on_to_csv(
    write: Callable[[bytes, str], Path], tmp_path: Path
) -> None:
    content = ERD.replace(b"1, 3,", b"2, 3,").replace(b"Elev.", b"LElev.  RElev.")
    content = content.replace(b"NAMmm", b"NAMmm      mm") + b"4.0\n5.0\n6.0\n"
    right = read_profile(write(content, "a.erd"), name="run").track("right")
    right.to_csv(tmp_path / "right.csv")
    assert read_profile(tmp_path / "right.csv", name="run, right") == right


# --- no file does harm ------------------------------------------------------------------------


def check_any_content(path: Path, content: bytes) -> Profile | None:
    """Check that `content` is a whole profile, or an error that names the place in the file."""
    path.write_bytes(content)
    profile, error = None, FormatError("", path=path)
    try:
        profile = read_profile(path)
    except FormatError as caught:
        error = caught
    assert error.path == str(path)
    assert len(error.message) < 1000
    assert 1 <= (error.line or 1) <= 1 + content.count(b"\n") + content.count(b"\r")
    assert 0 <= (error.byte or 0) <= len(content)
    if profile is not None:
        for values in (profile.x, profile.z, *profile.tracks.values()):
            assert np.isfinite(values).all()
        assert profile.summary()["format"]
    return profile


MANY = 10**12
MEGABYTE = 2**20


def text_with(top: bytes) -> bytes:
    return top + b"\n0.0 0.0\n1.0 0.0\n"


HUGE: list[tuple[str, bytes]] = [
    *(
        ("a.erd", ERD.replace(old, new))
        for old, new in [
            (b"1, 3, ", b"1, %d, " % MANY),
            (b"1, 3, ", b"10000, %d, " % MANY),
            (b"1, 3, ", b"%d, 3, " % MANY),
            (b"1, 3, -1, 1, 5,", b"1, %d, -1, 1, 1," % MANY),
            (b"1, 3, -1, 1, 5,", b"10000, -1, %d, %d, 0," % (MANY, MANY)),
            (b"1, 3, -1, 1, 5,", b"1, %d, 1, %d, 1," % (MANY, 4 * MANY)),
            (b"SHORTNAM", b"SHORTNAM" + b" " * 900_000),
            (b"SHORTNAM", b"LONGNAME" + b"x  " * 300_000 + b"\nSHORTNAM"),
            (b"SHORTNAM", b"TITLE   x\n&" * 90_000 + b"\nSHORTNAM"),
            (b"END\n", b"E\n" * 2_000_000),
        ]
    ),
    *(
        ("a.crg", CRG.replace(old, new))
        for old, new in [
            (b"END_U = 0.5", b"END_U = 0.25e12"),
            (b"INCREMENT = 0.25", b"INCREMENT = 1e-15"),
            (b"at v = 0,m", b"999999999999,m"),
            (b"D:long section at v = 0,m\n", b"D:x,m\n" * 60_000),
            (b"D:long section at v = 0,m\n", b"D:long section 1,m\n" * 50_000),
            (b"made by a test\n", b"made by a test\n" * 200_000),
            (b"$$\n", b"x" * 2_000_000),
        ]
    ),
    ("a.txt", text_with(b"x" * 2_000_000)),
    ("a.txt", text_with(b"Station [m] " + b"z (" * 500_000)),
    ("a.txt", text_with(b"x " + b"[" * 9000)),
    ("a.txt", text_with(b"(" * 4000 + b" " * 4000 + b")")),
    ("a.txt", text_with(b"x;" * 4000)),
    ("a.txt", text_with(b"x" + b" " * 9000 + b"z")),
    ("a.txt", b"1" * 2_000_000),
    ("a.txt", b"1" + b" " * 9000 + b"x\n" * 3),
    ("a.txt", b"1 " * 2_000_000),
    ("a.csv", b"Lane;1\n" * 300_000),
    ("a.csv", b"Road;A\n" * 300_000),
    ("a.csv", b"# comment\n" * 300_000),
    ("a.csv", b"\n" * 2_000_000),
    ("a.csv", b"0.0 " + b"9" * 9000 + b"\n1.0 1.0\n"),
    ("a.csv", b"-1e308,0\n1e308,1\n"),
]


@pytest.mark.parametrize(
    ("name", "content"), HUGE, ids=[f"{name[2:]}-{i}" for i, (name, _) in enumerate(HUGE)]
)
def test_huge_headers_and_counts_take_neither_memory_nor_time(
    tmp_path: Path, name: str, content: bytes
) -> None:
    """What is taken is a multiple of the file, not of what it claims; seconds for slow machines."""
    begin = time.perf_counter()
    tracemalloc.start()
    try:
        profile = check_any_content(tmp_path / name, content)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 30 * len(content) + 20 * MEGABYTE
    assert time.perf_counter() - begin < 20.0
    assert profile is None or (profile.x.size <= 3 and b"%d" % MANY not in content)


TEXT_FILES = [
    TEXT,
    b"0.0,583.1\n0.5,583.25\n1.0,583.2\n1.5,583\n",
    b"# x [m], z [mm]\n0.0, 1\n0.5, 2\n# c\n1.0, 3\n",
    b"Date;12.03.2021\r\nx;z left;z right\r\nm;mm;mm\r\n0,0;1,5;2\r\n0,5;1;2,5\r\n",
    b"Distance (ft)\tLeft Elevation (in)\tRight Elevation (in)\n0\t1.5\t2\n1\t1\t2\n",
]
VALID = [*TEXT_FILES, ERD, CRG]
SUFFIXES = [*PROFILE_READERS, ".log", ""]

PIECES = st.sampled_from(
    [
        *(b"\n", b"\r", b" ", b",", b";", b"\t", b".", b"-", b'"', b"#", b"$", b"$$\n", b"&", b"["),
        *(b"nan", b"inf", b"1e400", b"-1", b"0", b"999999999999", b"1_0", b"0x1", b"\xd9\xa3"),
        *(b"\x00", b"\x0b", b"\x1a", b"\x85", b"\xa0", b"\xff\xfe", b"\xef\xbb\xbf", b"\xe4"),
        *(b"x;z\n", b"m;mm\n", b"Lane;1\n", b"units: ft\n", b"---\n", b"END\n", b"ERDFILEV"),
    ]
)


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """Draw a valid file of any format of which pieces are cut out, repeated or replaced."""
    content = draw(st.sampled_from(VALID))
    for _ in range(draw(st.integers(1, 5))):
        start = draw(st.integers(0, len(content)))
        stop = draw(st.integers(start, min(len(content), start + 12)))
        piece = draw(st.binary(max_size=6) | PIECES | st.just(2 * content[start:stop]))
        content = content[:start] + piece + content[stop:]
    return content


@pytest.mark.filterwarnings("error")
@settings(max_examples=1000)
@given(content=damaged(), suffix=st.sampled_from(SUFFIXES))
def test_a_damaged_file_is_a_profile_or_a_format_error(
    tmp_path: Path, content: bytes, suffix: str
) -> None:
    check_any_content(tmp_path / f"any{suffix}", content)


@pytest.mark.filterwarnings("error")
@settings(max_examples=200)
@given(content=st.binary(max_size=300), suffix=st.sampled_from(SUFFIXES), head=st.integers(0, 60))
def test_any_bytes_are_a_profile_or_a_format_error(
    tmp_path: Path, content: bytes, suffix: str, head: int
) -> None:
    for start in (b"", *(valid[:head] for valid in VALID)):
        check_any_content(tmp_path / f"any{suffix}", start + content)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("suffix", [".txt", ".log"])
@pytest.mark.parametrize("valid", TEXT_FILES, ids=range(len(TEXT_FILES)))
def test_text_cut_anywhere_keeps_the_rows_ahead_of_the_cut(
    tmp_path: Path, valid: bytes, suffix: str
) -> None:
    """No count in such a file tells that it is cut: only the last row may suffer."""
    whole = check_any_content(tmp_path / f"whole{suffix}", valid)
    assert whole is not None
    for length in range(len(valid)):
        part = check_any_content(tmp_path / f"cut{suffix}", valid[:length])
        if part is not None and part.x.size > 2:
            ahead = part.x.size - 1
            assert part.z[:ahead].tolist() == whole.z[:ahead].tolist()
            assert list(part.tracks) == list(whole.tracks)


@pytest.mark.filterwarnings("error")
def test_numbers_in_any_dress_are_read_as_what_they_are(tmp_path: Path) -> None:
    """Every delimiter, decimal mark and head that leaves one reading gives the same numbers."""
    x, left, right = GRID, 0.5 * np.sin(GRID), 0.5 * np.cos(GRID)
    heads = ["", "Road: A12\nLane;2\nDate, 12.03.2021, 10:00\n\n", "# a\n", "-----\nRun 3\n"]
    rng = random.Random(1)
    for delimiter, decimal, head, end, units in itertools.product(
        ";\t, ", ".,", heads, ("\n", "\r\n", "\r"), (True, False)
    ):
        if delimiter == decimal:
            continue
        gap = delimiter * (rng.randint(1, 3) if delimiter == " " else 1)
        names, row = ["Station", "Höhe_rechts", "Höhe_links"], ["[m]", "[mm]", "[mm]"]
        if not units:
            names = [f"{name} {unit}" for name, unit in zip(names, row, strict=True)]
        rows = [names, *([row] if units else [])]
        for station, z_left, z_right in zip(x, left, right, strict=True):
            numbers = (station, 1e3 * z_right, 1e3 * z_left)
            rows.append([f"{number:.9f}".replace(".", decimal) for number in numbers])
        table = "\n".join(gap.join(cells) for cells in rows) + "\n"
        path = tmp_path / "dress.txt"
        path.write_bytes((head + table).replace("\n", end).encode(rng.choice(["utf-8", "cp1252"])))
        profile = read_profile(path)
        np.testing.assert_allclose(profile.x, x, atol=1e-12)
        np.testing.assert_allclose(profile.track("left").z, left, atol=1e-11)
        np.testing.assert_allclose(profile.track("right").z, right, atol=1e-11)
        assert profile.source is not None
        assert profile.source.units == ("m", "mm", "mm")


def test_bytes_of_every_kind_at_random(tmp_path: Path) -> None:
    """Longer than hypothesis draws: rubbish of one alphabet each."""
    rng = random.Random(7)
    alphabets = ["0123456789.,;\n", string.printable, "ab \n", "01\n ", "[]()m;x\n", "$D:!\n#"]
    for alphabet, suffix in itertools.product(alphabets, SUFFIXES):
        for _ in range(5):
            content = "".join(rng.choices(alphabet, k=3000)).encode()
            check_any_content(tmp_path / f"any{suffix}", content)


# --- files of others --------------------------------------------------------------------------


@pytest.mark.parametrize("folder", ["opencrg", "chrono_crg", "iri_sorel"])
def test_real_files_under_another_name(tmp_path: Path, folder: str) -> None:
    if not (DATA / folder).is_dir():
        pytest.skip(f"measured profiles not beside the project (shared/data/{folder})")
    paths = [path for path in (DATA / folder).iterdir() if path.suffix in PROFILE_READERS]
    assert paths
    for path in paths:
        copy = tmp_path / "copy.prf"
        copy.write_bytes(path.read_bytes())
        assert read_profile(copy, name=path.stem) == read_profile(path)
