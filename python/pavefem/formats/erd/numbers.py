"""Numbers of an ERD file, as binary or as text, and the place to blame where there is none."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pavefem.errors import FormatError
from pavefem.formats.erd.header import LINE_END, Header, real_number
from pavefem.formats.files import decode_text


def stations(start: float, step: float, count: int) -> NDArray[np.float64]:
    """Stations of `count` samples at a constant step."""
    return start + step * np.arange(count, dtype=np.float64)


def read_numbers(header: Header, order: str) -> NDArray[np.float64]:
    """Numbers of the file, shape (samples, channels), all finite."""
    if header.encoding == "text":
        return _text_numbers(header)
    return _binary_numbers(header, np.dtype(order + header.encoding))


def _binary_numbers(header: Header, dtype: np.dtype[np.generic]) -> NDArray[np.float64]:
    path, start = _data_place(header)
    size = path.stat().st_size - start
    row = len(header.channels) * dtype.itemsize
    samples = _binary_samples(header, path, start, size, row)
    with path.open("rb") as file:
        table = np.fromfile(
            file, dtype=dtype, count=samples * len(header.channels), offset=start
        ).astype(np.float64)
    finite = np.isfinite(table)
    if not finite.all():
        first = int(np.argmin(finite))
        raise FormatError(
            f"sample {first // len(header.channels)} is {table[first]:g}; it must be finite",
            path=path,
            byte=start + first * dtype.itemsize,
        )
    return table.reshape(samples, len(header.channels))


def _data_place(header: Header) -> tuple[Path, int]:
    """File and byte at which the binary numbers start."""
    with header.path.open("rb") as file:
        file.seek(header.end)
        rest = file.read(80)
    beside = [header.path.with_suffix(".bin"), header.path.with_name(header.path.name + ".bin")]
    if not rest.strip():
        for path in beside:
            if path != header.path and path.is_file():
                return path, 0
    if not rest:
        raise header.error(
            f"ends with its header, and the file of its binary numbers, {beside[0].name}, is "
            "missing",
            byte=header.size,
        )
    return header.path, header.end


def _binary_samples(header: Header, path: Path, start: int, size: int, row: int) -> int:
    """Count the samples in `size` bytes, of which one has `row`; check the header."""
    record, records = header.record_bytes, header.records
    if records > 1 and record > 1 and record % row and row % record:
        raise header.error(
            f"NBYTES is {record}: records of {record} bytes hold no whole number of samples of "
            f"{row} bytes",
            line=2,
        )
    if header.samples == -1:
        if size % row or size < 2 * row:
            raise FormatError(
                f"{size} bytes of numbers are no whole number, 2 or more, of samples of {row} "
                "bytes: the file is cut short or damaged",
                path=path,
                byte=start + size - size % row,
            )
        return size // row
    needed = header.samples * row
    if size < needed:
        raise FormatError(
            f"cut short: {size} bytes of numbers, {header.samples} samples of {row} bytes are "
            f"{needed} bytes",
            path=path,
            byte=start + size,
        )
    if size > needed and size != records * record and size - needed >= record:
        raise FormatError(
            f"{size} bytes of numbers, {header.samples} samples of {row} bytes are {needed} bytes",
            path=path,
            byte=start + needed,
        )
    return header.samples


def _text_numbers(header: Header) -> NDArray[np.float64]:
    """Numbers below the header; each line has the same number of them, but for the last."""
    channels, samples = len(header.channels), header.samples
    size = header.size - header.end
    if samples * channels * 2 > size + 1:  # a digit and a blank each
        raise header.error(
            f"cut short: {size} bytes of text cannot hold the {samples} samples of {channels} "
            "channels that NSAMP and NCHAN say",
            line=2,
        )
    with header.path.open("rb") as file:
        file.seek(header.end)
        content = file.read().rstrip(b"\x1a\x00 \t\r\n")
    lines = LINE_END.split(decode_text(content, header.path, header.end).replace(",", " "))
    numbers, width = _numbers_of_lines(header, lines)
    count = numbers.size if samples == -1 else samples * channels
    in_step = samples != -1 or width % channels == 0 or channels % width == 0
    if numbers.size != count or count % channels or count < 2 * channels or not in_step:
        short = numbers.size < max(count, 2 * channels)
        what = "whole samples, 2 or more," if samples == -1 else f"{samples} samples"
        raise header.error(
            f"{'cut short' if short else 'damaged'}: {numbers.size} numbers in the "
            f"file, {width} in a line, {what} of {channels} channels are needed",
            line=header.end_line + len(lines) - 1,
        )
    return numbers.reshape(-1, channels)


def _numbers_of_lines(header: Header, lines: Sequence[str]) -> tuple[NDArray[np.float64], int]:
    """Numbers in the lines, all finite, and how many a line has."""
    if not any(map(str.strip, lines)):
        return np.empty(0), 1
    try:
        table = np.loadtxt(lines, comments=None, ndmin=2)
    except ValueError:
        return _numbers_line_by_line(header, lines)
    if not np.isfinite(table).all():
        return _numbers_line_by_line(header, lines)
    return table.ravel(), table.shape[1]


def _numbers_line_by_line(header: Header, lines: Sequence[str]) -> tuple[NDArray[np.float64], int]:
    """Slower than `numpy.loadtxt`: D exponents, a short last line, and the line to blame."""
    numbers: list[float] = []
    width, last = 0, max(i for i, line in enumerate(lines) if line.strip())
    for i, line in enumerate(lines):
        words = line.split()
        for word in words:
            value = real_number(word)
            if value is None or not math.isfinite(value):
                raise header.error(
                    f"{word[:40]!r} is not a finite number", line=header.end_line + i
                )
            numbers.append(value)
        width = width or len(words)
        if len(words) > width or (0 < len(words) < width and i < last):
            raise header.error(
                f"{len(words)} numbers, lines before it have {width}", line=header.end_line + i
            )
    return np.array(numbers), width
