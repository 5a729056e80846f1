"""The road of an OpenCRG file: its grid, its reference line, and a profile along it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from pavefem.errors import FormatError
from pavefem.formats.crg.channels import ENCODINGS, TOLERANCE, Channels
from pavefem.formats.crg.data import Data, read_binary, read_text
from pavefem.formats.crg.header import Header, Parameters
from pavefem.formats.files import check_is_file
from pavefem.profile import Profile, ProfileSource

SCALES: Final = (
    "SCALE_Z_GRID",
    "SCALE_SLOPE",
    "SCALE_BANKING",
    "SCALE_LENGTH",
    "SCALE_WIDTH",
)

RELATIVE_TOLERANCE: Final = 1e-6
"""`TOLERANCE` as a fraction of the length, for slopes, and for v on a long section: CHECK_EPS."""


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


@dataclass(frozen=True)
class Road:
    """Elevations on the grid, and what the reference line adds to them."""

    path: Path
    channels: Channels
    data: Data
    u: NDArray[np.float64]  # stations, m
    v: NDArray[np.float64]  # lateral positions of the long sections, m
    scale: float  # of the elevations on the grid
    z_ref: NDArray[np.float64]  # elevation of the reference line, m
    banking: NDArray[np.float64]  # m/m
    fills: str | None  # modifier of the file that fills missing elevations

    @classmethod
    @np.errstate(all="ignore")  # what overflows is refused as not finite
    def read(cls, path: Path) -> Self:
        """Read a file whole, and check that its header and its data agree."""
        check_is_file(path)
        with path.open("rb") as file:
            header = Header.read(path, file)
            _check_sections(header)
            road, modifiers = (header.parameters(f"ROAD_CRG{end}") for end in ("", "_MODS"))
            channels = Channels.parse(header, road)
            rows = _stated_rows(road)
            kind, size = ENCODINGS[channels.encoding]
            read = read_binary if kind == "binary" else read_text
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
            format=f"OpenCRG, {channels.encoding}",
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


def _check_sections(header: Header) -> None:
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


def _stated_rows(road: Parameters) -> int | None:
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


def _check_stations(channels: Channels, data: Data, start: float, increment: float) -> None:
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
    road: Parameters, channels: Channels, data: Data, increment: float
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


def _banking(road: Parameters, channels: Channels, data: Data) -> NDArray[np.float64]:
    if "banking" in channels.reference:
        return _complete_column(data, channels.reference["banking"], "banking")
    return np.full(data.values.shape[0], _constant(road, "B", "banking"))


def _constant(road: Parameters, letter: str, name: str) -> float:
    """Slope or banking of the header, which must not vary without a channel."""
    start_key, end_key = (f"REFERENCE_LINE_{end}_{letter}" for end in ("START", "END"))
    start = road.get(start_key, 0.0)
    end = road.get(end_key, start)
    if not abs(end - start) <= RELATIVE_TOLERANCE:
        raise road.error(
            f"{name} is {start:g} at the start and {end:g} at the end, but has no channel", end_key
        )
    return start


def _complete_column(data: Data, column: int, name: str, first: int = 0) -> NDArray[np.float64]:
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


def _scale(modifiers: Parameters, key: str) -> float:
    scale = modifiers.get(key, 1.0)
    if scale == 0.0 or (scale < 0.0 and key in ("SCALE_LENGTH", "SCALE_WIDTH")):
        raise modifiers.error(f"{key} {scale:g} has no clear meaning; leave it out", key)
    return scale


def _fill_mode(modifiers: Parameters) -> str | None:
    default = 2.0 if "GRID_NAN_OFFSET" in modifiers else 0.0
    mode = modifiers.get("GRID_NAN_MODE", default)
    return None if mode == 0.0 else f"GRID_NAN_MODE {mode:g}"
