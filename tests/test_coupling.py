"""Two-way coupling: tires that feel the deflection they cause.

Goal: forces and deflections agree with those of vehicle and pavement as one system by another
integrator; on a road that hardly gives way they are those of one-way coupling, from which they
differ in proportion to its compliance; the cost of one-way coupling is stated, saved and loaded.
(The published sprung mass on a simply supported beam is in `rust/core/tests/coupling.rs`.)
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Run
from oracle import Array, DenseRoad, hermite, road_under, vehicle_matrices

import pavefem as pf

SPEED_KMH = 65.3
CONVERGED = pf.Scheme.converged(element_length=0.25)


def slopes(h: float, s: float) -> Array:
    """Derivatives of the shape functions along the element."""
    return np.array(
        [
            (6 * s**2 - 6 * s) / h,
            1 - 4 * s + 3 * s**2,
            (6 * s - 6 * s**2) / h,
            3 * s**2 - 2 * s,
        ]
    )


class OneSystem:
    """Vehicle and pavement in one set of equations."""

    def __init__(
        self,
        road: pf.Road,
        vehicle: pf.Vehicle,
        profile: pf.Profile,
        run_in: float,
        lift_off: bool = False,
    ) -> None:
        self.dense = DenseRoad.of(road, CONVERGED, 20.0, SPEED_KMH)
        self.speed = SPEED_KMH / 3.6
        self.offsets = vehicle.axle_positions
        self.profile, self.origin, self.lift_off = profile, profile.x[0] + run_in, lift_off
        mass, damping, stiffness, self.felt, self.loads = vehicle_matrices(vehicle)
        self.k = np.array([tire.stiffness for tire in vehicle.tires])
        self.c = np.array([tire.damping for tire in vehicle.tires])
        # The vehicle without its tires, whose forces are written out.
        self.damping = damping - self.felt.T @ np.diag(self.c) @ self.felt
        self.stiffness = stiffness - self.felt.T @ np.diag(self.k) @ self.felt
        self.inverse = np.linalg.inv(mass)
        at = np.ix_(self.dense.free, self.dense.free)
        self.pavement = [m[at] for m in (self.dense.damping, self.dense.stiffness)]
        self.pavement_inverse = np.linalg.inv(self.dense.mass[at])

    def shares(self, places: Array) -> tuple[Array, Array]:
        """Give the rows of the deflection under each axle, and of its slope."""
        nodes = self.dense.nodes
        rows = np.zeros((2, places.size, 2 * nodes.size))
        for i, x in enumerate(places):
            if 0.0 <= x <= nodes[-1]:
                j = min(int(np.searchsorted(nodes, x, side="right")), nodes.size - 1) - 1
                h = nodes[j + 1] - nodes[j]
                rows[0, i, 2 * j : 2 * j + 4] = hermite(h, (x - nodes[j]) / h)
                rows[1, i, 2 * j : 2 * j + 4] = slopes(h, (x - nodes[j]) / h)
        return rows[0][:, self.dense.free], rows[1][:, self.dense.free]

    def forces(self, time: float, state: Array) -> tuple[Array, Array, Array]:
        """Give the tire forces, their derivatives, and the rows of the deflection under them."""
        places = self.speed * time - self.offsets
        shape, slope = self.shares(places) if time >= 0.0 else self.shares(places - 1e3)
        k, c = self.k[:, np.newaxis], self.c[:, np.newaxis]
        derivative = np.hstack(
            [-k * self.felt, -c * self.felt, k * shape + c * self.speed * slope, c * shape]
        )
        point = np.zeros(places.size)
        z, velocity = road_under(self.profile, places + self.origin, point, self.speed)
        force = self.loads + self.k * z + self.c * velocity + derivative @ state
        if self.lift_off:
            derivative = np.where(force[:, np.newaxis] > 0.0, derivative, 0.0)
            force = np.maximum(force, 0.0)
        return force, derivative, shape

    def inner(self) -> Array:
        """Give the matrix of the system without its tires."""
        n, m = self.inverse.shape[0], self.pavement_inverse.shape[0]
        matrix = np.zeros((2 * (n + m), 2 * (n + m)))
        matrix[:n, n : 2 * n] = np.eye(n)
        matrix[n : 2 * n, :n] = -self.inverse @ self.stiffness
        matrix[n : 2 * n, n : 2 * n] = -self.inverse @ self.damping
        matrix[2 * n : -m, -m:] = np.eye(m)
        matrix[-m:, 2 * n : -m] = -self.pavement_inverse @ self.pavement[1]
        matrix[-m:, -m:] = -self.pavement_inverse @ self.pavement[0]
        return matrix

    def input(self, shape: Array) -> Array:
        """Give what a force on each axle's tires does to the rates: half of it a wheel track."""
        n, m = self.inverse.shape[0], self.pavement_inverse.shape[0]
        up = self.inverse @ self.felt.T
        down = -0.5 * self.pavement_inverse @ shape.T
        zeros = np.zeros((n, up.shape[1])), np.zeros((m, up.shape[1]))
        return np.vstack([zeros[0], up, zeros[1], down])

    def solve(self, start: float, times: Array, parts: int) -> tuple[Array, Array]:
        """Tire forces and the deflections under the axles, from rest, in parts of a step.

        By the two-stage Radau method of third order (Hairer and Wanner), by Newton's iteration.
        """
        inner = self.inner()
        size, n, m = inner.shape[0], self.inverse.shape[0], self.pavement_inverse.shape[0]
        # The static loads are carried by springs whose stretch counts as none.
        held = np.pad(self.inverse @ (self.felt.T @ self.loads), (n, size - 2 * n))
        dt = (times[1] - times[0]) / parts
        stages, inside = np.array([1 / 3, 1.0]), np.array([[5 / 12, -1 / 12], [3 / 4, 1 / 4]])

        def rates(time: float, state: Array) -> tuple[Array, Array]:
            force, derivative, shape = self.forces(time, state)
            pushed = self.input(shape)
            return inner @ state + pushed @ force - held, inner + pushed @ derivative

        def advance(time: float, state: Array) -> Array:
            slopes = np.tile(rates(time, state)[0], 2)
            for _ in range(20):
                states = state + dt * inside @ slopes.reshape(2, size)
                (f0, j0), (f1, j1) = map(rates, time + dt * stages, states)
                blocks = [[dt * inside[i, k] * j for k in range(2)] for i, j in enumerate((j0, j1))]
                change = np.linalg.solve(
                    np.eye(2 * size) - np.block(blocks), np.concatenate([f0, f1]) - slopes
                )
                slopes = slopes + change
                if np.abs(change).max() <= 1e-9 * np.abs(slopes).max():
                    return np.asarray(state + dt * inside[1] @ slopes.reshape(2, size))
            raise AssertionError("Newton's iteration has not settled")

        state = np.zeros(size)
        count = round(start / dt)
        forces, under = [], []
        for step in range(count, round(times[-1] / dt) + 1):
            time = step * dt
            if step >= 0 and step % parts == 0:
                force, _, shape = self.forces(time, state)
                forces.append(force)
                under.append(shape @ state[2 * n : -m])
            state = advance(time, state)
        return np.array(forces), np.array(under)


def waves(length: float, height: float = 4e-4) -> pf.Profile:
    """Give a rough profile that begins level, its samples at no places that axles stand on."""
    x = np.linspace(0.0, length, round(length / 0.00997))
    lengths = np.geomspace(0.6, 12.0, 24)
    phases = np.random.default_rng(3).uniform(0.0, 2 * np.pi, lengths.size)
    z = sum(
        height * wave**0.9 * np.sin(2 * np.pi * x / wave + phase)
        for wave, phase in zip(lengths, phases, strict=True)
    )
    return pf.Profile(x, np.sin(np.pi * np.minimum(x, 1.0) / 2.0) ** 2 * z)


def two_way(*arguments: Any, **options: Any) -> pf.Result:
    fixed: dict[str, Any] = {"scheme": CONVERGED, "speed_kmh": SPEED_KMH, "coupling": "two-way"}
    return pf.simulate(*arguments, **fixed | options)


def test_vehicle_and_pavement_as_one_system(truck: pf.Vehicle) -> None:
    """The paper's truck over rough road: second order in the step, 2e-4 of static at 1 ms."""
    coarse = 2e-3
    run_in = 56 * coarse * SPEED_KMH / 3.6
    road, profile = pf.Road(length=3.0), waves(20.0)
    runs = [
        two_way(
            road,
            truck,
            profile=profile,
            run_in=run_in,
            scheme=CONVERGED.model_copy(update={"dt": dt}),
        )
        for dt in (coarse, coarse / 2)
    ]
    times = runs[0].time
    system = OneSystem(road, truck, profile, run_in)
    forces, under = system.solve(-56 * coarse, times, 2)
    rms = []
    for step, run in enumerate(runs, start=1):
        assert run.forces is not None
        assert run.coupling is not None
        assert run.coupling.axle_deflection is not None
        error = (run.forces.force[::step] - forces[: times.size]) / truck.static_loads
        assert np.abs(error).max() < 8e-4 / step**2
        sunk = run.coupling.axle_deflection[::step] - under
        assert np.abs(sunk).max() < 2e-3 / step**2 * np.abs(under).max()
        rms.append(np.sqrt(np.mean(error**2)))
        # It is not the answer of one-way coupling.
        assert run.coupling.force_change.min() > 20 * np.abs(error).max()
    assert 3.0 < rms[0] / rms[1] < 5.0, rms


def quarter_car() -> pf.Vehicle:
    return pf.Vehicle(
        name="quarter car",
        bodies=[pf.Body(name="sprung", mass=9e3, x=0.0), pf.Body(name="axle", mass=1e3, x=0.0)],
        springs=[pf.Spring(upper="sprung", lower="axle", x=0.0, stiffness=8e5, damping=3e4)],
        tires=[pf.Tire(body="axle", x=0.0, stiffness=4e6, damping=4e3)],
    )


def test_a_wheel_that_leaves_the_road_as_one_system() -> None:
    """Over waves 8 times as high the tire flies and lands."""
    dt = 1e-3
    run_in = 112 * dt * SPEED_KMH / 3.6
    road, profile, vehicle = pf.Road(length=4.0), waves(20.0, 3e-3), quarter_car()
    run = two_way(road, vehicle, profile=profile, run_in=run_in, lift_off=True)
    assert run.forces is not None
    assert run.coupling is not None
    force = run.forces.force
    assert (force == 0.0).sum() > 30
    expected, _ = OneSystem(road, vehicle, profile, run_in, lift_off=True).solve(
        -112 * dt, run.time, 2
    )
    error = (force - expected) / vehicle.static_loads
    assert np.abs(error).max() < 3e-3
    assert np.sqrt(np.mean(error**2)) < 5e-4
    assert run.coupling.force_change.min() > 1e-2


# --- limits -----------------------------------------------------------------------------------


def scaled(factor: float) -> pf.Pavement:
    """Give a pavement whose mass, damping and stiffness are so many times the paper's."""
    paper = pf.Pavement.paper()
    names = (
        "moment_of_inertia",
        "element_mass",
        "beam_damping",
        "bar_mass",
        "bar_damping",
        "bar_rigidity",
        "asphalt_bar_stiffness",
    )
    return paper.model_copy(update={name: factor * getattr(paper, name) for name in names})


@pytest.mark.parametrize("lift_off", [False, True])
def test_a_road_that_hardly_gives_way(truck: pf.Vehicle, lift_off: bool) -> None:
    """The cost of one-way coupling is in proportion to the road's compliance, down to rounding."""
    profile = pf.Profile.iso8608("B", 60.0, seed=2)

    def run(factor: float) -> pf.Result:
        road = pf.Road(scaled(factor), length=10.0)
        return two_way(road, truck, profile=profile, run_in=20.0, lift_off=lift_off)

    stiff, stiffer, firm = (run(factor) for factor in (1e2, 1e4, 1e12))
    assert stiff.coupling is not None
    assert stiffer.coupling is not None
    assert firm.coupling is not None
    ratio = stiff.coupling.force_change / stiffer.coupling.force_change
    np.testing.assert_allclose(ratio, 100.0, rtol=2e-2)
    assert firm.coupling.force_change.max() < 1e-9
    assert abs(firm.coupling.deflection_change) < 1e-9


@pytest.mark.parametrize("interpolation", ["linear", "staircase"])
def test_lift_off_that_does_not_happen_changes_nothing(
    truck: pf.Vehicle, interpolation: Any
) -> None:
    profile = pf.Profile.iso8608("A", 60.0, seed=2)
    runs = [
        two_way(
            pf.Road(length=8.0),
            truck,
            profile=profile,
            run_in=20.0,
            interpolation=interpolation,
            lift_off=lift_off,
        )
        for lift_off in (False, True)
    ]
    forces = [run.forces.force for run in runs if run.forces is not None]
    assert forces[0].min() > 0.0
    tolerance = 1e-8 * truck.static_loads.max()
    np.testing.assert_allclose(forces[1], forces[0], rtol=0, atol=tolerance)


def test_on_a_smooth_road_the_vehicle_only_sinks(truck: pf.Vehicle) -> None:
    """A long uniform road gives way evenly: the forces of a vehicle that sinks are static."""
    result = two_way(pf.Road(length=150.0), truck, scheme=pf.Scheme.converged())
    assert result.forces is not None
    assert result.coupling is not None
    assert result.coupling.axle_deflection is not None
    front = result.forces.position[:, 0]
    settled = (front > 100.0) & (front < 145.0)
    forces = result.forces.force[settled] / truck.static_loads
    np.testing.assert_allclose(forces, 1.0, rtol=0, atol=1e-3)
    under = result.coupling.axle_deflection[settled]
    assert (under < -2e-4).all()
    assert (np.ptp(under, axis=0) < 1e-2 * np.abs(under).max(axis=0)).all()
    # It pressed and pulled as it came onto the road, which is what the cost is.
    assert result.coupling.force_change.max() > 1e-2


def test_the_deflection_under_an_axle_is_that_of_its_place(truck: pf.Vehicle) -> None:
    result = two_way(
        pf.Road(length=12.0), truck, scheme=pf.Scheme.converged(), stations=[5.2, 8.0], every=1
    )
    assert result.forces is not None
    assert result.coupling is not None
    assert result.coupling.axle_deflection is not None
    for station in (5.2, 8.0):
        history = result.history(station).to_numpy()
        for axle in range(3):
            place = result.forces.position[:, axle]
            found = np.interp(station, place, result.coupling.axle_deflection[:, axle])
            passing = np.interp(station, place, history)
            assert abs(found - passing) < 1e-2 * result.max_deflection
    off = (result.forces.position < 0.0) | (result.forces.position > 12.0)
    assert off.any()
    assert (result.coupling.axle_deflection[off] == 0.0).all()


def test_lightly_damped_axles_on_a_hot_road() -> None:
    """Axles of a semitrailer hop at little damping, and another compliance shifts their phase."""
    vehicle = pf.vehicles.semitrailer()
    profile = pf.Profile.iso8608("D", 160.0, seed=1)
    with pytest.warns(pf.ValidityWarning):
        result = two_way(
            pf.Road(length=60.0), vehicle, profile=profile, run_in=50.0, temperature_c=40.0
        )
    assert result.coupling is not None
    assert result.coupling.force_change.max() > 0.5
    assert result.coupling.iterations < 10


# --- what the result says ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def coupled(truck: pf.Vehicle, rough: pf.Profile) -> pf.Result:
    return two_way(pf.Road(length=10.0), truck, profile=rough, run_in=40.0, every=3)


def test_the_cost_is_the_difference_of_two_runs(
    coupled: pf.Result, truck: pf.Vehicle, rough: pf.Profile
) -> None:
    options: dict[str, Any] = {"scheme": CONVERGED, "speed_kmh": SPEED_KMH, "profile": rough}
    road = pf.Road(length=10.0)
    one_way = pf.simulate(road, truck, run_in=40.0, **options)
    two = pf.simulate(road, truck, run_in=40.0, coupling="two-way", **options)
    assert one_way.coupling is None
    assert "two-way coupling" not in one_way.summary()
    assert "force_change" not in one_way.dataset
    assert one_way.forces is not None
    assert two.forces is not None
    assert coupled.coupling is not None
    change = np.abs(two.forces.force - one_way.forces.force).max(axis=0) / truck.static_loads
    np.testing.assert_allclose(coupled.coupling.force_change, change, rtol=1e-12)
    change = two.max_deflection / one_way.max_deflection - 1.0
    assert coupled.coupling.deflection_change == pytest.approx(change, rel=1e-9)
    assert two.max_deflection == coupled.max_deflection


def test_dataset_has_units(coupled: pf.Result) -> None:
    dataset = coupled.dataset
    assert dataset["axle_deflection"].dims == ("time", "axle")
    assert dataset["axle_deflection"].shape == dataset["tire_force"].shape
    assert dataset["axle_deflection"].attrs["units"] == "m"
    assert dataset["force_change"].dims == ("axle",)
    for name in ("force_change", "deflection_change", "coupling_iterations"):
        assert dataset[name].attrs["units"] == "1"
        assert dataset[name].attrs["long_name"]
    line = coupled.summary()["two-way coupling"]
    assert "% of static" in line
    assert f"{100 * dataset['force_change'][1]:.2g}" in line


@pytest.mark.parametrize("keep", [["deflection", "tire_force"], "envelope"])
def test_a_file_holds_it(keep: Any, truck: pf.Vehicle, tmp_path: Path) -> None:
    result = two_way(pf.Road(length=6.0), truck, keep=keep)
    assert result.coupling is not None
    assert (result.coupling.axle_deflection is None) == (keep == "envelope")
    result.to_netcdf(tmp_path / "result.nc")
    loaded = pf.load_result(tmp_path / "result.nc")
    assert loaded.scenario.coupling == "two-way"
    assert loaded.coupling is not None
    assert loaded.summary() == result.summary()
    assert loaded.coupling.iterations == result.coupling.iterations
    assert loaded.dataset.identical(result.dataset)


def test_a_damaged_file_is_not_a_result(coupled: pf.Result, tmp_path: Path) -> None:
    path = tmp_path / "result.nc"
    coupled.dataset.drop_vars("deflection_change").to_netcdf(path, engine="h5netcdf")
    with pytest.raises(pf.FormatError, match="deflection_change"):
        pf.load_result(path)


def test_the_dense_solver_names_the_window(truck: pf.Vehicle) -> None:
    with pytest.raises(ValueError, match=r'coupling = "two-way".*solver="window"'):
        pf.simulate(pf.Road.paper(), truck, coupling="two-way")
    third = CONVERGED.model_copy(update={"order": 3})
    with pytest.raises(ValueError, match="order=2"):
        two_way(pf.Road.paper(), truck, scheme=third)
    with pytest.raises(ValueError, match="coupling"):
        pf.Scenario(coupling="both")


def test_a_store_couples_one_way(truck: pf.Vehicle, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match='coupling = "one-way"'):
        two_way(pf.Road(length=6.0), truck, keep=["tire_force"], store=tmp_path / "run.zarr")


def test_a_tire_print_feels_the_mean_deflection(truck: pf.Vehicle) -> None:
    """A print of 1 mm is a point; one of 0.3 m sinks less than a point load does."""
    found = []
    for tire_print in (0.0, 1e-3, 0.3):
        scheme = CONVERGED.model_copy(update={"tire_print": tire_print})
        coupling = two_way(pf.Road(length=6.0), truck, scheme=scheme).coupling
        assert coupling is not None
        assert coupling.axle_deflection is not None
        found.append(coupling.axle_deflection)
    point, short, long = found
    np.testing.assert_allclose(short, point, rtol=0, atol=1e-3 * np.abs(point).max())
    assert 0.7 < long.min() / point.min() < 0.95


def test_the_paper_scheme_by_the_window(truck: pf.Vehicle) -> None:
    """First order, on the paper's mesh: near the converged scheme's cost."""
    schemes = (pf.Scheme.paper(solver="window"), pf.Scheme.converged())
    found = [two_way(pf.Road.paper(), truck, scheme=scheme).coupling for scheme in schemes]
    paper, converged = (coupling for coupling in found if coupling is not None)
    np.testing.assert_allclose(paper.force_change, converged.force_change, rtol=0.1)


def test_command_line_and_scenario_file(pavefem: Run, tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text('coupling = "two-way"\n[scheme]\npreset = "converged"\n[road]\nlength = 6.0\n')
    assert pf.Scenario.from_toml(file).coupling == "two-way"
    assert "two-way coupling" in pavefem("run", str(file)).out
    short = ("--smooth", "--length", "6", "--coupling", "two-way")
    outcome = pavefem("run", *short, "--scheme", "converged", "--out", "both")
    assert outcome.code == 0, outcome.err
    assert "two-way coupling" in outcome.out
    assert pf.load_result(tmp_path / "both" / "result.nc").coupling is not None
    assert 'solver="window"' in pavefem("run", *short).error()
