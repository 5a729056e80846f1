"""Load measures against their closed forms for sinusoidal and Gaussian forces.

Sources
-------
A force F_s (1 + a sin) has a DLC of a / sqrt 2 and a mean fourth power of 1 + 3 a² + 3/8 a⁴ (times
F_s⁴); a Gaussian one of 1 + 6 DLC² + 3 DLC⁴, Eisenmann's road stress factor (1975). Sums of
sinusoids and their correlation follow from their phases. ESAL and load sharing are done by hand.

Goal: all of it to rounding, where sampling is exact (whole waves at equal steps); a fleet known by
its statistics gives what its histories give; scale and order of vehicles change nothing.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure
from oracle import Array
from scipy.interpolate import interp1d

import pavefem as pf
from pavefem import metrics, plotting

NAN, INF = float("nan"), float("inf")

WAVE, STEP = 8.0, 0.125
"""Length of the waves along the road, and what a vehicle travels between instants, m."""
WAVES = np.arange(16.0, 16.0 + 5 * WAVE, STEP)
"""Stations over five whole waves, each at an instant of every axle."""
EXACT = 1e-13


def run(
    *force: Callable[[Array], Array],
    static: Sequence[float] | float = 50e3,
    spacing: float = 4.0,
    length: float = 80.0,
) -> pf.TireForces:
    """Make a run from the force of each axle as a function of its place."""
    travel = np.arange(0.0, length, STEP)
    place = travel[:, np.newaxis] - spacing * np.arange(len(force))
    return pf.TireForces(
        time=travel / 20.0,
        position=place,
        force=np.stack([f(x) for f, x in zip(force, place.T, strict=True)], axis=1),
        static_loads=np.broadcast_to(static, len(force)).astype(float),
    )


def wave(a: float, phase: float = 0.0, static: float = 50e3) -> Callable[[Array], Array]:
    return lambda x: static * (1.0 + a * np.sin(2.0 * np.pi * x / WAVE + phase))


def fleet(*runs: pf.TireForces) -> xr.Dataset:
    vehicles = [one.dataset for one in runs]
    together: xr.Dataset = xr.concat(vehicles, "vehicle", data_vars="all", join="outer")
    return together.assign_coords(vehicle=[f"V{i}" for i in range(len(runs))])


def statistics(histories: xr.Dataset, stations: Array) -> xr.Dataset:
    """Reduce a fleet to what is left of it where histories are not kept."""
    force = histories["tire_force"]
    return xr.Dataset(
        {
            "static_load": histories["static_load"],
            "mean_force": force.mean("time"),
            "std_force": force.std("time"),
            "min_force": force.min("time"),
            "max_force": force.max("time"),
            "station_force": metrics.station_forces(histories, stations),
        }
    )


def one_of_each() -> xr.Dataset:
    """Make a fleet of a three-axle and a two-axle vehicle, the second of a shorter run."""
    long = run(wave(0.2), wave(0.1, 1.0), wave(0.3, 2.0), static=[50e3, 60e3, 70e3])
    short = run(wave(0.25, 0.5), wave(0.15, 2.5), static=[40e3, 80e3], spacing=1.5, length=72.0)
    return fleet(long, short)


# --- force at stations --------------------------------------------------------------------------


def test_force_between_instants_is_linear() -> None:
    """Midway, a chord of the sine is lower than the sine by cos(half a step)."""
    forces = run(wave(0.3), wave(0.3, 1.0))
    stations = WAVES + STEP / 2.0
    found = metrics.station_forces(forces, stations)
    chord = np.cos(np.pi * STEP / WAVE)
    for axle, phase in ((1, 0.0), (2, 1.0)):
        expected = wave(0.3 * chord, phase)(stations)
        np.testing.assert_allclose(found.sel(axle=axle), expected, rtol=EXACT)
    assert found.dims == ("station", "axle")
    assert (found.attrs["units"], found["station"].attrs["units"]) == ("N", "m")


def test_an_axle_does_not_pass_before_its_start_nor_after_its_end() -> None:
    """Axles go from 0 and -4 m to 79.875 and 75.875 m."""
    found = metrics.station_forces(run(wave(0.1), wave(0.1)), [-4.0, -1.0, 0.0, 75.875, 76.0, 80.0])
    passed = found.notnull().to_numpy()
    assert passed.T.tolist() == [
        [False, False, True, True, True, False],
        [True, True, True, True, False, False],
    ]


def test_stations_are_those_of_the_road_that_all_axles_pass(truck: pf.Vehicle) -> None:
    """Every 0.25 m from the front axle's start at 0 to the last one's end, 5.85 m behind 30 m."""
    found = metrics.station_forces(pf.tire_forces(truck, None, speed_kmh=65.0, distance=30.0))
    np.testing.assert_array_equal(found["station"], np.arange(0.0, 24.01, 0.25))
    np.testing.assert_allclose(found, np.tile(truck.static_loads, (97, 1)), rtol=1e-12)


@pytest.mark.parametrize("off", [-1e-10, 0.0, 1e-10])
def test_stations_missed_by_rounding_only_are_passed(off: float) -> None:
    """Instants from 0 to 80 m, but for rounding."""
    forces = run(wave(0.1), length=80.125)
    found = metrics.station_forces(replace(forces, position=forces.position + off))
    np.testing.assert_array_equal(found["station"], np.arange(0.0, 80.01, 0.25))
    np.testing.assert_allclose(found[:, 0], wave(0.1)(found["station"].to_numpy()), rtol=1e-9)


def test_stations_of_a_result_are_on_its_road(rough_run: pf.Result) -> None:
    """From 0 to 25 m; the last instant is within a step of the last axle's leaving at 25 m."""
    found = metrics.station_forces(rough_run)
    np.testing.assert_array_equal(found["station"], np.arange(0.0, 24.8, 0.25))
    forces = rough_run.forces
    assert forces is not None
    for axle in range(3):
        expected = interp1d(forces.position[:, axle], forces.force[:, axle])(found["station"][1:-1])
        np.testing.assert_allclose(found[1:-1, axle], expected, rtol=1e-12)


def test_a_fleet_keeps_its_vehicles_apart() -> None:
    together = metrics.station_forces(one_of_each(), WAVES)
    assert together.dims == ("vehicle", "station", "axle")
    np.testing.assert_allclose(together[0, :, 2], wave(0.3, 2.0)(WAVES), rtol=EXACT)
    np.testing.assert_allclose(together[1, :, 0], wave(0.25, 0.5)(WAVES), rtol=EXACT)
    assert together[1, :, 2].isnull().all()


def test_stations_of_a_fleet_without_histories() -> None:
    kept = statistics(one_of_each(), WAVES)
    np.testing.assert_array_equal(metrics.station_forces(kept), kept["station_force"])
    some = metrics.station_forces(kept, WAVES[3:30:7] + 1e-11)
    np.testing.assert_array_equal(some, kept["station_force"].isel(station=slice(3, 30, 7)))


# --- DLC and road stress factor -----------------------------------------------------------------


@pytest.mark.parametrize("a", [0.0, 0.05, 0.3, 0.9])
def test_dlc_of_a_sinusoid(a: float) -> None:
    found = metrics.dlc(run(wave(a), wave(a / 2.0, 0.7, static=80e3), static=[50e3, 80e3]))
    np.testing.assert_allclose(found, [a / np.sqrt(2.0), a / np.sqrt(8.0)], rtol=EXACT, atol=1e-15)
    assert (found.dims, found.name, found.attrs["units"]) == (("axle",), "dlc", "1")


def test_dlc_is_about_the_mean_over_the_static_load() -> None:
    """A mean force off the static load does not count as dynamic."""
    found = metrics.dlc(run(lambda x: wave(0.2)(x) + 10e3))
    np.testing.assert_allclose(found, [0.2 / np.sqrt(2.0)], rtol=EXACT)


def test_dlc_of_a_run(rough_run: pf.Result) -> None:
    forces = rough_run.forces
    assert forces is not None
    expected = forces.force.std(axis=0) / forces.static_loads
    assert expected.min() > 0.05
    for given_as in (rough_run, forces, forces.dataset):
        np.testing.assert_allclose(metrics.dlc(given_as), expected, rtol=1e-12)


def test_road_stress_factor_is_the_gaussian_fourth_moment() -> None:
    """By Gauss-Hermite quadrature, exact for a polynomial of fourth degree."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(3)
    for spread in (0.0, 0.1, 0.25, 0.6):
        moment = (weights * (1.0 + spread * nodes) ** 4).sum() / weights.sum()
        assert metrics.road_stress_factor(spread) == pytest.approx(moment, rel=1e-14)


def test_road_stress_factor_of_a_gaussian_force() -> None:
    """The mean of the aggregate force of a random force, within four of its standard errors."""
    force = 50e3 * (1.0 + 0.15 * np.random.default_rng(1).standard_normal(100_000))
    forces = run(lambda x: force, length=force.size * STEP)
    ratio = metrics.aggregate_force(forces, forces.position[:, 0])["ratio"]
    factor = metrics.road_stress_factor(metrics.dlc(forces)).item()
    assert factor == pytest.approx(1.0 + 6.0 * 0.15**2 + 3.0 * 0.15**4, rel=0.01)
    # The sample's DLC is that of the same numbers: only third and fourth moments are random.
    assert float(ratio.mean()) == pytest.approx(factor, abs=4.0 * float(ratio.std()) / 316.0)


def test_road_stress_factor_of_a_sinusoid_is_too_high_by_the_fourth_power() -> None:
    """1 + 3 a² + 3/8 a⁴ for the sinusoid, 1 + 3 a² + 3/4 a⁴ for a Gaussian force of its DLC."""
    a = 0.4
    forces = run(wave(a))
    ratio = metrics.aggregate_force(forces, WAVES)["ratio"].mean()
    np.testing.assert_allclose(ratio, 1.0 + 3.0 * a**2 + 0.375 * a**4, rtol=EXACT)
    factor = metrics.road_stress_factor(metrics.dlc(forces))
    np.testing.assert_allclose(factor - ratio, 0.375 * a**4, rtol=1e-11)


def test_road_stress_factor_keeps_its_type() -> None:
    assert type(metrics.road_stress_factor(0.1)) is float
    array = metrics.road_stress_factor(np.array([[0.1, 0.2]]))
    assert type(array) is np.ndarray and array.shape == (1, 2)
    labelled = metrics.road_stress_factor(metrics.dlc(one_of_each()))
    assert isinstance(labelled, xr.DataArray)
    assert labelled.dims == ("vehicle", "axle")
    assert labelled.isnull().sum() == 1  # the axle that is not there


# --- aggregate force ----------------------------------------------------------------------------


@pytest.mark.parametrize("power", [1.0, 2.0, 4.0])
def test_aggregate_of_axles_in_step(power: float) -> None:
    """Peaks on the same places: N axles press N times as one, everywhere."""
    found = metrics.aggregate_force(run(*4 * [wave(0.3)]), WAVES, power)
    one = wave(0.3)(WAVES) ** power
    np.testing.assert_allclose(found["aggregate"], 4.0 * one, rtol=EXACT)
    np.testing.assert_allclose(found["static"], 4.0 * 50e3**power, rtol=EXACT)
    np.testing.assert_allclose(found["ratio"], one / 50e3**power, rtol=EXACT)


@pytest.mark.parametrize(
    ("power", "axles", "ratio"),
    [(1.0, 2, 1.0), (2.0, 3, 1.0 + 0.3**2 / 2.0), (4.0, 5, 1.0 + 3 * 0.3**2 + 0.375 * 0.3**4)],
)
def test_aggregate_of_axles_that_cancel(power: float, axles: int, ratio: float) -> None:
    """Phases spread evenly over more axles than the power leave the mean alone, everywhere."""
    phases = 2.0 * np.pi * np.arange(axles) / axles
    found = metrics.aggregate_force(run(*(wave(0.3, phase) for phase in phases)), WAVES, power)
    np.testing.assert_allclose(found["ratio"], ratio, rtol=EXACT)
    np.testing.assert_allclose(found["percentile_95"] / found["static"], ratio, rtol=EXACT)


def test_percentile_of_a_sinusoid() -> None:
    """A sine is below sin(0.45 pi) on 95 % of its way; n stations leave it uncertain by pi / n."""
    a, n = 0.3, 4001
    found = metrics.aggregate_force(
        run(lambda x: wave(a)(WAVE * np.round(x / STEP) / n), length=n * STEP),
        STEP * np.arange(n),
    )
    expected = (1.0 + a * np.sin(0.45 * np.pi)) ** 4
    slope = 4.0 * (1.0 + a) ** 3 * a * np.cos(0.45 * np.pi - np.pi / n)
    ratio = float(found["percentile_95"] / found["static"])
    assert ratio == pytest.approx(expected, abs=slope * np.pi / n)


def test_aggregate_of_a_run_by_hand(rough_run: pf.Result) -> None:
    """The sum written out, with scipy's interpolation and numpy's percentile."""
    forces = rough_run.forces
    assert forces is not None
    stations = np.arange(0.5, 24.6, 0.5)
    total = sum(
        interp1d(forces.position[:, axle], forces.force[:, axle])(stations).clip(0.0) ** 4
        for axle in range(3)
    )
    found = metrics.aggregate_force(rough_run, stations)
    np.testing.assert_allclose(found["aggregate"], total, rtol=1e-12)
    np.testing.assert_allclose(found["percentile_95"], np.percentile(total, 95.0), rtol=1e-12)
    np.testing.assert_allclose(found["static"], (forces.static_loads**4).sum(), rtol=1e-12)


def test_stations_that_an_axle_misses_are_left_out() -> None:
    stations = np.arange(-8.0, 90.0, 2.0)
    found = metrics.aggregate_force(run(wave(0.3), wave(0.3)), stations)
    np.testing.assert_array_equal(found["station"], np.arange(0.0, 75.0, 2.0))
    np.testing.assert_array_equal(
        found["left_out"], [-8.0, -6.0, -4.0, -2.0, *np.arange(76.0, 90.0, 2.0)]
    )
    assert found["left_out"].attrs["long_name"].startswith("stations left out")
    assert not found.isnull().to_dataarray().any()
    inside = metrics.aggregate_force(run(wave(0.3), wave(0.3)), stations[4:42])
    np.testing.assert_array_equal(inside["percentile_95"], found["percentile_95"])
    assert inside["left_out"].size == 0


def test_tires_that_left_the_road_do_not_damage_it() -> None:
    """A force of -100 % to 300 % of the static load: the part below zero adds nothing."""
    found = metrics.aggregate_force(run(wave(2.0)), WAVES)
    pressing = np.maximum(wave(2.0)(WAVES), 0.0)
    assert (pressing == 0.0).any()
    np.testing.assert_allclose(found["aggregate"], pressing**4, rtol=EXACT)


def test_aggregate_of_a_fleet_is_the_sum_of_its_vehicles() -> None:
    vehicles = one_of_each()
    each = metrics.aggregate_force(vehicles, WAVES)
    assert each["aggregate"].dims == ("vehicle", "station")
    assert each["static"].dims == each["percentile_95"].dims == ("vehicle",)
    whole = metrics.aggregate_force(vehicles, WAVES, fleet=True)
    assert whole["aggregate"].dims == ("station",)
    by_hand = wave(0.2)(WAVES) ** 4 + wave(0.1, 1.0)(WAVES) ** 4 + wave(0.3, 2.0)(WAVES) ** 4
    np.testing.assert_allclose(each["aggregate"][0], by_hand, rtol=EXACT)
    by_hand += wave(0.25, 0.5)(WAVES) ** 4 + wave(0.15, 2.5)(WAVES) ** 4
    np.testing.assert_allclose(whole["aggregate"], by_hand, rtol=EXACT)
    statics = np.array([50e3, 60e3, 70e3, 40e3, 80e3])
    np.testing.assert_allclose(whole["static"], (statics**4).sum(), rtol=EXACT)
    np.testing.assert_allclose(
        whole["percentile_95"], np.percentile(whole["aggregate"], 95.0), rtol=EXACT
    )


def test_aggregate_says_what_it_is(tmp_path: Path) -> None:
    found = metrics.aggregate_force(run(wave(0.1)), WAVES)
    for name in ("aggregate", "static", "percentile_95"):
        assert found[name].attrs["units"] == "N^4"
    assert found["ratio"].attrs["units"] == "1"
    assert "sum of F^4" in found["aggregate"].attrs["long_name"]
    assert metrics.aggregate_force(run(wave(0.1)), power=1)["aggregate"].attrs["units"] == "N"
    found.to_netcdf(tmp_path / "aggregate.nc", engine="h5netcdf")
    back = xr.load_dataset(tmp_path / "aggregate.nc", engine="h5netcdf")
    xr.testing.assert_identical(back, found)


# --- spatial repeatability ----------------------------------------------------------------------


def sri(first: pf.TireForces, second: pf.TireForces, **options: Any) -> float:
    return float(metrics.spatial_repeatability(first, second, **{"stations": WAVES} | options))


@given(st.floats(-7.0, 7.0), st.floats(0.01, 0.9), st.floats(0.01, 0.9))
def test_repeatability_of_shifted_sinusoids(phase: float, a: float, b: float) -> None:
    """The correlation of two sines is the cosine of the phase between them, whatever their size."""
    first, second = run(wave(a)), run(wave(b, phase, static=80e3), static=80e3)
    assert sri(first, second) == pytest.approx(np.cos(phase), abs=1e-10)
    assert 1.0 - EXACT < sri(second, second) <= 1.0


def test_repeatability_of_a_vehicle_with_itself_and_its_opposite() -> None:
    forces = run(wave(0.3), wave(0.2, 1.0))
    assert sri(forces, forces) == pytest.approx(1.0, abs=EXACT)
    opposite = replace(forces, force=2.0 * forces.static_loads - forces.force)
    assert sri(forces, opposite) == pytest.approx(-1.0, abs=EXACT)


def test_repeatability_of_unrelated_vehicles() -> None:
    """Waves of another length are orthogonal; noise of n stations is so within 4 / sqrt(n)."""
    assert sri(run(wave(0.3)), run(lambda x: wave(0.3)(2.0 * x))) == pytest.approx(0.0, abs=EXACT)
    noise = np.random.default_rng(2).standard_normal((2, 10_000))
    first, second = (
        run(lambda x, row=row: 50e3 + 5e3 * row, length=row.size * STEP)  # type: ignore[misc]
        for row in noise
    )
    assert abs(sri(first, second, stations=first.position[:, 0])) < 4.0 / np.sqrt(10_000)


def test_repeatability_is_of_the_aggregate_force_along_the_road() -> None:
    """Two axles each, their phases added; each axle counted where it stands, not when."""
    first = run(wave(0.3), wave(0.3, 1.0), spacing=3.0)
    second = run(wave(0.1, 0.4), wave(0.1, 1.6), spacing=5.0)
    assert sri(first, second) == pytest.approx(np.cos(0.5 - 1.0), abs=1e-12)


def test_repeatability_takes_a_power() -> None:
    first, second = run(wave(0.5)), run(wave(0.5, 1.0))
    expected = np.corrcoef(wave(0.5)(WAVES) ** 4, wave(0.5, 1.0)(WAVES) ** 4)[0, 1]
    assert sri(first, second, power=4.0) == pytest.approx(expected, abs=1e-12)


def test_repeatability_of_runs_that_overlap() -> None:
    """Without stations, over what both runs pass: here 20 to 79.75 m."""
    first, second = run(wave(0.3)), run(wave(0.3, 0.7))
    second = replace(second, position=second.position + 20.0)
    # Its places moved, the second wave has moved on by 20 m, two and a half waves.
    common = np.arange(20.0, 79.8, 0.25)
    expected = np.corrcoef(wave(0.3)(common), wave(0.3, 0.7 + np.pi)(common))[0, 1]
    found = float(metrics.spatial_repeatability(first, second))
    assert found == pytest.approx(expected, abs=1e-12)


def test_repeatability_matrix_of_a_fleet() -> None:
    phases = [0.0, 0.4, 1.3, 2.9]
    vehicles = fleet(*(run(wave(0.2, phase)) for phase in phases))
    found = metrics.spatial_repeatability(vehicles, stations=WAVES)
    assert found.dims == ("vehicle", "other")
    expected = np.cos(np.subtract.outer(phases, phases))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    assert found["other"].to_numpy().tolist() == ["V0", "V1", "V2", "V3"]
    np.testing.assert_array_equal(found, found.T)


def test_repeatability_of_a_fleet_against_one_run_and_against_itself() -> None:
    phases = np.array([0.0, 0.4, 1.3])
    vehicles = fleet(*(run(wave(0.2, phase)) for phase in phases))
    found = metrics.spatial_repeatability(vehicles, run(wave(0.5, 0.1)), stations=WAVES)
    assert found.dims == ("vehicle",)
    np.testing.assert_allclose(found, np.cos(phases - 0.1), rtol=0, atol=1e-12)
    later = fleet(*(run(wave(0.2, 2.0 * phase)) for phase in phases))
    found = metrics.spatial_repeatability(vehicles, later, stations=WAVES)
    assert found.dims == ("vehicle",)
    np.testing.assert_allclose(found, np.cos(phases), rtol=0, atol=1e-12)


def test_repeatability_of_a_fleet_without_histories() -> None:
    """Its stations are taken for both."""
    vehicles = one_of_each()
    kept = statistics(vehicles, WAVES)
    expected = metrics.spatial_repeatability(vehicles, stations=WAVES)
    xr.testing.assert_allclose(metrics.spatial_repeatability(kept), expected, rtol=1e-12)
    one = run(wave(0.2, 1.0))
    expected = metrics.spatial_repeatability(vehicles, one, stations=WAVES)
    xr.testing.assert_allclose(metrics.spatial_repeatability(kept, one), expected, rtol=1e-12)
    swapped = metrics.spatial_repeatability(one, kept)
    xr.testing.assert_allclose(swapped, expected, rtol=1e-12)


# --- ESAL ---------------------------------------------------------------------------------------


def test_esal_by_hand(truck: pf.Vehicle, nominal: pf.Result) -> None:
    """Half of, one and two standard axles: 1/16, 1 and 16."""
    found = metrics.esal([40e3, 80e3, 160e3])
    assert found["per_axle"].to_numpy().tolist() == [0.0625, 1.0, 16.0]
    assert float(found["total"]) == 17.0625
    assert found["total"].attrs["units"] == "1"
    # Table II of the paper: 38 925, 76 335 and 80 938 N.
    expected = (38_925.0 / 80e3) ** 4 + (76_335.0 / 80e3) ** 4 + (80_938.0 / 80e3) ** 4
    for loads in (truck, truck.static_loads, nominal, nominal.forces):
        assert loads is not None
        assert float(metrics.esal(loads)["total"]) == pytest.approx(expected, rel=1e-9)


def test_esal_of_another_standard_axle_and_exponent() -> None:
    """France: 130 kN; a cemented base: exponent 12. A load of half the standard: 2^-n."""
    found = metrics.esal([65e3, 130e3], standard_axle=130e3, exponent=12.0)
    assert found["per_axle"].to_numpy().tolist() == [2.0**-12, 1.0]
    assert found.attrs == {"standard_axle": 130e3, "exponent": 12.0}


def test_esal_of_a_run_that_kept_no_forces(road: pf.Road, truck: pf.Vehicle) -> None:
    bare = pf.simulate(road, truck, keep="envelope")
    xr.testing.assert_identical(metrics.esal(bare), metrics.esal(truck))


def test_esal_of_a_fleet() -> None:
    found = metrics.esal(one_of_each())
    expected = [0.625**4 + 0.75**4 + 0.875**4, 0.5**4 + 1.0]
    np.testing.assert_allclose(found["total"], expected, rtol=EXACT)
    assert found["per_axle"].dims == ("vehicle", "axle")
    assert found["per_axle"].isnull().sum() == 1
    rows = metrics.esal([[50e3, 60e3], [40e3, 80e3]])
    assert rows["total"].dims == ("vehicle",)
    np.testing.assert_allclose(rows["total"], [0.625**4 + 0.75**4, 0.5**4 + 1.0], rtol=EXACT)


# --- load sharing -------------------------------------------------------------------------------


def test_groups_of_axles(truck: pf.Vehicle) -> None:
    """A semitrailer: steer axle, drive axle, tridem; and the same places along the road."""
    places = [0.0, 3.7, 9.4, 10.7, 12.0]
    for positions in (places, -np.array(places), 100.0 - np.array(places)):
        assert metrics.axle_groups(positions).to_numpy().tolist() == [1, 2, 3, 3, 3]
    assert metrics.axle_groups(places, within=1.3).to_numpy().tolist() == [1, 2, 3, 3, 4]
    assert metrics.axle_groups(places, within=4.0).to_numpy().tolist() == [1, 1, 2, 2, 2]
    assert metrics.axle_groups([0.0, 2.0, 3.9]).to_numpy().tolist() == [1, 2, 2]
    assert metrics.axle_groups(truck.axle_positions).dims == ("axle",)


def test_groups_of_a_fleet() -> None:
    places = xr.DataArray([[0.0, 4.0, 5.3], [0.0, 1.2, NAN]], dims=("vehicle", "axle"))
    assert metrics.axle_groups(places).to_numpy().tolist() == [[1, 2, 2], [1, 1, 0]]


def test_load_sharing_by_hand() -> None:
    """A tandem with 40 and 60 kN in the mean: 0.8 and 1.2; the steer axle has nothing to share."""
    forces = run(wave(0.3, static=30e3), wave(0.3, static=40e3), wave(0.1, static=60e3))
    forces = replace(forces, position=forces.position[:, :1] - np.array([0.0, 4.0, 5.3]))
    np.testing.assert_allclose(metrics.load_sharing(forces), [1.0, 0.8, 1.2], rtol=EXACT)
    # All three in one group: means of 30, 40 and 60 kN over 130 kN / 3.
    found = metrics.load_sharing(forces, [7, 7, 7])
    np.testing.assert_allclose(found, np.array([90.0, 120.0, 180.0]) / 130.0, rtol=EXACT)
    assert found.sum() == pytest.approx(3.0)
    np.testing.assert_allclose(metrics.load_sharing(forces, [1, 2, 3]), 1.0, rtol=EXACT)


def test_load_sharing_of_the_walking_beam_is_that_of_its_arms(truck: pf.Vehicle) -> None:
    forces = pf.tire_forces(truck, None, distance=10.0)
    mean = (76_335.0 + 80_938.0) / 2.0
    expected = [1.0, 76_335.0 / mean, 80_938.0 / mean]
    np.testing.assert_allclose(metrics.load_sharing(forces), expected, rtol=1e-9)


def test_load_sharing_of_a_fleet() -> None:
    """By histories, groups found from places; and by mean forces, groups given."""
    vehicles = one_of_each()  # axles 4 m apart, and 1.5 m apart
    means = vehicles["tire_force"].mean("time").to_numpy()
    found = metrics.load_sharing(vehicles)
    np.testing.assert_allclose(found[0], 1.0, rtol=EXACT)
    np.testing.assert_allclose(found[1, :2], means[1, :2] / means[1, :2].mean(), rtol=EXACT)
    assert found.isnull().sum() == 1
    kept = statistics(vehicles, WAVES)
    np.testing.assert_allclose(metrics.load_sharing(kept, [[1, 2, 3], [1, 1, 1]]), found)
    labelled = xr.DataArray([[1, 2, 3], [1, 1, 0]], kept["static_load"].coords)
    np.testing.assert_allclose(metrics.load_sharing(kept, labelled), found)


def test_dynamic_load_sharing_of_sinusoids() -> None:
    """Axles that go up and down in turn: 1 + a sin and 1 - a sin, with a spread of a / sqrt 2."""
    a, travel = 0.3, np.arange(0.0, 80.0, STEP)
    forces = run(wave(a), wave(a, np.pi + 2.0 * np.pi * 1.5 / WAVE), spacing=1.5)
    found = metrics.dynamic_load_sharing(forces)
    assert found.dims == ("time", "axle")
    expected = 1.0 + a * np.sin(2.0 * np.pi * travel / WAVE)
    np.testing.assert_allclose(found[:, 0], expected, rtol=1e-12)
    np.testing.assert_allclose(found.sum("axle"), 2.0, rtol=1e-12)
    np.testing.assert_allclose(found.std("time"), a / np.sqrt(2.0), rtol=1e-12)


def test_dynamic_load_sharing_of_single_axles_and_of_tires_off_the_road() -> None:
    """A lifted axle carries nothing, its neighbour all; a single axle is 1, even in the air."""
    time, place = np.array([0.0, 1.0]), np.array([[9.0, 4.0, 3.0], [10.0, 5.0, 4.0]])
    force = np.array([[-1e3, -2e3, 50e3], [0.0, 40e3, 40e3]])
    forces = pf.TireForces(time, place, force, np.full(3, 40e3))
    found = metrics.dynamic_load_sharing(forces).to_numpy()
    assert found.tolist() == [[1.0, 0.0, 2.0], [1.0, 1.0, 1.0]]


# --- what holds for every input -----------------------------------------------------------------

amplitudes = st.floats(0.01, 0.9)
phases = st.floats(0.0, 6.3)
axles = st.lists(st.tuples(amplitudes, phases, st.floats(1e4, 1e5)), min_size=1, max_size=4)


def made_of(waves: list[tuple[float, float, float]], scale: float = 1.0) -> pf.TireForces:
    forces = run(
        *(wave(a, phase, static) for a, phase, static in waves),
        static=[static for *_, static in waves],
        spacing=1.5,
    )
    return replace(forces, force=scale * forces.force, static_loads=scale * forces.static_loads)


def varies(forces: pf.TireForces) -> bool:
    total = metrics.station_forces(forces, WAVES).sum("axle")
    return float(total.std()) > 1e-3 * float(total.mean())


@given(axles, axles, st.floats(1e-3, 1e3))
@settings(max_examples=10)
def test_scale_leaves_coefficients_alone(
    waves: list[tuple[float, float, float]],
    others: list[tuple[float, float, float]],
    scale: float,
) -> None:
    small, large, other = made_of(waves), made_of(waves, scale), made_of(others)
    for measure in (metrics.dlc, metrics.load_sharing):
        np.testing.assert_allclose(measure(large), measure(small), rtol=1e-10)
    ratios = [metrics.aggregate_force(one, WAVES)["ratio"] for one in (small, large)]
    np.testing.assert_allclose(ratios[1], ratios[0], rtol=1e-10)
    if varies(small) and varies(other):
        assert sri(large, other) == pytest.approx(sri(small, other), abs=1e-9)


@given(st.lists(axles, min_size=2, max_size=4), st.randoms(use_true_random=False))
@settings(max_examples=10)
def test_order_of_vehicles_does_not_matter(
    vehicles: list[list[tuple[float, float, float]]], random: Any
) -> None:
    order = list(range(len(vehicles)))
    random.shuffle(order)
    given_order = fleet(*(made_of(waves) for waves in vehicles))
    shuffled = given_order.isel(vehicle=order)
    for measure in (metrics.dlc, metrics.load_sharing, metrics.dynamic_load_sharing):
        xr.testing.assert_allclose(
            measure(shuffled), measure(given_order).isel(vehicle=order), rtol=1e-12
        )
    sums = [metrics.aggregate_force(one, WAVES, fleet=True) for one in (shuffled, given_order)]
    xr.testing.assert_allclose(sums[0], sums[1], rtol=1e-12)
    if all(varies(made_of(waves)) for waves in vehicles):
        before = metrics.spatial_repeatability(given_order, stations=WAVES)
        after = metrics.spatial_repeatability(shuffled, stations=WAVES)
        np.testing.assert_allclose(after, before.isel(vehicle=order, other=order), atol=1e-10)


@given(axles)
def test_shares_of_a_group_add_up(waves: list[tuple[float, float, float]]) -> None:
    found = metrics.load_sharing(made_of(waves))  # 1.5 m apart, so one group
    assert float(found.sum()) == pytest.approx(len(waves), rel=1e-12)


@given(st.lists(axles, min_size=1, max_size=3))
@settings(max_examples=10)
def test_statistics_give_what_histories_give(
    vehicles: list[list[tuple[float, float, float]]],
) -> None:
    histories = fleet(*(made_of(waves) for waves in vehicles))
    kept = statistics(histories, WAVES)
    xr.testing.assert_allclose(metrics.dlc(kept), metrics.dlc(histories), rtol=1e-12)
    xr.testing.assert_identical(
        metrics.aggregate_force(kept), metrics.aggregate_force(histories, WAVES)
    )
    groups = metrics.axle_groups(histories["axle_position"].isel(time=0, drop=True))
    xr.testing.assert_allclose(
        metrics.load_sharing(kept, groups), metrics.load_sharing(histories), rtol=1e-12
    )


def test_a_fleet_of_runs_of_different_length_gives_what_each_run_gives(truck: pf.Vehicle) -> None:
    """Slower runs take more instants: the faster one's history ends earlier."""
    profile = pf.Profile.iso8608("C", length=120.0, seed=4)
    runs = [pf.tire_forces(truck, profile, speed, run_in=40.0) for speed in (50.0, 80.0)]
    together = fleet(*runs)
    assert together["tire_force"].isnull().any()
    stations = np.arange(40.0, 110.0, 0.25)
    for number, one in enumerate(runs):
        alone = metrics.aggregate_force(one, stations)
        found = metrics.aggregate_force(together, stations).isel(vehicle=number, drop=True)
        xr.testing.assert_allclose(found, alone, rtol=1e-12)
        for measure in (metrics.dlc, metrics.load_sharing):
            np.testing.assert_allclose(measure(together)[number], measure(one), rtol=1e-12)
    pair = float(metrics.spatial_repeatability(*runs, stations=stations))
    matrix = metrics.spatial_repeatability(together, stations=stations)
    assert float(matrix[0, 1]) == pytest.approx(pair, abs=1e-12)


# --- what a user can get wrong ------------------------------------------------------------------


def dataset(**changes: Any) -> xr.Dataset:
    return run(wave(0.2), wave(0.3, 1.0)).dataset.assign(**changes)


def with_value(name: str, index: tuple[int, ...], value: float) -> xr.Dataset:
    """Change one number of a fleet of two."""
    vehicles = fleet(run(wave(0.2), wave(0.3)), run(wave(0.1), wave(0.2))).copy(deep=True)
    vehicles[name].to_numpy()[index] = value
    return vehicles


def kept(**changes: Any) -> xr.Dataset:
    return statistics(one_of_each(), WAVES).assign(**changes)


def in_units(name: str, units: str) -> xr.Dataset:
    changed = dataset()
    changed[name].attrs["units"] = units
    return changed


Call = Callable[[], object]
TABLE: list[tuple[str, Call, str]] = [
    # forces
    ("forces of the wrong type", lambda: metrics.dlc([1.0, 2.0]),  # type: ignore[arg-type]
     "forces is a list: must be TireForces, a Result or an xarray.Dataset"),
    ("result without forces", lambda: metrics.dlc(
        pf.simulate(pf.Road(length=5.0), pf.vehicles.tandem_truck(), keep="envelope")),
     'tire forces were not kept: run with keep=["tire_force", ...]'),
    ("one instant", lambda: metrics.dlc(dataset().isel(time=[0])),
     "the number of instants of tire_force is 1: must be at least 2"),
    ("no instant", lambda: metrics.dlc(dataset().isel(time=[])), "tire_force is empty"),
    ("no axle", lambda: metrics.dlc(dataset().isel(axle=[])), "static_load is empty"),
    ("no static load", lambda: metrics.dlc(dataset().drop_vars("static_load")),
     "the dataset has no static_load, only ['tire_force', 'axle_position']"),
    ("no force", lambda: metrics.dlc(dataset().drop_vars("tire_force")),
     "the dataset has neither tire_force nor std_force"),
    ("no mean force", lambda: metrics.load_sharing(dataset().drop_vars("tire_force")),
     "the dataset has neither tire_force nor mean_force"),
    ("no force at stations", lambda: metrics.station_forces(
        dataset().drop_vars("tire_force"), WAVES), "the dataset has no tire_force"),
    ("no places", lambda: metrics.station_forces(dataset().drop_vars("axle_position"), WAVES),
     "the dataset has neither station_force nor axle_position"),
    ("no history", lambda: metrics.dynamic_load_sharing(kept(), [1, 2, 2]),
     "the dataset has no tire_force"),
    ("forces over stations", lambda: metrics.dlc(dataset().rename(time="station")),
     "tire_force has the dimensions ('station', 'axle'): must have ('time', 'axle')"),
    ("forces in kN", lambda: metrics.dlc(in_units("tire_force", "kN")),
     "tire_force is in 'kN': must be in 'N'"),
    ("static loads in t", lambda: metrics.dlc(in_units("static_load", "t")),
     "static_load is in 't': must be in 'N'"),
    ("places in km", lambda: metrics.station_forces(in_units("axle_position", "km"), WAVES),
     "axle_position is in 'km': must be in 'm'"),
    ("forces as text", lambda: metrics.dlc(
        dataset(tire_force=dataset()["tire_force"].astype(str))), "must hold real numbers"),
    ("NaN in a run", lambda: metrics.dlc(with_value("tire_force", (0, 17, 1), NAN)),
     "tire_force is nan at instant 17 of axle 2: must be finite"),
    ("NaN at the end of one axle", lambda: metrics.dlc(with_value("tire_force", (0, -1, 1), NAN)),
     "tire_force is nan at instant 639 of axle 2"),
    ("NaN at the end of a single run", lambda: metrics.dlc(
        with_value("tire_force", (0, -1), NAN).isel(vehicle=0)),
     "tire_force is nan at instant 639"),
    ("infinite force", lambda: metrics.dlc(with_value("tire_force", (1, 3, 0), INF)),
     "tire_force is inf at instant 3 of axle 1"),
    ("NaN place", lambda: metrics.station_forces(
        with_value("axle_position", (0, 5, 0), NAN), WAVES),
     "axle_position is nan at instant 5 of axle 1"),
    ("places that end early", lambda: metrics.station_forces(
        with_value("axle_position", (0, -1), NAN), WAVES), "end at different instants"),
    ("forces without a static load", lambda: metrics.dlc(with_value("static_load", (0, 1), NAN)),
     "tire_force is given for an axle whose static_load is NaN"),
    ("vehicle without axles", lambda: metrics.dlc(kept(static_load=kept()["static_load"] * NAN)),
     "static_load is NaN for every axle of a vehicle"),
    ("negative static load", lambda: metrics.dlc(with_value("static_load", (1, 0), -5.0)),
     "static_load = -5 N: must be finite and above 0"),
    ("no static weight", lambda: metrics.dlc(with_value("static_load", (1, 0), 0.0)),
     "static_load = 0 N"),
    ("negative spread", lambda: metrics.dlc(kept(std_force=-kept()["std_force"])),
     "N: must be finite and not below 0"),
    ("NaN spread", lambda: metrics.dlc(kept(std_force=kept()["std_force"] * NAN)),
     "std_force = nan N: must be finite and not below 0"),
    ("backing up", lambda: metrics.station_forces(
        with_value("axle_position", (0, 8, 0), 0.5), WAVES),
     "axle_position must increase with time: 0.875 m is followed by 0.5 m"),
    # stations
    ("no stations", lambda: metrics.station_forces(dataset(), []),
     "stations is empty: must hold at least one place, m"),
    ("stations out of order", lambda: metrics.station_forces(dataset(), [1.0, 3.0, 2.0]),
     "stations must increase: 3 m is followed by 2 m"),
    ("a station twice", lambda: metrics.aggregate_force(dataset(), [1.0, 1.0]),
     "stations must increase: 1 m is followed by 1 m"),
    ("station NaN", lambda: metrics.aggregate_force(dataset(), [1.0, NAN]), "stations[1] is nan"),
    ("stations in a table", lambda: metrics.station_forces(dataset(), [[1.0]]),
     "stations must be one-dimensional, got shape (1, 1)"),
    ("one station as a number", lambda: metrics.station_forces(dataset(), 3.0),
     "stations must be one-dimensional, got shape ()"),
    ("stations as text", lambda: metrics.station_forces(dataset(), ["here"]),
     "stations must hold real numbers"),
    ("stations off the run", lambda: metrics.aggregate_force(dataset(), [100.0, 110.0]),
     "no station is passed by every axle: not one of the 2 from 100 to 110 m"),
    ("run shorter than the vehicle", lambda: metrics.aggregate_force(
        run(wave(0.1), wave(0.1), length=3.0)),
     "no station every 0.25 m is passed by every axle: the last of them starts at 0 m, and the "
     "first ends at -1.125 m"),
    ("run around the world", lambda: metrics.aggregate_force(
        dataset(axle_position=dataset()["axle_position"] * 1e9)), "give stations"),
    ("stations that a fleet has not", lambda: metrics.station_forces(kept(), [20.0, 20.0005]),
     "no forces are known at station 20.0005 m, the nearest is at 20 m"),
    ("station forces without places", lambda: metrics.station_forces(kept().drop_vars("station")),
     "station_force has no station coordinate"),
    ("infinite station force", lambda: metrics.station_forces(
        kept(station_force=kept()["station_force"] * INF)), "station_force is infinite"),
    # powers
    ("negative power", lambda: metrics.aggregate_force(dataset(), power=-4.0),
     "power = -4: must be finite and above 0"),
    ("power zero", lambda: metrics.aggregate_force(dataset(), power=0.0), "power = 0"),
    ("power NaN", lambda: metrics.aggregate_force(dataset(), power=NAN), "power = nan"),
    ("power as text", lambda: metrics.aggregate_force(dataset(), power="4"),  # type: ignore[arg-type]
     "power = '4': must be a number"),
    ("power that overflows", lambda: metrics.aggregate_force(dataset(), power=100.0),
     "power = 100: 64997.5"),
    ("fleet of one run", lambda: metrics.aggregate_force(dataset(), fleet=True),
     "fleet=True sums over vehicles, and the forces have no such dimension"),
    # DLC
    ("negative DLC", lambda: metrics.road_stress_factor(-0.1),
     "dlc = -0.1: must be finite and not below 0"),
    ("NaN DLC", lambda: metrics.road_stress_factor(NAN), "dlc = nan"),
    ("infinite DLC", lambda: metrics.road_stress_factor(np.array([0.1, INF])), "dlc = inf"),
    # repeatability
    ("one run", lambda: metrics.spatial_repeatability(dataset()), "a is one run"),
    ("smooth road", lambda: metrics.spatial_repeatability(dataset(), run(wave(0.0))),
     "the aggregate force of b does not vary along the road, as on a smooth profile"),
    ("smooth profile", lambda: metrics.spatial_repeatability(*2 * [pf.tire_forces(
        pf.vehicles.tandem_truck(), pf.Profile.smooth(40.0))]),
     "the aggregate force of a does not vary"),
    ("one vehicle on a smooth road", lambda: metrics.spatial_repeatability(
        fleet(run(wave(0.1)), run(wave(0.0)))), "a vehicle of a does not vary"),
    ("two stations", lambda: metrics.spatial_repeatability(
        dataset(), dataset(), stations=[20.0, 21.0]),
     "2 stations are passed by all axles: must be at least 3"),
    ("two fleets", lambda: metrics.spatial_repeatability(
        fleet(run(wave(0.1)), run(wave(0.2))), fleet(run(wave(0.1)), run(wave(0.2)),
                                                     run(wave(0.3)))),
     "a and b have different vehicles"),
    ("runs on different roads", lambda: metrics.spatial_repeatability(
        dataset(), dataset(axle_position=dataset()["axle_position"] + 500.0)),
     "no station every 0.25 m is passed by every axle"),
    # ESAL
    ("negative load", lambda: metrics.esal([50e3, -1.0]), "loads = -1 N: must be finite"),
    ("NaN load", lambda: metrics.esal([50e3, NAN]), "loads holds nan: every value must be finite"),
    ("no load", lambda: metrics.esal([]), "loads is empty"),
    ("one load as a number", lambda: metrics.esal(50e3), "loads has shape ()"),
    ("loads as text", lambda: metrics.esal(["heavy"]), "loads must hold real numbers"),
    ("loads of unequal length", lambda: metrics.esal([[1e4], [1e4, 2e4]]),
     "loads must be an array of numbers"),
    ("loads in kN", lambda: metrics.esal([60.0, 95.0]),
     "the heaviest axle of 95 N is 0.00119 times the standard axle of 80000 N"),
    ("standard axle in kN", lambda: metrics.esal([60e3, 95e3], standard_axle=80.0),
     "times the standard axle of 80 N: must be 0.01 to 100 times; both are in N"),
    ("labelled in kN", lambda: metrics.esal(
        xr.DataArray([60.0], dims="axle", attrs={"units": "kN"})),
     "loads is in 'kN': must be in 'N'"),
    ("loads of no axle", lambda: metrics.esal(xr.DataArray([6e4], dims="x")),
     "loads has the dimensions ('x',): must have ('axle',)"),
    ("no standard axle", lambda: metrics.esal([50e3], standard_axle=0.0), "standard_axle = 0 N"),
    ("negative exponent", lambda: metrics.esal([50e3], exponent=-4.0),
     "exponent = -4: must be finite and above 0"),
    # groups
    ("axles out of order", lambda: metrics.axle_groups([0.0, 4.0, 3.0]),
     "positions must go from the front axle to the rear one, no two alike"),
    ("two axles in one place", lambda: metrics.axle_groups([0.0, 4.0, 4.0]), "no two alike"),
    ("NaN ahead of an axle", lambda: metrics.axle_groups(
        xr.DataArray([0.0, NAN, 4.0], dims="axle")), "NaN only behind a vehicle's last axle"),
    ("infinite place of an axle", lambda: metrics.axle_groups([0.0, INF]),
     "positions holds inf: every value must be finite"),
    ("groups within nothing", lambda: metrics.axle_groups([0.0, 1.0], within=0.0),
     "within = 0 m: must be finite and above 0"),
    ("groups of a fleet that has no places", lambda: metrics.load_sharing(kept()),
     "the dataset has neither axle_offset nor axle_position: give groups, as from axle_groups"),
    ("too few groups", lambda: metrics.load_sharing(dataset(), [1]),
     "groups are of {'axle': 1}, static_load of {'axle': 2}"),
    ("groups of other vehicles", lambda: metrics.load_sharing(kept(), xr.DataArray(
        [[1, 2, 2]] * 2, {"vehicle": ["A", "B"]}, ("vehicle", "axle"))),
     "must have the same axles and vehicles"),
    ("half a group", lambda: metrics.load_sharing(dataset(), [1.0, 1.5]),
     "groups must be whole numbers, one for each axle"),
    ("group in the air", lambda: metrics.load_sharing(
        dataset(tire_force=-dataset()["tire_force"]), [1, 1]), "press on the road with no force"),
    ("tandem in the air for a moment", lambda: metrics.dynamic_load_sharing(
        run(wave(2.0), wave(2.0), spacing=WAVE), [1, 1]), "press on the road with no force at all"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("call", "fragment"), [row[1:] for row in TABLE], ids=[row[0] for row in TABLE]
)
def test_bad_input(call: Call, fragment: str) -> None:
    with pytest.raises(ValueError, match=re.escape(fragment)):
        call()


# --- plots --------------------------------------------------------------------------------------


def saved(figure: Figure, path: Path) -> bytes:
    figure.savefig(path, dpi=50)
    return path.read_bytes()


def test_bars_are_the_coefficients(tmp_path: Path) -> None:
    coefficients = metrics.dlc(one_of_each())
    figure = plotting.plot_dlc(coefficients)
    (axes,) = figure.axes
    heights = [[bar.get_height() for bar in bars] for bars in axes.containers]
    np.testing.assert_array_equal(heights, coefficients)
    places = [bar.get_x() + bar.get_width() / 2 for bar in axes.containers[0]]
    np.testing.assert_allclose(np.diff(places), 1.0)
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["V0", "V1"]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["1", "2", "3"]
    assert saved(figure, tmp_path / "dlc.png").startswith(b"\x89PNG")


def test_bars_of_one_vehicle_need_no_legend() -> None:
    (axes,) = plotting.plot_dlc(metrics.dlc(run(wave(0.2), wave(0.1)))).axes
    assert len(axes.patches) == 2
    assert axes.get_legend() is None


def test_boxes_of_a_large_fleet(tmp_path: Path) -> None:
    vehicles = fleet(*(run(wave(0.01 * (i + 1)), wave(0.2)) for i in range(9)))
    figure = plotting.plot_dlc(metrics.dlc(vehicles))
    (axes,) = figure.axes
    assert axes.get_title() == "Dynamic load coefficient of 9 vehicles"
    lines = [np.asarray(line.get_ydata()) for line in axes.lines]
    level = [y[0] for y in lines if y.size == 2 and y[0] == y[1]]
    assert any(y == pytest.approx(0.05 / np.sqrt(2.0)) for y in level)  # the median of axle 1
    assert saved(figure, tmp_path / "boxes.png").startswith(b"\x89PNG")


def test_aggregate_force_with_its_percentile(tmp_path: Path) -> None:
    found = metrics.aggregate_force(run(wave(0.3), wave(0.3)), WAVES)
    figure = plotting.plot_aggregate_force(found)
    (axes,) = figure.axes
    along, percentile, static = axes.lines
    np.testing.assert_array_equal(np.asarray(along.get_xdata()), WAVES)
    np.testing.assert_array_equal(np.asarray(along.get_ydata()), found["ratio"])
    level = float(found["percentile_95"] / found["static"])
    assert np.asarray(percentile.get_ydata()) == pytest.approx(level)
    assert percentile.get_label() == f"95th percentile {level:.2f}"
    assert np.asarray(static.get_ydata()) == pytest.approx(1.0)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("station [m]", "dynamic sum / static sum")
    assert saved(figure, tmp_path / "aggregate.png").startswith(b"\x89PNG")
    several = plotting.plot_aggregate_force(metrics.aggregate_force(one_of_each(), WAVES))
    assert [line.get_label() for line in several.axes[0].lines[::2]] == ["V0", "V1", "static loads"]


def test_matrix_of_repeatability(tmp_path: Path) -> None:
    matrix = metrics.spatial_repeatability(one_of_each(), stations=WAVES)
    figure = plotting.plot_spatial_repeatability(matrix)
    axes = figure.axes[0]
    np.testing.assert_allclose(np.asarray(axes.images[0].get_array()), matrix)
    assert [text.get_text() for text in axes.texts] == [f"{v:.2f}" for v in np.ravel(matrix)]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["V0", "V1"]
    assert saved(figure, tmp_path / "sri.png").startswith(b"\x89PNG")
    many = fleet(*(run(wave(0.1, 0.2 * i)) for i in range(15)))
    axes = plotting.plot_spatial_repeatability(
        metrics.spatial_repeatability(many, stations=WAVES)
    ).axes[0]
    assert not axes.texts
    assert [label.get_text() for label in axes.get_xticklabels()] == [
        f"V{i}" for i in range(0, 15, 2)
    ]


def test_plots_leave_the_current_figure_alone() -> None:
    before = plt.get_fignums()
    vehicles = one_of_each()
    plotting.plot_dlc(metrics.dlc(vehicles))
    plotting.plot_aggregate_force(metrics.aggregate_force(vehicles))
    plotting.plot_spatial_repeatability(metrics.spatial_repeatability(vehicles))
    assert plt.get_fignums() == before


def test_plots_need_what_they_draw() -> None:
    vehicles = fleet(*(run(wave(0.1, 0.2 * i)) for i in range(7)))
    with pytest.raises(ValueError, match="dlc must be labelled by axle, or by vehicle and axle"):
        plotting.plot_dlc(vehicles["tire_force"])
    with pytest.raises(ValueError, match=r"as metrics\.aggregate_force gives it"):
        plotting.plot_aggregate_force(vehicles)
    with pytest.raises(ValueError, match=r"7 vehicles are too many for one picture.* is 6"):
        plotting.plot_aggregate_force(metrics.aggregate_force(vehicles))
    with pytest.raises(ValueError, match="sri must be labelled by vehicle and other"):
        plotting.plot_spatial_repeatability(metrics.dlc(vehicles))
