"""Runs block by block into a store: the same answer, in constant memory, through kills."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import pavefem as pf
from pavefem import store, stream
from pavefem.store import StoredResult

zarr = pytest.importorskip("zarr")

LENGTH = 400.0
STATIONS = [100.0, 333.31]

Small = Callable[..., None]


def inputs(**changes: Any) -> dict[str, Any]:
    """Give a truck on a rough road of 400 m: 22 000 instants."""
    pavements = (pf.Pavement.paper(), pf.Pavement.paper(asphalt=pf.Asphalt(vma=18.0)))
    road = pf.Road(sections=[(pavements[0], 300.0), (pavements[1], LENGTH - 300.0)])
    return {
        "road": road,
        "vehicle": pf.vehicles.tandem_truck(),
        "profile": pf.Profile.iso8608("C", length=450.0, seed=3),
        "run_in": 40.0,
        "scheme": "converged",
        "keep": ["deflection", "tire_force"],
        "stations": STATIONS,
        "every": 4,
    } | changes


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> Small:
    """Cut runs into blocks and chunks so small that a short road has some."""

    def _small(block: int = 4000, chunk: int = 300) -> None:
        monkeypatch.setattr(stream, "_BLOCK", block)
        monkeypatch.setattr(stream, "_WARM_UPS", 0)
        monkeypatch.setattr(store, "_CHUNK", chunk)

    return _small


@pytest.fixture(scope="module")
def plain() -> pf.Result:
    return pf.simulate(**inputs())


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> pf.Result:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stream, "_BLOCK", 4000)
        patch.setattr(stream, "_WARM_UPS", 0)
        patch.setattr(store, "_CHUNK", 300)
        return pf.simulate(**inputs(), store=tmp_path_factory.mktemp("whole") / "run.zarr")


def assert_close(found: pf.Result, expected: pf.Result, part: float = 1e-7) -> None:
    """All numbers within a part of the peak; the vehicle's are the same to the last bit."""
    tolerance = part * expected.max_deflection
    np.testing.assert_array_equal(found.x, expected.x)
    np.testing.assert_array_equal(found.time, expected.time)
    for name in ("lowest", "highest", "peak_deflection"):
        values, others = getattr(found, name), getattr(expected, name)
        np.testing.assert_allclose(values, others, rtol=0, atol=tolerance, err_msg=name)
    assert {*found.histories} == {*expected.histories}
    for name, history in expected.histories.items():
        atol = part * np.abs(history).max()
        np.testing.assert_allclose(found.histories[name], history, rtol=0, atol=atol, err_msg=name)
    assert found.max_deflection == pytest.approx(expected.max_deflection, abs=tolerance)
    moved = np.abs(found.time_of_lowest - expected.time_of_lowest)
    # (Of values that are equal but for rounding, either instant may be the lowest.)
    assert (moved > 0.5e-3).mean() < 1e-3
    assert found.forces is not None and expected.forces is not None
    np.testing.assert_array_equal(found.forces.force, expected.forces.force)
    np.testing.assert_array_equal(found.forces.position, expected.forces.position)
    for name in ("static_loads", "lowest", "highest", "lift_off"):
        assert np.array_equal(getattr(found.axles, name), getattr(expected.axles, name)), name


def assert_same(found: pf.Result, expected: pf.Result) -> None:
    assert_close(found, expected, part=0.0)
    np.testing.assert_array_equal(found.time_of_lowest, expected.time_of_lowest)


@pytest.mark.parametrize(
    ("block", "chunk"), [(1777, 64), (4000, 1000), (10_000, 300), (9**9, 2**14)]
)
def test_blocks_of_any_length_give_the_plain_run(
    block: int, chunk: int, small: Small, plain: pf.Result, tmp_path: Path
) -> None:
    small(block, chunk)
    found = pf.simulate(**inputs(), store=tmp_path / "run.zarr")
    assert_close(found, plain)
    assert found.summary() == plain.summary()


@pytest.mark.parametrize(
    "changes",
    [
        {"profile": None, "run_in": 0.0, "stations": [7.0], "every": 5000},
        {"profile": pf.Profile.iso8608("F", length=450.0, seed=1), "lift_off": True},
        {"profile": pf.Profile.iso8608("F", length=450.0, seed=1), "interpolation": "staircase"},
        {"scheme": pf.Scheme.paper(solver="window"), "every": 1},
        {"keep": ["strain", "pressure", "moment", "velocity", "deflection", "tire_force"]},
        {"vehicle": pf.vehicles.quarter_car(dry_friction=0.1), "speed_kmh": 90.0},
    ],
    ids=["smooth", "lift-off", "staircase", "paper", "quantities", "friction"],
)
def test_all_kinds_of_runs(changes: dict[str, Any], small: Small, tmp_path: Path) -> None:
    small(3001)
    found = pf.simulate(**inputs(**changes), store=tmp_path / "run.zarr")
    expected = pf.simulate(**inputs(**changes))
    assert_close(found, expected)
    if "lift_off" in changes:
        assert found.axles.lift_off


def test_a_finished_store_is_plain_zarr(uninterrupted: pf.Result, plain: pf.Result) -> None:
    """What any reader finds in it has the names, dimensions, units and attributes of the result."""
    assert isinstance(uninterrupted, StoredResult)
    found, expected = xr.open_zarr(uninterrupted.path), plain.dataset
    assert found.sizes == expected.sizes
    assert set(found.variables) == set(expected.variables)
    for name, values in expected.variables.items():
        assert found[name].dims == values.dims, name
        assert found[name].dtype == values.dtype, name
        assert found[name].attrs == values.attrs, name
    assert found.attrs.keys() - expected.attrs.keys() == {"stored_run"}
    for name in ("lift_off", "scenario", "vehicle_name"):
        assert found.attrs[name] == expected.attrs[name]
    assert found.attrs["max_deflection"] == pytest.approx(plain.max_deflection)
    assert sorted(path.name for path in uninterrupted.path.iterdir() if path.is_file()) == [
        "zarr.json"
    ]
    assert not (uninterrupted.path / "progress").exists()


def test_a_stored_result_is_lazy(uninterrupted: pf.Result, plain: pf.Result) -> None:
    assert isinstance(uninterrupted, StoredResult)
    result = pf.load_result(uninterrupted.path)
    history = result.history(STATIONS[1])
    assert not history.variable._in_memory
    assert not result.tire_forces.variable._in_memory
    assert_same(result, uninterrupted)
    np.testing.assert_allclose(history, plain.history(STATIONS[1]), atol=1e-10)
    assert result.scenario.profile is not None and plain.scenario.profile is not None
    np.testing.assert_array_equal(result.scenario.profile.z, plain.scenario.profile.z)
    with pytest.raises(ValueError, match=r"the nearest is at 100 m: run with stations=\[200\]"):
        result.history(200.0)


def test_a_stored_result_goes_into_netcdf(uninterrupted: pf.Result, tmp_path: Path) -> None:
    uninterrupted.to_netcdf(tmp_path / "run.nc")
    assert_same(pf.load_result(tmp_path / "run.nc"), uninterrupted)


def test_the_envelope_alone(plain: pf.Result, tmp_path: Path) -> None:
    changes = {"keep": "envelope", "stations": None}
    found = pf.simulate(**inputs(**changes), store=tmp_path / "run.zarr")
    np.testing.assert_allclose(found.lowest, plain.lowest, rtol=0, atol=1e-11)
    assert (found.time.size, found.deflection, found.forces) == (0, None, None)
    with pytest.raises(ValueError, match="no history of 'deflection' was kept"):
        found.history(1.0)


def test_tracks_of_a_profile_are_kept(tmp_path: Path) -> None:
    made = pf.Profile.iso8608("C", length=120.0, seed=3)
    tracks = {"left": made.z, "right wheel path": 0.9 * made.z}
    profile = pf.Profile(made.x, made.z, "two", tracks=tracks)
    changes = {"profile": profile, "run_in": 0.0, "road": pf.Road(length=60.0), "stations": [9.0]}
    found = pf.simulate(**inputs(**changes), store=tmp_path / "run.zarr")
    assert_close(found, pf.simulate(**inputs(**changes)))
    assert found.scenario.profile is not None
    assert [*found.scenario.profile.tracks] == [*tracks]
    for name, elevations in tracks.items():
        np.testing.assert_array_equal(found.dataset["track_elevation"].sel(track=name), elevations)


def test_the_same_call_again_does_nothing(
    uninterrupted: pf.Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert isinstance(uninterrupted, StoredResult)
    monkeypatch.setattr(stream, "forces_in_blocks", None)
    assert_same(pf.simulate(**inputs(), store=uninterrupted.path), uninterrupted)


def so_far(path: Path) -> StoredResult:
    with pytest.warns(UserWarning, match=r"the run is not finished, this is \d"):
        result = pf.load_result(path)
    assert isinstance(result, StoredResult) and not result.finished
    return result


def assert_begins(found: StoredResult, expected: pf.Result) -> None:
    """What there is of a run is how the whole one begins."""
    rows = found.time.size
    assert 0 < rows < expected.time.size
    assert found.deflection is not None and expected.deflection is not None
    np.testing.assert_array_equal(found.time, expected.time[:rows])
    np.testing.assert_array_equal(found.deflection, expected.deflection[:rows])
    assert found.forces is not None and expected.forces is not None
    np.testing.assert_array_equal(found.forces.force, expected.forces.force[:rows])
    # The truck, 6 m long, is past all that is 20 m behind its first axle.
    reached = found.forces.position[-1, 0]
    past = found.x < reached - 20.0
    assert past.any() and not past.all()
    for name in ("lowest", "highest", "time_of_lowest"):
        values, whole = getattr(found, name), getattr(expected, name)
        np.testing.assert_array_equal(values[past], whole[past], err_msg=name)
        assert not values[found.x > reached + 20.0].any()
    assert found.max_deflection == -found.lowest.min() <= expected.max_deflection
    assert "not finished" in found.summary()


def test_ctrl_c_keeps_what_is_done(
    small: Small, uninterrupted: pf.Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    small()
    path = tmp_path / "run.zarr"
    original = store.State.to_file

    def to_file(state: store.State, file: Path) -> None:
        if state.blocks == 3:
            raise KeyboardInterrupt
        original(state, file)

    monkeypatch.setattr(store.State, "to_file", to_file)
    with pytest.raises(KeyboardInterrupt) as interrupt:
        pf.simulate(**inputs(), store=path)
    [note] = interrupt.value.__notes__
    assert note == f"{path} holds 8 s of 22.478 s, and the same call goes on there"
    assert_begins(so_far(path), uninterrupted)
    monkeypatch.setattr(store.State, "to_file", original)
    assert_same(pf.simulate(**inputs(), store=path), uninterrupted)


@pytest.mark.parametrize("key", ["tire_force/c/2/0", "lowest/c/3", "zarr.json"])
def test_a_full_disk_loses_nothing_of_what_is_done(
    key: str,
    small: Small,
    uninterrupted: pf.Result,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Whether it is full at a history, at nodes, or at the very end."""
    small()
    path = tmp_path / "run.zarr"
    original = zarr.storage.LocalStore.set

    async def full(self: Any, name: str, value: Any) -> None:
        if name == key and (path / "progress").exists():
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        await original(self, name, value)

    monkeypatch.setattr(zarr.storage.LocalStore, "set", full)
    with pytest.raises(OSError, match=r"No space left on device; .* holds \S+ s of 22") as error:
        pf.simulate(**inputs(), store=path)
    assert error.value.errno == errno.ENOSPC
    if key == "zarr.json":
        assert so_far(path).time.size == uninterrupted.time.size
    else:
        assert_begins(so_far(path), uninterrupted)
    monkeypatch.setattr(zarr.storage.LocalStore, "set", original)
    assert_same(pf.simulate(**inputs(), store=path), uninterrupted)


def test_no_room_for_the_store_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(zarr.storage.LocalStore, "set", full)
    with pytest.raises(OSError, match="No space left on device"):
        pf.simulate(**inputs(), store=tmp_path / "run.zarr")
    assert not list(tmp_path.iterdir())
    with pytest.raises(FileNotFoundError, match="no such folder"):
        pf.simulate(**inputs(), store=tmp_path / "none" / "run.zarr")


SLOW = """
import time
from pavefem import store, stream
import pavefem as pf
from test_stream import inputs

stream._BLOCK, stream._WARM_UPS, store._CHUNK = 4000, 0, 300
original = store.Store.write

def write(self, *answer):
    original(self, *answer)
    time.sleep(0.5)

store.Store.write = write
pf.simulate(**inputs(), store="run.zarr")
"""

LONG = """
import signal
import pavefem as pf

# A shell's background process, and so its children, would ignore it.
signal.signal(signal.SIGINT, signal.default_int_handler)
road = pf.Road(length=60e3)
truck = pf.vehicles.tandem_truck()
pf.simulate(road, truck, scheme="converged", keep="envelope", store="run.zarr", progress=True)
"""


@pytest.fixture
def child(tmp_path: Path) -> Iterator[Callable[[str], subprocess.Popen[str]]]:
    """Start a script in a process of its own, which is gone when the test is."""
    started: list[subprocess.Popen[str]] = []
    folders = [str(Path(pf.__file__).parents[1]), str(Path(__file__).parent)]

    def start(script: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-c", script],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(folders)},
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.wait()
        if process.stderr is not None:
            process.stderr.close()


def wait_for_block(process: subprocess.Popen[str], path: Path, block: int) -> None:
    """Wait until so many blocks are done."""
    file = path / "progress" / f"{block % 2}.npz"
    for _ in range(6000):
        assert process.poll() is None, process.communicate()[1]
        if file.exists() and store.State.from_file(file).blocks >= block:
            return
        time.sleep(0.01)
    raise AssertionError(f"no block {block}")


def test_what_is_done_outlasts_a_kill(
    child: Callable[[str], subprocess.Popen[str]],
    small: Small,
    uninterrupted: pf.Result,
    tmp_path: Path,
) -> None:
    """Twice, and each time the same call goes on; it ends at the numbers of the undisturbed run."""
    small()
    path = tmp_path / "run.zarr"
    for block in (1, 3):
        process = child(SLOW)
        wait_for_block(process, path, block)
        process.kill()
        process.wait()
        found = so_far(path)
        assert found.time.size >= block * 1000
        assert_begins(found, uninterrupted)
    assert_same(pf.simulate(**inputs(), store=path), uninterrupted)


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX's")
def test_ctrl_c_within_a_block(
    child: Callable[[str], subprocess.Popen[str]], tmp_path: Path
) -> None:
    """A run of minutes ends within a second or so, and says what there is."""
    path = tmp_path / "run.zarr"
    process = child(LONG)
    wait_for_block(process, path, 1)
    begun = time.monotonic()
    process.send_signal(signal.SIGINT)
    assert process.stderr is not None
    told = process.stderr.read()
    assert time.monotonic() - begun < 5.0  # with the interpreter's own end, on a busy machine
    assert process.wait() != 0
    assert "run.zarr holds " in told and "the same call goes on there" in told
    assert so_far(path).lowest[100:1000].max() < -1e-4


@pytest.fixture
def stopped(
    small: Small, uninterrupted: pf.Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Path:
    """Leave a store at which four blocks of six are done."""
    small()
    original = store.Store.write

    def write(self: store.Store, *answer: Any) -> None:
        if self.blocks == 4:
            raise RuntimeError("enough")
        original(self, *answer)

    with monkeypatch.context() as patch:
        patch.setattr(store.Store, "write", write)
        with pytest.raises(RuntimeError, match="enough"):
            pf.simulate(**inputs(), store=tmp_path / "run.zarr")
    return tmp_path / "run.zarr"


def spoil(file: Path) -> None:
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 0xFF
    file.write_bytes(data)


@pytest.mark.parametrize(
    ("harm", "rows"),
    [
        (lambda path: spoil(path / "deflection/c/3/0"), 3000),
        (lambda path: (path / "tire_force/c/3/0").unlink(), 3000),
        (lambda path: spoil(path / "progress/0.npz"), 3000),
        (lambda path: (path / "progress/0.npz").write_bytes(b""), 3000),
        (lambda path: (path / "progress/0.npz").unlink(), 3000),
        (lambda path: (path / "deflection/c/4").mkdir(), 4000),
    ],
)
def test_a_damaged_last_block_is_done_again(
    harm: Callable[[Path], object], rows: int, stopped: Path, uninterrupted: pf.Result
) -> None:
    harm(stopped)
    found = so_far(stopped)
    assert found.time.size == rows
    assert_begins(found, uninterrupted)
    assert_same(pf.simulate(**inputs(), store=stopped), uninterrupted)


def test_without_a_sound_state_it_begins_anew(stopped: Path, uninterrupted: pf.Result) -> None:
    for file in stopped.glob("progress/*.npz"):
        spoil(file)
    with pytest.raises(pf.FormatError, match="no block of its run is done"):
        pf.load_result(stopped)
    assert_same(pf.simulate(**inputs(), store=stopped), uninterrupted)


def test_damage_is_noticed_when_it_is_read(uninterrupted: pf.Result, tmp_path: Path) -> None:
    assert isinstance(uninterrupted, StoredResult)
    path = tmp_path / "run.zarr"
    shutil.copytree(uninterrupted.path, path)
    spoil(path / "deflection/c/2/0")
    result = pf.load_result(path)
    np.testing.assert_array_equal(result.lowest, uninterrupted.lowest)
    with pytest.raises(pf.FormatError, match=r"run\.zarr: not a sound store of a run"):
        _ = result.deflection
    (path / "lowest/c/1").unlink()
    with pytest.raises(pf.FormatError, match="lowest is not finite"):
        pf.load_result(path)


@pytest.mark.parametrize(
    "changes",
    [
        {"speed_kmh": 65.001},
        {"every": 8},
        {"stations": [100.0]},
        {"keep": ["deflection"]},
        {"profile": pf.Profile.iso8608("C", length=450.0, seed=4)},
        {"lift_off": True},
    ],
)
def test_another_runs_store_is_refused(changes: dict[str, Any], stopped: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in stopped.rglob("*")}
    with pytest.raises(ValueError, match="holds the run of other inputs"):
        pf.simulate(**inputs(**changes), store=stopped)
    assert before == {path: path.stat().st_mtime_ns for path in stopped.rglob("*")}


def test_what_is_no_store_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes").write_text("mine")
    folder = tmp_path / "folder"
    folder.mkdir()
    zarr.open_group(tmp_path / "other.zarr", mode="w")
    for name in ("notes", "folder", "other.zarr"):
        with pytest.raises(pf.FormatError, match="not a sound store of a run"):
            pf.simulate(**inputs(), store=tmp_path / name)
    assert (tmp_path / "notes").read_text() == "mine"
    assert not list(folder.iterdir())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"scheme": "paper"}, 'use a Scheme with solver="window"'),
        ({"stations": None}, r"give stations=\[...\]"),
        ({"every": 10**9}, "a smaller every"),
        (
            {"road": pf.Road(pf.Pavement.paper(beam_damping=0.0, bar_damping=0.0), LENGTH)},
            "waves live on, as nothing damps them",
        ),
    ],
)
def test_what_a_store_does_not_take(changes: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=message):
        pf.simulate(**inputs(**changes), store=tmp_path / "run.zarr")
    assert not list(tmp_path.iterdir())


def test_without_zarr_it_is_said_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "zarr", None)
    with pytest.raises(ImportError, match=r"pip install 'pavefem\[zarr\]'"):
        pf.simulate(**inputs(), store=tmp_path / "run.zarr")


def test_memory_does_not_grow_with_the_road(run_python: Callable[..., Any]) -> None:
    """Ten times the road: no more memory but for its nodes, some 200 bytes each."""
    script = """
import resource, sys
import pavefem as pf

road = pf.Road(length=float(sys.argv[1]))
truck = pf.vehicles.tandem_truck()
store = sys.argv[1] + ".zarr"
kept = {"keep": ["deflection"], "stations": [1000.0], "every": 500}
pf.simulate(road, truck, scheme=pf.Scheme.paper(solver="window"), store=store, **kept)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""
    peaks = []
    for length in ("2000", "20000"):
        done = run_python("-c", script, length)
        assert done.returncode == 0, done.stderr
        peaks.append(1024 * int(done.stdout))
    assert peaks[1] - peaks[0] < 200 * 36_000
