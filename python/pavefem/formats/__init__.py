"""Road profiles in files: ERD, OpenCRG and columns of text, each with a reader of its own."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pavefem.errors import FormatError
from pavefem.formats import crg, erd
from pavefem.formats.crg import read_crg
from pavefem.formats.erd import read_erd
from pavefem.formats.files import check_is_file
from pavefem.formats.foreign import known_other
from pavefem.formats.text import check_columns, read_text
from pavefem.profile import Profile

__all__ = ["PROFILE_READERS", "read_profile"]

HEAD: Final = 64 * 1024
"""First bytes of a file by which its format is told."""


@dataclass(frozen=True)
class _Format:
    """A format, its reader, and how it is told by suffix and by content."""

    name: str
    suffixes: tuple[str, ...]
    read: Callable[..., Profile]
    is_in: Callable[[bytes], bool]  # whether the first bytes can be of no other format
    start: str  # what a file has to start with


_ERD: Final = _Format(
    "an ERD file",
    (".erd",),
    read_erd,
    lambda head: erd.MAGIC.match(head) is not None,
    "an ERD file starts with ERDFILEV2.00",
)
_CRG: Final = _Format(
    "an OpenCRG file",
    (".crg",),
    read_crg,
    lambda head: crg.MAGIC.search(head) is not None,
    "an OpenCRG file starts with sections such as $CT and $ROAD_CRG",
)
_TEXT: Final = _Format(
    "columns of text",
    (".csv", ".dat", ".tsv", ".txt"),
    read_text,
    lambda head: False,
    "columns of text start with column names or numbers",
)
_FORMATS: Final = (_CRG, _ERD, _TEXT)

PROFILE_READERS: Final[dict[str, Callable[..., Profile]]] = {
    suffix: fmt.read for fmt in _FORMATS for suffix in sorted(fmt.suffixes)
}
"""Reader of each profile file suffix, in lower case."""


def read_profile(path: str | os.PathLike[str], **options: Any) -> Profile:
    """Read a road profile, in the format of its content and, where that is open, its suffix.

    Parameters
    ----------
    path : str or os.PathLike
        UMTRI's ERD (``.erd``), ASAM's OpenCRG (``.crg``), or columns of text (``.csv``, ``.dat``,
        ``.tsv``, ``.txt``). The first two are told by what they start with, whatever their
        suffix; a file of any other suffix is taken if its content leaves no doubt.
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
        If neither suffix nor content are of a known format, if they contradict each other, or if
        the file does not hold what its format calls for.
    ValueError
        If the reader does not have an option, or not with that value.
    """
    fmt = _format_of(Path(path))
    known = [name for name in inspect.signature(fmt.read).parameters if name != "path"]
    unknown = [name for name in options if name not in known]
    if unknown:
        raise ValueError(
            f"{os.fspath(path)} is {fmt.name}, and its reader has no option {', '.join(unknown)}; "
            f"it has {', '.join(known)}"
        )
    return fmt.read(path, **options)


def _format_of(path: Path) -> _Format:
    """Format of a file, if need be by its suffix."""
    check_is_file(path)
    suffix = path.suffix.lower()
    by_suffix = next((fmt for fmt in _FORMATS if suffix in fmt.suffixes), None)
    if by_suffix is None and not path.exists():
        raise FormatError(_unknown(suffix), path=path)
    with path.open("rb") as file:
        head = file.read(HEAD)
    by_content = next((fmt for fmt in _FORMATS if fmt.is_in(head)), None)
    if by_content is not None:
        return by_content
    other = known_other(head, suffix)
    if other is not None:
        expected = _unknown(suffix) if by_suffix is None else by_suffix.start
        raise FormatError(f"is {other}; {expected}", path=path, byte=0)
    if by_suffix is _TEXT:
        return _TEXT
    try:
        check_columns(path, head if len(head) < HEAD else _whole_lines(head))
    except FormatError as error:
        if by_suffix is not None:  # its reader says what is missing
            return by_suffix
        raise FormatError(
            f"{_unknown(suffix)}; nor is its content ({error.message})",
            path=path,
            line=error.line,
            byte=error.byte,
        ) from None
    if by_suffix is not None:
        raise FormatError(
            f"holds columns of text, and {by_suffix.start}; give the file the suffix .txt or .csv",
            path=path,
            line=1,
        )
    return _TEXT


def _whole_lines(head: bytes) -> bytes:
    return head[: max(head.rfind(b"\n"), head.rfind(b"\r")) + 1]


def _unknown(suffix: str) -> str:
    supported = ", ".join(PROFILE_READERS)
    return f"suffix {suffix!r} is not a profile format; supported are {supported}"
