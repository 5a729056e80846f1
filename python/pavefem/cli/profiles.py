"""Options of the commands that read profiles: those of the readers, as the terminal has them."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from pavefem.formats import PROFILE_READERS, read_profile
from pavefem.formats.units import METRES
from pavefem.profile import Profile

_UNITS = ", ".join(METRES)

Files = Annotated[
    list[Path],
    typer.Argument(help=f"Profiles: {', '.join(PROFILE_READERS)}.", metavar="FILE", readable=False),
]


def _given(
    *,
    track: Annotated[
        str | None,
        typer.Option(help='One track of several, such as "left".  [default: all; run: the first]'),
    ] = None,
    elevation_unit: Annotated[
        str | None,
        typer.Option(help=f"Unit of elevations, where the file has none: {_UNITS}.  [default: m]"),
    ] = None,
    station_unit: Annotated[
        str | None, typer.Option(help="Unit of stations, where the file has none.  [default: m]")
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(
            help="Columns of a text file to read, by name or counted from 0: station, then the "
            "elevation of each track; such as 0,2."
        ),
    ] = None,
    channels: Annotated[
        str | None,
        typer.Option(
            help="Channels of an ERD file to read, by name or counted from 0: the elevation of "
            "each track."
        ),
    ] = None,
    step: Annotated[
        float | None, typer.Option(help="Distance between samples, m, of text without stations.")
    ] = None,
    decimal: Annotated[
        str | None, typer.Option(help="Decimal mark of a text file, where it leaves that open.")
    ] = None,
    skip: Annotated[
        int | None, typer.Option(help="Lines to ignore at the top of a text file.")
    ] = None,
    lateral: Annotated[
        list[float] | None,
        typer.Option(
            help="Lateral position on an OpenCRG road, m, positive to the left; give it once for "
            "each track.  [default: 0]"
        ),
    ] = None,
) -> dict[str, Any]:
    """Return what is given of the options."""
    return {name: value for name, value in locals().items() if value not in (None, [])}


def with_reader_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command these options; it gets those that are given as `reader`, for `read`."""
    own = inspect.signature(command, eval_str=True).parameters.values()
    options = inspect.signature(_given, eval_str=True).parameters

    @functools.wraps(command)
    def with_options(**given: Any) -> None:
        reader = _given(**{name: given.pop(name) for name in options})
        command(**given, reader=reader)

    parameters = [*(one for one in own if one.name != "reader"), *options.values()]
    with_options.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in parameters]
    )
    return with_options


def read(path: Path, reader: dict[str, Any]) -> Profile:
    """Read a profile as the options say."""
    options = dict(reader)
    track, lateral = options.pop("track", None), options.pop("lateral", None)
    for name in ("columns", "channels"):
        if name in options:
            options[name] = _listed(options[name])
    if lateral is not None:
        options["v"] = lateral if len(lateral) > 1 else lateral[0]
    profile = read_profile(path, **options)
    return profile if track is None else profile.track(track)


def _listed(text: str) -> list[str | int]:
    """Split names and numbers of columns at their commas."""
    names = [name.strip() for name in text.split(",")]
    return [int(name) if name.isdecimal() else name for name in names]
