"""The sensitivity S of the paper."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pavefem.profile import finite_vector


def paper_sensitivity(x: ArrayLike, y: ArrayLike, *, signed: bool = False) -> float:
    """Sensitivity S of the paper (Fig. 13, Table III): relative change over relative change.

    ``S_i = (|y_i+1 - y_i| / y_i) / (|x_i+1 - x_i| / x_i)``, forward differences from each point to
    the next, averaged. It depends on the unit of x where that has an offset (°C against K), and on
    the points.

    Parameters
    ----------
    x : array_like, shape (n,)
        Values of the input, above 0, n >= 2; each differs from the one before.
    y : array_like, shape (n,)
        What the answer is there, above 0.
    signed : bool
        Whether a fall of y with x counts as negative, as in the paper's rows of speed and
        roughness.

    Returns
    -------
    float

    Raises
    ------
    ValueError
        If x and y are not finite vectors of one length of at least 2 with values above 0, or x
        stays the same from one point to the next.

    Examples
    --------
    A power law of small steps has its exponent as sensitivity:

    >>> x = np.linspace(1.0, 2.0, 1001)
    >>> round(paper_sensitivity(x, 1.0 / x**2, signed=True), 2)
    -2.0
    """
    inputs, answers = finite_vector("x", x), finite_vector("y", y)
    if inputs.size != answers.size or inputs.size < 2:
        raise ValueError(
            f"x has {inputs.size} values and y has {answers.size}: must be as many, at least 2"
        )
    for name, values in (("x", inputs), ("y", answers)):
        if not values.min() > 0.0:
            raise ValueError(
                f"{name} has {values.min():g}: must be above 0, where a relative change has a sense"
            )
    if np.any(np.diff(inputs) == 0.0):
        same = inputs[np.argmin(np.diff(inputs) != 0.0)]
        raise ValueError(f"x has {same:g} twice in a row: must change from each point to the next")
    with np.errstate(all="ignore"):  # what comes of it is refused below
        ratio = _relative_steps(answers) / _relative_steps(inputs)
    mean = float(np.mean(ratio if signed else np.abs(ratio)))
    if not np.isfinite(mean):
        raise ValueError("relative changes of x or y are too large, or too small, for numbers")
    return mean


def _relative_steps(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.diff(values) / values[:-1]
