"""Runs of any length, block by block into a store: memory does not grow with the road.

The pavement forgets. A block of instants therefore needs no state of the blocks before it: it
starts from rest as many instants earlier as the pavement remembers. The vehicle runs through
without a break; where a store is taken up again, its forces are computed anew: they cost little.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pavefem import _core
from pavefem._files import telling_what_is_kept
from pavefem._progress import progress_bar
from pavefem.forces import MEMORY_LIMIT, Progress, TireForces, forces_in_blocks
from pavefem.result import Result
from pavefem.scenario import Scenario
from pavefem.store import Plan, Store, open_result

Record = tuple[
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.uint64],
    NDArray[np.float64],
]
"""What the core keeps: histories; of nodes lowest, highest and the step of the lowest, and the
lowest while each axle is the nearest."""

Answer = Callable[[Scenario, NDArray[np.float64], TireForces, Record], Result]
"""Makes a result of what happened at some nodes and instants."""

_BLOCK: Final = 2**16
"""Instants of a block, where nothing speaks against it."""

_BLOCK_SIZE: Final = 2**26
"""Bytes that the histories of a block should take at most."""

_WARM_UPS: Final = 16
"""Fewest instants of a block, in warm-ups."""


def stream(
    scenario: Scenario,
    window: _core.Window,
    answer: Answer,
    path: Path,
    *,
    digest: str,
    columns: int,
    every: int,
    progress: bool,
) -> Result:
    """Run a scenario into a store, or go on with it there.

    Parameters
    ----------
    scenario : Scenario
        The inputs.
    window : Window
        Its road.
    answer : callable
        Makes the answer of a block from what the core keeps.
    path : Path
        The store.
    digest : str
        Key of the run: a store of another one is refused.
    columns : int
        Columns of the histories.
    every : int
        Instants of a row of the histories.
    progress : bool
        Show progress when the run takes over a second.
    """
    run = scenario.plan
    warm_up = _warm_up(window, run.speed)
    fitting = _BLOCK_SIZE // (8 * max(1, columns)) * every
    block = math.ceil(max(_WARM_UPS * warm_up, min(_BLOCK, fitting)) / every) * every
    size = 8.0 * block * (columns / every + 8.0 * len(scenario.vehicle.tires))
    if not size < MEMORY_LIMIT:
        raise ValueError(
            f"a block of {block} instants would take {size / 2**30:.3g} GiB, the limit is "
            f"{MEMORY_LIMIT / 2**30:g}: use fewer stations or a smaller every"
        )
    x = window.nodes
    plan = Plan(digest, run.steps + 1, block, every, run.dt)
    store = Store(path, plan, _template(scenario, answer, x, columns))
    if not store.finished:

        def so_far() -> str:
            return store.plan.so_far(store.blocks)

        with telling_what_is_kept(path, so_far), progress_bar(progress, "run") as report:
            # The store has the profile; the answers of its blocks go without.
            bare = scenario.model_copy(update={"profile": None, "run_in": 0.0})
            ahead = np.empty((2, 0, len(scenario.vehicle.tires)))
            work = _Work(bare, scenario.origin, window, answer, store, warm_up, x, report, ahead)
            forces_in_blocks(
                run,
                scenario.vehicle,
                scenario.profile,
                store.plan.block,
                work.take,
                interpolation=scenario.interpolation,
                lift_off=scenario.lift_off,
            )
            store.finish()
    return open_result(path)


def _warm_up(window: _core.Window, speed: float) -> int:
    """How many instants warm a block up."""
    warm_up = window.warm_up(speed)
    if math.isinf(warm_up):
        raise ValueError(
            "a store takes a pavement that forgets, so that a block can start from rest shortly "
            "before it; here waves live on, as nothing damps them or bars are far apart: run "
            "without a store, or with damping"
        )
    return int(warm_up)


def _template(scenario: Scenario, answer: Answer, x: NDArray[np.float64], columns: int) -> Result:
    """Build the answer of an instant at which nothing has moved."""
    static = scenario.vehicle.static_loads
    forces = TireForces(np.zeros(1), np.zeros((1, static.size)), static[np.newaxis], static)
    rest = np.broadcast_to(0.0, x.size)  # takes no memory
    steps = np.broadcast_to(np.uint64(0), x.size)
    passes = np.broadcast_to(0.0, (static.size, x.size))
    return answer(scenario, x, forces, (np.zeros((1, columns)), rest, rest, steps, passes))


@dataclass
class _Work:
    """Takes forces block by block: the pavement's answer goes to the store."""

    scenario: Scenario
    origin: float
    """Station of the profile at the road's x = 0, m."""
    window: _core.Window
    answer: Answer
    store: Store
    warm_up: int
    x: NDArray[np.float64]
    report: Progress | None
    ahead: NDArray[np.float64]
    """Places and forces (2, instants, axles) at the instants ahead of the next block."""
    begun: int = 0
    """Instants before the next block."""

    def take(self, forces: TireForces) -> None:
        """Take the forces of the next block."""
        forces = forces.seen_from(self.origin)
        loads = np.concatenate([self.ahead, [forces.position, forces.force]], axis=1)
        if self.begun >= self.store.plan.begin(self.store.blocks):
            self._run(forces, loads)
        self.ahead = loads[:, max(0, loads.shape[1] - self.warm_up) :].copy()
        self.begun += forces.time.size

    def _run(self, forces: TireForces, loads: NDArray[np.float64]) -> None:
        position, force = loads
        warm_up = self.ahead.shape[1]
        before = self.begun - warm_up
        first, record = self.window.run_block(position, force, before, warm_up, self._progress)
        x = self.x[first : first + record[1].size]
        self.store.write(self.answer(self.scenario, x, forces, record), first)

    def _progress(self, done: int, total: int) -> None:
        if self.report is not None:
            plan = self.store.plan
            within = plan.block * done // max(1, total)
            self.report(min(self.begun + within, plan.instants), plan.instants)
