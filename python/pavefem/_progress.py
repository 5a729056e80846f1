"""A progress bar that appears only when the work takes over a second."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import Progress

DELAY = 1.0


@contextmanager
def progress_bar(show: bool, what: str) -> Iterator[Callable[..., None] | None]:
    """Yield a callback for the steps done and in all, or None if nothing is to be shown.

    It may also be told what to say in place of `what`.
    """
    if not show:
        yield None
        return
    started = time.monotonic()
    bar: Progress | None = None

    def report(done: int, total: int, now: str = what) -> None:
        nonlocal bar
        if bar is None and time.monotonic() - started > DELAY:
            bar = Progress(transient=True)
            bar.start()
            bar.add_task(what, total=total)
        if bar is not None:
            bar.update(bar.task_ids[0], completed=done, total=total, description=now)

    try:
        yield report
    finally:
        if bar is not None:
            bar.stop()
