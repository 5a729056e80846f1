"""The table of passages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pavefem.profile import real_array
from pavefem.traffic.generate import drawn
from pavefem.vehicle import Vehicle

if TYPE_CHECKING:
    import pandas as pd

Course = tuple[ArrayLike, ArrayLike]
"""Times, s, and places of the front axle, m along the road in the direction of travel."""

WIDEST: Final = 5.0
"""Largest lateral offset, m, that is believed."""

_COLUMNS: Final = ("entry_time", "vehicle", "speed_kmh", "lane", "direction", "lateral_offset")
_REQUIRED: Final = _COLUMNS[:3]


class Traffic:
    """Vehicles that come onto a road, a row for each passage of a lane.

    Rows are sorted by entry time. A passage goes at its speed for ever, or follows a course of
    piecewise constant speed, at whose end it leaves the lane.

    Parameters
    ----------
    vehicles : sequence of Vehicle
        The distinct vehicles.
    vehicle : array_like of int, shape (n,)
        Which of them each passage is of.
    entry_time : array_like, shape (n,)
        Time at which the front axle comes onto the lane, s.
    speed_kmh : array_like
        Speed at entry, km/h: one for all, or shape (n,).
    lane : array_like of int
        Number of the lane, from 1.
    direction : array_like of int
        1 along the road, -1 against it; each direction has lanes of its own.
    lateral_offset : array_like
        How far to the side of the wheel path a vehicle goes, m.
    vehicle_id : sequence, optional
        What the source calls each; by default the row.
    courses : sequence of (times, places) or None, optional
        Courses, of at least two breaks each; None for a constant speed from place 0 on.
    counts : mapping of str to int, optional
        Records read, kept, left out and so on.
    problems : sequence of (int, str)
        Lines of the source that could not be used, and why.

    Attributes
    ----------
    breaks_time, breaks_place : ndarray
        All courses, one after the other, s and m.
    breaks_start : ndarray, shape (n + 1,)
        Where each begins; one break for a constant speed.

    Raises
    ------
    ValueError
        If arrays do not fit together, a number is out of range or a course goes back.

    Examples
    --------
    >>> from pavefem import vehicles
    >>> lorry = vehicles.rigid_truck()
    >>> len(Traffic([lorry], vehicle=[0, 0], entry_time=[0.0, 3.0], speed_kmh=80.0))
    2
    """

    def __init__(
        self,
        vehicles: Sequence[Vehicle],
        vehicle: ArrayLike,
        entry_time: ArrayLike,
        speed_kmh: ArrayLike,
        lane: ArrayLike = 1,
        direction: ArrayLike = 1,
        lateral_offset: ArrayLike = 0.0,
        *,
        vehicle_id: Sequence[Any] | None = None,
        courses: Sequence[Course | None] | None = None,
        counts: Mapping[str, int] | None = None,
        problems: Sequence[tuple[int, str]] = (),
    ) -> None:
        self.vehicles = tuple(vehicles)
        if not all(isinstance(one, Vehicle) for one in self.vehicles):
            raise ValueError("vehicles must be a sequence of Vehicle")
        entry = _numbers("entry_time", entry_time, None)
        count = entry.size
        given = courses if courses is not None else [None] * count
        if len(given) != count:
            raise ValueError(f"courses has {len(given)} items, expected {count}")
        order = np.argsort(entry, kind="stable")
        self.entry_time = entry[order]
        self.vehicle = _whole("vehicle", vehicle, count, 0, len(self.vehicles) - 1)[order]
        self.speed_kmh = _numbers("speed_kmh", speed_kmh, count)[order]
        self.lane = _whole("lane", lane, count, 1, 10_000)[order]
        self.direction = _whole("direction", direction, count, -1, 1)[order]
        self.lateral_offset = _numbers("lateral_offset", lateral_offset, count)[order]
        names = list(range(count)) if vehicle_id is None else list(vehicle_id)
        if len(names) != count:
            raise ValueError(f"vehicle_id has {len(names)} items, expected {count}")
        self.vehicle_id = tuple(names[row] for row in order)
        self.counts = MappingProxyType(dict(counts or {"read": count, "kept": count}))
        self.problems = tuple(problems)
        self._check()
        breaks = [
            _breaks(row, given[at], float(self.entry_time[row])) for row, at in enumerate(order)
        ]
        sizes = [len(times) for times, _ in breaks]
        none = np.empty(0)
        self.breaks_time = np.concatenate([none, *(times for times, _ in breaks)])
        self.breaks_place = np.concatenate([none, *(places for _, places in breaks)])
        self.breaks_start = np.concatenate([[0], np.cumsum(sizes)]).astype(np.intp)
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)

    def _check(self) -> None:
        for name, wrong, allowed in (
            ("direction", self.direction == 0, "1 or -1"),
            ("speed_kmh", self.speed_kmh < 0.0, "not below 0"),
            ("entry_time", np.abs(self.entry_time) > 1e8, "within 1e8 s of 0"),
            ("lateral_offset", np.abs(self.lateral_offset) > WIDEST, f"within {WIDEST:g} m of 0"),
        ):
            if wrong.any():
                row = int(wrong.argmax())
                value = getattr(self, name)[row]
                raise ValueError(f"{name} = {value:g} of passage {row}: must be {allowed}")

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"counts": dict(self.counts)}  # a view of a dictionary does not travel

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state | {"counts": MappingProxyType(state["counts"])})
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)

    def __len__(self) -> int:
        return self.entry_time.size

    def __repr__(self) -> str:
        first, last = self.period
        return (
            f"Traffic({len(self)} passages of {len(self.vehicles)} vehicles on "
            f"{np.unique(self.lane).size} lanes, {first:g} to {last:g} s)"
        )

    @property
    def period(self) -> tuple[float, float]:
        """First and last entry, s."""
        if len(self) == 0:
            return 0.0, 0.0
        return float(self.entry_time[0]), float(self.entry_time[-1])

    def course(self, passage: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return times, s, and places, m, of the breaks of a passage."""
        own = slice(self.breaks_start[passage], self.breaks_start[passage + 1])
        return self.breaks_time[own], self.breaks_place[own]

    def summary(self) -> dict[str, str]:
        """Return a few figures to print."""
        first, last = self.period
        figures = {
            "passages": f"{len(self)} on {np.unique(self.lane).size} lanes",
            "period": f"{first:g} to {last:g} s",
            "vehicles": f"{len(self.vehicles)} distinct",
        }
        if len(self):
            low, high = self.speed_kmh.min(), self.speed_kmh.max()
            figures["speed at entry"] = f"{low:.0f} to {high:.0f} km/h"
        return figures | {f"records {name}": str(count) for name, count in self.counts.items()}

    @classmethod
    def from_dataframe(cls, table: pd.DataFrame, vehicles: Mapping[str, Vehicle]) -> Self:
        """Take passages from the rows of a DataFrame.

        Parameters
        ----------
        table : pandas.DataFrame
            Columns ``entry_time`` (s), ``vehicle`` (a name), ``speed_kmh`` (km/h) and, if there
            are any, ``lane``, ``direction``, ``lateral_offset`` (m) and ``vehicle_id``.
        vehicles : mapping of str to Vehicle
            The vehicles by name.

        Raises
        ------
        ValueError
            If a column is missing or unknown, or a name is not in `vehicles`.
        """
        columns = [str(name) for name in table.columns]
        unknown = [name for name in columns if name not in (*_COLUMNS, "vehicle_id")]
        missing = [name for name in _REQUIRED if name not in columns]
        if unknown or missing:
            raise ValueError(
                f"columns {columns}: {'unknown ' + str(unknown) if unknown else ''}"
                f"{'missing ' + str(missing) if missing else ''}; must have {[*_REQUIRED]} and may "
                f"have {[*_COLUMNS[3:], 'vehicle_id']}"
            )
        names = list(vehicles)
        strange = sorted({str(name) for name in table["vehicle"]} - set(names))
        if strange:
            raise ValueError(f"vehicle {strange[0]!r} of the table: must be one of {names}")
        number = {name: at for at, name in enumerate(names)}
        rest = {name: table[name].to_numpy() for name in _COLUMNS[3:] if name in columns}
        return cls(
            list(vehicles.values()),
            [number[str(name)] for name in table["vehicle"]],
            table["entry_time"].to_numpy(),
            table["speed_kmh"].to_numpy(),
            **rest,
            vehicle_id=list(table["vehicle_id"]) if "vehicle_id" in columns else None,
        )

    def to_dataframe(self) -> pd.DataFrame:
        """Make a DataFrame as `from_dataframe` takes it; of courses it has only the beginnings.

        Raises
        ------
        ImportError
            If pandas is not installed.
        """
        import pandas as pd

        names = np.array([vehicle.name for vehicle in self.vehicles])
        columns = {name: getattr(self, name) for name in _COLUMNS} | {
            "vehicle": names[self.vehicle],
            "vehicle_id": list(self.vehicle_id),
        }
        return pd.DataFrame(columns)

    @classmethod
    def generate(
        cls,
        *,
        duration: float,
        seed: int,
        flow: float = 200.0,
        lanes: int = 2,
        direction: int = 1,
        classes: Mapping[str, float] | None = None,
        loading: tuple[float, float] = (0.6, 0.3),
        speed_kmh: tuple[float, float] = (80.0, 5.0),
        min_headway: float = 1.5,
        wander: float = 0.0,
        length: float | None = None,
    ) -> Self:
        """Draw traffic at random.

        Headways at entry are a smallest one and an exponentially distributed rest. Payloads are
        normally distributed parts of a preset's own, cut to 0 to 1 and rounded to tenths, so that
        vehicles which are distinct are few; speeds and lateral offsets are normally distributed,
        cut at three standard deviations.

        Parameters
        ----------
        duration : float
            Vehicles enter during this time, s.
        seed : int
            Seed of the generator: the same gives the same traffic.
        flow : float
            Vehicles an hour and lane.
        lanes : int
            Lanes, numbered from 1.
        direction : {1, -1}
            Their direction of travel.
        classes : mapping of str to float, optional
            Presets of `pavefem.vehicles` and their shares, which need not add up to 1. The default
            is of round numbers: 35 % rigid trucks, 15 % tandem trucks, 35 % semitrailers and 15 %
            tridem semitrailers.
        loading : (float, float)
            Mean and standard deviation of the payload, as a part of the preset's own.
        speed_kmh : (float, float)
            Mean and standard deviation of the speed, km/h.
        min_headway : float
            Least time between two front axles in a lane, s.
        wander : float
            Standard deviation of the lateral offset, m.
        length : float, optional
            Length of the road, m: over it nobody overtakes in his lane. Who has come as near as
            `min_headway` to the one ahead goes on at that one's speed. Without it, vehicles drive
            through one another.

        Raises
        ------
        ValueError
            If a number is out of range, or a flow leaves no room for the least headway.
        """
        found = drawn(
            duration=duration,
            seed=seed,
            flow=flow,
            lanes=lanes,
            classes=classes,
            loading=loading,
            speed_kmh=speed_kmh,
            min_headway=min_headway,
            wander=wander,
            length=length,
        )
        return cls(**found, direction=direction)


def _numbers(name: str, values: ArrayLike, count: int | None) -> NDArray[np.float64]:
    numbers = real_array(name, values)
    if count is not None and numbers.ndim == 0:
        numbers = np.full(count, float(numbers))
    if numbers.ndim != 1 or (count is not None and numbers.size != count):
        expected = "a list of numbers" if count is None else f"{count} numbers or one"
        raise ValueError(f"{name} has shape {numbers.shape}: must be {expected}")
    if not np.isfinite(numbers).all():
        row = int(np.argmin(np.isfinite(numbers)))
        raise ValueError(f"{name} = {numbers[row]} of passage {row}: must be finite")
    return numbers


def _whole(name: str, values: ArrayLike, count: int, low: int, high: int) -> NDArray[np.int64]:
    numbers = _numbers(name, values, count)
    wrong = (numbers != np.floor(numbers)) | (numbers < low) | (numbers > high)
    if wrong.any():
        row = int(wrong.argmax())
        raise ValueError(
            f"{name} = {numbers[row]:g} of passage {row}: must be a whole number, {low} to {high}"
        )
    return numbers.astype(np.int64)


def _breaks(
    row: int, course: Course | None, entry: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Check the course of a passage."""
    if course is None:
        return np.array([entry]), np.zeros(1)
    times, places = (_numbers(f"course of passage {row}", part, None) for part in course)
    if times.size < 2 or times.size != places.size:
        raise ValueError(
            f"course of passage {row} has {times.size} times and {places.size} places: must be as "
            "many of both, at least 2"
        )
    if times[0] != entry:
        raise ValueError(f"course of passage {row} begins at {times[0]:g} s, not {entry:g} s")
    if (np.diff(times) <= 0.0).any() or (np.diff(places) < 0.0).any():
        raise ValueError(f"course of passage {row}: times must increase, places must not go back")
    return times, places
