"""Scalar answers of a run, by name or by a function of the user's."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import partial
from operator import attrgetter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pavefem.result import Result
from pavefem.simulate import Keep

Function = Callable[[Result], Any]
_ByAxle = Callable[[Result], NDArray[np.float64]]
Outputs = str | Function | Sequence[str | Function] | Mapping[str, str | Function]


@dataclass(frozen=True)
class Output:
    """A scalar answer of a run.

    Attributes
    ----------
    name : str
        What the study calls it.
    function : callable
        Makes it of a `Result`.
    attributes : mapping of str
        Its units and long name, as far as they are known.
    keep : sequence of str, "envelope" or None
        The histories that `function` reads; None if it is the user's, who says so elsewhere.
    """

    name: str
    function: Function
    attributes: Mapping[str, str]
    keep: Keep | None

    def of(self, result: Result) -> float:
        """Value of a run, finite, or a ValueError."""
        value = self.function(result)
        if np.ndim(value) != 0:
            raise ValueError(f"{self.name} has the shape {np.shape(value)}: must be one number")
        if np.iscomplexobj(value):
            raise ValueError(f"{self.name} = {value}: must be real")
        number = float(value)
        if not math.isfinite(number):
            raise ValueError(f"{self.name} = {number:g}: must be finite")
        return number


def _dlc(result: Result) -> NDArray[np.float64]:
    """As `metrics.dlc`, whose labels take as long as a run."""
    forces = result.forces
    assert forces is not None  # the output says what to keep
    spread: NDArray[np.float64] = forces.force.std(axis=0)
    return spread / forces.static_loads


def _max_force(result: Result) -> NDArray[np.float64]:
    return result.axles.highest


def _min_force(result: Result) -> NDArray[np.float64]:
    return result.axles.lowest


def _of_axle(axle: int, values: _ByAxle, result: Result) -> float:
    """One axle's value of a quantity that all axles have."""
    found = values(result)
    if axle > found.size:
        raise ValueError(f"there is no axle {axle}: the vehicle has {found.size}")
    return float(found[axle - 1])


def _most(values: _ByAxle, result: Result) -> float:
    return float(values(result).max())


def _least(values: _ByAxle, result: Result) -> float:
    return float(values(result).min())


_OF_RUN: Final = {
    "max_deflection": "largest deflection",
    "mid_deflection": "largest deflection at mid-length",
    "rebound": "largest rebound",
}
"""Attributes of a result, m."""
_OF_AXLES: Final[Mapping[str, tuple[_ByAxle, Any, str, str, Keep]]] = {
    "dlc": (_dlc, _most, "1", "dynamic load coefficient", ("tire_force",)),
    "max_force": (_max_force, _most, "N", "largest tire force", "envelope"),
    "min_force": (_min_force, _least, "N", "smallest tire force", "envelope"),
}

NAMES: Final = (*_OF_RUN, *_OF_AXLES, *(f"{name}_1" for name in _OF_AXLES))
"""Outputs that have a name; any number of an axle may stand in place of the 1."""


def outputs_of(outputs: Outputs) -> tuple[Output, ...]:
    """Find outputs by their names, or by the names that the user gives to functions.

    Raises
    ------
    ValueError
        If there is none, a name is not known or stands for two, or a function has no name.
    """
    if isinstance(outputs, Mapping):
        found = [_output(what, name) for name, what in outputs.items()]
    elif isinstance(outputs, str) or callable(outputs):
        found = [_output(outputs)]
    elif isinstance(outputs, Sequence):
        found = [_output(what) for what in outputs]
    else:
        raise ValueError(f"outputs = {outputs!r}: must be names, functions, or a mapping to them")
    names = [output.name for output in found]
    if not names or len(set(names)) < len(names):
        raise ValueError(f"outputs has {names}: must be one or more, each with a name of its own")
    return tuple(found)


def _output(what: str | Function, name: str | None = None) -> Output:
    if name is not None and not (isinstance(name, str) and name):
        raise ValueError(f"outputs has the name {name!r}: must be text")
    if callable(what):
        own = getattr(what, "__name__", None) if name is None else name
        if not isinstance(own, str) or not own.isidentifier():
            raise ValueError(
                f"output {what!r} has no name to call it by: give outputs={{name: function}}"
            )
        return Output(own, what, {}, None)
    if isinstance(what, str):
        named = name or what
        if what in _OF_RUN:
            attributes = {"units": "m", "long_name": _OF_RUN[what]}
            return Output(named, attrgetter(what), attributes, "envelope")
        split = re.fullmatch(r"(\w+?)(?:_([1-9]\d*))?", what)
        if split is not None and split[1] in _OF_AXLES:
            values, extreme, units, text, keep = _OF_AXLES[split[1]]
            one = extreme if split[2] is None else partial(_of_axle, int(split[2]))
            text += " of any axle" if split[2] is None else f" of axle {split[2]}"
            return Output(named, partial(one, values), {"units": units, "long_name": text}, keep)
    near = get_close_matches(what, NAMES, n=1) if isinstance(what, str) else []
    hint = f" (near it: {near[0]})" if near else ""
    raise ValueError(
        f"output {what!r}{hint}: must be a function of a Result, or one of {', '.join(NAMES)} "
        "(or of another axle)"
    )
