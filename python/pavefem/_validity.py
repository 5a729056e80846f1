"""Warnings that an empirical law is left: given to the user, or to a study that asks for them."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from pavefem.errors import ValidityWarning

_HEARD: ContextVar[list[str] | None] = ContextVar("heard", default=None)
"""Of each thread its own, which the filters of `warnings` are not."""


def warn_validity(message: str, stacklevel: int = 1) -> None:
    """Warn of a law used outside its range; `stacklevel` counts from the caller."""
    heard = _HEARD.get()
    if heard is None:
        warnings.warn(message, ValidityWarning, stacklevel=stacklevel + 1)
    elif message not in heard:
        heard.append(message)


@contextmanager
def listening() -> Iterator[list[str]]:
    """Collect the messages of this thread, each once, in place of warnings."""
    heard: list[str] = []
    token = _HEARD.set(heard)
    try:
        yield heard
    finally:
        _HEARD.reset(token)
