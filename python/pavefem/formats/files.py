"""Files as the readers need them: that they are files, and their bytes as text."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from pavefem.errors import FormatError

_CONTROL_BYTE: Final = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")


def check_is_file(path: Path) -> None:
    """Raise FormatError if there is something at `path` that is no file, such as a folder."""
    if path.exists() and not path.is_file():
        raise FormatError("is a directory or a device; a file is needed", path=path)


def decode_text(content: bytes, path: Path, start: int = 0) -> str:
    """Text of a file from byte `start` on, in UTF-8 or Latin-1."""
    if start == 0 and content.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise FormatError("is UTF-16 text; save it as UTF-8", path=path, byte=0)
    control = _CONTROL_BYTE.search(content)
    if control is not None:
        raise FormatError(
            f"is not text: it holds the control byte 0x{content[control.start()]:02x}",
            path=path,
            byte=start + control.start(),
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")
