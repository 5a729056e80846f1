"""The base of every input model: frozen, strict about names and finite numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from inspect import cleandoc
from textwrap import indent
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, validate_call


def _number(value: Any) -> Any:
    """Take numpy's numbers as Python's; refuse what only looks like a number."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool | str | bytes):
        raise ValueError("must be a number")
    return value


def whole_number(name: str, value: int) -> int:
    """Return a count of at least 1, or raise a ValueError that names it."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not whole or not 1 <= value < 2**63:
        raise ValueError(f"{name} = {value!r}: must be a whole number, at least 1, below 2**63")
    return int(value)


def finite_number(name: str, value: Any) -> float:
    """Return a finite number, or raise a ValueError that names it."""
    if isinstance(value, np.ndarray) and value.ndim == 0 and not np.ma.is_masked(value):
        value = value.item()
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool):
        with suppress(OverflowError):
            number = float(value)
            if math.isfinite(number):
                return number
    raise ValueError(f"{name} = {value!r}: must be a finite number")


def two_numbers(name: str, pair: Any) -> tuple[float, float]:
    """Return two finite numbers, or raise a ValueError that names them."""
    if not isinstance(pair, list | tuple | np.ndarray) or len(pair) != 2:
        raise ValueError(f"{name} = {pair!r}: must be two numbers")
    low, high = pair
    return finite_number(name, low), finite_number(name, high)


Number = Annotated[float, BeforeValidator(_number)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
VoidsPercent = Annotated[Number, Field(gt=3, lt=100)]

checked = validate_call(config=ConfigDict(allow_inf_nan=False))
"""Decorator of a function: its arguments are checked as the fields of a model are."""


class Model(BaseModel):
    """A frozen set of checked inputs.

    The Python API, the TOML scenario file, validation and its messages all come from the fields of
    such models. A field that does not exist, a value out of range, a NaN or an infinity is a
    ``pydantic.ValidationError``, which is a `ValueError` that names every offending field.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True
    )

    @classmethod
    def __pydantic_init_subclass__(cls, **options: Any) -> None:
        """Complete the docstring by what stands beneath each field."""
        super().__pydantic_init_subclass__(**options)
        if cls.__doc__ is None or not cls.model_fields or "Parameters\n" in cls.__doc__:
            return
        fields = (
            f"{name}{'' if field.is_required() else ', optional'}\n"
            + indent(field.description or "", "    ")
            for name, field in cls.model_fields.items()
        )
        heading = "Parameters\n----------\n"
        cls.__doc__ = f"{cleandoc(cls.__doc__)}\n\n{heading}" + "\n".join(fields)

    # What a model derives from its fields is cached beside them; it is no part of the model.

    def __iter__(self) -> Iterator[tuple[str, Any]]:  # type: ignore[override]
        """Yield the fields by name."""
        return ((name, getattr(self, name)) for name in type(self).model_fields)

    def __getstate__(self) -> dict[Any, Any]:
        return super().__getstate__() | {"__dict__": dict(self)}

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        return self

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Build the model anew with some fields changed, checked as at first."""
        return type(self)(**dict(self) | dict(update or {}))
