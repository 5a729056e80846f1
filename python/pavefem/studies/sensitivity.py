"""Which parameter matters: one at a time, by Morris' effects, and by Sobol's indices.

Parameters are fields of a scenario, each between two values, all of them alike likely. The methods
are those of SALib, which the extra ``sensitivity`` installs.
"""

from __future__ import annotations

import importlib
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from pavefem._model import finite_number, whole_number
from pavefem.errors import ValidityWarning
from pavefem.scenario import Scenario
from pavefem.studies.evaluation import evaluate
from pavefem.studies.fields import checked_bounds, resolve
from pavefem.studies.outputs import Outputs, outputs_of

if TYPE_CHECKING:
    from distributed import Client

Array = NDArray[np.float64]
Function = Callable[[Array], ArrayLike]
Ranges = Mapping[str, tuple[float, float]]

CONSTANT: Final = 1e-9
"""Spread of an output, as a part of its size, up to which it does not vary."""


def tornado(
    model: Scenario | Mapping[str, Any] | Function,
    parameters: Ranges,
    outputs: Outputs | None = None,
    *,
    executor: Executor | Client | None = None,
    workers: int | None = None,
    store: str | os.PathLike[str] | None = None,
    progress: bool = False,
) -> xr.Dataset:
    """Change one parameter at a time, from the middle of all ranges to both its ends.

    Parameters
    ----------
    model, parameters, outputs, executor, workers, store, progress
        As of `sobol`.

    Returns
    -------
    xarray.Dataset
        `middle` of (output), with all parameters in the middle of their ranges; `at_low` and
        `at_high` of (output, parameter), with one of them at an end. `plotting.plot_tornado`
        draws it.

    Raises
    ------
    ValueError
        As of `sobol`.

    Examples
    --------
    >>> found = tornado(lambda x: x[:, 0] + 2.0 * x[:, 1], {"a": (0.0, 1.0), "b": (0.0, 1.0)})
    >>> (found["at_high"] - found["at_low"]).to_numpy()
    array([[1., 2.]])
    """
    study = _Study.of(model, parameters, outputs)
    middle = study.ranges.mean(axis=1)
    points = np.tile(middle, (1 + 2 * middle.size, 1))
    ends = points[1:].reshape(2, middle.size, middle.size)
    for end, values in zip(ends, study.ranges.T, strict=True):
        np.fill_diagonal(end, values)
    answers = _all_of(study, points, study.run(points, executor, workers, store, progress))
    _check_varies(study, answers)
    at_low, at_high = answers[1:].reshape(2, middle.size, -1)
    return study.dataset("One parameter at a time").assign(
        middle=("output", answers[0]),
        at_low=(("output", "parameter"), at_low.T),
        at_high=(("output", "parameter"), at_high.T),
    )


def morris(
    model: Scenario | Mapping[str, Any] | Function,
    parameters: Ranges,
    outputs: Outputs | None = None,
    *,
    trajectories: int = 50,
    levels: int = 4,
    level: float = 0.95,
    seed: int = 0,
    executor: Executor | Client | None = None,
    workers: int | None = None,
    store: str | os.PathLike[str] | None = None,
    progress: bool = False,
) -> xr.Dataset:
    """Screen parameters by Morris' elementary effects.

    An effect is the change of an output for a step in one parameter, in units of its range. Runs
    are `trajectories` times one more than parameters, far fewer than `sobol` takes.

    Parameters
    ----------
    model, parameters, outputs
        As of `sobol`.
    trajectories : int
        Number of walks through the ranges, in each of which every parameter takes one step.
    levels : int
        Values that each parameter takes, an even number.
    level, seed, executor, workers, store, progress
        As of `sobol`.

    Returns
    -------
    xarray.Dataset
        Of (output, parameter): `mu`, the mean effect; `mu_star`, the mean magnitude, with
        `mu_star_confidence`, half of its confidence interval; `sigma`, the standard deviation,
        which is large where the effect depends on the other parameters or is curved. Runs as of
        `sobol`. `plotting.plot_morris` draws it.

    Raises
    ------
    ImportError
        If SALib is not installed.
    ValueError
        As of `sobol`; if fewer than two trajectories ran whole.

    Warns
    -----
    UserWarning
        If runs failed: their trajectories are left out.
    ValidityWarning
        As of `sobol`.

    Notes
    -----
    Morris, Technometrics 33 (1991), 161-174; Campolongo, Cariboni and Saltelli, Environmental
    Modelling and Software 22 (2007), 1509-1518, for mu*.
    """
    sample, analyze = _salib("sample.morris"), _salib("analyze.morris")
    study = _Study.of(model, parameters, outputs)
    trajectories = whole_number("trajectories", trajectories)
    levels = whole_number("levels", levels)
    if trajectories < 2 or levels % 2:
        raise ValueError(
            f"trajectories = {trajectories} and levels = {levels}: must be at least 2, and even"
        )
    _check_level(level)
    seed_of_points, seed_of_level = _seeds(seed)
    problem = study.problem
    points = sample.sample(problem, trajectories, num_levels=levels, seed=seed_of_points)
    answers, errors = study.run(points, executor, workers, store, progress)
    failed = np.array([bool(error) for error in errors]).reshape(trajectories, -1)
    whole = failed.sum(axis=1) == 0
    if not whole.all():
        if whole.sum() < 2:
            raise ValueError(f"{study.failures(points, errors)}: narrow the ranges")
        warnings.warn(
            f"{study.failures(points, errors)}: {trajectories - whole.sum()} of {trajectories} "
            "trajectories are left out",
            UserWarning,
            stacklevel=2,
        )
    kept = np.repeat(whole, len(study.names) + 1)
    points, answers = points[kept], answers[kept]
    _check_varies(study, answers)
    found = [
        analyze.analyze(
            problem, points, column, num_levels=levels, conf_level=level, seed=seed_of_level
        )
        for column in answers.T
    ]
    columns = {
        "mu": ("mu", "mean effect of a whole range"),
        "mu_star": ("mu_star", "mean magnitude of the effect of a whole range"),
        "mu_star_confidence": ("mu_star_conf", "half of the confidence interval of mu*"),
        "sigma": ("sigma", "standard deviation of the effect"),
    }
    return study.dataset("Morris' elementary effects", level, points, answers).assign(
        {
            name: (
                ("output", "parameter"),
                np.array([np.asarray(effects[key], dtype=np.float64) for effects in found]),
                {"long_name": text},
            )
            for name, (key, text) in columns.items()
        }
    )


def sobol(
    model: Scenario | Mapping[str, Any] | Function,
    parameters: Ranges,
    outputs: Outputs | None = None,
    *,
    samples: int = 1024,
    second_order: bool = False,
    level: float = 0.95,
    seed: int = 0,
    executor: Executor | Client | None = None,
    workers: int | None = None,
    store: str | os.PathLike[str] | None = None,
    progress: bool = False,
) -> xr.Dataset:
    """Part the variance of outputs among parameters by Sobol's indices.

    The first-order index of a parameter is the part of the variance that goes if it becomes known;
    its total index, the part that is left if all others become known. Where they differ, it acts
    together with others. With n parameters, runs are ``samples (n + 2)``, or ``samples (2 n + 2)``
    with the indices of pairs.

    Parameters
    ----------
    model : Scenario or mapping, or callable
        What the points differ from, or its fields by name; or a function of an array (points,
        parameters) that gives an array (points) or (points, outputs).
    parameters : mapping of str to (float, float)
        Range of each parameter, all values of which are alike likely: fields of the scenario, as of
        `sweep` (``temperature_c``, ``vma``, ``speed_kmh``, ``axle_spacing``, ``payload``...), and
        ``iri``, m/km, to which the scenario's profile is scaled.
    outputs : str, callable, sequence or mapping
        As of `sweep`, the largest deflection by default; for a function, the names of its outputs.
    samples : int
        Number of points of the Sobol sequence, a power of 2.
    second_order : bool
        Whether to find the indices of pairs, too.
    level : float
        Level of the confidence intervals, which are from resampling.
    seed : int
        Seed of the scrambled sequence and of the resampling.
    executor, workers, store, progress
        As of `sweep`; a function is called at once with all points.

    Returns
    -------
    xarray.Dataset
        Of (output, parameter): `first_order` and `total`, and half of their confidence intervals,
        `first_order_confidence` and `total_confidence`; of (output, pair): `second_order` and
        `second_order_confidence`, if asked for. Of all runs, `points` (run, parameter) and
        `answers` (run, output). `plotting.plot_sobol` draws it.

    Raises
    ------
    ImportError
        If SALib is not installed.
    ValueError
        If a parameter or output is not known, a range is not in order, or `samples` is no power of
        2; if an output is constant; if a run fails, as all are needed: the message says how many,
        and why and where the first did.

    Warns
    -----
    ValidityWarning
        If runs use an empirical law outside its range.

    Notes
    -----
    Saltelli's sampling and estimators of Saltelli et al., Computer Physics Communications 181
    (2010), 259-270, and 145 (2002), 280-297, for pairs.
    """
    sample, analyze = _salib("sample.sobol"), _salib("analyze.sobol")
    study = _Study.of(model, parameters, outputs)
    samples = whole_number("samples", samples)
    if samples < 2 or samples & (samples - 1):
        raise ValueError(f"samples = {samples}: must be a power of 2, as 512, 1024 or 2048")
    _check_level(level)
    seed_of_points, seed_of_level = _seeds(seed)
    problem = study.problem
    points = sample.sample(problem, samples, calc_second_order=second_order, seed=seed_of_points)
    answers = _all_of(study, points, study.run(points, executor, workers, store, progress))
    _check_varies(study, answers)
    found = [
        analyze.analyze(
            problem, column, calc_second_order=second_order, conf_level=level, seed=seed_of_level
        )
        for column in answers.T
    ]
    each, pairs = ("output", "parameter"), [*combinations(range(len(study.names)), 2)]
    columns: dict[str, Any] = {
        name: (each, np.array([indices[key] for indices in found]), {"long_name": text})
        for name, key, text in (
            ("first_order", "S1", "part of the variance that goes if the parameter is known"),
            ("first_order_confidence", "S1_conf", "half of its confidence interval"),
            ("total", "ST", "part of the variance that is left if all others are known"),
            ("total_confidence", "ST_conf", "half of its confidence interval"),
        )
    }
    if second_order:
        at = tuple(np.array(pairs, dtype=np.intp).reshape(-1, 2).T)
        columns["pair"] = [f"{study.names[i]} x {study.names[j]}" for i, j in pairs]
        for name, key in (("second_order", "S2"), ("second_order_confidence", "S2_conf")):
            columns[name] = ("output", "pair"), np.array([indices[key][at] for indices in found])
    return study.dataset("Sobol's indices", level, points, answers).assign(columns)


@dataclass(frozen=True, eq=False)
class _Study:
    """Parameters between their ends, and outputs of a model."""

    model: Scenario | Function
    names: list[str]
    units: list[str]
    ranges: Array
    outputs: Outputs
    output_names: list[str]
    output_units: list[str]

    @classmethod
    def of(
        cls,
        model: Scenario | Mapping[str, Any] | Function,
        parameters: Ranges,
        outputs: Outputs | None,
    ) -> _Study:
        if isinstance(model, Mapping):
            model = Scenario.model_validate(model)
        bounds = checked_bounds(parameters)
        names, ranges = [*bounds], np.array([*bounds.values()])
        if isinstance(model, Scenario):
            outputs = "max_deflection" if outputs is None else outputs
            found = outputs_of(outputs)
            units = [field.units or "" for field in resolve(model, names)]
            of_outputs = [output.attributes.get("units", "") for output in found]
            output_names = [output.name for output in found]
            return cls(model, names, units, ranges, outputs, output_names, of_outputs)
        if not callable(model):
            raise ValueError(
                f"model is a {type(model).__name__}: must be a Scenario, its fields or a function"
            )
        if outputs is None:
            outputs = "output"
        listed = [*outputs] if isinstance(outputs, list | tuple) else [outputs]
        output_names = [name for name in listed if isinstance(name, str) and name]
        if not output_names or len(set(output_names)) < len(listed):
            raise ValueError(f"outputs = {outputs!r}: must be names, for a function")
        none = [""] * len(names)
        return cls(model, names, none, ranges, outputs, output_names, [""] * len(output_names))

    @property
    def problem(self) -> dict[str, Any]:
        """The parameters as SALib has them."""
        return {
            "num_vars": len(self.names),
            "names": self.names,
            "bounds": self.ranges.tolist(),
        }

    def run(
        self,
        points: Array,
        executor: Executor | Client | None,
        workers: int | None,
        store: str | os.PathLike[str] | None,
        progress: bool,
    ) -> tuple[Array, Sequence[str]]:
        """Find the outputs of all points, and why some failed."""
        if not isinstance(self.model, Scenario):
            given = {"executor": executor, "workers": workers, "store": store}
            beyond = [name for name, value in given.items() if value is not None]
            if beyond:
                raise ValueError(
                    f"{' and '.join(beyond)}: for a scenario; a function is called at once with "
                    "all points, and what it gives is not kept"
                )
            answers = np.ma.asarray(self.model(points.copy()), np.float64)
            values = np.asarray(np.ma.filled(answers, np.nan))
            if values.shape == (len(points),):
                values = values[:, np.newaxis]
            if values.shape != (len(points), len(self.output_names)):
                raise ValueError(
                    f"the function gave an array of shape {values.shape}: must be "
                    f"({len(points)}, {len(self.output_names)}), of points and outputs"
                )
            finite = np.isfinite(values).sum(axis=1) == values.shape[1]
            return values, np.where(finite, "", "not finite").tolist()
        found = evaluate(
            self.model,
            self.names,
            points,
            self.outputs,
            executor=executor,
            workers=workers,
            store=store,
            progress=progress,
        )
        left = [message for message in found.warnings if message]
        if left:
            warnings.warn(
                f"{len(left)} of {len(points)} runs use a law outside its range, as in {left[0]!r}",
                ValidityWarning,
                stacklevel=3,
            )
        return found.values, found.errors

    def failures(self, points: Array, errors: Sequence[str]) -> str:
        """Say how many runs failed, and where and why the first did."""
        first = next(number for number, error in enumerate(errors) if error)
        values = zip(self.names, points[first], strict=True)
        at = ", ".join(f"{name} = {value:g}" for name, value in values)
        count = sum(bool(error) for error in errors)
        return f"{count} of {len(errors)} runs failed, the first at {at}: {errors[first]}"

    def dataset(
        self,
        title: str,
        level: float | None = None,
        points: Array | None = None,
        answers: Array | None = None,
    ) -> xr.Dataset:
        """Begin the answer: what the study is of, and its runs."""
        dataset = xr.Dataset(
            coords={
                "parameter": self.names,
                "units": ("parameter", self.units),
                "low": ("parameter", self.ranges[:, 0]),
                "high": ("parameter", self.ranges[:, 1]),
                "output": self.output_names,
                "output_units": ("output", self.output_units),
            },
            attrs={"title": title} | ({} if level is None else {"level": level}),
        )
        if points is not None:
            dataset["points"] = ("run", "parameter"), points
            dataset["answers"] = ("run", "output"), answers
        return dataset


def _all_of(study: _Study, points: Array, found: tuple[Array, Sequence[str]]) -> Array:
    """Take the outputs of runs of which none may fail."""
    answers, errors = found
    if any(errors):
        raise ValueError(f"{study.failures(points, errors)}: all are needed, so narrow the ranges")
    return answers


def _check_varies(study: _Study, answers: Array) -> None:
    for name, column in zip(study.output_names, answers.T, strict=True):
        if np.ptp(column) <= CONSTANT * np.abs(column).max():
            raise ValueError(
                f"output {name} is the same, {column[0]:g}, in all {column.size} runs: no "
                "parameter matters to it; widen the ranges, or choose others or another output"
            )


def _check_level(level: float) -> None:
    if not 0.0 < finite_number("level", level) < 1.0:
        raise ValueError(f"level = {level!r}: must be between 0 and 1")


def _seeds(seed: int) -> tuple[int, int]:
    """Seeds of the points and of the resampling; the latter is not 0, which SALib ignores."""
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise ValueError(f"seed = {seed!r}: must be a whole number, not below 0")
    return int(seed), int(seed) + 1


def _salib(name: str) -> Any:
    try:
        return importlib.import_module(f"SALib.{name}")
    except ImportError as error:
        raise ImportError(
            f'this needs SALib ({error}): pip install "pavefem[sensitivity]"'
        ) from None
