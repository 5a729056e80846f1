"""What all figures share: units and colours."""

from __future__ import annotations

from typing import Final

MM: Final = 1e3
KN: Final = 1e-3
COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Told apart by colour-blind readers too."""


def colour(number: int) -> str:
    """Colour of an axle, a track or a vehicle, counted from 0."""
    return COLOURS[number % len(COLOURS)]
