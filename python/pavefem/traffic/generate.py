"""Traffic drawn at random."""

from __future__ import annotations

import inspect
import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pavefem import vehicles
from pavefem._model import finite_number, two_numbers, whole_number
from pavefem.vehicle import Vehicle

CLASSES: Final[Mapping[str, float]] = {
    "rigid_truck": 0.35,
    "tandem_truck": 0.15,
    "semitrailer": 0.35,
    "tridem_semitrailer": 0.15,
}
"""Shares of vehicles: round numbers."""

STEPS: Final = 10
"""Payloads are rounded to such parts of a preset's own."""
CUT: Final = 3.0
"""Distributions are cut at so many standard deviations."""
SLOWEST: Final = 10.0
"""Least speed, km/h, of what is drawn."""
BEYOND: Final = 100.0
"""How far a course goes on after a road's end and the vehicle's own length, m."""

Line = tuple[NDArray[np.float64], NDArray[np.float64]]


def drawn(
    *,
    duration: float,
    seed: int,
    flow: float,
    lanes: int,
    classes: Mapping[str, float] | None,
    loading: tuple[float, float],
    speed_kmh: tuple[float, float],
    min_headway: float,
    wander: float,
    length: float | None,
) -> dict[str, Any]:
    """Draw what `Traffic.generate` describes: the fields of a table."""
    duration, flow = _above("duration", duration, "s"), _above("flow", flow, "vehicles an hour")
    lanes = whole_number("lanes", lanes)
    mean_speed, speed_deviation = two_numbers("speed_kmh", speed_kmh)
    mean_load, load_deviation = two_numbers("loading", loading)
    least, wander = finite_number("min_headway", min_headway), finite_number("wander", wander)
    if not isinstance(seed, int | np.integer) or isinstance(seed, bool) or seed < 0:
        raise ValueError(f"seed = {seed!r}: must be a whole number, not below 0")
    if min(speed_deviation, load_deviation, wander, least) < 0.0:
        raise ValueError("standard deviations and min_headway must not be below 0")
    if mean_speed < SLOWEST:
        raise ValueError(f"speed_kmh = {mean_speed:g}: must be at least {SLOWEST:g} on average")
    mean = 3600.0 / flow
    if least >= mean:
        raise ValueError(
            f"min_headway = {least:g} s: must be below the mean headway, {mean:g} s at a flow of "
            f"{flow:g} an hour"
        )
    if length is not None:
        length = _above("length", length, "m")
    names, shares = _shares(classes)
    random = np.random.default_rng(seed)
    number: dict[tuple[str, int], int] = {}
    columns: dict[str, list[Any]] = {
        name: [] for name in ("vehicle", "entry_time", "speed_kmh", "lane", "lateral_offset")
    }
    courses: list[Line | None] = []
    for lane in range(1, lanes + 1):
        ahead: Line | None = None
        time = random.exponential(mean - least)
        while time < duration:
            name = str(random.choice(names, p=shares))
            step = round(float(np.clip(random.normal(mean_load, load_deviation), 0, 1)) * STEPS)
            key = (name, step)
            speed = max(SLOWEST, mean_speed + speed_deviation * _cut(random))
            columns["vehicle"].append(number.setdefault(key, len(number)))
            columns["entry_time"].append(time)
            columns["speed_kmh"].append(speed)
            columns["lane"].append(lane)
            columns["lateral_offset"].append(wander * _cut(random))
            course = None
            if length is not None:
                ahead = _behind(ahead, time, speed / 3.6, least, length)
                course = ahead if ahead[0].size > 2 else None
            courses.append(course)
            time += least + random.exponential(mean - least)
    made = [_loaded(name, step / STEPS) for name, step in number]
    return {"vehicles": made, **columns, "courses": courses}


def _behind(ahead: Line | None, time: float, speed: float, gap: float, length: float) -> Line:
    """Drive at a speed until the one ahead, so much time away, is in the way; then as it does.

    Time as a function of place: the larger of one's own and of the other's, later by the gap. The
    latter bends upwards only, so that both meet once.
    """
    end = length + 2.0 * BEYOND
    own = np.array([time, time + end / speed]), np.array([0.0, end])
    if ahead is None:
        return own
    times, places = ahead[0] + gap, ahead[1]
    late = times - (time + places / speed)
    if late.max() <= 0.0:
        return own
    after = int(np.argmax(late > 0.0))
    part = late[after - 1] / (late[after - 1] - late[after])
    meet = places[after - 1] + part * (places[after] - places[after - 1])
    when = time + meet / speed
    if meet <= 0.0:
        return times, places
    return np.concatenate([[time, when], times[after:]]), np.concatenate(
        [[0.0, meet], places[after:]]
    )


def _shares(classes: Mapping[str, float] | None) -> tuple[list[str], NDArray[np.float64]]:
    shares = dict(CLASSES if classes is None else classes)
    for name, share in shares.items():
        if name not in vehicles.PRESETS or "payload" not in _options(name):
            raise ValueError(f"classes has {name!r}: must be of {_with_payload()}")
        if not (finite_number(f"share of {name}", share) >= 0.0):
            raise ValueError(f"share of {name} = {share!r}: must not be below 0")
    total = sum(shares.values())
    if not total > 0.0:
        raise ValueError("classes: must have a share above 0")
    return list(shares), np.array(list(shares.values())) / total


def _options(name: str) -> Mapping[str, inspect.Parameter]:
    return inspect.signature(vehicles.PRESETS[name]).parameters


def _with_payload() -> list[str]:
    return [name for name in vehicles.PRESETS if "payload" in _options(name)]


def _loaded(name: str, part: float) -> Vehicle:
    payload = part * float(_options(name)["payload"].default)
    return vehicles.named(name, payload=payload)


def _cut(random: np.random.Generator) -> float:
    return float(np.clip(random.normal(), -CUT, CUT))


def _above(name: str, value: float, unit: str) -> float:
    number = finite_number(name, value)
    if not (number > 0.0 and math.isfinite(number)):
        raise ValueError(f"{name} = {number:g} {unit}: must be above 0")
    return number
