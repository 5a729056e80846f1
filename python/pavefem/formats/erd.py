"""ERD files of road profiles: a header in text, then the elevations at a constant step.

The format is that of the Engineering Research Division of UMTRI, in which RoadRuf, ProVAL and LTPP
exchange profiles: "The ERD File Specification" (UMTRI), and M. W. Sayers and S. M. Karamihas,
"ERD file format for storage and analysis of road profiles" (UMTRI; appendix A of the RoadRuf
reference manual, 1997).

Line 1 is ``ERDFILEV2.00``. Line 2 is ``NCHAN, NSAMP, NRECS, NBYTES, KEYNUM, STEP, KEYOPT``:
number of channels, of samples in each (-1: as many as there are), of binary records and of bytes
in each, how the numbers are stored (`ENCODINGS`), distance between the samples, and one that is
not used here. Each further line is a keyword in the first 8 characters and its text; those that
have nothing to do with the profile are skipped. The header ends with the line ``END``. A name or
unit of each channel takes 8 characters (``SHORTNAM``, ``UNITSNAM``) or 32 (``LONGNAME``,
``GENNAME``). The numbers follow sample by sample, one for each channel: as text below the header,
as binary either there or, as UMTRI has it, in a file of the same name with the suffix ``.bin``.

Checked against published material: the layout of LTPP's text files, and UMTRI's rules of header
and ``.bin`` file. Not checked against any, for want of a public file: what KEYNUM 0 and 1 stand
for, the widths of long names, records, the keywords GAIN, OFFSET and XSTART, and lines continued
by ``&``.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, Self

import numpy as np
from numpy.typing import NDArray

from pavefem._files import replacing
from pavefem.errors import FormatError
from pavefem.formats.text import (
    METRES,
    check_plausible,
    check_units,
    choose_units,
    decode_text,
    in_order_of_tracks,
    known_unit,
    name_tracks,
    track_of,
)
from pavefem.profile import Profile, ProfileSource

ENCODINGS: Final[dict[int, str]] = {0: "i2", 1: "f4", 5: "text"}
"""How numbers are stored, by KEYNUM: 2-byte integers, 4-byte reals, or text."""

MAX_HEADER: Final = 1_000_000
"""Most bytes in which the header must end."""

MAX_CHANNELS: Final = 10_000

MAX_ELEVATION: Final = 1e5
"""Highest elevation, m, that is believed of binary numbers."""

BYTE_ORDERS: Final = {"little": "<", "big": ">"}

NAME_WIDTHS: Final = {"SHORTNAM": 8, "UNITSNAM": 8, "LONGNAME": 32, "GENNAME": 32}
"""Characters that each channel takes in the text of a keyword."""

SHORT_NAMES: Final = {"left": "LElev.", "right": "RElev.", "center": "CElev."}

_MAGIC: Final = re.compile(rb"(\xef\xbb\xbf)?\s{0,80}ERDFILEV", re.IGNORECASE)
_END: Final = re.compile(rb"(?:^|[\r\n])[ \t]*END[ \t]*(?:\r\n|\n|\r|\Z)", re.IGNORECASE)
_LINE_END: Final = re.compile(r"\r\n|\n|\r")
_INTEGER: Final = re.compile(r"[+-]?\d{1,18}", re.ASCII)
_REAL: Final = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eEdD][+-]?\d+)?", re.ASCII)


@np.errstate(all="ignore")  # what overflows is refused as not finite
def read_erd(
    path: str | os.PathLike[str],
    *,
    channels: Sequence[int | str] | None = None,
    station_unit: str | None = None,
    elevation_unit: str | None = None,
    byte_order: Literal["little", "big"] = "little",
    name: str | None = None,
) -> Profile:
    """Read the profile in an ERD file.

    Parameters
    ----------
    path : str or os.PathLike
        The file with the header. Binary numbers are in it, or beside it with the suffix ``.bin``.
    channels : sequence of int or str, optional
        Channels of elevations, counted from 0 or by short or long name; each is a track. By
        default the one that is named an elevation, or profile, or those of the left, right and
        center track; else the only one.
    station_unit, elevation_unit : {"m", "cm", "mm", "km", "in", "ft", "mi", "mil"}, optional
        Units in the file. By default those of the header, and m where it has none.
    byte_order : {"little", "big"}, optional
        Order of the bytes of a binary number; the header does not say.
    name : str, optional
        Name of the profile; by default the title in the header, or the name of the file.

    Returns
    -------
    Profile
        In m, with tracks if there are several; ``.source`` says what was understood of the file.
        Stations start at 0, or at XSTART if the header has it.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    FormatError
        If the file is no ERD file or a damaged one, holds fewer or more numbers than its header
        says, does not say which channels are elevations, or has units that are not of a length.
    ValueError
        If an option is not one of those allowed.

    Notes
    -----
    Where the header has the keywords GAIN or OFFSET, with one number for each channel, an
    elevation is gain times number plus offset, in the unit of its channel.
    """
    check_units(station_unit, elevation_unit)
    if byte_order not in BYTE_ORDERS:
        raise ValueError(f"byte_order must be 'little' or 'big', got {byte_order!r}")
    header = _Header.read(Path(path))
    chosen, tracks = _choose_channels(header, channels)
    stated = [header.unit("XUNITS"), *(header.channels[i].unit for i in chosen)]
    units, units_from = choose_units(header.error, stated, (station_unit, elevation_unit))

    table = _numbers(header, BYTE_ORDERS[byte_order])
    x = _stations(header, table.shape[0], METRES[units[0]])
    z = [
        (header.channels[i].gain * table[:, i] + header.channels[i].offset) * METRES[unit]
        for i, unit in zip(chosen, units[1:], strict=True)
    ]
    for elevation in z:
        if header.encoding == "f4" and np.abs(elevation).max() > MAX_ELEVATION:
            raise header.error(
                f"an elevation of {np.abs(elevation).max():.3g} m, at most {MAX_ELEVATION:g} m is "
                f"believed; the numbers were read in {byte_order}-endian order: pass byte_order="
            )
        if "default" in units_from:
            check_plausible(header.error, x, elevation, units_from)
    source = ProfileSource(
        path=os.fspath(path),
        rows=table.shape[0],
        header=tuple(channel.name for channel in header.channels),
        columns=(-1, *chosen),
        units=units,
        units_from=units_from,
    )
    try:
        return Profile(
            x,
            z[0],
            (header.text("TITLE") or Path(path).stem) if name is None else name,
            source=source,
            tracks=dict(zip(tracks, z, strict=True)) if tracks else None,
        )
    except ValueError as error:  # numbers that fit a file but, in m, no profile
        raise header.error(str(error)) from None


def write_erd(profile: Profile, path: str | os.PathLike[str]) -> None:
    """Write a profile as an ERD file with text numbers, in m, at full precision.

    Each track is a channel. `read_erd` gives the same elevations and, within rounding, stations;
    for tracks that are not left, right or center it needs ``channels=``. The station of the first
    sample, where it is not 0, is kept in the keyword XSTART.

    Parameters
    ----------
    profile : Profile
        Uniform profile.
    path : str or os.PathLike
        File to write; an existing one is replaced.

    Raises
    ------
    ValueError
        If the stations are not uniform, as the file holds their spacing instead of them, or if
        a name of a track is longer than 32 characters.
    """
    if not profile.is_uniform:
        raise ValueError(
            "stations are irregular and an ERD file holds one spacing; "
            "write profile.resample(spacing)"
        )
    columns = dict(profile.tracks) or {"": profile.z}
    width = NAME_WIDTHS["LONGNAME"]
    for track in columns:
        if len(track) > width:
            raise ValueError(f"track {track!r} is longer than {width} characters")
    long = [
        f"{track.capitalize()} elevation" if track in SHORT_NAMES else track for track in columns
    ]
    lines = [
        "ERDFILEV2.00",
        f"{len(columns)}, {profile.x.size}, -1, 1, 5, {_step(profile.x)!r}, -1,",
        f"TITLE   {' '.join(profile.name.split())}",
        _names("SHORTNAM", [SHORT_NAMES.get(track, track[:7] or "Elev.") for track in columns]),
        _names("LONGNAME", [text or "Elevation" for text in long]),
        _names("GENNAME", ["Profile elevation"] * len(columns)),
        _names("UNITSNAM", ["m"] * len(columns)),
        "XLABEL  Distance",
        "XUNITS  m",
        *([f"XSTART  {float(profile.x[0])!r}"] if profile.x[0] != 0.0 else []),
        "END",
    ]
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    with replacing(path) as new, new.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(line.rstrip() + "\n" for line in lines)
        file.writelines(" ".join(map(repr, row)) + "\n" for row in rows)


def _names(keyword: str, names: Sequence[str]) -> str:
    width = NAME_WIDTHS[keyword]
    return f"{keyword:8}" + "".join(name.ljust(width) for name in names)


def _step(x: NDArray[np.float64]) -> float:
    """Spacing that gives the stations `x` back, as exactly as one can."""
    mean = float(x[-1] - x[0]) / (x.size - 1)
    short = float(f"{mean:.9g}")
    return min(short, mean, key=lambda step: np.abs(_grid(float(x[0]), step, x.size) - x).max())


def _grid(start: float, step: float, count: int) -> NDArray[np.float64]:
    return start + step * np.arange(count, dtype=np.float64)


# --- header -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Channel:
    """What the header says of a channel; the unit in lower case, known or not."""

    short: str
    long: str
    general: str
    unit: str | None
    gain: float
    offset: float

    @property
    def name(self) -> str:
        return self.long or self.short or self.general

    @property
    def track(self) -> str | None:
        """Track of `TRACKS` that it is the elevation of, empty for an elevation of none."""
        if self.unit is not None and self.unit not in METRES:
            return None
        found = [track_of(name) for name in (self.long, self.short, self.general)]
        return next(filter(None, found), "" if "" in found else None)


@dataclass(frozen=True)
class _Header:
    """Header of a file, and where in the file it ends."""

    path: Path
    lines: dict[str, int]  # line of each keyword, counted from 1
    texts: dict[str, str]
    channels: list[_Channel]
    samples: int  # of each channel, -1 if the header does not know
    records: int
    record_bytes: int
    encoding: str
    step: float
    end: int  # byte that the data start at
    end_line: int  # line that the data start in
    size: int  # bytes in the file

    @classmethod
    def read(cls, path: Path) -> Self:
        if path.is_dir():
            raise FormatError("is a directory; a file is needed", path=path)
        with path.open("rb") as file:
            start = file.read(MAX_HEADER)
        if not _MAGIC.match(start):
            raise FormatError(
                f"line is {start[:20]!r}; an ERD file starts with ERDFILEV2.00", path=path, line=1
            )
        end = _END.search(start)
        if end is None:
            raise FormatError(
                f"no line END in the first {len(start)} bytes: the header is cut short, or longer "
                f"than {MAX_HEADER} bytes",
                path=path,
            )
        lines = _LINE_END.split(decode_text(start[: end.end()], path))
        layout = _Layout.parse(path, lines)
        numbers, texts = _keywords(lines)
        return cls(
            path=path,
            lines=numbers,
            texts=texts,
            channels=_channels(path, numbers, texts, layout.channels),
            samples=layout.samples,
            records=layout.records,
            record_bytes=layout.record_bytes,
            encoding=layout.encoding,
            step=layout.step,
            end=end.end(),
            end_line=len(lines) if lines[-1] == "" else len(lines) + 1,
            size=path.stat().st_size,
        )

    def text(self, keyword: str) -> str:
        return self.texts.get(keyword, "").strip()

    def unit(self, keyword: str) -> str | None:
        return known_unit(self.text(keyword)) if self.text(keyword) else None

    def real(self, keyword: str) -> float | None:
        """Return the number of a keyword, None without one."""
        text = self.text(keyword)
        if not text:
            return None
        return _reals(self.path, self.lines[keyword], keyword, text, 1)[0]

    def error(self, message: str, line: int | None = None, byte: int | None = None) -> FormatError:
        return FormatError(message, path=self.path, line=line, byte=byte)


@dataclass(frozen=True)
class _Layout:
    """Line 2 of a file."""

    channels: int
    samples: int
    records: int
    record_bytes: int
    encoding: str
    step: float

    @classmethod
    def parse(cls, path: Path, lines: Sequence[str]) -> Self:
        def error(message: str) -> FormatError:
            return FormatError(message, path=path, line=2)

        fields = lines[1].replace(",", " ").split() if len(lines) > 1 else []
        if len(fields) < 6:
            raise error(
                f"{len(fields)} numbers; NCHAN, NSAMP, NRECS, NBYTES, KEYNUM and STEP are needed"
            )
        integers: dict[str, int] = {}
        for key, field in zip(
            ("NCHAN", "NSAMP", "NRECS", "NBYTES", "KEYNUM"), fields, strict=False
        ):
            if not _INTEGER.fullmatch(field):
                raise error(f"{key} {field[:40]!r} is not an integer")
            integers[key] = int(field)
        if not 1 <= integers["NCHAN"] <= MAX_CHANNELS:
            raise error(f"NCHAN is {integers['NCHAN']}, must be 1 to {MAX_CHANNELS}")
        if integers["NSAMP"] != -1 and integers["NSAMP"] < 2:
            raise error(f"NSAMP is {integers['NSAMP']}; a profile needs at least 2 samples")
        if integers["KEYNUM"] not in ENCODINGS:
            raise error(
                f"KEYNUM is {integers['KEYNUM']}; supported are 0 (2-byte integers), 1 (4-byte "
                "reals) and 5 (text)"
            )
        step = _reals(path, 2, "STEP", fields[5], 1)[0]
        if step <= 0.0:
            raise error(f"STEP is {step:g}; a profile needs a positive distance")
        return cls(
            channels=integers["NCHAN"],
            samples=integers["NSAMP"],
            records=integers["NRECS"],
            record_bytes=integers["NBYTES"],
            encoding=ENCODINGS[integers["KEYNUM"]],
            step=step,
        )


def _keywords(lines: Sequence[str]) -> tuple[dict[str, int], dict[str, str]]:
    """Line, counted from 1, and text of each keyword; the first one of each counts."""
    numbers: dict[str, int] = {}
    texts: dict[str, list[str]] = {}
    last: list[str] = []
    for number, line in enumerate(lines[2:], start=3):
        keyword = line[:8].strip().upper()
        if keyword.startswith("&"):  # goes on with the line before
            last.append(line[8:])
            continue
        last = [line[8:]]
        if keyword and not line[0].isspace() and keyword not in texts:
            numbers[keyword], texts[keyword] = number, last
    return numbers, {keyword: "".join(parts) for keyword, parts in texts.items()}


def _channels(
    path: Path, lines: dict[str, int], texts: dict[str, str], count: int
) -> list[_Channel]:
    named = {
        keyword: _fields(texts.get(keyword, ""), width, count)
        for keyword, width in NAME_WIDTHS.items()
    }
    scales = {
        keyword: _reals(path, lines[keyword], keyword, texts[keyword], count)
        if texts.get(keyword, "").strip()
        else [default] * count
        for keyword, default in (("GAIN", 1.0), ("OFFSET", 0.0))
    }
    return [
        _Channel(
            short=named["SHORTNAM"][i],
            long=named["LONGNAME"][i],
            general=named["GENNAME"][i],
            unit=known_unit(named["UNITSNAM"][i]) or None,
            gain=scales["GAIN"][i],
            offset=scales["OFFSET"][i],
        )
        for i in range(count)
    ]


def _fields(text: str, width: int, count: int) -> list[str]:
    """Names of `count` channels, in fields of `width` or, where their number fits, as words."""
    words = text.split() if width == NAME_WIDTHS["SHORTNAM"] else re.split(r"\s{2,}", text.strip())
    if len(words) == count:
        return words
    return [text[width * i : width * (i + 1)].strip() for i in range(count)]


def _reals(path: Path, line: int, keyword: str, text: str, count: int) -> list[float]:
    """Return the `count` finite numbers in the text of a keyword."""
    words = text.replace(",", " ").split()
    if len(words) != count:
        raise FormatError(f"{keyword} has {len(words)} numbers, not {count}", path=path, line=line)
    values = []
    for word in words:
        value = _real(word)
        if value is None or not math.isfinite(value):
            raise FormatError(
                f"{keyword} {word[:40]!r} is not a finite number", path=path, line=line
            )
        values.append(value)
    return values


def _real(word: str) -> float | None:
    """Return a number, also one with the exponent mark D of Fortran."""
    if not _REAL.fullmatch(word):
        return None
    return float(word.replace("D", "e").replace("d", "e"))


# --- channels and stations --------------------------------------------------------------------


def _choose_channels(
    header: _Header, channels: Sequence[int | str] | None
) -> tuple[list[int], tuple[str, ...]]:
    """Channels of elevations, and the names of the tracks if there are several."""
    known = header.channels
    if channels is not None:
        if isinstance(channels, str) or len(channels) == 0:
            raise ValueError(f"channels must be numbers or names, one or more, got {channels!r}")
        chosen = [_find_channel(header, wanted) for wanted in channels]
        if len(set(chosen)) < len(chosen):
            raise header.error(f"channels={channels!r} has the same channel twice")
    else:
        tracks = {i: track for i in range(len(known)) if (track := known[i].track) is not None}
        chosen = in_order_of_tracks(tracks) if tracks else [0]
        if not chosen or (not tracks and len(known) > 1):
            raise header.error(
                f"which of {len(known)} channels ({_shortened(c.name for c in known)}) are "
                "elevations? Pass channels=, names or numbers counted from 0"
            )
    return chosen, name_tracks([known[i].track or known[i].name for i in chosen])


def _find_channel(header: _Header, wanted: int | str) -> int:
    if isinstance(wanted, str):
        key = wanted.strip().lower()
        found = [
            i
            for i, channel in enumerate(header.channels)
            if key in (channel.short.lower(), channel.long.lower(), channel.track)
        ]
    else:
        found = [i for i in range(len(header.channels)) if i == wanted]
    if len(found) != 1:
        raise header.error(
            f"channels: {wanted!r} is {len(found)} of the file's channels, must be one; it has "
            f"0 to {len(header.channels) - 1} ({_shortened(c.name for c in header.channels)})"
        )
    return found[0]


def _shortened(names: Iterator[str]) -> str:
    text = ", ".join(name or "without a name" for name in names)
    return text if len(text) <= 200 else text[:200] + " ..."


def _stations(header: _Header, count: int, metres: float) -> NDArray[np.float64]:
    """Stations, m."""
    return _grid((header.real("XSTART") or 0.0) * metres, header.step * metres, count)


# --- numbers ----------------------------------------------------------------------------------


def _numbers(header: _Header, order: str) -> NDArray[np.float64]:
    """Numbers of the file, shape (samples, channels), all finite."""
    if header.encoding == "text":
        return _text_numbers(header)
    return _binary_numbers(header, np.dtype(order + header.encoding))


def _binary_numbers(header: _Header, dtype: np.dtype[np.generic]) -> NDArray[np.float64]:
    path, start = _data_place(header)
    size = path.stat().st_size - start
    row = len(header.channels) * dtype.itemsize
    samples = _binary_samples(header, path, start, size, row)
    with path.open("rb") as file:
        table = np.fromfile(
            file, dtype=dtype, count=samples * len(header.channels), offset=start
        ).astype(np.float64)
    finite = np.isfinite(table)
    if not finite.all():
        first = int(np.argmin(finite))
        raise FormatError(
            f"sample {first // len(header.channels)} is {table[first]:g}; it must be finite",
            path=path,
            byte=start + first * dtype.itemsize,
        )
    return table.reshape(samples, len(header.channels))


def _data_place(header: _Header) -> tuple[Path, int]:
    """File and byte at which the binary numbers start."""
    with header.path.open("rb") as file:
        file.seek(header.end)
        rest = file.read(80)
    beside = [header.path.with_suffix(".bin"), header.path.with_name(header.path.name + ".bin")]
    if not rest.strip():
        for path in beside:
            if path != header.path and path.is_file():
                return path, 0
    if not rest:
        raise header.error(
            f"ends with its header, and the file of its binary numbers, {beside[0].name}, is "
            "missing",
            byte=header.size,
        )
    return header.path, header.end


def _binary_samples(header: _Header, path: Path, start: int, size: int, row: int) -> int:
    """Count the samples in `size` bytes, of which one has `row`; check the header."""
    record, records = header.record_bytes, header.records
    if records > 1 and record > 1 and record % row and row % record:
        raise header.error(
            f"NBYTES is {record}: records of {record} bytes hold no whole number of samples of "
            f"{row} bytes",
            line=2,
        )
    if header.samples == -1:
        if size % row or size < 2 * row:
            raise FormatError(
                f"{size} bytes of numbers are no whole number, 2 or more, of samples of {row} "
                "bytes: the file is cut short or damaged",
                path=path,
                byte=start + size - size % row,
            )
        return size // row
    needed = header.samples * row
    if size < needed:
        raise FormatError(
            f"cut short: {size} bytes of numbers, {header.samples} samples of {row} bytes are "
            f"{needed} bytes",
            path=path,
            byte=start + size,
        )
    if size > needed and size != records * record and size - needed >= record:
        raise FormatError(
            f"{size} bytes of numbers, {header.samples} samples of {row} bytes are {needed} bytes",
            path=path,
            byte=start + needed,
        )
    return header.samples


def _text_numbers(header: _Header) -> NDArray[np.float64]:
    """Numbers below the header; each line has the same number of them, but for the last."""
    channels, samples = len(header.channels), header.samples
    size = header.size - header.end
    if samples * channels * 2 > size + 1:  # a digit and a blank each
        raise header.error(
            f"cut short: {size} bytes of text cannot hold the {samples} samples of {channels} "
            "channels that NSAMP and NCHAN say",
            line=2,
        )
    with header.path.open("rb") as file:
        file.seek(header.end)
        content = file.read().rstrip(b"\x1a\x00 \t\r\n")
    lines = _LINE_END.split(decode_text(content, header.path, header.end).replace(",", " "))
    numbers, width = _numbers_of_lines(header, lines)
    count = numbers.size if samples == -1 else samples * channels
    in_step = samples != -1 or width % channels == 0 or channels % width == 0
    if numbers.size != count or count % channels or count < 2 * channels or not in_step:
        what = "whole samples, 2 or more," if samples == -1 else f"{samples} samples"
        raise header.error(
            f"{'cut short' if numbers.size < count else 'damaged'}: {numbers.size} numbers in the "
            f"file, {width} in a line, {what} of {channels} channels are needed",
            line=header.end_line + len(lines) - 1,
        )
    return numbers.reshape(-1, channels)


def _numbers_of_lines(header: _Header, lines: Sequence[str]) -> tuple[NDArray[np.float64], int]:
    """Numbers in the lines, all finite, and how many a line has."""
    if not any(map(str.strip, lines)):
        return np.empty(0), 1
    try:
        table = np.loadtxt(lines, comments=None, ndmin=2)
    except ValueError:
        return _numbers_line_by_line(header, lines)
    if not np.isfinite(table).all():
        return _numbers_line_by_line(header, lines)
    return table.ravel(), table.shape[1]


def _numbers_line_by_line(header: _Header, lines: Sequence[str]) -> tuple[NDArray[np.float64], int]:
    """Slower than `numpy.loadtxt`: D exponents, a short last line, and the line to blame."""
    numbers: list[float] = []
    width, last = 0, max(i for i, line in enumerate(lines) if line.strip())
    for i, line in enumerate(lines):
        words = line.split()
        for word in words:
            value = _real(word)
            if value is None or not math.isfinite(value):
                raise header.error(
                    f"{word[:40]!r} is not a finite number", line=header.end_line + i
                )
            numbers.append(value)
        width = width or len(words)
        if len(words) > width or (0 < len(words) < width and i < last):
            raise header.error(
                f"{len(words)} numbers, lines before it have {width}", line=header.end_line + i
            )
    return np.array(numbers), width
