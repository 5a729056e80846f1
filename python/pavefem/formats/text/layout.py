"""How the lines of a text file divide into cells, and the cells into digits."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Final

from pavefem.formats.text.lines import Text, is_number, split

DELIMITERS: Final = {",": "comma", ";": "semicolon", "\t": "tab", " ": "whitespace"}

SAMPLE_LINES: Final = 200
"""Data lines from which delimiter and decimal mark are detected."""

_THOUSANDS: Final = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_BLANK_BETWEEN_NUMBERS: Final = re.compile(r"[\d.]\s+[-+.]?\d")


@dataclass(frozen=True)
class Layout:
    """How a line divides into cells, and a cell into digits."""

    delimiter: str
    decimal: str
    count: int  # columns


def detect_layout(
    text: Text, delimiter: str | None = None, decimal: str | None = None, least: int = 2
) -> Layout:
    """Divide the lines as the options say, or as there is only one way to.

    Parameters
    ----------
    text : Text
        Lines of the file.
    delimiter, decimal : str, optional
        What the caller gave.
    least : int, optional
        Columns that are needed.
    """
    sample = [line for _, line in islice(text.data(), SAMPLE_LINES)]
    if delimiter is None:
        delimiter = _detect_delimiter(sample[0], decimal)
        if delimiter == "," and decimal is None:
            _check_comma_delimits(text, sample)
    if decimal is None:
        decimal = "." if delimiter == "," else _detect_decimal(text, sample, delimiter)
    count = len(split(sample[0], delimiter))
    if count < least:
        raise text.error(
            f"{sample[0][:40]!r} is one column at delimiter {DELIMITERS[delimiter]}; station and "
            "elevation are needed: check the line, pass delimiter= (one of "
            f"{', '.join(map(repr, DELIMITERS))}), or step= for elevations without stations",
            text.start,
        )
    return Layout(delimiter, decimal, count)


def _detect_delimiter(line: str, decimal: str | None) -> str:
    for mark in ";\t":
        if mark in line:
            return mark
    if "," not in line or decimal == "," or _BLANK_BETWEEN_NUMBERS.search(line):
        return " "
    return ","


def _check_comma_delimits(text: Text, sample: Sequence[str]) -> None:
    """Refuse lines like ``1,5,2,5``, where a comma could as well be the decimal mark."""
    commas = [line.count(",") for line in sample]
    row = commas.index(max(commas))
    named = text.names is not None and text.lines[text.names].count(",") == commas[row]
    if commas[row] > 1 and not named and not any("." in line for line in sample):
        raise text.error_at_row(
            f"{sample[row][:40]!r} has several readings: each comma could be delimiter or decimal "
            "mark; pass delimiter=',' if the numbers are whole, else write the file with another "
            "delimiter, such as ';', and pass decimal=','",
            row,
        )


def _detect_decimal(text: Text, sample: Sequence[str], delimiter: str) -> str:
    cells = [cell for line in sample for cell in split(line, delimiter)]
    with_comma = [cell for cell in cells if "," in cell and is_number(cell, ",")]
    with_point = [cell for cell in cells if "." in cell and is_number(cell, ".")]
    if not with_comma:
        return "."
    if with_point or all(map(_THOUSANDS.fullmatch, with_comma)):
        other = f" beside {with_point[0]!r}" if with_point else ""
        raise text.error(
            f"the comma of {with_comma[0]!r}{other} could be a decimal mark or group thousands; "
            "pass decimal=',' or decimal='.'"
        )
    return ","
