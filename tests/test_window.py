"""The moving window: against the transition matrix, closed form of a moving load, long roads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pavefem as pf
from pavefem.analytical import WinklerBeam


def two_sections() -> pf.Road:
    soft = pf.Pavement.paper(asphalt=pf.Asphalt(vma=18.0))
    return pf.Road(sections=[(pf.Pavement.paper(), 13.3), (soft, 11.7)], ends="pinned")


@pytest.mark.parametrize("preset", [pf.Scheme.paper, pf.Scheme.converged])
def test_window_against_the_transition_matrix(preset: type[pf.Scheme]) -> None:
    """Second order in the step: half the step, a quarter of the difference."""
    road, truck = two_sections(), pf.vehicles.tandem_truck()
    errors = []
    for dt in (2e-3, 1e-3):
        dense, window = (
            pf.simulate(road, truck, scheme=preset(dt=dt, hold="first", solver=solver))
            for solver in ("dense", "window")
        )
        assert dense.deflection is not None
        assert window.deflection is not None
        np.testing.assert_array_equal(window.time, dense.time)
        np.testing.assert_array_equal(window.x, dense.x)
        difference = window.deflection - dense.deflection
        bound = np.abs(difference).max()
        assert bound < 5e-3 * dense.max_deflection
        np.testing.assert_allclose(window.lowest, dense.lowest, rtol=0, atol=2 * bound)
        np.testing.assert_allclose(window.highest, dense.highest, rtol=0, atol=2 * bound)
        errors.append(np.sqrt(np.mean(difference**2)) / dense.max_deflection)
    assert errors[1] < 1e-4
    assert 3.0 < errors[0] / errors[1] < 5.0, errors


@pytest.mark.parametrize("speed_kmh", [25.0, 65.0, 105.0])
def test_moving_load_on_a_long_road_has_its_closed_form(speed_kmh: float) -> None:
    """A wheel far from both ends of 150 m: the steady state on an infinite Winkler beam."""
    pavement = pf.Pavement.paper()
    wheel = pf.Vehicle(
        name="wheel",
        bodies=[pf.Body(name="mass", mass=4000.0, x=0.0)],
        tires=[pf.Tire(body="mass", x=0.0, stiffness=1e6, damping=0.0)],
    )
    beam = WinklerBeam.of(pavement.constants(20.0, speed_kmh))
    expected, _ = beam.moving_peak(wheel.static_loads[0] / 2, speed_kmh / 3.6)
    road = pf.Road(pavement, length=150.0)
    scheme = pf.Scheme.converged()
    found = pf.simulate(road, wheel, speed_kmh=speed_kmh, scheme=scheme, keep="envelope")
    inside = (found.x > 50.0) & (found.x < 100.0)
    np.testing.assert_allclose(-found.lowest[inside], expected, rtol=1e-3)


def test_ten_kilometres() -> None:
    """On a uniform smooth road every node far from the ends goes through the same."""
    scheme = pf.Scheme.paper(solver="window")
    result = pf.simulate(
        pf.Road(length=10_000.0),
        pf.vehicles.tandem_truck(),
        scheme=scheme,
        stations=[5000.0],
        every=100,
    )
    inside = slice(100, -100)
    assert np.ptp(result.lowest[inside]) < 5e-3 * result.max_deflection
    assert result.deflection is not None
    assert np.abs(result.deflection).max() < result.max_deflection
    passing = result.time_of_lowest[inside]
    assert (np.diff(passing) > 0.0).mean() > 0.9


def test_a_scenario_file_can_ask_for_it(tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text('[scheme]\npreset = "paper"\nsolver = "window"\n[road]\nlength = 900.0\n')
    scenario = pf.Scenario.from_toml(file)
    assert scenario.scheme == pf.Scheme.paper(solver="window")
    assert pf.run(scenario, keep="envelope").max_deflection > 5e-4


def test_a_long_road_names_the_window() -> None:
    with pytest.raises(ValueError, match=r'use a Scheme with solver="banded" .* or "window"'):
        pf.simulate(pf.Road(length=900.0), pf.vehicles.tandem_truck())
