"""Everything a run of traffic depends on, from Python or from a TOML file."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    AfterValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    field_serializer,
    field_validator,
    model_validator,
)

from pavefem._model import NotNegative, Number, Positive
from pavefem._tables import make
from pavefem.profile import Profile
from pavefem.road import Road
from pavefem.scenario import ScenarioFile, beside, in_short, profile_from_table, scheme_from_table
from pavefem.scheme import Scheme
from pavefem.traffic import Traffic, read_sumo

BINS: Final = tuple(np.geomspace(1e-5, 1e-2, 31).tolist())
"""Edges of the distribution of pass peaks where they are not given, m: ten for each decade."""

MAKERS: Final[Mapping[str, Callable[..., Traffic]]] = {"generate": Traffic.generate}
"""Traffic that a scenario file can have made."""

READERS: Final[Mapping[str, Callable[..., Traffic]]] = {"sumo": read_sumo}
"""Readers of files of traffic, by the name of their format."""


def _increasing(numbers: tuple[float, ...]) -> tuple[float, ...]:
    if any(b <= a for a, b in pairwise(numbers)):
        raise ValueError("must increase")
    return numbers


Increasing = AfterValidator(_increasing)


class TrafficScenario(ScenarioFile):
    """Traffic on one road: all inputs of a run, checked together.

    In a TOML file every field is a key, `road`, `traffic`, `profile` and `scheme` are tables, and
    what is left out has the default given here::

        temperature_c = 20.0

        [road]
        length = 2000.0

        [traffic]
        make = "generate"           # or file = "driven.xml", format = "sumo"
        duration = 3600.0
        seed = 1

        [profile]                   # or one for each lane: [profile.1], [profile.-1]
        make = "iso8608"
        road_class = "B"
        length = 2100.0

        [scheme]
        preset = "converged"

    Every lane is a strip of its own, the wheel track on which vehicles roll. A lane of the other
    direction has its number with a minus sign.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    road: Road = Road(length=2000.0)
    """The road and its pavement, the same in all lanes."""
    traffic: Traffic
    """Who comes when, and how."""
    profile: Profile | dict[int, Profile | None] | None = None
    """The profile of all lanes, or of each by its number, in the direction in which x grows; None
    is smooth. Beyond its ends it goes on level."""
    temperature_c: Number = 20.0
    """Asphalt temperature, °C."""
    scheme: Scheme = Scheme.converged()
    """Discretisation in space and time."""
    run_in: NotNegative = 50.0
    """Distance from a profile's first sample to the road's x = 0, m, and over which each vehicle
    settles before it comes onto a lane."""
    period: tuple[Number, Number] | None = None
    """From when to when axles count as they pass, s; by default from 0 until all have left. The
    vehicles roll and the pavement moves beforehand, as they do without."""
    part: tuple[Number, Number] | None = None
    """Stretch of the road whose nodes count, m, the second end not included unless it is the
    road's; by default all of it. The pavement beside it moves as it does without."""
    stations: tuple[Number, ...] = ()
    """Places, m, whose deflection is kept over time, in every lane."""
    every: Annotated[int, Field(ge=1)] = 1
    """Keep every n-th instant of it."""
    powers: Annotated[tuple[Positive, ...], Increasing] = (1.0, 2.0, 4.0, 5.0, 8.0)
    """Exponents of the sums over all passes that are kept of each node."""
    bins: Annotated[tuple[Positive, ...], Increasing] = BINS
    """Edges of the distribution of pass peaks, m."""
    precision: Literal["double", "single"] = "double"
    """Numbers of the pavement's motion: of 64 bits, or of 32, at about twice the speed."""

    @field_validator("traffic", mode="before")
    @classmethod
    def _read_traffic(cls, value: Any, info: ValidationInfo) -> Any:
        return _traffic_from_table(value, beside(info)) if isinstance(value, Mapping) else value

    @field_validator("profile", mode="before")
    @classmethod
    def _profiles_from_tables(cls, value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, Mapping) and not {"file", "make"} & value.keys():
            return {lane: profile_from_table(one, info) for lane, one in value.items()}
        return profile_from_table(value, info)

    _scheme = field_validator("scheme", mode="before")(scheme_from_table)

    @field_validator("scheme")
    @classmethod
    def _steps_windows(cls, scheme: Scheme) -> Scheme:
        if (scheme.solver, scheme.order) != ("window", 2):
            raise ValueError(
                f"solver={scheme.solver!r}, order={scheme.order}: traffic needs a scheme with "
                'solver="window" and order=2, as "converged" is, or Scheme.paper(solver="window")'
            )
        return scheme

    @field_validator("traffic")
    @classmethod
    def _vehicles_are_linear(cls, traffic: Traffic) -> Traffic:
        rubbing = [
            vehicle.name
            for vehicle in traffic.vehicles
            if any(spring.friction is not None for spring in vehicle.springs)
        ]
        if rubbing:
            raise ValueError(
                f"{', '.join(rubbing)}: has springs with dry friction; traffic takes vehicles "
                "without"
            )
        if len(traffic) == 0:
            raise ValueError("nobody comes: must have at least one vehicle")
        return traffic

    @model_validator(mode="after")
    def _lies_on_the_road(self) -> Self:
        length = self.road.length
        for name, span in (("period", self.period), ("part", self.part)):
            if span is not None and not 0.0 <= span[0] < span[1]:
                raise ValueError(f"{name} = {span}: must begin at 0 or later, and end after that")
        if self.part is not None and self.part[0] >= length:
            raise ValueError(f"part = {self.part}: must begin on the road of {length:g} m")
        for place in self.stations:
            if not 0.0 <= place <= length:
                raise ValueError(f"station {place:g} m is not on the road, 0 to {length:g} m")
        return self

    @model_validator(mode="after")
    def _profiles_fit(self) -> Self:
        needed = self.run_in + self.road.length
        if isinstance(self.profile, Mapping):
            absent = [lane for lane in self.lanes.tolist() if lane not in self.profile]
            if absent:
                raise ValueError(
                    f"profile has lanes {[*self.profile]}: traffic is on {self.lanes.tolist()}, "
                    "give a profile, or None, for each"
                )
        for profile in {id(one): one for one in self.profiles if one is not None}.values():
            if profile.length < needed * (1.0 - 1e-9):
                raise ValueError(
                    f"profile {profile.name!r} is {profile.length:g} m long, but the run-in of "
                    f"{self.run_in:g} m and the road of {self.road.length:g} m need {needed:g} m"
                )
        return self

    @model_validator(mode="after")
    def _strips_have_a_width(self) -> Self:
        widths = [section.pavement.width for section in self.road.sections]
        if np.any(self.traffic.lateral_offset) and max(widths) > min(widths) * (1.0 + 1e-9):
            raise ValueError(
                f"sections have strips of {min(widths):g} to {max(widths):g} m in width, and "
                "vehicles are off the track: what share of them loads the strip, is not defined"
            )
        return self

    @cached_property
    def lane_of(self) -> NDArray[np.int64]:
        """Lane of each passage, below 0 in the other direction."""
        lanes: NDArray[np.int64] = self.traffic.lane * self.traffic.direction
        return lanes

    @cached_property
    def lanes(self) -> NDArray[np.int64]:
        """Numbers of the lanes that have traffic, in order; below 0 in the other direction."""
        return np.unique(self.lane_of)

    @property
    def profiles(self) -> Sequence[Profile | None]:
        """Profile of each lane."""
        if isinstance(self.profile, Mapping):
            return [self.profile.get(lane) for lane in self.lanes.tolist()]
        return [self.profile] * self.lanes.size

    @property
    def shares(self) -> NDArray[np.float64]:
        """Part of each passage's wheel track that loads the strip.

        A wheel path as wide as the strip, moved sideways, overlaps it by so much.
        """
        width = self.road.sections[0].pavement.width
        shares: NDArray[np.float64] = np.maximum(
            0.0, 1.0 - np.abs(self.traffic.lateral_offset) / width
        )
        return shares

    @property
    def stretch(self) -> tuple[float, float]:
        """Stretch of the road whose nodes count, m."""
        return (0.0, math.inf) if self.part is None else self.part

    @field_serializer("profile")
    def _profiles_in_short(
        self, profile: Profile | dict[int, Profile | None] | None
    ) -> dict[Any, Any] | None:
        if isinstance(profile, dict):
            return {lane: in_short(one) for lane, one in profile.items()}
        return in_short(profile)

    @field_serializer("traffic")
    def _traffic_in_short(self, traffic: Traffic) -> dict[str, Any]:
        names = [vehicle.name for vehicle in traffic.vehicles]
        return {"passages": len(traffic), "vehicles": names}


def _traffic_from_table(table: Mapping[str, Any], folder: Path) -> Traffic:
    """Read or make the traffic that a table of a file names."""
    options = dict(table)
    if "file" not in options:
        return make("make", MAKERS, options)
    options["path"] = folder / options.pop("file")
    try:
        return make("format", READERS, {"format": "sumo"} | options)
    except OSError as error:
        raise ValueError(str(error)) from None
