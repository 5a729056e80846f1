"""Where points are evaluated: in threads, by an executor, or on a Dask cluster; in batches.

A batch takes about a second, by what the one before it took, so that sending it costs little and
little is lost with it. Batches come back in any order; what a point answers depends on none of it.
"""

from __future__ import annotations

import math
import os
import pickle
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Generator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from dataclasses import dataclass
from threading import Event
from typing import Any, Final, NamedTuple, Protocol, Self

from pavefem._model import whole_number
from pavefem.cache import Recent
from pavefem.errors import SweepError
from pavefem.forces import Progress

BATCH: Final = 1.0
"""What a batch should take, s."""
SHORTEST: Final = 0.05
"""What the last batches, made smaller for all workers to end together, should take at least, s."""
CAPACITY_AGE: Final = 2.0
"""How long the number of threads of a cluster is believed, s."""

Points = Sequence[int]
"""Points by their numbers."""

Row = tuple[Any, ...]
"""What a point differs in from others."""


class Plan(Protocol):
    """What all points have in common, and how one is evaluated."""

    def evaluate(self, row: Row, watch: Progress | None = None, /) -> Any:
        """Return what becomes of a point; `watch` may raise to stop."""


class Batch(NamedTuple):
    """What became of some points."""

    outcomes: list[Any]
    """One for each of them, in the order in which they were handed over."""
    seconds: float
    """How long it took."""


def evaluate_batch(plan: Plan, rows: Sequence[Row], watch: Progress | None = None) -> Batch:
    """Evaluate points one after the other; `watch` may raise to stop."""
    started = time.perf_counter()
    outcomes = []
    for done, row in enumerate(rows):
        if watch is not None:
            watch(done, len(rows))
        outcomes.append(plan.evaluate(row, watch))
    return Batch(outcomes, time.perf_counter() - started)


class Pool(ABC):
    """Workers that take batches."""

    def __init__(self, workers: int) -> None:
        self._workers = workers

    def workers(self) -> int:
        """Count the batches that they work on at a time."""
        return self._workers

    @abstractmethod
    def submit(self, rows: Sequence[Row]) -> Future[Batch]:
        """Hand over a batch."""

    @abstractmethod
    def close(self) -> None:
        """Let go; batches that may still be running are no longer wanted."""


def pool_for(executor: Any, plan: Plan, workers: int | None = None) -> Pool:
    """Find out what kind of workers `executor` has.

    Raises
    ------
    ValueError
        If it is none, forks this process, or the plan cannot be sent to it.
    """
    if workers is not None:
        workers = whole_number("workers", workers)
    if executor is None:
        return Threads(plan, workers or _cores())
    if isinstance(executor, ThreadPoolExecutor):
        return Shared(plan, executor, workers or _workers_of(executor))
    if isinstance(executor, Executor):
        _refuse_fork(executor)
        return Sent(Parcel.of(plan), executor, workers or _workers_of(executor))
    # Who has a client has imported its package.
    distributed = sys.modules.get("distributed")
    if distributed is not None and isinstance(executor, distributed.Client):
        return Cluster(plan, executor, workers)
    raise ValueError(
        f"executor is a {type(executor).__name__}: must be a concurrent.futures.Executor, "
        "a dask.distributed.Client, or None for threads of this process"
    )


def dispatch(
    pool: Pool, rows: Sequence[Row], points: Points
) -> Generator[dict[int, Any], None, None]:
    """Have points evaluated, and yield them as they are done, a batch at a time.

    Raises
    ------
    SweepError
        If a batch could not be worked on, once all others that are done have been yielded.
    """
    waiting: dict[Future[Batch], Points] = {}
    start, seconds = 0, math.inf
    try:
        while start < len(points) or waiting:
            workers = pool.workers()
            while start < len(points) and len(waiting) < 2 * workers:
                size = _batch_size(seconds, len(points) - start, workers)
                taken = points[start : start + size]
                start += len(taken)
                waiting[_submitted(pool, [rows[point] for point in taken])] = taken
            failure: Exception | None = None
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                taken = waiting.pop(future)
                try:
                    batch = future.result()
                except Exception as error:
                    failure = error
                    continue
                seconds = batch.seconds / len(taken)
                yield dict(zip(taken, batch.outcomes, strict=True))
            if failure is not None:
                raise _lost(failure) from failure
    finally:
        for future in waiting:
            future.cancel()
        pool.close()


def _submitted(pool: Pool, rows: Sequence[Row]) -> Future[Batch]:
    try:
        return pool.submit(rows)
    except Exception as error:  # the workers broke since, or were shut down
        raise _lost(error) from error


def _lost(error: Exception) -> SweepError:
    return SweepError(f"the executor failed, {type(error).__name__}: {error}".rstrip(": "))


def _batch_size(seconds: float, left: int, workers: int) -> int:
    """Choose the number of points of a batch, where the last ones took so many seconds each."""
    seconds = max(seconds, 1e-6)
    fair = max(left / (2 * workers), SHORTEST / seconds)
    return max(1, int(min(BATCH / seconds, fair)))


def _cores() -> int:
    """Count the cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not everywhere
        return os.cpu_count() or 1


def _workers_of(executor: Executor) -> int:
    """Count the workers of an executor: those of the standard library know, others may not."""
    found = getattr(executor, "_max_workers", None)
    return found if isinstance(found, int) and found > 0 else _cores()


def _refuse_fork(executor: Executor) -> None:
    if isinstance(executor, ProcessPoolExecutor):
        context = getattr(executor, "_mp_context", None)
        if context is not None and context.get_start_method() == "fork":
            raise ValueError(
                "the executor forks this process, which has threads: make it with "
                'mp_context=multiprocessing.get_context("spawn")'
            )


# --- threads ------------------------------------------------------------------------------------


class _Stopped(BaseException):
    """A batch is no longer wanted; no point is to take this for an error of its own."""


class Shared(Pool):
    """An executor whose threads share the plan with us."""

    def __init__(self, plan: Plan, executor: ThreadPoolExecutor, workers: int) -> None:
        super().__init__(workers)
        self._plan, self._executor, self._stop = plan, executor, Event()

    def submit(self, rows: Sequence[Row]) -> Future[Batch]:
        """Hand over a batch that stops when we do."""
        return self._executor.submit(evaluate_batch, self._plan, rows, self._watch)

    def _watch(self, _done: int, _total: int) -> None:
        if self._stop.is_set():
            raise _Stopped

    def close(self) -> None:
        """Stop batches that are running."""
        self._stop.set()


class Threads(Shared):
    """Threads of our own."""

    def __init__(self, plan: Plan, workers: int) -> None:
        super().__init__(plan, ThreadPoolExecutor(workers, "pavefem"), workers)

    def close(self) -> None:
        """Stop batches that are running, and their threads with them."""
        super().close()
        self._executor.shutdown(wait=False)


# --- other processes ----------------------------------------------------------------------------


@dataclass(frozen=True)
class Parcel:
    """A plan on its way to other processes, each of which opens it once."""

    data: bytes

    @classmethod
    def of(cls, plan: Plan) -> Self:
        """Pack a plan, or say why it cannot be sent."""
        try:
            return cls(pickle.dumps(plan))
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise ValueError(
                f"this cannot be sent to other processes: {error}. Functions must be those "
                "of a module that these can import"
            ) from None

    def open(self) -> Plan:
        """Return the plan."""
        return _OPENED.get(self.data, 1, lambda: pickle.loads(self.data))


_OPENED: Final = Recent[Plan](budget=2)  # plans


def _evaluate_parcel(parcel: Parcel, rows: Sequence[Row]) -> Batch:
    return evaluate_batch(parcel.open(), rows)


class Sent(Pool):
    """An executor of processes, or one that we know nothing of."""

    def __init__(self, parcel: Parcel, executor: Executor, workers: int) -> None:
        super().__init__(workers)
        self._parcel, self._executor = parcel, executor

    def submit(self, rows: Sequence[Row]) -> Future[Batch]:
        """Hand over a batch with the plan packed."""
        return self._executor.submit(_evaluate_parcel, self._parcel, rows)

    def close(self) -> None:
        """Leave the executor as it is; it is not ours."""


def _deliver(plan: Plan) -> Plan:
    return plan


def _evaluate_packed(plan: Plan, rows: bytes) -> Batch:
    return evaluate_batch(plan, pickle.loads(rows))


class Cluster(Pool):
    """A Dask cluster.

    The plan is the outcome of a task of its own: workers hand it to each other, and where all that
    had it are gone the scheduler has it made again. Batches of a worker that is gone go to others.
    """

    def __init__(self, plan: Plan, client: Any, workers: int | None) -> None:
        if client.asynchronous:
            raise ValueError("the Client is asynchronous: must be one that waits")
        super().__init__(workers or 0)
        self._client = client
        self._executor = client.get_executor(pure=False, retries=2)
        self._plan = client.submit(_deliver, plan, pure=False)
        self._until = -math.inf if workers is None else math.inf

    def workers(self) -> int:
        """Count the threads at present; a cluster that grows with its work needs some to see."""
        if time.monotonic() > self._until:
            self._workers = max(4, sum(self._client.nthreads().values()))
            self._until = time.monotonic() + CAPACITY_AGE
        return self._workers

    def submit(self, rows: Sequence[Row]) -> Future[Batch]:
        """Hand over a batch as bytes: Dask would look for keys of its own among the values."""
        future: Future[Batch] = self._executor.submit(
            _evaluate_packed, self._plan, pickle.dumps(rows)
        )
        return future

    def close(self) -> None:
        """Let the cluster forget the plan."""
        self._plan.release()
