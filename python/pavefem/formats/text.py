"""Profiles in columns of text: one line per station, any usual delimiter and decimal mark.

What a file does not say is not guessed: where two readings are possible, the file is refused and
the message names the option that decides. What was understood is kept in `Profile.source`.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Final, Literal, Self

import numpy as np
from numpy.typing import NDArray

from pavefem.errors import FormatError
from pavefem.profile import UNIFORM_TOLERANCE, Profile, ProfileSource, uniform_grid

METRES: Final[dict[str, float]] = {
    "m": 1.0,
    "cm": 0.01,
    "mm": 0.001,
    "km": 1000.0,
    "in": 0.0254,
    "ft": 0.3048,
    "mi": 1609.344,
    "mil": 25.4e-6,
}
"""Metres in one of each unit."""

UNIT_NAMES: Final[dict[str, str]] = {
    **{name: "m" for name in ("meter", "meters", "metre", "metres")},
    **{name: "mm" for name in ("millimeter", "millimeters", "millimetre", "millimetres")},
    **{name: "in" for name in ("in.", "inch", "inches")},
    **{name: "ft" for name in ("ft.", "foot", "feet")},
    **{name: "mi" for name in ("mile", "miles")},
    "mils": "mil",
}
"""Units that are written out."""

TRACKS: Final[dict[str, tuple[str, ...]]] = {
    "left": ("left", "lft", "lt", "l", "lwp", "links", "gauche"),
    "right": ("right", "rgt", "rt", "r", "rwp", "rechts", "droite"),
    "center": ("center", "centre", "ctr", "c", "cwp", "mitte"),
}
"""Words that say which track an elevation is of, in the order of the tracks of a profile."""

QUANTITIES: Final = ("station", "elevation")

COMMENT_MARKS: Final = ("#", "%")

DELIMITERS: Final = {",": "comma", ";": "semicolon", "\t": "tab", " ": "whitespace"}

STATION_WORDS: Final = frozenset({"station", "stations", "distance", "chainage", "x", "s", "weg"})
ELEVATION_WORDS: Final = frozenset(
    {"elevation", "elevations", "elev", "height", "z", "höhe", "hoehe"}
)

MAX_SLOPE_RMS: Final = 0.5
"""Steepest rms slope that is believed of a file without units; rough roads have 0.02."""

MAX_RELIEF: Final = 100.0
"""Largest range of elevation (m), per km and at least 1 km, believed of a file without units."""

MAX_GAP: Final = 100.0
"""Widest gap between stations, in median spacings, that is interpolated unasked."""

MAX_ROUNDING: Final = 0.1
"""Coarsest last decimal of a station, in spacings, that counts as rounding of a uniform grid."""

MAX_DECIMALS: Final = 6

SAMPLE_LINES: Final = 200
"""Data lines from which delimiter and decimal mark are detected."""

_NUMBER: Final = {
    mark: re.compile(
        rf"[+-]?(\d+({re.escape(mark)}\d*)?|{re.escape(mark)}\d+)([eE][+-]?\d+)?", re.A
    )
    for mark in ".,"
}
_NO_VALUE: Final = frozenset({"na", "n/a", "nan", "null", "none", "inf", "infinity"})
_THOUSANDS: Final = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_BLANK_BETWEEN_NUMBERS: Final = re.compile(r"[\d.]\s+[-+.]?\d")
_HEADER_WORD: Final = re.compile(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?")
_LABEL: Final = re.compile(
    r"(?P<name>.*?)\s*"
    r"(?:[\[(]\s*(?P<bracket>[^\])]*?)\s*[\])]"
    rf"|(?:^|[_,/\s])\s*(?P<suffix>{'|'.join(METRES)}))",
    re.IGNORECASE,
)
_SIDE: Final = {
    name: re.compile(rf"({'|'.join(words)})({'|'.join((*ELEVATION_WORDS, 'prof', 'profile'))})?")
    for name, words in TRACKS.items()
}
_SIDE_FILLER: Final = frozenset(
    {"profile", "prof", "track", "wheel", "path", "wheelpath", "wheeltrack"}
)
_CONTROL_BYTE: Final = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")


@np.errstate(all="ignore")  # what overflows is refused as not finite
def read_text(
    path: str | os.PathLike[str],
    *,
    columns: tuple[int | str, ...] | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    station_unit: str | None = None,
    elevation_unit: str | None = None,
    spacing: float | Literal["median", "file"] = "median",
    skip: int = 0,
    name: str | None = None,
) -> Profile:
    r"""Read a profile from columns of text.

    The file holds comment lines (``#`` or ``%``), at most one header line with column names,
    which may carry units (``station [m]``, ``Distance (km)``, ``elevation_mm``), and one line
    per station. A comment line directly above the data counts as the header if its names do.
    Elevations of several wheel paths (``Left Elevation (in)``, ``Right Elevation (in)``) become
    the tracks of one profile.

    Parameters
    ----------
    path : str or os.PathLike
        File, in UTF-8 or Latin-1.
    columns : tuple of int or str, optional
        Station and elevation columns, counted from 0 or by header name; each further one is
        another track. By default the header decides, if it names one station (or distance,
        chainage, x, s) and one elevation (or height, z), or one for each of left, right and
        center; else a file of two columns is read as station, elevation.
    delimiter : {",", ";", "\t", " "}, optional
        Field delimiter, a blank for any whitespace. Detected by default.
    decimal : {".", ","}, optional
        Decimal mark. Detected by default, where there is only one reading.
    station_unit, elevation_unit : {"m", "cm", "mm", "km", "in", "ft", "mi", "mil"}, optional
        Units in the file. By default those of the header, and m where it has none.
    spacing : float or {"median", "file"}, optional
        Distance between the stations of the profile, m. By default, irregular stations are
        interpolated linearly onto their median spacing and uniform ones are kept; ``"file"``
        keeps any.
    skip : int, optional
        Lines to ignore at the top of the file.
    name : str, optional
        Name of the profile; that of the file by default.

    Returns
    -------
    Profile
        In m; ``.source`` says what was understood of the file. Tracks are in the order left,
        right, center, or in that of `columns`.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    FormatError
        If the file is not text, has several readings, contradicts an option, misses a number,
        has a station that does not increase, or elevations that cannot be in m though neither
        header nor option gives a unit.
    ValueError
        If an option is not one of those allowed.

    Notes
    -----
    Printed stations are rounded: they count as uniform within 0.1 % of the spacing, and as a
    uniform grid whose rounding is removed within one unit of their last decimal, if that is at
    most a tenth of the spacing. Interpolation starts at the first station; up to one spacing at
    the end of the file does not fill another and is left out.
    """
    _check_options(delimiter, decimal, (station_unit, elevation_unit), spacing, skip)
    text = _Text.read(Path(path), skip)
    layout = _detect_layout(text, delimiter, decimal)
    labels = _header_labels(text, layout)
    chosen, tracks = _choose_columns(text, layout, labels, columns)
    quantities = quantities_of(tracks)
    units, units_from = _choose_units(text, labels, chosen, (station_unit, elevation_unit))

    printed, *elevations = _numbers(text, layout, chosen, quantities).T
    _check_numbers(text, printed, elevations, quantities)
    grid = None if spacing == "file" else _without_rounding(printed)
    x = (printed if grid is None else grid) * METRES[units[0]]
    z = [e * METRES[unit] for e, unit in zip(elevations, units[1:], strict=True)]
    if "default" in units_from:
        for elevation in z:
            check_plausible(text.error, x, elevation, units_from)
    try:
        profile = Profile(
            x,
            z[0],
            Path(path).stem if name is None else name,
            tracks=dict(zip(tracks, z, strict=True)) if tracks else None,
        )
    except ValueError as error:  # numbers that fit a file but, in m, no profile
        raise text.error(str(error)) from None
    target = _target_spacing(text, profile, spacing)
    if target is not None:
        profile = profile.resample(target)

    as_read = grid is None and target is None
    gaps = np.diff(printed) * METRES[units[0]]
    source = ProfileSource(
        path=os.fspath(path),
        rows=printed.size,
        header=tuple(label.text for label in labels),
        columns=chosen,
        delimiter=layout.delimiter,
        decimal=layout.decimal,
        units=units,
        units_from=units_from,
        stations="resampled" if target else "as read" if as_read else "rounding removed",
        resampled_from=None if as_read else (float(gaps.min()), float(gaps.max())),
    )
    return replace(profile, source=source)


def _check_options(
    delimiter: str | None,
    decimal: str | None,
    units: tuple[str | None, str | None],
    spacing: float | str,
    skip: int,
) -> None:
    if delimiter is not None and delimiter not in DELIMITERS:
        allowed = ", ".join(map(repr, DELIMITERS))
        raise ValueError(f"delimiter must be one of {allowed}, got {delimiter!r}")
    if decimal not in (None, ".", ","):
        raise ValueError(f"decimal must be '.' or ',', got {decimal!r}")
    if decimal == "," == delimiter:
        raise ValueError("delimiter and decimal cannot both be ','")
    check_units(*units)
    if spacing not in ("median", "file") and not (
        isinstance(spacing, (int, float)) and np.isfinite(spacing) and spacing > 0.0
    ):
        raise ValueError(f"spacing must be 'median', 'file' or positive (m), got {spacing!r}")
    if skip < 0:
        raise ValueError(f"skip must be at least 0 lines, got {skip}")


def check_units(station_unit: str | None, elevation_unit: str | None) -> None:
    """Raise ValueError unless both options are units, or not given."""
    for option, unit in (("station_unit", station_unit), ("elevation_unit", elevation_unit)):
        if unit is not None and unit not in METRES:
            raise ValueError(f"{option} must be one of {', '.join(METRES)}, got {unit!r}")


# --- lines ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Text:
    """Lines of a file, and which of them (counted from 0) are header, comment and data."""

    path: Path
    lines: list[str]
    header: int | None
    comment: int | None  # the last comment above the data
    start: int  # the first data line

    @classmethod
    def read(cls, path: Path, skip: int) -> Self:
        lines = _decode(path).replace("\r\n", "\n").replace("\r", "\n").split("\n")
        header = comment = None
        for i in range(skip, len(lines)):
            line = lines[i].strip()
            if line.startswith(COMMENT_MARKS):
                comment = i
            elif line and header is None and _is_header(line):
                header = i
            elif line:
                return cls(path, lines, header, comment, i)
        raise FormatError("no line with numbers: the file is empty or cut short", path=path)

    def data(self) -> Iterator[tuple[int, str]]:
        """Index and stripped text of every line from the first data line on that holds data."""
        for i in range(self.start, len(self.lines)):
            line = self.lines[i].strip()
            if line and not line.startswith(COMMENT_MARKS):
                yield i, line

    def error(self, message: str, line: int | None = None) -> FormatError:
        """Return the error that blames a line, counted from 0, or the file."""
        return FormatError(message, path=self.path, line=None if line is None else line + 1)

    def error_at_row(self, message: str, row: int) -> FormatError:
        """Return the error that blames a data row, counted from 0."""
        line, _ = next(islice(self.data(), row, None))
        return self.error(message, line)


def _decode(path: Path) -> str:
    if path.is_dir():
        raise FormatError("is a directory; a file is needed", path=path)
    content = path.read_bytes()
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise FormatError("is UTF-16 text; save it as UTF-8", path=path, byte=0)
    return decode_text(content, path)


def decode_text(content: bytes, path: Path, start: int = 0) -> str:
    """Text of a file from byte `start` on, in UTF-8 or Latin-1."""
    control = _CONTROL_BYTE.search(content)
    if control is not None:
        raise FormatError(
            f"is not text: it holds the control byte 0x{content[control.start()]:02x}",
            path=path,
            byte=start + control.start(),
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _is_header(line: str) -> bool:
    """Whether a line holds words, and no cell of it is a number or stands for a missing one."""
    delimiter = next((mark for mark in ";\t," if mark in line), " ")
    first_word = re.split(r"[\s,;]", line, maxsplit=1)[0].strip('"')
    values = any(
        _is_number(cell, ".") or cell.lower() in _NO_VALUE
        for cell in (first_word, *_split(line, delimiter))
    )
    return not values and any(character.isalpha() for character in line)


# --- delimiter and decimal mark ---------------------------------------------------------------


@dataclass(frozen=True)
class _Layout:
    """How a line divides into cells, and a cell into digits."""

    delimiter: str
    decimal: str
    count: int  # columns


def _detect_layout(text: _Text, delimiter: str | None, decimal: str | None) -> _Layout:
    sample = [line for _, line in islice(text.data(), SAMPLE_LINES)]
    if delimiter is None:
        delimiter = _detect_delimiter(sample[0], decimal)
        if delimiter == "," and decimal is None:
            _check_comma_delimits(text, sample)
    if decimal is None:
        decimal = "." if delimiter == "," else _detect_decimal(text, sample, delimiter)
    count = len(_split(sample[0], delimiter))
    if count < 2:
        raise text.error(
            f"{sample[0][:40]!r} is one column at delimiter {DELIMITERS[delimiter]}; station and "
            "elevation are needed: check the line, or pass delimiter= (one of "
            f"{', '.join(map(repr, DELIMITERS))})",
            text.start,
        )
    return _Layout(delimiter, decimal, count)


def _detect_delimiter(line: str, decimal: str | None) -> str:
    for mark in ";\t":
        if mark in line:
            return mark
    if "," not in line or decimal == "," or _BLANK_BETWEEN_NUMBERS.search(line):
        return " "
    return ","


def _check_comma_delimits(text: _Text, sample: Sequence[str]) -> None:
    """Refuse lines like ``1,5,2,5``, where a comma could as well be the decimal mark."""
    commas = [line.count(",") for line in sample]
    row = commas.index(max(commas))
    named = text.header is not None and text.lines[text.header].count(",") == commas[row]
    if commas[row] > 1 and not named and not any("." in line for line in sample):
        raise text.error_at_row(
            f"{sample[row][:40]!r} has several readings: each comma could be delimiter or decimal "
            "mark; pass delimiter=',' if the numbers are whole, else write the file with another "
            "delimiter, such as ';', and pass decimal=','",
            row,
        )


def _detect_decimal(text: _Text, sample: Sequence[str], delimiter: str) -> str:
    cells = [cell for line in sample for cell in _split(line, delimiter)]
    with_comma = [cell for cell in cells if "," in cell and _is_number(cell, ",")]
    with_point = [cell for cell in cells if "." in cell and _is_number(cell, ".")]
    if not with_comma:
        return "."
    if with_point or all(map(_THOUSANDS.fullmatch, with_comma)):
        other = f" beside {with_point[0]!r}" if with_point else ""
        raise text.error(
            f"the comma of {with_comma[0]!r}{other} could be a decimal mark or group thousands; "
            "pass decimal=',' or decimal='.'"
        )
    return ","


def _split(line: str, delimiter: str) -> list[str]:
    cells = line.split() if delimiter == " " else line.split(delimiter)
    return [cell.strip().strip('"').strip() for cell in cells]


def _is_number(cell: str, decimal: str) -> bool:
    return _NUMBER[decimal].fullmatch(cell) is not None


# --- header, columns and units ----------------------------------------------------------------


@dataclass(frozen=True)
class _Label:
    """Name of a column; its unit in lower case, known or not, if it has one."""

    text: str
    name: str
    unit: str | None

    @classmethod
    def parse(cls, text: str) -> Self:
        match = _LABEL.fullmatch(text)
        if match is None:
            return cls(text, text, None)
        unit = match["suffix"] if match["bracket"] is None else match["bracket"]
        return cls(text, match["name"], known_unit(unit))

    def has_word(self, words: frozenset[str]) -> bool:
        """Whether one of `words` is in the name."""
        return not words.isdisjoint(_words(self.name))


def known_unit(text: str) -> str:
    """Return a unit in lower case, as `METRES` has it if it is one of them."""
    unit = text.strip().lower()
    return UNIT_NAMES.get(unit, unit)


def track_of(name: str) -> str | None:
    """Say which track of `TRACKS` a name is the elevation of.

    Returns
    -------
    str or None
        Empty if the name is of an elevation but of none, or several, of the tracks; None if it
        is not of an elevation.
    """
    words = _words(name)
    sides = {
        side: [word for word in words if pattern.fullmatch(word)] for side, pattern in _SIDE.items()
    }
    found = [side for side, matching in sides.items() if matching]
    with_side = {word for matching in sides.values() for word in matching}
    plain = ELEVATION_WORDS.intersection(words)
    if not plain and not (with_side and with_side | _SIDE_FILLER >= set(words)):
        return None
    return found[0] if len(found) == 1 else ""


def _words(name: str) -> list[str]:
    return re.findall(r"[^\W\d_]+", name.lower())


def _header_labels(text: _Text, layout: _Layout) -> list[_Label]:
    """One label for each column, or none if the file has no header."""
    if text.header is not None:
        labels = _split_header(text.lines[text.header].strip(), layout.delimiter)
        if len(labels) != layout.count:
            raise text.error(
                f"number of column names is {len(labels)} "
                f"({', '.join(label.text for label in labels)}), of columns below it "
                f"{layout.count}; correct the header or pass skip=",
                text.header,
            )
        return labels
    if text.comment is not None:
        line = text.lines[text.comment].strip().lstrip("".join(COMMENT_MARKS)).strip()
        labels = _split_header(line, layout.delimiter)
        known = [
            label.has_word(STATION_WORDS | ELEVATION_WORDS) or label.unit in METRES
            for label in labels
        ]
        if len(labels) == layout.count and all(known[:2]):
            return labels
    return []


def _split_header(line: str, delimiter: str) -> list[_Label]:
    words = _HEADER_WORD.findall(line) if delimiter == " " else _split(line, delimiter)
    return [_Label.parse(word) for word in words]


def _choose_columns(
    text: _Text,
    layout: _Layout,
    labels: Sequence[_Label],
    columns: tuple[int | str, ...] | None,
) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """Columns of station and elevations, and the names of the tracks if there are several."""
    if columns is not None:
        if isinstance(columns, str) or len(columns) < 2:
            raise text.error(f"columns={columns!r} must be a station and at least one elevation")
        chosen = tuple(_find_column(text, layout, labels, wanted) for wanted in columns)
        if len(set(chosen)) < len(chosen):
            raise text.error(f"columns={columns!r} is twice the same column; two are needed")
        return chosen, name_tracks([labels[i].name if labels else "" for i in chosen[1:]])
    stations = [i for i, label in enumerate(labels) if label.has_word(STATION_WORDS)]
    tracks = {
        i: track for i, label in enumerate(labels) if (track := track_of(label.name)) is not None
    }
    elevations = in_order_of_tracks(tracks)
    if len(stations) == 1 and elevations and stations[0] not in elevations:
        return (stations[0], *elevations), name_tracks([tracks[i] for i in elevations])
    if layout.count == 2 and 0 not in tracks and 1 not in stations:
        return (0, 1), ()
    names = f" ({', '.join(label.text for label in labels)})" if labels else " without a header"
    raise text.error(
        f"which of {layout.count} columns{names} are station and elevation? "
        "Pass columns=, names or numbers counted from 0, of the station and of each track"
    )


def in_order_of_tracks(tracks: dict[int, str]) -> list[int]:
    """Columns of one elevation, or of one for each track; none if there are other columns."""
    names = list(tracks.values())
    if len(names) > 1 and ("" in names or len(set(names)) < len(names)):
        return []
    order = ["", *TRACKS]
    return sorted(tracks, key=lambda i: order.index(tracks[i]))


def name_tracks(names: Sequence[str]) -> tuple[str, ...]:
    """Names of tracks, from those of their columns; none for a single one."""
    if len(names) < 2:
        return ()
    tracks = [track_of(name) or name.strip() for name in names]
    if len(set(tracks)) == len(tracks) and all(name and name.isprintable() for name in tracks):
        return tuple(tracks)
    return tuple(f"track {i}" for i in range(1, len(names) + 1))


def quantities_of(tracks: Sequence[str]) -> tuple[str, ...]:
    """Name station and elevations, for messages."""
    return ("station", *(f"{track} elevation" for track in tracks)) if tracks else QUANTITIES


def _find_column(text: _Text, layout: _Layout, labels: Sequence[_Label], wanted: int | str) -> int:
    if isinstance(wanted, str):
        key = wanted.strip().lower()
        found = [
            i for i, label in enumerate(labels) if key in (label.text.lower(), label.name.lower())
        ]
    else:
        found = [i for i in range(layout.count) if i == wanted]
    if len(found) != 1:
        names = f", named {', '.join(label.text for label in labels)}" if labels else ", no header"
        raise text.error(
            f"columns: {wanted!r} is {len(found)} of the file's columns, must be one; it has "
            f"0 to {layout.count - 1}{names}"
        )
    return found[0]


def _choose_units(
    text: _Text,
    labels: Sequence[_Label],
    chosen: Sequence[int],
    options: tuple[str | None, str | None],
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Units of station and elevations, and where each is from."""
    stated = [labels[column].unit if labels else None for column in chosen]
    return choose_units(text.error, stated, options)


def choose_units(
    error: Callable[[str], FormatError],
    stated: Sequence[str | None],
    options: tuple[str | None, str | None],
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Units of station and elevations, and where each is from.

    Parameters
    ----------
    error : callable
        Gives the error to raise for a message.
    stated : sequence of str or None
        Units of station and of each track in the file.
    options : tuple of str or None
        Units of station and of elevations that the caller gave.

    Returns
    -------
    tuple of tuple of str
        Units, of `METRES`, and for each of them ``"header"``, ``"option"`` or ``"default"``.
    """
    chosen = [
        _choose_unit(error, QUANTITIES[min(i, 1)], unit, options[min(i, 1)])
        for i, unit in enumerate(stated)
    ]
    return tuple(unit for unit, _ in chosen), tuple(origin for _, origin in chosen)


def _choose_unit(
    error: Callable[[str], FormatError], quantity: str, stated: str | None, option: str | None
) -> tuple[str, str]:
    if stated in METRES:
        if option not in (None, stated):
            raise error(f"{quantity}_unit={option!r} contradicts the header, [{stated}]")
        return stated, "header"
    if option is not None:
        return option, "option"
    if stated is not None:
        raise error(
            f"{quantity} unit [{stated}] of the header is none of {', '.join(METRES)}; "
            f"pass {quantity}_unit="
        )
    return "m", "default"


# --- numbers ----------------------------------------------------------------------------------


def _numbers(
    text: _Text, layout: _Layout, chosen: Sequence[int], quantities: Sequence[str]
) -> NDArray[np.float64]:
    """Stations and elevations as printed, shape (rows, columns chosen)."""
    lines = text.lines[text.start :]
    if layout.decimal == ",":
        if any("." in line for line in lines):
            return _numbers_line_by_line(text, layout, chosen, quantities)
        lines = [line.replace(",", ".") for line in lines]
    delimiter = None if layout.delimiter == " " else layout.delimiter
    try:
        table = np.loadtxt(lines, delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        return _numbers_line_by_line(text, layout, chosen, quantities)
    return table[:, chosen]


def _numbers_line_by_line(
    text: _Text, layout: _Layout, chosen: Sequence[int], quantities: Sequence[str]
) -> NDArray[np.float64]:
    """Slower than `_numbers`, for text beside the numbers, and to find the line to blame."""
    rows: list[list[float]] = []
    for i, line in text.data():
        cells = _split(line, layout.delimiter)
        if len(cells) != layout.count:
            raise text.error(
                f"number of columns is {len(cells)}, in line {text.start + 1} it is "
                f"{layout.count} (delimiter {DELIMITERS[layout.delimiter]})",
                i,
            )
        for quantity, column in zip(quantities, chosen, strict=True):
            if not _is_number(cells[column], layout.decimal):
                raise text.error(
                    f"{quantity} {cells[column]!r} is not a number with decimal mark "
                    f"{layout.decimal!r}",
                    i,
                )
        rows.append([float(cells[j].replace(",", ".")) for j in chosen])
    return np.array(rows)


def _check_numbers(
    text: _Text,
    station: NDArray[np.float64],
    elevations: Sequence[NDArray[np.float64]],
    quantities: Sequence[str],
) -> None:
    if station.size < 2:
        raise text.error("one sample; a profile needs at least 2", text.start)
    finite = np.isfinite([station, *elevations]).all(axis=0)
    increases = np.append(True, station[1:] > station[:-1])
    if finite.all() and increases.all():
        return
    row = int(np.argmin(finite & increases))
    for quantity, values in zip(quantities, (station, *elevations), strict=True):
        if not np.isfinite(values[row]):
            raise text.error_at_row(f"{quantity} is {values[row]:g}; it must be finite", row)
    raise text.error_at_row(
        f"station {station[row]} does not increase (previous {station[row - 1]})", row
    )


def check_plausible(
    error: Callable[[str], FormatError],
    x: NDArray[np.float64],
    z: NDArray[np.float64],
    units_from: Sequence[str],
) -> None:
    """Refuse what cannot be in m, where neither header nor option gives a unit."""
    slope_rms = float(np.sqrt(np.mean((np.diff(z) / np.diff(x)) ** 2)))
    relief, allowed = float(np.ptp(z)), MAX_RELIEF * max(1.0, float(x[-1] - x[0]) / 1000.0)
    if slope_rms <= MAX_SLOPE_RMS and relief <= allowed:
        return
    options = " and ".join(
        f"{quantity}_unit="
        for quantity, origins in zip(QUANTITIES, (units_from[:1], units_from[1:]), strict=True)
        if "default" in origins
    )
    raise error(
        f"read in m, the elevations have a slope of {slope_rms:.3g} rms (at most {MAX_SLOPE_RMS} "
        f"is believed) and a range of {relief:.4g} m over {x[-1] - x[0]:.4g} m (at most "
        f"{allowed:.4g} m); the header gives no unit: pass {options}"
    )


# --- spacing ----------------------------------------------------------------------------------


def _without_rounding(station: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Uniform grid of which `station` is the printed rounding; None where it is not one."""
    grid = uniform_grid(station)
    distance = np.abs(station - grid).max()
    spacing = grid[1] - grid[0]
    last_digit = _last_digit(station)
    if UNIFORM_TOLERANCE * spacing < distance <= last_digit <= MAX_ROUNDING * spacing:
        return grid
    return None


def _last_digit(values: NDArray[np.float64]) -> float:
    """Return the power of ten, 1 or less, of which all `values` are multiples; 0 if none is."""
    for decimals in range(MAX_DECIMALS + 1):
        scaled = values * 10.0**decimals
        if np.allclose(scaled, np.rint(scaled), rtol=1e-15, atol=1e-6):
            return float(10.0**-decimals)
    return 0.0


def _target_spacing(
    text: _Text, profile: Profile, spacing: float | Literal["median", "file"]
) -> float | None:
    """Spacing (m) to interpolate onto; None where the stations stay."""
    if spacing == "file":
        return None
    median = profile.spacing
    if spacing == "median":
        if profile.is_uniform:
            return None
        _check_gaps(text, profile.x, median)
        return float(f"{median:.9g}")  # 0.2395, not 0.23950000000002092
    same = profile.is_uniform and math.isclose(spacing, median, rel_tol=1e-9)
    return None if same else spacing


def _check_gaps(text: _Text, x: NDArray[np.float64], median: float) -> None:
    gaps = np.diff(x)
    widest = int(np.argmax(gaps))
    if gaps[widest] > MAX_GAP * median:
        raise text.error_at_row(
            f"gap of {gaps[widest]:.6g} m before this station, {gaps[widest] / median:.0f} times "
            f"the median spacing of {median:.6g} m (at most {MAX_GAP:g} times is interpolated); "
            "pass spacing= in m, or spacing='file' to keep the stations",
            widest + 1,
        )
