"""ERD files that are written: text numbers, in m, at full precision."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pavefem._files import replacing
from pavefem.formats.erd.header import NAME_WIDTHS
from pavefem.formats.erd.numbers import stations
from pavefem.profile import Profile

SHORT_NAMES: Final = {"left": "LElev.", "right": "RElev.", "center": "CElev."}
"""Names in LTPP's files; for any other track, its own is cut to fit."""


def write_erd(profile: Profile, path: str | os.PathLike[str]) -> None:
    """Write a profile as an ERD file with text numbers, in m, at full precision.

    Each track is a channel. `read_erd` gives the same elevations and, within rounding, stations;
    for tracks that are not left, right or center it needs ``channels=``. The station of the first
    sample, where it is not 0, is kept in the keyword XSTART.

    Parameters
    ----------
    profile : Profile
        Uniform profile.
    path : str or os.PathLike
        File to write; an existing one is replaced.

    Raises
    ------
    ValueError
        If the stations are not uniform, as the file holds their spacing instead of them, or if
        a name of a track is longer than 32 characters.
    """
    if not profile.is_uniform:
        raise ValueError(
            "stations are irregular and an ERD file holds one spacing; "
            "write profile.resample(spacing)"
        )
    columns = profile.by_track
    width = NAME_WIDTHS["LONGNAME"]
    for track in columns:
        if len(track) > width:
            raise ValueError(f"track {track!r} is longer than {width} characters")
    long = [
        f"{track.capitalize()} elevation" if track in SHORT_NAMES else track for track in columns
    ]
    lines = [
        "ERDFILEV2.00",
        f"{len(columns)}, {profile.x.size}, -1, 1, 5, {_step(profile.x)!r}, -1,",
        f"TITLE   {' '.join(profile.name.split())}",
        _names("SHORTNAM", [SHORT_NAMES.get(track, track[:7] or "Elev.") for track in columns]),
        _names("LONGNAME", [text or "Elevation" for text in long]),
        _names("GENNAME", ["Profile elevation"] * len(columns)),
        _names("UNITSNAM", ["m"] * len(columns)),
        "XLABEL  Distance",
        "XUNITS  m",
        *([f"XSTART  {float(profile.x[0])!r}"] if profile.x[0] != 0.0 else []),
        "END",
    ]
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    with replacing(path) as new, new.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(line.rstrip() + "\n" for line in lines)
        file.writelines(" ".join(map(repr, row)) + "\n" for row in rows)


def _names(keyword: str, names: Sequence[str]) -> str:
    width = NAME_WIDTHS[keyword]
    return f"{keyword:8}" + "".join(name.ljust(width) for name in names)


def _step(x: NDArray[np.float64]) -> float:
    """Spacing that gives the stations `x` back, as exactly as one can."""
    mean = float(x[-1] - x[0]) / (x.size - 1)
    short = float(f"{mean:.9g}")
    return min(short, mean, key=lambda step: np.abs(stations(float(x[0]), step, x.size) - x).max())
