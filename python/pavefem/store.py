"""A run in a zarr store: written block by block, and readable at any time as far as it goes.

Histories are chunked by blocks of time, and what belongs to nodes by nodes. A chunk is written
once, when all of it is known, and carries a checksum. What is known of nodes whose chunk is not
complete stands in a state, with what belongs to the whole run. The state is written last of a block
and takes its place in one step: a block without it is not done. The last two are kept; where the
last one, or a chunk of its block, is damaged, that block is done again. When the run is finished
the states go, and the store is plain zarr, with names, units and attributes of `Result.dataset`.
"""

from __future__ import annotations

import json
import shutil
import warnings
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any, Final, Self

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pavefem._files import replacing
from pavefem.errors import FormatError
from pavefem.forces import AxleForces, LiftOff, TireForces
from pavefem.quantities import Quantity
from pavefem.result import Result, from_dataset, lift_off_text

_PLAN: Final = "stored_run"
"""Attribute of the store that says what run it is for."""

_STATES: Final = "progress"
"""Group that holds the states while the run is not finished."""

_CHUNK: Final = 2**14
"""Nodes of a chunk."""

_EXTREMES: Final[Mapping[str, int | slice]] = {
    "lowest": 0,
    "highest": 1,
    "time_of_lowest": 2,
    "peak_deflection": slice(3, None),
}
"""What there is of every node, by row; the last of each axle."""

_OF_ALL: Final = ("max_deflection", "lift_off")
"""Attributes that are not known before the end of the run."""

DAMAGED: Final = (
    OSError,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    RuntimeError,
    EOFError,
    zipfile.BadZipFile,
    zlib.error,
)
"""What reading may raise where a file is not as it was written."""


@dataclass(frozen=True)
class Plan:
    """What a store is for, and how the run is cut into blocks."""

    run: str
    """Digest of all that the numbers depend on."""
    instants: int
    """Instants of the run."""
    block: int
    """Instants of a block: as many as so many whole rows of the histories take."""
    every: int
    """Instants of a row of the histories."""
    dt: float
    """Time step, s."""

    @property
    def blocks(self) -> int:
        """Blocks of the whole run."""
        return -(-self.instants // self.block)

    def begin(self, block: int) -> int:
        """Return the first instant of a block."""
        return min(block * self.block, self.instants)

    def rows(self, blocks: int) -> int:
        """Return how many rows the histories have after so many blocks."""
        return -(-self.begin(blocks) // self.every)

    def so_far(self, blocks: int) -> str:
        """Return how far so many blocks go, for people to read."""
        done, whole = (self.begin(count) * self.dt for count in (blocks, self.blocks))
        return f"{done:.5g} s of {whole:.5g} s"


class StoredResult(Result):
    """A `Result` whose histories stay in their store until they are asked for.

    `dataset`, `history()` and `tire_forces` are lazy: no more is read than is taken from them.
    `histories` and `forces` read all that there is of what is asked for.

    Attributes
    ----------
    path : Path
        The store.
    finished : bool
        Whether its run is; if not, this is what it came to so far.
    """

    path: Path
    finished: bool
    _so_far: str

    def __init__(self, path: Path, dataset: xr.Dataset, so_far: str = "") -> None:
        rest = vars(from_dataset(dataset.isel(time=slice(0))))
        own = {"path": path, "finished": not so_far, "dataset": dataset, "_so_far": so_far}
        self.__dict__.update(rest | own)
        self.__dict__["histories"] = _Histories(path, dataset, rest["histories"])

    def summary(self) -> dict[str, str]:
        """Return the figures of `Result.summary`, and how far the run is if it is not finished."""
        figures = super().summary()
        return figures if self.finished else {"not finished": self._so_far} | figures

    @property
    def time(self) -> NDArray[np.float64]:
        """Instants of the histories, s."""
        return _read(self.path, self.dataset["time"])

    @property
    def forces(self) -> TireForces | None:
        """Tire forces and axle places on the road, if kept."""
        if "tire_force" not in self.dataset:
            return None
        position, force = (
            _read(self.path, self.dataset[name]) for name in ("axle_position", "tire_force")
        )
        static, lift_off = self.axles.static_loads, self.axles.lift_off
        return TireForces(self.time, position, force, static, lift_off)


class _Histories(Mapping[Quantity, NDArray[np.float64]]):
    """Histories that are read when they are asked for."""

    def __init__(self, path: Path, dataset: xr.Dataset, names: Iterable[Quantity]) -> None:
        self._path, self._dataset, self._names = path, dataset, tuple(names)

    def __getitem__(self, name: Quantity) -> NDArray[np.float64]:
        if name not in self._names:
            raise KeyError(name)
        return _read(self._path, self._dataset[name])

    def __contains__(self, name: object) -> bool:
        return name in self._names  # without reading it

    def __iter__(self) -> Iterator[Quantity]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def _read(path: Path, values: xr.DataArray) -> NDArray[np.float64]:
    """Read what a store has of a history; a FormatError if it is damaged."""
    with reading(path):
        found = values.to_numpy()
        if not np.isfinite(found).all():
            raise ValueError(f"{values.name} is not finite")
        return found


@dataclass(frozen=True)
class State:
    """What is known after some blocks and does not stand in a chunk."""

    blocks: int
    """Blocks done."""
    nodes: tuple[int, int]
    """First node that stands in no chunk, now and one block earlier."""
    extremes: NDArray[np.float64]
    """`_EXTREMES` of the nodes from there on."""
    deepest: float
    """Lowest deflection so far, m."""
    axles: AxleForces

    def followed_by(self, result: Result, first: int) -> State:
        """Take along the answer of a block, for the nodes from `first` on."""
        here = slice(first - self.nodes[0], first - self.nodes[0] + result.x.size)
        missing = max(0, here.stop - self.extremes.shape[1])
        extremes = np.pad(self.extremes, ((0, 0), (0, missing)))
        lowest, highest, when, *peaks = extremes[:, here]
        when[:] = np.where(result.lowest < lowest, result.time_of_lowest, when)
        lowest[:] = np.minimum(lowest, result.lowest)
        highest[:] = np.maximum(highest, result.highest)
        for peak, found in zip(peaks, result.peak_deflection, strict=True):
            peak[:] = np.maximum(peak, found)
        return State(
            blocks=self.blocks + 1,
            nodes=self.nodes,
            extremes=extremes,
            deepest=min(self.deepest, float(result.lowest.min())),
            axles=self.axles.followed_by(result.axles),
        )

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of a dataset, `_OF_ALL`."""
        deepest = max(0.0, -self.deepest)
        return dict(zip(_OF_ALL, (deepest, lift_off_text(self.axles)), strict=True))

    def to_file(self, path: Path) -> None:
        """Write it in one step."""
        axles = self.axles
        with replacing(path) as part, part.open("wb") as file:
            np.savez(
                file,
                head=np.array([self.blocks, *self.nodes, self.deepest]),
                extremes=self.extremes,
                axles=np.stack([axles.static_loads, axles.lowest, axles.highest]),
                lift_off=np.array([[*asdict(lift).values()] for lift in axles.lift_off]),
            )

    @classmethod
    def from_file(cls, path: Path) -> Self:
        """Read it; one of `DAMAGED` if it is not as it was written."""
        with np.load(path, allow_pickle=False) as found:
            numbers = dict(found)
        blocks, now, before, deepest = numbers["head"].tolist()
        lifted = tuple(
            LiftOff(int(axle), int(instants), position)
            for axle, instants, position in numbers["lift_off"].reshape(-1, 3).tolist()
        )
        static, lowest, highest = numbers["axles"]
        axles = AxleForces(static, lowest, highest, lifted)
        return cls(int(blocks), (int(now), int(before)), numbers["extremes"], deepest, axles)


class Store:
    """The store of a run, to be written.

    Parameters
    ----------
    path : Path
        The store, made if it is not there.
    plan : Plan
        The run. A store of the same run in other blocks keeps its own.
    template : Result
        The answer of the run with one row of histories: what there is to write.

    Raises
    ------
    ValueError
        If at `path` there is anything but a store of this run.
    """

    def __init__(self, path: Path, plan: Plan, template: Result) -> None:
        if not path.exists():
            _create(path, plan, template.dataset)
        with reading(path):
            self._group = _zarr().open_group(path, mode="r+")
            self._arrays = dict(self._group.arrays())
            found = _open(path)
            self.plan = _plan(found)
        if self.plan.run != plan.run:
            raise ValueError(
                f"{path} holds the run of other inputs or of another version of pavefem: "
                "remove it, or name another store"
            )
        self.path = path
        self.finished = _is_finished(found)
        self._histories = _histories(template.dataset)
        axles = AxleForces.none(template.axles.static_loads)
        none = np.zeros((3 + axles.static_loads.size, 0))
        start = State(0, (0, 0), none, 0.0, axles)
        self._state = start if self.finished else _last_state(path, found, self.plan) or start

    @property
    def blocks(self) -> int:
        """Blocks done."""
        return self.plan.blocks if self.finished else self._state.blocks

    def write(self, result: Result, first: int) -> None:
        """Write the answer of the next block, for the nodes from `first` on.

        No later block comes by a node ahead of `first`.
        """
        state = self._state.followed_by(result, first)
        rows = slice(self.plan.rows(state.blocks - 1), self.plan.rows(state.blocks))
        variables = result.dataset.variables
        for name in self._histories:
            self._arrays[name][rows] = variables[name].to_numpy()
        # (A node less: rounding may move the next window by one.)
        state = self._complete(state, max(0, first - 1) // _CHUNK * _CHUNK)
        state.to_file(self.path / _STATES / f"{state.blocks % 2}.npz")
        self._state = state

    def finish(self) -> None:
        """Write what was not known before all blocks were done."""
        state = self._complete(self._state, self._arrays["x"].size)
        self._arrays["min_force"][:] = state.axles.lowest
        self._arrays["max_force"][:] = state.axles.highest
        self._group.update_attributes(state.attributes)
        self.finished = True
        shutil.rmtree(self.path / _STATES, ignore_errors=True)
        _consolidate(self.path)

    def _complete(self, state: State, node: int) -> State:
        """Write the nodes ahead of one, whose chunks are then complete, and leave them out."""
        start = state.nodes[0]
        count = max(0, node - start)
        if count == 0:
            return replace(state, nodes=(start, start))
        extremes = np.pad(state.extremes, ((0, 0), (0, max(0, count - state.extremes.shape[1]))))
        for name, rows in _EXTREMES.items():
            self._arrays[name][..., start : start + count] = extremes[rows, :count]
        return replace(state, nodes=(start + count, start), extremes=extremes[:, count:])


def is_store(path: Path) -> bool:
    """Whether there is a zarr store."""
    return (path / "zarr.json").is_file()


def open_result(path: Path) -> StoredResult:
    """Open the store of a run; see `pavefem.load_result`."""
    with reading(path):
        dataset = _open(path)
        if _is_finished(dataset):
            return StoredResult(path, dataset)
        plan = _plan(dataset)
        state = _last_state(path, dataset, plan)
        if state is None:
            raise ValueError("no block of its run is done")
        so_far = plan.so_far(state.blocks)
        result = StoredResult(path, _up_to(dataset, plan, state), so_far)
    warnings.warn(
        f"{path}: the run is not finished, this is {so_far}; the call that began it goes on there",
        stacklevel=3,
    )
    return result


def _up_to(dataset: xr.Dataset, plan: Plan, state: State) -> xr.Dataset:
    """Put what stands in the state to what stands in chunks."""
    start, size = state.nodes[0], dataset.sizes["x"]
    extremes = np.zeros((state.extremes.shape[0], size))
    extremes[:, start : start + state.extremes.shape[1]] = state.extremes
    for name, rows in _EXTREMES.items():
        extremes[rows, :start] = dataset[name][..., :start]
        dataset[name] = dataset[name].copy(data=extremes[rows])
    for name, forces in (("min_force", state.axles.lowest), ("max_force", state.axles.highest)):
        dataset[name] = dataset[name].copy(data=forces)
    return dataset.assign_attrs(state.attributes).isel(time=slice(plan.rows(state.blocks)))


def _last_state(path: Path, dataset: xr.Dataset, plan: Plan) -> State | None:
    """Find the last state that is sound, as its block is."""
    states = []
    for file in (path / _STATES).glob("*.npz"):
        with suppress(*DAMAGED):
            states.append(State.from_file(file))
    for state in sorted(states, key=lambda state: state.blocks, reverse=True):
        rows = slice(plan.rows(state.blocks - 1), plan.rows(state.blocks))
        block = dataset.isel(time=rows, x=slice(*reversed(state.nodes)))
        with suppress(*DAMAGED):
            names = [*_histories(block), *_EXTREMES]
            if all(np.isfinite(block[name]).all() for name in names):
                return state
    return None


def _open(path: Path) -> xr.Dataset:
    _zarr()
    dataset = xr.open_dataset(path, engine="zarr", chunks=None, consolidated=False)
    if "track_elevation" in dataset:
        names = dataset["track_elevation"].attrs.pop("tracks")
        dataset = dataset.assign_coords(track=("track", names))
    return dataset


def _histories(dataset: xr.Dataset) -> list[str]:
    """Names of what has rows along time; no instants without anything at them."""
    names = [name for name, values in dataset.variables.items() if values.dims[:1] == ("time",)]
    return [str(name) for name in names] if len(names) > 1 else []


def _create(path: Path, plan: Plan, dataset: xr.Dataset) -> None:
    """Make a store without a block; it takes its place in one step."""
    zarr = _zarr()
    if not path.parent.is_dir():
        raise FileNotFoundError(f"no such folder: {path.parent}")
    part = path.with_name(f".{path.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    rows = plan.rows(plan.blocks) if _histories(dataset) else 0
    try:
        dataset.attrs = {name: dataset.attrs[name] for name in dataset.attrs if name not in _OF_ALL}
        dataset.attrs[_PLAN] = json.dumps(asdict(plan))
        static = dataset.drop_dims(["time", "x"])
        if "track" in static.coords:
            # Text is not yet of zarr's standard.
            static["track_elevation"].attrs["tracks"] = static["track"].to_numpy().tolist()
            static = static.drop_vars("track")
        static.to_zarr(part, zarr_format=3, consolidated=False)
        group = zarr.open_group(part, mode="r+")
        for name, values in dataset.variables.items():
            if not {"time", "x"} & set(values.dims):
                continue
            sizes = dict(zip(values.dims, values.shape, strict=True))
            shape = tuple((sizes | {"time": rows})[dim] for dim in values.dims)
            chunks = sizes | {"time": min(plan.rows(1), rows), "x": min(_CHUNK, dataset.sizes["x"])}
            group.create_array(
                str(name),
                shape=shape,
                chunks=tuple(max(1, chunks[dim]) for dim in values.dims),
                dtype=values.dtype,
                compressors=[
                    zarr.codecs.BloscCodec(cname="lz4", shuffle="shuffle"),
                    zarr.codecs.Crc32cCodec(),
                ],
                fill_value=np.nan,
                attributes=values.attrs,
                dimension_names=[str(dim) for dim in values.dims],
            )
        group["x"][:] = dataset["x"].to_numpy()
        group.create_group(_STATES)
        _consolidate(part)
        part.rename(path)
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise


def _consolidate(path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # zarr says that this is not yet of its standard
        _zarr().consolidate_metadata(path)


def _plan(dataset: xr.Dataset) -> Plan:
    if _PLAN not in dataset.attrs:
        raise ValueError("it holds no run of pavefem")
    return Plan(**json.loads(dataset.attrs[_PLAN]))


def _is_finished(dataset: xr.Dataset) -> bool:
    return all(name in dataset.attrs for name in _OF_ALL)


@contextmanager
def reading(path: Path, what: str = "a sound store of a run") -> Iterator[None]:
    """Say which store is damaged."""
    try:
        yield
    except DAMAGED as error:
        raise FormatError(f"not {what}: {error}", path=path) from None


def _zarr() -> ModuleType:
    try:
        import zarr
    except ImportError:
        raise ImportError("stores need zarr: pip install 'pavefem[zarr]'") from None
    return zarr
