"""The base of every input model: frozen, strict about names and finite numbers."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]


class Model(BaseModel):
    """A frozen set of checked inputs.

    The Python API, the TOML scenario file, validation and its messages all come from the fields of
    such models. A field that does not exist, a value out of range, a NaN or an infinity is a
    ``pydantic.ValidationError``, which is a `ValueError` that names every offending field.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True
    )
