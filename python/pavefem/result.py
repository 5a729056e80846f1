"""What a run answers: deflections, their envelope, tire forces, and the inputs they belong to."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, overload

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pavefem._files import replacing
from pavefem._model import finite_number
from pavefem.coupling import Coupling
from pavefem.errors import FormatError
from pavefem.forces import AxleForces, LiftOff, TireForces
from pavefem.profile import Profile
from pavefem.quantities import QUANTITIES, Quantity
from pavefem.scenario import Scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pavefem.convergence import ErrorEstimate
    from pavefem.plotting.animation import Film


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """The answer of a road to one vehicle.

    Deflections are up positive, as in the paper's Fig. 7: a loaded pavement reads negative.

    Attributes
    ----------
    scenario : Scenario
        The inputs.
    x : ndarray, shape (nodes,)
        Places of the nodes, m, both ends of the road included.
    lowest, highest : ndarray, shape (nodes,)
        Envelope: extremes of the deflection of every node over the whole run, m.
    time_of_lowest : ndarray, shape (nodes,)
        When each node was lowest, s.
    peak_deflection : ndarray, shape (axles, nodes)
        Magnitude of the lowest deflection of every node while each axle was the nearest, m.
    axles : AxleForces
        Extremes of the tire force of every axle over the whole run, N, and where it lifted off.
    time : ndarray, shape (times,)
        Instants of the histories, s.
    histories : dict of ndarray, shape (times, nodes) or (times, stations)
        What was kept of ``deflection``, ``velocity``, ``curvature``, ``moment``, ``strain`` and
        ``pressure``, by name.
    stations : ndarray, or None
        Places of the histories, m, where they are not the nodes.
    forces : TireForces, or None
        Tire forces and axle places on the road, if kept.
    coupling : Coupling, or None
        What two-way coupling changes, if tires feel the deflection.
    """

    scenario: Scenario
    x: NDArray[np.float64]
    lowest: NDArray[np.float64]
    highest: NDArray[np.float64]
    time_of_lowest: NDArray[np.float64]
    peak_deflection: NDArray[np.float64]
    axles: AxleForces
    time: NDArray[np.float64]
    histories: Mapping[Quantity, NDArray[np.float64]] = field(default_factory=dict)
    stations: NDArray[np.float64] | None = None
    forces: TireForces | None = None
    coupling: Coupling | None = None

    def __repr__(self) -> str:
        scenario = self.scenario
        return (
            f"Result({scenario.vehicle.name!r}, {scenario.speed_kmh:g} km/h, "
            f"{scenario.temperature_c:g} °C, {scenario.road.length:g} m of road, "
            f"max_deflection {self.max_deflection * 1e3:.4f} mm)"
        )

    @property
    def max_deflection(self) -> float:
        """Magnitude of the lowest deflection of any node at any time, m."""
        return max(0.0, -float(self.lowest.min()))

    @property
    def deflection(self) -> NDArray[np.float64] | None:
        """Deflection histories, m, if kept."""
        return self.histories.get("deflection")

    @property
    def mid_deflection(self) -> float:
        """Magnitude of the lowest deflection of the node nearest to mid-length, m."""
        return max(0.0, -float(self.lowest[self._middle]))

    @property
    def rebound(self) -> float:
        """Highest deflection of any node at any time, m."""
        return float(self.highest.max())

    @property
    def _middle(self) -> int:
        return int(np.abs(self.x - self.scenario.road.length / 2.0).argmin())

    @property
    def places(self) -> NDArray[np.float64]:
        """Places of the histories, m: the stations, or the nodes."""
        return self.x if self.stations is None else self.stations

    @property
    def tire_forces(self) -> xr.DataArray:
        """Tire force (time, axle), N."""
        if "tire_force" not in self.dataset:
            raise ValueError('tire forces were not kept: run with keep=["tire_force", ...]')
        return self.dataset["tire_force"]

    @property
    def envelope(self) -> xr.Dataset:
        """Lowest and highest deflection of every node, m, and when it was lowest, s."""
        return self.dataset[["lowest", "highest", "time_of_lowest"]]

    def history(self, x: float, quantity: Quantity = "deflection") -> xr.DataArray:
        """Deflection, or another quantity that was kept, over time at a node or station.

        Raises
        ------
        ValueError
            If no history was kept of it or at that place; the message names the nearest one.
        """
        if not isinstance(quantity, str) or quantity not in self.histories:
            kept = f"only of {', '.join(self.histories)}" if self.histories else "of nothing"
            wanted = [quantity] if quantity in [*QUANTITIES] else f"some of {[*QUANTITIES]}"
            raise ValueError(f"no history of {quantity!r} was kept, {kept}: run with keep={wanted}")
        place = finite_number("x", x)
        places = self.places
        nearest = int(np.abs(places - place).argmin())
        if abs(places[nearest] - place) > 1e-9 * max(1.0, abs(place)):
            raise ValueError(
                f"no history was kept at x = {x:g} m, the nearest is at {places[nearest]:g} m: "
                f"run with stations=[{x:g}]"
            )
        return self.dataset[quantity][:, nearest]

    @cached_property
    def dataset(self) -> xr.Dataset:
        """All of it as an `xarray.Dataset`, with units, and every input in the attributes."""
        metres, newton = {"units": "m"}, {"units": "N"}
        place = "x" if self.stations is None else "station"
        dataset = xr.Dataset(
            {
                "lowest": ("x", self.lowest, metres | {"long_name": "lowest deflection"}),
                "highest": ("x", self.highest, metres | {"long_name": "highest deflection"}),
                "time_of_lowest": (
                    "x",
                    self.time_of_lowest,
                    {"units": "s", "long_name": "time of the lowest deflection"},
                ),
                "peak_deflection": (
                    ("axle", "x"),
                    self.peak_deflection,
                    metres | {"long_name": "largest deflection while an axle is the nearest"},
                ),
                "static_load": (
                    "axle",
                    self.axles.static_loads,
                    newton | {"long_name": "static axle load"},
                ),
                "min_force": (
                    "axle",
                    self.axles.lowest,
                    newton | {"long_name": "smallest tire force of an axle"},
                ),
                "max_force": (
                    "axle",
                    self.axles.highest,
                    newton | {"long_name": "largest tire force of an axle"},
                ),
            },
            coords={
                "axle": ("axle", np.arange(1, self.axles.static_loads.size + 1)),
                "x": ("x", self.x, metres | {"long_name": "place along the road"}),
                "time": ("time", self.time, {"units": "s"}),
            },
            attrs=self._attributes(),
        )
        if self.stations is not None:
            dataset = dataset.assign_coords(station=("station", self.stations, metres))
        for name, values in self.histories.items():
            is_ = QUANTITIES[name]
            attributes = {"units": is_.units, "long_name": is_.long_name, "positive": is_.positive}
            dataset[name] = (("time", place), values, attributes)
        if self.forces is not None:
            dataset = dataset.merge(self.forces.dataset)
        if self.coupling is not None:
            dataset = self.coupling.assign_to(dataset)
        profile = self.scenario.profile
        if profile is not None:
            attributes = metres | {"long_name": "profile elevation", "name": profile.name}
            dataset = dataset.assign_coords(
                profile_station=("profile_station", profile.x, metres)
            ).assign(profile_elevation=("profile_station", profile.z, attributes))
            if profile.tracks:
                tracks = np.stack(list(profile.tracks.values()))
                dataset = dataset.assign_coords(track=("track", list(profile.tracks))).assign(
                    track_elevation=(("track", "profile_station"), tracks, attributes)
                )
        return dataset

    def _attributes(self) -> dict[str, Any]:
        scenario = self.scenario
        return {
            "title": "Pavement response to a vehicle",
            "pavefem_version": version("pavefem"),
            "vehicle_name": scenario.vehicle.name,
            "speed_kmh": scenario.speed_kmh,
            "temperature_c": scenario.temperature_c,
            "road_length": scenario.road.length,
            "max_deflection": self.max_deflection,
            "lift_off": lift_off_text(self.axles),
            "scenario": scenario.model_dump_json(),
        }

    def summary(self) -> dict[str, str]:
        """Return the figures an engineer looks at first, as text with units, by what they are."""
        scenario, mm = self.scenario, 1e3
        worst = int(self.lowest.argmin())
        longest = float(np.diff(self.x).max().round(6))
        figures = {
            "vehicle": f"{scenario.vehicle.name}, {scenario.vehicle.total_mass / 1e3:.1f} t",
            "speed": f"{scenario.speed_kmh:g} km/h",
            "temperature": f"{scenario.temperature_c:g} °C",
            "road": f"{scenario.road.length:g} m",
            "mesh": f"{self.x.size - 1} elements of {longest:g} m, {scenario.scheme.foundation}",
            "profile": "smooth" if scenario.profile is None else scenario.profile.name,
            "largest deflection": (
                f"{self.max_deflection * mm:.4f} mm at x = {self.x[worst]:g} m, "
                f"t = {self.time_of_lowest[worst]:.3f} s"
            ),
            "largest deflection at mid-length": (
                f"{self.mid_deflection * mm:.4f} mm at x = {self.x[self._middle]:g} m"
            ),
            "largest rebound": f"{self.rebound * mm:.4f} mm",
        }
        axles = self.axles
        rows = zip(axles.static_loads, axles.lowest, axles.highest, strict=True)
        for axle, (static, low, high) in enumerate(rows, start=1):
            figures[f"axle {axle}"] = (
                f"static {static / 1e3:.2f} kN, {low / 1e3:.2f} to {high / 1e3:.2f} kN"
            )
        # A linear tire pulls at the road where it would lift off.
        lifts = "lifts off" if scenario.lift_off else "would lift off"
        for lift in axles.lift_off:
            figures[f"axle {lift.axle} {lifts}"] = (
                f"at {lift.instants} instants, first at x = {lift.position:.2f} m"
            )
        if self.coupling is not None:
            figures["two-way coupling"] = self.coupling.summary()
        return figures

    def error_estimate(self, x: float | None = None) -> ErrorEstimate:
        """Estimate the error of the largest deflection by finer runs of the same scenario.

        The scenario runs again, with half the time step, and with half the element length: some
        five times the work of the run itself. With ``foundation="bars"`` the error of the mesh is
        that against a continuous bed, which bars become.

        Parameters
        ----------
        x : float, optional
            A node, m; by default that of `max_deflection`.

        Returns
        -------
        ErrorEstimate
            The parts of the time step and of the mesh, and what scheme a tolerance would take.

        Raises
        ------
        ValueError
            If there is no node at `x`, or it does not move.
        """
        from pavefem import convergence  # it runs scenarios, whose answers are results

        return convergence.error_estimate(self, x)

    def plot(self, x: float | None = None) -> Figure:
        """Draw the deflection at `x` (mid-length), the worst instant, the envelope, the forces."""
        from pavefem import plotting  # matplotlib takes half a second to import

        return plotting.plot_result(self, x)

    @overload
    def animate(self, path: None = None, **options: Any) -> Film: ...
    @overload
    def animate(self, path: str | os.PathLike[str], **options: Any) -> None: ...
    def animate(self, path: str | os.PathLike[str] | None = None, **options: Any) -> Film | None:
        """Show the vehicle moving over the profile and the deflecting road.

        Parameters
        ----------
        path : path-like, optional
            File to write, ``.gif`` or ``.html``; without it, a notebook shows what is returned.
        **options
            ``between=(start, end)``, ``fps``, ``slow_motion`` and others of `plotting.animate`.

        Returns
        -------
        Film or None
            A `matplotlib.animation.FuncAnimation`; None where a file is written.

        Raises
        ------
        ValueError
            If the deflection of all nodes or the tire forces were not kept, or as of
            `plotting.animate`.
        """
        from pavefem import plotting  # matplotlib takes half a second to import

        return plotting.animate(self, path, **options)

    def to_netcdf(self, path: str | os.PathLike[str]) -> None:
        """Write a netCDF file that `load_result` reads back; an old file is replaced as a whole.

        Raises
        ------
        OSError
            If the folder does not exist or cannot be written. The result itself is not touched.
        """
        with replacing(path) as file:
            self.dataset.to_netcdf(file, engine="h5netcdf")


def lift_off_text(axles: AxleForces) -> str:
    """Where axles lifted off, as files have it."""
    return json.dumps([[lift.axle, lift.instants, lift.position] for lift in axles.lift_off])


def load_result(path: str | os.PathLike[str]) -> Result:
    """Read a result that `Result.to_netcdf` wrote, or open a store of `run`.

    Of a store, histories are read when they are asked for. The store of a run that is not finished
    is opened as far as it goes, with a warning that says how far.

    Raises
    ------
    FormatError
        If the file is not netCDF or not a pavefem result, or a store is damaged or without a block.
    FileNotFoundError
        If there is no such file.
    """
    from pavefem import store  # it is made of results

    if store.is_store(Path(path)):
        return store.open_result(Path(path))
    if not Path(path).is_file():
        raise FileNotFoundError(f"no such file: {os.fspath(path)}")
    try:
        dataset = xr.load_dataset(path, engine="h5netcdf")
    except (OSError, ValueError, LookupError, RuntimeError, AttributeError) as error:
        raise FormatError(f"not a sound netCDF file: {error}", path=path) from None
    try:
        if "traffic" in str(dataset.attrs.get("title")):
            raise ValueError("it is one of traffic, which load_traffic_result reads")
        for name, size in dataset.sizes.items():
            if size == 0:
                raise ValueError(f"{name} is empty")
        return from_dataset(dataset)
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise FormatError(f"not a pavefem result: {error}", path=path) from None


_DIMENSIONS: Final = {
    "x": ("x",),
    "time": ("time",),
    "station": ("station",),
    "lowest": ("x",),
    "highest": ("x",),
    "time_of_lowest": ("x",),
    "peak_deflection": ("axle", "x"),
    "tire_force": ("time", "axle"),
    "axle_position": ("time", "axle"),
    "static_load": ("axle",),
    "min_force": ("axle",),
    "max_force": ("axle",),
    "force_change": ("axle",),
    "deflection_change": (),
    "axle_deflection": ("time", "axle"),
}


def _check_dataset(dataset: xr.Dataset) -> None:
    """Find what a file of another origin lacks or holds in another shape."""
    for name in (
        "x",
        "time",
        "static_load",
        "min_force",
        "max_force",
        "lowest",
        "highest",
        "time_of_lowest",
        "peak_deflection",
    ):
        if name not in dataset.variables:
            raise ValueError(f"it has no {name}")
    place = "station" if "station" in dataset.dims else "x"
    for name, dims in (_DIMENSIONS | dict.fromkeys(QUANTITIES, ("time", place))).items():
        if name not in dataset:
            continue
        values = dataset[name]
        if values.dims != dims or values.dtype != np.float64:
            raise ValueError(
                f"{name} is {values.dtype} of {values.dims}, expected float64 of {dims}"
            )
        if not np.isfinite(values).all():
            raise ValueError(f"{name} is not finite")
        if any(dim not in dataset.coords for dim in dims):
            raise ValueError(f"{name} lacks a coordinate of {dims}")
    for quantity, is_ in QUANTITIES.items():
        if quantity in dataset and (units := dataset[quantity].attrs.get("units")) != is_.units:
            raise ValueError(f"{quantity} has units {units!r}, expected {is_.units!r}")


def from_dataset(dataset: xr.Dataset) -> Result:
    """Build the result that a dataset is of; a ValueError or the like if it is of none."""
    _check_dataset(dataset)
    inputs = json.loads(dataset.attrs["scenario"])
    absent = [name for name in Scenario.model_fields if name not in inputs]
    if absent:
        raise ValueError(f"its scenario has no {', '.join(absent)}")
    if "profile_elevation" in dataset:
        elevation = dataset["profile_elevation"]
        tracks = None
        if "track_elevation" in dataset:
            names = dataset["track"].to_numpy()
            rows = dataset["track_elevation"].to_numpy()
            tracks = {str(name): row for name, row in zip(names, rows, strict=True)}
        inputs["profile"] = Profile(
            dataset["profile_station"].to_numpy(),
            elevation.to_numpy(),
            elevation.attrs["name"],
            tracks=tracks,
        )
    axles = AxleForces(
        dataset["static_load"].to_numpy(),
        dataset["min_force"].to_numpy(),
        dataset["max_force"].to_numpy(),
        tuple(LiftOff(*lift) for lift in json.loads(dataset.attrs["lift_off"])),
    )
    forces = None
    if "tire_force" in dataset:
        forces = TireForces(
            time=dataset["time"].to_numpy(),
            position=dataset["axle_position"].to_numpy(),
            force=dataset["tire_force"].to_numpy(),
            static_loads=axles.static_loads,
            lift_off=axles.lift_off,
        )
    return Result(
        scenario=Scenario.model_validate(inputs),
        x=dataset["x"].to_numpy(),
        lowest=dataset["lowest"].to_numpy(),
        highest=dataset["highest"].to_numpy(),
        time_of_lowest=dataset["time_of_lowest"].to_numpy(),
        peak_deflection=dataset["peak_deflection"].to_numpy(),
        axles=axles,
        time=dataset["time"].to_numpy(),
        histories={name: dataset[name].to_numpy() for name in QUANTITIES if name in dataset},
        stations=dataset["station"].to_numpy() if "station" in dataset else None,
        forces=forces,
        coupling=Coupling.of(dataset),
    )
