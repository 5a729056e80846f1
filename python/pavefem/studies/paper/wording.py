"""How numbers and names are written, on the page and in pictures alike."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

MM: Final = 1e3

ROWS: Final = {
    "temperature": "temperature",
    "vma": "VMA",
    "roughness": "roughness (IRI)",
    "speed": "speed",
}
"""Rows of Table III, as people read them."""
HEADS: Final = ROWS | {"speed": "speed, to the next"}
"""The same as heads of the rows; an entry of the last is from a speed to the next."""
RATIOS: Final = {
    "temperature_to_vma": "temperature / VMA",
    "temperature_to_speed": "temperature / speed, absolute",
    "temperature_to_roughness": "temperature / roughness",
    "temperature_to_roughness_absolute": "temperature / roughness, of absolute values",
}
"""Ratios of its means."""


def sensitivity(value: float) -> str:
    """Write a sensitivity, small ones with as many decimals as the paper has."""
    size = abs(value)
    return f"{value:.{3 if size >= 1.0 else 4 if size >= 0.01 else 5}f}".replace("-", "−")


def listed(values: Iterable[float]) -> str:
    """Write sensitivities one after the other."""
    return ", ".join(map(sensitivity, values))


def in_order(rows: Iterable[str]) -> str:
    """Write the names of rows, from the largest to the smallest."""
    return " > ".join(ROWS[row] for row in rows)


def percent(ours: float, printed: float) -> float:
    """Difference in percent of what is printed."""
    return 100.0 * (ours / printed - 1.0)


def difference(ours: float | str, printed: float | str) -> str:
    """Write how ours differs, such as ``+3.1 %``; of text, whether it does."""
    if isinstance(ours, str) or isinstance(printed, str):
        return "as printed" if ours == printed else "differs"
    if ours * printed < 0.0:
        return "other sign"
    value = percent(ours, printed)
    return f"{value:+.{1 if abs(value) < 99.95 else 0}f} %".replace("-", "−")


def millimetres(value: float | str) -> str:
    """Write a deflection that is in m; text as it is."""
    return value if isinstance(value, str) else f"{value * MM:.2f} mm"
