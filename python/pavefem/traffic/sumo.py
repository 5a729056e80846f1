"""Floating-car data of SUMO: where each vehicle is, at equal intervals of time.

Source: https://sumo.dlr.de/docs/Simulation/Output/FCDOutput.html
"""

from __future__ import annotations

import csv
import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple
from xml.etree import ElementTree

from pavefem import vehicles
from pavefem.errors import FormatError
from pavefem.traffic.table import Traffic
from pavefem.vehicle import Vehicle

_LEAST: Final = 2
"""Fewest samples of a passage: between two there is a speed."""


class Sample(NamedTuple):
    """Where a vehicle is."""

    line: int
    """Where in the file that stands; 0 where there are no lines."""
    time: float
    name: str
    kind: str
    place: float
    lane: str


def read_sumo(
    path: str | os.PathLike[str],
    kinds: Mapping[str, Vehicle | str],
    *,
    ignore: Collection[str] = (),
    edges: Sequence[tuple[str, float]] | None = None,
    on_error: str = "refuse",
) -> Traffic:
    """Read floating-car data, as XML, CSV or Parquet.

    Speeds are constant between two samples, so that places are those of the file. The place is
    that of the front bumper, taken for the front axle's. A change of lane ends one passage, at the
    first sample in the new lane, and begins another. XML and CSV are streamed.

    Parameters
    ----------
    path : path
        A file whose name ends in ``.xml``, ``.csv`` (columns separated by ``;``) or ``.parquet``.
    kinds : mapping of str to Vehicle or str
        What each type of vehicle is: a vehicle, or the name of a preset.
    ignore : collection of str
        Types that are left out, and counted.
    edges : sequence of (str, float), optional
        Edges that make the road, in their order, with their lengths, m; without, there must be
        one. Samples on other edges are left out, and counted.
    on_error : {"refuse", "skip"}
        Whether a broken record is an error, or left out, counted and told of by `problems`.

    Returns
    -------
    Traffic
        `counts` has the samples ``read``, ``kept``, ``ignored`` and ``broken``.

    Raises
    ------
    FormatError
        If the file is not of this format; with the line, where there is one.
    ValueError
        If a type is not known, or an argument out of range.
    ImportError
        If pandas or pyarrow is not installed, for Parquet.
    """
    path = Path(path)
    if on_error not in ("refuse", "skip"):
        raise ValueError(f'on_error = {on_error!r}: must be "refuse" or "skip"')
    fleet = {kind: _vehicle(kind, given) for kind, given in kinds.items()}
    begins = None if edges is None else _begins(edges)
    counts = dict.fromkeys(("read", "kept", "ignored", "broken"), 0)
    problems: list[tuple[int, str]] = []
    only: str | None = None
    tracks: dict[str, list[Sample]] = {}
    for record in _records(path):
        counts["read"] += 1
        try:
            sample = _sample(record)
        except ValueError as error:
            if on_error == "refuse":
                raise FormatError(str(error), path=path, line=record.line or None) from None
            counts["broken"] += 1
            problems.append((record.line, str(error)))
            continue
        edge = sample.lane.rpartition("_")[0]
        if sample.kind in ignore or (begins is not None and edge not in begins):
            counts["ignored"] += 1
            continue
        if sample.kind not in fleet:
            raise ValueError(
                f"{path.name}: vehicle {sample.name!r} is of type {sample.kind!r}: must be one of "
                f"{[*fleet]}, or of those to ignore"
            )
        if begins is None:
            only = only or edge
            if edge != only:
                raise ValueError(f"{path.name} has edges {only!r} and {edge!r}: name them in edges")
        else:
            sample = sample._replace(place=sample.place + begins[edge])
        counts["kept"] += 1
        tracks.setdefault(sample.name, []).append(sample)
    return _traffic(tracks, fleet, counts, problems)


def _vehicle(kind: str, given: Vehicle | str) -> Vehicle:
    if isinstance(given, Vehicle):
        return given
    if isinstance(given, str):
        return vehicles.named(given)
    raise ValueError(f"kinds[{kind!r}] is a {type(given).__name__}: must be a Vehicle or a name")


def _begins(edges: Sequence[tuple[str, float]]) -> dict[str, float]:
    begins, place = {}, 0.0
    for edge, length in edges:
        begins[edge] = place
        place += length
    return begins


class _Record(NamedTuple):
    line: int
    values: Mapping[str, Any]


def _sample(record: _Record) -> Sample:
    """Make a sample of a record, or raise a ValueError that says what is wrong."""
    values = record.values
    numbers = {}
    for name in ("time", "pos"):
        try:
            numbers[name] = float(values[name])
        except (KeyError, TypeError, ValueError):
            raise ValueError(f"{name} = {values.get(name)!r}: must be a number") from None
        if not abs(numbers[name]) < 1e8:
            raise ValueError(f"{name} = {numbers[name]}: must be finite and below 1e8")
    for name in ("id", "type", "lane"):
        if not values.get(name):
            raise ValueError(f"{name} is missing")
    lane = str(values["lane"])
    if not lane.rpartition("_")[2].isdecimal():
        raise ValueError(f"lane = {lane!r}: must be edge_number")
    name, kind = str(values["id"]), str(values["type"])
    return Sample(record.line, numbers["time"], name, kind, numbers["pos"], lane)


def _records(path: Path) -> Iterator[_Record]:
    kinds = {".xml": _from_xml, ".csv": _from_csv, ".parquet": _from_parquet}
    if path.suffix.lower() not in kinds:
        raise ValueError(f"{path.name}: must end in one of {', '.join(kinds)}")
    return kinds[path.suffix.lower()](path)


def _from_xml(path: Path) -> Iterator[_Record]:
    time = None
    try:
        for event, element in ElementTree.iterparse(path, events=("start", "end")):
            if element.tag == "timestep" and event == "start":
                time = element.get("time")
            elif element.tag == "vehicle" and event == "end":
                yield _Record(0, {**element.attrib, "time": time})
            elif element.tag == "timestep":
                element.clear()
    except ElementTree.ParseError as error:
        line = error.position[0]
        raise FormatError(f"is not XML: {error}", path=path, line=line) from None


def _from_csv(path: Path) -> Iterator[_Record]:
    with path.open(newline="", encoding="utf-8") as file:
        try:
            rows = csv.reader(file, delimiter=";")
            header = next(rows, [])
            names = [name.removeprefix("vehicle_").removeprefix("timestep_") for name in header]
            missing = {"time", "id", "type", "pos", "lane"} - set(names)
            if missing:
                raise FormatError(f"has no column for {sorted(missing)}", path=path, line=1)
            for line, row in enumerate(rows, start=2):
                record = dict(zip(names, row, strict=False))
                if record.get("id") or len(row) != len(names):
                    yield _Record(line, record)
        except (UnicodeDecodeError, csv.Error) as error:
            raise FormatError(f"is not CSV: {error}", path=path) from None


def _from_parquet(path: Path) -> Iterator[_Record]:
    import pandas as pd

    table = pd.read_parquet(path)
    names = [str(name).removeprefix("vehicle_").removeprefix("timestep_") for name in table.columns]
    missing = {"time", "id", "type", "pos", "lane"} - set(names)
    if missing:
        raise FormatError(f"has no column for {sorted(missing)}", path=path)
    for row in table.itertuples(index=False, name=None):
        record = dict(zip(names, row, strict=True))
        if isinstance(record["id"], str) and record["id"]:
            yield _Record(0, record)


def _traffic(
    tracks: Mapping[str, Sequence[Sample]],
    fleet: Mapping[str, Vehicle],
    counts: Mapping[str, int],
    problems: Sequence[tuple[int, str]],
) -> Traffic:
    """Cut each vehicle's track where it changes its lane."""
    kinds = list(fleet)
    rows: list[tuple[int, float, float, int, str]] = []
    courses: list[tuple[list[float], list[float]]] = []
    for name, track in tracks.items():
        for stretch in _stretches(track):
            times = [sample.time for sample in stretch]
            places = [sample.place for sample in stretch]
            speed = (places[1] - places[0]) / (times[1] - times[0])
            # Lanes of SUMO count from 0, on the right.
            lane = int(stretch[0].lane.rpartition("_")[2]) + 1
            rows.append((kinds.index(stretch[0].kind), times[0], 3.6 * speed, lane, name))
            courses.append((times, places))
    number, entry, speeds, lanes, names = zip(*rows, strict=True) if rows else ([],) * 5
    return Traffic(
        list(fleet.values()),
        number,
        entry,
        speeds,
        lanes,
        vehicle_id=names,
        courses=courses,
        counts=counts,
        problems=problems,
    )


def _stretches(track: Sequence[Sample]) -> Iterator[list[Sample]]:
    """Stretches in one lane each; the first sample in the next lane ends one."""
    stretch: list[Sample] = []
    for sample in track:
        if stretch and sample.lane.rpartition("_")[2] != stretch[-1].lane.rpartition("_")[2]:
            ended = [*stretch, sample._replace(lane=stretch[-1].lane)]
            yield ended
            stretch = []
        stretch.append(sample)
    if len(stretch) >= _LEAST:
        yield stretch
