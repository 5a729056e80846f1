"""What pavefem raises and warns, beyond the built-in exceptions."""

from __future__ import annotations

import os


class PavefemError(Exception):
    """Base of every exception that pavefem defines."""


class SolverError(PavefemError, RuntimeError):
    """The numerics failed: a singular matrix, or a response that is no longer finite."""


class SweepError(PavefemError, RuntimeError):
    """The workers of a sweep are gone, or a cluster gave up; what was kept, the message says."""


class FormatError(PavefemError, ValueError):
    """A file does not hold what its format, or the options given with it, call for.

    Parameters
    ----------
    message : str
        What was found and what is allowed.
    path : str or os.PathLike, optional
        The file.
    line : int, optional
        Line of a text file, counted from 1.
    byte : int, optional
        Offset in a binary file, counted from 0.

    Attributes
    ----------
    message, path, line, byte
        As given; `path` is a string, and what was not given is None.
    """

    def __init__(
        self,
        message: str,
        *,
        path: str | os.PathLike[str] | None = None,
        line: int | None = None,
        byte: int | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.path = None if path is None else os.fspath(path)
        self.line = line
        self.byte = byte

    def __str__(self) -> str:
        place = [
            *([self.path] if self.path is not None else []),
            *([f"line {self.line}"] if self.line is not None else []),
            *([f"byte {self.byte}"] if self.byte is not None else []),
        ]
        return f"{', '.join(place)}: {self.message}" if place else self.message


class ValidityWarning(UserWarning):
    """An empirical law is used outside the range it was fitted on, or a step is too coarse."""


class CalibrationWarning(UserWarning):
    """Measurements do not tell all parameters that are fitted to them."""
