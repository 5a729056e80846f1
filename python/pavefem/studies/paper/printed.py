"""What the paper prints, as far as it is at hand: Table III, ranges and trends of figures."""

from __future__ import annotations

from typing import Final

TABLE_III: Final = {
    "temperature": (3.279, 2.770, 2.832),
    "vma": (2.014, 1.884, 1.646),
    "roughness": (0.00183, 0.00659, -0.00340),
    "speed": (-0.0432, -0.0710),
}
"""Sensitivities at 25, 65 and 105 km/h; those to speed from 25 to 65 and from 65 to 105 km/h."""
MEANS: Final = {"temperature": 2.96, "vma": 1.848, "roughness": 0.0016, "speed": -0.0571}
"""Their means, as printed."""

RATIOS: Final = {
    "temperature_to_vma": 1.6,
    "temperature_to_roughness": 1769.0,
}
"""Ratios of means that the paper states."""

FIG_8: Final = (0.50e-3, 0.75e-3)
"""Range of the peaks over the tandem spacing, m."""
FIG_8_TRENDS: Final = ("a minimum at 1.3 m", "a minimum at 1.3 m", "falls")
"""How they go from 0.7 over 1.3 to 2.2 m, at 25, 65 and 105 km/h."""
FIG_10: Final = (0.56e-3, 0.68e-3)
"""Range of the mean peaks over speed, m."""
FIG_10_TREND: Final = "falls"
FIG_11_HIGHEST: Final = 4.5e-3
"""Highest peak, at 40 °C, m."""

SECONDS: Final = {"with the matrices": 58.0, "matrices read from a file": 1.0}
"""How long a run takes; the second is an upper bound."""
