"""Constants of a pavement come back from what it would answer, with errors that hold."""

from __future__ import annotations

import io
import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray
from oracle import DenseRoad
from scipy.optimize import curve_fit
from scipy.stats import binom

import pavefem as pf
from pavefem.studies.measurements import static_deflection

Array = NDArray[np.float64]

FORCE = np.linspace(10e3, 60e3, 12)
NOISE = 3e-6
TRUTH = {"asphalt_bar_stiffness": 70e6, "bar_rigidity": 80e6}
WIDE = {"asphalt_bar_stiffness": (1e7, 1e9), "bar_rigidity": (1e7, 1e9)}


def road_of(**fields: Any) -> pf.Road:
    return pf.Road(pf.Pavement.paper(**fields), length=25.0)


TRUE_ROAD = road_of(**TRUTH)


@cache
def compliance(road: pf.Road, temperature_c: float, offsets: tuple[float, ...] = (0.0,)) -> Array:
    """Deflection per newton at mid-length, beside a load there, by the independent model."""
    dense = DenseRoad.of(road, pf.Scheme.paper(), temperature_c, 15.0)
    free = dense.free
    answer = np.zeros(2 * dense.nodes.size)
    load = -dense.forces(np.array([12.5]), np.array([2.0]), "linear")
    answer[free] = np.linalg.solve(dense.stiffness[np.ix_(free, free)], load[free])
    return np.interp(12.5 + np.asarray(offsets), dense.nodes, answer[::2])


def pairs(
    rng: np.random.Generator, temperature_c: float, noise: float | None = None
) -> pf.ForceDeflection:
    exact = FORCE * compliance(TRUE_ROAD, temperature_c)
    return pf.ForceDeflection(
        FORCE,
        exact + rng.normal(scale=NOISE, size=FORCE.size),
        speed_kmh=15.0,
        temperature_c=temperature_c,
        noise=noise,
    )


def days(seed: int, noise: float | None = None) -> list[pf.ForceDeflection]:
    rng = np.random.default_rng(seed)
    return [pairs(rng, temperature, noise) for temperature in (10.0, 25.0)]


# --- the model at rest --------------------------------------------------------------------------


@pytest.mark.parametrize("ends", ["clamped", "pinned", "free"])
@pytest.mark.parametrize("scheme", [pf.Scheme.paper(), pf.Scheme.converged()])
def test_static_deflection_solves_an_independent_assembly(ends: Any, scheme: pf.Scheme) -> None:
    road = pf.Road(pf.Pavement.paper(), length=6.0, ends=ends)
    x = 2.34
    found = static_deflection(
        road, x, [0.5, 2.0, 5.5], temperature_c=25.0, speed_kmh=30.0, scheme=scheme
    )
    dense = DenseRoad.of(road, scheme, 25.0, 30.0)
    free = np.ix_(dense.free, dense.free)
    answer = np.zeros(2 * dense.nodes.size)
    load = -dense.forces(np.array([x]), np.array([2.0]), scheme.weights)
    answer[dense.free] = np.linalg.solve(dense.stiffness[free], load[dense.free])
    nodes = np.abs(dense.nodes[:, None] - np.array([0.5, 2.0, 5.5])).argmin(axis=0)
    np.testing.assert_allclose(found, answer[2 * nodes], rtol=1e-10, atol=1e-20)


def test_static_deflection_is_that_of_a_winkler_beam() -> None:
    road = pf.Road.paper()
    beam = pf.analytical.WinklerBeam.of(road.sections[0].pavement.constants(25.0, 30.0))
    offsets = np.array([0.0, 0.05, 0.3, 0.8])
    for element_length, allowed in ((0.125, 3e-3), (0.0625, 3e-4)):
        scheme = pf.Scheme.converged(element_length=element_length)
        found = static_deflection(
            road, 12.5, 12.5 + offsets, temperature_c=25.0, speed_kmh=30.0, scheme=scheme
        )
        expected = beam.static_deflection(1.0, offsets)
        assert np.abs(found - expected).max() < allowed * expected[0]


def test_an_axle_that_creeps_deflects_the_road_as_one_at_rest() -> None:
    road = pf.Road(pf.Pavement.paper(), length=8.0)
    lorry = pf.vehicles.from_axles(weights=[60e3, 90e3], spacings=[5.0])
    scheme = pf.Scheme.paper(dt=0.02)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pf.ValidityWarning)  # so slow a load is outside the range
        passage = pf.simulate(road, lorry, speed_kmh=0.05, scheme=scheme, stations=[4.0])
        rest = static_deflection(
            road, 4.0, [4.0], temperature_c=20.0, speed_kmh=0.05, scheme=scheme
        )
    # The other axle, 5 m off, is not felt; what is left is the lag of the dampers.
    assert -float(passage.dataset["deflection"].min()) == pytest.approx(45e3 * rest[0], rel=1e-3)


# --- known constants come back ------------------------------------------------------------------


def test_exact_pairs_give_the_constants_back() -> None:
    tests = [
        pf.ForceDeflection(
            FORCE,
            FORCE * compliance(road_of(**TRUTH), temperature),
            speed_kmh=15.0,
            temperature_c=temperature,
        )
        for temperature in (10.0, 25.0)
    ]
    fit = pf.calibrate(road_of(), tests, WIDE)
    for name, value in TRUTH.items():
        assert fit.values[name] == pytest.approx(value, rel=1e-7)
    assert fit.road == road_of(**fit.values)
    assert max(np.abs(part).max() for part in fit.residuals) < 1e-12


def test_intervals_of_pairs_hold_the_truth_as_often_as_they_say() -> None:
    seeds = 80
    fits = [pf.calibrate(road_of(), days(seed), WIDE) for seed in range(seeds)]
    # As many misses as one set of seeds in a thousand has, at the most and at the least.
    for level in (0.5, 0.95):
        least, most = (binom.ppf(tail, seeds, level) for tail in (0.0005, 0.9995))
        for name, value in TRUTH.items():
            intervals = np.array([fit.interval(name, level) for fit in fits])
            held = int(((intervals[:, 0] <= value) & (value <= intervals[:, 1])).sum())
            assert least <= held <= most, (name, level, held)
    for name in TRUTH:
        spread = np.std([np.log(fit.values[name]) for fit in fits], ddof=1)
        said = np.mean([fit.standard_errors[name] / fit.values[name] for fit in fits])
        assert said == pytest.approx(spread, rel=0.25)
    found = np.corrcoef([[fit.values[name] for name in TRUTH] for fit in fits], rowvar=False)[0, 1]
    said = np.mean([float(fit.correlation[0, 1]) for fit in fits])
    assert said == pytest.approx(found, abs=0.1)
    variance = np.mean([fit.noise[0][0] ** 2 for fit in fits])
    assert variance == pytest.approx(NOISE**2, rel=4.0 * np.sqrt(2.0 / (22 * seeds)))


@pytest.mark.parametrize("noise", [None, NOISE])
def test_fit_and_covariance_are_those_of_another_fit_of_another_model(noise: float | None) -> None:
    tests = days(1, noise)
    fit = pf.calibrate(road_of(), tests, WIDE)

    def model(force: Array, stiffness: float, rigidity: float) -> Array:
        road = road_of(asphalt_bar_stiffness=stiffness * 1e7, bar_rigidity=rigidity * 1e7)
        return np.concatenate([force * compliance(road, t) for t in (10.0, 25.0)])

    measured = np.concatenate([test.deflection for test in tests])
    sigma = None if noise is None else np.full(measured.size, noise)
    values, covariance = curve_fit(
        model, FORCE, measured, p0=[5.0, 9.0], sigma=sigma, absolute_sigma=noise is not None
    )
    np.testing.assert_allclose(list(fit.values.values()), 1e7 * values, rtol=1e-5)
    np.testing.assert_allclose(fit.covariance, 1e14 * covariance, rtol=1e-3)


HISTORY_TRUTH = {
    "asphalt_bar_stiffness": 70e6,
    "bar_damping": 110e3,
    "moment_of_inertia": 4e-5,
}
HISTORY_BOUNDS = {
    "asphalt_bar_stiffness": (1e7, 1e9),
    "bar_damping": (1e4, 1e6),
    "moment_of_inertia": (1e-5, 1e-3),
}


def short(**fields: Any) -> pf.Road:
    return pf.Road(pf.Pavement.paper(**fields), length=10.0)


@pytest.fixture(scope="module")
def true_history() -> xr.DataArray:
    road = short(**HISTORY_TRUTH)
    profile = pf.Profile.iso8608("B", length=60.0, seed=2)
    result = pf.simulate(
        road,
        pf.vehicles.tandem_truck(),
        profile=profile,
        run_in=30.0,
        speed_kmh=40.0,
        stations=[4.0, 6.5],
        keep=["deflection"],
        every=7,
    )
    return result.dataset["deflection"]


def history_of(deflection: Any, **options: Any) -> pf.DeflectionHistory:
    passage: dict[str, Any] = {
        "vehicle": pf.vehicles.tandem_truck(),
        "profile": pf.Profile.iso8608("B", length=60.0, seed=2),
        "run_in": 30.0,
        "speed_kmh": 40.0,
        "temperature_c": 20.0,
    }
    return pf.DeflectionHistory(deflection, **passage | options)


def test_an_exact_history_gives_the_constants_back(true_history: xr.DataArray) -> None:
    fit = pf.calibrate(short(), history_of(true_history), HISTORY_BOUNDS)
    for name, value in HISTORY_TRUTH.items():
        assert fit.values[name] == pytest.approx(value, rel=1e-6)


def test_intervals_of_noisy_histories_hold_the_truth(true_history: xr.DataArray) -> None:
    held = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        noisy = true_history + rng.normal(scale=5e-6, size=true_history.shape)
        fit = pf.calibrate(short(), history_of(noisy), HISTORY_BOUNDS)
        for name, value in HISTORY_TRUTH.items():
            low, high = fit.interval(name)
            held.append(low <= value <= high)
            assert high - low < 0.2 * value
    assert len(held) == 24
    assert sum(held) >= binom.ppf(0.001, 24, 0.95)


def test_histories_and_pairs_are_fitted_together(true_history: xr.DataArray) -> None:
    rng = np.random.default_rng(3)
    noisy = true_history + rng.normal(scale=5e-6, size=true_history.shape)
    exact = FORCE * compliance(road_of(**HISTORY_TRUTH), 25.0)
    creeping = pf.ForceDeflection(
        FORCE,
        exact + rng.normal(scale=1e-6, size=FORCE.size),
        noise=1e-6,
        speed_kmh=15.0,
        temperature_c=25.0,
    )
    alone = pf.calibrate(short(), history_of(noisy, noise=5e-6), HISTORY_BOUNDS)
    both = pf.calibrate(short(), [history_of(noisy, noise=5e-6), creeping], HISTORY_BOUNDS)
    assert 0.9 < both.misfit < 1.1
    for name, value in HISTORY_TRUTH.items():
        gain = both.standard_errors[name] / alone.standard_errors[name]
        assert gain < (0.85 if name == "asphalt_bar_stiffness" else 1.01)
        low, high = both.interval(name, 0.999)
        assert low < value < high


def test_noisy_deflections_weigh_less() -> None:
    rng = np.random.default_rng(5)
    road = road_of(asphalt_bar_stiffness=70e6)
    exact = FORCE * compliance(road, 20.0)
    wrong = exact + np.where(np.arange(FORCE.size) % 2 == 0, 50e-6, 0.0)
    noise = np.where(np.arange(FORCE.size) % 2 == 0, 50e-6, 1e-6)
    test = pf.ForceDeflection(
        FORCE,
        wrong + rng.normal(scale=0.5e-6, size=FORCE.size),
        noise=noise,
        speed_kmh=15.0,
        temperature_c=20.0,
    )
    bounds = {"asphalt_bar_stiffness": (1e7, 1e9)}
    assert pf.calibrate(road, test, bounds).values["asphalt_bar_stiffness"] == pytest.approx(
        70e6, rel=5e-3
    )


def test_a_basin_tells_beam_and_bed_apart() -> None:
    truth = {"moment_of_inertia": 6e-5, "asphalt_bar_stiffness": 70e6}
    offsets = (0.0, 0.5, 1.0)
    deflection = 50e3 * compliance(road_of(**truth), 20.0, offsets)
    bounds = {"moment_of_inertia": (1e-5, 1e-3), "asphalt_bar_stiffness": (1e7, 1e9)}
    basin = pf.ForceDeflection(
        [50e3] * 3, deflection, offset=offsets, noise=1e-6, speed_kmh=15.0, temperature_c=20.0
    )
    fit = pf.calibrate(road_of(), basin, bounds)
    for name, value in truth.items():
        assert fit.values[name] == pytest.approx(value, rel=1e-6)
        assert np.isfinite(fit.standard_errors[name])


# --- what cannot be told is said ----------------------------------------------------------------


@pytest.mark.parametrize("noise", [None, NOISE])
def test_two_springs_in_series_cannot_be_told_apart_at_one_temperature(noise: float | None) -> None:
    test = pairs(np.random.default_rng(0), 20.0, noise)
    with pytest.warns(pf.CalibrationWarning) as caught:
        fit = pf.calibrate(road_of(), test, WIDE)
    [message] = [str(warning.message) for warning in caught]
    assert message == fit.undetermined[0]
    assert "do not tell asphalt_bar_stiffness and bar_rigidity apart" in message
    assert all(np.isinf(error) for error in fit.standard_errors.values())
    assert fit.interval("bar_rigidity") == (0.0, np.inf)
    np.testing.assert_array_equal(fit.correlation, [[1.0, -1.0], [-1.0, 1.0]])
    np.testing.assert_array_equal(np.sign(fit.covariance), fit.correlation)
    assert "not determined" in fit.summary()["bar_rigidity"]
    # The combination that the message names: k1 k2 / (k1 + k2) stays.
    [rise, fall] = [
        float(part.split("%")[0].split()[-1]) for part in message.split("together, ")[1].split(",")
    ]
    subbase, asphalt = fit.values["bar_rigidity"] / 0.5, fit.pavement.bar_stiffness(1.0)
    assert asphalt < subbase
    modulus = float(fit.pavement.asphalt.modulus(20.0, 15.0))
    bar = fit.pavement.bar_stiffness(modulus)
    asphalt = 1.0 / (1.0 / bar - 1.0 / subbase)
    assert rise / asphalt == pytest.approx(-fall / subbase, rel=0.06)


def test_one_combination_of_three_parameters_leaves_two_undetermined() -> None:
    bounds = WIDE | {"moment_of_inertia": (1e-6, 1e-3)}
    with pytest.warns(pf.CalibrationWarning) as caught:
        fit = pf.calibrate(road_of(), pairs(np.random.default_rng(0), 20.0), bounds)
    assert len(caught) == len(fit.undetermined) == 2
    assert np.isinf(list(fit.standard_errors.values())).all()
    assert not np.isnan(fit.correlation).any()
    assert not np.isnan(fit.covariance).any()


def test_a_parameter_without_effect_is_named_and_the_others_keep_their_errors() -> None:
    test = pairs(np.random.default_rng(0), 20.0, NOISE)
    alone = pf.calibrate(road_of(), test, {"asphalt_bar_stiffness": (1e7, 1e9)})
    with pytest.warns(pf.CalibrationWarning, match=r"do not determine bar_damping between 1000"):
        fit = pf.calibrate(
            road_of(), test, {"asphalt_bar_stiffness": (1e7, 1e9), "bar_damping": (1e3, 1e6)}
        )
    assert np.isinf(fit.standard_errors["bar_damping"])
    assert fit.standard_errors["asphalt_bar_stiffness"] == pytest.approx(
        alone.standard_errors["asphalt_bar_stiffness"], rel=1e-6
    )
    np.testing.assert_array_equal(fit.correlation, np.eye(2))


def test_an_effect_below_the_noise_counts_as_none() -> None:
    """The two springs differ at two temperatures, but not if these are nearly the same."""
    rng = np.random.default_rng(0)
    tests = [pairs(rng, temperature, NOISE) for temperature in (20.0, 20.02)]
    with pytest.warns(pf.CalibrationWarning, match="bar_rigidity"):
        fit = pf.calibrate(road_of(), tests, WIDE)
    assert np.isinf(fit.standard_errors["bar_rigidity"])


def test_composition_and_binder_act_through_one_modulus() -> None:
    test = pairs(np.random.default_rng(0), 20.0, NOISE)
    with pytest.warns(pf.CalibrationWarning, match="do not tell vma and penetration_index apart"):
        pf.calibrate(road_of(), test, {"vma": (14.0, 29.0), "penetration_index": (-1.0, 1.0)})


def test_a_parameter_at_its_bound_is_named() -> None:
    with pytest.warns(pf.CalibrationWarning, match="asphalt_bar_stiffness ended at a bound"):
        fit = pf.calibrate(road_of(), days(0), {"asphalt_bar_stiffness": (1e7, 6e7)})
    assert fit.at_bound == ("asphalt_bar_stiffness",)
    assert fit.values["asphalt_bar_stiffness"] == pytest.approx(6e7)


# --- input --------------------------------------------------------------------------------------


def test_units_of_labels_are_read() -> None:
    deflection = FORCE * compliance(road_of(), 20.0)
    plain = pf.ForceDeflection(FORCE, deflection, speed_kmh=15.0, temperature_c=20.0, noise=2e-6)
    labelled = pf.ForceDeflection(
        xr.DataArray(FORCE / 1e3, attrs={"units": "kN"}),
        xr.DataArray(deflection * 1e3, attrs={"units": "mm"}),
        noise=xr.DataArray(2.0, attrs={"units": "µm"}),
        speed_kmh=15.0,
        temperature_c=20.0,
    )
    np.testing.assert_allclose(labelled.force, plain.force)
    np.testing.assert_allclose(labelled.deflection, plain.deflection)
    assert labelled.noise is not None
    np.testing.assert_allclose(labelled.noise, np.full(FORCE.size, 2e-6))


def test_a_history_is_the_same_with_labels_and_without(true_history: xr.DataArray) -> None:
    labelled = history_of(true_history)
    milli = (true_history * 1e3).assign_attrs(units="mm").transpose("station", "time")
    plain = history_of(
        true_history.to_numpy(), time=true_history["time"].to_numpy(), stations=[4.0, 6.5]
    )
    one = history_of(true_history.sel(station=6.5))
    np.testing.assert_array_equal(labelled.deflection, plain.deflection)
    np.testing.assert_allclose(history_of(milli).deflection, plain.deflection)
    np.testing.assert_array_equal(labelled.time, plain.time)
    np.testing.assert_array_equal(one.deflection, plain.deflection[:, 1:])
    np.testing.assert_array_equal(one.stations, [6.5])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"deflection": [0.3, 0.6, 0.9]}, r"reaches 0.9 m, more than 0.1 m: give metres"),
        ({"force": [20.0, 40.0, 60.0]}, r"largest force is 60 N, less than 1000 N: give newtons"),
        ({"deflection": [-1e-4, -2e-4, -3e-4]}, "positive downwards"),
        ({"deflection": [1e-4, 2e-4]}, r"force has shape \(3,\) and deflection \(2,\)"),
        ({"deflection": [1e-4, np.nan, 3e-4]}, "deflection must be finite"),
        ({"noise": 3.0}, "noise reaches 3 m: give metres"),
        ({"noise": 0.0}, "noise = 0 m: must be above 0"),
        ({"noise": [1e-6, 1e-6]}, "noise has shape"),
        (
            {"force": xr.DataArray([20.0, 40.0, 60.0], attrs={"units": "t"})},
            "force has units 't': must be N, or one of",
        ),
    ],
)
def test_pairs_that_cannot_be_right_are_refused(change: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"force": [20e3, 40e3, 60e3], "deflection": [1e-4, 2e-4, 3e-4]}
    with pytest.raises(ValueError, match=message):
        pf.ForceDeflection(**given | change, speed_kmh=15.0, temperature_c=20.0)


def test_histories_that_cannot_be_right_are_refused(true_history: xr.DataArray) -> None:
    values, time = true_history.to_numpy(), true_history["time"].to_numpy()
    for deflection, labels, message in [
        (values * 1e3, (time, [4.0, 6.5]), "give metres"),
        (-values, (time, [4.0, 6.5]), "up positive"),
        (values, (time, [4.0]), "one column for each of the 1 stations"),
        (values, (time[::-1], [4.0, 6.5]), "time must increase"),
        (values, (), "give time and stations"),
        (true_history, (time, [4.0, 6.5]), "give neither"),
        (true_history.rename(station="place"), (), "must be by time, and by station or x"),
    ]:
        with pytest.raises(ValueError, match=message):
            history_of(deflection, **dict(zip(("time", "stations"), labels, strict=False)))


def test_times_off_the_run_are_refused(true_history: xr.DataArray) -> None:
    values, time = true_history.to_numpy(), true_history["time"].to_numpy()
    late = history_of(values, time=1e3 * time, stations=[4.0, 6.5])
    with pytest.raises(ValueError, match=r"seconds since its front axle was at x = 0"):
        pf.calibrate(short(), late, HISTORY_BOUNDS)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"parameters": {}}, "parameters = {}: must be names"),
        ({"parameters": ["vma"]}, r"parameters = \['vma'\]: must be names"),
        ({"parameters": {"speed_kmh": (1.0, 99.0)}}, "speed_kmh is no number of the pavement"),
        ({"parameters": {"asphalt": (1.0, 99.0)}}, "asphalt is no number of the pavement"),
        ({"parameters": {"stiffness": (1.0, 2.0)}}, "stiffness"),
        ({"parameters": {"vma": (25.0, 20.0)}}, "bounds of vma are 25 and 20"),
        ({"parameters": {"vma": 25.0}}, "bounds of vma = 25.0: must be two numbers"),
        ({"parameters": {"vma": (1.0, 20.0)}}, "vma"),
        ({"parameters": {"vma": (12.0, 20.0)}}, "vma starts at 25: must be within its bounds"),
        ({"start": {"bar_mass": 300.0}}, "start has bar_mass: not among the parameters"),
        ({"measurements": []}, "no measurements"),
        ({"measurements": [1.0]}, "measurements has a float"),
        ({"scheme": "fine"}, "scheme = 'fine'"),
    ],
)
def test_a_fit_that_cannot_be_made_is_refused(arguments: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {
        "road": road_of(),
        "measurements": days(0),
        "parameters": {"asphalt_bar_stiffness": (1e7, 1e9)},
    }
    with pytest.raises(ValueError, match=message):
        pf.calibrate(**given | arguments)


def test_noise_is_known_of_all_or_of_none() -> None:
    known, unknown = days(0, NOISE)[0], days(0)[1]
    with pytest.raises(ValueError, match="comes without its noise, but others with it"):
        pf.calibrate(road_of(), [known, unknown], WIDE)
    two = pf.ForceDeflection([20e3, 40e3], [3e-4, 6e-4], speed_kmh=15.0, temperature_c=20.0)
    with pytest.raises(ValueError, match="2 deflections for 2 parameters: must be more"):
        pf.calibrate(road_of(), two, WIDE)


def test_the_range_of_the_stiffness_formulas_is_warned_of_once() -> None:
    creeping = pf.ForceDeflection(
        FORCE, FORCE * 1e-8, speed_kmh=1.0, temperature_c=20.0, name="creeping"
    )
    with pytest.warns(pf.ValidityWarning) as caught:
        pf.calibrate(road_of(), creeping, {"asphalt_bar_stiffness": (1e6, 1e10)})
    messages = [str(warning.message) for warning in caught]
    assert len(messages) == len(set(messages))
    assert any("loading time 1.08 s" in message for message in messages)


def test_what_a_fit_tells(true_history: xr.DataArray) -> None:
    fit = pf.calibrate(road_of(), days(0, NOISE), WIDE)
    low, high = fit.interval("bar_rigidity")
    table = fit.dataset.sel(parameter="bar_rigidity")
    assert (float(table["interval_low"]), float(table["interval_high"])) == (low, high)
    assert float(table["bound_low"]) == 1e7
    assert float(table["start"]) == pytest.approx(9.5e7)
    assert f"95 % interval {low:.5g} to {high:.5g}" in fit.summary()["bar_rigidity"]
    assert fit.summary()["deflections"] == "24 of 2 measurements"
    with pytest.raises(ValueError, match="vma"):
        fit.interval("vma")
    with pytest.raises(ValueError, match="level"):
        fit.interval("bar_rigidity", 95.0)


def test_a_fit_is_drawn(true_history: xr.DataArray) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pf.CalibrationWarning)
        fit = pf.calibrate(
            short(), [history_of(true_history), *days(0)], {"bar_damping": (1e4, 1e6)}
        )
    figure = fit.plot()
    figure.savefig(io.BytesIO(), format="png")
    assert len(figure.axes) == 6
    fitted = figure.axes[2].lines[1]
    np.testing.assert_allclose(np.asarray(fitted.get_xdata(), dtype=np.float64), FORCE / 1e3)
    np.testing.assert_allclose(
        np.asarray(fitted.get_ydata(), dtype=np.float64), fit.fitted[1] * 1e3
    )


def test_a_creep_test_takes_no_tire_print() -> None:
    pairs = pf.ForceDeflection(
        force=[40e3, 50e3], deflection=[4e-4, 5e-4], speed_kmh=15.0, temperature_c=10.0
    )
    with pytest.raises(ValueError, match=r"tire_print = 0.3 m: a force at rest is a point"):
        pairs.predict(pf.Road.paper(), pf.Scheme.converged(tire_print=0.3))
