"""The whole run: against plain dense stepping, by its invariances, and by its rates in dt.

Goal: the blocked stepper of the core gives the numbers of a loop ``y = Phi y + Gamma f`` written in
numpy (`oracle.DenseRoad`); the options that choose what is kept never change what is computed.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from conftest import forget_steppers
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import Array, DenseRoad, constant_forces, turning

import pavefem as pf
from pavefem import _core
from pavefem._progress import progress_bar

Hold = Literal["zero", "first"]


def deflection(result: pf.Result) -> Array:
    assert result.deflection is not None
    return result.deflection


def single_axle(load: float = 80e3) -> pf.Vehicle:
    """Build a mass on a tire."""
    return pf.Vehicle(
        name="axle",
        bodies=[pf.Body(name="mass", mass=load / 9.81, x=0.0)],
        tires=[pf.Tire(body="mass", x=0.0, stiffness=1e6, damping=1e4)],
    )


def agree(found: Array, expected: Array, digits: float) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=digits * np.abs(expected).max())


# --- against plain dense stepping -------------------------------------------------------------

SCHEMES = {
    "paper": pf.Scheme.paper(),
    "first-order hold": pf.Scheme.paper(hold="first"),
    "hermite weights": pf.Scheme.paper(weights="hermite"),
    "winkler bed": pf.Scheme.paper(foundation="winkler"),
    "converged, coarse": pf.Scheme.converged(element_length=0.25, dt=2e-3, solver="dense"),
}


@pytest.mark.parametrize("name", SCHEMES)
def test_plain_stepping_gives_the_same(name: str, truck: pf.Vehicle) -> None:
    scheme = SCHEMES[name]
    road = pf.Road(length=10.0)
    found = pf.simulate(road, truck, scheme=scheme, speed_kmh=65.0, temperature_c=20.0)
    dense = DenseRoad.of(road, scheme, 20.0, 65.0)
    positions, forces = constant_forces(truck, 10.0, 65.0, scheme.dt)
    expected = dense.step(positions, forces, scheme.dt, scheme.weights, scheme.hold)
    np.testing.assert_allclose(found.x, dense.nodes, rtol=0, atol=1e-12)
    agree(deflection(found), expected, 1e-10)
    held = scheme.hold == "zero"
    lowest, highest = (expected.min(axis=0), expected.max(axis=0)) if held else turning(expected)
    agree(found.lowest, lowest, 1e-10)
    agree(found.highest, highest, 1e-10)
    agree(found.peak_deflection.max(axis=0), -lowest, 1e-10)


@pytest.mark.parametrize("ends", ["clamped", "pinned", "free"])
def test_plain_stepping_of_sections_and_ends(
    ends: Literal["clamped", "pinned", "free"], truck: pf.Vehicle
) -> None:
    """Three structures whose lengths are not multiples of the element, each end in turn."""
    hot = pf.Pavement.paper(pf.Asphalt(vma=20.0))
    soft = pf.Pavement.paper(bar_rigidity=3e7, bar_damping=5e4, element_mass=700.0)
    road = pf.Road(sections=[(hot, 3.3), (soft, 2.0), (pf.Pavement.paper(), 4.9)], ends=ends)
    assert road.length == pytest.approx(10.2)
    scheme = pf.Scheme.paper()
    found = pf.simulate(road, truck, scheme=scheme, speed_kmh=80.0, temperature_c=25.0)
    dense = DenseRoad.of(road, scheme, 25.0, 80.0)
    assert found.x.size == 1 + 7 + 4 + 10
    np.testing.assert_allclose(found.x, dense.nodes, rtol=0, atol=1e-12)
    positions, forces = constant_forces(truck, 10.2, 80.0, scheme.dt)
    agree(deflection(found), dense.step(positions, forces, scheme.dt), 1e-10)
    held = [0, -1] if ends != "free" else []
    assert (deflection(found)[:, held] == 0.0).all()
    if ends == "free":
        assert deflection(found)[:, [0, -1]].any()


def test_plain_stepping_under_rough_forces(road: pf.Road, rough_run: pf.Result) -> None:
    assert rough_run.forces is not None
    dense = DenseRoad.of(road, pf.Scheme.paper(), 20.0, 65.0)
    expected = dense.step(rough_run.forces.position, rough_run.forces.force, 1e-3)
    agree(deflection(rough_run), expected, 1e-10)


@given(
    st.floats(1.0, 6.0),
    st.floats(0.2, 0.5),
    st.floats(20.0, 110.0),
    st.floats(5.0, 30.0),
    st.sampled_from(["bars", "winkler"]),
    st.sampled_from(["linear", "hermite"]),
    st.sampled_from(["zero", "first"]),
)
@settings(max_examples=15)
def test_plain_stepping_of_random_roads(
    length: float,
    h: float,
    speed_kmh: float,
    temperature_c: float,
    foundation: Any,
    weights: Any,
    hold: Any,
) -> None:
    scheme = pf.Scheme(foundation=foundation, element_length=h, weights=weights, hold=hold, dt=2e-3)
    road, axle = pf.Road(length=length), single_axle()
    with pytest.warns(pf.ValidityWarning) if not 10.8 <= speed_kmh <= 108.0 else nullcontext():
        found = pf.simulate(
            road, axle, scheme=scheme, speed_kmh=speed_kmh, temperature_c=temperature_c
        )
        dense = DenseRoad.of(road, scheme, temperature_c, speed_kmh)
    positions, forces = constant_forces(axle, length, speed_kmh, 2e-3)
    agree(deflection(found), dense.step(positions, forces, 2e-3, weights, hold), 1e-9)


def test_strip_matrices_are_those_of_the_oracle() -> None:
    road = pf.Road(sections=[(pf.Pavement.paper(), 2.2), (pf.Pavement.paper(bar_mass=50.0), 1.0)])
    foundations: tuple[Literal["bars", "winkler"], ...] = ("bars", "winkler")
    for foundation in foundations:
        scheme = pf.Scheme(foundation=foundation)
        strip = road.strip(20.0, 65.0, foundation=foundation)
        dense = DenseRoad.of(road, scheme, 20.0, 65.0)
        free = np.ix_(dense.free, dense.free)
        for name in ("mass", "damping", "stiffness"):
            agree(getattr(strip, name), getattr(dense, name)[free], 1e-14)


# --- physics that any linear road has ---------------------------------------------------------


def test_starts_at_rest_and_comes_back_to_it(nominal: pf.Result) -> None:
    assert not deflection(nominal)[0].any()
    # The first half of the road is long rid of the truck when the last axle leaves.
    assert np.abs(deflection(nominal)[-1, :20]).max() < 1e-3 * nominal.max_deflection


def stepper(strip: _core.Strip, hold: Hold = "zero", weights: str = "linear") -> _core.Stepper:
    transition = _core.Transition.of_strip(strip, 1e-3)
    return _core.Stepper(strip, transition, weights, hold, (["deflection"], True, np.empty(0), 1))


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_superposition_of_axles(road: pf.Road, truck: pf.Vehicle, hold: Hold) -> None:
    """Two vehicles together do what each does alone, added; twice the force, twice the answer."""
    positions, forces = constant_forces(truck, 25.0, 65.0, 1e-3)
    step = stepper(road.strip(20.0, 65.0), hold)
    whole = step.run(positions, forces)[0]
    parts = [step.run(positions[:, [i]].copy(), forces[:, [i]].copy())[0] for i in range(3)]
    agree(sum(parts[1:], parts[0]), whole, 1e-12)
    agree(step.run(positions, -2.5 * forces)[0], -2.5 * whole, 1e-12)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10)
def test_superposition_of_random_forces(seed: int) -> None:
    rng = np.random.default_rng(seed)
    strip = pf.Road(length=4.0).strip(20.0, 65.0)
    step = stepper(strip, "first", "hermite")
    positions = rng.uniform(-1.0, 5.0, (150, 2))
    one, other = rng.normal(0.0, 5e4, (2, 150, 2))
    together = step.run(positions, one + 3.0 * other)[0]
    agree(step.run(positions, one)[0] + 3.0 * step.run(positions, other)[0], together, 1e-11)


@pytest.mark.parametrize("foundation", ["bars", "winkler"])
def test_reciprocity(foundation: Literal["bars", "winkler"]) -> None:
    """Maxwell and Betti: a force at a deflects b as a force at b deflects a, at every instant."""
    soft = pf.Pavement.paper(bar_rigidity=2e7, moment_of_inertia=2e-4)
    road = pf.Road(sections=[(pf.Pavement.paper(), 3.0), (soft, 3.0)])
    strip = road.strip(20.0, 65.0, foundation=foundation)
    step = stepper(strip, weights="hermite")
    forces = np.full((200, 1), 8e4)
    a, b = 3, 8  # nodes 0.5 m apart
    at_b = step.run(np.full((200, 1), strip.nodes[a]), forces)[0][:, b]
    at_a = step.run(np.full((200, 1), strip.nodes[b]), forces)[0][:, a]
    assert np.abs(at_b).max() > 1e-9
    agree(at_b, at_a, 1e-10)


def test_mirrored_road_under_a_standing_force() -> None:
    strip = pf.Road(length=6.0).strip(20.0, 65.0)
    history = stepper(strip).run(np.full((100, 1), 3.0), np.full((100, 1), 8e4))[0]
    agree(history[:, ::-1], history, 1e-11)


def test_standing_force_ends_at_the_static_deflection() -> None:
    strip = pf.Road(length=5.0).strip(20.0, 65.0)
    history = stepper(strip).run(np.full((3000, 1), 2.0), np.full((3000, 1), 8e4))[0]
    force = np.zeros(strip.stiffness.shape[0])
    force[2 * (4 - 1)] = -4e4  # half of the axle; node 4 at 2 m, node 0 held
    expected = np.linalg.solve(strip.stiffness, force)[::2]
    agree(history[-1, 1:-1], np.asarray(expected, dtype=np.float64), 1e-9)


def test_axles_off_the_road_load_nothing() -> None:
    strip = pf.Road(length=3.0).strip(20.0, 65.0)
    places = np.tile([-1e-9, 3.0 + 1e-9, 1e6], (50, 1))
    history, lowest, highest, _, _ = stepper(strip).run(places, np.full((50, 3), 8e4))
    assert not history.any()
    assert not lowest.any()
    assert not highest.any()


def test_share_on_a_clamped_end_goes_into_the_support() -> None:
    strip = pf.Road(length=3.0).strip(20.0, 65.0)
    near = stepper(strip).run(np.full((300, 1), 0.25), np.full((300, 1), 8e4))[0]
    half = stepper(strip).run(np.full((300, 1), 0.5), np.full((300, 1), 4e4))[0]
    agree(near, half, 1e-12)


def test_softer_and_slower_roads_deflect_more(road: pf.Road, truck: pf.Vehicle) -> None:
    peaks = [
        pf.simulate(road, truck, temperature_c=t, keep="envelope").max_deflection
        for t in (10.0, 20.0, 30.0)
    ]
    assert peaks == sorted(peaks)
    fast, slow = (
        pf.simulate(road, truck, speed_kmh=v, keep="envelope").max_deflection for v in (105.0, 25.0)
    )
    assert fast < slow


# --- convergence in dt ------------------------------------------------------------------------


@pytest.mark.parametrize(("hold", "order"), [("zero", 1.0), ("first", 2.0)])
def test_order_of_the_hold_in_dt(hold: Hold, order: float) -> None:
    """Halving dt halves the error of the zero-order hold and quarters that of the first-order one.

    At 72 km/h steps of 4, 2 and 1 ms meet every 4 ms; the reference goes by 0.125 ms. Hermite
    weights are smooth from element to element; a step of the force at entry falls on a clamp.
    """
    road = pf.Road(length=8.0)

    def history(dt: float, hold: Hold) -> Array:
        scheme = pf.Scheme.paper(weights="hermite", hold=hold, dt=dt)
        every = round(4e-3 / dt)
        return deflection(
            pf.simulate(road, single_axle(), speed_kmh=72.0, scheme=scheme, every=every)
        )

    reference = history(1.25e-4, "first")
    steps = (4e-3, 2e-3, 1e-3)
    errors = np.array([np.abs(history(dt, hold) - reference).max() for dt in steps])
    rates = np.log2(errors[:-1] / errors[1:])
    assert (np.abs(rates - order) < 0.2).all(), (errors, rates)


# --- what is kept -----------------------------------------------------------------------------


def test_envelope_is_the_extremes_of_the_history(nominal: pf.Result, rough_run: pf.Result) -> None:
    for result in (nominal, rough_run):
        history = deflection(result)
        np.testing.assert_array_equal(result.lowest, history.min(axis=0))
        np.testing.assert_array_equal(result.highest, history.max(axis=0))
        np.testing.assert_allclose(
            result.time_of_lowest, result.time[history.argmin(axis=0)], rtol=0, atol=1e-12
        )
        assert result.max_deflection == -history.min()


def test_keep_envelope_computes_the_same_and_keeps_no_history(
    road: pf.Road, truck: pf.Vehicle, rough: pf.Profile, rough_run: pf.Result
) -> None:
    lean = pf.simulate(road, truck, profile=rough, run_in=40.0, keep="envelope")
    assert lean.deflection is None
    assert lean.forces is None
    for name in ("x", "lowest", "highest", "time_of_lowest"):
        np.testing.assert_array_equal(getattr(lean, name), getattr(rough_run, name))


@pytest.mark.parametrize(
    ("keep", "kept"),
    [
        (["deflection"], (True, False)),
        (["tire_force"], (False, True)),
        (("deflection", "tire_force"), (True, True)),
        ([], (False, False)),
        ("envelope", (False, False)),
    ],
)
def test_keep(road: pf.Road, truck: pf.Vehicle, keep: Any, kept: tuple[bool, bool]) -> None:
    result = pf.simulate(road, truck, keep=keep)
    assert (result.deflection is not None, result.forces is not None) == kept
    assert ("deflection" in result.dataset, "tire_force" in result.dataset) == kept


@pytest.mark.parametrize("every", [1, 2, 3, 7, 256, 1708, 1709, 100_000])
def test_every_thins_the_histories_only(
    road: pf.Road, truck: pf.Vehicle, nominal: pf.Result, every: int
) -> None:
    thin = pf.simulate(road, truck, every=every)
    np.testing.assert_array_equal(thin.time, nominal.time[::every])
    np.testing.assert_array_equal(deflection(thin), deflection(nominal)[::every])
    np.testing.assert_array_equal(thin.lowest, nominal.lowest)
    assert thin.forces is not None
    assert nominal.forces is not None
    np.testing.assert_array_equal(thin.forces.time, thin.time)
    np.testing.assert_array_equal(thin.forces.force, nominal.forces.force[::every])
    np.testing.assert_array_equal(thin.forces.position, nominal.forces.position[::every])
    assert thin.dataset.sizes["time"] == thin.time.size


def test_stations_at_nodes_are_the_nodes(
    road: pf.Road, truck: pf.Vehicle, nominal: pf.Result
) -> None:
    result = pf.simulate(road, truck, stations=[12.5, 0.5, 25.0], every=3)
    nodes = [25, 1, 50]
    agree(deflection(result), deflection(nominal)[::3, nodes], 1e-12)
    np.testing.assert_array_equal(result.stations, [12.5, 0.5, 25.0])
    np.testing.assert_array_equal(result.lowest, nominal.lowest)


def test_stations_between_nodes_are_read_by_the_shape_functions() -> None:
    """A force in the middle of a symmetric road: the slope there is zero, so 3s² - 2s³ applies."""
    road = pf.Road(length=2.0)  # nodes at 0, 0.5, 1, 1.5, 2
    strip = road.strip(20.0, 65.0)
    transition = _core.Transition.of_strip(strip, 1e-3)
    places = np.array([0.75, 1.25, 1.0, 0.5])
    step = _core.Stepper(strip, transition, "linear", "zero", (["deflection"], False, places, 1))
    history = step.run(np.full((200, 1), 1.0), np.full((200, 1), 8e4))[0]
    agree(history[:, 0], history[:, 1], 1e-12)
    static = np.zeros(6)
    static[2] = -4e4
    u = np.linalg.solve(strip.stiffness, static)  # w1 th1 w2 th2 w3 th3
    n = [0.5, 0.5 / 8, 0.5, -0.5 / 8]
    late = step.run(np.full((3000, 1), 1.0), np.full((3000, 1), 8e4))[0][-1]
    assert late[0] == pytest.approx(float(np.dot(n, u[:4])), rel=1e-8)


def test_finer_stations_do_not_change_the_run(road: pf.Road, truck: pf.Vehicle) -> None:
    few = pf.simulate(road, truck, stations=[3.21])
    many = pf.simulate(road, truck, stations=[1.0, 3.21, 24.999])
    agree(deflection(many)[:, [1]], deflection(few), 1e-12)


def test_no_stations_at_all_is_not_an_odd_result(road: pf.Road, truck: pf.Vehicle) -> None:
    """An empty list keeps no history, or is refused; it does not make a result that breaks."""
    try:
        result = pf.simulate(road, truck, stations=[])
    except ValueError as error:
        assert "station" in str(error)  # noqa: PT017
        return
    assert result.dataset is not None
    assert result.summary()
    result.plot()


def test_run_of_a_scenario_is_simulate(
    road: pf.Road, truck: pf.Vehicle, rough: pf.Profile, rough_run: pf.Result
) -> None:
    again = pf.run(pf.Scenario(road=road, vehicle=truck, profile=rough, run_in=40.0))
    np.testing.assert_array_equal(deflection(again), deflection(rough_run))
    assert again.scenario == rough_run.scenario


# --- profiles in, forces out ------------------------------------------------------------------


def test_tire_forces_are_those_of_module_one(
    truck: pf.Vehicle, rough: pf.Profile, rough_run: pf.Result
) -> None:
    alone = pf.tire_forces(truck, rough, 65.0, run_in=40.0, distance=25.0 + truck.length)
    assert rough_run.forces is not None
    np.testing.assert_array_equal(rough_run.forces.force, alone.force)
    np.testing.assert_allclose(rough_run.forces.position, alone.position - 40.0, atol=1e-12)


def test_smooth_profile_is_no_profile(road: pf.Road, truck: pf.Vehicle, nominal: pf.Result) -> None:
    level = pf.simulate(road, truck, profile=pf.Profile.smooth(40.0))
    agree(deflection(level), deflection(nominal), 1e-11)


def test_lift_off_positions_are_on_the_road(road: pf.Road, truck: pf.Vehicle) -> None:
    awful = pf.Profile.iso8608("H", 80.0, seed=1)
    result = pf.simulate(road, truck, profile=awful, run_in=40.0, speed_kmh=90.0)
    assert result.forces is not None
    assert result.forces.lift_off
    for lift in result.forces.lift_off:
        column = result.forces.force[:, lift.axle - 1]
        first = int((column < 0.0).argmax())
        assert lift.position == pytest.approx(result.forces.position[first, lift.axle - 1])
    leaving = pf.simulate(road, truck, profile=awful, run_in=40.0, speed_kmh=90.0, lift_off=True)
    assert leaving.forces is not None
    assert leaving.forces.force.min() == 0.0
    assert not np.array_equal(deflection(leaving), deflection(result))


# --- inputs of other layouts, caches ----------------------------------------------------------


@pytest.mark.parametrize(
    "convert",
    [
        lambda a: np.asarray(a, dtype=np.float32),
        lambda a: np.asfortranarray(np.column_stack([a, a]))[:, 0],
        lambda a: np.repeat(a, 2)[::2],
        lambda a: a[::-1].copy()[::-1],
        lambda a: a.tolist(),
    ],
    ids=["float32", "column", "strided", "reversed", "list"],
)
def test_layout_of_the_profile_does_not_matter(
    convert: Callable[[Array], Any], road: pf.Road, truck: pf.Vehicle
) -> None:
    # Binary fractions, which single precision holds.
    x = np.arange(0.0, 64.0, 0.25)
    z = np.round(0.003 * np.sin(x) * 2**16) / 2**16
    plain = pf.simulate(road, truck, profile=pf.Profile(x, z), run_in=20.0)
    other = pf.simulate(road, truck, profile=pf.Profile(convert(x), convert(z)), run_in=20.0)
    np.testing.assert_array_equal(deflection(other), deflection(plain))


def test_whole_numbers_are_numbers(road: pf.Road, truck: pf.Vehicle, nominal: pf.Result) -> None:
    result = pf.simulate(
        road,
        truck,
        speed_kmh=65,
        temperature_c=20,
        stations=[12],
        every=np.int64(1),  # type: ignore[arg-type]
    )
    assert result.max_deflection == nominal.max_deflection
    profile = pf.Profile(np.arange(64), np.arange(64) % 2)
    assert np.isfinite(pf.simulate(road, truck, profile=profile).max_deflection)


def test_layout_of_the_loads_does_not_matter(truck: pf.Vehicle) -> None:
    strip = pf.Road(length=5.0).strip(20.0, 65.0)
    positions, forces = constant_forces(truck, 5.0, 65.0, 1e-3)
    forces = forces * np.linspace(0.5, 1.5, forces.shape[0])[:, np.newaxis]
    step = stepper(strip)
    plain = step.run(positions, forces)[0]
    conversions: list[Callable[[Array], Array]] = [
        np.asfortranarray,
        lambda a: np.repeat(np.repeat(a, 2, axis=0), 2, axis=1)[::2, 1::2],
    ]
    for convert in conversions:
        np.testing.assert_array_equal(step.run(convert(positions), convert(forces))[0], plain)


def test_loads_that_do_not_fit_are_refused(truck: pf.Vehicle) -> None:
    step = stepper(pf.Road(length=5.0).strip(20.0, 65.0))
    with pytest.raises(ValueError, match="axle forces has shape"):
        step.run(np.zeros((5, 2)), np.zeros((5, 3)))
    with pytest.raises(pf.SolverError, match="axle forces is not finite: NaN"):
        step.run(np.zeros((5, 1)), np.full((5, 1), np.nan))
    with pytest.raises(pf.SolverError, match="axle positions is not finite"):
        step.run(np.full((5, 1), np.inf), np.zeros((5, 1)))


def test_cold_warm_and_uncached_runs_are_identical(
    road: pf.Road, truck: pf.Vehicle, cache_folder: Path
) -> None:
    results = [pf.simulate(road, truck, cache=False)]
    assert not cache_folder.exists()
    results.append(pf.simulate(road, truck))  # computes and writes
    results.append(pf.simulate(road, truck))  # from memory
    forget_steppers()
    results.append(pf.simulate(road, truck))  # from the file
    for other in results[1:]:
        np.testing.assert_array_equal(deflection(other), deflection(results[0]))
        np.testing.assert_array_equal(other.lowest, results[0].lowest)


def test_cache_tells_roads_apart(truck: pf.Vehicle) -> None:
    """Every input that the matrices depend on changes the answer also when the cache is warm."""
    base: dict[str, Any] = {"road": pf.Road(length=6.0), "vehicle": truck}
    variants: list[dict[str, Any]] = [
        {},
        {"road": pf.Road(length=6.5)},
        {"road": pf.Road(length=6.0, ends="free")},
        {"road": pf.Road(length=6.0).with_asphalt(vma=20.0)},
        {"temperature_c": 21.0},
        {"speed_kmh": 66.0},
        {"scheme": pf.Scheme.paper(dt=2e-3)},
        {"scheme": pf.Scheme.paper(hold="first")},
        {"scheme": pf.Scheme.paper(weights="hermite")},
        {"scheme": pf.Scheme.paper(foundation="winkler")},
        {"scheme": pf.Scheme.paper(element_length=0.25)},
    ]
    warm = [pf.simulate(**base | changes).lowest.min() for changes in variants]
    cold = [pf.simulate(**base | changes, cache=False).lowest.min() for changes in variants]
    assert warm == cold
    assert len(set(warm)) == len(variants)


def test_road_can_be_changed_after_a_run(truck: pf.Vehicle) -> None:
    """What a run works out and remembers of a pavement is no field of it."""
    road = pf.Road(length=5.0)
    fresh = road.with_asphalt(vma=20.0)
    before = road.model_dump_json()
    pf.simulate(road, truck, keep="envelope")
    assert road.with_asphalt(vma=20.0) == fresh
    assert road.model_dump_json() == before
    assert road == pf.Road(length=5.0)


def test_progress_does_not_change_the_answer(
    road: pf.Road, truck: pf.Vehicle, nominal: pf.Result
) -> None:
    shown = pf.simulate(road, truck, progress=True)
    np.testing.assert_array_equal(deflection(shown), deflection(nominal))


@pytest.mark.parametrize("progress", [True, False])
def test_progress_of_tire_forces_is_asked_for_as_that_of_a_run(
    progress: bool, truck: pf.Vehicle, rough: pf.Profile, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[bool, str]] = []

    def bar(show: bool, what: str) -> AbstractContextManager[Callable[[int, int], None] | None]:
        asked.append((show, what))
        return progress_bar(show, what)

    monkeypatch.setattr("pavefem.forces.progress_bar", bar)
    forces = pf.tire_forces(truck, rough, progress=progress)
    assert asked == [(progress, "vehicle")]
    np.testing.assert_array_equal(forces.force, pf.tire_forces(truck, rough).force)


def test_defaults_are_those_of_a_scenario() -> None:
    """The signature of `simulate` restates them for its readers; here they are held together."""
    fields = pf.Scenario()
    for name, parameter in inspect.signature(pf.simulate).parameters.items():
        if name in pf.Scenario.model_fields and parameter.default is not parameter.empty:
            expected = getattr(fields, name)
            given = parameter.default
            assert (pf.Scheme.named(given) if name == "scheme" else given) == expected, name
