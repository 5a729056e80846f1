"""Vehicles that know the call that built them, so that studies can change its arguments."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import wraps
from typing import Any, ParamSpec

from pavefem.vehicle import Vehicle

_P = ParamSpec("_P")


@dataclass(frozen=True)
class Call:
    """A builder and the arguments it was called with.

    Attributes
    ----------
    function : callable
        The builder.
    arguments : mapping of str
        The arguments given, by name.
    """

    function: Callable[..., Vehicle]
    arguments: Mapping[str, Any]

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all arguments that the builder takes."""
        return tuple(inspect.signature(self.function).parameters)

    def __call__(self, **changes: Any) -> Vehicle:
        """Build the vehicle anew, with some arguments changed."""
        return self.function(**dict(self.arguments) | changes)


def builder(function: Callable[_P, Vehicle]) -> Callable[_P, Vehicle]:
    """Make a function's vehicles remember the call, in `Vehicle.made_by`.

    The functions of this package are such builders; this is the decorator for one of your own,
    whose arguments a sweep then changes by their names. All of them must have names.

    Examples
    --------
    >>> import pavefem as pf
    >>> @pf.vehicles.builder
    ... def tipper(load: float = 8000.0) -> pf.Vehicle:
    ...     return pf.vehicles.rigid_truck(suspension="air", payload=load)
    >>> tipper(load=5000.0).made_by.arguments
    {'load': 5000.0}
    """
    signature = inspect.signature(function)
    for parameter in signature.parameters.values():
        if parameter.kind not in (parameter.POSITIONAL_OR_KEYWORD, parameter.KEYWORD_ONLY):
            raise ValueError(
                f"argument {parameter} of {function.__name__}: a builder's arguments must have "
                "names of their own"
            )

    @wraps(function)
    def build(*args: _P.args, **kwargs: _P.kwargs) -> Vehicle:
        vehicle = function(*args, **kwargs)
        if not isinstance(vehicle, Vehicle):
            raise ValueError(f"{function.__name__} made a {type(vehicle).__name__}: not a Vehicle")
        vehicle.remember(Call(build, signature.bind(*args, **kwargs).arguments))
        return vehicle

    return build
