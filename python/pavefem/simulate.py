"""The main job: a vehicle rolls over a profile and the road answers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from pavefem import _core
from pavefem._model import whole_number
from pavefem._progress import progress_bar
from pavefem.asphalt import kmh
from pavefem.cache import Recent, digest, transition
from pavefem.forces import (
    MEMORY_LIMIT,
    TOLERANCE,
    AxleForces,
    Interpolation,
    Progress,
    TireForces,
    plan,
    roll,
)
from pavefem.profile import Profile, finite_vector
from pavefem.quantities import QUANTITIES, Quantity, core_names, histories
from pavefem.result import Result
from pavefem.road import Road
from pavefem.scenario import Scenario
from pavefem.scheme import Scheme
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
    keep: Keep = HISTORIES,
    every: int = 1,
    stations: Sequence[float] | None = None,
    cache: bool = True,
    progress: bool = False,
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
    keep : sequence of str, or "envelope"
        Histories to keep besides the envelope, the peaks under each axle and the extremes of the
        tire forces: ``"tire_force"``, and of the pavement ``"deflection"``, ``"velocity"``,
        ``"curvature"``, ``"moment"``, ``"strain"`` (of the bottom fibre), ``"pressure"`` (on the
        foundation). All but deflections need a scheme with ``solver="window"``. ``"envelope"``
        keeps none.
    every : int
        Keep every n-th instant of the histories. The envelope sees all.
    stations : sequence of float, optional
        Places, m, whose histories are kept in place of those of all nodes (between nodes by the
        element's shape functions).
    cache : bool
        Whether transition matrices are kept between runs, in memory and on disk.
    progress : bool
        Show progress when the run takes over a second.

    Returns
    -------
    Result

    Raises
    ------
    ValueError
        If an input is out of range or the inputs do not fit together; the message names it.
    SolverError
        If a matrix is singular or the response is not finite.

    Warns
    -----
    ValidityWarning
        If the asphalt is outside the range of its stiffness formulas.
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
    )
    return run(scenario, keep=keep, every=every, stations=stations, cache=cache, progress=progress)


def run(
    scenario: Scenario,
    *,
    keep: Keep = HISTORIES,
    every: int = 1,
    stations: Sequence[float] | None = None,
    cache: bool = True,
    progress: bool = False,
) -> Result:
    """Run a scenario; see `simulate`."""
    if not isinstance(scenario, Scenario):
        raise ValueError(f"scenario is a {type(scenario).__name__}: must be a Scenario")
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

    `bar` gives what each of the two parts of the work reports to; without `files`, transition
    matrices are kept in memory only; `forces_of` finds the tire forces, if somebody has them.
    """
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
            'use solver="window", as Scheme.converged() or Scheme.paper(solver="window") has it'
        )
    _check_size(scenario, len(core_names(along)), places.size, every, stations is None)
    kept = (core_names(along), bool(along) and stations is None, places, every)
    stepper, x = _stepper(scenario, kept, cache, files)
    with bar("vehicle") as report:
        forces = (forces_of or forces_on_road)(scenario, report)
    with bar("pavement") as report:
        history, lowest, highest, step, passes = stepper.run(forces.position, forces.force, report)
    return Result(
        scenario=scenario,
        x=x,
        lowest=lowest,
        highest=highest,
        time_of_lowest=step.astype(np.float64) * scenario.scheme.dt,
        peak_deflection=np.abs(passes),
        axles=AxleForces.of(forces),
        time=forces.time[::every],
        histories=histories(history, along, x if stations is None else places, scenario.road),
        stations=None if stations is None else places,
        forces=_thin(forces, every) if "tire_force" in quantities else None,
    )


def _check_size(
    scenario: Scenario, quantities: int, stations: int, every: int, nodes: bool
) -> None:
    """Refuse, before any work, a mesh or histories that no memory holds."""
    road, scheme = scenario.road, scenario.scheme
    elements = sum(section.length / scheme.element_length for section in road.sections)
    if scheme.solver == "dense" and not 2.0 * elements < _core.DENSE_LIMIT + 4.0:
        raise ValueError(
            f"a road of {road.length:g} m in elements of {scheme.element_length:g} m has "
            f"{2.0 * elements:.4g} unknowns; with dense matrices the limit is {_core.DENSE_LIMIT}: "
            'use a Scheme with solver="window", a shorter road or longer elements'
        )
    steps = (road.length + scenario.vehicle.length) / (float(kmh(scenario.speed_kmh)) * scheme.dt)
    columns = quantities * (elements if nodes else stations)
    axles = len(scenario.vehicle.tires)
    size = 8.0 * steps * (columns / every + 4.0 * axles)
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
    scenario: Scenario, kept: tuple[list[str], bool, np.ndarray, int], cache: bool, files: bool
) -> tuple[_core.Stepper | _core.Window, np.ndarray]:
    """Prepare the road for stepping, or take what a run before has prepared; and its nodes."""
    road, scheme = scenario.road, scenario.scheme
    table = road.table(scenario.temperature_c, scenario.speed_kmh)
    mesh = (scheme.element_length, scheme.foundation, road.ends)
    if scheme.solver == "window":
        window = _core.Window(table, *mesh, scheme.dt, scheme.weights, scheme.hold, kept)
        return window, window.nodes
    strip = _core.Strip(table, *mesh)
    x = strip.nodes
    key = digest(table, mesh, scheme.dt)

    def make() -> _core.Stepper:
        response = (
            transition(key, strip, scheme.dt)
            if cache and files
            else _core.Transition.of_strip(strip, scheme.dt)
        )
        return _core.Stepper(strip, response, scheme.weights, scheme.hold, kept)

    if not cache:
        return make(), x
    # Some 25 matrices of n x n, n being two unknowns a node; 35 where forces vary within a step.
    size = (25 if scheme.hold == "zero" else 35) * 8 * (2 * x.size) ** 2
    quantities, nodes, stations, every = kept
    whole = (key, scheme.weights, scheme.hold, *quantities, nodes, tuple(stations), every)
    return _STEPPERS.get(whole, size, make), x


def forces_on_road(scenario: Scenario, report: Progress | None) -> TireForces:
    """Tire forces from the front axle at x = 0 until the last axle leaves the road."""
    vehicle, profile = scenario.vehicle, scenario.profile
    distance = scenario.road.length + vehicle.length
    dt, run_in = scenario.scheme.dt, scenario.run_in
    run = plan(vehicle, profile, scenario.speed_kmh, dt, run_in, distance)
    kind = scenario.interpolation, scenario.lift_off, TOLERANCE
    forces = roll(vehicle, profile, run, *kind, report)
    if profile is None:
        return forces
    origin = float(profile.x[0]) + run_in
    lifted = tuple(
        replace(lift_off, position=lift_off.position - origin) for lift_off in forces.lift_off
    )
    return replace(forces, position=forces.position - origin, lift_off=lifted)


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
