"""Options of the commands that read profiles: those of the readers, as the terminal has them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from pavefem.formats import PROFILE_READERS
from pavefem.formats.units import METRES

_UNITS = ", ".join(METRES)

ElevationUnit = Annotated[
    str | None,
    typer.Option(help=f"Unit of elevations, where the file has none: {_UNITS}.  [default: m]"),
]
StationUnit = Annotated[
    str | None, typer.Option(help="Unit of stations, where the file has none.  [default: m]")
]
Columns = Annotated[
    str | None,
    typer.Option(
        help="Columns of a text file to read, by name or counted from 0: station, then the "
        "elevation of each track; such as 0,2."
    ),
]
Channels = Annotated[
    str | None,
    typer.Option(
        help="Channels of an ERD file to read, by name or counted from 0: the elevation of each "
        "track."
    ),
]
Step = Annotated[
    float | None, typer.Option(help="Distance between samples, m, of text without stations.")
]
Decimal = Annotated[
    str | None, typer.Option(help="Decimal mark of a text file, where it leaves that open.")
]
Skip = Annotated[int | None, typer.Option(help="Lines to ignore at the top of a text file.")]
Lateral = Annotated[
    list[float] | None,
    typer.Option(
        help="Lateral position on an OpenCRG road, m, positive to the left; give it once for each "
        "track.  [default: 0]"
    ),
]
Files = Annotated[
    list[Path],
    typer.Argument(help=f"Profiles: {', '.join(PROFILE_READERS)}.", metavar="FILE", readable=False),
]


def reader_options(
    *,
    columns: str | None = None,
    channels: str | None = None,
    lateral: list[float] | None = None,
    **others: str | float | None,
) -> dict[str, Any]:
    """Return what was given of the options above, as `read_profile` takes them."""
    options = others | {
        "columns": _listed(columns),
        "channels": _listed(channels),
        "v": lateral if lateral is None or len(lateral) > 1 else lateral[0],
    }
    return {name: value for name, value in options.items() if value is not None}


def _listed(text: str | None) -> list[str | int] | None:
    """Split names and numbers of columns at their commas."""
    if text is None:
        return None
    names = [name.strip() for name in text.split(",")]
    return [int(name) if name.isdecimal() else name for name in names]
