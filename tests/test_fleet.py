"""Many vehicles at a time: the same numbers as one by one, whatever is kept and on any threads."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pavefem as pf

SPEEDS = [40.0, 55.5, 61.0, 72.0, 80.0, 90.0, 99.0]


def lorry(mass: float = 12_000.0, **changes: Any) -> pf.Vehicle:
    """Build a two-axle lorry, one of several kinds in a fleet."""
    return pf.Vehicle(
        name="lorry",
        bodies=[
            pf.Body(name="frame", mass=mass, x=2.6, pitch_inertia=45_000.0),
            pf.Body(name="front axle", mass=500.0, x=0.0),
            pf.Body(name="rear axle", mass=900.0, x=4.2),
        ],
        springs=[
            pf.Spring(
                upper="frame", lower="front axle", x=0.0, stiffness=4e5, damping=2e4, **changes
            ),
            pf.Spring(upper="frame", lower="rear axle", x=4.2, stiffness=8e5, damping=3e4),
        ],
        tires=[
            pf.Tire(body="front axle", x=0.0, stiffness=1.6e6, damping=2e3, print_length=0.25),
            pf.Tire(body="rear axle", x=4.2, stiffness=3.2e6, damping=4e3),
        ],
    )


@pytest.fixture(scope="module")
def fleet() -> list[pf.Vehicle]:
    """Give seven vehicles of three kinds: linear of 6 and 4 unknowns, and one that rubs."""
    trucks = [pf.vehicles.tandem_truck(payload=payload) for payload in (0.0, 6e3, 12e3)]
    rubbing = lorry(friction=pf.Friction(force=4e3, travel=2e-3))
    return [trucks[0], lorry(), trucks[1], rubbing, lorry(15_000.0), trucks[2], lorry(9_000.0)]


@pytest.fixture(scope="module")
def profile() -> pf.Profile:
    return pf.Profile.iso8608("B", 90.0, spacing=0.1, seed=5)


@pytest.mark.parametrize("interpolation", ["linear", "staircase"])
@pytest.mark.parametrize("threads", [1, 2, 5])
def test_a_fleet_is_its_vehicles(
    fleet: list[pf.Vehicle], profile: pf.Profile, interpolation: Any, threads: int
) -> None:
    stations = np.arange(22.0, 80.0, 0.77)
    dataset = pf.fleet_forces(
        fleet, profile, SPEEDS, run_in=20.0, every=3, stations=stations,
        interpolation=interpolation, threads=threads,
    )  # fmt: skip
    for number, (vehicle, speed) in enumerate(zip(fleet, SPEEDS, strict=True)):
        alone = pf.tire_forces(vehicle, profile, speed, run_in=20.0, interpolation=interpolation)
        one = dataset.isel(vehicle=number, axle=slice(len(vehicle.tires)))
        kept = one["tire_force"].dropna("time")
        np.testing.assert_array_equal(kept, alone.force[::3])
        np.testing.assert_array_equal(kept["time"], alone.time[::3])
        for axle, (force, place) in enumerate(zip(alone.force.T, alone.position.T, strict=True)):
            passing = np.interp(stations, place, force)
            np.testing.assert_allclose(one["station_force"][:, axle], passing, rtol=1e-9)
        found = [one[name] for name in ("mean_force", "std_force", "min_force", "max_force")]
        force = alone.force
        for ours, expected in zip(
            found, (force.mean(0), force.std(0), force.min(0), force.max(0)), strict=True
        ):
            np.testing.assert_allclose(ours, expected, rtol=1e-9)
        np.testing.assert_array_equal(one["static_load"], vehicle.static_loads)
        np.testing.assert_array_equal(one["lift_off_instants"], (force <= 0.0).sum(0))


def test_axles_that_are_not_there_are_nan(fleet: list[pf.Vehicle], profile: pf.Profile) -> None:
    dataset = pf.fleet_forces(fleet, profile, 80.0, stations=[50.0])
    missing = np.array([[len(v.tires) <= axle for axle in range(3)] for v in fleet])
    for name in ("static_load", "mean_force", "std_force", "lift_off_instants", "axle_offset"):
        np.testing.assert_array_equal(np.isnan(dataset[name]), missing)
    np.testing.assert_array_equal(np.isnan(dataset["station_force"][:, 0]), missing)


def test_dataset_is_labelled(fleet: list[pf.Vehicle], profile: pf.Profile) -> None:
    dataset = pf.fleet_forces(fleet, profile, SPEEDS, every=10, stations=[50.0, 60.0])
    assert dict(dataset.sizes) == {"vehicle": 7, "axle": 3, "station": 2, "time": 811}
    for name in ("static_load", "mean_force", "station_force", "tire_force"):
        assert dataset[name].attrs["units"] == "N"
    np.testing.assert_array_equal(dataset["speed_kmh"], SPEEDS)
    assert list(dataset["vehicle_name"].to_numpy()) == [vehicle.name for vehicle in fleet]


def test_statistics_alone_keep_no_histories(fleet: list[pf.Vehicle], profile: pf.Profile) -> None:
    dataset = pf.fleet_forces(fleet, profile, 80.0)
    assert "time" not in dataset.dims
    assert "station" not in dataset.dims


def test_lift_off_in_a_fleet(truck: pf.Vehicle) -> None:
    awful = pf.Profile.iso8608("F", 60.0, seed=2)
    dataset = pf.fleet_forces([truck, truck], awful, [60.0, 80.0], lift_off=True)
    assert (dataset["lift_off_instants"] > 0).all()
    assert (dataset["min_force"] == 0.0).all()


def test_stations_at_the_very_ends_are_passed(truck: pf.Vehicle, profile: pf.Profile) -> None:
    alone = pf.tire_forces(truck, profile, 72.0, run_in=10.0)
    ends = [10.0, float(alone.position[-1, -1])]
    dataset = pf.fleet_forces([truck], profile, 72.0, run_in=10.0, stations=ends)
    assert np.isfinite(dataset["station_force"]).all()
    assert dataset["station_force"][0, 0, 0] == alone.force[0, 0]
    assert dataset["station_force"][0, 1, -1] == alone.force[-1, -1]


@pytest.mark.parametrize(
    ("options", "fragment"),
    [
        ({"vehicles": []}, "at least one Vehicle"),
        ({"vehicles": pf.vehicles.tandem_truck()}, "sequence of at least one Vehicle"),
        ({"vehicles": ["lorry"]}, "vehicle is a str"),
        ({"profile": None}, "profile is a NoneType"),
        ({"speed_kmh": [50.0, 60.0]}, "one for each of 1 vehicles"),
        ({"speed_kmh": 0.0}, "speed_kmh"),
        ({"speed_kmh": [np.nan]}, "speed_kmh"),
        ({"dt": 0.0}, "dt = 0"),
        ({"every": 0}, "every = 0"),
        ({"every": 2.5}, "every = 2.5"),
        ({"threads": 0}, "threads = 0"),
        ({"stations": []}, "stations has shape (0,)"),
        ({"stations": [[1.0]]}, "stations has shape (1, 1)"),
        ({"stations": [1.0, np.inf]}, "places that are finite"),
        ({"stations": [89.0]}, "station 89 m is not passed by all axles: must be within 0 to 84"),
        ({"stations": [-1.0]}, "station -1 m is not passed by all axles"),
        ({"stations": [50.0, 40.0]}, "stations must increase"),
        ({"stations": [50.0, 50.0]}, "stations must increase"),
        ({"interpolation": "cubic"}, 'interpolation = "cubic"'),
        ({"tolerance": 0.0}, "tolerance"),
        ({"run_in": 90.0}, "run_in = 90 m"),
        ({"dt": 1e-7, "every": 1, "vehicles": [pf.vehicles.tandem_truck()] * 5}, "GiB"),
    ],
)
def test_what_is_refused(profile: pf.Profile, options: dict[str, Any], fragment: str) -> None:
    values: dict[str, Any] = {"vehicles": [pf.vehicles.tandem_truck()], "profile": profile}
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the message is checked below
        pf.fleet_forces(**values | options)
    assert fragment in str(caught.value)


def test_load_measures_of_a_fleet_are_those_of_its_vehicles(
    fleet: list[pf.Vehicle], profile: pf.Profile
) -> None:
    stations = np.arange(25.0, 80.0, 0.25)
    dataset = pf.fleet_forces(fleet, profile, SPEEDS, run_in=20.0, stations=stations)
    coefficients = pf.metrics.dlc(dataset)
    sharing = pf.metrics.load_sharing(dataset)
    aggregate = pf.metrics.aggregate_force(dataset)
    repeatability = pf.metrics.spatial_repeatability(dataset)
    for number, (vehicle, speed) in enumerate(zip(fleet, SPEEDS, strict=True)):
        alone = pf.tire_forces(vehicle, profile, speed, run_in=20.0)
        axles = slice(len(vehicle.tires))
        one = {"vehicle": number, "axle": axles}
        np.testing.assert_allclose(coefficients.isel(one), pf.metrics.dlc(alone), rtol=1e-9)
        np.testing.assert_allclose(sharing.isel(one), pf.metrics.load_sharing(alone), rtol=1e-9)
        by_itself = pf.metrics.aggregate_force(alone, stations)
        np.testing.assert_allclose(
            aggregate["ratio"].isel(vehicle=number), by_itself["ratio"], rtol=1e-9
        )
    assert repeatability.sizes == {"vehicle": 7, "other": 7}
    np.testing.assert_allclose(np.diag(repeatability), 1.0, rtol=1e-12)
