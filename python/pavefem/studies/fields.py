"""How a name reaches a field of a scenario, and how a scenario is built with other values.

A field has a path, such as ``road.pavement.asphalt.vma``. It is a field of `Scenario` or of a model
within it; of ``road``, ``pavement`` stands for the pavement of every section. Three more:
``road.length`` is the length of a road of one section, ``vehicle.*`` are the arguments of the
function that built the vehicle (`Vehicle.made_by`), and ``profile.iri`` scales the elevations of
the profile to an IRI in m/km. Any end of a path is a name for it, if no other path ends so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import lru_cache
from types import MappingProxyType
from typing import Any, Final

from pavefem._model import two_numbers
from pavefem._validity import listening, warn_validity
from pavefem.asphalt import Asphalt
from pavefem.pavement import Pavement
from pavefem.profile import Profile
from pavefem.road import Road
from pavefem.scenario import Scenario
from pavefem.scheme import Scheme
from pavefem.vehicle import Vehicle

Changes = Mapping[str, Any]
"""Values by path, the head of the path left off where the part is known."""

UNITS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "speed_kmh": "km/h",
        "temperature_c": "°C",
        "run_in": "m",
        "length": "m",
        "iri": "m/km",
        "vma": "%",
        "softening_point_c": "°C",
        "penetration_index": "1",
        "moment_of_inertia": "m⁴",
        "spacing": "m",
        "thickness": "m",
        "element_mass": "kg",
        "beam_damping": "N s/m",
        "bar_mass": "kg",
        "bar_damping": "N s/m",
        "bar_rigidity": "N",
        "asphalt_bar_stiffness": "N/m",
        "reference_temperature_c": "°C",
        "reference_vma": "%",
        "reference_speed_kmh": "km/h",
        "element_length": "m",
        "tire_print": "m",
        "dt": "s",
        "axle_spacing": "m",
        "payload": "kg",
        "wheelbase": "m",
        "pitch_inertia": "kg m²",
        "beam_inertia": "kg m²",
        "sprung_mass": "kg",
        "dry_friction": "1",
        "print_length": "m",
    }
)
"""Units of the numbers among the fields, by the last part of the path; of a builder that is not
pavefem's, none are known."""

_LONG_NAMES: Final = {"iri": "IRI", "vma": "voids in the mineral aggregate", "dt": "time step"}


@dataclass(frozen=True)
class Field:
    """A field of a scenario that a study changes."""

    name: str
    """What the user calls it."""
    path: str
    """Where it is."""
    units: str | None = None
    """Its units, if it is a number whose units are known."""

    @property
    def part(self) -> str:
        """Field of `Scenario` that it is, or is in."""
        return self.path.partition(".")[0]

    @property
    def inner(self) -> str:
        """Its path within that part; "" for the part itself."""
        return self.path.partition(".")[2]

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of a coordinate along which it varies."""
        last = self.path.rpartition(".")[2]
        plain = last.removesuffix("_c").removesuffix("_kmh").replace("_", " ")
        units = {} if self.units is None else {"units": self.units}
        return units | {"long_name": _LONG_NAMES.get(last, plain), "field": self.path}


def known_paths(base: Scenario) -> list[str]:
    """Paths of all fields of a scenario that can be changed."""
    call = base.vehicle.made_by
    parts = {
        "road": ["length", *_below(Road, "sections")],
        "road.pavement": _below(Pavement),
        "road.pavement.asphalt": _below(Asphalt),
        "vehicle": () if call is None else call.parameters,
        "profile": ["iri"],
        "scheme": _below(Scheme),
    }
    below = [f"{part}.{field}" for part, fields in parts.items() for field in fields]
    return [*Scenario.model_fields, "road.pavement", *below]


def _below(model: type[Road | Pavement | Asphalt | Scheme], *without: str) -> list[str]:
    return [name for name in model.model_fields if name not in without]


def resolve(base: Scenario, names: Sequence[str]) -> tuple[Field, ...]:
    """Find the fields that names stand for.

    Raises
    ------
    ValueError
        If a name stands for no field or for several, or one field is part of another.
    """
    known = known_paths(base)
    fields = tuple(_resolve(base, name, known) for name in names)
    for field in fields:
        for other in fields:
            if other is not field and f"{other.path}.".startswith(f"{field.path}."):
                raise ValueError(
                    f"{field.name} and {other.name} overlap: {other.path} is part of {field.path}"
                )
    return fields


def _resolve(base: Scenario, name: str, known: Sequence[str]) -> Field:
    if not isinstance(name, str):
        raise ValueError(f"{name!r} is no field: must be the name of one, such as speed_kmh")
    found = [path for path in known if f".{path}".endswith(f".{name}")]
    # A whole path is that path, whatever else ends so.
    found = [name] if name in found else found
    if len(found) > 1:
        raise ValueError(f"{name} is not one field but {len(found)}: say {' or '.join(found)}")
    if found:
        [path] = found
        call = base.vehicle.made_by
        own = call is not None and not call.function.__module__.startswith("pavefem.")
        foreign = path.startswith("vehicle.") and own
        return Field(name, path, None if foreign else UNITS.get(path.rpartition(".")[2]))
    names = {path.rpartition(".")[2]: path for path in known} | {path: path for path in known}
    near = get_close_matches(name, names, n=3, cutoff=0.6)
    hint = f"; near it: {', '.join(near)}" if near else ""
    if base.vehicle.made_by is None:
        hint += (
            f"; arguments of the vehicle are not known, because {base.vehicle.name!r} was not "
            "built by a function of pavefem.vehicles or one marked pavefem.vehicles.builder"
        )
    raise ValueError(f"{name} is no field of the scenario{hint}. Fields: {', '.join(known)}")


def checked_bounds(
    parameters: Mapping[str, tuple[float, float]],
) -> dict[str, tuple[float, float]]:
    """Take the two values between which each parameter lies.

    Raises
    ------
    ValueError
        If there is no parameter, or values are not two finite numbers, the lower one first.
    """
    if not isinstance(parameters, Mapping) or not parameters:
        raise ValueError(
            f"parameters = {parameters!r}: must be names of one or more with their bounds"
        )
    checked = {}
    for name, pair in parameters.items():
        if not isinstance(name, str):
            raise ValueError(f"parameters has the name {name!r}: must be text")
        low, high = two_numbers(f"bounds of {name}", pair)
        if not low < high:
            raise ValueError(f"bounds of {name} are {low:g} and {high:g}: the first must be lower")
        checked[name] = low, high
    return checked


# --- parts of a scenario with other values ------------------------------------------------------


def changed_part(base: Scenario, part: str, changes: Changes) -> Any:
    """Build one of `PARTS` with other values; ``""`` among the changes is the part as a whole."""
    inner = dict(changes)
    whole = inner.pop("", getattr(base, part))
    if part == "scheme" and isinstance(whole, str):
        whole = Scheme.named(whole)
    if part == "road" or inner:
        return PARTS[part](whole, inner)
    return whole


def _road(road: Road, changes: Changes) -> Road:
    """Build the road anew: what its pavements keep, and warn of once, is not the base's."""
    if not isinstance(road, Road):
        return road  # the scenario says what is wrong
    inner = dict(changes)
    length = inner.pop("length", None)
    if length is not None and len(road.sections) > 1:
        raise ValueError(f"length = {length}: the road has {len(road.sections)} sections")
    ends = inner.pop("ends", road.ends)
    sections = [
        section.model_copy(
            update={
                "pavement": _pavement(inner.get("pavement", section.pavement), inner),
                "length": section.length if length is None else length,
            }
        )
        for section in road.sections
    ]
    made = road.model_copy(update={"sections": sections, "ends": ends})
    for section in made.sections:
        _ = section.pavement.reference_modulus
    return made


def _pavement(pavement: Pavement, changes: Changes) -> Pavement:
    if not isinstance(pavement, Pavement):
        return pavement
    own = _within("pavement", changes)
    asphalt = own.get("asphalt", pavement.asphalt)
    if mix := _within("asphalt", own):
        asphalt = asphalt.model_copy(update=mix)
    plain = {key: value for key, value in own.items() if "." not in key}
    return pavement.model_copy(update=plain | {"asphalt": asphalt})


def _within(part: str, changes: Changes) -> dict[str, Any]:
    prefix = f"{part}."
    return {
        key.removeprefix(prefix): value for key, value in changes.items() if key.startswith(prefix)
    }


def _vehicle(vehicle: Vehicle, changes: Changes) -> Vehicle:
    if vehicle.made_by is None:
        raise ValueError(f"no function is known that builds {vehicle.name!r}")
    return vehicle.made_by(**changes)


def _profile(profile: Profile | None, changes: Changes) -> Profile:
    iri = changes["iri"]
    if profile is None:
        raise ValueError(f"iri = {iri} m/km: the base has no profile to scale")
    if not iri > 0.0:
        raise ValueError(f"iri = {iri} m/km: must be above 0")
    own, heard = _iri(profile)
    for message in heard:
        warn_validity(message)
    if not own > 0.0:
        raise ValueError(f"iri = {iri} m/km: profile {profile.name!r} is smooth")
    scale = iri / own
    tracks = {name: scale * z for name, z in profile.tracks.items()}
    return replace(profile, z=scale * profile.z, tracks=tracks)


@lru_cache(maxsize=16)
def _iri(profile: Profile) -> tuple[float, list[str]]:
    """IRI of a profile, m/km, and what it warns of: of every point, though found once."""
    with listening() as heard:
        return profile.iri(), heard


def _scheme(scheme: Scheme, changes: Changes) -> Scheme:
    return scheme.model_copy(update=changes)


PARTS: Final[Mapping[str, Callable[[Any, Changes], Any]]] = MappingProxyType(
    {"road": _road, "vehicle": _vehicle, "profile": _profile, "scheme": _scheme}
)
"""Fields of `Scenario` that have fields of their own, and how to build them with other values."""
