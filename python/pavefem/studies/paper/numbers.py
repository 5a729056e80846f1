"""What the runs of a reading come to: peaks, Table III and its ratios."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pavefem.studies.paper import printed
from pavefem.studies.paper.cases import (
    FINE_SPACINGS,
    SPACINGS,
    SPEEDS,
    TEMPERATURES,
    VMAS,
    Answer,
    Case,
)
from pavefem.studies.paper.readings import READINGS
from pavefem.studies.paper.sensitivity import paper_sensitivity
from pavefem.studies.paper.sites import Site

Rows = Mapping[str, Sequence[float]]

EVERY_SECOND: Final = slice(None, None, 2)
"""Of temperatures and VMA: the points of Table III."""


@dataclass(frozen=True)
class TableIII:
    """Sensitivities of the peak at the middle of the road.

    Attributes
    ----------
    rows : mapping of str to sequence of float
        ``temperature``, ``vma`` and ``roughness`` at each of `SPEEDS`, and ``speed`` from each
        of them to the next.
    means : mapping of str to float
        Mean of each row.
    """

    rows: Rows
    means: Mapping[str, float]

    @classmethod
    def of(cls, rows: Rows) -> TableIII:
        """Take rows with the means that follow."""
        return cls(rows, {name: float(np.mean(row)) for name, row in rows.items()})

    def absolute(self, name: str) -> float:
        """Mean of the absolute values of a row."""
        return float(np.mean(np.abs(self.rows[name])))

    @property
    def order(self) -> list[str]:
        """Rows from the largest to the smallest, in absolute size."""
        return sorted(self.rows, key=lambda name: -self.absolute(name))

    @property
    def ratios(self) -> dict[str, float]:
        """Mean sensitivity to temperature over those to the rest.

        Signs are kept, but in what ends in ``_absolute``; the one to speed is absolute too.
        """
        temperature = self.means["temperature"]
        return {
            "temperature_to_vma": temperature / self.means["vma"],
            "temperature_to_speed": temperature / self.absolute("speed"),
            "temperature_to_roughness": temperature / self.means["roughness"],
            "temperature_to_roughness_absolute": temperature / self.absolute("roughness"),
        }


PRINTED: Final = TableIII(printed.TABLE_III, printed.MEANS)
PRINTED_RATIOS: Final = TableIII.of(printed.TABLE_III).ratios | printed.RATIOS
"""As the paper states them, the others from its entries."""


@dataclass(frozen=True)
class Numbers:
    """Answers of one reading, in the order of `SPEEDS` and of what is varied.

    Attributes
    ----------
    reading : str
    histories : mapping of (float, float) to ndarray
        Deflection at the middle, m, each millisecond, by speed (km/h) and tandem spacing (m).
    by_spacing, by_spacing_converged : ndarray, shape (speeds, spacings)
        Peaks, m, over `FINE_SPACINGS`; by the paper's scheme and by the converged one.
    by_temperature, by_vma : ndarray, shape (speeds, 7)
        Peaks, m, over `TEMPERATURES` and `VMAS`.
    by_site : ndarray, shape (speeds, sites)
        Peaks, m, over the profiles, from smooth to rough.
    modulus_held : ndarray, shape (speeds,)
        Peaks, m, on a smooth road whose modulus is the one at the lowest speed.
    iri : ndarray, shape (sites,)
        Of the profiles, m/km.
    pulls : int
        Runs over profiles in which a linear tire would have lifted off.
    """

    reading: str
    histories: Mapping[tuple[float, float], NDArray[np.float64]]
    by_spacing: NDArray[np.float64]
    by_spacing_converged: NDArray[np.float64]
    by_temperature: NDArray[np.float64]
    by_vma: NDArray[np.float64]
    by_site: NDArray[np.float64]
    modulus_held: NDArray[np.float64]
    iri: NDArray[np.float64]
    pulls: int

    @property
    def nominal(self) -> NDArray[np.float64]:
        """Peaks on the smooth road at 20 °C and 25 % VMA, m, by speed."""
        return self.by_temperature[:, TEMPERATURES.index(20.0)]

    @property
    def at_spacings(self) -> NDArray[np.float64]:
        """Peaks at `SPACINGS`, m, shape (speeds, 3)."""
        return self.by_spacing[:, [FINE_SPACINGS.index(spacing) for spacing in SPACINGS]]

    @property
    def at_spacings_converged(self) -> NDArray[np.float64]:
        """The same by the converged scheme."""
        return self.by_spacing_converged[:, [FINE_SPACINGS.index(s) for s in SPACINGS]]

    @cached_property
    def table(self) -> TableIII:
        """Table III."""
        mean = self.by_site.mean(axis=1)
        iri, halves = self.iri_of_halves, self.peaks_of_halves
        return TableIII.of(
            {
                "temperature": [
                    paper_sensitivity(TEMPERATURES[EVERY_SECOND], peaks[EVERY_SECOND])
                    for peaks in self.by_temperature
                ],
                "vma": [
                    paper_sensitivity(VMAS[EVERY_SECOND], peaks[EVERY_SECOND])
                    for peaks in self.by_vma
                ],
                "roughness": [paper_sensitivity(iri, peaks, signed=True) for peaks in halves],
                "speed": sensitivities_to_speed(mean),
            }
        )

    @property
    def iri_of_halves(self) -> NDArray[np.float64]:
        """Mean IRI of the smoother and of the rougher half of the profiles, m/km."""
        return np.array([half.mean() for half in np.array_split(self.iri, 2)])

    @property
    def peaks_of_halves(self) -> NDArray[np.float64]:
        """Mean peaks of the two halves, m, shape (speeds, 2)."""
        return np.stack([h.mean(axis=1) for h in np.array_split(self.by_site, 2, axis=1)], axis=1)

    @property
    def roughness_error(self) -> NDArray[np.float64] | None:
        """Standard error of the sensitivities to roughness, from the spread within the halves.

        None where a half is a single profile.
        """
        halves = np.array_split(self.by_site, 2, axis=1)
        if min(half.shape[1] for half in halves) < 2:
            return None
        low, high = map(float, self.iri_of_halves)
        errors = [half.std(axis=1, ddof=1) / np.sqrt(half.shape[1]) for half in halves]
        relative: NDArray[np.float64] = np.hypot(*errors) / self.peaks_of_halves[:, 0]
        return relative * low / (high - low)

    @property
    def roughness_of_neighbours(self) -> list[float] | None:
        """Sensitivities to roughness from each profile to the next; None where two have one IRI."""
        if np.any(np.diff(self.iri) == 0.0):
            return None
        return [paper_sensitivity(self.iri, peaks, signed=True) for peaks in self.by_site]


def sensitivities_to_speed(peaks: NDArray[np.float64]) -> list[float]:
    """Signed sensitivities of peaks to speed, from each of `SPEEDS` to the next."""
    pairs = zip(SPEEDS, SPEEDS[1:], peaks, peaks[1:], strict=False)
    return [paper_sensitivity([v, w], [y, z], signed=True) for v, w, y, z in pairs]


def cases_of(reading: str, sites: int) -> dict[str, list[list[Case]]]:
    """Cases of a reading by what they are for, a row for each speed."""

    def rows(field: str, values: Sequence[float], scheme: str = "paper") -> list[list[Case]]:
        starts = [Case(reading, speed, scheme=scheme) for speed in SPEEDS]
        changes: list[dict[str, Any]] = [{field: value} for value in values]
        return [[start._replace(**change) for change in changes] for start in starts]

    return {
        "by_spacing": rows("axle_spacing", FINE_SPACINGS),
        "by_spacing_converged": rows("axle_spacing", FINE_SPACINGS, "converged"),
        "by_temperature": rows("temperature_c", TEMPERATURES),
        "by_vma": rows("vma", VMAS),
        "by_site": rows("site", range(sites)),
        "modulus_held": [
            [Case(reading, speed, temperature_of_same_modulus(reading, speed))] for speed in SPEEDS
        ],
    }


def temperature_of_same_modulus(reading: str, speed_kmh: float) -> float:
    """Temperature, °C, at which the modulus is that of 20 °C at the lowest speed.

    By eq. 8 a binder is as stiff where ``t^-0.368 (T_RB - T)^5`` is, t being 0.3 m over the speed.
    """
    softening = READINGS[reading].pavement.asphalt.softening_point_c
    return softening - (softening - 20.0) * math.pow(SPEEDS[0] / speed_kmh, 0.368 / 5.0)


def numbers_of(reading: str, answers: Mapping[Case, Answer], sites: Sequence[Site]) -> Numbers:
    """Sort the answers of a reading."""
    cases = cases_of(reading, len(sites))

    def peaks(name: str) -> NDArray[np.float64]:
        return np.array([[answers[case].peak for case in row] for row in cases[name]])

    return Numbers(
        reading=reading,
        histories={
            (speed, spacing): answers[Case(reading, speed, axle_spacing=spacing)].deflection
            for speed in SPEEDS
            for spacing in SPACINGS
        },
        by_spacing=peaks("by_spacing"),
        by_spacing_converged=peaks("by_spacing_converged"),
        by_temperature=peaks("by_temperature"),
        by_vma=peaks("by_vma"),
        by_site=peaks("by_site"),
        modulus_held=peaks("modulus_held")[:, 0],
        iri=np.array([site.iri for site in sites]),
        pulls=sum(answers[case].pulls for row in cases["by_site"] for case in row),
    )
