"""What the paper leaves open, read in two ways, and what has to be assumed beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from pavefem.asphalt import Asphalt
from pavefem.pavement import Pavement
from pavefem.studies.paper import sites


@dataclass(frozen=True)
class Reading:
    """A way to read the paper's Table I."""

    name: str
    """``"first"`` or ``"second"``."""
    pavement: Pavement
    """Table I read so, at the nominal 25 % of VMA."""
    made_for: str
    """What it reproduces, and what not."""

    def pavement_with(self, vma: float) -> Pavement:
        """Take the pavement with another VMA, %."""
        asphalt = self.pavement.asphalt.model_copy(update={"vma": vma})
        return self.pavement.model_copy(update={"asphalt": asphalt})


READINGS: Final = {
    "first": Reading(
        "first",
        Pavement.paper(),
        "It gives the sensitivities to temperature and VMA at every speed. Peaks lie above the "
        "printed ranges at low speed.",
    ),
    "second": Reading(
        "second",
        Pavement.paper(
            Asphalt(penetration_index=-0.16), bar_damping=14e3, asphalt_bar_stiffness=84.3e6
        ),
        "It gives the levels of Fig. 8 and, at 25 and 105 km/h, its trends. Sensitivities to "
        "temperature come out too high.",
    ),
}
"""No reading found gives everything."""


@dataclass(frozen=True)
class Assumption:
    """Something the paper leaves open, and how it is taken."""

    what: str
    says: str
    """What the paper says of it."""
    first: str
    second: str
    why: str


def _spaced(number: float) -> str:
    return f"{number:,.0f}".replace(",", "\u00a0")


def _open_constants() -> tuple[Assumption, ...]:
    """Constants in which the readings differ."""
    first, second = (READINGS[name].pavement for name in ("first", "second"))
    return (
        Assumption(
            "damping constant of a bar",
            "“Damping constant of the bar elements” stands twice in Table I: 14\u00a0000 and "
            "140\u00a0000",
            f"{_spaced(first.bar_damping)} N s/m; the other is the beam’s",
            f"{_spaced(second.bar_damping)} N s/m, as the beam’s",
            "Table I prints both values under the bars’ name. With much damping the "
            "sensitivities come out, with little the levels and trends of Fig. 8.",
        ),
        Assumption(
            "penetration index of the binder",
            "not given",
            f"{first.asphalt.penetration_index:g}".replace("-", "−"),
            f"{second.asphalt.penetration_index:g}".replace("-", "−"),
            "Fitted with the next line: in the first reading to Table III, in the second to "
            "Fig. 8.",
        ),
        Assumption(
            "asphalt’s part of a bar at 20 °C, 25 % VMA, 65 km/h",
            "not given; 1/k_bar = 1/k_subbase + 1/k_asphalt (eq. 6)",
            f"{first.asphalt_bar_stiffness / 1e6:g} MN/m",
            f"{second.asphalt_bar_stiffness / 1e6:g} MN/m",
            "Fitted; it goes with the modulus. With the penetration index the only number of the "
            "pavement that is not in the paper.",
        ),
    )


_SAME: Final = "the same"
_UNKNOWN: Final = "not known to us"

ASSUMPTIONS: Final = (
    *_open_constants(),
    Assumption(
        "stiffness of the subbase’s part of a bar",
        "“Spring constant of the bar elements 95\u00a0000\u00a0000”",
        "EA = 9.5e7 N, so EA / 0.5 m = 190 MN/m",
        _SAME,
        "Read as the spring itself, the sensitivities to VMA come out at half the printed ones.",
    ),
    Assumption(
        "void content",
        "“void content”",
        "voids in the mineral aggregate (VMA)",
        _SAME,
        "Eq. 7 is Heukelom and Klomp’s formula with 3 % of air counted with the aggregate.",
    ),
    Assumption(
        "scheme",
        "0.5 m elements, linear shares (Fig. 6), eqs. 9-12",
        "the same, 1 ms, force and place held within a step; Phi by scaling and squaring",
        _SAME,
        "Summed as printed, the series of eq. 11 loses all digits in single precision: "
        "|A dt| is 35 at 1 ms.",
    ),
    Assumption(
        "where deflections are taken",
        _UNKNOWN,
        "at the middle of the 25 m, until the last axle leaves",
        _SAME,
        "Next to the clamped ends peaks are others.",
    ),
    Assumption(
        "tandem spacing, but for Figs. 7 and 8",
        _UNKNOWN,
        "1.6 m, both axles 0.8 m from the tandem’s centre, static loads kept",
        _SAME,
        "With it the sensitivities to temperature and VMA come out.",
    ),
    Assumption(
        "truck",
        "Table II and Fig. 4, without tires, pitch inertia and equalizing beam",
        "tires 1.75 MN/m (front) and 3.5 MN/m, 10 kN s/m an axle; pitch inertia 80\u00a0000 kg m²; "
        "beam 100 kg m²",
        _SAME,
        "Chosen. The static axle loads fix the centre of gravity and the pin of the beam.",
    ),
    Assumption(
        "forces, but for Figs. 9 and 10",
        _UNKNOWN,
        "constant: a smooth road",
        _SAME,
        "With them the sensitivities to temperature and VMA come out.",
    ),
    Assumption(
        "profiles of Figs. 9 and 10, and of the roughness and speed rows",
        "26 measured profiles that may not be passed on",
        f"if none are given: {sites.COUNT} random ones of ISO 8608 (seeds 0 to {sites.COUNT - 1}, "
        f"{sites.SPACING:g} m apart), scaled to {sites.SMOOTHEST:g} to {sites.ROUGHEST:g} m/km in "
        "even steps",
        _SAME,
        "The range of the paper’s IRI is not known to us; this one goes from a new motorway to a "
        "poor road.",
    ),
    Assumption(
        "profile between samples",
        "segments of constant elevation",
        "a staircase: within a segment the elevation does not change",
        _SAME,
        "As the paper has it; the damping of the tires then feels no slope. The truck settles over "
        f"{sites.RUN_IN:g} m ahead of the road, or what a profile has.",
    ),
    Assumption(
        "sensitivity to roughness",
        "S of 26 profiles, signed",
        "forward difference from the smoother to the rougher half: means of IRI and peak",
        _SAME,
        "From one profile to the next a step of IRI of a few percent would divide the chance of "
        "which bump lies ahead of the middle.",
    ),
    Assumption(
        "sensitivity to speed",
        "from 25 to 65 and from 65 to 105 km/h, signed",
        "of the mean peaks of Fig. 10",
        _SAME,
        "Fig. 10 is the one over speed.",
    ),
)
"""All that is assumed: first what the readings differ in."""
