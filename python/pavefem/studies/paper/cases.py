"""The runs: which there are, and what the middle of the road does in each."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pavefem._validity import listening
from pavefem.road import Road
from pavefem.simulate import simulate
from pavefem.studies.paper.readings import READINGS
from pavefem.studies.paper.sites import Site
from pavefem.vehicle import Vehicle
from pavefem.vehicles import tandem_truck

LENGTH: Final = 25.0
"""Length of the road, m (section VI.B)."""
MIDDLE: Final = LENGTH / 2.0
"""Place of the deflections, m."""

SPEEDS: Final = (25.0, 65.0, 105.0)
"""km/h."""
SPACINGS: Final = (0.7, 1.3, 2.2)
"""Tandem spacings of Fig. 7, and those at which Fig. 8 is compared, m."""
FINE_SPACINGS: Final = tuple(round(0.7 + 0.1 * i, 1) for i in range(16))
"""Those of Fig. 8, 0.7 to 2.2 m."""
TEMPERATURES: Final = (10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0)
"""Of Fig. 11, °C; Table III has every second."""
VMAS: Final = (15.0, 17.5, 20.0, 22.5, 25.0, 27.5, 30.0)
"""Of Fig. 12, %; Table III has every second."""


class Case(NamedTuple):
    """A run by what differs between runs."""

    reading: str
    speed_kmh: float
    temperature_c: float = 20.0
    vma: float = 25.0
    axle_spacing: float = 1.6
    site: int | None = None
    """Number of the profile, from 0; None is a smooth road."""
    scheme: str = "paper"


@dataclass(frozen=True)
class Answer:
    """What a run answers."""

    deflection: NDArray[np.float64]
    """At the middle, each millisecond, up positive, m."""
    pulls: bool
    """Whether a linear tire would have lifted off."""

    @property
    def peak(self) -> float:
        """Largest deflection of the middle, m."""
        return max(0.0, -float(self.deflection.min()))


def run_cases(
    cases: Collection[Case], sites: Sequence[Site], report: Callable[[int, int], None] | None
) -> dict[Case, Answer]:
    """Run all cases, on as many threads as there are processors."""
    unique = list(dict.fromkeys(cases))
    answers: dict[Case, Answer] = {}
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        futures: dict[Future[Answer], Case] = {
            pool.submit(_run, case, sites): case for case in unique
        }
        try:
            for future in as_completed(futures):
                answers[futures[future]] = future.result()
                if report is not None:
                    report(len(answers), len(unique))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return answers


def _run(case: Case, sites: Sequence[Site]) -> Answer:
    site = None if case.site is None else sites[case.site]
    with listening():  # `remarks` has what is to be said, of each state of the asphalt once
        result = simulate(
            _road(case.reading, case.vma),
            _truck(case.axle_spacing),
            profile=None if site is None else site.profile,
            run_in=0.0 if site is None else site.run_in,
            interpolation="staircase",
            speed_kmh=case.speed_kmh,
            temperature_c=case.temperature_c,
            scheme=case.scheme,
            keep=["deflection"],
            stations=[MIDDLE],
        )
    assert result.deflection is not None  # it is kept
    return Answer(result.deflection[:, 0], bool(result.axles.lift_off))


@lru_cache
def _road(reading: str, vma: float) -> Road:
    return Road(READINGS[reading].pavement_with(vma), LENGTH)


@lru_cache
def _truck(axle_spacing: float) -> Vehicle:
    return tandem_truck(axle_spacing=axle_spacing)


def remarks(cases: Collection[Case]) -> dict[str, list[Case]]:
    """Find what the stiffness formulas warn of, and in which cases."""
    found: dict[str, list[Case]] = {}
    states = dict.fromkeys(
        Case(case.reading, case.speed_kmh, case.temperature_c, case.vma) for case in cases
    )
    for case in states:
        with listening() as heard:
            asphalt = READINGS[case.reading].pavement_with(case.vma).asphalt
            asphalt.modulus(case.temperature_c, case.speed_kmh)
        for message in heard:
            found.setdefault(message, []).append(case)
    return found
