"""Asphalt stiffness from temperature, loading time and composition."""

from __future__ import annotations

from typing import Annotated, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from pavefem import _core
from pavefem._model import Model, Number, VoidsPercent
from pavefem._validity import warn_validity

TIRE_PRINT: Final = _core.TIRE_PRINT
"""Length of a tire print, m: at speed v a point is loaded for 0.3 / v seconds."""


def kmh(speed_kmh: ArrayLike) -> NDArray[np.float64]:
    """Speed in m/s from km/h; a `ValueError` where it is not above 0 and finite."""
    speed = np.asarray(speed_kmh, dtype=np.float64)
    wrong = ~(np.isfinite(speed) & (speed > 0.0))
    if wrong.any():
        raise ValueError(f"speed_kmh = {speed[wrong].flat[0]:g}: must be finite and above 0 km/h")
    return speed / 3.6


class Asphalt(Model):
    """An asphalt mix, as far as its stiffness goes.

    Examples
    --------
    >>> mix = Asphalt(vma=25.0, softening_point_c=60.0, penetration_index=-1.0)
    >>> round(float(mix.modulus(temperature_c=20.0, speed_kmh=65.0)) / 1e9, 5)
    4.38521
    """

    vma: VoidsPercent = 25.0
    """Voids in the mineral aggregate, % of the volume."""
    softening_point_c: Annotated[Number, Field(gt=-50, lt=200)] = 60.0
    """Softening point of the binder, ring and ball, °C."""
    penetration_index: Annotated[Number, Field(ge=-10, le=10)] = -1.0
    """Penetration index of the binder (the paper gives none; -1 is the reading chosen here)."""

    def binder_stiffness(
        self, temperature_c: ArrayLike, loading_time: ArrayLike
    ) -> np.float64 | NDArray[np.float64]:
        """Binder stiffness (eq. 8, Ullidtz).

        ``E_b = 1.157e-7 t^-0.368 exp(-PI) (T_RB - T)^5`` in MPa, t in s, T in °C.

        Parameters
        ----------
        temperature_c : array_like
            Asphalt temperature, °C, below the softening point.
        loading_time : array_like
            Loading time, s. Both arguments broadcast.

        Returns
        -------
        float64 or ndarray
            Binder stiffness, Pa.

        Raises
        ------
        ValueError
            If the temperature is not below the softening point or the loading time not above 0.

        Warns
        -----
        ValidityWarning
            Outside the limits of the formula: 0.01 to 0.1 s, penetration index -1 to 1,
            softening point 10 to 70 °C above the temperature.
        """
        temperature, time = _broadcast(temperature_c, loading_time)
        binder = self._binder(temperature, time)
        self._warn_binder(temperature, time)
        return binder[()]

    def modulus(
        self, temperature_c: ArrayLike, speed_kmh: ArrayLike
    ) -> np.float64 | NDArray[np.float64]:
        """Mix stiffness under a vehicle (eqs. 7-8, Heukelom and Klomp), the modulus E.

        ``E = E_b [1 + (257.5 - 2.5 VMA) / (n (VMA - 3))]^n`` with ``n = 0.83 log10(40 GPa / E_b)``
        and the loading time 0.3 m / v.

        Parameters
        ----------
        temperature_c : array_like
            Asphalt temperature, °C, below the softening point.
        speed_kmh : array_like
            Vehicle speed, km/h. Both arguments broadcast.

        Returns
        -------
        float64 or ndarray
            Mix stiffness, Pa.

        Raises
        ------
        ValueError
            If the temperature is not below the softening point or the speed not above 0.

        Warns
        -----
        ValidityWarning
            Outside the limits of the formulas: those of `binder_stiffness`, 12 to 30 % of VMA, a
            binder stiffness above 5 MPa.
        """
        temperature, speed = _broadcast(temperature_c, kmh(speed_kmh))
        time = TIRE_PRINT / speed
        binder = self._binder(temperature, time)
        self._warn_binder(temperature, time)
        _warn("binder stiffness", binder / 1e6, 5.0, np.inf, "MPa")
        _warn("vma", np.float64(self.vma), 12.0, 30.0, "%")
        vma = np.full(binder.size, self.vma)
        return _core.mix_modulus(binder.ravel(), vma).reshape(binder.shape)[()]

    def _binder(
        self, temperature: NDArray[np.float64], time: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        softening = np.full(time.size, self.softening_point_c)
        index = np.full(time.size, self.penetration_index)
        binder = _core.binder_stiffness(time.ravel(), temperature.ravel(), softening, index)
        return binder.reshape(time.shape)

    def _warn_binder(self, temperature: NDArray[np.float64], time: NDArray[np.float64]) -> None:
        below = self.softening_point_c - temperature
        _warn("loading time", time, 0.01, 0.1, "s")
        _warn("penetration index", np.float64(self.penetration_index), -1.0, 1.0, "")
        _warn("softening point minus temperature", below, 10.0, 70.0, "°C")


def _broadcast(*values: ArrayLike) -> tuple[NDArray[np.float64], ...]:
    return np.broadcast_arrays(*(np.asarray(value, dtype=np.float64) for value in values))


def _warn(
    name: str, value: NDArray[np.float64] | np.float64, low: float, high: float, unit: str
) -> None:
    """Warn of the value that lies furthest outside ``low`` to ``high``, the limits included."""
    outside = np.maximum(low - value, value - high)
    # The loading time of a speed may miss a limit by a rounding error.
    if outside.size == 0 or not outside.max() > 1e-9 * abs(low):
        return
    worst = np.ravel(value)[np.argmax(outside)]
    limits = f"above {low:g}" if np.isinf(high) else f"{low:g} to {high:g}"
    warn_validity(
        f"{name} {worst:.4g} {unit}".rstrip()
        + f" is outside the range of the stiffness formulas, {limits} {unit}".rstrip(),
        stacklevel=4,
    )
