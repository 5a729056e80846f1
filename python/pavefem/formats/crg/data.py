"""Road data of an OpenCRG file, as binary or as text, and the place to blame in it."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Final, Literal

import numpy as np
from numpy.typing import NDArray

from pavefem.errors import FormatError
from pavefem.formats.crg.header import NUMBER, Header

RECORD: Final = 80
"""Bytes of a record of road data."""

_NOT_TEXT: Final = re.compile(rb"[^\x20-\x7e\r\n]")


@dataclass(frozen=True)
class Data:
    """Road data, shape (cross sections, channels), and where its numbers stand in the file."""

    path: Path
    values: NDArray[np.floating[Any]]
    start: int  # byte of the first number, or line of the first record
    kind: Literal["text", "binary"]
    size: int  # bytes of a number

    def error_at(self, message: str, row: int, column: int) -> FormatError:
        """Return the error that blames one number."""
        if self.kind == "binary":
            number = row * self.values.shape[1] + column
            return FormatError(message, path=self.path, byte=self.start + number * self.size)
        per_record = RECORD // self.size
        records = -(-self.values.shape[1] // per_record)
        line = self.start + row * records + column // per_record
        return FormatError(message, path=self.path, line=line)

    def column(self, column: int) -> NDArray[np.float64]:
        """Return the numbers of one channel."""
        return self.values[:, column].astype(np.float64)


def read_binary(header: Header, file: BinaryIO, channels: int, size: int, rows: int | None) -> Data:
    """Big-endian numbers without a break; the last record is filled with NaN."""
    payload = os.fstat(file.fileno()).st_size - header.size
    end = header.size + payload
    if payload % RECORD:
        raise FormatError(
            f"road data of {payload} bytes is not a multiple of {RECORD}: damaged or cut short",
            path=header.path,
            byte=end,
        )
    count, per_record = payload // size, RECORD // size
    whole = count // channels
    if rows is not None:
        needed = -(-rows * channels // per_record) * RECORD
        if needed != payload:
            raise FormatError(
                f"road data of {payload} bytes; {rows} cross sections of {channels} channels, as "
                f"many as REFERENCE_LINE_END_U says, fill {needed}: damaged or cut short",
                path=header.path,
                byte=end,
            )
    elif count - whole * channels >= per_record:
        raise FormatError(
            f"road data ends within cross section {whole + 1} of {channels} channels: damaged or "
            "cut short",
            path=header.path,
            byte=end,
        )
    file.seek(header.size)
    content = file.read(payload)
    if len(content) != payload:
        raise FormatError("changes while it is read", path=header.path, byte=header.size)
    numbers = np.frombuffer(content, f">f{size}")
    # fewer than per_record numbers are filling: as many cross sections as are not
    least = max(0, -(-(count - per_record + 1) // channels))
    filled = np.flatnonzero(~np.isnan(numbers[least * channels :]))
    used = least if filled.size == 0 else least + int(filled[-1]) // channels + 1
    used = used if rows is None else rows
    if used > whole or not np.isnan(numbers[used * channels :]).all():
        raise FormatError(
            f"what follows cross section {min(used, whole)} is not filled with NaN: damaged",
            path=header.path,
            byte=header.size + min(used, whole) * channels * size,
        )
    values = numbers[: used * channels].reshape(used, channels)
    return Data(header.path, values, header.size, "binary", size)


def read_text(header: Header, file: BinaryIO, channels: int, width: int, rows: int | None) -> Data:
    """Fields of fixed width, 80 characters to a line; each cross section starts on a new one."""
    file.seek(header.size)
    content = file.read()
    first = header.lines + 1
    other = _NOT_TEXT.search(content)
    if other is not None:
        raise FormatError(
            f"road data is not text: it holds the byte 0x{content[other.start()]:02x}",
            path=header.path,
            line=first + content.count(b"\n", 0, other.start()),
        )
    per_record = RECORD // width
    records = -(-channels // per_record)
    fields = np.full(records, per_record)
    fields[-1] = channels - (records - 1) * per_record
    lines = content.split(b"\n")
    cut_short = lines[-1].strip() != b""  # the last line has no end
    full = int(fields[(len(lines) - 1) % records]) * width
    if cut_short and len(lines[-1]) < full:
        raise FormatError(
            "road data ends within a record: cut short",
            path=header.path,
            line=first + len(lines) - 1,
        )
    lines = [line.rstrip() for line in lines]
    while lines and not lines[-1]:
        lines.pop()
    found, rest = divmod(len(lines), records)
    if rest or (rows is not None and rows != found):
        needed = "" if rows is None else f"; REFERENCE_LINE_END_U says {rows} cross sections"
        raise FormatError(
            f"road data has {len(lines)} records, {records} to a cross section{needed}: damaged "
            "or cut short",
            path=header.path,
            line=first + max(0, len(lines) - 1),
        )
    length = np.fromiter(map(len, lines), np.int64, len(lines)).reshape(found, records)
    wrong = (length > fields * width) | (length <= (fields - 1) * width)
    if wrong.any():
        i = int(np.argmax(wrong))
        raise FormatError(
            f"record of {length.flat[i]} characters; it must hold {fields[i % records]} fields of "
            f"{width}",
            path=header.path,
            line=first + i,
        )
    cells = np.frombuffer(b"".join(line.ljust(RECORD) for line in lines), f"S{width}")
    cells = cells.reshape(found, records * per_record)[:, :channels]
    data = Data(header.path, np.full(cells.shape, np.nan), first, "text", width)
    missing = np.char.startswith(np.char.lstrip(cells), b"*")
    try:
        plain = cells[~missing]
        if plain.tobytes().translate(None, b"0123456789+-.eE "):
            raise ValueError("not only numbers")
        data.values[~missing] = plain.astype(np.float64)
    except ValueError:
        for row, column in np.argwhere(~missing).tolist():
            cell = cells[row, column].decode("ascii")
            if not NUMBER.fullmatch(cell.strip()):
                raise data.error_at(f"{cell!r} is not a number", row, column) from None
        raise FormatError("road data has fields that are no numbers", path=header.path) from None
    return data
