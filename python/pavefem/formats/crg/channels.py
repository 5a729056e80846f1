"""Channels of an OpenCRG file: which column is which long section, and where that lies."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Literal, Self

import numpy as np
from numpy.typing import NDArray

from pavefem.formats.crg.header import DIGITS, Header, Parameters

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

TOLERANCE: Final = 1e-4
"""Distance (m) within which positions agree: CHECK_TOL of the specification by default."""

_POSITION: Final = re.compile(rf"long section\s+at v\s*=\s*({DIGITS})", re.A | re.I)
_INDEX: Final = re.compile(r"long section\s+(\d+)", re.A | re.I)
_REFERENCE: Final = re.compile(r"reference line\s*(.*)", re.I)


@dataclass(frozen=True)
class Channels:
    """Columns of the road data: long sections from right to left, and the reference line's."""

    encoding: str
    names: list[str]
    v: NDArray[np.float64]  # of each long section, increasing
    columns: list[int]  # of each long section
    reference: dict[str, int]  # column of each channel of the reference line

    @classmethod
    def parse(cls, header: Header, road: Parameters) -> Self:
        """Read the section that defines the channels."""
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


def _allowed_unit(header: Header, name: str, line: int) -> str | None:
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


def _check_borders(road: Parameters, v: NDArray[np.float64]) -> None:
    for key, border in (("LONG_SECTION_V_RIGHT", v[0]), ("LONG_SECTION_V_LEFT", v[-1])):
        stated = road.get(key, float(border))
        if not abs(stated - border) <= TOLERANCE:
            raise road.error(
                f"{key} {stated:g} m contradicts the long section at {border:g} m", key
            )


def _numbered_positions(header: Header, road: Parameters, count: int) -> NDArray[np.float64]:
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
