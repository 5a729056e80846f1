"""Columns of text that are written: comma-separated, in m, at full precision."""

from __future__ import annotations

import os
import re

from pavefem._files import replacing
from pavefem.formats.tracks import TRACKS
from pavefem.profile import Profile


def write_csv(profile: Profile, path: str | os.PathLike[str]) -> None:
    """Write stations and elevations (m) as comma-separated text, at full precision.

    `pavefem.formats.text.read_text` gives the same numbers. For irregular stations it needs
    ``spacing="file"``, and for tracks that are not left, right or center ``columns=``, the
    station and the names of the tracks.

    Parameters
    ----------
    profile : Profile
    path : str or os.PathLike
        File to write; an existing one is replaced.
    """
    columns = [profile.x, *profile.by_track.values()]
    names = [_column_name(track) for track in profile.by_track]
    with replacing(path) as new, new.open("w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(["station_m", *names]) + "\n")
        rows = zip(*(column.tolist() for column in columns), strict=True)
        file.writelines(",".join(map(repr, row)) + "\n" for row in rows)


def _column_name(track: str) -> str:
    """Name that is read back as that of the track."""
    if track in ("", *TRACKS):
        return f"{track}_elevation_m".strip("_")
    return re.sub(r'[][(),;"]', " ", track).strip() + " [m]"
