"""What traffic does to a road: extremes, peaks and sums over all passes, and what each one did."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, Self

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pavefem._files import replacing
from pavefem._model import finite_number, whole_number
from pavefem.errors import FormatError
from pavefem.traffic_scenario import TrafficScenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Of = Literal["deflection", "strain", "force"]
"""What damage is counted of."""

_TITLE: Final = "Pavement response to traffic"

_METRES: Final = {"units": "m"}
_NODES: Final = {
    "lowest": ("lowest", _METRES | {"long_name": "lowest deflection"}),
    "highest": ("highest", _METRES | {"long_name": "highest deflection"}),
    "time_of_lowest": (
        "time_of_lowest",
        {"units": "s", "long_name": "time of the lowest deflection"},
    ),
    "max_strain": (
        "strain",
        {"units": "1", "long_name": "largest strain of the bottom fibre", "positive": "tension"},
    ),
    "max_force": ("force", {"units": "N", "long_name": "largest force of a wheel track"}),
    "passes": ("passes", {"units": "1", "long_name": "axles that passed"}),
    "pass_peaks": ("histogram", {"units": "1", "long_name": "axles by their peak of deflection"}),
    "deflection_sums": (
        "deflection_powers",
        {"units": "m**power", "long_name": "sum of powers of the peaks of deflection"},
    ),
    "strain_sums": (
        "strain_powers",
        {"units": "1", "long_name": "sum of powers of the peaks of strain"},
    ),
    "force_sums": (
        "force_powers",
        {"units": "N**power", "long_name": "sum of powers of the forces of passes"},
    ),
}
"""What there is of each node of each lane: its name in the core, and its attributes."""

_OF_NODES: Final[Mapping[str, tuple[str, ...]]] = {
    "pass_peaks": ("lane", "x", "bin"),
    **dict.fromkeys(("deflection_sums", "strain_sums", "force_sums"), ("lane", "x", "power")),
}
"""Dimensions of those that have more than two."""

_PASSAGES: Final = {
    "instants": ("1", "instants that its forces are of"),
    "dlc": ("1", "largest dynamic load coefficient of the axles"),
    "max_axle_force": ("N", "largest tire force of an axle"),
    "place_of_force": ("m", "place of that axle then"),
    "axle_of_force": ("1", "number of that axle"),
    "max_deflection": ("m", "largest deflection as one of the axles passed"),
    "place_of_deflection": ("m", "place of the node where that was"),
    "max_passage_strain": ("1", "largest strain as one of the axles passed"),
    "entry": ("s", "when it comes onto the lane"),
    "exit": ("s", "when it has left it"),
}
"""What there is of each passage, in the order of the core."""

_WHO: Final = ("vehicle", "vehicle_id", "passage_lane", "entry_speed_kmh", "lateral_offset")
"""Who each passage is."""

_ATTRIBUTES: Final = ("temperature_c", "road_length", "dt", "every", "scenario")
"""What is said of a run beside its work."""


class Work(NamedTuple):
    """How far a run is, and what it took."""

    inputs: str
    """Digest of what all parts of a run have in common."""
    begin: float
    """From when axles count, s,"""
    end: float
    """and until when, s."""
    done: float
    """How far it is, s."""
    finished: bool
    """Whether it is finished."""
    vehicle_seconds: float
    """Time that vehicles have been on the road, all together, s."""
    wall_time: float
    """How long it took, s."""

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of a dataset."""
        return self._asdict() | {"finished": int(self.finished)}


@dataclass(frozen=True, eq=False, repr=False)
class TrafficResult:
    """The answer of a road to traffic.

    Deflections are up positive: a loaded pavement reads negative; peaks are magnitudes.

    Attributes
    ----------
    dataset : xarray.Dataset
        All of it, with units. Of (lane, x): `lowest`, `highest`, `time_of_lowest`, `max_strain`,
        `max_force`, `passes`; and `pass_peaks` by (bin), `deflection_sums`, `strain_sums` and
        `force_sums` by (power). Of (passage): who it is (`vehicle`, `vehicle_id`, `passage_lane`,
        `entry_speed_kmh`, `lateral_offset`) and what it did (`dlc`, `max_axle_force`,
        `max_deflection`, ...). `deflection` of (time, lane, station), if kept. Lanes of the other
        direction have numbers below 0.
    """

    dataset: xr.Dataset

    @classmethod
    def of(
        cls,
        scenario: TrafficScenario,
        *,
        nodes: NDArray[np.float64],
        lanes: Sequence[Mapping[str, NDArray[Any]]],
        passages: NDArray[np.float64],
        work: Work,
    ) -> Self:
        """Make a result of what the core has."""
        length = scenario.road.length
        counts = counted(nodes, scenario.stretch)
        variables: dict[str, Any] = {}
        for name, (key, attributes) in _NODES.items():
            # Who comes the other way counts nodes from the road's end.
            rows = [
                (found[key] if lane > 0 else found[key][::-1])[counts]
                for lane, found in zip(scenario.lanes, lanes, strict=True)
            ]
            values = np.stack(rows)
            if values.dtype == np.uint64:
                values = values.astype(np.int64)
            variables[name] = (_OF_NODES.get(name, ("lane", "x")), values, attributes)
        edges = np.array([0.0, *scenario.bins, math.inf])
        dataset = xr.Dataset(
            variables | _of_passages(scenario, passages),
            coords={
                "lane": ("lane", scenario.lanes, {"long_name": "lane, below 0 against x"}),
                "x": ("x", nodes[counts], _METRES | {"long_name": "place along the road"}),
                "power": ("power", np.array(scenario.powers)),
                "bin_start": ("bin", edges[:-1], _METRES),
                "bin_end": ("bin", edges[1:], _METRES),
            },
            attrs={
                "title": _TITLE,
                "pavefem_version": version("pavefem"),
                "temperature_c": scenario.temperature_c,
                "road_length": length,
                "dt": scenario.scheme.dt,
                "every": scenario.every,
                "scenario": scenario.model_dump_json(),
            }
            | work.attributes,
        )
        if places := stations_of(scenario):
            dataset = dataset.assign_coords(station=("station", np.array(places), _METRES))
        return cls(dataset)

    def with_history(self, blocks: Iterable[NDArray[np.float64]]) -> Self:
        """Put the histories of the stations to it, rows after rows; nothing without stations."""
        if "station" not in self.dataset:
            return self
        shape = self.dataset.sizes["lane"], self.dataset.sizes["station"]
        rows = np.concatenate([np.empty((0, math.prod(shape))), *blocks])
        attrs = self.dataset.attrs
        # Rows are of ticks that are whole multiples, from whenever they are kept.
        first = -(-round(attrs["begin"] / attrs["dt"]) // attrs["every"])
        time = attrs["dt"] * (attrs["every"] * np.arange(first, first + len(rows)))
        attributes = _METRES | {"long_name": "deflection", "positive": "up"}
        values = rows.reshape(len(rows), *shape)
        dataset = self.dataset.assign_coords(time=("time", time, {"units": "s"}))
        return type(self)(
            dataset.assign(deflection=(("time", "lane", "station"), values, attributes))
        )

    def with_attributes(self, **attributes: Any) -> Self:
        """Put attributes to its dataset."""
        return type(self)(self.dataset.assign_attrs(attributes))

    def __repr__(self) -> str:
        sizes, state = self.dataset.sizes, "" if self.is_finished else f", {self.so_far}"
        return (
            f"TrafficResult({sizes['passage']} passages on {sizes['lane']} lanes, "
            f"{self.dataset.attrs['road_length']:g} m of road, "
            f"max_deflection {self.max_deflection * 1e3:.4f} mm{state})"
        )

    @property
    def is_finished(self) -> bool:
        """Whether the run is; if not, this is what it came to so far."""
        return bool(self.dataset.attrs["finished"])

    @property
    def so_far(self) -> str:
        """How far the run is, for people to read."""
        return f"{self.dataset.attrs['done']:.5g} s of {self.dataset.attrs['end']:.5g} s"

    @property
    def max_deflection(self) -> float:
        """Magnitude of the lowest deflection of any node at any time, m."""
        return max(0.0, -float(self.dataset["lowest"].min()))

    @property
    def envelope(self) -> xr.Dataset:
        """Lowest and highest deflection of every node, m, and when it was lowest, s."""
        return self.dataset[["lowest", "highest", "time_of_lowest"]]

    @property
    def load_cycles(self) -> xr.DataArray:
        """Axles that passed, of (lane, x)."""
        return self.dataset["passes"]

    @property
    def passages(self) -> xr.Dataset:
        """What each vehicle did in each lane: a table of (passage)."""
        names = [name for name, values in self.dataset.items() if values.dims == ("passage",)]
        table = self.dataset[names]
        return table.drop_vars([name for name in table.coords if name != "passage"])

    def pass_peaks(self, lane: int, x: float) -> xr.DataArray:
        """Count the axles that passed the node nearest to a place, by their peak of deflection.

        Returns
        -------
        xarray.DataArray
            Of (bin), from `bin_start` to `bin_end`, m; the first and the last bin hold what is
            below and above all edges.

        Raises
        ------
        ValueError
            If there is no such lane, or the place is not on the part of the road that counts.
        """
        return self.dataset["pass_peaks"].isel(self._node(lane, x))

    def history(self, lane: int, x: float) -> xr.DataArray:
        """Deflection over time at a station of a lane, m.

        Raises
        ------
        ValueError
            If none was kept there.
        """
        kept = self.dataset["station"].to_numpy().tolist() if "station" in self.dataset else []
        place = finite_number("x", x)
        number = self._lane(lane)
        for column, station in enumerate(kept):
            if abs(station - place) <= 1e-9 * max(1.0, abs(place)):
                return self.dataset["deflection"][:, number, column]
        raise ValueError(
            f"no history was kept at x = {x:g} m, only at {kept}: run with stations=[{x:g}]"
        )

    def damage(self, exponent: float = 4.0, *, of: Of = "strain", reference: float) -> xr.DataArray:
        """Sum of ``(peak / reference)**exponent`` over all passes.

        With ``of="force"`` and a reference of 40 kN, the wheel track of an axle of 80 kN, it is the
        number of such axles that do the same by the fourth-power law.

        Between two powers that were kept (and 0, the number of passes), the logarithm of the sum is
        that of a cubic through the nearest ones. It is a convex function of the exponent; so the
        true sum lies between the chord and its neighbours prolonged, to which the cubic is held.

        Parameters
        ----------
        exponent : float
            Not above the largest power that was kept; exact where it is one of them.
        of : {"strain", "deflection", "force"}
            The largest strain of the bottom fibre while an axle is the nearest, the largest
            deflection then, m, or the force of the wheel track as it passes, N.
        reference : float
            What one is counted for.

        Returns
        -------
        xarray.DataArray
            Of (lane, x). The attribute `error` bounds the relative error of its interpolation, 0
            where the exponent was kept.

        Raises
        ------
        ValueError
            If the exponent is below 0 or above all powers that were kept, or a value is not known.
        """
        exponent, reference = (
            finite_number("exponent", exponent),
            finite_number("reference", reference),
        )
        if of not in ("deflection", "strain", "force"):
            raise ValueError(f'of = {of!r}: must be "deflection", "strain" or "force"')
        if not reference > 0.0:
            raise ValueError(f"reference = {reference:g}: must be above 0")
        powers = [0.0, *self.dataset["power"].to_numpy().tolist()]
        if not 0.0 <= exponent <= powers[-1]:
            raise ValueError(
                f"exponent = {exponent:g}: must be 0 to {powers[-1]:g}, the largest power that "
                "was kept; run with powers=(...) up to what is needed"
            )
        passes = self.dataset["passes"].to_numpy()[..., np.newaxis]
        sums = np.concatenate([passes, self.dataset[f"{of}_sums"].to_numpy()], axis=-1)
        total, error = _between(np.array(powers), sums, exponent)
        total = total * reference**-exponent
        attributes = {
            "units": "1",
            "long_name": f"sum of ({of} / {reference:g})**{exponent:g} over all passes",
            "error": error,
        }
        return xr.DataArray(
            total, self.dataset["passes"].coords, ("lane", "x"), "damage", attributes
        )

    def worst(self, n: int = 10, *, apart: float = 10.0, exponent: float = 4.0) -> xr.Dataset:
        """Rank the places with the largest deflections.

        Parameters
        ----------
        n : int
            How many.
        apart : float
            Least distance between two of a lane, m.
        exponent : float
            Of the damage by strain, which is given beside the mean of all nodes.

        Returns
        -------
        xarray.Dataset
            Of (rank), from 1: `lane`, `x` (m), `max_deflection` (m), `time` (s), `passes`,
            `relative_damage`. Fewer than `n` where the road has no more. `to_dataframe()` prints.
        """
        n = whole_number("n", n)
        dataset = self.dataset
        lowest, x = dataset["lowest"].to_numpy(), dataset["x"].to_numpy()
        damage = self.damage(exponent, of="strain", reference=1.0)
        mean = float(damage.mean())
        damage = damage / mean if mean > 0.0 else damage
        left = lowest < 0.0
        found: list[tuple[int, int]] = []
        while len(found) < n and left.any():
            lane, node = np.unravel_index(np.where(left, lowest, 0.0).argmin(), lowest.shape)
            found.append((int(lane), int(node)))
            left[lane, np.abs(x - x[node]) < apart] = False
        lanes, nodes = np.array(found, dtype=np.int64).reshape(-1, 2).T
        of_rank = xr.DataArray(lanes, dims="rank"), xr.DataArray(nodes, dims="rank")
        at = {"lane": of_rank[0], "x": of_rank[1]}
        return xr.Dataset(
            {
                "lane": ("rank", dataset["lane"].to_numpy()[lanes]),
                "x": ("rank", x[nodes], _METRES),
                "max_deflection": ("rank", -lowest[lanes, nodes], _METRES),
                "time": dataset["time_of_lowest"].isel(at).variable,
                "passes": dataset["passes"].isel(at).variable,
                "relative_damage": (
                    "rank",
                    damage.to_numpy()[lanes, nodes],
                    {"units": "1", "long_name": f"damage ~ strain**{exponent:g} / mean"},
                ),
            },
            coords={"rank": np.arange(1, len(found) + 1)},
        )

    def worst_vehicles(
        self,
        n: int = 10,
        *,
        by: Literal["max_deflection", "max_passage_strain", "max_axle_force", "dlc"] = (
            "max_deflection"
        ),
    ) -> xr.Dataset:
        """Rank the passages of vehicles, the worst one first.

        Returns
        -------
        xarray.Dataset
            The table `passages`, its first `n` rows by what is asked for, of (passage).
        """
        n = whole_number("n", n)
        choices = ("max_deflection", "max_passage_strain", "max_axle_force", "dlc")
        if by not in choices:
            raise ValueError(f"by = {by!r}: must be one of {list(choices)}")
        table = self.passages
        values = table[by].to_numpy()
        order = np.argsort(-values, kind="stable")  # NaN, of who has not left yet, comes last
        return table.isel(passage=order[:n])

    def summary(self) -> dict[str, str]:
        """Return the figures an engineer looks at first, as text with units, by what they are."""
        dataset, attrs = self.dataset, self.dataset.attrs
        figures = {} if self.is_finished else {"not finished": self.so_far}
        figures |= {
            "road": (
                f"{attrs['road_length']:g} m, {dataset.sizes['lane']} lanes "
                f"({', '.join(f'{lane}' for lane in dataset['lane'].to_numpy())})"
            ),
            "temperature": f"{attrs['temperature_c']:g} °C",
            "nodes": f"{dataset.sizes['x']} in each lane",
            "time": f"{attrs['begin']:.5g} to {attrs['end']:.5g} s",
            "passages of vehicles": f"{dataset.sizes['passage']}",
            "axle passes": f"{int(dataset['passes'].max())} at most at a node",
        }
        deepest = self.worst(1)
        if deepest.sizes["rank"]:
            first = deepest.isel(rank=0)
            figures["largest deflection"] = (
                f"{float(first['max_deflection']) * 1e3:.4f} mm in lane {int(first['lane'])} at "
                f"x = {float(first['x']):g} m, t = {float(first['time']):.3f} s"
            )
        figures["largest strain"] = f"{float(dataset['max_strain'].max()) * 1e6:.1f} µm/m"
        figures["largest wheel-track force"] = f"{float(dataset['max_force'].max()) / 1e3:.2f} kN"
        dlc = dataset["dlc"].to_numpy()
        if np.isfinite(dlc).any():
            figures["dynamic load coefficient"] = (
                f"{np.nanmean(dlc):.3f} in the mean, {np.nanmax(dlc):.3f} at most"
            )
        if attrs["wall_time"] > 0.0:
            figures["throughput"] = (
                f"{self.throughput:.4g} vehicle-seconds a second, "
                f"{(attrs['done'] - attrs['begin']) / attrs['wall_time']:.3g} times real time"
            )
        return figures

    @property
    def throughput(self) -> float:
        """Time that vehicles were on the road, all together, in a second of work."""
        return float(self.dataset.attrs["vehicle_seconds"] / self.dataset.attrs["wall_time"])

    def plot(self) -> Figure:
        """Draw a map, lane by distance, of the largest deflections."""
        from pavefem import plotting  # matplotlib takes half a second to import

        return plotting.plot_traffic_map(self)

    def plot_time_distance(self) -> Figure:
        """Draw where each vehicle is over time, and the worst places when they are."""
        from pavefem import plotting  # matplotlib takes half a second to import

        return plotting.plot_time_distance(self)

    def to_netcdf(self, path: str | os.PathLike[str]) -> None:
        """Write a file that `load_traffic_result` reads back; an old one is replaced as a whole.

        Raises
        ------
        OSError
            If the folder does not exist or cannot be written. The result itself is not touched.
        """
        with replacing(path) as file:
            self.dataset.to_netcdf(file, engine="h5netcdf")

    @classmethod
    def merge(cls, results: Iterable[TrafficResult]) -> Self:
        """Put parts of one run together: stretches of the road, parts of the time, or both.

        Counts and sums are added, extremes taken, stretches laid end to end: what the whole run
        answers, but for rounding in the sums.

        Parameters
        ----------
        results : iterable of TrafficResult
            Of runs that differ in `part` and `period` only: each stretch once for each period.

        Raises
        ------
        ValueError
            If they are not parts of one run that do not overlap.
        """
        from pavefem.traffic_merge import merged  # it is made of results

        return cls(merged([result.dataset for result in results]))

    def _lane(self, lane: int) -> int:
        lanes: list[int] = self.dataset["lane"].to_numpy().tolist()
        if lane not in lanes:
            raise ValueError(f"lane = {lane!r}: must be one of {lanes}")
        return lanes.index(lane)

    def _node(self, lane: int, x: float) -> dict[str, int]:
        place, nodes = finite_number("x", x), self.dataset["x"].to_numpy()
        if not nodes[0] <= place <= nodes[-1]:
            raise ValueError(f"x = {x:g} m: must be within {nodes[0]:g} to {nodes[-1]:g} m")
        return {"lane": self._lane(lane), "x": int(np.abs(nodes - place).argmin())}


def _of_passages(
    scenario: TrafficScenario, seen: NDArray[np.float64]
) -> dict[str, tuple[str, NDArray[Any], dict[str, Any]]]:
    """Who the passages are, and what they did."""
    traffic, length = scenario.traffic, scenario.road.length
    names = np.array([vehicle.name for vehicle in traffic.vehicles])
    lane = scenario.lane_of
    table = dict(zip(_PASSAGES, seen.T.copy(), strict=True))
    table["axle_of_force"] += 1.0
    # On a smooth road nobody rolls: forces are static.
    is_smooth = np.array([profile is None for profile in scenario.profiles])
    smooth = is_smooth[np.searchsorted(scenario.lanes, lane)]
    loads = [vehicle.static_loads for vehicle in traffic.vehicles]
    table["dlc"][smooth] = 0.0
    table["max_axle_force"][smooth] = np.array([load.max() for load in loads])[
        traffic.vehicle[smooth]
    ]
    table["axle_of_force"][smooth] = (
        1.0 + np.array([load.argmax() for load in loads])[traffic.vehicle[smooth]]
    )
    # Places are counted along x from here on.
    for name in ("place_of_force", "place_of_deflection"):
        table[name] = np.where(traffic.direction > 0, table[name], length - table[name])
    table["exit"][np.isinf(table["exit"])] = np.nan
    who = (
        names[traffic.vehicle],
        np.asarray(traffic.vehicle_id).astype(str),
        lane,
        traffic.speed_kmh,
        traffic.lateral_offset,
    )
    units: tuple[dict[str, str], ...] = ({}, {}, {}, {"units": "km/h"}, _METRES)
    found: dict[str, tuple[str, NDArray[Any], dict[str, Any]]] = {
        name: ("passage", values, unit) for name, values, unit in zip(_WHO, who, units, strict=True)
    }
    for name, (unit_of, words) in _PASSAGES.items():
        found[name] = ("passage", table[name], {"units": unit_of, "long_name": words})
    return found | _courses(scenario, table["exit"])


def _courses(
    scenario: TrafficScenario, exits: NDArray[np.float64]
) -> dict[str, tuple[str, NDArray[Any], dict[str, Any]]]:
    """Where front axles are over time, as far as speeds change."""
    traffic, length = scenario.traffic, scenario.road.length
    starts, ends = traffic.breaks_start[:-1], traffic.breaks_start[1:] - 1
    number = np.repeat(np.arange(len(traffic)), np.diff(traffic.breaks_start))
    time, place = traffic.breaks_time, traffic.breaks_place
    # Who keeps one speed goes on to the end of the road.
    steady = np.flatnonzero((starts == ends) & np.isfinite(exits))
    begins = starts[steady]
    gone = (exits[steady] - time[begins]) * traffic.speed_kmh[steady] / 3.6
    place = np.insert(place, begins + 1, place[begins] + gone)
    time = np.insert(time, begins + 1, exits[steady])
    number = np.insert(number, begins + 1, steady)
    forward = traffic.direction[number] > 0
    return {
        "course_passage": ("course", number, {"long_name": "passage, counted from 0"}),
        "course_time": ("course", time, {"units": "s"}),
        "course_x": (
            "course",
            np.where(forward, place, length - place),
            _METRES | {"long_name": "place of the front axle"},
        ),
    }


def counted(nodes: NDArray[np.float64], stretch: tuple[float, float]) -> NDArray[np.bool_]:
    """Which nodes count: those of a stretch, without its end unless that is the road's."""
    start, end = stretch
    ahead = nodes < (end - 1e-9 if end < nodes[-1] else math.inf)
    counts: NDArray[np.bool_] = (nodes >= start - 1e-9) & ahead
    return counts


def stations_of(scenario: TrafficScenario) -> list[float]:
    """Stations on the stretch that counts, m."""
    start, end = scenario.stretch
    last = end if end < scenario.road.length else math.inf
    return [place for place in scenario.stations if start <= place < last]


def _between(
    powers: NDArray[np.float64], sums: NDArray[np.float64], exponent: float
) -> tuple[NDArray[np.float64], float]:
    """Sum at an exponent, of those at some powers along the last axis; and its relative error."""
    after = int(np.searchsorted(powers, exponent))
    if powers[after] == exponent:
        return sums[..., after].astype(np.float64), 0.0
    before, last = after - 1, powers.size - 1
    logs = np.log(np.where(sums > 0.0, sums, 1.0))

    def line(i: int, j: int) -> NDArray[np.float64]:
        part = (exponent - powers[i]) / (powers[j] - powers[i])
        found: NDArray[np.float64] = logs[..., i] + part * (logs[..., j] - logs[..., i])
        return found

    high = line(before, after)
    # A convex function lies above its chords prolonged.
    low = np.full(high.shape, -np.inf)
    if before > 0:
        low = np.maximum(low, line(before - 1, before))
    if after < last:
        low = np.maximum(low, line(after, after + 1))
    near = range(max(0, before - 1), min(last, after + 1) + 1)
    cubic = np.zeros(high.shape)
    for i in near:
        others = [j for j in near if j != i]
        weight = math.prod((exponent - powers[j]) / (powers[i] - powers[j]) for j in others)
        cubic += weight * logs[..., i]
    found = np.clip(cubic, low, high)
    there = (sums > 0.0).all(axis=-1)
    off = np.maximum(np.exp(high - found) - 1.0, 1.0 - np.exp(low - found))
    error = float(off[there].max()) if there.any() else 0.0
    return np.where(there, np.exp(found), 0.0), error


def load_traffic_result(path: str | os.PathLike[str]) -> TrafficResult:
    """Read a result that `TrafficResult.to_netcdf` wrote, or open a store of `simulate_traffic`.

    The store of a run that is not finished is opened as far as it goes, with a warning that says
    how far.

    Raises
    ------
    FormatError
        If the file is not netCDF or not such a result, or a store is damaged or nothing is done.
    FileNotFoundError
        If there is no such file.
    """
    from pavefem import traffic_store  # it is made of results

    if traffic_store.is_traffic_store(Path(path)):
        return traffic_store.open_traffic(Path(path))
    return read_traffic_result(Path(path))


def read_traffic_result(path: Path) -> TrafficResult:
    """Read a file of a result."""
    if not path.is_file():
        raise FileNotFoundError(f"no such file: {path}")
    try:
        dataset = xr.load_dataset(path, engine="h5netcdf")
    except (OSError, ValueError, LookupError, RuntimeError, AttributeError) as error:
        raise FormatError(f"not a sound netCDF file: {error}", path=path) from None
    try:
        _check(dataset)
    except ValueError as error:
        raise FormatError(f"not a pavefem result of traffic: {error}", path=path) from None
    return TrafficResult(dataset)


def is_of_traffic(path: Path) -> bool:
    """Whether there is a file of a result of traffic."""
    try:
        with xr.open_dataset(path, engine="h5netcdf") as dataset:
            return bool(dataset.attrs.get("title") == _TITLE)
    except (OSError, ValueError, LookupError, RuntimeError, AttributeError):
        return False


def _check(dataset: xr.Dataset) -> None:
    """Find what a file of another origin lacks or holds in another shape."""
    if dataset.attrs.get("title") != _TITLE:
        raise ValueError(f"its title is not {_TITLE!r}")
    absent = [name for name in (*Work._fields, *_ATTRIBUTES) if name not in dataset.attrs]
    if absent:
        raise ValueError(f"it has no attribute {absent[0]}")
    needed: dict[str, tuple[str, ...]] = {
        name: _OF_NODES.get(name, ("lane", "x")) for name in _NODES
    }
    needed |= {name: (name,) for name in ("lane", "x", "power")}
    needed |= dict.fromkeys(("bin_start", "bin_end"), ("bin",))
    needed |= dict.fromkeys((*_WHO, *_PASSAGES), ("passage",))
    needed |= dict.fromkeys(("course_passage", "course_time", "course_x"), ("course",))
    for name, dims in needed.items():
        if name not in dataset.variables:
            raise ValueError(f"it has no {name}")
        if dataset[name].dims != dims:
            raise ValueError(f"{name} is of {dataset[name].dims}, expected {dims}")
        if dataset[name].size == 0:
            raise ValueError(f"{name} is empty")
    for name in _NODES:
        if name != "time_of_lowest" and not np.isfinite(dataset[name]).all():
            raise ValueError(f"{name} is not finite")
