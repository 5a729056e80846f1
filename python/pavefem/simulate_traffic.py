"""Traffic on a road: thousands of vehicles, each with its own speed and so its own stiffness."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from pavefem import _core
from pavefem._files import telling_what_is_kept
from pavefem._model import whole_number
from pavefem._progress import progress_bar
from pavefem._validity import warn_validity
from pavefem.asphalt import kmh
from pavefem.cache import digest
from pavefem.forces import MEMORY_LIMIT
from pavefem.profile import Profile
from pavefem.road import Road
from pavefem.scheme import Scheme
from pavefem.simulate import warn_of_long_steps
from pavefem.traffic import Traffic
from pavefem.traffic_result import TrafficResult, Work, counted, stations_of
from pavefem.traffic_scenario import BINS, TrafficScenario
from pavefem.traffic_store import TrafficStore

SLOWEST: Final = 5.0
"""Speed below which asphalt has the stiffness that it has at it, km/h: one that stands would load
it for ever."""

_OF_A_PART: Final = frozenset({"begin", "end", "part", "stations"})
"""Inputs of the core in which parts of a run differ."""

_TURN: Final = 0.5
"""How long the core works before progress is told and Ctrl-C is seen to, s."""


def simulate_traffic(
    road: Road,
    traffic: Traffic,
    *,
    profile: Profile | Mapping[int, Profile | None] | None = None,
    temperature_c: float = 20.0,
    scheme: Scheme | str = "converged",
    run_in: float = 50.0,
    period: tuple[float, float] | None = None,
    part: tuple[float, float] | None = None,
    stations: Sequence[float] = (),
    every: int = 1,
    powers: Sequence[float] = (1.0, 2.0, 4.0, 5.0, 8.0),
    bins: Sequence[float] = BINS,
    precision: str = "double",
    threads: int | None = None,
    progress: bool = False,
    store: str | os.PathLike[str] | None = None,
) -> TrafficResult:
    """Deflection of a road under traffic.

    Each lane is a strip under one wheel track, as in `simulate`, and lanes do not touch. Each
    vehicle has its own tire forces, and the modulus under it is that of its own present speed.
    Deflections of vehicles that share pavement are added, each with its own stiffness, before any
    extreme is taken: exact where their speeds are equal.

    Parameters
    ----------
    road : Road
        The road, the same in all lanes.
    traffic : Traffic
        Who comes when, on which lane and how fast.
    profile : Profile or mapping of int, optional
        Elevations along the wheel track of all lanes, or of each by its number; a lane of the other
        direction has its number with a minus sign. Always along x: who comes the other way runs
        over it from its end. The road's x = 0 is `run_in` behind the first sample; beyond its ends
        a profile goes on level. None is a smooth road: static forces.
    temperature_c : float
        Asphalt temperature, °C.
    scheme : Scheme or str
        Discretisation; the solver must be the window, of second order, as of ``"converged"``.
    run_in : float
        Distance over which each vehicle settles before it comes onto its lane, m.
    period : (float, float), optional
        From when to when axles count as they pass a node, s.
    part : (float, float), optional
        Stretch of the road whose nodes count, m. With both, a run falls into parts whose results
        `TrafficResult.merge` puts together; see also `simulate_traffic_in_parts`.
    stations : sequence of float, optional
        Places, m, whose deflection is kept over time, in every lane.
    every : int
        Keep every n-th instant of it.
    powers : sequence of float
        Exponents of the sums, over all passes, of peak deflection, peak strain and force that are
        kept of each node: with them `TrafficResult.damage` has any exponent up to the largest.
    bins : sequence of float
        Edges of the distribution of the peaks of deflection, m; those below and above are counted.
    precision : {"double", "single"}
        Numbers of the pavement's motion.
    threads : int, optional
        Threads to use; by default as many as the machine has processors. They change no number.
    progress : bool
        Show progress when the run takes over a second.
    store : path, optional
        Folder in which what is done outlasts a Ctrl-C or a kill: the same call again goes on there,
        to the same numbers. `load_traffic_result` opens it meanwhile.

    Returns
    -------
    TrafficResult

    Raises
    ------
    ValueError
        If an input is out of range or the inputs do not fit together, a vehicle has dry friction,
        the pavement does not forget, or the store is that of another run; the message names it.
    SolverError
        If the response is not finite.
    OSError
        If the store cannot be written; what was done stays.

    Warns
    -----
    ValidityWarning
        If the asphalt is outside the range of its stiffness formulas, a vehicle is slower than
        5 km/h, or an axle goes further than an element in a step.
    """
    scenario = TrafficScenario(
        road=road,
        traffic=traffic,
        profile=profile,
        temperature_c=temperature_c,
        scheme=scheme,
        run_in=run_in,
        period=period,
        part=part,
        stations=tuple(stations),
        every=every,
        powers=tuple(powers),
        bins=tuple(bins),
        precision=precision,
    )
    return run_traffic(scenario, threads=threads, progress=progress, store=store)


def run_traffic(
    scenario: TrafficScenario,
    *,
    threads: int | None = None,
    progress: bool = False,
    store: str | os.PathLike[str] | None = None,
) -> TrafficResult:
    """Run a scenario; see `simulate_traffic`."""
    if not isinstance(scenario, TrafficScenario):
        raise ValueError(f"scenario is a {type(scenario).__name__}: must be a TrafficScenario")
    run = TrafficRun(scenario, threads=threads, store=store)
    run.finish(progress)
    return run.result()


class TrafficRun:
    """A run of traffic that can be stopped and gone on with.

    Parameters
    ----------
    scenario : TrafficScenario
        The inputs.
    threads, store
        As of `simulate_traffic`. A run goes on where its store ends.
    """

    def __init__(
        self,
        scenario: TrafficScenario,
        *,
        threads: int | None = None,
        store: str | os.PathLike[str] | None = None,
    ) -> None:
        threads = os.cpu_count() or 1 if threads is None else whole_number("threads", threads)
        inputs = core_inputs(scenario)
        self.scenario = scenario
        of_all_parts = {name: inputs[name] for name in inputs if name not in _OF_A_PART}
        self._inputs = _digest(scenario, of_all_parts)
        self._begin: int = inputs["begin"]
        self._end: int = inputs["end"]
        self._columns = inputs["stations"].shape[0]
        _check_size(scenario, inputs)
        self._history: list[NDArray[np.float64]] = []
        self._wall_time = 0.0
        self._store = None
        if store is not None:
            self._store = TrafficStore(Path(store), _digest(scenario, inputs, scenario.every))
        self._core = _core.Traffic(**inputs, threads=threads)
        if not counted(self._core.nodes, scenario.stretch).any():
            raise ValueError(f"part = {scenario.part} m: holds no node")
        if self._store is not None and (state := self._store.state) is not None:
            self._core.restore(state.core)
            self._wall_time = state.wall_time

    @property
    def finished(self) -> bool:
        """Whether nothing more comes."""
        return self._core.finished or (self._store is not None and self._store.finished)

    def finish(self, progress: bool = False) -> None:
        """Run until the end. What is done by a Ctrl-C is kept, in the store or by `result`."""
        path = None if self._store is None else self._store.folder
        with telling_what_is_kept(path, self._so_far), progress_bar(progress, "traffic") as report:
            try:
                self.go(report)
            except KeyboardInterrupt:
                self._save()
                raise
            self._save()

    def go(self, report: Callable[..., object] | None) -> None:
        """Run until the end, telling the steps done and in all, and how it stands."""
        first, started = self._core.tick, time.monotonic()
        begun, ticks = started, 1
        while not self.finished:
            self._advance(ticks)
            now = time.monotonic()
            seconds, begun = now - begun, now
            self._wall_time += seconds
            ticks = max(1, int(ticks * min(4.0, _TURN / max(seconds, 1e-6))))
            if report is not None:
                rate = (self._core.tick - first) * self._dt / (now - started)
                done = min(self._core.tick, self._end) - first
                report(done, self._end - first, self._how_it_stands(rate))
            if self._store is not None and self._store.is_due():
                self._save()

    def result(self) -> TrafficResult:
        """Return what it came to so far."""
        if self._store is not None and self._store.finished:
            return self._store.result()
        before = [] if self._store is None else self._store.history()
        return self._without_history().with_history([*before, *self._history])

    def _without_history(self) -> TrafficResult:
        return TrafficResult.of(
            self.scenario,
            nodes=self._core.nodes,
            lanes=self._core.lanes(),
            passages=self._core.vehicles(),
            work=Work(
                inputs=self._inputs,
                begin=self._begin * self._dt,
                end=self._end * self._dt,
                done=self._now,
                finished=self._core.finished,
                vehicle_seconds=self._core.vehicle_seconds,
                wall_time=self._wall_time,
            ),
        )

    @property
    def _dt(self) -> float:
        return self.scenario.scheme.dt

    @property
    def _now(self) -> float:
        return float(np.clip(self._core.tick, 0, self._end)) * self._dt

    def _advance(self, ticks: int) -> None:
        """Let the core go on, and keep what is asked for of the histories."""
        first = self._core.tick
        rows = self._core.advance(ticks)
        if self._columns == 0:
            return
        number = np.arange(first, first + rows.shape[0])
        counts = (number >= self._begin) & (number < self._end)
        self._history.append(rows[counts & (number % self.scenario.every == 0)])
        if self._core.finished:
            # Who has left leaves the road at rest.
            rest = self._rows(self._end) - self._rows(self._core.tick)
            self._history.append(np.zeros((rest, self._columns)))

    def _save(self) -> None:
        """Write what is done."""
        if self._store is None or self._store.finished:
            return
        if self._core.finished:
            self._store.finish(self.result())
            return
        history = np.concatenate([np.empty((0, self._columns)), *self._history])
        if self._columns > 0 and self._store.rows + len(history) != self._rows(self._core.tick):
            return  # Ctrl-C came between the core and its history: what was written before stays
        self._store.write(self._core.state(), self._wall_time, self._without_history(), history)
        self._history.clear()

    def _rows(self, tick: int) -> int:
        """Rows that the histories have at a tick."""
        every = self.scenario.every
        before = -(-self._begin // every)
        rows: int = max(before, -(-min(tick, self._end) // every)) - before
        return rows

    def _so_far(self) -> str:
        return f"{self._now:.5g} s of {self._end * self._dt:.5g} s"

    def _how_it_stands(self, rate: float) -> str:
        now, end = hours(self._now), hours(self._end * self._dt)
        return f"t = {now} of {end}, {rate:.3g}x real time, {self._core.active} vehicles"


def core_inputs(scenario: TrafficScenario) -> dict[str, Any]:
    """Everything but the number of threads that the core is given."""
    road, traffic, scheme = scenario.road, scenario.traffic, scenario.scheme
    pieces = _Pieces.of(traffic)
    classes, number = _classes(pieces.speed)
    size = 8.0 * classes.size * len(road.sections) * 6
    if not size < MEMORY_LIMIT:
        raise ValueError(
            f"{classes.size} speeds on {len(road.sections)} sections take {size / 2**30:.3g} GiB "
            f"of stiffnesses, the limit is {MEMORY_LIMIT / 2**30:g}: round the speeds, or use "
            "fewer sections"
        )
    constants = road.constants_at(scenario.temperature_c, classes)
    element_length = scheme.element_length or min(
        road.element_length(scenario.temperature_c, float(classes[i]), table=table)
        for i, table in ((i, _table(road, constants[i])) for i in (0, -1))
    )
    fastest = float(pieces.speed.max())
    warn_of_long_steps(fastest, scheme.dt, element_length, stacklevel=4)
    forward = scenario.lanes > 0
    profiles, profile_of = _placed_profiles(scenario)
    period = period_of(scenario)
    begin, end = (math.ceil(time / scheme.dt - 1e-6) for time in period)
    if end <= begin:
        raise ValueError(f"period = {period} s: must hold a step of {scheme.dt:g} s")
    lane = np.searchsorted(scenario.lanes, scenario.lane_of)
    lengths = np.array([section.length for section in road.sections])
    thickness = np.array([section.pavement.thickness for section in road.sections])
    roads = [(lengths, constants, thickness)]
    if not forward.all():
        mirrored = np.ascontiguousarray(constants[:, ::-1])
        roads.append((lengths[::-1].copy(), mirrored, thickness[::-1].copy()))
    return {
        "roads": roads,
        "element_length": element_length,
        "foundation": scheme.foundation,
        "ends": road.ends,
        "weights": scheme.weights,
        "tire_print": scheme.tire_print,
        "hold": scheme.hold,
        "dt": scheme.dt,
        "profiles": profiles,
        "lanes": np.column_stack([np.where(forward, 0.0, 1.0), profile_of]),
        "vehicles": [vehicle.core for vehicle in traffic.vehicles],
        "passages": np.column_stack(
            [
                traffic.vehicle,
                lane,
                scenario.shares,
                np.full(len(traffic), scenario.run_in),
                pieces.first,
            ]
        ).astype(np.float64),
        "breaks": np.column_stack([pieces.time, pieces.place, pieces.speed, number]),
        "until": pieces.until,
        "powers": list(scenario.powers),
        "bins": np.array(scenario.bins),
        "stations": _stations(scenario),
        "begin": begin,
        "end": end,
        "part": scenario.stretch,
        "precision": scenario.precision,
    }


class _Pieces(NamedTuple):
    """Stretches of constant speed, those of a passage after each other."""

    time: NDArray[np.float64]
    """When each begins, s."""
    place: NDArray[np.float64]
    """Where its front axle then is, m in its direction of travel."""
    speed: NDArray[np.float64]
    """m/s."""
    first: NDArray[np.int64]
    """Number of the first one of each passage."""
    until: NDArray[np.float64]
    """When each passage ends, s; infinity if with the road."""

    @classmethod
    def of(cls, traffic: Traffic) -> Self:
        """Take courses apart: between two breaks the speed is constant."""
        times, places = traffic.breaks_time, traffic.breaks_place
        starts, ends = traffic.breaks_start[:-1], traffic.breaks_start[1:] - 1
        on_its_own = starts == ends
        speed = np.empty(times.size)
        speed[:-1] = np.diff(places) / np.where(np.diff(times) > 0.0, np.diff(times), np.inf)
        speed[starts[on_its_own]] = kmh(traffic.speed_kmh[on_its_own])
        begins = np.ones(times.size, dtype=bool)
        begins[ends[~on_its_own]] = False
        first = np.cumsum(begins) - 1
        return cls(
            time=times[begins],
            place=places[begins],
            speed=speed[begins],
            first=first[starts],
            until=np.where(on_its_own, np.inf, times[ends]),
        )


def _classes(speed: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Speeds that have a stiffness of their own, km/h, and which of them each piece has."""
    # Speeds that differ by how they were rounded are one.
    speed_kmh = np.round(3.6 * speed, 6)
    slow = speed_kmh < SLOWEST
    if slow.any():
        warn_validity(
            f"{np.count_nonzero(slow)} of {slow.size} pieces of courses are slower than "
            f"{SLOWEST:g} km/h, down to {speed_kmh.min():.3g}: asphalt is taken as stiff as at "
            f"{SLOWEST:g} km/h",
            stacklevel=5,
        )
    return np.unique(np.maximum(speed_kmh, SLOWEST), return_inverse=True)


def _table(road: Road, constants: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.column_stack([[section.length for section in road.sections], constants])


def _placed_profiles(
    scenario: TrafficScenario,
) -> tuple[list[tuple[NDArray[np.float64], NDArray[np.float64], str]], list[int]]:
    """Elevations in the direction of travel, from where lanes begin; and which each lane has."""
    placed: dict[tuple[int, bool], int] = {}
    profiles: list[tuple[NDArray[np.float64], NDArray[np.float64], str]] = []
    numbers: list[int] = []
    for lane, profile in zip(scenario.lanes, scenario.profiles, strict=True):
        if profile is None:
            numbers.append(-1)
            continue
        key = id(profile), bool(lane > 0)
        if key not in placed:
            placed[key] = len(profiles)
            x, z = profile.x - (profile.x[0] + scenario.run_in), profile.z
            if lane < 0:
                x, z = (scenario.road.length - x)[::-1].copy(), z[::-1].copy()
            profiles.append((x, z, "linear"))
        numbers.append(placed[key])
    return profiles, numbers


def period_of(scenario: TrafficScenario) -> tuple[float, float]:
    """From when to when axles count, s: if not given, until the last vehicle has left."""
    if scenario.period is not None:
        return scenario.period
    traffic, pieces = scenario.traffic, _Pieces.of(scenario.traffic)
    lengths = np.array([vehicle.length for vehicle in traffic.vehicles])[traffic.vehicle]
    last = np.append(pieces.first[1:], pieces.time.size) - 1
    left = scenario.road.length + lengths - pieces.place[last]
    with np.errstate(divide="ignore"):
        leaves = pieces.time[last] + left / pieces.speed[last]
    return 0.0, float(np.minimum(leaves, pieces.until).max()) + scenario.scheme.dt


def _stations(scenario: TrafficScenario) -> NDArray[np.float64]:
    """Lane and place in the direction of travel of each history."""
    places = np.array(stations_of(scenario))
    rows = [
        (number, place if lane > 0 else scenario.road.length - place)
        for number, lane in enumerate(scenario.lanes)
        for place in places
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 2)


def _check_size(scenario: TrafficScenario, inputs: Mapping[str, Any]) -> None:
    """Refuse, before any work, what no memory holds."""
    ticks, columns = inputs["end"] - inputs["begin"], len(inputs["stations"])
    size = 8.0 * ticks / scenario.every * columns
    if not size < MEMORY_LIMIT:
        raise ValueError(
            f"{ticks} steps of {columns} stations and lanes would keep {size / 2**30:.3g} GiB, "
            f"the limit is {MEMORY_LIMIT / 2**30:g}: use a larger every or fewer stations"
        )
    nodes = scenario.lanes.size * scenario.road.length / inputs["element_length"]
    # Once as the core has it, and once as the dataset.
    size = 2.0 * nodes * (8.0 * (6 + 3 * len(scenario.powers)) + 4.0 * (len(scenario.bins) + 1))
    if not size < MEMORY_LIMIT:
        raise ValueError(
            f"{nodes:.4g} nodes in {scenario.lanes.size} lanes would keep {size / 2**30:.3g} GiB, "
            f"the limit is {MEMORY_LIMIT / 2**30:g}: use longer elements, fewer powers or bins, or "
            "a shorter road"
        )


def _digest(scenario: TrafficScenario, inputs: Mapping[str, Any], *rest: object) -> str:
    """Key of all that numbers depend on: of these inputs, and of what else there is."""
    key = digest(np.empty(0), [item.model_dump_json() for item in scenario.traffic.vehicles], rest)
    for name, value in inputs.items():
        if name != "vehicles":
            for item in _taken_apart(value):
                key = digest(np.asarray(item), name, key)
    return key.hex()


def _taken_apart(value: Any) -> Iterator[Any]:
    if isinstance(value, list | tuple):
        for item in value:
            yield from _taken_apart(item)
    else:
        yield value


def hours(seconds: float) -> str:
    """Write a time as hours, minutes and seconds."""
    whole = round(seconds)
    return f"{whole // 3600:02d}:{whole // 60 % 60:02d}:{whole % 60:02d}"
