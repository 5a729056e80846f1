"""The structure of a pavement: an asphalt beam on damped bars or on a bed (Table I, Fig. 1)."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Any, NamedTuple, Self, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from pavefem._model import Model, NotNegative, Number, Positive, VoidsPercent
from pavefem.asphalt import Asphalt


class Constants(NamedTuple):
    """What the finite elements need of a pavement at one modulus, per metre of wheel track."""

    bending_stiffness: float
    """EI, N m²."""
    bending_damping: float
    """c_EI, N m² s."""
    mass: float
    """Mass of the beam, kg/m."""
    bed_stiffness: float
    """k, N/m²."""
    bed_damping: float
    """c, N s/m²."""
    bed_mass: float
    """Mass that moves with the beam, kg/m."""


class Pavement(Model):
    """A flexible pavement under one wheel track, by the constants of the paper's Table I.

    An Euler-Bernoulli beam of asphalt stands on vertical bars, `spacing` apart, that stand on fixed
    ground. A bar is the asphalt below the beam and the subbase in series,
    ``1/k_bar = 1/k_subbase + 1/k_asphalt`` (eq. 6), of which the asphalt's part follows the
    modulus. Table I's numbers hold for one element and one bar `spacing` apart; under mesh
    refinement the same constants per metre are kept.

    The damping constant of the bar elements stands twice in Table I: the first, 14 000 N s/m, is
    read as the beam's, the second as the bar's. Its "spring constant of the bar elements",
    95 000 000, is read as EA in newtons, because the stiffness EA / spacing reproduces Table III.
    """

    asphalt: Asphalt = Asphalt()
    """The mix of the beam and of the asphalt's part of the bars."""
    moment_of_inertia: Annotated[Number, Field(ge=1e-12)] = 4.5e-5
    """Second moment of area I of the beam, m⁴."""
    thickness: Annotated[Number, Field(ge=1e-3, le=10)] = 0.10
    """Thickness of the beam, m: strain at its bottom is the curvature times half of it."""
    spacing: Annotated[Positive, Field(le=100)] = 0.5
    """Distance between bars, and length of the element that the constants below hold for, m."""
    element_mass: Positive = 1000.0
    """Mass of a beam element, kg."""
    beam_damping: NotNegative = 14_000.0
    """Damping constant c_d of a beam element, N s/m; c_d spacing³ bends, N m² s."""
    bar_mass: NotNegative = 355.0
    """Mass of a bar, kg; a third of it moves with the node (consistent mass)."""
    bar_damping: NotNegative = 140_000.0
    """Damping constant of a bar, N s/m."""
    bar_rigidity: Positive = 9.5e7
    """EA of the subbase's part of a bar, N; its spring constant is EA / spacing."""
    asphalt_bar_stiffness: Positive = 56e6
    """Spring constant of the asphalt's part of a bar at the reference modulus, N/m (fitted)."""
    reference_temperature_c: Number = 20.0
    """Temperature at which `asphalt_bar_stiffness` holds, °C."""
    reference_vma: VoidsPercent = 25.0
    """Voids in the mineral aggregate at which it holds, %."""
    reference_speed_kmh: Positive = 65.0
    """Speed at which it holds, km/h."""

    @classmethod
    def paper(cls, asphalt: Asphalt | None = None, **changes: Any) -> Self:
        """Build the pavement of the paper's Table I.

        Parameters
        ----------
        asphalt : Asphalt, optional
            The mix; by default 25 % VMA, softening point 60 °C, penetration index -1.
        **changes
            Fields that are to differ from Table I.
        """
        return cls(asphalt=Asphalt() if asphalt is None else asphalt, **changes)

    @property
    def width(self) -> float:
        """Width of the strip that carries a wheel track, 12 I / thickness³, m (0.54 m)."""
        return 12.0 * self.moment_of_inertia / self.thickness**3

    @property
    def subbase_stiffness(self) -> float:
        """Spring constant of the subbase's part of a bar, EA / spacing, N/m."""
        return self.bar_rigidity / self.spacing

    @cached_property
    def reference_modulus(self) -> float:
        """Modulus of this binder at the reference temperature, VMA and speed, Pa."""
        mix = self.asphalt.model_copy(update={"vma": self.reference_vma})
        return float(mix.modulus(self.reference_temperature_c, self.reference_speed_kmh))

    @overload
    def bar_stiffness(self, modulus: float) -> np.float64: ...
    @overload
    def bar_stiffness(self, modulus: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def bar_stiffness(
        self, modulus: float | NDArray[np.float64]
    ) -> np.float64 | NDArray[np.float64]:
        """Spring constant of a bar (eq. 6), N/m, at asphalt moduli in Pa, above 0."""
        given = np.asarray(modulus, dtype=np.float64)
        wrong = ~(np.isfinite(given) & (given > 0.0))
        if wrong.any():
            raise ValueError(f"modulus = {given[wrong].flat[0]} Pa: must be finite and above 0")
        asphalt = self.asphalt_bar_stiffness * given / self.reference_modulus
        stiffness: NDArray[np.float64] = 1.0 / (1.0 / self.subbase_stiffness + 1.0 / asphalt)
        return stiffness[()]

    def constants(self, temperature_c: float, speed_kmh: float) -> Constants:
        """Constants per metre at a temperature, °C, under a vehicle at a speed, km/h."""
        [row] = self.constants_at(temperature_c, [speed_kmh])
        return Constants(*row.tolist())

    def constants_at(self, temperature_c: float, speed_kmh: ArrayLike) -> NDArray[np.float64]:
        """Constants per metre under vehicles at many speeds.

        Parameters
        ----------
        temperature_c : float
            Asphalt temperature, °C.
        speed_kmh : array_like, shape (speeds,)
            Vehicle speeds, km/h.

        Returns
        -------
        ndarray, shape (speeds, 6)
            The fields of `Constants`.
        """
        modulus = np.asarray(self.asphalt.modulus(temperature_c, speed_kmh))
        # In the order of `Constants`.
        columns = (
            modulus * self.moment_of_inertia,
            self.beam_damping * self.spacing**3,
            self.element_mass / self.spacing,
            self.bar_stiffness(modulus) / self.spacing,
            self.bar_damping / self.spacing,
            self.bar_mass / 3.0 / self.spacing,
        )
        return np.stack(np.broadcast_arrays(*columns), axis=-1)
