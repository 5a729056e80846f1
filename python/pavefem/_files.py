"""Files that are there as a whole or not at all, and what is told of those of a run."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a file beside `path` to write; it takes the place of `path` if nothing is raised."""
    target = Path(path)
    if target.exists() and not target.is_file():
        raise OSError(f"{target} is a directory or a device; a file is needed")
    if not target.parent.is_dir():
        raise FileNotFoundError(f"no such folder: {target.parent}")
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=".part")
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)  # mkstemp lets only its owner read
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def check_writable(folder: Path) -> None:
    """Make a folder if need be, and see that a file can be made in it, before any work is done."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(f"cannot write to the folder {folder}: {error.strerror or error}") from None


@contextmanager
def telling_what_is_kept(path: Path | None, so_far: Callable[[], str]) -> Iterator[None]:
    """Say of what ends a run early how far it is in its store, if it has one."""

    def kept() -> str:
        return f"{path} holds {so_far()}, and the same call goes on there"

    try:
        yield
    except OSError as error:
        if path is None:
            raise
        told = error.strerror or str(error)
        raise OSError(error.errno, f"{told}; {kept()}", error.filename or path) from error
    except KeyboardInterrupt as error:
        if path is not None:
            error.add_note(kept())
        raise
