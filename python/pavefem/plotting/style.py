"""What all figures share: units, colours, how one is begun, and names as they are."""

from __future__ import annotations

from typing import Final

from matplotlib.figure import Figure

MM: Final = 1e3
KN: Final = 1e-3
COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Told apart by colour-blind readers too."""


def colour(number: int) -> str:
    """Colour of an axle, a track or a vehicle, counted from 0."""
    return COLOURS[number % len(COLOURS)]


def new_figure(width: float, height: float) -> Figure:
    """Begin a figure, inches; pyplot knows nothing of it."""
    return Figure(figsize=(width, height), layout="constrained")


def plain(text: str) -> str:
    """Keep a dollar in a name from beginning a formula."""
    return text.replace("$", r"\$")
