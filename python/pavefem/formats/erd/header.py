"""Header of an ERD file: how the numbers are stored, and what is said of each channel."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

from pavefem.errors import FormatError
from pavefem.formats.files import check_is_file, decode_text
from pavefem.formats.tracks import track_of
from pavefem.formats.units import METRES, known_unit

ENCODINGS: Final[dict[int, str]] = {0: "i2", 1: "f4", 5: "text"}
"""How numbers are stored, by KEYNUM: as a type of numpy, or text."""

STORED: Final = {"i2": "2-byte integers", "f4": "4-byte reals", "text": "text numbers"}
"""The same, for people."""

MAX_HEADER: Final = 1_000_000
"""Most bytes in which the header must end."""

MAX_CHANNELS: Final = 10_000

NAME_WIDTHS: Final = {"SHORTNAM": 8, "UNITSNAM": 8, "LONGNAME": 32, "GENNAME": 32}
"""Characters that each channel takes in the text of a keyword."""

MAGIC: Final = re.compile(rb"(\xef\xbb\xbf)?\s{0,80}ERDFILEV", re.IGNORECASE)
"""Start of the file, which no other has."""

LINE_END: Final = re.compile(r"\r\n|\n|\r")
_END: Final = re.compile(rb"(?:^|[\r\n])[ \t]*END[ \t]*(?:\r\n|\n|\r|\Z)", re.IGNORECASE)
_INTEGER: Final = re.compile(r"[+-]?\d{1,18}", re.ASCII)
_REAL: Final = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eEdD][+-]?\d+)?", re.ASCII)


@dataclass(frozen=True)
class Channel:
    """What the header says of a channel; the unit in lower case, known or not."""

    short: str
    long: str
    general: str
    unit: str | None
    gain: float
    offset: float

    @property
    def name(self) -> str:
        """The longest of its names."""
        return self.long or self.short or self.general

    @property
    def track(self) -> str | None:
        """Track of `TRACKS` that it is the elevation of, empty for an elevation of none."""
        if self.unit is not None and self.unit not in METRES:
            return None
        found = [track_of(name) for name in (self.long, self.short, self.general)]
        return next(filter(None, found), "" if "" in found else None)


@dataclass(frozen=True)
class Header:
    """Header of a file, and where in the file it ends."""

    path: Path
    lines: dict[str, int]  # line of each keyword, counted from 1
    texts: dict[str, str]
    channels: list[Channel]
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
        """Read the lines up to END."""
        check_is_file(path)
        with path.open("rb") as file:
            start = file.read(MAX_HEADER)
        if not MAGIC.match(start):
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
        lines = LINE_END.split(decode_text(start[: end.end()], path))
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
            end_line=len(lines),
            size=path.stat().st_size,
        )

    def text(self, keyword: str) -> str:
        """Return the text of a keyword, empty without one."""
        return self.texts.get(keyword, "").strip()

    def unit(self, keyword: str) -> str | None:
        """Return the unit that a keyword names, None without one."""
        return known_unit(self.text(keyword)) if self.text(keyword) else None

    def real(self, keyword: str) -> float | None:
        """Return the number of a keyword, None without one."""
        text = self.text(keyword)
        if not text:
            return None
        return _reals(self.path, self.lines[keyword], keyword, text, 1)[0]

    def error(self, message: str, line: int | None = None, byte: int | None = None) -> FormatError:
        """Return the error that blames a line or a byte, or the file."""
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
            known = ", ".join(f"{key} ({STORED[code]})" for key, code in ENCODINGS.items())
            raise error(f"KEYNUM is {integers['KEYNUM']}; supported are {known}")
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
) -> list[Channel]:
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
        Channel(
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
        value = real_number(word)
        if value is None or not math.isfinite(value):
            raise FormatError(
                f"{keyword} {word[:40]!r} is not a finite number", path=path, line=line
            )
        values.append(value)
    return values


def real_number(word: str) -> float | None:
    """Return a number, also one with the exponent mark D of Fortran."""
    if not _REAL.fullmatch(word):
        return None
    return float(word.replace("D", "e").replace("d", "e"))
