"""Units of length in profile files: their names, which one holds, and whether it can be right."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pavefem.errors import FormatError

METRES: Final[dict[str, float]] = {
    "m": 1.0,
    "cm": 0.01,
    "mm": 0.001,
    "km": 1000.0,
    "in": 0.0254,
    "ft": 0.3048,
    "mi": 1609.344,
    "mil": 25.4e-6,
}
"""Metres in one of each unit."""

UNIT_NAMES: Final[dict[str, str]] = {
    **{name: "m" for name in ("meter", "meters", "metre", "metres")},
    **{name: "mm" for name in ("millimeter", "millimeters", "millimetre", "millimetres")},
    **{name: "in" for name in ("in.", "inch", "inches")},
    **{name: "ft" for name in ("ft.", "foot", "feet")},
    **{name: "mi" for name in ("mile", "miles")},
    "mils": "mil",
}
"""Units that are written out."""

QUANTITIES: Final = ("station", "elevation")

MAX_SLOPE_RMS: Final = 0.5
"""Steepest rms slope that is believed of a file without units; rough roads have 0.02."""

MAX_RELIEF: Final = 100.0
"""Largest range of elevation (m), per km and at least 1 km, believed of a file without units."""


def known_unit(text: str) -> str:
    """Return a unit in lower case, as `METRES` has it if it is one of them."""
    unit = text.strip().lower()
    return UNIT_NAMES.get(unit, unit)


def check_units(station_unit: str | None, elevation_unit: str | None) -> None:
    """Raise ValueError unless both options are units, or not given."""
    for option, unit in (("station_unit", station_unit), ("elevation_unit", elevation_unit)):
        if unit is not None and unit not in METRES:
            raise ValueError(f"{option} must be one of {', '.join(METRES)}, got {unit!r}")


def choose_units(
    error: Callable[[str], FormatError],
    stated: Sequence[str | None],
    options: tuple[str | None, str | None],
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Units of station and elevations, and where each is from.

    Parameters
    ----------
    error : callable
        Gives the error to raise for a message.
    stated : sequence of str or None
        Units of station and of each track in the file.
    options : tuple of str or None
        Units of station and of elevations that the caller gave.

    Returns
    -------
    tuple of tuple of str
        Units, of `METRES`, and for each of them ``"header"``, ``"option"`` or ``"default"``.
    """
    chosen = [
        _choose_unit(error, QUANTITIES[min(i, 1)], unit, options[min(i, 1)])
        for i, unit in enumerate(stated)
    ]
    return tuple(unit for unit, _ in chosen), tuple(origin for _, origin in chosen)


def _choose_unit(
    error: Callable[[str], FormatError], quantity: str, stated: str | None, option: str | None
) -> tuple[str, str]:
    if stated in METRES:
        if option not in (None, stated):
            raise error(f"{quantity}_unit={option!r} contradicts the header, [{stated}]")
        return stated, "header"
    if option is not None:
        return option, "option"
    if stated is not None:
        raise error(
            f"{quantity} unit [{stated}] of the header is none of {', '.join(METRES)}; "
            f"pass {quantity}_unit="
        )
    return "m", "default"


def options_for(units_from: Sequence[str]) -> str:
    """Name the options that give the units which neither header nor option gave."""
    return " and ".join(
        f"{quantity}_unit="
        for quantity, origins in zip(QUANTITIES, (units_from[:1], units_from[1:]), strict=True)
        if "default" in origins
    )


def check_plausible(
    error: Callable[[str], FormatError],
    x: NDArray[np.float64],
    z: NDArray[np.float64],
    units_from: Sequence[str],
) -> None:
    """Refuse what cannot be in m, where neither header nor option gives a unit."""
    slope_rms = float(np.sqrt(np.mean((np.diff(z) / np.diff(x)) ** 2)))
    relief, allowed = float(np.ptp(z)), MAX_RELIEF * max(1.0, float(x[-1] - x[0]) / 1000.0)
    if slope_rms <= MAX_SLOPE_RMS and relief <= allowed:
        return
    raise error(
        f"read in m, the elevations have a slope of {slope_rms:.3g} rms (at most {MAX_SLOPE_RMS} "
        f"is believed) and a range of {relief:.4g} m over {x[-1] - x[0]:.4g} m (at most "
        f"{allowed:.4g} m); the header gives no unit: pass {options_for(units_from)}"
    )
