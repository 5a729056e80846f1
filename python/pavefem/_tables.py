"""Tables of a TOML file: read, turned into objects by name, and what is wrong with them told."""

from __future__ import annotations

import inspect
import os
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from pavefem._model import Model
from pavefem.errors import FormatError, SolverError

_Made = TypeVar("_Made")


def read_toml(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a TOML file.

    Raises
    ------
    FormatError
        If it is not TOML.
    OSError
        If it cannot be read.
    """
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise FormatError(f"not a TOML file: {error}", path=path) from None


@contextmanager
def told_of(path: str | os.PathLike[str], whole: str) -> Iterator[None]:
    """Turn what is wrong with the values of a file into a FormatError, a line for each."""
    try:
        yield
    except ValidationError as error:
        found = explain(error, whole)
        noun = "error" if len(found) == 1 else "errors"
        lines = "\n".join(f"  {line}" for line in found)
        raise FormatError(f"{len(found)} {noun} in the {whole}\n{lines}", path=path) from None
    except SolverError as error:
        raise FormatError(f"vehicle: {error}", path=path) from None


def explain(error: ValidationError, whole: str = "scenario") -> list[str]:
    """One line for each wrong value: its key, what is wrong, and what was given."""
    items = error.errors()
    failed = [item["loc"] for item in items]
    lines = []
    for item in items:
        # A sequence whose items all failed counts as empty; the items say what is wrong.
        below = any(loc[: len(item["loc"])] == item["loc"] and loc != item["loc"] for loc in failed)
        if item["type"] == "too_short" and below:
            continue
        key = ".".join(str(part) for part in item["loc"]) or whole
        given = item["input"]
        shown = "" if isinstance(given, Mapping | Model) else f" (given {given!r})"
        lines.append(f"{key}: {item['msg'].removeprefix('Value error, ')}{shown}")
    return lines


def make(key: str, makers: Mapping[str, Callable[..., _Made]], options: dict[str, Any]) -> _Made:
    """Call the maker that `options` names under `key` with the rest of them."""
    name = options.pop(key, None)
    if not isinstance(name, str) or name not in makers:
        raise ValueError(f"{key} = {name!r}: must be one of {list(makers)}")
    known = inspect.signature(makers[name]).parameters
    unknown = [option for option in options if option not in known]
    if unknown:
        raise ValueError(f"{name} has no {', '.join(unknown)}; it has {', '.join(known)}")
    missing = [
        option
        for option, parameter in known.items()
        if parameter.default is inspect.Parameter.empty and option not in options
    ]
    if missing:
        raise ValueError(f"{name} needs {', '.join(missing)}")
    try:
        return makers[name](**options)
    except (TypeError, OverflowError) as error:
        raise ValueError(str(error)) from None
