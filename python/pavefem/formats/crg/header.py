"""Header of an OpenCRG file: its sections, and the parameters in them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final, Self

from pavefem.errors import FormatError

MAX_HEADER: Final = 1024 * 1024
"""Bytes within which the header has to end; 14 000 channels fit, each with a full line."""

HEADER_RECORD: Final = 72
"""Bytes of a header line that count; the specification has the rest ignored."""

DIGITS: Final = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
NUMBER: Final = re.compile(DIGITS, re.A)

MAGIC: Final = re.compile(rb"^\$(CT\b|ROAD_CRG|KD_DEFINITION)", re.IGNORECASE | re.MULTILINE)
"""Lines that no other file has."""

_SECTION_MARK: Final = re.compile(r"\$(\w*)", re.A)


@dataclass(frozen=True)
class Header:
    """Sections of the header: their lines, without comments, and the numbers of those lines."""

    path: Path
    sections: dict[str, list[tuple[int, str]]]
    lines: int  # of the header, counting the one that ends it
    size: int  # in bytes

    @classmethod
    def read(cls, path: Path, file: BinaryIO) -> Self:
        """Read the sections up to the line that ends the header."""
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
        """Return the error that blames a line, or the file."""
        return FormatError(message, path=self.path, line=line)

    def parameters(self, section: str) -> Parameters:
        """Return the parameters of a section, none if the file does not have it."""
        entries: dict[str, tuple[int, str]] = {}
        for line, text in self.sections.get(section, []):
            key, equals, value = (part.strip() for part in text.partition("="))
            if not equals:
                raise self.error(f"{text!r} is not PARAMETER = value", line)
            if key.upper() in entries:
                raise self.error(f"a second value of {key}", line)
            entries[key.upper()] = (line, value)
        return Parameters(self, entries)


@dataclass(frozen=True)
class Parameters:
    """Parameters of one section, by upper-case name: line and value as written."""

    header: Header
    entries: dict[str, tuple[int, str]]

    def __contains__(self, key: str) -> bool:
        return key in self.entries

    def line(self, key: str) -> int | None:
        """Line of a parameter, None without one."""
        return self.entries[key][0] if key in self.entries else None

    def get(self, key: str, default: float) -> float:
        """Return the number that a parameter has to be."""
        if key not in self.entries:
            return default
        line, text = self.entries[key]
        value = float(text) if NUMBER.fullmatch(text) else math.nan
        if not math.isfinite(value):
            raise self.header.error(f"{key} {text!r} is not a finite number", line)
        return value

    def error(self, message: str, key: str) -> FormatError:
        """Return the error that blames the line of a parameter."""
        return self.header.error(message, self.line(key))
