"""Lines of a text file: which of them name columns, which are metadata, where the data start."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Final, Self

from pavefem.errors import FormatError
from pavefem.formats.files import decode_text
from pavefem.formats.tracks import ELEVATION_WORDS, STATION_WORDS, words_of
from pavefem.formats.units import METRES, known_unit

COMMENT_MARKS: Final = ("#", "%")

MAX_HEAD_LINE: Final = 10_000
"""Most characters of a line above the data, and of the first one with data."""

MAX_METADATA: Final = 10_000
"""Most lines of text above the data, comments apart."""

_NUMBER: Final = {
    mark: re.compile(
        rf"[+-]?(\d+({re.escape(mark)}\d*)?|{re.escape(mark)}\d+)([eE][+-]?\d+)?", re.A
    )
    for mark in ".,"
}
_NO_VALUE: Final = frozenset({"na", "n/a", "nan", "null", "none", "inf", "infinity"})
_DATE_OR_TIME: Final = re.compile(r"\d{1,4}([-/.:])\d{1,2}\1\d{1,4}\D?.*|\d{1,2}:\d\d", re.A)
_RULE: Final = re.compile(r"[-=_*+|\s]+")
_BRACKETS: Final = re.compile(r"\[.*\]|\(.*\)")


def split(line: str, delimiter: str) -> list[str]:
    """Cells of a line, without the blanks and quotes around them."""
    cells = line.split() if delimiter == " " else line.split(delimiter)
    return [cell.strip().strip('"').strip() for cell in cells]


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with this decimal mark."""
    return _NUMBER[decimal].fullmatch(cell) is not None


@dataclass(frozen=True)
class Text:
    """Lines of a file, and which of them (counted from 0) hold what.

    Above the data there may be, in this order, metadata, one line of column names and one of
    their units; comments, empty lines and rules of dashes anywhere.
    """

    path: Path
    lines: list[str]
    metadata: tuple[int, ...]
    comments: tuple[int, ...]  # above the data
    names: int | None  # the column names, directly above the data
    units: int | None  # the line of units below them
    start: int  # the first data line

    @classmethod
    def parse(cls, path: Path, content: bytes, skip: int = 0) -> Self:
        """Find the first data line, and what stands above it."""
        text = decode_text(content, path).replace("\r\n", "\n").replace("\r", "\n")
        lines = text.split("\n")
        metadata: list[int] = []
        comments: list[int] = []
        names = units = None
        for i in range(skip, len(lines)):
            line = lines[i].strip()
            if line == "" or _RULE.fullmatch(line):
                continue
            if line.startswith(COMMENT_MARKS):
                comments.append(i)
                continue
            if len(line) > MAX_HEAD_LINE:
                raise FormatError(
                    f"line of {len(line)} characters above the numbers, or as the first of them; "
                    f"at most {MAX_HEAD_LINE} are read",
                    path=path,
                    line=i + 1,
                )
            if len(metadata) > MAX_METADATA:
                raise FormatError(
                    f"no line with numbers below {MAX_METADATA} lines of text",
                    path=path,
                    line=i + 1,
                )
            cells = head_cells(line)
            if names is not None and units is None and _are_units(cells):
                units = i
            elif _are_words(line, cells):
                metadata += [] if names is None else [names]
                names, units = i, None
            elif _starts_with_word(line, cells) and not _fits(names, lines, cells):
                metadata += [i] if names is None else [names, i]
                names = units = None
            else:
                return cls(path, lines, tuple(metadata), tuple(comments), names, units, i)
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


def head_cells(line: str) -> list[str]:
    """Cells of a line above the data, which may have a delimiter of its own."""
    return split(line, next((mark for mark in ";\t," if mark in line), " "))


def _are_words(line: str, cells: list[str]) -> bool:
    """Whether a line has words, and no cell is a number or stands for a missing one."""
    values = any(map(_is_value, (_first_word(line), *cells)))
    return not values and any(character.isalpha() for character in line)


def _starts_with_word(line: str, cells: list[str]) -> bool:
    """Whether a line starts like metadata, with a word or a date: ``Run;3``."""
    words = any(character.isalpha() for character in cells[0])
    return not _is_value(_first_word(line)) and (
        words or _DATE_OR_TIME.fullmatch(cells[0]) is not None
    )


def _is_value(cell: str) -> bool:
    return is_number(cell, ".") or is_number(cell, ",") or cell.lower() in _NO_VALUE


def _first_word(line: str) -> str:
    return re.split(r"[\s,;]", line, maxsplit=1)[0].strip('"')


def _fits(names: int | None, lines: list[str], cells: list[str]) -> bool:
    """Whether cells below column names are a row of that table, if a damaged one."""
    if names is None:
        return False
    named = head_cells(lines[names].strip())
    words = {word for name in named for word in words_of(name)}
    return len(named) == len(cells) and not words.isdisjoint(STATION_WORDS | ELEVATION_WORDS)


def _are_units(cells: list[str]) -> bool:
    """Whether cells are units: all known or in brackets, one at least of length."""
    known = [known_unit(cell.strip("[]()")) in METRES for cell in cells]
    return any(known) and all(
        is_length or cell == "" or _BRACKETS.fullmatch(cell)
        for is_length, cell in zip(known, cells, strict=True)
    )
