"""Numbers of a text file, and the line to blame where there is none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pavefem.formats.text.layout import DELIMITERS, Layout
from pavefem.formats.text.lines import Text, is_number, split


def read_numbers(
    text: Text, layout: Layout, chosen: Sequence[int], quantities: Sequence[str]
) -> NDArray[np.float64]:
    """Numbers of the chosen columns as printed, shape (rows, columns chosen)."""
    lines = text.lines[text.start :]
    if layout.decimal == ",":
        if any("." in line for line in lines):
            return _numbers_line_by_line(text, layout, chosen, quantities)
        lines = [line.replace(",", ".") for line in lines]
    delimiter = None if layout.delimiter == " " else layout.delimiter
    try:
        table = np.loadtxt(lines, delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        return _numbers_line_by_line(text, layout, chosen, quantities)
    return table[:, chosen]


def _numbers_line_by_line(
    text: Text, layout: Layout, chosen: Sequence[int], quantities: Sequence[str]
) -> NDArray[np.float64]:
    """Slower than `read_numbers`, for text beside the numbers, and to find the line to blame."""
    rows: list[list[float]] = []
    for i, line in text.data():
        cells = split(line, layout.delimiter)
        if len(cells) != layout.count:
            raise text.error(
                f"number of columns is {len(cells)}, in line {text.start + 1} it is "
                f"{layout.count} (delimiter {DELIMITERS[layout.delimiter]})",
                i,
            )
        for quantity, column in zip(quantities, chosen, strict=True):
            if not is_number(cells[column], layout.decimal):
                below = "; if the table starts below this line, pass skip="
                raise text.error(
                    f"{quantity} {cells[column][:40]!r} is not a number with decimal mark "
                    f"{layout.decimal!r}{below if i == text.start else ''}",
                    i,
                )
        rows.append([float(cells[j].replace(",", ".")) for j in chosen])
    return np.array(rows)


def check_numbers(
    text: Text,
    station: NDArray[np.float64],
    elevations: Sequence[NDArray[np.float64]],
    quantities: Sequence[str],
) -> None:
    """Refuse a number that is not finite, and a station that does not increase."""
    if station.size < 2:
        raise text.error("one sample; a profile needs at least 2", text.start)
    finite = np.isfinite([station, *elevations]).all(axis=0)
    increases = np.append(True, station[1:] > station[:-1])
    if finite.all() and increases.all():
        return
    row = int(np.argmin(finite & increases))
    for quantity, values in zip(quantities, (station, *elevations), strict=True):
        if not np.isfinite(values[row]):
            raise text.error_at_row(f"{quantity} is {values[row]:g}; it must be finite", row)
    raise text.error_at_row(
        f"station {station[row]} does not increase (previous {station[row - 1]})", row
    )
