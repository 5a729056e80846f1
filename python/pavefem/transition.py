"""Transition matrix and particular response of any M u'' + C u' + K u = f (eqs. 9-12)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pavefem import _core


def transition(
    mass: ArrayLike,
    damping: ArrayLike,
    stiffness: ArrayLike,
    dt: float,
    *,
    form: Literal["auto", "stiffness", "state", "integral"] = "auto",
) -> _core.Transition:
    """Compute Phi and Gamma of ``M u'' + C u' + K u = f`` for one time step.

    In the state y = (u, u'), ``y(t + dt) = Phi y(t) + Gamma f`` for a force that is constant over
    the step, with ``Phi = exp(A dt)`` by a Taylor series, scaled and squared.

    Parameters
    ----------
    mass, damping, stiffness : array_like, shape (n, n)
        M, C and K, in units of one's own.
    dt : float
        Time step, s.
    form : {"auto", "stiffness", "state", "integral"}
        How Gamma is found: as ``(I - Phi) [K^-1; 0]``, as ``A^-1 (Phi - I) B``, or as the integral
        of the series, the only form where K (and with it A) is singular. ``"auto"`` is the first,
        or the last where the first is singular or, at a small step, lost in rounding.

    Returns
    -------
    Transition
        With ``phi`` (2n, 2n), ``gamma`` (2n, n), ``ramp`` (2n, n: the state after a force that grew
        linearly to one over the step), and how the series was summed: ``norm`` of A dt, ``terms``
        and ``squarings``.

    Raises
    ------
    ValueError
        If the matrices are not square and of one size, or dt is not above 0.
    SolverError
        If a matrix that has to be inverted is singular, or an entry is not finite; it says which.

    Examples
    --------
    An undamped oscillator of 1 Hz comes back after one second:

    >>> step = transition([[1.0]], [[0.0]], [[4 * np.pi**2]], dt=1.0)
    >>> bool(np.allclose(step.phi, np.eye(2), atol=1e-11))
    True
    """
    matrices = (
        _matrix("mass", mass),
        _matrix("damping", damping),
        _matrix("stiffness", stiffness),
    )
    return _core.Transition(*matrices, float(dt), form)


def _matrix(name: str, values: ArrayLike) -> NDArray[np.float64]:
    if np.iscomplexobj(values):
        raise ValueError(f"{name} is complex: must be real")
    matrix = np.asarray(values, dtype=np.float64)
    if matrix.ndim != 2:
        raise ValueError(f"{name} has shape {matrix.shape}: must be a square matrix")
    return matrix
