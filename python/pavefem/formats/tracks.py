"""Names of columns and channels: which is a station, and which the elevation of which track."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Final

TRACKS: Final[dict[str, tuple[str, ...]]] = {
    "left": ("left", "lft", "lt", "l", "lwp", "links", "gauche", "izquierda", "sinistra"),
    "right": ("right", "rgt", "rt", "r", "rwp", "rechts", "droite", "derecha", "destra"),
    "center": ("center", "centre", "ctr", "c", "cwp", "mitte"),
}
"""Words that say which track an elevation is of, in the order of the tracks of a profile."""

STATION_WORDS: Final = frozenset(
    {
        *("station", "stations", "distance", "chainage", "x", "s"),
        *("weg", "stationierung", "abscisse", "distancia", "progressiva", "afstand"),
    }
)

ELEVATION_WORDS: Final = frozenset(
    {
        *("elevation", "elevations", "elev", "height", "z", "höhe", "hoehe"),
        *("altitude", "cota", "quota", "hoogte"),
    }
)

_SIDE: Final = {
    name: re.compile(rf"({'|'.join(words)})({'|'.join((*ELEVATION_WORDS, 'prof', 'profile'))})?")
    for name, words in TRACKS.items()
}
_SIDE_FILLER: Final = frozenset(
    {"profile", "prof", "profil", "track", "wheel", "path", "wheelpath", "wheeltrack", "trace"}
)


def words_of(name: str) -> list[str]:
    """Words of a name, in lower case: what stands between digits, blanks and signs."""
    return re.findall(r"[^\W\d_]+", name.lower())


def track_of(name: str) -> str | None:
    """Say which track of `TRACKS` a name is the elevation of.

    Returns
    -------
    str or None
        Empty if the name is of an elevation but of none, or several, of the tracks; None if it
        is not of an elevation.
    """
    words = words_of(name)
    sides = {
        side: [word for word in words if pattern.fullmatch(word)] for side, pattern in _SIDE.items()
    }
    found = [side for side, matching in sides.items() if matching]
    with_side = {word for matching in sides.values() for word in matching}
    plain = ELEVATION_WORDS.intersection(words)
    if not plain and not (with_side and with_side | _SIDE_FILLER >= set(words)):
        return None
    return found[0] if len(found) == 1 else ""


def in_order_of_tracks(tracks: dict[int, str]) -> list[int]:
    """Columns of one elevation, or of one for each track; none if there are other columns."""
    names = list(tracks.values())
    if len(names) > 1 and ("" in names or len(set(names)) < len(names)):
        return []
    order = ["", *TRACKS]
    return sorted(tracks, key=lambda i: order.index(tracks[i]))


def name_tracks(names: Sequence[str]) -> tuple[str, ...]:
    """Names of tracks, from those of their columns; none for a single one."""
    if len(names) < 2:
        return ()
    tracks = [track_of(name) or name.strip() for name in names]
    if len(set(tracks)) == len(tracks) and all(name and name.isprintable() for name in tracks):
        return tuple(tracks)
    return tuple(f"track {i}" for i in range(1, len(names) + 1))


def listed(names: Iterable[str]) -> str:
    """List names for a message, the first ones if there are many."""
    text = ", ".join(name or "without a name" for name in names)
    return text if len(text) <= 200 else text[:200] + " ..."
