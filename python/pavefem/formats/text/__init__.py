"""Profiles in columns of text: one line per station, any usual delimiter and decimal mark.

What a file does not say is not guessed: where two readings are possible, the file is refused and
the message names the option that decides. What was understood is kept in `Profile.source`.

Above the numbers there may be lines of metadata (``Road: A12``, ``Lane;2``, ``Date;12.03.2021``),
then one line of column names, with units (``Station [m];Höhe links [mm];Höhe rechts [mm]``) or
with those in a line of their own below it. Metadata without column names are refused, and so are
units that only they speak of: ``skip=`` and the options for units decide.

A text file does not say how many lines it has: one that is cut short reads as a shorter profile,
and its last number may have lost digits.

Checked against published files: station and elevation in two columns without a header (github
michalsorel/iri), and elevations with decimal commas and without stations, between semicolons
(github vsimko/rroad). Not checked against any, for want of a public file: exports of ProVAL, and
those of European profilers with metadata, units and both wheel paths. The rules above are what is
read of them.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from pavefem.formats.files import check_is_file
from pavefem.formats.text.columns import choose_columns, column_units, read_labels
from pavefem.formats.text.layout import DELIMITERS, detect_layout
from pavefem.formats.text.lines import Text
from pavefem.formats.text.numbers import check_numbers, read_numbers
from pavefem.formats.text.stations import target_spacing, without_rounding
from pavefem.formats.text.write import write_csv
from pavefem.formats.units import METRES, QUANTITIES, check_plausible, check_units
from pavefem.profile import Profile, ProfileSource

__all__ = ["check_columns", "read_text", "write_csv"]


@np.errstate(all="ignore")  # what overflows is refused as not finite
def read_text(
    path: str | os.PathLike[str],
    *,
    columns: Sequence[int | str] | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    station_unit: str | None = None,
    elevation_unit: str | None = None,
    step: float | None = None,
    spacing: float | Literal["median", "file"] = "median",
    skip: int = 0,
    name: str | None = None,
) -> Profile:
    r"""Read a profile from columns of text.

    The file holds, below lines of metadata, at most one line of column names, which may carry
    units (``station [m]``, ``Distance (km)``, ``elevation_mm``) or have them in a line of their
    own below it, and one line per station. Comment lines start with ``#`` or ``%``; one directly
    above the data counts as the column names if its names do. Elevations of several wheel paths
    (``Left Elevation (in)``, ``Right Elevation (in)``) become the tracks of one profile.

    Parameters
    ----------
    path : str or os.PathLike
        File, in UTF-8 or Latin-1.
    columns : sequence of int or str, optional
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
    step : float, optional
        Distance between the samples of a file that has no stations, m. They then start at 0, and
        all `columns` are elevations.
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
    _check_options(delimiter, decimal, (station_unit, elevation_unit), step, spacing, skip)
    check_is_file(Path(path))
    text = Text.parse(Path(path), Path(path).read_bytes(), skip)
    layout = detect_layout(text, delimiter, decimal, 1 if step else 2)
    labels = read_labels(text, layout)
    chosen, tracks = choose_columns(text, layout, labels, columns, step is None)
    quantities = _quantities(tracks)
    options = (station_unit if step is None else "m", elevation_unit)
    units, units_from = column_units(text, labels, chosen, options)

    if step is None:
        table = read_numbers(text, layout, chosen, quantities)
    else:
        table = read_numbers(text, layout, chosen[1:], quantities[1:])
        table = np.column_stack([step * np.arange(len(table)), table])
    printed, *elevations = table.T
    check_numbers(text, printed, elevations, quantities)
    grid = None if spacing == "file" else without_rounding(printed)
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
    target = target_spacing(text, profile, spacing)
    if target is not None:
        profile = profile.resample(target)

    as_read = grid is None and target is None
    gaps = np.diff(printed) * METRES[units[0]]
    mark = {".": "decimal point", ",": "decimal comma"}[layout.decimal]
    source = ProfileSource(
        path=os.fspath(path),
        format=f"columns of text, {DELIMITERS[layout.delimiter]} and {mark}",
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


def check_columns(path: Path, head: bytes) -> None:
    """Raise FormatError unless the first lines of a file are columns of text."""
    text = Text.parse(path, head)
    read_labels(text, detect_layout(text))


def _quantities(tracks: Sequence[str]) -> tuple[str, ...]:
    """Name station and elevations, for messages."""
    return ("station", *(f"{track} elevation" for track in tracks)) if tracks else QUANTITIES


def _check_options(
    delimiter: str | None,
    decimal: str | None,
    units: tuple[str | None, str | None],
    step: float | None,
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
    if step is not None and not _is_positive(step):
        raise ValueError(f"step must be positive (m), got {step!r}")
    if step is not None and units[0] not in (None, "m"):
        raise ValueError(f"step is in m, so that station_unit={units[0]!r} has no meaning")
    if spacing not in ("median", "file") and not _is_positive(spacing):
        raise ValueError(f"spacing must be 'median', 'file' or positive (m), got {spacing!r}")
    if not isinstance(skip, int) or skip < 0:
        raise ValueError(f"skip must be at least 0 lines, got {skip!r}")


def _is_positive(value: float | str) -> bool:
    return isinstance(value, (int, float)) and bool(np.isfinite(value)) and value > 0.0
