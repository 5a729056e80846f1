"""What every command shares: what is printed where, and how mistakes and warnings are said.

Results go to stdout. Everything else is a line on stderr that starts with ``error:`` or
``warning:``. The exit code is 2 where something was wrong, and 130 after Ctrl-C.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final, TypeVar

import typer
from pydantic import ValidationError
from rich.console import Console
from rich.table import Table
from rich.text import Text

from pavefem._tables import explain
from pavefem.errors import PavefemError

console = Console()
errors = Console(stderr=True)

MISTAKES: Final = (PavefemError, ValueError, OSError, MemoryError, ImportError)
"""What a user, a file or the machine can cause, or a library that is not there; anything else is a
bug and has a traceback."""

_Found = TypeVar("_Found")


@contextmanager
def reporting() -> Iterator[None]:
    """Print mistakes and warnings as lines, and turn a mistake into an exit code.

    As a decorator, ``@reporting()``, it does so for a command.
    """
    try:
        with _warnings_printed():
            yield
    except BrokenPipeError:
        raise  # who reads stdout has seen enough: typer ends without a word
    except MISTAKES as error:
        _print_mistake(error)
        raise typer.Exit(2) from None
    except KeyboardInterrupt as error:
        report_error("; ".join(["stopped", *getattr(error, "__notes__", ())]))
        raise typer.Exit(130) from None


def each_file(files: Sequence[Path], work: Callable[[Path], _Found]) -> tuple[list[_Found], bool]:
    """Do the same with every file; one that fails is reported and loses none of the others.

    Returns
    -------
    list, bool
        What was found, and whether a file failed.
    """
    found, failed = [], False
    for path in files:
        about = f"{path}: "
        try:
            if not path.exists():
                raise FileNotFoundError(f"{path}: no such file")
            with _warnings_printed(about):
                found.append(work(path))
        except BrokenPipeError:
            raise
        except MISTAKES as error:
            _print_mistake(error, about)
            failed = True
    return found, failed


def print_figures(title: str, figures: dict[str, str]) -> None:
    """Print what there is to know of something, by what it is."""
    table = Table(title=Text(title), show_header=False, title_justify="left")
    for name, value in figures.items():
        table.add_row(Text(name), Text(value))
    console.print(table)


@contextmanager
def _warnings_printed(about: str = "") -> Iterator[None]:
    """Print each warning as one line, and the same one not twice."""
    printed: set[str] = set()

    def show(message: Warning | str, *_: object, **__: object) -> None:
        line = f"warning: {about}{message}"
        if line not in printed:
            errors.print(line, style="yellow", highlight=False, markup=False, soft_wrap=True)
            printed.add(line)

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


def _print_mistake(error: Exception, about: str = "") -> None:
    """Print a line for each thing that was wrong, `about` ahead of what does not name its file."""
    if isinstance(error, ValidationError):
        lines = explain(error)
    elif isinstance(error, MemoryError):
        lines = ["no memory for this: use a shorter road or profile, or a longer time step"]
    elif isinstance(error, OSError) and error.strerror:
        name = "" if error.filename is None else f"{error.filename}: "
        lines = [f"{name}{error.strerror.lower()}"]
    else:
        lines = [str(error)]
    for line in lines:
        named = line.startswith((about, about.replace(": ", ", ")))
        report_error(line if named else about + line)


def report_error(line: str) -> None:
    """Print a line that says what was wrong."""
    errors.print(f"error: {line}", style="red", highlight=False, markup=False, soft_wrap=True)
