"""A study's points: each is a scenario of its own, and all share what they can."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final, NamedTuple

from pydantic import ValidationError

from pavefem._tables import explain
from pavefem._validity import listening
from pavefem.asphalt import kmh
from pavefem.cache import Recent
from pavefem.forces import Progress, TireForces
from pavefem.result import Result
from pavefem.scenario import Scenario
from pavefem.simulate import (
    HISTORIES,
    Keep,
    answer,
    check_keep,
    check_stations,
    forces_on_road,
)
from pavefem.studies.fields import PARTS, Changes, Field, changed_part, resolve
from pavefem.studies.outputs import Output, Outputs, outputs_of
from pavefem.vehicles.builder import Call

Row = tuple[Any, ...]
"""Of one point, a value for each field; for an object its number among the choices."""

MOST_FILES: Final = 256
"""Transition matrices of a study that go to the cache folder; a larger study keeps the latest of
them in memory only (the paper's take 0.6 MB each)."""

_OF_PAVEMENT: Final = (
    "temperature_c",
    "road.pavement",
    "road.ends",
    *(
        f"scheme.{name}"
        for name in (
            "foundation",
            "element_length",
            "weights",
            "tire_print",
            "hold",
            "solver",
            "order",
        )
    ),
)
"""Fields, and parts with their fields, that tire forces do not depend on."""


class Outcome(NamedTuple):
    """What became of a point."""

    values: list[float]
    """Its outputs, none if it failed."""
    error: str
    """Why it failed, or ""."""
    warning: str
    """Which laws it uses outside their range, or ""."""


class _Memory:
    """What points of one process share: parts of scenarios, and tire forces."""

    def __init__(self) -> None:
        self.parts = Recent[tuple[Any, list[str]]](budget=64)  # of one "byte" each
        self.forces = Recent[TireForces](budget=64 * 2**20)


@dataclass(frozen=True, eq=False)
class Plan:
    """What the points of a study have in common. It can be pickled.

    Attributes
    ----------
    base : Scenario
        The scenario that points differ from.
    fields : tuple of Field
        Where they differ.
    choices : tuple of (tuple or None)
        For each field the objects that a number in a row stands for; None where rows have values.
    outputs : tuple of Output
        What is asked of each point.
    keep, stations, cache
        As of `simulate`.
    files : bool
        Whether transition matrices go to the cache folder, too; not where they are many.
    call : Call, optional
        The call that made the base's vehicle.
    """

    base: Scenario
    fields: tuple[Field, ...]
    choices: tuple[tuple[Any, ...] | None, ...]
    outputs: tuple[Output, ...]
    keep: Keep
    stations: tuple[float, ...] | None
    cache: bool
    files: bool
    call: Call | None
    memory: _Memory = field(default_factory=_Memory)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "memory"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, memory=_Memory())
        if self.call is not None:
            self.base.vehicle.remember(self.call)

    def scenario(self, row: Row) -> tuple[Scenario, list[str]]:
        """Build the scenario of a point, and say which laws its parts leave."""
        update, heard = dict[str, Any](), list[str]()
        parts: dict[str, dict[str, Any]] = {"road": {}}
        for item, options, entry in zip(self.fields, self.choices, row, strict=True):
            value = entry if options is None else options[entry]
            if item.part in PARTS:
                parts.setdefault(item.part, {})[item.inner] = value
            else:
                update[item.path] = value
        for part, changes in parts.items():
            update[part], said = self._part(part, changes, row)
            heard += said
        return self.base.model_copy(update=update), heard

    def _part(self, part: str, changes: Changes, row: Row) -> tuple[Any, list[str]]:
        def make() -> tuple[Any, list[str]]:
            with listening() as heard:
                return changed_part(self.base, part, changes), heard

        key = self._key(row, lambda item: item.part == part)
        return self.memory.parts.get((part, key), 1, make)

    def run(self, row: Row, watch: Progress | None = None) -> tuple[Result, list[str]]:
        """Run a point, and say which laws it leaves."""
        with listening() as heard:
            scenario, said = self.scenario(row)
            result = answer(
                scenario,
                keep=self.keep,
                every=1,
                stations=self.stations,
                cache=self.cache,
                bar=lambda _: nullcontext(watch),
                files=self.files,
                forces_of=partial(self._forces, row),
            )
        return result, [*dict.fromkeys(said + heard)]

    def _forces(self, row: Row, scenario: Scenario, report: Progress | None) -> TireForces:
        def make() -> TireForces:
            forces = forces_on_road(scenario, report)
            for shared in (forces.time, forces.position, forces.force, forces.static_loads):
                shared.setflags(write=False)  # a function of the user's might
            return forces

        return self.memory.forces.get(self._key(row, _shapes_forces), _size(scenario), make)

    def _key(self, row: Row, is_of: Callable[[Field], bool]) -> Row:
        """Values of a point in some of the fields."""
        return tuple(entry for item, entry in zip(self.fields, row, strict=True) if is_of(item))

    def evaluate(self, row: Row, watch: Progress | None = None) -> Outcome:
        """Find the outputs of a point, or why it has none."""
        try:
            result, warnings = self.run(row, watch)
            return Outcome([output.of(result) for output in self.outputs], "", "; ".join(warnings))
        except Exception as error:  # whatever it is, it is of this point and no other
            return Outcome([], _told(error), "")

    def in_order(self, rows: Sequence[Row]) -> list[int]:
        """Put points that share what takes longest to make next to each other."""
        dense = self.base.scheme.solver == "dense"
        shapes = _shapes_matrix if dense else _shapes_forces
        first: dict[Row, int] = {}
        groups = [first.setdefault(self._key(row, shapes), i) for i, row in enumerate(rows)]
        return sorted(range(len(rows)), key=groups.__getitem__)

    def with_files_for(self, rows: Sequence[Row]) -> Plan:
        """Leave the cache folder alone where many points would fill it."""
        matrices = len({self._key(row, _shapes_matrix) for row in rows})
        return replace(self, files=self.cache and matrices <= MOST_FILES)


def plan_of(
    base: Scenario | Mapping[str, Any],
    names: Sequence[str],
    outputs: Outputs,
    *,
    choices: Sequence[tuple[Any, ...] | None] | None = None,
    keep: Keep = HISTORIES,
    stations: Sequence[float] | None = None,
    cache: bool = True,
) -> Plan:
    """Check the parts of a study and put them together."""
    if isinstance(base, Mapping):
        base = Scenario.model_validate(base)
    if not isinstance(base, Scenario):
        raise ValueError(f"base is a {type(base).__name__}: must be a Scenario or its fields")
    found = outputs_of(outputs)
    free = check_keep(keep)
    read = [free if output.keep is None else check_keep(output.keep) for output in found]
    quantities = list(dict.fromkeys(name for names in read for name in names))
    places = check_stations(stations)
    if stations is not None and all(output.keep is not None for output in found):
        raise ValueError(
            f"stations = {places.tolist()}: for functions among the outputs, which read histories; "
            f"none of {[output.name for output in found]} does"
        )
    return Plan(
        base=base,
        fields=resolve(base, names),
        choices=tuple(choices or [None] * len(names)),
        outputs=found,
        keep=quantities,
        stations=None if stations is None else tuple(places.tolist()),
        cache=cache,
        files=cache,
        call=base.vehicle.made_by,
    )


def _size(scenario: Scenario) -> int:
    """Bytes of the tire forces of a run: time, and place and force of each axle."""
    distance = scenario.road.length + scenario.vehicle.length
    steps = distance / (float(kmh(scenario.speed_kmh)) * scenario.scheme.dt)
    return int(8 * steps * (1 + 2 * len(scenario.vehicle.tires)))


def _shapes_forces(item: Field) -> bool:
    return not any(f"{item.path}.".startswith(f"{path}.") for path in _OF_PAVEMENT)


def _shapes_matrix(item: Field) -> bool:
    return item.part in ("road", "scheme", "speed_kmh", "temperature_c")


def _told(error: Exception) -> str:
    message = "; ".join(explain(error)) if isinstance(error, ValidationError) else f"{error}"
    return f"{type(error).__name__}: {message}".rstrip(": ")
