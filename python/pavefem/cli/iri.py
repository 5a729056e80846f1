"""``pavefem iri``: how rough profiles are, whole and in segments."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Final, NamedTuple

import numpy as np
import typer
import xarray as xr
from rich.table import Table
from rich.text import Text

from pavefem import roughness
from pavefem._files import check_writable, replacing
from pavefem.cli.profiles import Files, read, with_reader_options
from pavefem.cli.terminal import console, each_file, reporting


class Format(StrEnum):
    """How roughness is written."""

    TABLE = "table"
    CSV = "csv"
    JSON = "json"


SUFFIXES: Final = {".csv": Format.CSV, ".json": Format.JSON}
"""What a file is written as if not told."""


class Part(NamedTuple):
    """A segment of a profile, or the whole."""

    start: float
    """Station at which it starts, m."""
    end: float
    """Station at which it ends, m."""
    values: list[float]
    """IRI of each track, m/km, and last the MRI if there are two wheel tracks."""


class Roughness(NamedTuple):
    """How rough one profile is."""

    path: Path
    tracks: list[str]
    """Names of the tracks, an empty one for a track without a name."""
    has_mri: bool
    segments: list[Part]
    whole: Part

    @property
    def columns(self) -> list[str]:
        """Names of the values of a part, for people."""
        names = [f"IRI {track}".strip() for track in self.tracks] + ["MRI"] * self.has_mri
        return [f"{name} [m/km]" for name in names]

    @property
    def keys(self) -> list[str]:
        """Names of the values of a part, for programs."""
        names = [f"{track}_iri".strip("_") for track in self.tracks] + ["mri"] * self.has_mri
        return [f"{name}_m_per_km" for name in names]


@reporting()
@with_reader_options
def iri(
    files: Files,
    segment: Annotated[float, typer.Option(help="Length of the segments, m.")] = 100.0,
    moving_average: Annotated[
        bool,
        typer.Option(help="Average elevations over 0.25 m; not for what was smoothed before."),
    ] = True,
    format_: Annotated[
        Format | None,
        typer.Option("--format", help="How to write it.  [default: as --out ends, else table]"),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="File to write CSV or JSON to.", metavar="FILE")
    ] = None,
    *,
    reader: dict[str, Any],
) -> None:
    """Print the international roughness index of profiles, in m/km.

    For each track of each file, in segments and of the whole; with two wheel tracks also their mean
    (MRI). A file that cannot be used is reported and loses none of the others; the exit code is
    then 2.
    """
    if not (math.isfinite(segment) and segment > 0.0):
        raise ValueError(f"--segment is {segment:g} m: must be above 0 and finite")
    chosen = _checked_format(format_, out, files)
    found, failed = each_file(files, lambda path: _measure(path, segment, moving_average, reader))
    if chosen is Format.TABLE:
        for profile in found:
            _print_table(profile)
    elif found:
        text = _as_csv(found) if chosen is Format.CSV else _as_json(found)
        if out is None:
            typer.echo(text, nl=False)
        else:
            with replacing(out) as file:
                file.write_text(text, encoding="utf-8", newline="")
            console.print(f"wrote {out}", highlight=False, markup=False, soft_wrap=True)
    if failed:
        raise typer.Exit(2)


def _checked_format(given: Format | None, out: Path | None, files: Sequence[Path]) -> Format:
    """Return how to write, when there is a place to write it to."""
    if out is None:
        return given or Format.TABLE
    chosen = given or SUFFIXES.get(out.suffix.lower())
    if chosen is None or chosen is Format.TABLE:
        raise ValueError(f"--out {out}: give --format csv or json, or such a suffix")
    check_writable(out.parent)
    if out.exists():
        if not out.is_file():
            raise ValueError(f"--out {out} is a directory or a device; a file is needed")
        if any(path.exists() and path.samefile(out) for path in files):
            raise ValueError(f"--out {out} is one of the profiles; it would be lost")
    return chosen


def _measure(
    path: Path,
    segment: float,
    moving_average: bool,
    reader: dict[str, Any],
) -> Roughness:
    """Read a profile and find how rough it is."""
    profile = read(path, reader)
    tracks = list(profile.tracks) or [reader.get("track", "")]
    has_mri = bool(roughness.wheel_tracks(profile))
    segments, whole = (
        roughness.iri(profile, segment=length, moving_average=moving_average)
        for length in (segment, None)
    )

    def values(index: xr.DataArray) -> list[list[float]]:
        rows = [index.to_numpy().reshape(len(tracks), -1)]
        if has_mri:
            rows.append(roughness.wheel_mean(profile, index).to_numpy().reshape(1, -1))
        return [column.tolist() for column in np.vstack(rows).T]

    starts, lengths = segments["start"].to_numpy(), segments["length"].to_numpy()
    ends = starts + lengths
    return Roughness(
        path,
        tracks,
        has_mri,
        [Part(*row) for row in zip(starts.tolist(), ends.tolist(), values(segments), strict=True)],
        Part(float(profile.x[0]), float(profile.x[-1]), *values(whole)),
    )


def _print_table(found: Roughness) -> None:
    table = Table(title=Text(str(found.path)), title_justify="left")
    for name in ("from [m]", "to [m]", *found.columns):
        table.add_column(Text(name), justify="right")
    for part in (*found.segments, found.whole):
        if part is found.whole:
            table.add_section()
        stations = (f"{station:.10g}" for station in (part.start, part.end))
        table.add_row(*stations, *(f"{value:.2f}" for value in part.values))
    console.print(table)


def _as_csv(found: Sequence[Roughness]) -> str:
    """Write a line for each segment and each whole; what a profile has not is left empty."""
    keys = dict.fromkeys(key for profile in found for key in profile.keys)
    text = io.StringIO()
    table = csv.DictWriter(
        text, ["file", "part", "start_m", "end_m", *keys], restval="", lineterminator="\n"
    )
    table.writeheader()
    for profile in found:
        for number, part in enumerate((*profile.segments, profile.whole), start=1):
            name = "whole" if part is profile.whole else f"segment {number}"
            place = {"file": profile.path, "part": name, "start_m": part.start, "end_m": part.end}
            table.writerow(place | dict(zip(profile.keys, part.values, strict=True)))
    return text.getvalue()


def _as_json(found: Sequence[Roughness]) -> str:
    """Write a list of profiles, with the values of each part by what they are."""

    def entry(profile: Roughness, part: Part) -> dict[str, float]:
        place = {"start_m": part.start, "end_m": part.end}
        return place | dict(zip(profile.keys, part.values, strict=True))

    profiles = [
        {
            "file": str(profile.path),
            "segments": [entry(profile, part) for part in profile.segments],
            "whole": entry(profile, profile.whole),
        }
        for profile in found
    ]
    return json.dumps(profiles, indent=2) + "\n"
