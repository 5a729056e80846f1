"""Traffic in parts: stretches of a road and periods of a day, on as many machines as there are."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any

import numpy as np

from pavefem._model import whole_number
from pavefem._progress import progress_bar
from pavefem._validity import listening, warn_validity
from pavefem.forces import Progress
from pavefem.road import Road
from pavefem.simulate_traffic import TrafficRun, period_of
from pavefem.studies.executors import dispatch, pool_for
from pavefem.traffic import Traffic
from pavefem.traffic_result import TrafficResult
from pavefem.traffic_scenario import TrafficScenario

if TYPE_CHECKING:
    from distributed import Client


def simulate_traffic_in_parts(
    road: Road,
    traffic: Traffic,
    *,
    stretches: int | Sequence[float] = 1,
    periods: int | Sequence[float] = 1,
    executor: Executor | Client | None = None,
    workers: int | None = None,
    progress: bool = False,
    **options: Any,
) -> TrafficResult:
    """Run traffic part by part, and put the parts together.

    In each part the vehicles roll from where they begin, and the pavement moves from as long before
    the part, and as far beside it, as it remembers: so what is put together is what the whole run
    answers, but for rounding.

    Parameters
    ----------
    road, traffic
        As of `simulate_traffic`.
    stretches : int or sequence of float
        Into how many stretches of like length the road is cut, or where, m.
    periods : int or sequence of float
        Into how many periods of like length the time is cut, or when, s.
    executor : concurrent.futures.Executor or dask.distributed.Client, optional
        Who runs the parts, as of `sweep`; by default threads of this process.
    workers : int, optional
        How many parts are worked on at a time, each by one thread.
    progress : bool
        Show progress when it takes over a second.
    **options
        Other arguments of `simulate_traffic` than `part`, `threads` and `store`.

    Returns
    -------
    TrafficResult

    Raises
    ------
    ValueError, SolverError
        As of `simulate_traffic`.
    SweepError
        If the executor, or a part, fails.
    """
    unknown = [name for name in options if name not in TrafficScenario.model_fields]
    if unknown or "part" in options:
        raise ValueError(f"{', '.join(unknown or ['part'])}: no argument of traffic in parts")
    scenario = TrafficScenario(road=road, traffic=traffic, **options)
    with listening() as told:
        begin, end = period_of(scenario)
    places = _cuts("stretches", stretches, 0.0, road.length)
    times = _cuts("periods", periods, begin, end)
    rows = [*product(pairwise(times), pairwise(places))]
    plan = _Parts(scenario)
    found: dict[int, tuple[TrafficResult, list[str]]] = {}
    with (
        progress_bar(progress, "parts") as report,
        closing(dispatch(pool_for(executor, plan, workers), rows, range(len(rows)))) as batches,
    ):
        for outcomes in batches:
            found |= outcomes
            if report is not None:
                report(len(found), len(rows))
    for message in dict.fromkeys([*told, *(text for _, texts in found.values() for text in texts)]):
        warn_validity(message, stacklevel=2)
    return TrafficResult.merge([found[number][0] for number in range(len(rows))])


@dataclass(frozen=True)
class _Parts:
    """A run that is done part by part."""

    scenario: TrafficScenario

    def evaluate(
        self, row: tuple[Any, ...], watch: Progress | None = None, /
    ) -> tuple[TrafficResult, list[str]]:
        """Run a part: its result, and which laws it uses outside their range."""
        period, part = row
        with listening() as told:
            scenario = self.scenario.model_copy(update={"period": period, "part": part})
            run = TrafficRun(scenario, threads=1)
            run.go(None if watch is None else lambda done, total, _: watch(done, total))
        return run.result(), told


def _cuts(name: str, given: int | Sequence[float], begin: float, end: float) -> list[float]:
    """Return where parts begin and end."""
    if isinstance(given, int | np.integer):
        return [*np.linspace(begin, end, whole_number(name, int(given)) + 1).tolist()]
    inner = [float(cut) for cut in given]
    cuts = [begin, *inner, end]
    if any(b <= a for a, b in pairwise(cuts)):
        raise ValueError(f"{name} = {inner}: must increase, within {begin:g} to {end:g}")
    return cuts
