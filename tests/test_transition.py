"""Phi and Gamma of M u'' + C u' + K u = f (eqs. 9-12) against scipy and closed forms.

Goal: the matrix exponential to 1e-12 of its largest entry wherever scipy itself is that good, the
three forms of Gamma equal to 1e-10, the semigroup property, and errors that name the matrix.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracle import Array, exponential

import pavefem as pf

FORMS: tuple[Literal["stiffness", "state", "integral"], ...] = ("stiffness", "state", "integral")


def error(found: Array, expected: Array) -> float:
    """Largest difference over the largest entry."""
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def scaled_error(found: Array, expected: Array, dt: float) -> float:
    """Error with velocities counted in displacement per step, so that both halves weigh alike."""
    n = found.shape[0] // 2
    left = np.concatenate([np.ones(n), np.full(n, dt)])
    right = 1.0 / left if found.shape[1] == 2 * n else np.ones(found.shape[1])
    return error(left[:, None] * found * right, left[:, None] * expected * right)


@st.composite
def systems(draw: st.DrawFn) -> tuple[Array, Array, Array, float]:
    """Draw stable random systems of 1 to 6 unknowns, from soft to stiff against the time step."""
    n = draw(st.integers(1, 6))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))

    def positive(scale: float) -> Array:
        root = rng.normal(size=(n, n))
        return scale * (root @ root.T + n * np.eye(n)) / n

    mass = positive(10.0 ** draw(st.integers(-2, 4)))
    frequency = 10.0 ** draw(st.floats(-1.0, 2.0))
    stiffness = positive(float(np.trace(mass)) / n * frequency**2)
    damping = positive(float(np.trace(mass)) / n * frequency * draw(st.floats(0.0, 2.0)))
    # With (I - Phi) K^-1, a step far below 1/frequency costs digits: eps / (frequency dt)².
    dt = draw(st.floats(0.3, 3.0)) / frequency
    return mass, damping, stiffness, dt


@pytest.mark.parametrize("foundation", ["bars", "winkler"])
def test_nominal_road_against_scipy(road: pf.Road, foundation: Literal["bars", "winkler"]) -> None:
    strip = road.strip(20.0, 65.0, foundation=foundation)
    found = pf.transition(strip.mass, strip.damping, strip.stiffness, 1e-3)
    expected = exponential(strip.mass, strip.damping, strip.stiffness, 1e-3)
    assert found.phi.shape == (196, 196)
    assert found.gamma.shape == (196, 98)
    assert scaled_error(found.phi, expected[0], 1e-3) < 1e-12
    assert scaled_error(found.gamma, expected[1], 1e-3) < 1e-12
    # A second difference of the same exponential: one more factor of eps / (omega dt).
    assert scaled_error(found.ramp, expected[2], 1e-3) < 2e-11


def test_truck_against_scipy(truck: pf.Vehicle) -> None:
    matrices = truck.mass_matrix, truck.damping_matrix, truck.stiffness_matrix
    found = pf.transition(*matrices, 1e-3)
    for ours, theirs in zip(
        (found.phi, found.gamma, found.ramp), exponential(*matrices, 1e-3), strict=True
    ):
        assert scaled_error(ours, theirs, 1e-3) < 1e-12


@given(systems())
def test_random_systems_against_scipy(system: tuple[Array, Array, Array, float]) -> None:
    mass, damping, stiffness, dt = system
    found = pf.transition(mass, damping, stiffness, dt)
    expected = exponential(mass, damping, stiffness, dt)
    for ours, theirs in zip((found.phi, found.gamma, found.ramp), expected, strict=True):
        assert scaled_error(ours, theirs, dt) < 2e-12


@given(systems())
def test_forms_of_gamma_agree(system: tuple[Array, Array, Array, float]) -> None:
    mass, damping, stiffness, dt = system
    steps = [pf.transition(mass, damping, stiffness, dt, form=form) for form in FORMS]
    for step in steps[1:]:
        assert scaled_error(step.gamma, steps[0].gamma, dt) < 1e-10
        assert scaled_error(step.ramp, steps[0].ramp, dt) < 1e-10
        atol = 1e-12 * np.abs(step.phi).max()
        np.testing.assert_allclose(step.phi, steps[0].phi, rtol=0, atol=atol)


def test_forms_of_gamma_agree_on_the_nominal_road(road: pf.Road) -> None:
    strip = road.strip(20.0, 65.0)
    steps = [
        pf.transition(strip.mass, strip.damping, strip.stiffness, 1e-3, form=form) for form in FORMS
    ]
    for step in steps[1:]:
        assert scaled_error(step.gamma, steps[0].gamma, 1e-3) < 1e-10


@given(systems(), st.integers(2, 5))
def test_semigroup(system: tuple[Array, Array, Array, float], parts: int) -> None:
    """One step is several shorter ones: Phi(t + s) = Phi(t) Phi(s), and so for a held force."""
    mass, damping, stiffness, dt = system
    whole = pf.transition(mass, damping, stiffness, dt)
    part = pf.transition(mass, damping, stiffness, dt / parts)
    phi, gamma = np.eye(2 * mass.shape[0]), np.zeros_like(whole.gamma)
    for _ in range(parts):
        phi, gamma = part.phi @ phi, part.phi @ gamma + part.gamma
    assert scaled_error(phi, whole.phi, dt) < 1e-11
    assert scaled_error(gamma, whole.gamma, dt) < 1e-11


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.7])
@pytest.mark.parametrize("turns", [0.01, 0.3, 4.0])
def test_underdamped_oscillator(zeta: float, turns: float) -> None:
    """Any textbook: free vibration and step response of m = 3, f = 2 Hz."""
    m, w = 3.0, 4.0 * np.pi
    dt = turns / 2.0
    found = pf.transition([[m]], [[2 * zeta * w * m]], [[m * w**2]], dt)
    wd = w * np.sqrt(1 - zeta**2)
    decay, c, s = np.exp(-zeta * w * dt), np.cos(wd * dt), np.sin(wd * dt)
    phi = decay * np.array(
        [
            [c + zeta * w / wd * s, s / wd],
            [-(w**2) / wd * s, c - zeta * w / wd * s],
        ]
    )
    gamma = np.array([[1 - phi[0, 0]], [-phi[1, 0]]]) / (m * w**2)
    np.testing.assert_allclose(found.phi, phi, rtol=0, atol=1e-12 * w)
    np.testing.assert_allclose(found.gamma, gamma, rtol=0, atol=1e-12 / (m * w))


def test_overdamped_oscillator() -> None:
    """Roots -1 and -4: u = (4 e^-t - e^-4t) / 3 from a unit displacement."""
    found = pf.transition([[1.0]], [[5.0]], [[4.0]], 0.8)
    slow, fast = np.exp(-0.8), np.exp(-3.2)
    expected = np.array([[4 * slow - fast, slow - fast], [4 * (fast - slow), 4 * fast - slow]]) / 3
    np.testing.assert_allclose(found.phi, expected, rtol=0, atol=1e-14)


def test_critically_damped_oscillator() -> None:
    found = pf.transition([[2.0]], [[12.0]], [[18.0]], 0.4)
    decay = np.exp(-1.2)
    expected = decay * np.array([[1 + 1.2, 0.4], [-9 * 0.4, 1 - 1.2]])
    np.testing.assert_allclose(found.phi, expected, rtol=0, atol=1e-14)


def test_free_mass_needs_the_integral_form() -> None:
    """A mass alone: u = t²/2m under a unit force, t³/6 m dt under one that grows."""
    found = pf.transition([[4.0]], [[0.0]], [[0.0]], 0.5, form="integral")
    np.testing.assert_allclose(found.phi, [[1.0, 0.5], [0.0, 1.0]], atol=1e-15)
    np.testing.assert_allclose(found.gamma, [[0.03125], [0.125]], rtol=1e-14)
    np.testing.assert_allclose(found.ramp, [[0.25 / 24.0], [0.0625]], rtol=1e-14)
    for form in FORMS[:2]:
        with pytest.raises(pf.SolverError, match="singular"):
            pf.transition([[4.0]], [[0.0]], [[0.0]], 0.5, form=form)


def test_undamped_motion_keeps_its_energy(truck: pf.Vehicle) -> None:
    mass, stiffness = truck.mass_matrix, truck.stiffness_matrix
    step = pf.transition(mass, np.zeros_like(mass), stiffness, 1e-3)
    state = np.concatenate([np.linspace(-0.01, 0.01, 6), np.linspace(0.3, -0.2, 6)])

    def energy(y: Array) -> float:
        return float(y[6:] @ mass @ y[6:] + y[:6] @ stiffness @ y[:6]) / 2

    before = energy(state)
    for _ in range(2000):
        state = step.phi @ state
    assert energy(state) == pytest.approx(before, rel=1e-10)


def test_damped_motion_dies_out(road: pf.Road) -> None:
    strip = road.strip(20.0, 65.0)
    phi = pf.transition(strip.mass, strip.damping, strip.stiffness, 1e-3).phi
    assert np.abs(np.linalg.eigvals(phi)).max() < 1.0


def test_series_is_scaled_and_squared(road: pf.Road) -> None:
    """PHYSICS of the nominal road: a norm of some tens at 1 ms, which a bare series cannot sum."""
    strip = road.strip(20.0, 65.0)
    step = pf.transition(strip.mass, strip.damping, strip.stiffness, 1e-3)
    assert step.norm > 30.0
    assert step.squarings >= 4
    assert 10 <= step.terms <= 40
    assert step.dt == 1e-3


def test_layout_and_type_of_the_arrays_do_not_matter(truck: pf.Vehicle) -> None:
    rng = np.random.default_rng(5)
    n = 4
    mass, damping, stiffness = (
        rng.integers(1, 5, (n, n)).astype(float) + 9.0 * (i + 1) * np.eye(n) for i in range(3)
    )
    # Not symmetric on purpose: a transposed copy would show.
    plain = pf.transition(mass, damping, stiffness, 0.1)
    conversions: list[Callable[[Array], Any]] = [
        np.asfortranarray,
        lambda m: m.astype(np.float32),
        lambda m: m.astype(np.int64),
        lambda m: np.kron(m, np.ones((2, 2)))[::2, ::2],
        lambda m: m[::-1, ::-1].copy()[::-1, ::-1],
        lambda m: m.tolist(),
    ]
    for convert in conversions:
        other = pf.transition(convert(mass), convert(damping), convert(stiffness), 0.1)
        np.testing.assert_array_equal(other.phi, plain.phi)
        np.testing.assert_array_equal(other.gamma, plain.gamma)
    expected = exponential(mass, damping, stiffness, 0.1)
    assert scaled_error(plain.phi, expected[0], 0.1) < 1e-12
    assert scaled_error(plain.gamma, expected[1], 0.1) < 1e-12


def two(**changes: object) -> dict[str, object]:
    matrices: dict[str, object] = {
        "mass": np.diag([1.0, 2.0]),
        "damping": np.diag([0.1, 0.1]),
        "stiffness": np.diag([5.0, 7.0]),
        "dt": 0.1,
    }
    return matrices | changes


@pytest.mark.parametrize(
    ("changes", "kind", "fragment"),
    [
        ({"mass": np.array([[1.0, 1.0], [1.0, 1.0]])}, pf.SolverError, "mass matrix is singular"),
        (
            {"stiffness": np.array([[1.0, -1.0], [-1.0, 1.0]]), "form": "stiffness"},
            pf.SolverError,
            "stiffness matrix is singular",
        ),
        ({"mass": np.diag([1.0, np.nan])}, pf.SolverError, "mass matrix is not finite: NaN"),
        ({"damping": np.diag([np.inf, 1.0])}, pf.SolverError, "damping matrix is not finite: inf"),
        ({"stiffness": np.diag([1.0, -np.inf])}, pf.SolverError, "stiffness matrix is not finite"),
        ({"mass": np.ones((2, 3))}, ValueError, "mass matrix has shape"),
        ({"damping": np.eye(3)}, ValueError, "damping matrix has shape"),
        ({"stiffness": np.eye(1)}, ValueError, "stiffness matrix has shape"),
        ({"mass": np.ones(2)}, ValueError, "mass has shape (2,)"),
        ({"dt": 0.0}, ValueError, "must be 1e-12 to 1e6"),
        ({"dt": -1.0}, ValueError, "must be 1e-12 to 1e6"),
        ({"dt": np.nan}, ValueError, "must be 1e-12 to 1e6"),
        ({"dt": 1e200}, ValueError, "must be 1e-12 to 1e6"),
        ({"form": "exact"}, ValueError, "form"),
        ({"mass": [["a", "b"], ["c", "d"]]}, ValueError, "could not convert string"),
    ],
)  # fmt: skip
def test_errors_name_the_matrix(
    changes: dict[str, object], kind: type[Exception], fragment: str
) -> None:
    with pytest.raises(kind, match=re.escape(fragment)):
        pf.transition(**two(**changes))  # type: ignore[arg-type]
