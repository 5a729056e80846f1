"""The banded solver: the paper's numbers, those of the dense solver, and roads of any length."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import DenseRoad

import pavefem as pf

MM = 1e-3
PAVEMENTS = {
    "paper": pf.Pavement.paper(),
    "lean": pf.Pavement.paper(pf.Asphalt(vma=18.0)),
    "weak": pf.Pavement.paper(bar_rigidity=3e7, bar_damping=5e4, element_mass=700.0),
}


def agree(found: pf.Result, expected: pf.Result, part: float) -> None:
    """Histories and envelopes are the same within a part of the largest deflection."""
    atol = part * expected.max_deflection
    np.testing.assert_array_equal(found.x, expected.x)
    np.testing.assert_array_equal(found.time, expected.time)
    for name in ("deflection", "lowest", "highest", "peak_deflection"):
        values = getattr(found, name), getattr(expected, name)
        np.testing.assert_allclose(*values, rtol=0, atol=atol, err_msg=name)


def by_both(road: pf.Road, scheme: pf.Scheme, **how: Any) -> tuple[pf.Result, pf.Result]:
    truck = pf.vehicles.tandem_truck()
    banded, dense = (
        pf.simulate(road, truck, scheme=scheme.model_copy(update={"solver": solver}), **how)
        for solver in ("banded", "dense")
    )
    return banded, dense


def test_nominal_case_of_the_paper() -> None:
    """The numbers of the dense solver in tests/test_literature.py."""
    scheme = pf.Scheme.paper(solver="banded")
    nominal = pf.simulate(pf.Road(length=25.0), pf.vehicles.tandem_truck(), scheme=scheme)
    assert -nominal.lowest[25] == pytest.approx(0.643594386 * MM, rel=1e-8)
    assert nominal.max_deflection == pytest.approx(0.661134721 * MM, rel=1e-8)
    assert nominal.highest[25] == pytest.approx(0.0606088 * MM, rel=1e-6)


@pytest.mark.parametrize("preset", [pf.Scheme.paper, pf.Scheme.converged])
@pytest.mark.parametrize("ends", ["clamped", "pinned", "free"])
def test_rough_road_of_sections_by_both_solvers(ends: Any, preset: type[pf.Scheme]) -> None:
    pavements = [PAVEMENTS["paper"], PAVEMENTS["lean"], PAVEMENTS["weak"], PAVEMENTS["paper"]]
    road = pf.Road(sections=list(zip(pavements, [23.0, 17.3, 5.0, 14.2], strict=True)), ends=ends)
    scheme = preset(element_length=0.5 if preset == pf.Scheme.paper else 0.25)
    profile = pf.Profile.iso8608("C", length=120.0, seed=3)
    banded, dense = by_both(road, scheme, profile=profile, run_in=30.0, speed_kmh=90.0)
    agree(banded, dense, 1e-8)


def test_long_road_by_an_independent_matrix_exponential() -> None:
    """All of Phi by scipy, and no digit of what is 11 m and more from the diagonal is missed."""
    road, truck = pf.Road(length=60.0), pf.vehicles.tandem_truck()
    scheme = pf.Scheme.paper(solver="banded", dt=2e-3)
    found = pf.simulate(road, truck, scheme=scheme)
    assert found.forces is not None
    oracle = DenseRoad.of(road, scheme, 20.0, 65.0)
    expected = oracle.step(found.forces.position, found.forces.force, 2e-3)
    assert found.deflection is not None
    atol = 1e-8 * found.max_deflection
    np.testing.assert_allclose(found.deflection, expected, rtol=0, atol=atol)


@given(
    sections=st.lists(
        st.tuples(st.sampled_from(list(PAVEMENTS.values())), st.floats(2.0, 12.0)),
        min_size=1,
        max_size=3,
    ),
    ends=st.sampled_from(["clamped", "pinned", "free"]),
    foundation=st.sampled_from(["bars", "winkler"]),
    h=st.floats(0.3, 0.7),
    weights=st.sampled_from(["linear", "hermite"]),
    hold=st.sampled_from(["zero", "first"]),
    dt=st.floats(5e-4, 4e-3),
    speed_kmh=st.floats(20.0, 105.0),
)
@settings(max_examples=10, deadline=None)
def test_random_roads_by_both_solvers(
    sections: Any,
    ends: Any,
    foundation: Any,
    h: float,
    weights: Any,
    hold: Any,
    dt: float,
    speed_kmh: float,
) -> None:
    road = pf.Road(sections=sections, ends=ends)
    fields = {"element_length": h, "dt": dt, "weights": weights, "hold": hold}
    banded, dense = by_both(
        road, pf.Scheme(foundation=foundation, **fields), speed_kmh=speed_kmh, cache=False
    )
    agree(banded, dense, 1e-7)


def test_two_kilometres_begin_as_a_hundred_metres_do() -> None:
    """Twenty times as long, and what is 30 m before the end of the short road is the same."""
    scheme = pf.Scheme.paper(hold="first")
    truck = pf.vehicles.tandem_truck()
    short = pf.simulate(pf.Road(length=100.0), truck, scheme=scheme, stations=[20.2, 69.9])
    scheme = scheme.model_copy(update={"solver": "banded"})
    long = pf.simulate(pf.Road(length=2000.0), truck, scheme=scheme, stations=[20.2, 69.9])
    assert short.deflection is not None
    assert long.deflection is not None
    atol = 2e-8 * short.max_deflection
    rows = np.flatnonzero(short.time < 4.0)
    np.testing.assert_allclose(long.deflection[rows], short.deflection[rows], rtol=0, atol=atol)
    inside = short.x < 70.0
    nodes = np.flatnonzero(inside)
    np.testing.assert_allclose(long.lowest[nodes], short.lowest[nodes], rtol=0, atol=atol)


def test_it_answers_more_than_deflections() -> None:
    """What the window answers, but for the errors of its steps, which are of second order."""
    road, truck = pf.Road(length=40.0), pf.vehicles.tandem_truck()
    names: list[Any] = ["velocity", "moment", "strain", "pressure"]
    errors = []
    for dt in (1e-3, 5e-4):
        banded, window = (
            pf.simulate(
                road,
                truck,
                scheme=pf.Scheme.converged(element_length=0.25, solver=solver, dt=dt),
                keep=names,
                stations=[17.3, 20.0],
            )
            for solver in ("banded", "window")
        )
        pairs = [(banded.histories[name], window.histories[name]) for name in names]
        errors.append([np.std(found - exact) / np.abs(exact).max() for exact, found in pairs])
    ratios = np.asarray(errors[0]) / np.asarray(errors[1])
    assert max(errors[1]) < 2e-4, errors
    assert ((ratios > 3.0) & (ratios < 5.0)).all(), errors


def test_a_scenario_file_can_ask_for_it(tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text('[scheme]\npreset = "paper"\nsolver = "banded"\n[road]\nlength = 900.0\n')
    scenario = pf.Scenario.from_toml(file)
    assert scenario.scheme == pf.Scheme.paper(solver="banded")
    assert pf.run(scenario, keep="envelope").max_deflection > 5e-4


def test_a_band_that_is_too_wide_names_the_other_solvers() -> None:
    """Elements of 4 cm: what a millisecond takes from one node to another goes beyond 120."""
    scheme = pf.Scheme.converged(solver="banded", element_length=0.04)
    with pytest.raises(ValueError, match=r"120 elements .* use the window or the dense one"):
        pf.simulate(pf.Road(length=10.0), pf.vehicles.tandem_truck(), scheme=scheme)
