"""Road surfaces in ASAM OpenCRG files (``.crg``): profiles along lateral positions.

An OpenCRG file holds elevations on a grid along a reference line: u is the station on that line
and v the lateral position, positive to the left, both in m. What is read here follows the
specification, ASAM OpenCRG 1.2.0, chapter 6 (6.2 file structure, 6.4.2 road parameters, 6.4.4
data definition, 6.4.6 modifiers, 6.4.8 road data), and, where that leaves something open, the
functions ``crg_read``, ``crg_check_data`` and ``crg_eval_uv2z`` published with it.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Final, Literal, Self

import numpy as np
from numpy.typing import NDArray

from pavefem.errors import FormatError
from pavefem.profile import Profile, ProfileSource

MAX_HEADER: Final = 1024 * 1024
"""Bytes within which the header has to end; 14 000 channels fit, each with a full line."""

HEADER_RECORD: Final = 72
"""Bytes of a header line that count; the specification has the rest ignored."""

RECORD: Final = 80
"""Bytes of a record of road data."""

ENCODINGS: Final[dict[str, tuple[Literal["text", "binary"], int]]] = {
    "KRBI": ("binary", 4),
    "KDBI": ("binary", 8),
    "LRFI": ("text", 10),
    "LDFI": ("text", 20),
}
"""Kind of the road data, and bytes of one number: 20, 10, 8 and 4 numbers fill a record."""

REFERENCE_UNITS: Final[dict[str, str]] = {
    "u": "m",
    "x": "m",
    "y": "m",
    "phi": "rad",
    "slope": "m/m",
    "banking": "m/m",
}
"""Channels of the reference line, and the only unit of each."""

SCALES: Final = (
    "SCALE_Z_GRID",
    "SCALE_SLOPE",
    "SCALE_BANKING",
    "SCALE_LENGTH",
    "SCALE_WIDTH",
)

TOLERANCE: Final = 1e-4
"""Distance (m) within which positions agree: CHECK_TOL of the specification by default."""

RELATIVE_TOLERANCE: Final = 1e-6
"""The same as a fraction of the length, for slopes, and for v on a long section: CHECK_EPS."""

_DIGITS: Final = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_NUMBER: Final = re.compile(_DIGITS, re.A)
_SECTION_MARK: Final = re.compile(r"\$(\w*)", re.A)
_POSITION: Final = re.compile(rf"long section\s+at v\s*=\s*({_DIGITS})", re.A | re.I)
_INDEX: Final = re.compile(r"long section\s+(\d+)", re.A | re.I)
_REFERENCE: Final = re.compile(r"reference line\s*(.*)", re.I)
_NOT_TEXT: Final = re.compile(rb"[^\x20-\x7e\r\n]")


@dataclass(frozen=True)
class CrgSource(ProfileSource):
    """What was understood of an OpenCRG file that a profile was read from.

    Of the fields of `ProfileSource`, `rows` counts the cross sections of the file, `header` has
    its channels, and `columns` has for each track the channel of the long section on it or next
    to it on the right.

    Parameters
    ----------
    encoding : {"KRBI", "KDBI", "LRFI", "LDFI"}
        Encoding of the road data: binary or text, in single or double precision.
    v : tuple of float
        Lateral position of each track that was read, m; positive to the left of the reference
        line.
    sections : tuple of (float, float)
        Lateral positions (m) of the long sections between which each track is interpolated;
        twice the same where the track is on one.
    trimmed : tuple of int
        Cross sections without an elevation on every track, left out at the start and at the end.
    """

    encoding: str = "KRBI"
    v: tuple[float, ...] = (0.0,)
    sections: tuple[tuple[float, float], ...] = ((0.0, 0.0),)
    trimmed: tuple[int, int] = (0, 0)


def read_crg(
    path: str | os.PathLike[str],
    *,
    v: float | Sequence[float] | Mapping[str, float] = 0.0,
    name: str | None = None,
) -> Profile:
    """Read the profile of an OpenCRG road along one lateral position, or along several.

    Elevation is that of the long sections, linear between them, plus the elevation of the
    reference line and `v` times its banking (``crg_eval_uv2z``)::

        z(u) = z_grid(u, v) + z_ref(u) + v b(u)

    z_ref starts at REFERENCE_LINE_START_Z and integrates the slope. Slope and banking are
    channels or constants of the header; the first value of a slope channel does not count, each
    other one holds from the cross section before it.

    Parameters
    ----------
    path : str or os.PathLike
        File.
    v : float, sequence of float, or mapping of str to float, optional
        Lateral position, m; positive to the left of the reference line, 0 on it. Several give a
        profile with tracks: ``{"left": 0.9, "right": -0.9}``, or named after their positions.
    name : str, optional
        Name of the profile; that of the file by default.

    Returns
    -------
    Profile
        Stations u and elevations in m; ``.source`` is a `CrgSource`.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    FormatError
        If the file is damaged, contradicts itself, refers to another file, is in other units, or
        if `v` is outside the road or has stations without elevation between others with one.
    ValueError
        If `v` is not finite, empty, or twice the same position.

    Notes
    -----
    Missing elevations (NaN) are left out at the two ends of the profile, for all tracks where one
    has none, which ``.source.trimmed`` counts. Between stations with an elevation they are
    refused.

    Of the modifiers in the file, those that scale are applied. Those that move the road as a
    whole are not, and neither is the offset to global elevations, REFERENCE_LINE_OFFSET_Z: they
    add a constant. Options, which applications need not follow, are not applied.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> text = '''$ROAD_CRG
    ... REFERENCE_LINE_INCREMENT = 0.5
    ... $
    ... $KD_DEFINITION
    ... #:LRFI
    ... D:long section at v = -1.0,m
    ... D:long section at v =  1.0,m
    ... $
    ... $$
    ...  0.0000000 0.0100000
    ...  0.0200000 0.0000000
    ... '''
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "site.crg"
    ...     _ = path.write_text(text)
    ...     profile = read_crg(path, v=0.5)
    >>> profile.x.tolist(), profile.z.tolist()
    ([0.0, 0.5], [0.0075, 0.005])
    """
    tracks = _positions(v)
    title = Path(path).stem if name is None else name
    return _Road.read(Path(path)).profile(list(tracks.values()), list(tracks), title)


def _positions(v: float | Sequence[float] | Mapping[str, float]) -> dict[str, float]:
    """Lateral position (m) of each track, by name; one without a name for a number."""
    if isinstance(v, (str, bytes)):
        raise ValueError(f"v must be finite lateral positions in m, got {v!r}")
    if isinstance(v, Mapping):
        named = dict(v)
        for name in named:
            if not (isinstance(name, str) and name.isprintable() and name.strip() == name != ""):
                raise ValueError(f"name of a track must be printable text, got {name!r}")
    elif isinstance(v, (Sequence, np.ndarray)):
        named = {f"v = {value} m": value for value in v}
        if len(named) != len(v):
            raise ValueError(f"v has a position twice: {v!r}")
    else:
        named = {"": v}
    for value in named.values():
        number = isinstance(value, (int, float, np.integer, np.floating))
        if not number or not math.isfinite(value):
            raise ValueError(f"v must be finite lateral positions in m, got {value!r}")
    if not named:
        raise ValueError("v has no position; at least one is needed")
    return {name: float(value) for name, value in named.items()}


# --- header -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Header:
    """Sections of the header: their lines, without comments, and the numbers of those lines."""

    path: Path
    sections: dict[str, list[tuple[int, str]]]
    lines: int  # of the header, counting the one that ends it
    size: int  # in bytes

    @classmethod
    def read(cls, path: Path, file: BinaryIO) -> Self:
        head = file.read(MAX_HEADER)
        sections: dict[str, list[tuple[int, str]]] = {}
        section, opened = "", 0
        number = start = 0
        while True:
            end = head.find(b"\n", start)
            number += 1
            if end < 0 and "ROAD_CRG_FILE" in sections:  # needs no road data
                return cls(path, sections, number, len(head))
            if end < 0:
                raise FormatError(
                    f"no line with $$ ends the header within {len(head)} bytes: no OpenCRG file, "
                    "or cut short",
                    path=path,
                    line=number,
                )
            line = head[start : min(end, start + HEADER_RECORD)].decode("latin-1")
            start = end + 1
            if line.startswith("$"):
                mark = _SECTION_MARK.match(line)
                name = "" if mark is None else mark[1].upper()
                if section and (name or line.startswith("$$")):
                    raise FormatError(
                        f"section ${section} of line {opened} is not closed by a line with $",
                        path=path,
                        line=number,
                    )
                if line.startswith("$$"):
                    return cls(path, sections, number, start)
                if name in sections:
                    raise FormatError(f"a second section ${name}", path=path, line=number)
                section, opened = name, number
                if name:
                    sections[name] = []
            elif section and section != "CT" and not line.lstrip().startswith("*"):
                content = line.partition("!")[0].strip()
                if content:
                    sections[section].append((number, content))

    def error(self, message: str, line: int | None = None) -> FormatError:
        return FormatError(message, path=self.path, line=line)

    def parameters(self, section: str) -> _Parameters:
        entries: dict[str, tuple[int, str]] = {}
        for line, text in self.sections.get(section, []):
            key, equals, value = (part.strip() for part in text.partition("="))
            if not equals:
                raise self.error(f"{text!r} is not PARAMETER = value", line)
            if key.upper() in entries:
                raise self.error(f"a second value of {key}", line)
            entries[key.upper()] = (line, value)
        return _Parameters(self, entries)


@dataclass(frozen=True)
class _Parameters:
    """Parameters of one section, by upper-case name: line and value as written."""

    header: _Header
    entries: dict[str, tuple[int, str]]

    def __contains__(self, key: str) -> bool:
        return key in self.entries

    def line(self, key: str) -> int | None:
        return self.entries[key][0] if key in self.entries else None

    def get(self, key: str, default: float) -> float:
        if key not in self.entries:
            return default
        line, text = self.entries[key]
        value = float(text) if _NUMBER.fullmatch(text) else math.nan
        if not math.isfinite(value):
            raise self.header.error(f"{key} {text!r} is not a finite number", line)
        return value

    def error(self, message: str, key: str) -> FormatError:
        return self.header.error(message, self.line(key))


# --- channels ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Channels:
    """Columns of the road data: long sections from right to left, and the reference line's."""

    encoding: str
    names: list[str]
    v: NDArray[np.float64]  # of each long section, increasing
    columns: list[int]  # of each long section
    reference: dict[str, int]  # column of each channel of the reference line

    @classmethod
    def parse(cls, header: _Header, road: _Parameters) -> Self:
        encoding = ""
        names: list[str] = []
        reference: dict[str, int] = {}
        positions: list[tuple[float, int]] = []
        indices: list[tuple[int, int]] = []
        first_line = None
        for line, text in header.sections["KD_DEFINITION"]:
            kind, content = text[:2].upper(), text[2:].strip()
            if kind == "#:":
                if encoding or content.upper() not in ENCODINGS:
                    raise header.error(
                        f"encoding {content!r} must be one of {', '.join(ENCODINGS)}, once", line
                    )
                encoding = content.upper()
            if kind not in ("D:", "U:"):
                continue
            name, _, unit = (part.strip() for part in content.partition(","))
            allowed = _allowed_unit(header, name, line)
            if kind == "U:":  # not in the data: without meaning beside the header, but for its unit
                unit = unit.partition(",")[0].strip()
            if allowed is not None and unit.lower() != allowed:
                raise header.error(f"unit {unit!r} of {name!r} must be {allowed}", line)
            if kind == "U:":
                continue
            column = len(names)
            names.append(content)
            if (match := _POSITION.fullmatch(name)) is not None:
                positions.append((float(match[1]), column))
            elif (match := _INDEX.fullmatch(name)) is not None:
                indices.append((int(match[1]), column))
            elif (match := _REFERENCE.fullmatch(name)) is not None:
                if match[1].lower() in reference:
                    raise header.error(f"a second channel {name!r}", line)
                reference[match[1].lower()] = column
                continue
            else:
                continue
            first_line = first_line or line
        if not positions and not indices:
            raise header.error("no long section is defined: there are no elevations")
        if positions and indices:
            raise header.error(
                "some long sections are defined by number, some by position: all must be alike",
                first_line,
            )
        if positions:
            positions.sort()
            v = np.array([position for position, _ in positions])
            _check_borders(road, v)
            columns = [column for _, column in positions]
        else:
            indices.sort()
            if [index for index, _ in indices] != list(range(1, len(indices) + 1)):
                raise header.error(
                    f"long sections must be numbered from 1 to {len(indices)}, each once",
                    first_line,
                )
            v = _numbered_positions(header, road, len(indices))
            columns = [column for _, column in indices]
        if not (np.isfinite(v).all() and (np.diff(v) > 0.0).all()):
            raise header.error("lateral positions of long sections must be finite and distinct")
        return cls(encoding or "KRBI", names, v, columns, reference)


def _allowed_unit(header: _Header, name: str, line: int) -> str | None:
    """Only unit of a channel; None for one that is no elevation and is skipped."""
    if name.lower().startswith("long section"):
        if not _POSITION.fullmatch(name) and not _INDEX.fullmatch(name):
            raise header.error(f"{name!r} has neither a number nor 'at v = ' and a position", line)
        return "m"
    match = _REFERENCE.fullmatch(name)
    if match is None:
        return None
    if match[1].lower() not in REFERENCE_UNITS:
        raise header.error(
            f"{name!r} is not a channel of the reference line; those are "
            f"{', '.join(REFERENCE_UNITS)}",
            line,
        )
    return REFERENCE_UNITS[match[1].lower()]


def _check_borders(road: _Parameters, v: NDArray[np.float64]) -> None:
    for key, border in (("LONG_SECTION_V_RIGHT", v[0]), ("LONG_SECTION_V_LEFT", v[-1])):
        stated = road.get(key, float(border))
        if not abs(stated - border) <= TOLERANCE:
            raise road.error(
                f"{key} {stated:g} m contradicts the long section at {border:g} m", key
            )


def _numbered_positions(header: _Header, road: _Parameters, count: int) -> NDArray[np.float64]:
    """Lateral positions of `count` sections; centred where the header has only an increment."""
    right, left, step = (f"LONG_SECTION_V_{end}" for end in ("RIGHT", "LEFT", "INCREMENT"))
    if step not in road:
        if right not in road or left not in road or count < 2:
            raise header.error(f"numbered long sections need {step}, or {right} and {left}")
        return np.linspace(road.get(right, 0.0), road.get(left, 0.0), count)
    increment = road.get(step, 0.0)
    if increment <= 0.0:
        raise road.error(f"{step} must be positive, got {increment:g} m", step)
    width = increment * (count - 1)
    start = road.get(right, road.get(left, 0.5 * width) - width)
    if not abs(start + width - road.get(left, start + width)) <= TOLERANCE:
        raise road.error(
            f"{count} long sections every {increment:g} m from {start:g} m end at "
            f"{start + width:g} m, not at {left} {road.get(left, 0.0):g} m",
            left,
        )
    return start + increment * np.arange(count, dtype=np.float64)


# --- road data --------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Data:
    """Road data, shape (cross sections, channels), and where its numbers stand in the file."""

    path: Path
    values: NDArray[np.floating[Any]]
    start: int  # byte of the first number, or line of the first record
    kind: Literal["text", "binary"]
    size: int  # bytes of a number

    def error_at(self, message: str, row: int, column: int) -> FormatError:
        if self.kind == "binary":
            number = row * self.values.shape[1] + column
            return FormatError(message, path=self.path, byte=self.start + number * self.size)
        per_record = RECORD // self.size
        records = -(-self.values.shape[1] // per_record)
        line = self.start + row * records + column // per_record
        return FormatError(message, path=self.path, line=line)

    def column(self, column: int) -> NDArray[np.float64]:
        return self.values[:, column].astype(np.float64)


def _read_binary(
    header: _Header, file: BinaryIO, channels: int, size: int, rows: int | None
) -> _Data:
    """Big-endian numbers without a break; the last record is filled with NaN."""
    payload = os.fstat(file.fileno()).st_size - header.size
    end = header.size + payload
    if payload % RECORD:
        raise FormatError(
            f"road data of {payload} bytes is not a multiple of {RECORD}: damaged or cut short",
            path=header.path,
            byte=end,
        )
    count, per_record = payload // size, RECORD // size
    whole = count // channels
    if rows is not None:
        needed = -(-rows * channels // per_record) * RECORD
        if needed != payload:
            raise FormatError(
                f"road data of {payload} bytes; {rows} cross sections of {channels} channels, as "
                f"many as REFERENCE_LINE_END_U says, fill {needed}: damaged or cut short",
                path=header.path,
                byte=end,
            )
    elif count - whole * channels >= per_record:
        raise FormatError(
            f"road data ends within cross section {whole + 1} of {channels} channels: damaged or "
            "cut short",
            path=header.path,
            byte=end,
        )
    file.seek(header.size)
    content = file.read(payload)
    if len(content) != payload:
        raise FormatError("changes while it is read", path=header.path, byte=header.size)
    numbers = np.frombuffer(content, f">f{size}")
    # fewer than per_record numbers are filling: as many cross sections as are not
    least = max(0, -(-(count - per_record + 1) // channels))
    filled = np.flatnonzero(~np.isnan(numbers[least * channels :]))
    used = least if filled.size == 0 else least + int(filled[-1]) // channels + 1
    used = used if rows is None else rows
    if used > whole or not np.isnan(numbers[used * channels :]).all():
        raise FormatError(
            f"what follows cross section {min(used, whole)} is not filled with NaN: damaged",
            path=header.path,
            byte=header.size + min(used, whole) * channels * size,
        )
    values = numbers[: used * channels].reshape(used, channels)
    return _Data(header.path, values, header.size, "binary", size)


def _read_text(
    header: _Header, file: BinaryIO, channels: int, width: int, rows: int | None
) -> _Data:
    """Fields of fixed width, 80 characters to a line; each cross section starts on a new one."""
    file.seek(header.size)
    content = file.read()
    first = header.lines + 1
    other = _NOT_TEXT.search(content)
    if other is not None:
        raise FormatError(
            f"road data is not text: it holds the byte 0x{content[other.start()]:02x}",
            path=header.path,
            line=first + content.count(b"\n", 0, other.start()),
        )
    per_record = RECORD // width
    records = -(-channels // per_record)
    fields = np.full(records, per_record)
    fields[-1] = channels - (records - 1) * per_record
    lines = content.split(b"\n")
    cut_short = lines[-1].strip() != b""  # the last line has no end
    full = int(fields[(len(lines) - 1) % records]) * width
    if cut_short and len(lines[-1]) < full:
        raise FormatError(
            "road data ends within a record: cut short",
            path=header.path,
            line=first + len(lines) - 1,
        )
    lines = [line.rstrip() for line in lines]
    while lines and not lines[-1]:
        lines.pop()
    found, rest = divmod(len(lines), records)
    if rest or (rows is not None and rows != found):
        needed = "" if rows is None else f"; REFERENCE_LINE_END_U says {rows} cross sections"
        raise FormatError(
            f"road data has {len(lines)} records, {records} to a cross section{needed}: damaged "
            "or cut short",
            path=header.path,
            line=first + max(0, len(lines) - 1),
        )
    length = np.fromiter(map(len, lines), np.int64, len(lines)).reshape(found, records)
    wrong = (length > fields * width) | (length <= (fields - 1) * width)
    if wrong.any():
        i = int(np.argmax(wrong))
        raise FormatError(
            f"record of {length.flat[i]} characters; it must hold {fields[i % records]} fields of "
            f"{width}",
            path=header.path,
            line=first + i,
        )
    cells = np.frombuffer(b"".join(line.ljust(RECORD) for line in lines), f"S{width}")
    cells = cells.reshape(found, records * per_record)[:, :channels]
    data = _Data(header.path, np.full(cells.shape, np.nan), first, "text", width)
    missing = np.char.startswith(np.char.lstrip(cells), b"*")
    try:
        plain = cells[~missing]
        if plain.tobytes().translate(None, b"0123456789+-.eE "):
            raise ValueError("not only numbers")
        data.values[~missing] = plain.astype(np.float64)
    except ValueError:
        for row, column in np.argwhere(~missing).tolist():
            cell = cells[row, column].decode("ascii")
            if not _NUMBER.fullmatch(cell.strip()):
                raise data.error_at(f"{cell!r} is not a number", row, column) from None
        raise FormatError("road data has fields that are no numbers", path=header.path) from None
    return data


# --- the road ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Road:
    """Elevations on the grid, and what the reference line adds to them."""

    path: Path
    channels: _Channels
    data: _Data
    u: NDArray[np.float64]  # stations, m
    v: NDArray[np.float64]  # lateral positions of the long sections, m
    scale: float  # of the elevations on the grid
    z_ref: NDArray[np.float64]  # elevation of the reference line, m
    banking: NDArray[np.float64]  # m/m
    fills: str | None  # modifier of the file that fills missing elevations

    @classmethod
    @np.errstate(all="ignore")  # what overflows is refused as not finite
    def read(cls, path: Path) -> Self:
        if path.exists() and not path.is_file():
            raise FormatError("is a directory or a device; a file is needed", path=path)
        with path.open("rb") as file:
            header = _Header.read(path, file)
            _check_sections(header)
            road, modifiers = (header.parameters(f"ROAD_CRG{end}") for end in ("", "_MODS"))
            channels = _Channels.parse(header, road)
            rows = _stated_rows(road)
            kind, size = ENCODINGS[channels.encoding]
            read = _read_binary if kind == "binary" else _read_text
            data = read(header, file, len(channels.names), size, rows)
        found = data.values.shape[0]
        if found < 2:
            raise header.error(f"road data has {found} cross sections, at least 2 are needed")
        z_grid, slope, banking, length, width = (_scale(modifiers, key) for key in SCALES)
        start, increment = (
            road.get(f"REFERENCE_LINE_{key}", 0.0) for key in ("START_U", "INCREMENT")
        )
        _check_stations(channels, data, start, increment)
        z_start, rise = _reference_line(road, channels, data, increment)
        return cls(
            path,
            channels,
            data,
            start + length * increment * np.arange(found, dtype=np.float64),
            width * channels.v,
            z_grid,
            z_start + slope * length * rise,
            banking * _banking(road, channels, data),
            _fill_mode(modifiers),
        )

    @np.errstate(all="ignore")
    def profile(self, v: list[float], names: list[str], title: str) -> Profile:
        """Profile along each of `v` (m); a name of one track may be empty."""
        neighbours = [self._neighbours(position) for position in v]
        z = np.array([self._elevation(*place) for place in zip(v, neighbours, strict=True)])
        start, stop = self._measured(z, v, neighbours)
        rows, tracks = self.u.size, dict(zip(names, z[:, start:stop], strict=True))
        channels = self.channels
        source = CrgSource(
            path=os.fspath(self.path),
            rows=rows,
            header=tuple(channels.names),
            columns=(-1, *(channels.columns[right] for right, _, _ in neighbours)),
            units=("m",) * (1 + len(v)),
            units_from=("default", *["header"] * len(v)),
            encoding=channels.encoding,
            v=tuple(v),
            sections=tuple((float(self.v[i]), float(self.v[j])) for i, j, _ in neighbours),
            trimmed=(start, rows - stop),
        )
        u = self.u[start:stop]
        try:
            return Profile(u, z[0, start:stop], title, source, tracks if names[0] else None)
        except ValueError as error:  # numbers that fit a file, but no profile
            raise FormatError(str(error), path=self.path) from None

    def _elevation(self, v: float, neighbours: tuple[int, int, float]) -> NDArray[np.float64]:
        right, left, weight = neighbours
        z = self.data.column(self.channels.columns[right])
        if right != left:
            z = (1.0 - weight) * z + weight * self.data.column(self.channels.columns[left])
        return self.scale * z + self.z_ref + v * self.banking

    def _neighbours(self, v: float) -> tuple[int, int, float]:
        """Long sections right and left of `v`, and the weight of the left one."""
        first, last = float(self.v[0]), float(self.v[-1])
        margin = RELATIVE_TOLERANCE * max(1.0, last - first)
        if not first - margin <= v <= last + margin:
            raise FormatError(
                f"v = {v:g} m is outside the road, {first:g} to {last:g} m", path=self.path
            )
        if self.v.size == 1:
            return 0, 0, 0.0
        right = int(np.clip(np.searchsorted(self.v, v, side="right") - 1, 0, self.v.size - 2))
        weight = float((v - self.v[right]) / (self.v[right + 1] - self.v[right]))
        if weight < RELATIVE_TOLERANCE:
            return right, right, 0.0
        if weight > 1.0 - RELATIVE_TOLERANCE:
            return right + 1, right + 1, 0.0
        return right, right + 1, weight

    def _measured(
        self, z: NDArray[np.float64], v: list[float], neighbours: list[tuple[int, int, float]]
    ) -> tuple[int, int]:
        """First row with an elevation on every track, and the row after the last one."""
        known: NDArray[np.bool_] = np.logical_not(np.isnan(z).any(axis=0))
        if not known.any():
            raise FormatError(
                f"no station has an elevation at v = {_listed(v)} m; {self._complete()}",
                path=self.path,
            )
        start, stop = int(np.argmax(known)), known.size - int(np.argmax(known[::-1]))
        if self.fills is not None and not known.all():
            raise FormatError(
                f"{np.count_nonzero(~known)} of {known.size} stations have no elevation at "
                f"v = {_listed(v)} m, and {self.fills} of the file would make one up: choose "
                f"another v; {self._complete()}",
                path=self.path,
            )
        measured: NDArray[np.bool_] = np.isfinite(z[:, start:stop])
        if not measured.all():
            row = start + int(np.argmin(measured.all(axis=0)))
            track = int(np.argmin(measured[:, row - start]))
            columns = [self.channels.columns[i] for i in neighbours[track][:2]]
            unknown = [c for c in columns if not np.isfinite(self.data.values[row, c])]
            what = "infinite" if np.isinf(z[track, row]) else "missing, between others"
            raise self.data.error_at(
                f"elevation at station {self.u[row]:g} m and v = {v[track]:g} m is {what}; "
                f"{self._complete()}",
                row,
                (unknown or columns)[0],
            )
        return start, stop

    def _complete(self) -> str:
        """Say where on the road there are no missing elevations."""
        complete = self.v[~np.isnan(self.data.values[:, self.channels.columns]).any(axis=0)]
        if complete.size == 0:
            return "no long section is complete"
        return f"long sections from {complete[0]:g} to {complete[-1]:g} m are complete"


def _listed(v: list[float]) -> str:
    return " or ".join(f"{position:g}" for position in v)


def _check_sections(header: _Header) -> None:
    if "ROAD_CRG_FILE" in header.sections:
        lines = header.sections["ROAD_CRG_FILE"]
        name = "".join(text for _, text in lines)
        raise header.error(
            f"refers to {name!r}, which is not followed: read that file itself",
            lines[0][0] if lines else None,
        )
    for name in ("ROAD_CRG", "KD_DEFINITION"):
        if name not in header.sections:
            raise header.error(f"the header has no section ${name}: no OpenCRG road")


def _stated_rows(road: _Parameters) -> int | None:
    """Cross sections that the header calls for, if it says where the reference line ends."""
    increment_key, end_key = "REFERENCE_LINE_INCREMENT", "REFERENCE_LINE_END_U"
    if increment_key not in road:
        raise road.error(f"section $ROAD_CRG has no {increment_key}", increment_key)
    increment = road.get(increment_key, 0.0)
    if increment <= 0.0:
        raise road.error(f"{increment_key} must be positive, got {increment:g} m", increment_key)
    start = road.get("REFERENCE_LINE_START_U", 0.0)
    if end_key not in road:
        return None
    end = road.get(end_key, 0.0)
    steps = (end - start) / increment
    if not 0.5 < steps < 2.0**53:
        raise road.error(
            f"{end_key} {end:g} m must be at least {increment:g} m after the start, {start:g} m",
            end_key,
        )
    rows = round(steps) + 1
    tolerance = max(TOLERANCE, RELATIVE_TOLERANCE * (end - start))
    if not abs(start + (rows - 1) * increment - end) <= tolerance:
        raise road.error(
            f"from {start:g} to {end:g} m is no whole number of {increment_key} {increment:g} m",
            end_key,
        )
    return rows


def _check_stations(channels: _Channels, data: _Data, start: float, increment: float) -> None:
    """Refuse a channel of stations that are not those of the header."""
    if "u" not in channels.reference:
        return
    column = channels.reference["u"]
    stations = start + increment * np.arange(data.values.shape[0], dtype=np.float64)
    same = np.abs(data.column(column) - stations) <= 0.03 * increment
    if not same.all():
        row = int(np.argmin(same))
        raise data.error_at(
            f"station {data.values[row, column]:g} m should be {stations[row]:g} m by the header",
            row,
            column,
        )


def _reference_line(
    road: _Parameters, channels: _Channels, data: _Data, increment: float
) -> tuple[float, NDArray[np.float64]]:
    """Elevation of the first cross section of the reference line, and the rise from it, m.

    A slope belongs to the step that ends at its cross section: the first value is not used. What
    is missing to REFERENCE_LINE_END_Z, within the tolerance, is spread over the length.
    """
    start = road.get("REFERENCE_LINE_START_Z", 0.0)
    steps = np.arange(data.values.shape[0], dtype=np.float64)
    if "slope" in channels.reference:
        slope = _complete_column(data, channels.reference["slope"], "slope", first=1)
        rise = increment * np.append(0.0, np.cumsum(slope))
    else:
        rise = increment * steps * _constant(road, "S", "slope")
    if "REFERENCE_LINE_END_Z" in road:
        missing = road.get("REFERENCE_LINE_END_Z", 0.0) - start - float(rise[-1])
        tolerance = max(TOLERANCE, RELATIVE_TOLERANCE * increment * (steps.size - 1))
        if not abs(missing) <= tolerance:
            raise road.error(
                f"slopes from {start:g} m end {abs(missing):.4g} m from REFERENCE_LINE_END_Z, at "
                f"most {tolerance:.4g} m is rounding",
                "REFERENCE_LINE_END_Z",
            )
        rise = rise + missing * steps / (steps.size - 1)
    return start, rise


def _banking(road: _Parameters, channels: _Channels, data: _Data) -> NDArray[np.float64]:
    if "banking" in channels.reference:
        return _complete_column(data, channels.reference["banking"], "banking")
    return np.full(data.values.shape[0], _constant(road, "B", "banking"))


def _constant(road: _Parameters, letter: str, name: str) -> float:
    """Slope or banking of the header, which must not vary without a channel."""
    start_key, end_key = (f"REFERENCE_LINE_{end}_{letter}" for end in ("START", "END"))
    start = road.get(start_key, 0.0)
    end = road.get(end_key, start)
    if not abs(end - start) <= RELATIVE_TOLERANCE:
        raise road.error(
            f"{name} is {start:g} at the start and {end:g} at the end, but has no channel", end_key
        )
    return start


def _complete_column(data: _Data, column: int, name: str, first: int = 0) -> NDArray[np.float64]:
    values = data.column(column)[first:]
    known = np.isfinite(values)
    if not known.all():
        row = first + int(np.argmin(known))
        raise data.error_at(
            f"{name} of the reference line at cross section {row + 1} is missing or infinite",
            row,
            column,
        )
    return values


def _scale(modifiers: _Parameters, key: str) -> float:
    scale = modifiers.get(key, 1.0)
    if scale == 0.0 or (scale < 0.0 and key in ("SCALE_LENGTH", "SCALE_WIDTH")):
        raise modifiers.error(f"{key} {scale:g} has no clear meaning; leave it out", key)
    return scale


def _fill_mode(modifiers: _Parameters) -> str | None:
    default = 2.0 if "GRID_NAN_OFFSET" in modifiers else 0.0
    mode = modifiers.get("GRID_NAN_MODE", default)
    return None if mode == 0.0 else f"GRID_NAN_MODE {mode:g}"
