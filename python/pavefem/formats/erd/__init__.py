"""ERD files of road profiles: a header in text, then the elevations at a constant step.

The format is that of the Engineering Research Division of UMTRI, in which RoadRuf, ProVAL and LTPP
exchange profiles: "The ERD File Specification" (UMTRI), and M. W. Sayers and S. M. Karamihas,
"ERD file format for storage and analysis of road profiles" (UMTRI; appendix A of the RoadRuf
reference manual, 1997).

Line 1 is ``ERDFILEV2.00``. Line 2 is ``NCHAN, NSAMP, NRECS, NBYTES, KEYNUM, STEP, KEYOPT``:
number of channels, of samples in each (-1: as many as there are), of binary records and of bytes
in each, how the numbers are stored (0: 2-byte integers, 1: 4-byte reals, 5: text), distance
between the samples, and one that is not used here. Each further line is a keyword in the first 8
characters and its text; those that have nothing to do with the profile are skipped. The header
ends with the line ``END``. A name or unit of each channel takes 8 characters (``SHORTNAM``,
``UNITSNAM``) or 32 (``LONGNAME``, ``GENNAME``). The numbers follow sample by sample, one for each
channel: as text below the header, as binary either there or, as UMTRI has it, in a file of the
same name with the suffix ``.bin``.

Checked against published material: the layout of LTPP's text files, and UMTRI's rules of header
and ``.bin`` file. Not checked against any, for want of a public file: what KEYNUM 0 and 1 stand
for, the widths of long names, records, the keywords GAIN, OFFSET and XSTART, and lines continued
by ``&``.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal

import numpy as np

from pavefem.formats.erd.header import MAGIC, STORED, Header
from pavefem.formats.erd.numbers import read_numbers, stations
from pavefem.formats.erd.write import write_erd
from pavefem.formats.tracks import in_order_of_tracks, listed, name_tracks
from pavefem.formats.units import METRES, check_plausible, check_units, choose_units
from pavefem.profile import Profile, ProfileSource

__all__ = ["MAGIC", "read_erd", "write_erd"]

MAX_ELEVATION: Final = 1e5
"""Highest elevation, m, that is believed of binary numbers."""

BYTE_ORDERS: Final = {"little": "<", "big": ">"}


@np.errstate(all="ignore")  # what overflows is refused as not finite
def read_erd(
    path: str | os.PathLike[str],
    *,
    channels: Sequence[int | str] | None = None,
    station_unit: str | None = None,
    elevation_unit: str | None = None,
    byte_order: Literal["little", "big"] = "little",
    name: str | None = None,
) -> Profile:
    """Read the profile in an ERD file.

    Parameters
    ----------
    path : str or os.PathLike
        The file with the header. Binary numbers are in it, or beside it with the suffix ``.bin``.
    channels : sequence of int or str, optional
        Channels of elevations, counted from 0 or by short or long name; each is a track. By
        default the one that is named an elevation, or profile, or those of the left, right and
        center track; else the only one.
    station_unit, elevation_unit : {"m", "cm", "mm", "km", "in", "ft", "mi", "mil"}, optional
        Units in the file. By default those of the header, and m where it has none.
    byte_order : {"little", "big"}, optional
        Order of the bytes of a binary number; the header does not say.
    name : str, optional
        Name of the profile; by default the title in the header, or the name of the file.

    Returns
    -------
    Profile
        In m, with tracks if there are several; ``.source`` says what was understood of the file.
        Stations start at 0, or at XSTART if the header has it.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    FormatError
        If the file is no ERD file or a damaged one, holds fewer or more numbers than its header
        says, does not say which channels are elevations, or has units that are not of a length.
    ValueError
        If an option is not one of those allowed.

    Notes
    -----
    Where the header has the keywords GAIN or OFFSET, with one number for each channel, an
    elevation is gain times number plus offset, in the unit of its channel.
    """
    check_units(station_unit, elevation_unit)
    if byte_order not in BYTE_ORDERS:
        raise ValueError(f"byte_order must be 'little' or 'big', got {byte_order!r}")
    header = Header.read(Path(path))
    chosen, tracks = _choose_channels(header, channels)
    stated = [header.unit("XUNITS"), *(header.channels[i].unit for i in chosen)]
    units, units_from = choose_units(header.error, stated, (station_unit, elevation_unit))

    table = read_numbers(header, BYTE_ORDERS[byte_order])
    metres = METRES[units[0]]
    start = header.real("XSTART") or 0.0
    x = stations(start * metres, header.step * metres, table.shape[0])
    z = [
        (header.channels[i].gain * table[:, i] + header.channels[i].offset) * METRES[unit]
        for i, unit in zip(chosen, units[1:], strict=True)
    ]
    for elevation in z:
        if header.encoding == "f4" and np.abs(elevation).max() > MAX_ELEVATION:
            raise header.error(
                f"an elevation of {np.abs(elevation).max():.3g} m, at most {MAX_ELEVATION:g} m is "
                f"believed; the numbers were read in {byte_order}-endian order: pass byte_order="
            )
        if "default" in units_from:
            check_plausible(header.error, x, elevation, units_from)
    source = ProfileSource(
        path=os.fspath(path),
        format=f"ERD, {STORED[header.encoding]}",
        rows=table.shape[0],
        header=tuple(channel.name for channel in header.channels),
        columns=(-1, *chosen),
        units=units,
        units_from=units_from,
    )
    try:
        return Profile(
            x,
            z[0],
            (header.text("TITLE") or Path(path).stem) if name is None else name,
            source=source,
            tracks=dict(zip(tracks, z, strict=True)) if tracks else None,
        )
    except ValueError as error:  # numbers that fit a file but, in m, no profile
        raise header.error(str(error)) from None


def _choose_channels(
    header: Header, channels: Sequence[int | str] | None
) -> tuple[list[int], tuple[str, ...]]:
    """Channels of elevations, and the names of the tracks if there are several."""
    known = header.channels
    if channels is not None:
        if isinstance(channels, str) or len(channels) == 0:
            raise ValueError(f"channels must be numbers or names, one or more, got {channels!r}")
        chosen = [_find_channel(header, wanted) for wanted in channels]
        if len(set(chosen)) < len(chosen):
            raise header.error(f"channels={channels!r} has the same channel twice")
    else:
        tracks = {i: track for i in range(len(known)) if (track := known[i].track) is not None}
        chosen = in_order_of_tracks(tracks) if tracks else [0]
        if not chosen or (not tracks and len(known) > 1):
            raise header.error(
                f"which of {len(known)} channels ({listed(c.name for c in known)}) are "
                "elevations? Pass channels=, names or numbers counted from 0"
            )
    return chosen, name_tracks([known[i].track or known[i].name for i in chosen])


def _find_channel(header: Header, wanted: int | str) -> int:
    if isinstance(wanted, str):
        key = wanted.strip().lower()
        found = [
            i
            for i, channel in enumerate(header.channels)
            if key in (channel.short.lower(), channel.long.lower(), channel.track)
        ]
    else:
        found = [i for i in range(len(header.channels)) if i == wanted]
    if len(found) != 1:
        raise header.error(
            f"channels: {wanted!r} is {len(found)} of the file's channels, must be one; it has "
            f"0 to {len(header.channels) - 1} ({listed(c.name for c in header.channels)})"
        )
    return found[0]
