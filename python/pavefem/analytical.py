"""Closed forms to compare numerical results with.

Deflections here are positive downwards, forces positive pressing on the beam.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pavefem import _core
from pavefem.pavement import Constants


class WinklerBeam:
    """An infinite beam on a damped Winkler bed.

    ``EI w'''' + c_EI w''''_t + m w_tt + c w_t + k w = P delta(x - v t)``

    Parameters
    ----------
    bending_stiffness : float
        EI, N m².
    mass : float
        Mass of beam and bed, kg/m.
    stiffness : float
        Bed stiffness k, N/m².
    damping : float
        Bed damping c, N s/m².
    bending_damping : float
        c_EI, N m² s.
    """

    def __init__(
        self,
        bending_stiffness: float,
        mass: float,
        stiffness: float,
        damping: float = 0.0,
        bending_damping: float = 0.0,
    ) -> None:
        self._core = _core.WinklerBeam(
            bending_stiffness=bending_stiffness,
            bending_damping=bending_damping,
            mass=mass,
            damping=damping,
            stiffness=stiffness,
        )

    @classmethod
    def of(cls, constants: Constants) -> WinklerBeam:
        """Build the infinite beam of a pavement's constants (`Pavement.constants`)."""
        return cls(
            bending_stiffness=constants.bending_stiffness,
            mass=constants.mass + constants.bed_mass,
            stiffness=constants.bed_stiffness,
            damping=constants.bed_damping,
            bending_damping=constants.bending_damping,
        )

    @property
    def decay(self) -> float:
        """``lambda = (k / 4 EI)^(1/4)``, 1/m."""
        return self._core.decay

    @property
    def critical_speed(self) -> float:
        """Speed of the slowest free wave, ``(4 k EI / m²)^(1/4)``, m/s."""
        return self._core.critical_speed

    def static_deflection(self, force: float, x: ArrayLike = 0.0) -> NDArray[np.float64]:
        """Deflection `x` m from a force at rest, m: ``P lambda / 2k`` under it."""
        places = _finite(force=force, x=x)
        return self._core.static_deflection(force, places.ravel()).reshape(places.shape)[()]

    def static_moment(self, force: float) -> float:
        """Bending moment under a force at rest, N m: ``P / 4 lambda``."""
        _finite(force=force)
        return self._core.static_moment(force)

    def moving_deflection(
        self, force: float, speed: float, xi: ArrayLike, print_length: float = 0.0
    ) -> NDArray[np.float64]:
        """Deflection `xi` m ahead of a force that moves at `speed`, m/s, in its steady state, m.

        The force is evenly spread over `print_length` m about its place, or, at 0, in a point.
        """
        places = _finite(force=force, speed=speed, print_length=print_length, xi=xi)
        values = self._core.moving_deflection(force, speed, places.ravel(), print_length)
        return values.reshape(places.shape)[()]

    def moving_peak(
        self, force: float, speed: float, print_length: float = 0.0
    ) -> tuple[float, float]:
        """Largest deflection under a moving force, m, and its place, m ahead of the force.

        The force is evenly spread over `print_length` m about its place, or, at 0, in a point.
        """
        _finite(force=force, speed=speed, print_length=print_length)
        return self._core.moving_peak(force, speed, print_length)


class SimplySupportedBeam:
    """A simply supported beam without a foundation.

    Parameters
    ----------
    length : float
        Span, m.
    bending_stiffness : float
        EI, N m².
    mass : float
        Mass, kg/m.
    """

    def __init__(self, length: float, bending_stiffness: float, mass: float) -> None:
        self._length = length
        self._core = _core.SimplySupportedBeam(
            length=length, bending_stiffness=bending_stiffness, mass=mass
        )

    def static_deflection(self, force: float) -> float:
        """Deflection at mid-span under a force there, m: ``P L³ / 48 EI``."""
        _finite(force=force)
        return self._core.static_deflection(force)

    def moving_deflection(
        self, force: float, speed: float, x: float, time: ArrayLike, modes: int = 200
    ) -> NDArray[np.float64]:
        """Deflection at `x`, m, while a force crosses at `speed`, m/s, by the modal series (Fryba).

        `time`, s, is counted from the force's entry and ends with its leaving.
        """
        times = _finite(force=force, speed=speed, x=x, time=time)
        if not 0.0 <= x <= self._length:
            raise ValueError(f"x = {x:g} m: must be on the beam, 0 to {self._length:g} m")
        if not speed > 0.0:
            raise ValueError(f"speed = {speed:g} m/s: must be above 0")
        leaving = self._length / speed
        if times.size and not (times.min() >= 0.0 and times.max() <= leaving * (1.0 + 1e-9)):
            raise ValueError(f"time must be 0 to {leaving:g} s, when the force leaves")
        if not 1 <= modes <= 10_000:
            raise ValueError(f"modes = {modes}: must be 1 to 10 000")
        values = self._core.moving_deflection(force, speed, x, times.ravel(), modes)
        return values.reshape(times.shape)[()]


def _finite(**values: ArrayLike) -> NDArray[np.float64]:
    """Check that all are finite; the last of them as an array."""
    array = np.empty(0)
    for name, value in values.items():
        array = np.asarray(value, dtype=np.float64)
        if not np.isfinite(array).all():
            raise ValueError(f"{name} must be finite")
    return array
