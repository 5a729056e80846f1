"""Everything one run depends on, from Python or from a TOML file."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final, Literal, Self

from pydantic import ConfigDict, ValidationInfo, field_serializer, field_validator, model_validator

from pavefem._model import Model, NotNegative, Number, Positive
from pavefem._tables import make, read_toml, told_of
from pavefem.forces import Interpolation, Run, plan
from pavefem.formats import read_profile
from pavefem.profile import Profile
from pavefem.road import Road
from pavefem.scheme import Scheme
from pavefem.vehicles import VehicleTable, tandem_truck

GENERATORS: Final[Mapping[str, Callable[..., Profile]]] = {
    "smooth": Profile.smooth,
    "iso8608": Profile.iso8608,
}
"""Profiles that a scenario file can have made."""


def profile_from_table(value: Any, info: ValidationInfo) -> Any:
    """Read or make the profile that a table of a file names; leave others to the model."""
    if not isinstance(value, Mapping):
        return value
    options = dict(value)
    if "file" in options:
        try:
            return read_profile(beside(info) / options.pop("file"), **options)
        except (OSError, TypeError) as error:
            raise ValueError(str(error)) from None
    return make("make", GENERATORS, options)


def in_short(profile: Profile | None) -> dict[str, Any] | None:
    """Say in a few words which profile it is."""
    if profile is None:
        return None
    return {"name": profile.name, "samples": profile.x.size, "length": profile.length}


def beside(info: ValidationInfo) -> Path:
    """Folder from which the names of files in a scenario file count."""
    folder: Path = (info.context or {}).get("folder", Path())
    return folder


def scheme_from_table(value: Any) -> Any:
    """Build the scheme that a name stands for, or a table with a preset."""
    if isinstance(value, str):
        return Scheme.named(value)
    if isinstance(value, Mapping) and "preset" in value:
        changes = dict(value)
        return Scheme.model_validate(Scheme.named(changes.pop("preset")).model_dump() | changes)
    return value


class ScenarioFile(Model):
    """All inputs of a run, checked together, that a TOML file may hold."""

    @classmethod
    def from_toml(cls, path: str | os.PathLike[str]) -> Self:
        """Read a scenario file.

        Raises
        ------
        FormatError
            If the file is not TOML or holds wrong values: one line for each, with its key.
        OSError
            If the file cannot be read.
        """
        data = read_toml(path)
        with told_of(path, "scenario"):
            return cls.model_validate(data, context={"folder": Path(path).parent})


class Scenario(ScenarioFile):
    """One vehicle on one road over one profile: all inputs of a run, checked together.

    In a TOML file every field is a key, `road`, `vehicle`, `profile` and `scheme` are tables, and
    what is left out has the default given here::

        speed_kmh = 65.0
        temperature_c = 20.0
        run_in = 50.0

        [road]
        length = 25.0
        [road.pavement.asphalt]
        vma = 25.0

        [vehicle]
        preset = "tandem_truck"     # or units, or bodies, springs and tires
        axle_spacing = 1.3

        [profile]
        file = "site.csv"           # or make = "iso8608", road_class = "B", length = 100.0, ...

        [scheme]
        preset = "paper"            # or "converged"; further keys change it
        dt = 1e-3
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    road: Road = Road.paper()
    """The road and its pavement."""
    vehicle: VehicleTable = tandem_truck()
    """The vehicle."""
    profile: Profile | None = None
    """Its profile; None is a smooth road, which leaves constant static forces."""
    speed_kmh: Positive = 65.0
    """Speed, km/h."""
    temperature_c: Number = 20.0
    """Asphalt temperature, °C."""
    scheme: Scheme = Scheme.paper()
    """Discretisation in space and time."""
    run_in: NotNegative = 0.0
    """Distance from the profile's first sample to the road's x = 0, m: the vehicle settles."""
    interpolation: Interpolation = "linear"
    """Profile between samples: straight lines, or a staircase (the paper's)."""
    lift_off: bool = False
    """Whether a tire that would pull leaves the road; otherwise tires are linear."""
    coupling: Literal["one-way", "two-way"] = "one-way"
    """Whether tires feel the profile only (the paper), or the deflection under them too."""

    _profile = field_validator("profile", mode="before")(profile_from_table)
    _scheme = field_validator("scheme", mode="before")(scheme_from_table)

    @model_validator(mode="after")
    def _couples(self) -> Self:
        if self.coupling == "two-way" and (self.scheme.solver, self.scheme.order) != ("window", 2):
            raise ValueError(
                'coupling = "two-way": needs a scheme with solver="window" and order=2, as '
                '"converged" is, or Scheme.paper(solver="window")'
            )
        return self

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.profile is None:
            if self.run_in > 0.0:
                raise ValueError(f"run_in = {self.run_in:g} m needs a profile to run in on")
            return self
        needed = self.run_in + self.road.length
        if self.profile.length < needed * (1.0 - 1e-9):
            raise ValueError(
                f"profile {self.profile.name!r} is {self.profile.length:g} m long, but the run-in "
                f"of {self.run_in:g} m and the road of {self.road.length:g} m need {needed:g} m"
            )
        return self

    @property
    def origin(self) -> float:
        """Station of the profile at the road's x = 0, m."""
        return 0.0 if self.profile is None else float(self.profile.x[0]) + self.run_in

    @property
    def plan(self) -> Run:
        """The vehicle's run: from the front axle at x = 0 until the last axle leaves the road."""
        distance = self.road.length + self.vehicle.length
        dt = self.scheme.dt
        return plan(self.vehicle, self.profile, self.speed_kmh, dt, self.run_in, distance)

    @field_serializer("profile")
    def _profile_in_short(self, profile: Profile | None) -> dict[str, Any] | None:
        return in_short(profile)
