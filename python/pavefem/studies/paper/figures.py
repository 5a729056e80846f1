"""Figs. 7 to 12 as numbers: curves, what the paper prints of them, and how ours compare."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pavefem.studies.paper import printed
from pavefem.studies.paper.cases import (
    FINE_SPACINGS,
    MIDDLE,
    SPACINGS,
    SPEEDS,
    TEMPERATURES,
    VMAS,
)
from pavefem.studies.paper.numbers import Numbers, sensitivities_to_speed
from pavefem.studies.paper.sites import Site
from pavefem.studies.paper.wording import listed, millimetres

DT: Final = 1e-3
"""Time step of the paper's scheme, s."""

Marks = Literal["line", "line and points", "dashed", "points", "faint points"]


@dataclass(frozen=True)
class Curve:
    """A line or a set of points."""

    name: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    marks: Marks = "line"
    spread: NDArray[np.float64] | None = None
    """Standard deviation of what y is the mean of."""

    @classmethod
    def through(cls, name: str, x: ArrayLike, y: ArrayLike, marks: Marks = "line") -> Curve:
        """Take any sequences of numbers."""
        return cls(name, np.asarray(x, np.float64), np.asarray(y, np.float64), marks)


@dataclass(frozen=True)
class Panel:
    """Curves on one pair of axes; y is in m, and drawn in mm."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    printed: tuple[float, ...] = ()
    """Lowest and highest of what the paper prints, or the highest alone, m."""


@dataclass(frozen=True)
class Compared:
    """Something that the paper says, beside ours."""

    what: str
    printed: float | str
    ours: float | str
    """Peaks in m, trends as text."""


@dataclass(frozen=True)
class PaperFigure:
    """One of the paper's figures."""

    name: str
    """``"fig_7"`` and so on; the name of its file, too."""
    title: str
    understood: str
    """What it is taken to show."""
    known: str
    """What is known of the printed one."""
    panels: tuple[Panel, ...]
    compared: tuple[Compared, ...] = ()
    remark: str = ""
    """Where ours differs, and why; or what else is to be seen."""

    @property
    def heading(self) -> str:
        """Number and title."""
        return f"{self.name.replace('fig_', 'Fig. ')} — {self.title}"


def figures_of(numbers: Numbers, sites: Sequence[Site]) -> tuple[PaperFigure, ...]:
    """Make all figures of a reading."""
    return (
        _histories(numbers),
        _over_spacing(numbers),
        _over_roughness(numbers, sites),
        _over_speed(numbers),
        _over_temperature(numbers),
        _over_vma(numbers),
    )


def _histories(numbers: Numbers) -> PaperFigure:
    panels = []
    for speed in SPEEDS:
        # From when the front axle is 3 m ahead of the middle until the last is 3 m past it.
        first = int((MIDDLE - 3.0) / (speed / 3.6) / DT)
        last = int((MIDDLE + 5.2 + SPACINGS[-1] / 2.0 + 3.0) / (speed / 3.6) / DT)
        curves = tuple(
            Curve.through(
                f"tandem spacing {spacing:g} m",
                np.round(DT * np.arange(first, last), 3),
                np.round(numbers.histories[speed, spacing][first:last], 9),
            )
            for spacing in SPACINGS
        )
        panels.append(Panel(f"{speed:g} km/h", "time [s]", "deflection", curves))
    return PaperFigure(
        "fig_7",
        "Deflection under a passing truck",
        f"Deflection of the middle of the road ({MIDDLE:g} m) over time at three speeds and three "
        "tandem spacings, constant forces; here while the truck is near.",
        "Deflections are up positive: a loaded pavement reads negative. Printed values are not at "
        "hand.",
        tuple(panels),
        remark="Three troughs, the steer axle and the two of the tandem; at the smallest spacing "
        "the tandem’s two come near to one.",
    )


def _over_spacing(numbers: Numbers) -> PaperFigure:
    schemes = (
        ("The paper’s scheme: bars 0.5 m apart", numbers.by_spacing, printed.FIG_8),
        ("The converged scheme, for comparison", numbers.by_spacing_converged, ()),
    )
    panels = tuple(
        Panel(
            title,
            "tandem spacing [m]",
            "peak deflection",
            _by_speed(FINE_SPACINGS, peaks),
            known,
        )
        for title, peaks, known in schemes
    )
    trends = [trend(peaks) for peaks in numbers.at_spacings]
    same = [ours == theirs for ours, theirs in zip(trends, printed.FIG_8_TRENDS, strict=True)]
    compared = (
        Compared("lowest peak", printed.FIG_8[0], float(numbers.by_spacing.min())),
        Compared("highest peak", printed.FIG_8[1], float(numbers.by_spacing.max())),
        *(
            Compared(f"from 0.7 over 1.3 to 2.2 m at {speed:g} km/h", theirs, ours)
            for speed, theirs, ours in zip(SPEEDS, printed.FIG_8_TRENDS, trends, strict=True)
        ),
    )
    return PaperFigure(
        "fig_8",
        "Peak over tandem spacing",
        "Largest deflection of the middle of the road over tandem spacings of 0.7 to 2.2 m, at "
        "three speeds, constant forces.",
        "Peaks of 0.50 to 0.75 mm; at 25 and 65 km/h a minimum at 1.3 m, at 105 km/h a fall with "
        "the spacing.",
        panels,
        compared,
        _remark_on_spacing(same, numbers),
    )


def _remark_on_spacing(same: list[bool], numbers: Numbers) -> str:
    text = ""
    differing = [f"{speed:g}" for speed, alike in zip(SPEEDS, same, strict=True) if not alike]
    if differing:
        text = (
            f"At {' and '.join(differing)} km/h the trend is not the printed one. No reading has "
            "all three. They hang on how soon the pavement comes back between the two axles: on "
            "the damping of the bars, in which the readings differ. "
        )
    converged = [trend(peaks) for peaks in numbers.at_spacings_converged]
    return (
        f"{text}A curve through 0.7, 1.3 and 2.2 m alone would miss the lowest peaks, near 1 m. "
        f"By the converged scheme the trends over these three are: {', '.join(converged)}."
    )


def _over_roughness(numbers: Numbers, sites: Sequence[Site]) -> PaperFigure:
    shown = [sites[0], sites[len(sites) // 2], sites[-1]]
    profiles = tuple(
        Curve.through(
            f"{site.iri:.1f} m/km",
            np.round(site.profile.x - site.profile.x[0] - site.run_in, 6),
            site.profile.z - site.profile.z.mean(),
        )
        for site in reversed(shown)
    )
    errors = numbers.roughness_error
    error = "" if errors is None else f" (standard error {errors.min():.2f} to {errors.max():.2f})"
    return PaperFigure(
        "fig_9",
        "Roughness, and the peaks that go with it",
        "The profiles, of which the smoothest, a middle one and the roughest are drawn, and the "
        "peak at the middle of the road over their IRI.",
        "26 measured profiles; values are not at hand.",
        (
            Panel("Profiles (road from 0 to 25 m)", "place [m]", "elevation", profiles),
            Panel(
                "Peaks",
                "IRI [m/km]",
                "peak deflection",
                _by_speed(numbers.iri, numbers.by_site, "points"),
            ),
        ),
        remark="Roughness spreads the peaks more than it moves their mean: which bump lies ahead "
        "of the middle is chance, and it presses as often less as more. From the smoother to the "
        f"rougher half S is {listed(numbers.table.rows['roughness'])}{error}.",
    )


def _over_speed(numbers: Numbers) -> PaperFigure:
    means = numbers.by_site.mean(axis=1)
    count = numbers.by_site.shape[1]
    ours = "falls" if np.all(np.diff(means) < 0.0) else "does not fall throughout"
    curves = (
        Curve(
            "mean ± standard deviation",
            np.array(SPEEDS),
            means,
            "line and points",
            numbers.by_site.std(axis=1),
        ),
        Curve.through("smooth road", SPEEDS, numbers.nominal, "dashed"),
        Curve.through(
            "each profile", np.repeat(SPEEDS, count), numbers.by_site.ravel(), "faint points"
        ),
    )
    held = listed(sensitivities_to_speed(numbers.modulus_held))
    return PaperFigure(
        "fig_10",
        "Peak over speed",
        f"Mean over the {count} profiles of the largest deflection of the middle of the road, at "
        "three speeds.",
        "The mean falls with speed; 0.56 to 0.68 mm.",
        (Panel("", "speed [km/h]", "peak deflection", curves, printed.FIG_10),),
        (
            Compared("lowest mean", printed.FIG_10[0], float(means.min())),
            Compared("highest mean", printed.FIG_10[1], float(means.max())),
            Compared("with speed", printed.FIG_10_TREND, ours),
        ),
        f"Ours falls faster (S {listed(numbers.table.rows['speed'])}; printed "
        f"{listed(printed.TABLE_III['speed'])}) because the asphalt is stiffer the shorter it is "
        "loaded (eq. 8, t = 0.3 m / v). With the modulus held at what it is at "
        f"{SPEEDS[0]:g} km/h, S is {held} on a smooth road.",
    )


def _over_temperature(numbers: Numbers) -> PaperFigure:
    highest = numbers.by_temperature[:, -1]
    growth = highest / numbers.by_temperature[:, TEMPERATURES.index(30.0)]
    each = ", ".join(
        f"{millimetres(peak)} at {speed:g} km/h"
        for speed, peak in zip(SPEEDS, highest, strict=True)
    )
    return PaperFigure(
        "fig_11",
        "Peak over temperature",
        "Largest deflection of the middle of the road at 10 to 40 °C, at three speeds, constant "
        "forces, 25 % VMA.",
        "Up to 4.5 mm at 40 °C.",
        (
            Panel(
                "",
                "temperature [°C]",
                "peak deflection",
                _by_speed(TEMPERATURES, numbers.by_temperature),
                (printed.FIG_11_HIGHEST,),
            ),
        ),
        (Compared("highest peak, at 40 °C", printed.FIG_11_HIGHEST, float(highest.max())),),
        f"At 40 °C ours are {each}. There the binder is softer than the 5 MPa down to which the "
        "stiffness formulas hold, in the paper as here, and the modulus falls steeply: from 30 to "
        f"40 °C peaks grow {growth.min():.1f} to {growth.max():.1f} times.",
    )


def _over_vma(numbers: Numbers) -> PaperFigure:
    return PaperFigure(
        "fig_12",
        "Peak over voids in the mineral aggregate",
        "Largest deflection of the middle of the road at 15 to 30 % VMA (the paper’s void "
        "content), at three speeds, constant forces, 20 °C.",
        "Values are not at hand; the sensitivities in Table III are.",
        (Panel("", "VMA [%]", "peak deflection", _by_speed(VMAS, numbers.by_vma)),),
    )


def _by_speed(
    x: ArrayLike, peaks: NDArray[np.float64], marks: Marks = "line and points"
) -> tuple[Curve, ...]:
    return tuple(
        Curve.through(f"{speed:g} km/h", x, row, marks)
        for speed, row in zip(SPEEDS, peaks, strict=True)
    )


def trend(peaks: NDArray[np.float64]) -> str:
    """Say how peaks go over `SPACINGS`."""
    low, middle, high = peaks
    if low > middle > high:
        return "falls"
    if low < middle < high:
        return "rises"
    return f"a {'minimum' if middle < low else 'maximum'} at {SPACINGS[1]:g} m"
