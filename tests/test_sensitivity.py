"""Which parameter matters: indices against functions whose indices are known, and on the model."""

from __future__ import annotations

import io
import math
import sys
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import pavefem as pf
from pavefem import plotting
from pavefem.studies import morris, sobol, tornado

Array = NDArray[np.float64]

A, B = 7.0, 0.1
ANGLES: Final = {name: (-math.pi, math.pi) for name in ("x1", "x2", "x3")}


def ishigami(x: Array) -> Array:
    first = np.sin(x[:, 0])
    result: Array = first + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * first
    return result


def linear(x: Array) -> Array:
    result: Array = 3.0 + x @ np.array([1.0, -2.0, 0.0])
    return result


# Parts of the variance by the integrals of the function (Saltelli et al., Global Sensitivity
# Analysis: The Primer, 2008, p. 179).
VARIANCE: Final = A**2 / 8 + B * math.pi**4 / 5 + B**2 * math.pi**8 / 18 + 0.5
ON_ITS_OWN: Final = np.array([0.5 * (1 + B * math.pi**4 / 5) ** 2, A**2 / 8, 0.0]) / VARIANCE
TOGETHER: Final = 8 * B**2 * math.pi**8 / 225 / VARIANCE
"""Of x1 and x3."""
IN_ALL: Final = ON_ITS_OWN + np.array([TOGETHER, 0.0, TOGETHER])


def test_indices_of_the_ishigami_function() -> None:
    found = sobol(ishigami, ANGLES, samples=4096, second_order=True, seed=1)
    np.testing.assert_allclose(found["first_order"][0], ON_ITS_OWN, atol=0.01)
    np.testing.assert_allclose(found["total"][0], IN_ALL, atol=0.01)
    np.testing.assert_allclose(found["second_order"][0], [0.0, TOGETHER, 0.0], atol=0.02)
    assert found["pair"].to_numpy().tolist() == ["x1 x x2", "x1 x x3", "x2 x x3"]
    assert found.sizes["run"] == 4096 * 8
    np.testing.assert_array_equal(found["answers"][:, 0], ishigami(found["points"].to_numpy()))
    assert float(found["answers"].var()) == pytest.approx(VARIANCE, rel=0.01)


def test_confidence_intervals_of_indices_hold_them() -> None:
    seeds, held = 40, np.zeros(3)
    for seed in range(seeds):
        found = sobol(ishigami, ANGLES, samples=256, seed=seed)
        held += np.abs(found["first_order"][0] - ON_ITS_OWN) <= found["first_order_confidence"][0]
    # A sequence does better than the random points that resampling takes them for, hence no upper
    # limit; 33 of 40 has a chance of 1 in 500 at 95 %.
    assert held.min() >= 33


def test_indices_get_better_with_the_number_of_samples() -> None:
    samples = np.array([64, 256, 1024, 4096])
    errors = [
        np.sqrt(
            np.mean(
                [
                    (sobol(ishigami, ANGLES, samples=n, seed=s)["total"][0] - IN_ALL) ** 2
                    for s in range(8)
                ]
            )
        )
        for n in samples.tolist()
    ]
    order = np.polyfit(np.log(samples), np.log(errors), 1)[0]
    assert order < -0.5


def test_effects_of_a_linear_function_are_its_slopes() -> None:
    ranges = {"a": (0.0, 10.0), "b": (1.0, 2.0), "c": (-1.0, 1.0)}
    found = morris(linear, ranges, trajectories=10).isel(output=0)
    np.testing.assert_allclose(found["mu"], [10.0, -2.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(found["mu_star"], [10.0, 2.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(found["sigma"], 0.0, atol=1e-12)
    np.testing.assert_allclose(found["mu_star_confidence"], 0.0, atol=1e-12)
    assert found.sizes["run"] == 10 * 4
    one = tornado(linear, ranges).isel(output=0)
    np.testing.assert_allclose(one["middle"], 3.0 + 5.0 - 3.0)
    np.testing.assert_allclose(one["at_high"] - one["at_low"], [10.0, -2.0, 0.0])
    indices = sobol(linear, ranges, samples=1024).isel(output=0)
    np.testing.assert_allclose(indices["total"], [100 / 104, 4 / 104, 0.0], atol=0.01)


def test_sigma_tells_what_depends_on_the_others() -> None:
    ranges = {"a": (0.0, 1.0), "b": (0.0, 1.0), "c": (0.0, 1.0)}
    found = morris(lambda x: x[:, 0] * x[:, 1] + x[:, 2], ranges).isel(output=0)
    sigma = dict(zip("abc", found["sigma"].to_numpy(), strict=True))
    assert sigma["a"] > 0.2 and sigma["b"] > 0.2
    assert sigma["c"] < 1e-12


def test_seeds_are_kept_and_outputs_are_told_apart() -> None:
    def both(x: Array) -> Array:
        return np.stack([ishigami(x), linear(x)], axis=1)

    first, second, other = (
        sobol(both, ANGLES, ["a", "b"], samples=64, seed=seed) for seed in (0, 0, 1)
    )
    xr.testing.assert_identical(first, second)
    assert not np.array_equal(first["total"], other["total"])
    alone = sobol(ishigami, ANGLES, samples=64, seed=0)
    np.testing.assert_array_equal(first["total"].sel(output="a"), alone["total"][0])
    effects = [morris(both, ANGLES, ["a", "b"], seed=5) for _ in range(2)]
    xr.testing.assert_identical(*effects)


# --- of a scenario ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def base() -> pf.Scenario:
    return pf.Scenario(
        road=pf.Road(pf.Pavement.paper(), length=10.0),
        vehicle=pf.vehicles.tandem_truck(axle_spacing=1.3),
        profile=pf.Profile.iso8608("B", length=60.0, seed=1),
        run_in=30.0,
    )


RANGES: Final = {
    "temperature_c": (10.0, 30.0),
    "vma": (15.0, 28.0),
    "speed_kmh": (30.0, 100.0),
    "axle_spacing": (0.9, 2.2),
    "payload": (0.0, 12_400.0),
    "iri": (1.0, 5.0),
}


@pytest.fixture(scope="module")
def study(base: pf.Scenario) -> xr.Dataset:
    return sobol(base, RANGES, ["mid_deflection", "max_force"], samples=16)


def test_runs_of_a_study_are_those_of_simulate(base: pf.Scenario, study: xr.Dataset) -> None:
    assert study.sizes["run"] == 16 * 8
    made = base.profile
    assert made is not None
    for run in (0, 50, 127):
        at = dict(zip(RANGES, study["points"][run].to_numpy().tolist(), strict=True))
        scale = at["iri"] / made.iri()
        rough = pf.Profile(made.x, scale * made.z)
        assert rough.iri() == pytest.approx(at["iri"])
        result = pf.simulate(
            pf.Road(pf.Pavement.paper(asphalt=pf.Asphalt(vma=at["vma"])), length=10.0),
            pf.vehicles.tandem_truck(axle_spacing=at["axle_spacing"], payload=at["payload"]),
            profile=rough,
            run_in=30.0,
            speed_kmh=at["speed_kmh"],
            temperature_c=at["temperature_c"],
        )
        deflection, force = study["answers"][run].to_numpy()
        assert deflection == pytest.approx(-float(result.history(x=5.0).min()), rel=1e-9)
        assert force == pytest.approx(float(result.tire_forces.max()), rel=1e-9)


def test_a_study_says_what_it_is_of(study: xr.Dataset) -> None:
    assert study["units"].to_numpy().tolist() == ["°C", "%", "km/h", "m", "kg", "m/km"]
    assert study["output_units"].to_numpy().tolist() == ["m", "N"]
    assert study["high"].sel(parameter="payload") == 12_400.0
    assert study.attrs == {"title": "Sobol's indices", "level": 0.95}


def test_asphalt_rules_deflection_and_roughness_rules_force(base: pf.Scenario) -> None:
    one = tornado(base, RANGES, ["mid_deflection", "max_force"])
    change = abs(one["at_high"] - one["at_low"])
    deflection, force = change.sel(output="mid_deflection"), change.sel(output="max_force")
    assert deflection.idxmax().item() == "temperature_c"
    assert deflection.idxmin().item() in ("iri", "axle_spacing")
    assert force.sel(parameter="temperature_c") == force.sel(parameter="vma") == 0.0
    assert force.sel(parameter="iri") > 5e3


def test_threads_and_stores_change_no_answer(
    base: pf.Scenario, study: xr.Dataset, tmp_path: Path
) -> None:
    fields = base.model_copy()
    for _ in range(2):  # the second time from the store
        again = sobol(
            fields,
            RANGES,
            ["mid_deflection", "max_force"],
            samples=16,
            workers=1,
            store=tmp_path / "study",
        )
        xr.testing.assert_identical(again, study)
    assert any((tmp_path / "study").iterdir())


def test_a_constant_output_is_refused(base: pf.Scenario) -> None:
    asphalt = {name: RANGES[name] for name in ("temperature_c", "vma")}
    message = r"output max_force is the same, \S+, in all \d+ runs: no parameter matters to it"
    with pytest.raises(ValueError, match=message):
        sobol(base, asphalt, "max_force", samples=2)
    with pytest.raises(ValueError, match=message):
        morris(base, asphalt, "max_force", trajectories=2)
    with pytest.raises(ValueError, match=message):
        tornado(base, asphalt, "max_force")


def test_runs_that_fail_are_reported(base: pf.Scenario) -> None:
    warm = {"temperature_c": (30.0, 80.0), "payload": (0.0, 12_400.0)}
    message = r"of 16 runs failed, the first at temperature_c = .*, payload = .*below the softening"
    with pytest.warns(pf.ValidityWarning), pytest.raises(ValueError, match=message):
        sobol(base, warm, samples=4)
    with pytest.warns(pf.ValidityWarning), pytest.warns(UserWarning, match="trajectories are left"):
        left = morris(base, {"temperature_c": (20.0, 61.0), "payload": (0.0, 1e4)}, trajectories=20)
    assert 2 * 3 <= left.sizes["run"] < 20 * 3
    assert np.isfinite(left["mu_star"]).all()
    assert np.isfinite(left["answers"]).all()
    with pytest.raises(ValueError, match="narrow the ranges"):
        morris(base, {"temperature_c": (61.0, 80.0), "payload": (0.0, 1e4)}, trajectories=2)


def test_laws_that_are_left_are_warned_of_once(base: pf.Scenario) -> None:
    with pytest.warns(pf.ValidityWarning, match=r"of 5 runs use a law outside .* as in") as caught:
        tornado(base, {"temperature_c": (20.0, 45.0), "payload": (0.0, 1e4)})
    assert len(caught) == 1


# --- input --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"samples": 1000}, "samples = 1000: must be a power of 2"),
        ({"samples": 1}, "samples = 1: must be a power of 2"),
        ({"level": 95.0}, "level = 95.0"),
        ({"seed": -1}, "seed = -1"),
        ({"parameters": {}}, "parameters = {}: must be names"),
        ({"parameters": ["x1"]}, r"parameters = \['x1'\]: must be names"),
        ({"parameters": {"x1": (1.0, 1.0)}}, "bounds of x1 are 1 and 1: the first must be lower"),
        ({"parameters": {"x1": 1.0}}, "bounds of x1 = 1.0: must be two numbers"),
        ({"model": 3.0}, "model is a float"),
        ({"model": lambda x: x}, r"array of shape \(\d+, 3\): must be \(\d+, 1\)"),
        ({"model": lambda x: np.full(len(x), np.nan)}, "80 of 80 runs failed, .* not finite"),
        ({"outputs": ["a", "a"]}, r"outputs = \['a', 'a'\]"),
        ({"outputs": {"a", "b"}}, "outputs = {.*}: must be names"),
        ({"outputs": 5}, "outputs = 5: must be names"),
        ({"parameters": None}, "parameters = None: must be names"),
        ({"parameters": {1: (0.0, 1.0)}}, "parameters has the name 1: must be text"),
        ({"parameters": {"x1": "01"}}, "bounds of x1 = '01': must be two numbers"),
        ({"parameters": {"x1": (0, 10**400)}}, "bounds of x1 = 10+: must be a finite number"),
        ({"level": "high"}, "level = 'high': must be a finite number"),
        ({"store": "kept"}, "store: for a scenario; a function is called at once"),
        (
            {"model": lambda x: np.ma.masked_less(x[:, 0], 9.0)},
            "80 of 80 runs failed, .* not finite",
        ),
        ({"model": pf.Scenario()}, "x1"),
    ],
)
def test_a_study_that_cannot_be_made_is_refused(arguments: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"model": ishigami, "parameters": ANGLES, "samples": 16}
    with pytest.raises(ValueError, match=message):
        sobol(**given | arguments)


def test_trajectories_and_levels_are_checked() -> None:
    wrong: list[dict[str, Any]] = [{"trajectories": 1}, {"levels": 5}]
    for options in wrong:
        with pytest.raises(ValueError, match="must be at least 2, and even"):
            morris(ishigami, ANGLES, **options)


def test_without_salib_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "SALib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "SALib", None)
    for method in (sobol, morris):
        with pytest.raises(ImportError, match=r'pip install "pavefem\[sensitivity\]"'):
            method(ishigami, ANGLES)
    tornado(linear, ANGLES)


# --- pictures -----------------------------------------------------------------------------------


def widths(figure: Any) -> list[list[float]]:
    return [
        [patch.get_width() for patch in container.patches]
        for container in figure.axes[0].containers
        if hasattr(container, "patches")
    ]


def test_pictures_put_what_matters_most_on_top(base: pf.Scenario, study: xr.Dataset) -> None:
    one = tornado(base, RANGES, "mid_deflection")
    low, high = widths(plotting.plot_tornado(one))
    reach = np.abs(np.subtract(high, low))
    assert (np.diff(reach) >= 0.0).all()
    assert reach[-1] == pytest.approx(1e3 * abs(float(one["at_high"][0, 0] - one["at_low"][0, 0])))
    total, first = widths(plotting.plot_sobol(study, "mid_deflection"))
    assert (np.diff(total) >= 0.0).all()
    assert len(first) == 6
    effects = morris(base, RANGES, "mid_deflection", trajectories=4)
    [mu_star] = widths(plotting.plot_morris(effects))
    np.testing.assert_allclose(mu_star, np.sort(1e3 * effects["mu_star"][0]))
    for figure in (
        plotting.plot_tornado(one),
        plotting.plot_sobol(study, "max_force"),
        plotting.plot_morris(effects),
    ):
        figure.savefig(io.BytesIO(), format="png")
        assert figure.axes[0].get_yticklabels()[0].get_text()


def test_pictures_need_the_study_and_an_output(study: xr.Dataset) -> None:
    with pytest.raises(ValueError, match=r"output = None: must be one of \['mid_deflection', 'max"):
        plotting.plot_sobol(study)
    with pytest.raises(ValueError, match="must be a Dataset with at_low"):
        plotting.plot_tornado(study)
