"""Constants of a pavement from what was measured on it (the paper's section VI.A)."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import stats
from scipy.optimize import least_squares

from pavefem._model import finite_number
from pavefem._validity import listening
from pavefem.errors import CalibrationWarning, SolverError
from pavefem.pavement import Pavement
from pavefem.road import Road
from pavefem.scenario import Scenario
from pavefem.scheme import Scheme
from pavefem.studies.fields import Field, changed_part, checked_bounds, resolve
from pavefem.studies.measurements import DeflectionHistory, ForceDeflection, Measurement

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

STEP: Final = 1e-4
"""Step of the central differences, in widths of the bounds: their error is then some 1e-8, be it of
the step or of the rounding in a run."""
RANK: Final = 1e-6
"""Singular values of the Jacobian below this part of the largest are zero but for that error."""
LOOSEST: Final = 0.25
"""Standard error, in widths of the bounds, from which a parameter is not determined: its 95 %
interval is as wide as the bounds."""
MEMBER: Final = 0.01
"""Smallest part that a parameter has in a combination of which nothing is known."""


class Bounds(NamedTuple):
    """Between which values a parameter is sought, and on which scale.

    On the scale of the fit, the bounds are 0 and 1.
    """

    low: float
    high: float

    @property
    def logarithmic(self) -> bool:
        """Whether it is sought by its logarithm: if it cannot come to zero."""
        return self.low > 0.0

    @property
    def width(self) -> float:
        """Width of the bounds: of the logarithm, or of the values."""
        if self.logarithmic:
            return float(np.log(self.high / self.low))
        return self.high - self.low

    def value(self, scaled: float) -> float:
        """Value of a place between the bounds."""
        if self.logarithmic:
            return float(self.low * np.exp(self.width * scaled))
        return self.low + self.width * scaled

    def scaled(self, value: float) -> float:
        """Place of a value between the bounds."""
        if self.logarithmic:
            return float(np.log(value / self.low) / self.width)
        return (value - self.low) / self.width

    def rate(self, scaled: float) -> float:
        """Give the derivative of the value."""
        return self.width * (self.value(scaled) if self.logarithmic else 1.0)


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """Constants of a pavement that fit measurements, and how well these tell them.

    Attributes
    ----------
    road : Road
        The road with the fitted constants.
    bounds : dict of str to (low, high)
        Bounds of each parameter.
    start, values : dict of str to float
        Each parameter before and after the fit.
    covariance : DataArray, shape (parameters, parameters)
        Covariance of the parameters. Infinite where the measurements do not determine them.
    correlation : DataArray, shape (parameters, parameters)
        Their correlation; that of two parameters which cannot be told apart is 1 or -1.
    measurements : tuple of Measurement
        What was fitted.
    fitted : tuple of ndarray
        What the model answers in place of each measurement's deflections, m.
    noise_known : bool
        Whether the measurements came with their noise. Otherwise it is estimated from residuals.
    noise : tuple of ndarray
        Standard deviation of each measurement's deflections, m, as given or as estimated.
    misfit : float
        Mean square of residuals over noise, for each degree of freedom. Where the noise is known,
        it is about 1 if the model holds; where it is estimated, it is 1.
    degrees_of_freedom : int
        Number of deflections less that of parameters.
    undetermined : tuple of str
        What the measurements do not tell, one sentence for each combination of parameters.
    at_bound : tuple of str
        Parameters that are at one of their bounds, where errors do not hold.
    evaluations : int
        Number of times that the model was run.
    """

    road: Road
    bounds: dict[str, Bounds]
    start: dict[str, float]
    values: dict[str, float]
    covariance: xr.DataArray
    correlation: xr.DataArray
    measurements: tuple[Measurement, ...]
    fitted: tuple[Array, ...]
    noise_known: bool
    noise: tuple[Array, ...]
    misfit: float
    degrees_of_freedom: int
    undetermined: tuple[str, ...]
    at_bound: tuple[str, ...]
    evaluations: int

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value:.4g}" for name, value in self.values.items())
        return f"Calibration({values})"

    @property
    def pavement(self) -> Pavement:
        """The pavement with the fitted constants."""
        return self.road.sections[0].pavement

    @cached_property
    def standard_errors(self) -> dict[str, float]:
        """Standard error of each parameter; infinite where it is not determined."""
        errors = np.sqrt(np.diag(self.covariance.to_numpy()))
        return dict(zip(self.values, errors.tolist(), strict=True))

    @property
    def residuals(self) -> tuple[Array, ...]:
        """Measured less fitted deflections of each measurement, m."""
        pairs = zip(self.measurements, self.fitted, strict=True)
        return tuple(measured.deflection - fitted for measured, fitted in pairs)

    def interval(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """Confidence interval of a parameter.

        Normal errors of the parameter, or of its logarithm where it was fitted by that (its lower
        bound is above 0); by Student's distribution where the noise was estimated.

        Raises
        ------
        ValueError
            If there is no such parameter, or `level` is not between 0 and 1.
        """
        if name not in [*self.values]:
            raise ValueError(f"{name!r} was not fitted: must be one of {list(self.values)}")
        if not 0.0 < finite_number("level", level) < 1.0:
            raise ValueError(f"level = {level!r}: must be between 0 and 1")
        part = (1.0 + level) / 2.0
        quantile = stats.norm.ppf(part)
        if not self.noise_known:
            quantile = stats.t.ppf(part, self.degrees_of_freedom)
        value, reach = self.values[name], float(quantile) * self.standard_errors[name]
        if not self.bounds[name].logarithmic:
            return value - reach, value + reach
        factor = float(np.exp(reach / value))
        return value / factor, value * factor

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The parameters as an `xarray.Dataset` with their bounds, errors and 95 % intervals."""
        names = list(self.values)
        intervals = np.array([self.interval(name) for name in names])
        bounds = np.array([self.bounds[name] for name in names])
        columns = {
            "value": list(self.values.values()),
            "standard_error": list(self.standard_errors.values()),
            "interval_low": intervals[:, 0],
            "interval_high": intervals[:, 1],
            "start": list(self.start.values()),
            "bound_low": bounds[:, 0],
            "bound_high": bounds[:, 1],
        }
        return xr.Dataset(
            {column: ("parameter", values) for column, values in columns.items()}
            | {"covariance": self.covariance, "correlation": self.correlation}
        )

    def summary(self) -> dict[str, str]:
        """Return the parameters with their intervals, and what to know of the fit, as text."""
        figures = {}
        for name, value in self.values.items():
            low, high = self.interval(name)
            told = np.isfinite(self.standard_errors[name])
            figures[name] = f"{value:.5g}, " + (
                f"95 % interval {low:.5g} to {high:.5g}" if told else "not determined"
            )
        residuals = np.concatenate([part.ravel() for part in self.residuals])
        figures["deflections"] = f"{residuals.size} of {len(self.measurements)} measurements"
        rms = np.sqrt(np.mean(residuals**2))
        figures["residuals"] = f"{rms * 1e6:.4g} µm rms"
        if self.noise_known:
            figures["residuals over noise"] = f"{np.sqrt(self.misfit):.3g} (1 if the model holds)"
        for number, sentence in enumerate(self.undetermined, start=1):
            figures[f"not told {number}"] = sentence
        if self.at_bound:
            figures["at a bound"] = ", ".join(self.at_bound)
        return figures

    def plot(self) -> Figure:
        """Draw what was measured and fitted, and the residuals."""
        from pavefem import plotting  # matplotlib takes half a second to import

        return plotting.plot_calibration(self)


def calibrate(
    road: Road,
    measurements: Measurement | Sequence[Measurement],
    parameters: Mapping[str, tuple[float, float]],
    *,
    start: Mapping[str, float] | None = None,
    scheme: Scheme | str = "paper",
) -> Calibration:
    """Fit constants of a pavement to what was measured on it, by least squares.

    Parameters
    ----------
    road : Road
        The road of the measurements, of one section; its constants are kept but for those fitted.
    measurements : ForceDeflection, DeflectionHistory or a sequence of them
        What was measured. Several are fitted together, by the same constants.
    parameters : mapping of str to (float, float)
        Fields of `Pavement` or `Asphalt` to be fitted, with their bounds. Where the lower one is
        above 0, a field is fitted by its logarithm.
    start : mapping of str to float, optional
        Values to start from; by default those of the road.
    scheme : Scheme or {"paper", "converged"}
        Discretisation of the model.

    Returns
    -------
    Calibration

    Raises
    ------
    ValueError
        If a parameter is no field, bounds are not in order or a start is not between them; if some
        measurements come with their noise and others do not; if there are not more deflections than
        parameters where the noise is to be estimated.
    SolverError
        If the fit does not converge.

    Warns
    -----
    CalibrationWarning
        If the measurements do not tell parameters apart, or do not determine one at all: it names
        them, and their errors are infinite. If a parameter ends at a bound.
    ValidityWarning
        If the asphalt of the fit is outside the range of its stiffness formulas.

    Notes
    -----
    The fit goes downhill from its start; where several minima are to be feared, try others.
    Covariance is ``s² (J' J)^-1`` with the Jacobian J of the residuals over the noise, at the
    solution; s is 1 where the noise is known. It takes errors for independent of each other. J is
    scaled by the bounds. Combinations of parameters (its right singular vectors) whose singular
    value is below 1e-6 of the largest, or whose standard error is above a quarter of the bounds'
    width, are not determined.

    Examples
    --------
    The subbase and the bound part of a bar, from creep tests on a cold and on a warm day:

    >>> force, road = [20e3, 40e3, 60e3], Road.paper()
    >>> tests = [
    ...     ForceDeflection(force, [0.255e-3, 0.510e-3, 0.766e-3], speed_kmh=15, temperature_c=10),
    ...     ForceDeflection(force, [0.727e-3, 1.451e-3, 2.177e-3], speed_kmh=15, temperature_c=25),
    ... ]
    >>> wide = {"asphalt_bar_stiffness": (1e7, 1e9), "bar_rigidity": (1e7, 1e9)}
    >>> {name: f"{value:.2g}" for name, value in calibrate(road, tests, wide).values.items()}
    {'asphalt_bar_stiffness': '5.6e+07', 'bar_rigidity': '9.5e+07'}
    """
    tests = _check_measurements(measurements)
    bounds = {name: Bounds(*pair) for name, pair in checked_bounds(parameters).items()}
    model = _Model(Scenario(road=road, scheme=scheme), tests, bounds)
    if not model.noise_known and model.measured.size <= len(bounds):
        raise ValueError(
            f"{model.measured.size} deflections for {len(bounds)} parameters: must be more, or "
            "come with their noise"
        )
    first = model.place({} if start is None else start)
    found = least_squares(
        model.residuals,
        first,
        jac=model.jacobian,
        bounds=(0.0, 1.0),
        ftol=1e-9,
        xtol=1e-9,
        gtol=1e-9,
    )
    fit = _judge(model, first, found.x)
    # Along what is not determined, there may be no end.
    if not (found.success or fit.undetermined):
        raise SolverError(f"the fit did not converge in {found.nfev} steps, at {fit.values}")
    return fit


@dataclass(eq=False)
class _Model:
    """Residuals over noise, of parameters scaled by their bounds."""

    base: Scenario
    tests: tuple[Measurement, ...]
    bounds: dict[str, Bounds]
    evaluations: int = 0

    def __post_init__(self) -> None:
        """Find the fields, and see whether they take what lies between their bounds."""
        if len(self.base.road.sections) != 1:
            raise ValueError(f"road has {len(self.base.road.sections)} sections: must have one")
        for name, bounds in self.bounds.items():
            self.field(name)
            for value in bounds:
                self.road({name: value})

    @cached_property
    def fields(self) -> dict[str, Field]:
        return {field.name: field for field in resolve(self.base, list(self.bounds))}

    def field(self, name: str) -> float:
        """Value of a field of the pavement, or of its asphalt."""
        value: Any = self.base.road.sections[0]
        head, *path = self.fields[name].path.split(".")
        if head == "road" and path[0] == "pavement":
            for part in path:
                value = getattr(value, part)
        if not isinstance(value, float):
            raise ValueError(
                f"{name} is no number of the pavement or its asphalt: it is no parameter"
            )
        return value

    def road(self, values: Mapping[str, float]) -> Road:
        """Build the road with other values."""
        changes = {self.fields[name].inner: value for name, value in values.items()}
        road: Road = changed_part(self.base, "road", changes)
        return road

    @cached_property
    def noise_known(self) -> bool:
        return self.tests[0].noise is not None

    @cached_property
    def measured(self) -> Array:
        return np.concatenate([test.deflection.ravel() for test in self.tests])

    @cached_property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.measured**2)))

    @cached_property
    def noise(self) -> Array:
        """Noise of each deflection; where it is not known, a size that they all have."""
        given = [test.noise.ravel() for test in self.tests if test.noise is not None]
        return np.concatenate(given) if given else np.full(self.measured.size, self.rms)

    def place(self, values: Mapping[str, float]) -> Array:
        """Start of the fit, scaled."""
        if not isinstance(values, Mapping):
            raise ValueError(f"start = {values!r}: must be a mapping of parameters to numbers")
        unknown = [f"{name}" for name in values if name not in self.bounds]
        if unknown:
            raise ValueError(f"start has {', '.join(unknown)}: not among the parameters")
        scaled = []
        for name, (low, high) in self.bounds.items():
            value = finite_number(f"start of {name}", values.get(name, self.field(name)))
            if not low <= value <= high:
                raise ValueError(
                    f"{name} starts at {value:g}: must be within its bounds, {low:g} to {high:g}; "
                    "change them or give start"
                )
            scaled.append(self.bounds[name].scaled(value))
        return np.array(scaled)

    def values(self, scaled: Array) -> dict[str, float]:
        pairs = zip(self.bounds.items(), scaled, strict=True)
        return {name: bounds.value(float(place)) for (name, bounds), place in pairs}

    def predict(self, scaled: Array) -> tuple[Array, ...]:
        road = self.road(self.values(scaled))
        self.evaluations += 1
        return tuple(test.predict(road, self.base.scheme) for test in self.tests)

    def residuals(self, scaled: Array) -> Array:
        with listening():  # laws are left on the way to the solution; there it is warned of
            fitted = np.concatenate([part.ravel() for part in self.predict(scaled)])
        return (fitted - self.measured) / self.noise

    def jacobian(self, scaled: Array) -> Array:
        columns = []
        for number in range(scaled.size):
            ahead, behind = scaled.copy(), scaled.copy()
            ahead[number] = min(1.0, scaled[number] + STEP)
            behind[number] = max(0.0, scaled[number] - STEP)
            rise = self.residuals(ahead) - self.residuals(behind)
            columns.append(rise / (ahead[number] - behind[number]))
        return np.stack(columns, axis=1)


def _judge(model: _Model, first: Array, solution: Array) -> Calibration:
    """Work out how well the measurements tell the solution."""
    names = list(model.bounds)
    values = model.values(solution)
    fitted = model.predict(solution)
    residuals = model.residuals(solution)
    freedom = max(0, residuals.size - solution.size)
    square = float(residuals @ residuals) / max(1, freedom)
    scale = 1.0 if model.noise_known else float(np.sqrt(square))
    told = _Told.of(model.jacobian(solution), scale)
    rates = np.array(
        [bounds.rate(place) for bounds, place in zip(model.bounds.values(), solution, strict=True)]
    )
    sentences = tuple(
        _sentence(model, values, rates * direction, members)
        for direction, members in zip(told.directions, told.members, strict=True)
        if members.any()
    )
    stopped = np.minimum(solution, 1.0 - solution) < STEP
    at_bound = tuple(name for name, at in zip(names, stopped & ~told.lost, strict=True) if at)
    for sentence in sentences:
        warnings.warn(sentence, CalibrationWarning, stacklevel=3)
    if at_bound:
        warnings.warn(
            f"{', '.join(at_bound)} ended at a bound: the measurements would have it beyond, and "
            "its errors do not hold",
            CalibrationWarning,
            stacklevel=3,
        )

    def labelled(matrix: Array) -> xr.DataArray:
        return xr.DataArray(matrix, {"parameter": names, "other": names}, ("parameter", "other"))

    return Calibration(
        road=model.road(values),
        bounds=model.bounds,
        start=model.values(first),
        values=values,
        covariance=labelled(told.covariance * np.outer(rates, rates)),
        correlation=labelled(told.correlation),
        measurements=model.tests,
        fitted=fitted,
        noise_known=model.noise_known,
        noise=tuple(
            np.full(test.deflection.shape, scale * model.rms) if test.noise is None else test.noise
            for test in model.tests
        ),
        misfit=square if model.noise_known else 1.0,
        degrees_of_freedom=freedom,
        undetermined=sentences,
        at_bound=at_bound,
        evaluations=model.evaluations,
    )


class _Told(NamedTuple):
    """What a Jacobian tells of the parameters, which are scaled by their bounds."""

    directions: Array
    """Rows of combinations of parameters whose errors are independent."""
    members: NDArray[np.bool_]
    """Rows of the parameters that each combination leaves undetermined."""
    lost: NDArray[np.bool_]
    """Parameters that some combination leaves undetermined."""
    covariance: Array
    correlation: Array

    @classmethod
    def of(cls, jacobian: Array, scale: float) -> _Told:
        """Judge a Jacobian of residuals whose standard deviation is `scale`."""
        count = jacobian.shape[1]
        _, singular, directions = np.linalg.svd(jacobian)
        singular = np.append(singular, np.zeros(count - singular.size))
        known = singular > RANK * singular[0]
        inverse = np.divide(1.0, singular, out=np.zeros(count), where=known)
        parts = np.abs(directions)
        reach = np.where(
            known[:, np.newaxis],
            parts * (scale * inverse)[:, np.newaxis],
            np.where(parts > MEMBER, np.inf, 0.0),
        )
        members = reach > LOOSEST
        lost = np.asarray(members.any(axis=0))
        # A parameter that is lost goes where the combinations that lose it go, all of them alike.
        loose = directions[members.any(axis=1)]
        free = loose.T @ loose
        weighed = directions.T * inverse
        unit = weighed @ weighed.T
        both = np.outer(lost, lost)
        unit[both] = free[both]
        deviation = np.sqrt(np.diag(unit))
        correlation = unit / np.outer(deviation, deviation)
        correlation[lost[:, np.newaxis] != lost] = 0.0
        covariance = scale**2 * (weighed @ weighed.T)
        together = both & (np.abs(correlation) > MEMBER)
        covariance[together] = np.copysign(np.inf, correlation[together])
        return cls(directions, members, lost, covariance, correlation)


def _sentence(
    model: _Model, values: Mapping[str, float], change: Array, members: NDArray[np.bool_]
) -> str:
    """Say which combination of parameters the measurements do not tell."""
    names = [name for name, member in zip(values, members, strict=True) if member]
    if len(names) == 1:
        low, high = model.bounds[names[0]]
        return f"the measurements do not determine {names[0]} between {low:g} and {high:g}"
    # Of the size of a percent of the parameter that the combination changes most.
    changes = dict(zip(values, change.tolist(), strict=True))
    part = {
        name: changes[name] / (values[name] if bounds.logarithmic else bounds.width)
        for name, bounds in model.bounds.items()
    }
    lead = max(names, key=lambda name: abs(part[name]))
    listed = [
        f"{name} {part[name] / part[lead]:+.2g} %"
        if model.bounds[name].logarithmic
        else f"{name} {0.01 * changes[name] / part[lead]:+.2g}"
        for name in names
    ]
    return (
        f"the measurements do not tell {', '.join(names[:-1])} and {names[-1]} apart: together, "
        f"{', '.join(listed)} change them by less than their noise"
    )


def _check_measurements(
    measurements: Measurement | Sequence[Measurement],
) -> tuple[Measurement, ...]:
    tests = tuple(measurements) if isinstance(measurements, Sequence) else (measurements,)
    if not tests:
        raise ValueError("there are no measurements: must be at least one")
    for test in tests:
        if not isinstance(test, ForceDeflection | DeflectionHistory):
            raise ValueError(
                f"measurements has a {type(test).__name__}: must be ForceDeflection or "
                "DeflectionHistory"
            )
    known = [test.noise is not None for test in tests]
    if any(known) and not all(known):
        raise ValueError(
            f"{tests[known.index(False)].name} comes without its noise, but others with it: give "
            "it for all measurements or for none"
        )
    return tests
