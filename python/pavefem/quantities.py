"""What the pavement answers, and how it follows from what the core reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pavefem.pavement import Pavement
from pavefem.road import Road

Quantity = Literal["deflection", "velocity", "curvature", "moment", "strain", "pressure"]


class Description(NamedTuple):
    """What a quantity is."""

    units: str
    long_name: str
    positive: str
    core: str
    """What the core reads for it."""
    factor: Callable[[Pavement], float] = lambda pavement: 1.0
    """What that is multiplied by."""


QUANTITIES: Final[Mapping[Quantity, Description]] = {
    "deflection": Description("m", "deflection", "up", "deflection"),
    "velocity": Description("m/s", "rate of the deflection", "up", "velocity"),
    "curvature": Description("1/m", "curvature of the beam", "sagging", "curvature"),
    "moment": Description(
        "N m", "bending moment of the beam, under one wheel track", "sagging", "moment"
    ),
    "strain": Description(
        "1",
        "longitudinal strain of the bottom fibre",
        "tension",
        "curvature",
        lambda pavement: pavement.thickness / 2.0,
    ),
    "pressure": Description(
        "Pa",
        "pressure on the foundation",
        "down",
        "reaction",
        lambda pavement: 1.0 / pavement.width,
    ),
}
"""Quantities along the beam, by name.

Strain is that of beam theory, curvature times half the thickness; the pressure is what the bed
takes from the beam, ``-(k w + c dw/dt)``, over the width of the strip.
"""


def core_names(quantities: Sequence[Quantity]) -> list[str]:
    """Name what the core has to read, each once."""
    return list(dict.fromkeys(QUANTITIES[name].core for name in quantities))


def histories(
    history: NDArray[np.float64],
    quantities: Sequence[Quantity],
    places: NDArray[np.float64],
    road: Road,
) -> dict[Quantity, NDArray[np.float64]]:
    """Take each quantity (times, places) from the columns that the core has kept."""
    read = core_names(quantities)
    blocks = dict(zip(read, np.split(history, len(read), axis=1), strict=True)) if read else {}
    pavements = [road.pavement_at(x) for x in places] if len(road.sections) > 1 else None

    def values(description: Description) -> NDArray[np.float64]:
        block: NDArray[np.float64] = blocks[description.core]
        if pavements is None:
            factor = description.factor(road.sections[0].pavement)
            return block if factor == 1.0 else factor * block
        factors = np.array([description.factor(pavement) for pavement in pavements])
        return np.asarray(block * factors)

    return {name: values(QUANTITIES[name]) for name in quantities}
