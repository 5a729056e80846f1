"""The main job: a vehicle rolls over a profile and the road answers."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pavefem import _core
from pavefem._model import whole_number
from pavefem._progress import progress_bar
from pavefem.asphalt import kmh
from pavefem.cache import Recent, digest, transition
from pavefem.coupling import couple
from pavefem.errors import ValidityWarning
from pavefem.forces import (
    MEMORY_LIMIT,
    TOLERANCE,
    AxleForces,
    Interpolation,
    Progress,
    TireForces,
    roll,
)
from pavefem.profile import Profile, finite_vector
from pavefem.quantities import QUANTITIES, Quantity, core_names, histories
from pavefem.result import Result
from pavefem.road import Foundation, Road
from pavefem.scenario import Scenario
from pavefem.scheme import Scheme
from pavefem.stream import Record, stream
from pavefem.vehicle import Vehicle

Keep = Sequence[Quantity | Literal["tire_force"]] | Literal["envelope"]

HISTORIES: Final[Keep] = ("deflection", "tire_force")
"""Histories that are kept where it is not said."""

_STEPPERS: Final = Recent[_core.Stepper](budget=256 * 2**20)


def simulate(
    road: Road,
    vehicle: Vehicle,
    *,
    profile: Profile | None = None,
    speed_kmh: float = 65.0,
    temperature_c: float = 20.0,
    scheme: Scheme | str = "paper",
    run_in: float = 0.0,
    interpolation: Interpolation = "linear",
    lift_off: bool = False,
    coupling: Literal["one-way", "two-way"] = "one-way",
    keep: Keep = HISTORIES,
    every: int = 1,
    stations: Sequence[float] | None = None,
    cache: bool = True,
    progress: bool = False,
    store: str | os.PathLike[str] | None = None,
) -> Result:
    """Deflection of a road under a vehicle that crosses it at constant speed.

    The front axle is at x = 0 at time zero; the run ends when the last axle leaves the road.

    Parameters
    ----------
    road : Road
        The road; its modulus follows from `temperature_c` and `speed_kmh`.
    vehicle : Vehicle
        The vehicle. It is symmetric, and a wheel track carries half of each axle force.
    profile : Profile, optional
        Elevations along the wheel track; None is a smooth road: constant static forces.
    speed_kmh : float
        Speed, km/h.
    temperature_c : float
        Asphalt temperature, °C.
    scheme : Scheme or {"paper", "converged"}
        Discretisation in space and time.
    run_in : float
        Distance from the profile's first sample to x = 0, m. The vehicle starts at rest on the
        first sample and settles over this distance.
    interpolation : {"linear", "staircase"}
        Profile between samples: straight lines, or the elevation of a sample up to the next one.
    lift_off : bool
        Whether a tire that would pull leaves the road; otherwise tires are linear.
    coupling : {"one-way", "two-way"}
        Whether tires feel the profile only, as in the paper, or the deflection under them too. With
        ``"two-way"``, by the moving window only, vehicle and pavement take each step together, and
        `Result.coupling` says by how much the one-way answer is off.
    keep : sequence of str, or "envelope"
        Histories to keep besides the envelope, the peaks under each axle and the extremes of the
        tire forces: ``"tire_force"``, and of the pavement ``"deflection"``, ``"velocity"``,
        ``"curvature"``, ``"moment"``, ``"strain"`` (of the bottom fibre), ``"pressure"`` (on the
        foundation). All but deflections need a scheme with ``solver="banded"`` or ``"window"``.
        ``"envelope"`` keeps none.
    every : int
        Keep every n-th instant of the histories. The envelope sees all.
    stations : sequence of float, optional
        Places, m, whose histories are kept in place of those of all nodes (between nodes by the
        element's shape functions).
    cache : bool
        Whether dense transition matrices are kept between runs, in memory and on disk.
    progress : bool
        Show progress when the run takes over a second.
    store : path, optional
        A zarr store to write block by block, for roads of any length: memory does not grow with the
        road, and what is done outlasts a Ctrl-C, a kill or a full disk. The same call again goes on
        after the last block that is done. By the moving window only; histories of the pavement are
        kept at stations. Those of the result stay in the store until they are asked for.

    Returns
    -------
    Result

    Raises
    ------
    ValueError
        If an input is out of range or the inputs do not fit together, or the store is that of
        another run; the message names it.
    SolverError
        If a matrix is singular, the response is not finite, or two-way coupling does not settle.
    OSError
        If the store cannot be written; the blocks that are done stay.
    ImportError
        If zarr is not installed, for a store.

    Warns
    -----
    ValidityWarning
        If the asphalt is outside the range of its stiffness formulas, or an axle goes further than
        an element in a step.
    """
    scenario = Scenario(
        road=road,
        vehicle=vehicle,
        profile=profile,
        speed_kmh=speed_kmh,
        temperature_c=temperature_c,
        scheme=scheme,
        run_in=run_in,
        interpolation=interpolation,
        lift_off=lift_off,
        coupling=coupling,
    )
    return run(
        scenario,
        keep=keep,
        every=every,
        stations=stations,
        cache=cache,
        progress=progress,
        store=store,
    )


def run(
    scenario: Scenario,
    *,
    keep: Keep = HISTORIES,
    every: int = 1,
    stations: Sequence[float] | None = None,
    cache: bool = True,
    progress: bool = False,
    store: str | os.PathLike[str] | None = None,
) -> Result:
    """Run a scenario; see `simulate`."""
    if not isinstance(scenario, Scenario):
        raise ValueError(f"scenario is a {type(scenario).__name__}: must be a Scenario")
    if store is not None:
        return _into_store(scenario, _kept(scenario, keep, every, stations), Path(store), progress)
    return answer(
        scenario,
        keep=keep,
        every=every,
        stations=stations,
        cache=cache,
        bar=partial(progress_bar, progress),
    )


def answer(
    scenario: Scenario,
    *,
    keep: Keep,
    every: int,
    stations: Sequence[float] | None,
    cache: bool,
    bar: Callable[[str], AbstractContextManager[Progress | None]],
    files: bool = True,
    forces_of: Callable[[Scenario, Progress | None], TireForces] | None = None,
) -> Result:
    """Run a scenario, as `run`.

    `bar` gives what each part of the work reports to; without `files`, transition
    matrices are kept in memory only; `forces_of` finds the tire forces, if somebody has them.
    """
    kept = _kept(scenario, keep, every, stations)
    mesh = _mesh(scenario)
    _check_size(scenario, mesh, kept)
    stepper, x = _stepper(scenario, mesh, kept.for_core, cache, files)
    with bar("vehicle") as report:
        forces = (forces_of or forces_on_road)(scenario, report)
    if scenario.coupling == "one-way":
        with bar("pavement") as report:
            record = stepper.run(forces.position, forces.force, report)
        return kept.result(scenario, x, forces, record)
    assert isinstance(stepper, _core.Window)  # the scenario saw to it
    # Of the one-way answer, which nobody asked for, no history is kept.
    bare, _ = _stepper(scenario, mesh, _ENVELOPE.for_core, cache, files)
    with bar("pavement") as report:
        lowest = bare.run(forces.position, forces.force, report)[1]
    with bar("coupling") as report:
        coupled = couple(scenario, forces.position, stepper, report)
    with bar("pavement") as report:
        record = stepper.run(coupled.forces.position, coupled.forces.force, report)
    deepest = float(lowest.min()), float(record[1].min())
    coupling = coupled.against(forces, deepest, kept.every if kept.tire_force else None)
    return replace(kept.result(scenario, x, coupled.forces, record), coupling=coupling)


class _Kept(NamedTuple):
    """What is kept of a run."""

    along: Sequence[Quantity]
    """Quantities of the pavement."""
    tire_force: bool
    stations: np.ndarray | None
    every: int

    @property
    def for_core(self) -> tuple[list[str], bool, np.ndarray, int]:
        """The same as the core takes it."""
        places = np.empty(0) if self.stations is None else self.stations
        nodes = bool(self.along) and self.stations is None
        return core_names(self.along), nodes, places, self.every

    def result(
        self, scenario: Scenario, x: np.ndarray, forces: TireForces, record: Record
    ) -> Result:
        """Make the result of what the core has kept at some nodes and instants."""
        history, lowest, highest, step, passes = record
        places = x if self.stations is None else self.stations
        return Result(
            scenario=scenario,
            x=x,
            lowest=lowest,
            highest=highest,
            time_of_lowest=step.astype(np.float64) * scenario.scheme.dt,
            peak_deflection=np.abs(passes),
            axles=AxleForces.of(forces),
            time=forces.time[:: self.every],
            histories=histories(history, self.along, places, scenario.road),
            stations=self.stations,
            forces=_thin(forces, self.every) if self.tire_force else None,
        )


_ENVELOPE: Final = _Kept(along=(), tire_force=False, stations=None, every=1)


def _kept(scenario: Scenario, keep: Keep, every: int, stations: Sequence[float] | None) -> _Kept:
    """Check what is to be kept."""
    quantities = check_keep(keep)
    every = whole_number("every", every)
    places = check_stations(stations)
    along: list[Quantity] = [name for name in quantities if name != "tire_force"]
    if stations is not None and not along:
        raise ValueError(
            f"keep = {keep!r}: must have some of {[*QUANTITIES]} where stations are given"
        )
    beyond = [name for name in along if name != "deflection"]
    if beyond and scenario.scheme.solver == "dense":
        raise ValueError(
            f'keep = {keep!r}: solver="dense" answers deflections only; for {", ".join(beyond)} '
            'use solver="banded", the same steps, or "window", as Scheme.converged() has it'
        )
    return _Kept(along, "tire_force" in quantities, None if stations is None else places, every)


def _into_store(scenario: Scenario, kept: _Kept, path: Path, progress: bool) -> Result:
    """Run block by block."""
    if scenario.scheme.solver != "window":
        raise ValueError(
            'a store is written by the moving window: use a Scheme with solver="window", as '
            'scheme="converged" has it'
        )
    if scenario.scheme.order != 2:
        raise ValueError(
            f"a store is written by a scheme of order = 2, not {scenario.scheme.order}"
        )
    if scenario.coupling == "two-way":
        raise ValueError('a store is written with coupling = "one-way", not "two-way"')
    if kept.along and kept.stations is None:
        raise ValueError(
            f"a store keeps histories of {', '.join(kept.along)} at stations, not at all nodes: "
            'give stations=[...], or keep=["tire_force"] or "envelope"'
        )
    names, _, stations, every = for_core = kept.for_core
    window, _ = _stepper(scenario, _mesh(scenario), for_core, cache=False, files=False)
    assert isinstance(window, _core.Window)
    run = digest(stations, scenario.model_dump_json(), sorted(kept.along), kept.tire_force, every)
    if scenario.profile is not None:
        run = digest(scenario.profile.x, digest(scenario.profile.z, run))
    return stream(
        scenario,
        window,
        kept.result,
        path,
        digest=run.hex(),
        columns=len(names) * stations.size,
        every=every,
        progress=progress,
    )


class _Mesh(NamedTuple):
    """What the core meshes: sections by their constants, and the longest element, m."""

    table: np.ndarray
    element_length: float
    foundation: Foundation
    ends: str


def _mesh(scenario: Scenario) -> _Mesh:
    road, scheme = scenario.road, scenario.scheme
    place = (scenario.temperature_c, scenario.speed_kmh)
    table = road.table(*place)
    element_length = scheme.element_length or road.element_length(*place, table=table)
    warn_of_long_steps(float(kmh(scenario.speed_kmh)), scheme.dt, element_length, stacklevel=5)
    return _Mesh(table, element_length, scheme.foundation, road.ends)


def warn_of_long_steps(speed: float, dt: float, element_length: float, stacklevel: int) -> None:
    """Warn if an axle at a speed, m/s, goes over a whole element in a step."""
    step = speed * dt
    if step > element_length:
        warnings.warn(
            f"an axle goes {step:.3g} m in a step of dt = {dt:g} s, more than an element of "
            f"{element_length:.3g} m: nodes in between may miss it, use a dt of at most "
            f"{dt * element_length / step:.2g} s",
            ValidityWarning,
            stacklevel=stacklevel + 1,
        )


def _check_size(scenario: Scenario, mesh: _Mesh, kept: _Kept) -> None:
    """Refuse, before any work, a mesh or histories that no memory holds."""
    names, nodes, stations, every = kept.for_core
    road, scheme = scenario.road, scenario.scheme
    elements = sum(section.length / mesh.element_length for section in road.sections)
    if scheme.solver == "dense" and not 2.0 * elements < _core.DENSE_LIMIT + 4.0:
        raise ValueError(
            f"a road of {road.length:g} m in elements of {mesh.element_length:g} m has "
            f"{2.0 * elements:.4g} unknowns; with dense matrices the limit is {_core.DENSE_LIMIT}: "
            'use a Scheme with solver="banded" (the same steps) or "window" (faster ones of second '
            "order), a shorter road or longer elements"
        )
    steps = (road.length + scenario.vehicle.length) / (float(kmh(scenario.speed_kmh)) * scheme.dt)
    columns = len(names) * (elements if nodes else stations.size)
    axles = len(scenario.vehicle.tires)
    runs = 1.0 if scenario.coupling == "one-way" else 2.0
    size = 8.0 * steps * runs * (columns / every + 4.0 * axles)
    if not size < MEMORY_LIMIT:
        raise ValueError(
            f"{steps:.4g} steps would keep {size / 2**30:.3g} GiB, the limit is "
            f'{MEMORY_LIMIT / 2**30:g}: use a longer dt, every=n, stations=[...] or keep="envelope"'
        )


def check_stations(stations: Sequence[float] | None) -> NDArray[np.float64]:
    """Return the places of histories, none for those of all nodes, or raise a ValueError."""
    if stations is None:
        return np.array([], dtype=np.float64)
    places = finite_vector("stations", stations)
    if places.size == 0:
        raise ValueError("stations is empty: must be a list of places, m")
    return places


def check_keep(keep: Keep) -> Sequence[Quantity | Literal["tire_force"]]:
    """Return the histories that `keep` stands for, or raise a ValueError."""
    known = [*QUANTITIES, "tire_force"]
    if not isinstance(keep, str) and isinstance(keep, Iterable):
        quantities = tuple(keep)
        if all(isinstance(name, str) and name in known for name in quantities):
            return quantities
    elif keep == "envelope":
        return ()
    raise ValueError(f'keep = {keep!r}: must be "envelope" or some of {known}')


def _stepper(
    scenario: Scenario,
    mesh: _Mesh,
    kept: tuple[list[str], bool, np.ndarray, int],
    cache: bool,
    files: bool,
) -> tuple[_core.Stepper | _core.Banded | _core.Window, np.ndarray]:
    """Prepare the road for stepping, or take what a run before has prepared; and its nodes."""
    scheme = scenario.scheme
    weights, hold, tire_print = scheme.weights, scheme.hold, scheme.tire_print
    if scheme.solver == "banded":
        banded = _core.Banded(*mesh, scheme.dt, weights, hold, kept, print=tire_print)
        return banded, banded.nodes
    if scheme.solver == "window":
        extrapolate = scheme.order == 3
        window = _core.Window(
            *mesh, scheme.dt, weights, hold, kept, print=tire_print, extrapolate=extrapolate
        )
        return window, window.nodes
    strip = _core.Strip(*mesh)
    x = strip.nodes
    key = digest(mesh.table, mesh[1:], scheme.dt)

    def make() -> _core.Stepper:
        response = (
            transition(key, strip, scheme.dt)
            if cache and files
            else _core.Transition.of_strip(strip, scheme.dt)
        )
        return _core.Stepper(strip, response, weights, hold, kept, print=tire_print)

    if not cache:
        return make(), x
    # Some 25 matrices of n x n, n being two unknowns a node; 35 where forces vary within a step.
    size = (25 if hold == "zero" else 35) * 8 * (2 * x.size) ** 2
    quantities, nodes, stations, every = kept
    whole = (key, weights, hold, tire_print, *quantities, nodes, tuple(stations), every)
    return _STEPPERS.get(whole, size, make), x


def forces_on_road(scenario: Scenario, report: Progress | None) -> TireForces:
    """Tire forces from the front axle at x = 0 until the last axle leaves the road."""
    kind = scenario.interpolation, scenario.lift_off, TOLERANCE
    forces = roll(scenario.vehicle, scenario.profile, scenario.plan, *kind, report)
    return forces.seen_from(scenario.origin)


def _thin(forces: TireForces, every: int) -> TireForces:
    if every == 1:
        return forces
    kept = slice(None, None, every)
    return replace(
        forces,
        time=forces.time[kept],
        position=forces.position[kept],
        force=forces.force[kept],
    )
