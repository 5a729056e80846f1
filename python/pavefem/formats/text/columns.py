"""Columns of a text file: their names and units, which is the station, which an elevation."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Self

from pavefem.formats.text.layout import Layout
from pavefem.formats.text.lines import COMMENT_MARKS, Text, split
from pavefem.formats.tracks import (
    ELEVATION_WORDS,
    STATION_WORDS,
    in_order_of_tracks,
    listed,
    name_tracks,
    track_of,
    words_of,
)
from pavefem.formats.units import METRES, choose_units, known_unit, options_for

_WORD_WITH_UNIT: Final = re.compile(r"[^\s\[(]+(?:\s{0,9}[\[(][^\])]{0,60}[\])])?")
_UNIT_IN_BRACKETS: Final = re.compile(r"[\[(]([^\[(\])]*)[\])]$")
_UNIT_AT_THE_END: Final = re.compile(rf"(?:^|[_,/\s])({'|'.join(METRES)})$", re.IGNORECASE)
_SPEAKS_OF_UNITS: Final = re.compile(
    r"\b(units?|einheit(en)?|unités?|unidad(es)?|unità|eenhe(id|den))\b"
    rf"|[\[(](?:{'|'.join(METRES)})[\])]",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Label:
    """Name of a column; its unit in lower case, known or not, if it has one."""

    text: str
    name: str
    unit: str | None

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read ``station [m]``, ``Distance (km)``, ``elevation_mm`` or ``Höhe``."""
        match = _UNIT_IN_BRACKETS.search(text) or _UNIT_AT_THE_END.search(text)
        if match is None or track_of(match[1]):  # Elevation (left)
            return cls(text, text, None)
        return cls(text, text[: match.start()].rstrip(" \t_,/"), known_unit(match[1]))

    def has_word(self, words: frozenset[str]) -> bool:
        """Whether one of `words` is in the name."""
        return not words.isdisjoint(words_of(self.name))

    @property
    def is_known(self) -> bool:
        """Whether it names a station or an elevation, or has a unit of length."""
        return self.has_word(STATION_WORDS | ELEVATION_WORDS) or self.unit in METRES


def read_labels(text: Text, layout: Layout) -> list[Label]:
    """One label for each column, or none if there is nothing above the data but comments."""
    above = max([-1, *text.metadata, *([] if text.names is None else [text.names])])
    if text.comments and text.comments[-1] > above:
        labels = _labels_of_comment(text.lines[text.comments[-1]], layout)
        if labels:
            return labels
    line = "" if text.names is None else text.lines[text.names].strip()
    labels = _split_names(line, layout.delimiter)
    if text.metadata and not any(label.is_known or track_of(label.name) for label in labels):
        raise text.error(
            f"{text.lines[above].strip()[:60]!r} stands above the numbers and does not name their "
            "columns; pass skip= with the number of lines to leave out at the top",
            above,
        )
    if text.names is None:
        return []
    if len(labels) != layout.count:
        raise text.error(
            f"number of column names is {len(labels)} "
            f"({listed(label.text for label in labels)}), of columns below it "
            f"{layout.count}; correct the header or pass skip=",
            text.names,
        )
    return labels if text.units is None else _with_units(text, layout, labels, text.units)


def _split_names(line: str, delimiter: str) -> list[Label]:
    words = _WORD_WITH_UNIT.findall(line) if delimiter == " " else split(line, delimiter)
    return [Label.parse(word) for word in words]


def _labels_of_comment(line: str, layout: Layout) -> list[Label]:
    """Labels in a comment, none if it does not name the columns."""
    labels = _split_names(line.strip().lstrip("".join(COMMENT_MARKS)).strip(), layout.delimiter)
    known = all(label.is_known for label in labels[:2])
    return labels if len(labels) == layout.count and known else []


def _with_units(text: Text, layout: Layout, labels: list[Label], line: int) -> list[Label]:
    """Labels with the units that stand in a line of their own."""
    cells = [cell.strip("[]() ") for cell in split(text.lines[line].strip(), layout.delimiter)]
    if len(cells) != len(labels):
        raise text.error(f"number of units is {len(cells)}, of columns {len(labels)}", line)
    units = [known_unit(cell) or None for cell in cells]
    for label, unit in zip(labels, units, strict=True):
        if label.unit not in (None, unit) and unit is not None:
            raise text.error(f"unit {unit!r} contradicts that in {label.text!r}", line)
    return [
        replace(label, unit=unit or label.unit) for label, unit in zip(labels, units, strict=True)
    ]


def choose_columns(
    text: Text,
    layout: Layout,
    labels: Sequence[Label],
    columns: Sequence[int | str] | None,
    has_stations: bool,
) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """Columns of station (-1 for none) and elevations, and names of the tracks if several."""
    if columns is not None:
        first = 1 if has_stations else 0
        if isinstance(columns, str) or len(columns) <= first:
            needed = "a station and at least one elevation" if has_stations else "elevations"
            raise text.error(f"columns={columns!r} must be {needed}")
        chosen = tuple(_find_column(text, layout, labels, wanted) for wanted in columns)
        if len(set(chosen)) < len(chosen):
            raise text.error(f"columns={columns!r} is twice the same column; two are needed")
        names = name_tracks([labels[i].name if labels else "" for i in chosen[first:]])
        return (chosen if has_stations else (-1, *chosen)), names
    stations = [i for i, label in enumerate(labels) if label.has_word(STATION_WORDS)]
    tracks = {
        i: track for i, label in enumerate(labels) if (track := track_of(label.name)) is not None
    }
    chosen = tuple(in_order_of_tracks(tracks))
    names = name_tracks([tracks[i] for i in chosen])
    if not has_stations:
        if stations:
            raise text.error(f"step= is given, but {labels[stations[0]].text!r} has stations")
        if chosen or layout.count == 1:
            return (-1, *(chosen or (0,))), names
    elif len(stations) == 1 and chosen and stations[0] not in chosen:
        return (stations[0], *chosen), names
    elif layout.count == 2 and 0 not in tracks and 1 not in stations:
        return (0, 1), ()
    named = f" ({listed(label.text for label in labels)})" if labels else " without a header"
    if not has_stations:
        raise text.error(
            f"which of {layout.count} columns{named} are elevations? Pass columns=, names or "
            "numbers counted from 0, of each track"
        )
    raise text.error(
        f"which of {layout.count} columns{named} are station and elevation? "
        "Pass columns=, names or numbers counted from 0, of the station and of each track"
        f"{'' if stations else '; or step= if none has stations'}"
    )


def _find_column(text: Text, layout: Layout, labels: Sequence[Label], wanted: int | str) -> int:
    if isinstance(wanted, str):
        key = wanted.strip().lower()
        found = [
            i for i, label in enumerate(labels) if key in (label.text.lower(), label.name.lower())
        ]
    else:
        found = [i for i in range(layout.count) if i == wanted]
    if len(found) != 1:
        names = f", named {listed(label.text for label in labels)}" if labels else ", no header"
        raise text.error(
            f"columns: {wanted!r} is {len(found)} of the file's columns, must be one; it has "
            f"0 to {layout.count - 1}{names}"
        )
    return found[0]


def column_units(
    text: Text,
    labels: Sequence[Label],
    chosen: Sequence[int],
    options: tuple[str | None, str | None],
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Units of station and elevations, and where each is from, as `choose_units` has them."""
    stated = [labels[column].unit if labels and column >= 0 else None for column in chosen]
    units, units_from = choose_units(text.error, stated, options)
    if "default" in units_from:
        for i in (*text.metadata, *text.comments):
            if _SPEAKS_OF_UNITS.search(text.lines[i]):
                raise text.error(
                    f"{text.lines[i].strip()[:60]!r} speaks of units, and the names of the columns "
                    f"have none: pass {options_for(units_from)}",
                    i,
                )
    return units, units_from
