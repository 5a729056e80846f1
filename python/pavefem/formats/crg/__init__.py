"""Road surfaces in ASAM OpenCRG files (``.crg``): profiles along lateral positions.

An OpenCRG file holds elevations on a grid along a reference line: u is the station on that line
and v the lateral position, positive to the left, both in m. What is read here follows the
specification, ASAM OpenCRG 1.2.0, chapter 6 (6.2 file structure, 6.4.2 road parameters, 6.4.4
data definition, 6.4.6 modifiers, 6.4.8 road data), and, where that leaves something open, the
functions ``crg_read``, ``crg_check_data`` and ``crg_eval_uv2z`` published with it.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from pavefem.formats.crg.header import MAGIC, MAX_HEADER
from pavefem.formats.crg.road import CrgSource, Road
from pavefem.profile import Profile

__all__ = ["MAGIC", "MAX_HEADER", "CrgSource", "read_crg"]


def read_crg(
    path: str | os.PathLike[str],
    *,
    v: float | Sequence[float] | Mapping[str, float] = 0.0,
    name: str | None = None,
) -> Profile:
    """Read the profile of an OpenCRG road along one lateral position, or along several.

    Elevation is that of the long sections, linear between them, plus the elevation of the
    reference line and `v` times its banking (``crg_eval_uv2z``)::

        z(u) = z_grid(u, v) + z_ref(u) + v b(u)

    z_ref starts at REFERENCE_LINE_START_Z and integrates the slope. Slope and banking are
    channels or constants of the header; the first value of a slope channel does not count, each
    other one holds from the cross section before it.

    Parameters
    ----------
    path : str or os.PathLike
        File.
    v : float, sequence of float, or mapping of str to float, optional
        Lateral position, m; positive to the left of the reference line, 0 on it. Several give a
        profile with tracks: ``{"left": 0.9, "right": -0.9}``, or named after their positions.
    name : str, optional
        Name of the profile; that of the file by default.

    Returns
    -------
    Profile
        Stations u and elevations in m; ``.source`` is a `CrgSource`.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    FormatError
        If the file is damaged, contradicts itself, refers to another file, is in other units, or
        if `v` is outside the road or has stations without elevation between others with one.
    ValueError
        If `v` is not finite, empty, or twice the same position.

    Notes
    -----
    Missing elevations (NaN) are left out at the two ends of the profile, for all tracks where one
    has none, which ``.source.trimmed`` counts. Between stations with an elevation they are
    refused.

    Of the modifiers in the file, those that scale are applied. Those that move the road as a
    whole are not, and neither is the offset to global elevations, REFERENCE_LINE_OFFSET_Z: they
    add a constant. Options, which applications need not follow, are not applied.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> text = '''$ROAD_CRG
    ... REFERENCE_LINE_INCREMENT = 0.5
    ... $
    ... $KD_DEFINITION
    ... #:LRFI
    ... D:long section at v = -1.0,m
    ... D:long section at v =  1.0,m
    ... $
    ... $$
    ...  0.0000000 0.0100000
    ...  0.0200000 0.0000000
    ... '''
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "site.crg"
    ...     _ = path.write_text(text)
    ...     profile = read_crg(path, v=0.5)
    >>> profile.x.tolist(), profile.z.tolist()
    ([0.0, 0.5], [0.0075, 0.005])
    """
    tracks = _positions(v)
    title = Path(path).stem if name is None else name
    return Road.read(Path(path)).profile(list(tracks.values()), list(tracks), title)


def _positions(v: float | Sequence[float] | Mapping[str, float]) -> dict[str, float]:
    """Lateral position (m) of each track, by name; one without a name for a number."""
    if isinstance(v, (str, bytes)):
        raise ValueError(f"v must be finite lateral positions in m, got {v!r}")
    if isinstance(v, Mapping):
        named = dict(v)
        for name in named:
            if not (isinstance(name, str) and name.isprintable() and name.strip() == name != ""):
                raise ValueError(f"name of a track must be printable text, got {name!r}")
    elif isinstance(v, (Sequence, np.ndarray)):
        named = {f"v = {value} m": value for value in v}
        if len(named) != len(v):
            raise ValueError(f"v has a position twice: {v!r}")
    else:
        named = {"": v}
    for value in named.values():
        number = isinstance(value, (int, float, np.integer, np.floating))
        if not number or not math.isfinite(value):
            raise ValueError(f"v must be finite lateral positions in m, got {value!r}")
    if not named:
        raise ValueError("v has no position; at least one is needed")
    return {name: float(value) for name, value in named.items()}
