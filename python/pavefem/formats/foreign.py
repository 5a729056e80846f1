"""Files that hold no profile that can be read, told by their first bytes."""

from __future__ import annotations

import re
from typing import Final

_ZIPPED: Final = (
    (b"xl/", "an Excel workbook", "save its sheet as CSV"),
    (b"opendocument.spreadsheet", "an OpenDocument spreadsheet", "save its sheet as CSV"),
    (b"", "a ZIP archive", "unpack it"),
)
"""What a ZIP archive with these bytes among its first ones is, and what to do with it."""

_SIGNATURES: Final = (
    (rb"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an old Excel workbook", "save its sheet as CSV"),
    (rb"\x89HDF\r\n\x1a\n", "HDF5, or netCDF-4", "export the profile as CSV"),
    (rb"CDF[\x01\x02\x05]", "netCDF", "export the profile as CSV"),
    (rb"MATLAB \d\.\d MAT-file", "a MATLAB file", "export the profile as CSV"),
    (rb"PAR1[\x00-\x1f]", "a Parquet file", "export the profile as CSV"),
    (rb"SQLite format 3\0", "an SQLite database", "export the profile as CSV"),
    (rb"%PDF-", "a PDF document", "ask for the numbers in it as CSV or ERD"),
    (rb"\x1f\x8b", "a gzip archive", "unpack it"),
    (rb"BZh\d1AY&SY", "a bzip2 archive", "unpack it"),
    (rb"\xfd7zXZ\0|7z\xbc\xaf\x27\x1c|Rar!\x1a\x07", "an archive", "unpack it"),
    (rb"\x89PNG\r\n\x1a\n|\xff\xd8\xff|GIF8[79]a|BM....\0\0\0\0", "a picture", "find its numbers"),
    (rb"(\xef\xbb\xbf)?\s{0,80}<[?!A-Za-z]", "XML or HTML", "save its table as CSV"),
    (rb"(\xef\xbb\xbf)?\s{0,80}[\[{]\s{0,80}[\[{\"]", "JSON", "save its table as CSV"),
)
"""First bytes, what they are those of, and what to do with such a file."""

_COMPILED: Final = tuple(
    (re.compile(pattern, re.DOTALL), what, advice) for pattern, what, advice in _SIGNATURES
)


def known_other(head: bytes, suffix: str) -> str | None:
    """Say what a file is that is none of the formats read here, and what to do with it.

    Parameters
    ----------
    head : bytes
        First bytes of the file, some ten thousand of them.
    suffix : str
        Of the file, in lower case; it counts only where the bytes are not those of text.

    Returns
    -------
    str or None
        None if the file is not known.
    """
    if head.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        return next(f"{what}: {advice}" for sign, what, advice in _ZIPPED if sign in head)
    if suffix == ".ppf" and b"\0" in head:
        return "a pavement profile file of ASTM E2560: export it as ERD from ProVAL"
    found = (f"{what}: {advice}" for sign, what, advice in _COMPILED if sign.match(head))
    return next(found, None)
