"""Files that pavefem reads, one module per format."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from pavefem.errors import FormatError
from pavefem.formats.crg import read_crg
from pavefem.formats.erd import read_erd
from pavefem.formats.text import read_text
from pavefem.profile import Profile

__all__ = ["read_profile"]

PROFILE_READERS: Final[dict[str, Callable[..., Profile]]] = {
    ".crg": read_crg,
    ".csv": read_text,
    ".dat": read_text,
    ".erd": read_erd,
    ".tsv": read_text,
    ".txt": read_text,
}
"""Reader of each profile file suffix, in lower case."""


def read_profile(path: str | os.PathLike[str], **options: Any) -> Profile:
    """Read a road profile; the suffix of the file says the format.

    Parameters
    ----------
    path : str or os.PathLike
        ``.txt``, ``.csv``, ``.dat`` and ``.tsv`` are columns of text, ``.erd`` is UMTRI's format,
        ``.crg`` ASAM's OpenCRG.
    **options
        Options of the reader: see `pavefem.formats.text.read_text`,
        `pavefem.formats.erd.read_erd` and `pavefem.formats.crg.read_crg`.

    Returns
    -------
    Profile
        Stations and elevations in m; ``.source`` says what was understood of the file.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    FormatError
        If the suffix is not a known one, or the file does not hold what its format calls for.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in PROFILE_READERS:
        raise FormatError(
            f"suffix {suffix!r} is not a profile format; "
            f"supported are {', '.join(PROFILE_READERS)}",
            path=path,
        )
    return PROFILE_READERS[suffix](path, **options)
