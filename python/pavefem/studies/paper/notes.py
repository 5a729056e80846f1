"""What is to be said of the numbers: where they agree, where not and why, and the caveats."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pavefem.studies.paper import printed
from pavefem.studies.paper.cases import SPEEDS, TEMPERATURES
from pavefem.studies.paper.figures import trend
from pavefem.studies.paper.numbers import (
    EVERY_SECOND,
    PRINTED,
    PRINTED_RATIOS,
    Numbers,
    sensitivities_to_speed,
)
from pavefem.studies.paper.sensitivity import paper_sensitivity
from pavefem.studies.paper.wording import MM, in_order, listed, percent, sensitivity


class Note(NamedTuple):
    """Something to be said."""

    about: str
    text: str


def agreements(numbers: Numbers) -> list[Note]:
    """Say how a reading compares with Table III and the trends."""
    table = numbers.table
    worst = {
        row: max(
            (percent(ours, theirs) for ours, theirs in zip(table.rows[row], values, strict=True)),
            key=abs,
        )
        for row, values in PRINTED.rows.items()
    }
    times = {row: table.absolute(row) / PRINTED.absolute(row) for row in ("speed", "roughness")}
    as_printed = "as printed" if table.order == PRINTED.order else "not the printed order"
    trends = sum(
        trend(peaks) == theirs
        for peaks, theirs in zip(numbers.at_spacings, printed.FIG_8_TRENDS, strict=True)
    )
    falls = bool(np.all(np.diff(numbers.by_site.mean(axis=1)) < 0.0))
    return [
        Note(
            "Sensitivities",
            f"Those to temperature are within {abs(worst['temperature']):.1f} % of the printed "
            f"ones at every speed, those to VMA within {abs(worst['vma']):.1f} %.",
        ),
        Note("Order in absolute size", f"{in_order(table.order)}, {as_printed}."),
        Note(
            "Tandem spacing (Fig. 8)",
            f"{trends} of {len(SPEEDS)} trends are as printed; peaks are "
            f"{_span(numbers.by_spacing)}, printed {_span(printed.FIG_8)}.",
        ),
        Note(
            "Speed (Fig. 10)",
            f"The mean peak {'falls, as printed' if falls else 'does not fall throughout'}; it is "
            f"{_span(numbers.by_site.mean(axis=1))}, printed {_span(printed.FIG_10)}.",
        ),
        Note(
            "What differs most",
            f"The small sensitivities: to speed {times['speed']:.1f} and to roughness "
            f"{times['roughness']:.0f} times the printed ones in absolute size. Why stands under "
            "Table III.",
        ),
    ]


def _span(peaks: ArrayLike) -> str:
    return f"{np.min(peaks) * MM:.2f} to {np.max(peaks) * MM:.2f} mm"


def differences(numbers: Numbers) -> list[Note]:
    """Say where Table III differs in sign or size, and why."""
    return [_on_roughness(numbers), _on_speed(numbers)]


def _on_roughness(numbers: Numbers) -> Note:
    ours, theirs = numbers.table.rows["roughness"], PRINTED.rows["roughness"]
    other = [
        f"{speed:g} km/h" for speed, a, b in zip(SPEEDS, ours, theirs, strict=True) if a * b < 0.0
    ]
    signs = f"another sign at {' and '.join(other)}" if other else "signs as printed"
    text = (
        f"{listed(ours)}, printed {listed(theirs)}; {signs}. Peaks at one place "
        "scatter: the bump that lies ahead of it presses the truck down or lets it up. What is "
        "left of that in a mean depends on the profiles, and ours are not the paper’s."
    )
    error = numbers.roughness_error
    if error is not None:
        far = np.abs((np.array(ours) - theirs) / error).max()
        text += (
            f" The standard errors of ours are {listed(error)}; the printed values lie up to "
            f"{far:.1f} of them away."
        )
    neighbours = numbers.roughness_of_neighbours
    if neighbours is not None:
        text += (
            " Taken from each profile to the next in place of from half to half, S would be "
            f"{listed(neighbours)}: there small steps of IRI divide that chance."
        )
    return Note("Roughness", text)


def _on_speed(numbers: Numbers) -> Note:
    ours, theirs = numbers.table.rows["speed"], PRINTED.rows["speed"]
    factor = np.mean(ours) / np.mean(theirs)
    smooth = sensitivities_to_speed(numbers.nominal)
    held = sensitivities_to_speed(numbers.modulus_held)
    return Note(
        "Speed",
        f"{listed(ours)}, printed {listed(theirs)}: {factor:.1f} times as much in the mean. By "
        "eq. 8 with t = 0.3 m / v asphalt is stiffer under a faster truck, and that makes most of "
        f"it: on a smooth road S is {listed(smooth)}, and with the modulus held at what it is at "
        f"{SPEEDS[0]:g} km/h {listed(held)}.",
    )


def caveats(all_numbers: Mapping[str, Numbers], reading: str) -> list[Note]:
    """Say what to keep in mind of such a reproduction, and how much it makes."""
    numbers = all_numbers[reading]
    table = numbers.table
    by_unit = [
        sensitivity(_to_temperature(numbers, EVERY_SECOND, *unit))
        for unit in ((1.0, 0.0), (1.8, 32.0), (1.0, 273.15))
    ]
    fine = sensitivity(_to_temperature(numbers, slice(None)))
    coarse = sensitivity(_to_temperature(numbers, slice(None, None, len(TEMPERATURES) - 1)))
    return [
        Note(
            "S depends on the unit of temperature",
            f"The mean sensitivity to it is {by_unit[0]} from °C, {by_unit[1]} from °F and "
            f"{by_unit[2]} from K.",
        ),
        Note(
            "S depends on the points chosen",
            f"In steps of 5 °C in place of 10 it is {fine}, from 10 to 40 °C at once {coarse}.",
        ),
        Note(
            "“1769 times”, temperature over roughness, rests on signed values that cancel",
            "With absolute values the printed entries give "
            f"{PRINTED_RATIOS['temperature_to_roughness_absolute']:.0f}. Ours are "
            f"{table.ratios['temperature_to_roughness']:.0f} and "
            f"{table.ratios['temperature_to_roughness_absolute']:.0f}.",
        ),
        _on_mesh(all_numbers),
        Note(
            "The hottest asphalt is outside the range of its stiffness formulas",
            "In the paper’s Fig. 11 as here; the warnings below say where and by how much.",
        ),
        Note(
            "Tires are linear, as in the paper",
            f"In {numbers.pulls} of {numbers.by_site.size} runs over profiles one would have left "
            "the road, and pulls at it instead.",
        ),
    ]


def _to_temperature(
    numbers: Numbers, part: slice, factor: float = 1.0, offset: float = 0.0
) -> float:
    """Sensitivity to temperature on other points or in another unit, mean over the speeds."""
    x = factor * np.array(TEMPERATURES[part]) + offset
    return float(np.mean([paper_sensitivity(x, peaks[part]) for peaks in numbers.by_temperature]))


def _on_mesh(all_numbers: Mapping[str, Numbers]) -> Note:
    text = "It is coarser than the decay length of the beam."
    for name, numbers in all_numbers.items():
        pairs = zip(SPEEDS, numbers.at_spacings, numbers.at_spacings_converged, strict=True)
        other = [f"{v:g}" for v, paper, fine in pairs if trend(paper) != trend(fine)]
        ratio = numbers.by_spacing_converged / numbers.by_spacing
        text += (
            f" By the converged scheme peaks of the {name} reading are {ratio.min():.2f} to "
            f"{ratio.max():.2f} times as large, and the trend over 0.7, 1.3 and 2.2 m is "
            + (f"another at {', '.join(other)} km/h." if other else "the same at every speed.")
        )
    return Note("Peaks and their trend with the tandem spacing depend on the 0.5 m mesh", text)
