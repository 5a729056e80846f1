"""Traffic on a road: as each vehicle alone, as all at once, in parts, and after kills."""

from __future__ import annotations

import importlib
import multiprocessing
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

import pavefem as pf
from pavefem import _core, traffic_store
from pavefem.traffic_result import _between

DT = 1e-3
SOFT, STIFF = pf.Pavement.paper(), pf.Pavement.paper(asphalt=pf.Asphalt(vma=18.0))
ROAD = pf.Road(sections=[(SOFT, 90.0), (STIFF, 60.0)])
TRUCK, RIGID = pf.vehicles.tandem_truck(), pf.vehicles.rigid_truck()
ROUGH = pf.Profile.iso8608("C", length=220.0, seed=3)
SCHEME = pf.Scheme.converged(element_length=0.5)
INPUTS: dict[str, Any] = {"profile": ROUGH, "run_in": 40.0, "scheme": SCHEME, "threads": 1}

module = importlib.import_module("pavefem.simulate_traffic")


class Passage:
    """A vehicle in a lane; places of its course where its speed changes."""

    def __init__(
        self,
        entry: float,
        speed_kmh: float = 65.0,
        *,
        vehicle: int = 0,
        lane: int = 1,
        direction: int = 1,
        offset: float = 0.0,
        course: Sequence[tuple[float, float]] = (),
    ) -> None:
        self.row = (entry, vehicle, speed_kmh, lane, direction, offset)
        self.course = course or ((entry, 0.0),)


def traffic(
    passages: Iterable[Passage], vehicles: Sequence[pf.Vehicle] = (TRUCK, RIGID)
) -> pf.Traffic:
    rows = [*passages]
    entry, vehicle, speed, lane, direction, offset = zip(*(one.row for one in rows), strict=True)
    courses = [np.array(one.course).T if len(one.course) > 1 else None for one in rows]
    return pf.Traffic(
        vehicles,
        vehicle,
        entry,
        speed,
        lane,
        direction,
        offset,
        courses=[None if course is None else (course[0], course[1]) for course in courses],
    )


def run(passages: Iterable[Passage], road: pf.Road = ROAD, **changes: Any) -> pf.TrafficResult:
    return pf.simulate_traffic(road, traffic(passages), **INPUTS | changes)


def random_platoon(seed: int, count: int = 6, speed_kmh: float = 65.0) -> list[Passage]:
    """Followers at one speed, some so close that windows overlap; all come on a step of 2 ms."""
    rng = np.random.default_rng(seed)
    gaps = rng.choice([0.9, 1.3, 2.0, 6.0], count)
    entries = 2e-3 * np.round((0.4 + np.cumsum(gaps) + rng.uniform(0.0, 0.2, count)) / 2e-3)
    kinds = rng.integers(0, 2, count)
    return [
        Passage(float(entry), speed_kmh, vehicle=int(kind))
        for entry, kind in zip(entries, kinds, strict=True)
    ]


def all_axles(
    passages: Sequence[Passage], scheme: pf.Scheme
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places and forces of the axles of all vehicles, which go at one speed."""
    found = []
    for passage in passages:
        entry, vehicle, speed_kmh, *_ = passage.row
        alone = pf.simulate(
            ROAD,
            (TRUCK, RIGID)[vehicle],
            profile=ROUGH,
            run_in=40.0,
            speed_kmh=speed_kmh,
            scheme=scheme,
            keep=["tire_force"],
        )
        assert alone.forces is not None
        found.append((round(entry / scheme.dt), speed_kmh / 3.6, alone.forces))
    steps = max(first + forces.time.size for first, _, forces in found)
    positions, loads = [], []
    for first, speed, forces in found:
        since = scheme.dt * (np.arange(steps)[:, np.newaxis] - first)
        positions.append(forces.position[0] + speed * since)
        load = np.zeros(positions[-1].shape)
        load[first : first + forces.time.size] = forces.force
        loads.append(load)
    return np.concatenate(positions, axis=1), np.concatenate(loads, axis=1)


def assert_merged(found: pf.TrafficResult, whole: pf.TrafficResult, part: float = 1e-6) -> None:
    """What parts come to is what the whole answers."""
    peak = whole.max_deflection
    assert found.dataset.sizes == whole.dataset.sizes
    for name in ("lowest", "highest"):
        np.testing.assert_allclose(
            found.dataset[name], whole.dataset[name], rtol=0, atol=part * peak, err_msg=name
        )
    np.testing.assert_array_equal(found.load_cycles, whole.load_cycles)
    peaks = [result.dataset["pass_peaks"].astype(np.int64) for result in (found, whole)]
    np.testing.assert_array_equal(peaks[0].sum("bin"), peaks[1].sum("bin"))
    assert int(np.abs(peaks[0] - peaks[1]).sum()) <= 4  # some may lie on an edge
    for of in ("deflection", "strain", "force"):
        sums = [result.dataset[f"{of}_sums"] for result in (found, whole)]
        np.testing.assert_allclose(sums[0], sums[1], rtol=20 * part, err_msg=of)
    for name in ("dlc", "max_axle_force", "place_of_force", "entry", "exit"):
        np.testing.assert_allclose(found.dataset[name], whole.dataset[name], rtol=1e-12)
    for name in ("max_deflection", "max_passage_strain"):
        np.testing.assert_allclose(found.dataset[name], whole.dataset[name], rtol=part)
    if "deflection" in whole.dataset:
        np.testing.assert_array_equal(found.dataset["time"], whole.dataset["time"])
        np.testing.assert_allclose(
            found.dataset["deflection"], whole.dataset["deflection"], rtol=0, atol=part * peak
        )


def assert_same(found: pf.TrafficResult, expected: pf.TrafficResult) -> None:
    """All numbers to the last bit."""
    assert {*found.dataset.variables} == {*expected.dataset.variables}
    for name in expected.dataset.variables:
        xr.testing.assert_identical(found.dataset[name], expected.dataset[name])


# --- one vehicle, and many ----------------------------------------------------------------------


@pytest.mark.parametrize("entry", [0.0, 1.234])
def test_one_vehicle_is_that_of_simulate(entry: float) -> None:
    found = run([Passage(entry)], stations=[30.0, 100.3])
    alone = pf.simulate(
        ROAD,
        TRUCK,
        profile=ROUGH,
        run_in=40.0,
        scheme=SCHEME,
        keep=["deflection", "tire_force"],
        stations=[30.0, 100.3],
    )
    lane = found.dataset.sel(lane=1)
    part = 1e-6 * alone.max_deflection
    np.testing.assert_array_equal(lane["x"], alone.x)
    np.testing.assert_allclose(lane["lowest"], alone.lowest, rtol=0, atol=part)
    np.testing.assert_allclose(lane["highest"], alone.highest, rtol=0, atol=part)
    # An end that is held is never lowest.
    when = np.nan_to_num(lane["time_of_lowest"].to_numpy() - entry)
    np.testing.assert_allclose(when, alone.time_of_lowest, rtol=0, atol=1.01 * DT)
    assert (lane["passes"] == 3).all()
    for power in found.dataset["power"].to_numpy():
        np.testing.assert_allclose(
            lane["deflection_sums"].sel(power=power),
            (alone.peak_deflection**power).sum(axis=0),
            rtol=1e-4,
            atol=3.0 * part**power,
        )
    strained = (
        pf.simulate(ROAD, TRUCK, profile=ROUGH, run_in=40.0, scheme=SCHEME, keep=["strain"])
        .histories["strain"]
        .max(axis=0)
    )
    # (Where sections meet and at the ends, a node has the strain of one side.)
    within = ~np.isin(alone.x, [0.0, 90.0, 150.0])
    np.testing.assert_allclose(
        lane["max_strain"].to_numpy()[within], strained[within], rtol=0, atol=1e-6 * strained.max()
    )
    assert alone.forces is not None and alone.deflection is not None
    first = round(entry / DT)
    history = lane["deflection"].to_numpy()[first : first + alone.time.size]
    rows = min(len(history), alone.time.size)
    np.testing.assert_allclose(history[:rows], alone.deflection[:rows], rtol=0, atol=part)
    passage = found.passages.isel(passage=0)
    force = alone.forces.force
    assert float(passage["max_axle_force"]) == pytest.approx(force.max(), rel=1e-9)
    dlc = (force.std(axis=0) / alone.forces.static_loads).max()
    assert float(passage["dlc"]) == pytest.approx(dlc, rel=2e-3)
    assert float(passage["max_deflection"]) == pytest.approx(alone.max_deflection, rel=1e-6)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_followers_at_one_speed_are_one_long_vehicle(seed: int) -> None:
    """The same steps of a window over all axles at once, close followers and far ones."""
    passages = random_platoon(seed)
    found = run(passages, stations=[75.0])
    positions, forces = all_axles(passages, SCHEME)
    table = ROAD.table(20.0, 65.0)
    keep = (["deflection"], False, np.array([75.0]), 1)
    window = _core.Window(table, 0.5, "winkler", "clamped", DT, "hermite", "first", keep)
    history, lowest, highest, *_ = window.run(positions, forces)
    lane = found.dataset.sel(lane=1)
    part = 1e-6 * found.max_deflection
    np.testing.assert_allclose(lane["lowest"], lowest, rtol=0, atol=part)
    np.testing.assert_allclose(lane["highest"], highest, rtol=0, atol=part)
    rows = min(len(history), lane.sizes["time"])
    np.testing.assert_allclose(
        lane["deflection"].to_numpy()[:rows], history[:rows], rtol=0, atol=part
    )


def test_followers_converge_to_the_whole_road_at_second_order() -> None:
    """Against the dense solution, exact in time, of all axles together."""
    passages = random_platoon(4, count=2)
    stations = [30.0, 89.7, 90.0, 120.0]
    off, peak = [], 0.0
    for halvings in (0, 1, 2):
        scheme = SCHEME.model_copy(update={"dt": 1e-3 / 2**halvings})
        found = run(passages, scheme=scheme, stations=stations)
        strip = ROAD.strip(20.0, 65.0, element_length=0.5, foundation="winkler")
        response = _core.Transition.of_strip(strip, scheme.dt)
        keep = (["deflection"], False, np.array(stations), 1)
        stepper = _core.Stepper(strip, response, "hermite", "first", keep)
        whole_road, *_ = stepper.run(*all_axles(passages, scheme))
        history = found.dataset["deflection"].sel(lane=1).to_numpy()
        rows = min(len(history), len(whole_road))
        off.append((history[:rows] - whole_road[:rows])[:: 2**halvings])
        peak = found.max_deflection
    rows = min(len(each) for each in off)
    coarse, middle, fine = (each[:rows] for each in off)
    for more, less in ((coarse, middle), (middle, fine)):
        assert 3.8 < np.abs(more).max() / np.abs(less).max() < 4.2
    # What is left where the step goes to zero, but for terms of higher order.
    limit = (4.0 * fine - middle) / 3.0
    assert np.abs(limit).max() < 1e-5 * peak


def test_other_lanes_change_nothing() -> None:
    """Overtaking is in another lane."""
    alone = run([Passage(1.0, 50.0)])
    others = [Passage(2.0 + 0.4 * k, 90.0, lane=2, vehicle=1) for k in range(9)]
    found = run([Passage(1.0, 50.0), *others, Passage(1.5, 60.0, direction=-1)])
    # (By another speed the mesh may differ, but for the length of elements that is given.)
    for name in ("lowest", "highest", "max_strain", "max_force", "force_sums"):
        np.testing.assert_allclose(
            found.dataset[name].sel(lane=1), alone.dataset[name].sel(lane=1), rtol=1e-12
        )


def test_followers_of_different_stiffness_are_the_sum_of_each() -> None:
    """The rule: each deflection with the stiffness at its own vehicle's speed, then the sum."""
    speeds = [40.0, 65.0, 80.0]
    entries = [0.5, 3.2, 5.0]
    rows = [Passage(entry, speed) for entry, speed in zip(entries, speeds, strict=True)]
    stations = [60.0, 89.7, 120.0]
    found = run(rows, stations=stations, period=(0.0, 16.0))
    singles = [run([row], stations=stations, period=(0.0, 16.0)) for row in rows]
    total = sum(single.dataset["deflection"] for single in singles)
    part = 1e-6 * found.max_deflection
    np.testing.assert_allclose(found.dataset["deflection"], total, rtol=0, atol=part)
    deepest = [float(single.dataset["lowest"].min()) for single in singles]
    assert found.max_deflection > -min(deepest)  # they do meet


def test_who_leaves_and_comes_back_was_never_away() -> None:
    """On a smooth road a passage that is cut in two is the sum of both."""
    speed = 65.0 / 3.6
    stations = [70.0, 75.0, 80.0]
    options: dict[str, Any] = {"profile": None, "stations": stations, "period": (0.0, 12.0)}
    whole = run([Passage(0.5)], **options)
    cut = 4.5
    place = speed * (cut - 0.5)
    end = 0.5 + (ROAD.length + TRUCK.length + 1.0) / speed
    parts = run(
        [
            Passage(0.5, course=[(0.5, 0.0), (cut, place)]),
            Passage(cut, course=[(cut, place), (end, speed * (end - 0.5))]),
        ],
        **options,
    )
    part = 1e-6 * whole.max_deflection
    np.testing.assert_allclose(
        parts.dataset["deflection"], whole.dataset["deflection"], rtol=0, atol=part
    )


def test_the_other_direction_is_a_mirror() -> None:
    rows = [(0.5, 65.0), (2.1, 65.0), (4.0, 50.0)]
    found = run([Passage(*row, direction=-1) for row in rows], stations=[20.0])
    mirrored = pf.Road(sections=[(STIFF, 60.0), (SOFT, 90.0)])
    # Seen from the road's end; the level beyond the last sample is written out.
    x = ROAD.length - (ROUGH.x - ROUGH.x[0] - 40.0)[::-1]
    z = ROUGH.z[::-1]
    profile = pf.Profile(np.append(-40.0, x), np.append(z[0], z))
    expected = run([Passage(*row) for row in rows], mirrored, profile=profile, stations=[130.0])
    one, other = found.dataset.sel(lane=-1), expected.dataset.sel(lane=1)
    part = 1e-6 * found.max_deflection
    for name in ("lowest", "highest", "passes"):
        np.testing.assert_allclose(
            one[name], other[name].to_numpy()[::-1], rtol=0, atol=part, err_msg=name
        )
    np.testing.assert_allclose(one["deflection"], other["deflection"], rtol=0, atol=part)
    np.testing.assert_allclose(
        one["place_of_deflection"], ROAD.length - other["place_of_deflection"], atol=1e-9
    )


def test_a_vehicle_beside_the_track_loads_it_by_its_overlap() -> None:
    full = run([Passage(0.5)])
    for offset in (-0.2, 0.3):
        part = run([Passage(0.5, offset=offset)])
        share = 1.0 - abs(offset) / SOFT.width
        np.testing.assert_allclose(
            part.dataset["lowest"], share * full.dataset["lowest"], rtol=1e-9, atol=1e-15
        )
        np.testing.assert_allclose(part.dataset["max_force"], share * full.dataset["max_force"])
    assert run([Passage(0.5, offset=0.6), Passage(0.5, lane=2)]).dataset["lowest"][0].min() == 0.0


def test_each_lane_has_its_profile() -> None:
    profiles = {1: ROUGH, 2: None}
    found = run([Passage(0.5), Passage(0.5, lane=2)], profile=profiles).dataset
    smooth = run([Passage(0.5, lane=2)], profile=None).dataset
    np.testing.assert_allclose(found["lowest"].sel(lane=2), smooth["lowest"].sel(lane=2), rtol=1e-9)
    assert found["dlc"].to_numpy()[1] == 0.0 < found["dlc"].to_numpy()[0]
    assert float(found["max_axle_force"][1]) == pytest.approx(TRUCK.static_loads.max())


# --- parts --------------------------------------------------------------------------------------


def mixed() -> list[Passage]:
    rng = np.random.default_rng(7)
    return [
        Passage(
            float(rng.uniform(0.0, 12.0)),
            float(rng.uniform(45.0, 90.0)),
            vehicle=int(rng.integers(0, 2)),
            lane=abs(lane),
            direction=int(np.sign(lane)),
        )
        for lane in rng.choice([-2, -1, 1, 2], 12).tolist()
    ]


@pytest.fixture(scope="module")
def whole() -> pf.TrafficResult:
    return run(mixed(), stations=[20.0, 100.0], every=7)


@pytest.mark.parametrize(("stretches", "periods"), [(3, 1), (1, 3), ([40.3, 90.0], [5.0, 6.1])])
def test_parts_put_together_are_the_whole(
    stretches: Any, periods: Any, whole: pf.TrafficResult
) -> None:
    options = {name: INPUTS[name] for name in INPUTS if name != "threads"}
    found = pf.simulate_traffic_in_parts(
        ROAD,
        traffic(mixed()),
        stretches=stretches,
        periods=periods,
        stations=[20.0, 100.0],
        every=7,
        **options,
    )
    assert_merged(found, whole)
    assert {*found.summary()} == {*whole.summary()}


@pytest.mark.parametrize("kind", ["threads", "processes", "dask"])
def test_any_executor_runs_the_parts(kind: str, whole: pf.TrafficResult) -> None:
    options = {name: INPUTS[name] for name in INPUTS if name != "threads"}
    options |= {"stations": [20.0, 100.0], "every": 7, "stretches": 2, "periods": 2}
    if kind == "dask":
        distributed = pytest.importorskip("distributed")
        executor = distributed.Client(processes=False, n_workers=1, dashboard_address=None)
    elif kind == "threads":
        executor = ThreadPoolExecutor(2)
    else:
        spawn = multiprocessing.get_context("spawn")
        executor = ProcessPoolExecutor(1, mp_context=spawn)
    with executor:
        found = pf.simulate_traffic_in_parts(ROAD, traffic(mixed()), executor=executor, **options)
    assert_merged(found, whole)


def test_what_does_not_belong_together_is_not_merged() -> None:
    early, late, later = (
        run([Passage(0.5)], period=period) for period in ((0.0, 5.0), (5.0, 12.0), (4.0, 12.0))
    )
    merge = pf.TrafficResult.merge
    for parts, message in (
        ([], "nothing to merge"),
        ([early, later], "periods overlap"),
        ([early, run([Passage(0.6)], period=(5.0, 12.0))], "different inputs"),
        ([early, run([Passage(0.5)], period=(5.0, 12.0), part=(0.0, 50.0))], "same periods"),
    ):
        with pytest.raises(ValueError, match=message):
            merge(parts)
    assert merge([late, early]).dataset.attrs["begin"] == 0.0


def test_threads_change_nothing(whole: pf.TrafficResult) -> None:
    found = run(mixed(), stations=[20.0, 100.0], every=7, threads=2)
    for name, values in whole.dataset.items():
        if values.dtype.kind == "f":
            np.testing.assert_allclose(found.dataset[name], values, rtol=1e-12, err_msg=str(name))


def test_single_precision_is_near(whole: pf.TrafficResult) -> None:
    found = run(mixed(), stations=[20.0, 100.0], every=7, precision="single")
    off = np.abs(found.dataset["lowest"] - whole.dataset["lowest"]).max()
    assert 0.0 < off < 1e-4 * whole.max_deflection


# --- stores -------------------------------------------------------------------------------------


def stop_at(tick: int, patch: pytest.MonkeyPatch) -> None:
    """Have Ctrl-C come at a tick."""
    advance = module.TrafficRun._advance

    def _advance(self: Any, ticks: int) -> None:
        if self._core.tick >= tick:
            raise KeyboardInterrupt
        advance(self, ticks)

    patch.setattr(module.TrafficRun, "_advance", _advance)


def run_until(tick: int, **options: Any) -> str:
    """Run mixed traffic into a store, written at every turn, until Ctrl-C: what is told of it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(traffic_store, "INTERVAL", 0.0)
        patch.setattr(traffic_store, "_PART", 1e9)
        patch.setattr(module, "_TURN", 0.0)
        stop_at(tick, patch)
        with pytest.raises(KeyboardInterrupt) as caught:
            run(mixed(), **options)
    [note] = caught.value.__notes__
    return str(note)


def test_a_store_goes_on_to_the_same_bits(whole: pf.TrafficResult, tmp_path: Path) -> None:
    options: dict[str, Any] = {"stations": [20.0, 100.0], "every": 7, "store": tmp_path / "day"}
    for tick in (1500, 3500):
        assert "and the same call goes on there" in run_until(tick, **options)
        with pytest.warns(UserWarning, match="not finished, this is"):
            so_far = pf.load_traffic_result(tmp_path / "day")
        assert so_far.dataset.attrs["done"] == pytest.approx(1e-3 * tick, abs=0.3)
        rows = so_far.dataset.sizes["time"]
        np.testing.assert_array_equal(
            so_far.dataset["deflection"], whole.dataset["deflection"][:rows]
        )
        assert 0 < rows == -(-round(so_far.dataset.attrs["done"] / DT) // 7)
        assert "not finished" in so_far.summary()
    assert_same(run(mixed(), **options), whole)
    assert {path.name for path in (tmp_path / "day").iterdir()} == {"run.json", "result.nc"}
    assert_same(run(mixed(), **options), whole)  # it is there
    assert_same(pf.load_traffic_result(tmp_path / "day"), whole)


def test_a_damaged_state_is_done_again(whole: pf.TrafficResult, tmp_path: Path) -> None:
    options: dict[str, Any] = {"stations": [20.0, 100.0], "every": 7, "store": tmp_path / "day"}
    run_until(1500, **options)
    states = sorted((tmp_path / "day").glob("state-*.bin"), key=lambda path: path.stat().st_mtime)
    data = bytearray(states[-1].read_bytes())
    data[len(data) // 2] ^= 1
    states[-1].write_bytes(data)
    assert_same(run(mixed(), **options), whole)
    shutil.rmtree(tmp_path / "day")
    run_until(1500, **options)
    for path in (tmp_path / "day").glob("*.npy"):
        path.write_bytes(b"")
    assert_same(run(mixed(), **options), whole)


def test_a_store_of_something_else_is_refused(tmp_path: Path) -> None:
    run([Passage(0.5)], store=tmp_path / "day")
    with pytest.raises(ValueError, match="holds the run of other inputs"):
        run([Passage(0.6)], store=tmp_path / "day")
    (tmp_path / "day" / "run.json").write_text("{")
    with pytest.raises(pf.FormatError, match="not a sound store"):
        run([Passage(0.5)], store=tmp_path / "day")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "letter.txt").touch()
    with pytest.raises(ValueError, match=r"has files, but no run\.json"):
        run([Passage(0.5)], store=tmp_path / "full")


KILLED = """
import sys
sys.path.insert(0, {tests!r})
import test_simulate_traffic as own
from pavefem import traffic_store
traffic_store.INTERVAL, traffic_store._PART = 0.0, 1e9
own.module._TURN = 0.01
own.run(own.mixed(), stations=[20.0, 100.0], every=7, store="day")
"""


def test_what_is_done_outlasts_a_kill(whole: pf.TrafficResult, tmp_path: Path) -> None:
    code = KILLED.format(tests=str(Path(__file__).parent))
    process = subprocess.Popen([sys.executable, "-c", code], cwd=tmp_path)
    until = time.monotonic() + 60.0
    while not (tmp_path / "day" / "state-1.bin").exists() and time.monotonic() < until:
        assert process.poll() is None
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    options: dict[str, Any] = {"stations": [20.0, 100.0], "every": 7, "store": tmp_path / "day"}
    assert_same(run(mixed(), **options), whole)


# --- what is kept -------------------------------------------------------------------------------


def test_what_is_kept_fits_together(whole: pf.TrafficResult) -> None:
    dataset = whole.dataset
    assert (dataset["pass_peaks"].sum("bin") == dataset["passes"]).all()
    axles = sum(len((TRUCK, RIGID)[row.row[1]].tires) for row in mixed())
    assert (dataset["passes"].sum("lane") == axles).all()
    assert (dataset["lowest"] <= 0.0).all()
    largest = dataset["deflection_sums"].sel(power=8.0) ** (1.0 / 8.0)
    assert (largest >= -dataset["lowest"] * (1.0 - 1e-9)).all()
    counts = whole.pass_peaks(1, 75.2)
    assert counts.dims == ("bin",)
    deepest = -float(dataset["lowest"].sel(lane=1, x=75.0))
    filled = counts.where(counts > 0, drop=True)
    assert float(filled["bin_start"][-1]) <= deepest < float(filled["bin_end"][-1])
    assert float(dataset["max_deflection"].max()) == whole.max_deflection


def test_worst_places_are_apart_and_in_order(whole: pf.TrafficResult) -> None:
    worst = whole.worst(6, apart=25.0)
    peaks = worst["max_deflection"].to_numpy()
    assert peaks[0] == whole.max_deflection and (np.diff(peaks) <= 0.0).all()
    for lane in np.unique(worst["lane"]):
        places = np.sort(worst["x"].to_numpy()[worst["lane"].to_numpy() == lane])
        assert (np.diff(places) >= 25.0).all()
    first = whole.dataset.sel(lane=int(worst["lane"][0]), x=float(worst["x"][0]))
    assert float(worst["time"][0]) == float(first["time_of_lowest"])
    assert whole.worst(1000).sizes["rank"] < 1000
    assert worst.to_dataframe().shape == (6, 6)


def test_worst_vehicles_are_in_order(whole: pf.TrafficResult) -> None:
    for by in ("max_deflection", "max_axle_force", "dlc", "max_passage_strain"):
        found = whole.worst_vehicles(4, by=by)
        values = found[by].to_numpy()
        assert values.size == 4 and (np.diff(values) <= 0.0).all()
        assert values[0] == whole.dataset[by].max()


def test_damage_is_exact_at_powers_and_bounded_between(whole: pf.TrafficResult) -> None:
    passes = whole.damage(0.0, reference=1.0)
    np.testing.assert_array_equal(passes, whole.load_cycles)
    exact = run(mixed(), powers=[0.5, 3.0, 4.0, 4.5, 6.5])
    for of, reference in (("strain", 1e-4), ("deflection", 5e-4), ("force", 40e3)):
        at_four = whole.damage(4.0, of=of, reference=reference)  # type: ignore[arg-type]
        assert at_four.attrs["error"] == 0.0
        sums = whole.dataset[f"{of}_sums"].sel(power=4.0)
        np.testing.assert_allclose(at_four, sums / reference**4, rtol=1e-12)
        for exponent in (0.5, 3.0, 4.5, 6.5):
            found = whole.damage(exponent, of=of, reference=reference)  # type: ignore[arg-type]
            true = exact.damage(exponent, of=of, reference=reference)  # type: ignore[arg-type]
            off = abs(found / true - 1.0)
            assert off.max() <= found.attrs["error"] + 1e-9
            assert float(off.median()) < 0.01
    with pytest.raises(ValueError, match="must be 0 to 8, the largest power that was kept"):
        whole.damage(8.1, reference=1.0)


@given(
    peaks=st.lists(st.floats(1e-6, 1e-3), min_size=1, max_size=30),
    exponent=st.floats(0.0, 8.0),
)
def test_sums_of_powers_between_are_within_their_bound(peaks: list[float], exponent: float) -> None:
    powers = np.array([0.0, 1.0, 2.0, 4.0, 5.0, 8.0])
    values = np.array(peaks)
    sums = (values[:, np.newaxis] ** powers).sum(axis=0)
    found, error = _between(powers, sums, exponent)
    true = (values**exponent).sum()
    assert abs(float(found) / true - 1.0) <= error * (1.0 + 1e-6) + 1e-9


def test_a_file_has_all_of_it(whole: pf.TrafficResult, tmp_path: Path) -> None:
    whole.to_netcdf(tmp_path / "result.nc")
    found = pf.load_traffic_result(tmp_path / "result.nc")
    assert_same(found, whole)
    assert found.summary() == whole.summary()
    with pytest.raises(pf.FormatError, match="load_traffic_result"):
        pf.load_result(tmp_path / "result.nc")


def test_other_files_are_refused(
    whole: pf.TrafficResult, nominal: pf.Result, tmp_path: Path
) -> None:
    path = tmp_path / "other.nc"
    nominal.to_netcdf(path)
    with pytest.raises(pf.FormatError, match="not a pavefem result of traffic: its title"):
        pf.load_traffic_result(path)
    for changed, message in (
        (whole.dataset.drop_vars("lowest"), "it has no lowest"),
        (whole.dataset.isel(x=slice(0)), "is empty"),
        (whole.dataset.assign(lowest=np.nan * whole.dataset["lowest"]), "lowest is not finite"),
    ):
        changed.to_netcdf(path, engine="h5netcdf")
        with pytest.raises(pf.FormatError, match=message):
            pf.load_traffic_result(path)
    path.write_bytes(b"CDF")
    with pytest.raises(pf.FormatError, match="not a sound netCDF file"):
        pf.load_traffic_result(path)
    with pytest.raises(FileNotFoundError):
        pf.load_traffic_result(tmp_path / "none.nc")


# --- speeds and stiffness -----------------------------------------------------------------------


def test_constants_at_many_speeds_are_those_at_each() -> None:
    speeds = [20.0, 65.0, 90.0]
    found = ROAD.constants_at(20.0, speeds)
    assert found.shape == (3, 2, 6)
    for row, speed in zip(found, speeds, strict=True):
        np.testing.assert_array_equal(row, ROAD.table(20.0, speed)[:, 1:])


def test_a_hundred_thousand_speeds_take_no_time() -> None:
    started = time.perf_counter()
    ROAD.constants_at(20.0, np.linspace(20.0, 90.0, 100_000))
    assert time.perf_counter() - started < 1.0


def test_who_stands_loads_asphalt_as_at_walking_pace() -> None:
    course = [(0.5, 0.0), (4.5, 60.0), (7.5, 60.0), (12.5, 160.0)]
    with pytest.warns(pf.ValidityWarning) as told:
        found = run([Passage(0.5, course=course)])
    assert any("slower than 5 km/h" in str(each.message) for each in told)
    assert np.isfinite(found.max_deflection) and (found.load_cycles == len(TRUCK.tires)).all()


# --- mistakes -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"scheme": "paper"}, r'Scheme.paper\(solver="window"\)'),
        ({"scheme": pf.Scheme.converged(order=3)}, "order=2"),
        ({"profile": {2: ROUGH}}, r"traffic is on \[1\]"),
        ({"profile": pf.Profile.iso8608("B", length=100.0, seed=1)}, "need 190 m"),
        ({"period": (3.0, 2.0)}, "must begin at 0 or later, and end after that"),
        ({"period": (2.00001, 2.00002)}, "must hold a step"),
        ({"part": (200.0, 300.0)}, "must begin on the road"),
        ({"part": (10.1, 10.2)}, "holds no node"),
        ({"stations": [151.0]}, "not on the road, 0 to 150 m"),
        ({"powers": [2.0, 1.0]}, "must increase"),
        ({"powers": [-1.0]}, "greater than 0"),
        ({"bins": [1e-3, 1e-3]}, "must increase"),
        ({"every": 0}, "greater than or equal to 1"),
        ({"precision": "half"}, "double"),
        ({"threads": 0}, "threads = 0"),
        ({"temperature_c": float("nan")}, "finite"),
        ({"run_in": -1.0}, "greater than or equal to 0"),
    ],
)
def test_mistakes_are_told(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        run([Passage(0.5)], **changes)


def test_what_traffic_cannot_have_is_told_by_name() -> None:
    rubbing = pf.vehicles.quarter_car(dry_friction=0.1)
    with pytest.raises(ValueError, match=f"{rubbing.name}: has springs with dry friction"):
        pf.simulate_traffic(ROAD, traffic([Passage(0.5)], [rubbing]), **INPUTS)
    wide = pf.Road(sections=[(SOFT, 90.0), (pf.Pavement.paper(moment_of_inertia=6e-5), 60.0)])
    run([Passage(0.5)], wide)
    with pytest.raises(ValueError, match="what share of them loads the strip"):
        run([Passage(0.5, offset=0.1)], wide)
    undamped = pf.Road(pf.Pavement.paper(beam_damping=0.0, bar_damping=0.0), length=150.0)
    with pytest.raises(ValueError, match="does not forget"):
        run([Passage(0.5)], undamped)
    with pytest.raises(ValueError, match="must be one of"):
        run([Passage(0.5)]).pass_peaks(3, 10.0)
    with pytest.raises(ValueError, match="no history was kept"):
        run([Passage(0.5)]).history(1, 10.0)


# --- the command, and pictures ------------------------------------------------------------------

SCENARIO = """
run_in = 40.0
stations = [75.0]

[road]
length = 150.0

[traffic]
make = "generate"
duration = 40.0
seed = 1
length = 150.0

[profile]
make = "iso8608"
road_class = "C"
length = 220.0
seed = 3

[scheme]
preset = "converged"
element_length = 0.5
"""


@pytest.mark.draws
def test_the_command_writes_result_and_pictures(pavefem: Any, tmp_path: Path) -> None:
    (tmp_path / "scenario.toml").write_text(SCENARIO, encoding="utf-8")
    done = pavefem("traffic", "scenario.toml", "--out", "found", "--threads", "1", "--worst", "3")
    assert done.code == 0, done.err
    for text in ("largest deflection", "times real time", "worst places", "relative damage"):
        assert text in done.out
    names = {path.name for path in (tmp_path / "found").iterdir()}
    assert names == {"result.nc", "map.png", "time-distance.png"}
    found = pf.load_traffic_result(tmp_path / "found" / "result.nc")
    scenario = pf.TrafficScenario.from_toml(tmp_path / "scenario.toml")
    assert_same(found, pf.run_traffic(scenario, threads=1))
    told = pavefem("info", "scenario.toml", "found/result.nc")
    assert told.code == 0 and "scenario of traffic" in told.out and "result of traffic" in told.out


@pytest.mark.parametrize("store", [(), ("--store", "day")])
def test_ctrl_c_keeps_what_is_done(
    store: tuple[str, ...], pavefem: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "scenario.toml").write_text(SCENARIO, encoding="utf-8")
    monkeypatch.setattr(module, "_TURN", 0.0)
    with monkeypatch.context() as patch:
        stop_at(5000, patch)
        done = pavefem("traffic", "scenario.toml", *store)
    assert done.code == 130
    assert "stopped" in done.err and "has what was done, 5" in done.err
    so_far = pf.load_traffic_result(tmp_path / "out" / "result.nc")
    assert not so_far.is_finished and so_far.max_deflection > 0.0
    assert so_far.dataset.sizes["time"] == round(so_far.dataset.attrs["done"] / DT)
    if store:
        assert "the same call goes on there" in done.err
        assert pavefem("traffic", "scenario.toml", *store).code == 0
        scenario = pf.TrafficScenario.from_toml(tmp_path / "scenario.toml")
        found = pf.load_traffic_result(tmp_path / "out" / "result.nc")
        assert_same(found, pf.run_traffic(scenario))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("seed = 1", "sed = 1", "traffic: generate has no sed"),
        ("[traffic]", "[trafic]", "traffic: Field required"),
        ('preset = "converged"', 'preset = "paper"', "scheme: solver='dense'"),
        ("length = 220.0", "length = 100.0", "need 190 m"),
        ("run_in = 40.0", "run_on = 40.0", "run_on: Extra inputs"),
        ('make = "iso8608"', 'make = "fractal"', "profile: make = 'fractal'"),
    ],
)
def test_mistakes_of_a_file_are_told_by_key(
    old: str, new: str, message: str, pavefem: Any, tmp_path: Path
) -> None:
    (tmp_path / "scenario.toml").write_text(SCENARIO.replace(old, new), encoding="utf-8")
    done = pavefem("traffic", "scenario.toml")
    assert done.code == 2
    assert message in done.err and "Traceback" not in done.err


def test_pictures_show_the_worst(whole: pf.TrafficResult) -> None:
    figure = whole.plot()
    above, below = figure.axes[:2]
    assert [label.get_text() for label in above.get_yticklabels()] == ["-2", "-1", "1", "2"]
    assert below.get_ylim()[1] > 1e3 * whole.max_deflection
    axes = whole.plot_time_distance().axes[0]
    segments = [line for lines in axes.collections for line in lines.get_segments()]  # type: ignore[attr-defined]
    assert len(segments) == whole.dataset.sizes["passage"]
    assert all(segment[0, 1] in (0.0, ROAD.length) for segment in segments)
