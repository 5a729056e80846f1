"""Stations as printed: rounding is removed, irregular ones are interpolated onto a grid."""

from __future__ import annotations

import math
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from pavefem.formats.text.lines import Text
from pavefem.profile import UNIFORM_TOLERANCE, Profile, uniform_grid

MAX_GAP: Final = 100.0
"""Widest gap between stations, in median spacings, that is interpolated unasked."""

MAX_ROUNDING: Final = 0.1
"""Coarsest last decimal of a station, in spacings, that counts as rounding of a uniform grid."""

MAX_DECIMALS: Final = 6


def without_rounding(station: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Uniform grid of which `station` is the printed rounding; None where it is not one."""
    grid = uniform_grid(station)
    distance = np.abs(station - grid).max()
    spacing = grid[1] - grid[0]
    last_digit = _last_digit(station)
    if UNIFORM_TOLERANCE * spacing < distance <= last_digit <= MAX_ROUNDING * spacing:
        return grid
    return None


def _last_digit(values: NDArray[np.float64]) -> float:
    """Return the power of ten, 1 or less, of which all `values` are multiples; 0 if none is."""
    for decimals in range(MAX_DECIMALS + 1):
        scaled = values * 10.0**decimals
        if np.allclose(scaled, np.rint(scaled), rtol=1e-15, atol=1e-6):
            return float(10.0**-decimals)
    return 0.0


def target_spacing(
    text: Text, profile: Profile, spacing: float | Literal["median", "file"]
) -> float | None:
    """Spacing (m) to interpolate onto; None where the stations stay."""
    if spacing == "file":
        return None
    median = profile.spacing
    if spacing == "median":
        if profile.is_uniform:
            return None
        _check_gaps(text, profile.x, median)
        return float(f"{median:.9g}")  # 0.2395, not 0.23950000000002092
    same = profile.is_uniform and math.isclose(spacing, median, rel_tol=1e-9)
    return None if same else spacing


def _check_gaps(text: Text, x: NDArray[np.float64], median: float) -> None:
    gaps = np.diff(x)
    widest = int(np.argmax(gaps))
    if gaps[widest] > MAX_GAP * median:
        raise text.error_at_row(
            f"gap of {gaps[widest]:.6g} m before this station, {gaps[widest] / median:.0f} times "
            f"the median spacing of {median:.6g} m (at most {MAX_GAP:g} times is interpolated); "
            "pass spacing= in m, or spacing='file' to keep the stations",
            widest + 1,
        )
