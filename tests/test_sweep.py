"""Sweeps: each point is the run of its own scenario, whoever evaluates it and however often."""

from __future__ import annotations

import asyncio
import hashlib
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import pavefem as pf
from pavefem.simulate import forces_on_road
from pavefem.studies import evaluate, evaluation, executors, fields, points, store
from pavefem.studies.points import plan_of

WINDOW = pf.Scheme.paper(solver="window")
AXES: dict[str, Any] = {
    "temperature_c": [10.0, 20.0, 30.0],
    "speed_kmh": [45.0, 65.0, 90.0],
    "axle_spacing": [1.1, 1.3, 2.2],
    "vma": [20.0, 25.0],
}
OUTPUTS = ["max_deflection", "rebound", "dlc", "max_force_2"]


@pytest.fixture(scope="module")
def profile() -> pf.Profile:
    return pf.Profile.iso8608("B", length=50.0, seed=1)


@pytest.fixture(scope="module")
def base(profile: pf.Profile) -> pf.Scenario:
    return pf.Scenario(scheme=WINDOW, profile=profile, run_in=20.0)


@pytest.fixture(scope="module")
def expected(base: pf.Scenario) -> xr.Dataset:
    """Give the sweep that others must repeat to the bit, by one thread."""
    return pf.sweep(base, **AXES, outputs=OUTPUTS, workers=1)


def swept(base: pf.Scenario, name: str, values: Any, **options: Any) -> xr.Dataset:
    """Sweep a field whose name is not known here."""
    options[name] = values
    return pf.sweep(base, **options)


def bump(length: float, name: str) -> pf.Profile:
    x = np.arange(0.0, 50.0, 0.1)
    return pf.Profile(x, 0.02 * np.exp(-(((x - 30.0) / length) ** 2)), name=name)


# --- fields -------------------------------------------------------------------------------------


def sections(base: pf.Scenario, **changes: Any) -> pf.Road:
    pavement = base.road.sections[0].pavement
    return pf.Road(pavement.model_copy(update=changes), length=25.0)


def truck(**options: Any) -> pf.Vehicle:
    return pf.vehicles.tandem_truck(**options)


def scaled(profile: pf.Profile | None, iri: float) -> pf.Profile:
    assert profile is not None
    return pf.Profile(profile.x, profile.z * (iri / profile.iri()), name=profile.name)


CHANGES: dict[str, tuple[Any, Callable[[pf.Scenario, Any], dict[str, Any]]]] = {
    "speed_kmh": (80.0, lambda base, v: {"speed_kmh": v}),
    "temperature_c": (5, lambda base, v: {"temperature_c": v}),
    "run_in": (12.5, lambda base, v: {"run_in": v}),
    "interpolation": ("staircase", lambda base, v: {"interpolation": v}),
    "lift_off": (True, lambda base, v: {"lift_off": v}),
    "vma": (17.0, lambda base, v: {"road": base.road.with_asphalt(vma=v)}),
    "asphalt.penetration_index": (
        0.5,
        lambda base, v: {"road": base.road.with_asphalt(penetration_index=v)},
    ),
    "bar_damping": (2e4, lambda base, v: {"road": sections(base, bar_damping=v)}),
    "pavement.spacing": (0.4, lambda base, v: {"road": sections(base, spacing=v)}),
    "asphalt": (
        pf.Asphalt(vma=14.0),
        lambda base, v: {"road": base.road.with_asphalt(vma=14.0)},
    ),
    "pavement": (
        pf.Pavement.paper(bar_mass=100.0),
        lambda base, v: {"road": sections(base, bar_mass=100.0)},
    ),
    "road.length": (20.0, lambda base, v: {"road": pf.Road(pf.Pavement.paper(), length=v)}),
    "ends": ("pinned", lambda base, v: {"road": pf.Road(pf.Pavement.paper(), 25.0, ends=v)}),
    "dt": (2e-3, lambda base, v: {"scheme": pf.Scheme.paper(solver="window", dt=v)}),
    "element_length": (
        0.25,
        lambda base, v: {"scheme": pf.Scheme.paper(solver="window", element_length=v)},
    ),
    "scheme": ("converged", lambda base, v: {"scheme": v}),
    "axle_spacing": (1.7, lambda base, v: {"vehicle": truck(axle_spacing=v)}),
    "vehicle.payload": (3e3, lambda base, v: {"vehicle": truck(payload=v)}),
    "rear_tires": ((5e6, 2e4), lambda base, v: {"vehicle": truck(rear_tires=v)}),
    "vehicle": (pf.vehicles.rigid_truck(), lambda base, v: {"vehicle": v}),
    "iri": (6.0, lambda base, v: {"profile": scaled(base.profile, v)}),
    "profile": (bump(0.8, "bump"), lambda base, v: {"profile": v}),
}  # fmt: skip


@pytest.mark.parametrize("name", CHANGES)
def test_a_point_is_the_run_of_its_scenario(base: pf.Scenario, name: str) -> None:
    value, change = CHANGES[name]
    found = swept(base, name, [value], outputs=["max_deflection", "rebound", "max_force"])
    run = pf.run(base.model_copy(update=change(base, value)))
    assert found.sizes == {name: 1}
    assert found["max_deflection"].item() == run.max_deflection
    assert found["rebound"].item() == run.rebound
    assert found["max_force"].item() == run.axles.highest.max()
    # The field had to do with the answer.
    assert run.max_deflection != pf.run(base).max_deflection


def test_all_fields_can_be_swept_at_once(base: pf.Scenario, expected: xr.Dataset) -> None:
    point = expected.sel(temperature_c=30.0, speed_kmh=90.0, axle_spacing=1.1, vma=20.0)
    run = pf.simulate(
        base.road.with_asphalt(vma=20.0), truck(axle_spacing=1.1), profile=base.profile,
        run_in=20.0, speed_kmh=90.0, temperature_c=30.0, scheme=WINDOW,
    )  # fmt: skip
    assert point["max_deflection"] == run.max_deflection
    assert point["rebound"] == run.rebound
    assert point["max_force_2"] == run.axles.highest[1]
    assert point["dlc"] == pytest.approx(pf.metrics.dlc(run).max().item(), rel=1e-12)


def test_the_nominal_case_has_the_numbers_of_the_model() -> None:
    """The paper's truck on its road: deflections to nine digits, from an independent program."""
    found = pf.sweep({}, speed_kmh=[65.0], outputs=["max_deflection", "mid_deflection"])
    assert found["max_deflection"].item() == pytest.approx(0.661134721e-3, rel=2e-9)
    assert found["mid_deflection"].item() == pytest.approx(0.643594386e-3, rel=2e-9)


def test_a_sweep_says_what_it_is_of(base: pf.Scenario, expected: xr.Dataset) -> None:
    assert list(expected.sizes.items()) == [(name, len(AXES[name])) for name in AXES]
    units = {name: expected[name].attrs["units"] for name in [*AXES, *OUTPUTS]}
    assert units == {
        "temperature_c": "°C", "speed_kmh": "km/h", "axle_spacing": "m", "vma": "%",
        "max_deflection": "m", "rebound": "m", "dlc": "1", "max_force_2": "N",
    }  # fmt: skip
    assert expected["vma"].attrs["field"] == "road.pavement.asphalt.vma"
    assert (expected["error"] == "").all() and (expected["warning"] == "").all()
    assert json.loads(expected.attrs["base"])["run_in"] == 20.0


def test_a_sweep_is_saved_as_any_dataset(expected: xr.Dataset, tmp_path: Path) -> None:
    expected.to_netcdf(tmp_path / "sweep.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "sweep.nc", engine="h5netcdf") as read:
        xr.testing.assert_identical(read.load().astype(expected.dtypes), expected)


def test_arguments_of_the_base_vehicle_stay(base: pf.Scenario) -> None:
    """Of those that built it, a sweep changes the swept ones only."""
    light = base.model_copy(update={"vehicle": truck(payload=2e3, wheelbase=4.8)})
    found = pf.sweep(light, axle_spacing=[1.2], outputs="max_force")
    other = truck(payload=2e3, wheelbase=4.8, axle_spacing=1.2)
    run = pf.run(base.model_copy(update={"vehicle": other}))
    assert found["max_force"].item() == run.axles.highest.max()


@pf.vehicles.builder
def tipper(load: float = 8e3, *, springs: Any = "air") -> pf.Vehicle:
    return pf.vehicles.rigid_truck(payload=load, suspension=springs)


def test_a_builder_of_ones_own(base: pf.Scenario) -> None:
    mine = base.model_copy(update={"vehicle": tipper(5e3)})
    found = pf.sweep(mine, load=[4e3, 6e3], springs=["steel", "air"], outputs="max_force")
    assert "units" not in found["load"].attrs
    run = pf.run(base.model_copy(update={"vehicle": tipper(6e3, springs="steel")}))
    assert found["max_force"].sel(load=6e3, springs="steel") == run.axles.highest.max()


def test_what_a_vehicle_remembers_is_no_part_of_it() -> None:
    made, same = tipper(5e3), pf.vehicles.rigid_truck(payload=5e3, suspension="air")
    assert made == same and hash(made) == hash(same)
    assert made.model_dump() == same.model_dump()
    assert made.made_by is not None and made.made_by.arguments == {"load": 5e3}
    assert made.model_copy(update={"name": "other"}).made_by is None


def test_a_scenario_file_is_a_base(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(
        '[vehicle]\npreset = "semitrailer"\npayload = 9e3\n[scheme]\nsolver = "window"\n'
    )
    scenario = pf.Scenario.from_toml(tmp_path / "s.toml")
    found = pf.sweep(scenario, suspension=["air", "steel"])
    same = pf.sweep(
        {"vehicle": {"preset": "semitrailer", "payload": 9e3}, "scheme": WINDOW},
        suspension=["air", "steel"],
    )
    xr.testing.assert_identical(found, same)
    run = pf.run(
        scenario.model_copy(update={"vehicle": pf.vehicles.semitrailer(payload=9e3)}),
        keep="envelope",
    )
    assert found["max_deflection"].sel(suspension="steel") == run.max_deflection


def test_every_section_of_a_road_is_changed(base: pf.Scenario) -> None:
    stiff, soft = pf.Pavement.paper(), pf.Pavement.paper(bar_rigidity=5e7)
    two = base.model_copy(update={"road": pf.Road(sections=[(stiff, 10.0), (soft, 15.0)])})
    found = pf.sweep(two, vma=[18.0])
    run = pf.run(two.model_copy(update={"road": two.road.with_asphalt(vma=18.0)}))
    assert found["max_deflection"].item() == run.max_deflection
    with pytest.warns(UserWarning, match="1 of 1 points failed"):
        failed = swept(two, "road.length", [20.0])
    assert "2 sections" in failed["error"].item()


def test_objects_are_known_by_their_names(base: pf.Scenario) -> None:
    found = pf.sweep(
        base.model_copy(update={"run_in": 0.0}),
        profile=[bump(0.5, "short"), None, bump(2.0, "long")],
        rear_tires=[(3.5e6, 1e4), (5e6, 1e4)],
    )
    assert found["profile"].to_numpy().tolist() == ["short", "none", "long"]
    assert found["rear_tires"].to_numpy().tolist() == [0, 1]
    flat = pf.run(base.model_copy(update={"profile": None, "run_in": 0.0}), keep="envelope")
    assert found["max_deflection"].sel(profile="none", rear_tires=0) == flat.max_deflection


def test_every_number_of_a_scenario_has_units() -> None:
    lines = [pf.Scenario(vehicle=make()) for make in pf.vehicles.PRESETS.values()]
    words = {"road", "vehicle", "profile", "scheme", "interpolation", "lift_off", "coupling",
             "pavement", "asphalt", "ends", "foundation", "weights", "hold", "solver", "order",
             "suspension", "front_suspension", "rear_suspension", "front_tires",
             "rear_tires"}  # fmt: skip
    known = {path.rpartition(".")[2] for base in lines for path in fields.known_paths(base)}
    assert known - words == set(fields.UNITS)


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        ({}, "no field is swept"),
        ({"temprature_c": [1.0]}, "temprature_c is no field .*near it: temperature_c"),
        ({"nothing_like_it": [1.0]}, "is no field of the scenario. Fields: road, vehicle,"),
        ({"asphalt": [pf.Asphalt()], "vma": [20.0]}, "asphalt and vma overlap"),
        ({"vma": [20.0], "asphalt.vma": [20.0]}, "vma and asphalt.vma overlap"),
        ({"vma": 20.0}, "vma = 20.0: must be a list of values"),
        ({"vma": "20"}, "vma = '20': must be a list"),
        ({"vehicle": pf.vehicles.rigid_truck()}, "must be a list of values"),
        ({"vma": {20.0, 25.0}}, "must be a list of values"),
        ({"vma": []}, "vma has no value"),
        ({"vma": [20.0, 25, 20]}, "has a value twice"),
        ({"vma": [20.0, np.nan]}, "vma has nan: must be finite"),
        ({"profile": [bump(1.0, "a"), bump(2.0, "a")]}, "must differ"),
        ({"vma": [20.0], "outputs": []}, "must be one or more"),
        ({"vma": [20.0], "outputs": ["dlc", "dlc"]}, "a name of its own"),
        ({"vma": [20.0], "outputs": "max_deflexion"}, "near it: max_deflection"),
        ({"vma": [20.0], "outputs": 3}, "must be names, functions"),
        ({"vma": [20.0], "outputs": [3]}, "output 3: must be a function"),
        ({"vma": [20.0], "outputs": [lambda result: 1.0]}, "has no name to call it by"),
        ({"vma": [20.0], "outputs": {"vma": "dlc"}}, "something else of that name"),
        ({"vma": [20.0], "outputs": {"error": "dlc"}}, "something else of that name"),
        ({"vma": [20.0], "keep": "all"}, "keep = 'all'"),
        ({"vma": [20.0], "workers": 0}, "workers = 0"),
        ({"vma": [20.0], "executor": "threads"}, "executor is a str: must be"),
    ],
)
def test_what_is_not_understood_is_said(
    base: pf.Scenario, axes: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        pf.sweep(base, **axes)


def test_a_name_of_two_fields_is_refused(base: pf.Scenario) -> None:
    @pf.vehicles.builder
    def odd(spacing: float = 1.3) -> pf.Vehicle:
        return truck(axle_spacing=spacing)

    mine = base.model_copy(update={"vehicle": odd()})
    with pytest.raises(ValueError, match=r"say road.pavement.spacing or vehicle.spacing"):
        pf.sweep(mine, spacing=[1.0, 2.0])
    found = swept(mine, "vehicle.spacing", [1.4], vma=[25.0])
    run = pf.run(base.model_copy(update={"vehicle": truck(axle_spacing=1.4)}))
    assert found["max_deflection"].item() == run.max_deflection


def test_a_vehicle_of_unknown_origin_says_so(base: pf.Scenario) -> None:
    vehicle = truck()
    plain = pf.Vehicle(bodies=vehicle.bodies, springs=vehicle.springs, tires=vehicle.tires)
    other = base.model_copy(update={"vehicle": plain})
    with pytest.raises(ValueError, match=r"'vehicle' was not built by .* Fields: road"):
        pf.sweep(other, axle_spacing=[1.3])
    assert pf.sweep(other, vma=[25.0])["max_deflection"].item() == pf.run(base).max_deflection


def test_a_builder_needs_names_for_its_arguments() -> None:
    with pytest.raises(ValueError, match="must have names of their own"):
        pf.vehicles.builder(lambda *weights: truck())
    with pytest.raises(ValueError, match="not a Vehicle"):
        pf.vehicles.builder(lambda: 3)()  # type: ignore[arg-type, return-value]


@pytest.mark.parametrize("profile", [None, pf.Profile.smooth(50.0)])
def test_what_has_no_roughness_is_not_scaled(profile: pf.Profile | None) -> None:
    with pytest.warns(UserWarning, match="1 of 1 points failed"):
        found = pf.sweep({"scheme": WINDOW, "profile": profile}, iri=[2.0])
    assert ("smooth" if profile else "no profile") in found["error"].item()


# --- outputs ------------------------------------------------------------------------------------


def dip(result: pf.Result) -> float:
    """Give the deflection at mid-length, of a result that has its history."""
    return float(result.history(12.5).min())


def test_outputs_by_name_and_by_function(base: pf.Scenario) -> None:
    run = pf.run(base)
    found = pf.sweep(
        base,
        vma=[25.0],
        outputs={
            "middle": "mid_deflection",
            "dip": dip,
            "first": "min_force_1",
            "all": "min_force",
        },
    )
    assert found["middle"].item() == run.mid_deflection == -found["dip"].item()
    assert found["middle"].attrs["units"] == "m" and "units" not in found["dip"].attrs
    assert found["first"].item() == run.axles.lowest[0]
    assert found["all"].item() == run.axles.lowest.min()


@pytest.mark.parametrize("axle", [1, 2, 3])
def test_dlc_is_that_of_the_metrics(base: pf.Scenario, axle: int) -> None:
    found = pf.sweep(base, vma=[25.0], outputs=f"dlc_{axle}")
    expected = pf.metrics.dlc(pf.run(base)).sel(axle=axle).item()
    assert found[f"dlc_{axle}"].item() == pytest.approx(expected, rel=1e-12)


def test_functions_find_the_histories_that_are_asked_for(base: pf.Scenario) -> None:
    def size(result: pf.Result) -> int:
        assert result.deflection is not None
        return len(result.deflection[0])

    def forces(result: pf.Result) -> bool:
        return result.forces is not None

    found = pf.sweep(base, vma=[25.0], outputs=[size, forces], stations=[6.0, 12.5, 18.0])
    assert (found["size"].item(), found["forces"].item()) == (3.0, 1.0)
    found = pf.sweep(base, vma=[25.0], outputs=[forces], keep=["deflection"])
    assert found["forces"].item() == 0.0
    # What a name stands for is kept, whatever is asked for.
    assert pf.sweep(base, vma=[25.0], outputs=["dlc"], keep="envelope")["dlc"].item() > 0.0


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda result: result.lowest, "bad has the shape"),
        (lambda result: 1j, "bad = 1j: must be real"),
        (lambda result: float("nan"), "bad = nan: must be finite"),
        (lambda result: 1.0 / 0.0, "ZeroDivisionError: float division by zero"),
        ("max_force_4", "there is no axle 4: the vehicle has 3"),
    ],
)
def test_an_output_without_a_value_fails_its_point(
    base: pf.Scenario, function: Any, message: str
) -> None:
    with pytest.warns(UserWarning, match="1 of 1 points failed"):
        found = pf.sweep(base, vma=[25.0], outputs={"bad": function, "good": "rebound"})
    assert message in found["error"].item()
    assert np.isnan(found["bad"].item()) and np.isnan(found["good"].item())


# --- failures and warnings ----------------------------------------------------------------------


def test_failed_points_say_why_and_the_rest_is_kept(base: pf.Scenario) -> None:
    with pytest.warns(UserWarning, match="2 of 6 points failed"):
        found = pf.sweep(base, temperature_c=[20.0, 65.0, 30.0], vma=[20.0, 25.0])
    failed = found["max_deflection"].isnull()
    assert failed.sum() == 2 and failed.sel(temperature_c=65.0).all()
    assert (failed == (found["error"] != "")).all()
    message = "ValueError: temperature_c = 65.0 degC: must be below the softening point, 60 degC"
    assert (found["error"].sel(temperature_c=65.0) == message).all()
    alone = pf.sweep(base, temperature_c=[30.0], vma=[25.0])
    assert found["max_deflection"].sel(temperature_c=30.0, vma=25.0) == alone["max_deflection"]


def test_what_a_field_refuses_is_told_in_a_line(base: pf.Scenario) -> None:
    with pytest.warns(UserWarning, match="points failed"):
        found = pf.sweep(base, vma=[2.0, 25.0])
    assert found["error"][0] == "ValidationError: vma: Input should be greater than 3 (given 2.0)"
    assert found["error"][1] == ""


@pytest.mark.parametrize("workers", [1, 3])
def test_warnings_belong_to_their_points(workers: int) -> None:
    """All that leave a law's range say so, not only the first of a process or of a pavement."""
    base = {"scheme": WINDOW, "road": {"pavement": {"reference_temperature_c": 45.0}}}
    with pytest.warns(pf.ValidityWarning, match="6 of 6 points use a law outside") as caught:
        found = pf.sweep(base, temperature_c=[20.0, 45.0], payload=[0.0, 6e3, 9e3], workers=workers)
    assert len(caught) == 1
    at_reference = "binder stiffness 1.079 MPa is outside"
    assert found["warning"].str.startswith(at_reference).all()
    # The pavement at its own temperature, and the same at that of its reference, is one message.
    assert len(set(found["warning"].to_numpy().ravel())) == 1
    assert (found["error"] == "").all()


# --- sharing ------------------------------------------------------------------------------------


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """Count what a sweep makes."""
    counts = {"forces": 0, "vehicles": 0}
    part = fields.changed_part

    def count_forces(*arguments: Any) -> pf.TireForces:
        counts["forces"] += 1
        return forces_on_road(*arguments)

    def count_part(base: pf.Scenario, name: str, changes: Any) -> Any:
        counts["vehicles"] += name == "vehicle"
        return part(base, name, changes)

    monkeypatch.setattr(points, "forces_on_road", count_forces)
    monkeypatch.setattr(points, "changed_part", count_part)
    return counts


def test_tire_forces_are_shared_where_only_the_pavement_differs(
    base: pf.Scenario, counted: dict[str, int], expected: xr.Dataset
) -> None:
    found = pf.sweep(base, **AXES, outputs=OUTPUTS, workers=1)
    xr.testing.assert_identical(found, expected)
    assert expected["dlc"].size == 54
    assert counted == {"forces": 9, "vehicles": 3}  # speeds times spacings, and spacings


def test_a_function_cannot_spoil_what_is_shared(base: pf.Scenario) -> None:
    def spoil(result: pf.Result) -> float:
        assert result.forces is not None
        result.forces.force[:] = 0.0
        return 0.0

    with pytest.warns(UserWarning, match="2 of 2 points failed"):
        found = pf.sweep(base, vma=[20.0, 25.0], outputs=spoil)
    assert "read-only" in found["error"][0].item()


@pytest.mark.parametrize(
    ("name", "values", "times"),
    [
        ("temperature_c", [10.0, 20.0], 1),
        ("asphalt", [pf.Asphalt(vma=20.0), pf.Asphalt()], 1),
        ("bar_mass", [100.0, 200.0], 1),
        ("ends", ["free", "pinned"], 1),
        ("element_length", [0.5, 0.25], 1),
        ("foundation", ["bars", "winkler"], 1),
        ("dt", [1e-3, 2e-3], 2),
        ("speed_kmh", [50.0, 60.0], 2),
        ("payload", [5e3, 6e3], 2),
        ("interpolation", ["linear", "staircase"], 2),
        ("scheme", ["converged", WINDOW], 2),
        ("length", [20.0, 25.0], 2),
        ("iri", [2.0, 3.0], 2),
        ("run_in", [15.0, 20.0], 2),
        ("lift_off", [True, False], 2),
    ],
)
def test_what_tire_forces_depend_on(
    base: pf.Scenario, counted: dict[str, int], name: str, values: list[Any], times: int
) -> None:
    found = swept(base, name, values, workers=1)
    assert counted["forces"] == times
    for number, value in enumerate(values):
        alone = swept(base, name, [value])
        assert alone["max_deflection"].item() == found["max_deflection"][number].item()


def test_dense_matrices_are_shared_where_only_the_vehicle_differs(
    profile: pf.Profile, monkeypatch: pytest.MonkeyPatch, cache_folder: Path
) -> None:
    dense = pf.Scenario(road=pf.Road(pf.Pavement.paper(), length=8.0), profile=profile)
    axes: dict[str, Any] = {"payload": [0.0, 5e3, 9e3], "temperature_c": [10.0, 30.0]}
    found = pf.sweep(dense, **axes, workers=1)
    assert len(list(cache_folder.glob("*.bin"))) == 2
    run = pf.run(dense.model_copy(update={"vehicle": truck(payload=5e3), "temperature_c": 30.0}))
    assert found["max_deflection"].sel(payload=5e3, temperature_c=30.0) == run.max_deflection
    # A study of many matrices keeps them in memory only: here, more than one.
    for path in cache_folder.glob("*.bin"):
        path.unlink()
    monkeypatch.setattr(points, "MOST_FILES", 1)
    built = len(list(cache_folder.glob("*")))
    xr.testing.assert_identical(pf.sweep(dense, **axes, workers=1), found)
    assert len(list(cache_folder.glob("*"))) == built == 0


def test_points_that_share_are_next_to_each_other(base: pf.Scenario) -> None:
    names = ["temperature_c", "speed_kmh"]
    rows = [(t, v) for t in (10.0, 20.0, 30.0) for v in (45.0, 65.0)]
    order = plan_of(base, names, "dlc").in_order(rows)
    assert [rows[i][1] for i in order] == [45.0] * 3 + [65.0] * 3
    assert sorted(order) == list(range(6))
    dense = base.model_copy(update={"scheme": "paper"})
    order = plan_of(dense, ["payload", "temperature_c"], "dlc").in_order(rows[::-1])
    assert [rows[::-1][i][1] for i in order] == [65.0] * 3 + [45.0] * 3


# --- a table of points --------------------------------------------------------------------------


def test_a_table_of_points_is_evaluated_row_by_row(base: pf.Scenario, tmp_path: Path) -> None:
    names = ["temperature_c", "iri", "payload"]
    table = np.random.default_rng(1).uniform([5.0, 1.0, 2e3], [35.0, 5.0, 1.2e4], (7, 3))
    table[3, 0] = 80.0
    found = evaluate(base, names, table, ["max_deflection", "dlc_1"], workers=2, store=tmp_path)
    assert found.values.shape == (7, 2)
    assert [error != "" for error in found.errors] == [i == 3 for i in range(7)]
    for row, values in zip(table, found.values, strict=True):
        if row[0] < 60.0:
            point = pf.sweep(
                base, temperature_c=[row[0]], iri=[row[1]], payload=[row[2]],
                outputs=["max_deflection", "dlc_1"],
            )  # fmt: skip
            assert values.tolist() == [point["max_deflection"].item(), point["dlc_1"].item()]
    again = evaluate(base, names, table, ["max_deflection", "dlc_1"], store=tmp_path)
    assert np.array_equal(again.values, found.values, equal_nan=True)
    with pytest.raises(ValueError, match="another study, of other iri"):
        evaluate(
            base, names, table + np.array([0, 1, 0]), ["max_deflection", "dlc_1"], store=tmp_path
        )


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([[1.0, 2.0]], "must have a column for each"),
        ([[np.inf]], "must be finite"),
        ([["20"]], "values must hold real numbers"),
        ([[20.0 + 1j]], "values must hold real numbers"),
        (np.ma.masked_array([[20.0], [30.0]], mask=[[False], [True]]), "got masked values"),
    ],
)
def test_a_table_of_another_shape_is_refused(base: pf.Scenario, values: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        evaluate(base, ["temperature_c"], values, "rebound")


@pytest.mark.parametrize("names", [None, "temperature_c", {"temperature_c", "vma"}, [5]])
def test_names_without_an_order_or_a_text_are_refused(base: pf.Scenario, names: Any) -> None:
    with pytest.raises(ValueError, match=r"names = .* in the order of columns|5 is no field"):
        evaluate(base, names, [[20.0]], "rebound")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"speed_kmh": np.array(60.0)}, r"speed_kmh has shape \(\): must be a list of values"),
        ({"speed_kmh": np.array([[60.0, 70.0]])}, r"speed_kmh has shape \(1, 2\)"),
        (
            {"speed_kmh": np.ma.masked_array([60.0, 70.0], mask=[False, True])},
            "speed_kmh has masked",
        ),
        ({"stations": 5.0, "outputs": {"f": len}}, "stations must be one-dimensional"),
        ({"stations": [], "outputs": {"f": len}}, "stations is empty"),
        ({"stations": [5.0]}, r"stations = \[5.0\]: for functions among the outputs"),
        ({"outputs": {1: "rebound"}}, "outputs has the name 1: must be text"),
        ({"outputs": {"": "rebound"}}, "outputs has the name '': must be text"),
    ],
)
def test_a_sweep_of_no_sense_is_refused_before_it_runs(
    base: pf.Scenario, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        pf.sweep(base, **{"speed_kmh": [60.0]} | options)


# --- the store ----------------------------------------------------------------------------------


@pytest.fixture
def evaluated(monkeypatch: pytest.MonkeyPatch) -> list[points.Row]:
    """List the points that are evaluated."""
    rows: list[points.Row] = []
    own = points.Plan.evaluate

    def record(self: points.Plan, row: points.Row, *rest: Any) -> points.Outcome:
        rows.append(row)
        return own(self, row, *rest)

    monkeypatch.setattr(points.Plan, "evaluate", record)
    return rows


@pytest.fixture
def often(monkeypatch: pytest.MonkeyPatch) -> None:
    """Write a chunk whenever there is something to write, and make batches small."""
    monkeypatch.setattr(store, "INTERVAL", -1.0)
    monkeypatch.setattr(executors, "BATCH", 0.02)
    monkeypatch.setattr(executors, "SHORTEST", 0.0)


@pytest.mark.usefixtures("often")
def test_an_interrupted_sweep_goes_on(
    base: pf.Scenario, expected: xr.Dataset, evaluated: list[points.Row], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr(points, "forces_on_road", interrupting(forces_on_road, 6))
    with pytest.raises(KeyboardInterrupt) as caught:
        pf.sweep(base, **AXES, outputs=OUTPUTS, store=tmp_path, workers=1)
    kept = sum(len(chunk_points(path)) for path in tmp_path.glob("chunk-*"))
    assert 0 < kept < 54
    note = f"{kept} of 54 points were done, and are kept in {tmp_path}"
    assert note in caught.value.__notes__[0]
    evaluated.clear()
    found = pf.sweep(base, **AXES, outputs=OUTPUTS, store=tmp_path, workers=2)
    assert len(evaluated) == 54 - kept
    xr.testing.assert_identical(found, expected)
    evaluated.clear()
    xr.testing.assert_identical(pf.sweep(base, **AXES, outputs=OUTPUTS, store=tmp_path), expected)
    assert evaluated == []


def interrupting(function: Callable[..., Any], calls: int) -> Callable[..., Any]:
    """Press Ctrl-C in a call of a function."""

    def call(*arguments: Any) -> Any:
        nonlocal calls
        calls -= 1
        if calls == 0:
            raise KeyboardInterrupt
        return function(*arguments)

    return call


def chunk_points(path: Path) -> list[Any]:
    return list(json.loads(path.read_text().partition("\n")[2])["points"])


def test_without_a_store_an_interrupt_says_what_is_lost(
    base: pf.Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(points, "forces_on_road", interrupting(forces_on_road, 1))
    with pytest.raises(KeyboardInterrupt) as caught:
        pf.sweep(base, **AXES, workers=1)
    assert "0 of 54 points were done, and are lost: store=folder" in caught.value.__notes__[0]


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-20])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def forge(path: Path) -> None:
    """Put in a chunk that is sound, but of another study."""
    body = json.dumps({"study": "0" * 32, "points": chunk_points(path)}).encode()
    path.write_bytes(store._checksum(body).encode() + b"\n" + body)


@pytest.mark.usefixtures("often")
@pytest.mark.parametrize("damage", [flip, cut, empty, forge])
def test_a_damaged_chunk_is_done_again(
    base: pf.Scenario, expected: xr.Dataset, evaluated: list[points.Row], tmp_path: Path,
    damage: Callable[[Path], None],
) -> None:  # fmt: skip
    pf.sweep(base, **AXES, outputs=OUTPUTS, store=tmp_path, workers=1)
    chunks = sorted(tmp_path.glob("chunk-*"))
    assert len(chunks) > 3
    lost = len(chunk_points(chunks[1])) + len(chunk_points(chunks[-1]))
    damage(chunks[1])
    damage(chunks[-1])
    evaluated.clear()
    with pytest.warns(UserWarning, match="2 damaged chunks deleted"):
        found = pf.sweep(base, **AXES, outputs=OUTPUTS, store=tmp_path, workers=1)
    assert len(evaluated) == lost
    xr.testing.assert_identical(found, expected)
    evaluated.clear()
    pf.sweep(base, **AXES, outputs=OUTPUTS, store=tmp_path, workers=1)
    assert evaluated == []


@pytest.mark.parametrize(
    "outcome",
    [
        [[None], "", ""],
        [["3"], "", ""],
        [[float("nan")], "", ""],
        [{"a": 1.0}, "", ""],
        [[], 5, ""],
    ],
)
def test_points_that_are_no_outcomes_are_done_again(
    base: pf.Scenario, tmp_path: Path, outcome: list[Any]
) -> None:
    expected = pf.sweep(base, speed_kmh=[60.0], store=tmp_path)
    [chunk] = tmp_path.glob("chunk-*")
    data = json.loads(chunk.read_bytes().partition(b"\n")[2])
    body = json.dumps(data | {"points": [[0, *outcome]]}).encode()
    checksum = hashlib.blake2b(body, digest_size=16).hexdigest()
    chunk.write_bytes(checksum.encode() + b"\n" + body)
    with pytest.warns(UserWarning, match="1 damaged chunks deleted"):
        found = pf.sweep(base, speed_kmh=[60.0], store=tmp_path)
    xr.testing.assert_identical(found, expected)


def test_failures_and_warnings_are_kept(
    base: pf.Scenario, evaluated: list[points.Row], tmp_path: Path
) -> None:
    def sweep() -> xr.Dataset:
        with pytest.warns(UserWarning, match="1 of 3 points") as caught:
            found = pf.sweep(base, temperature_c=[20.0, 65.0, 45.0], store=tmp_path)
        assert len(caught) == 2
        return found

    first = sweep()
    evaluated.clear()
    xr.testing.assert_identical(sweep(), first)
    assert evaluated == []
    assert [bool(text) for text in first["error"].to_numpy()] == [False, True, False]
    assert [bool(text) for text in first["warning"].to_numpy()] == [False, False, True]


@pytest.mark.parametrize(
    ("changes", "differs"),
    [
        ({"speed_kmh": [45.0, 65.0, 91.0]}, "speed_kmh"),
        ({"speed_kmh": [65.0, 45.0, 90.0]}, "speed_kmh"),
        ({"outputs": ["rebound"]}, "outputs"),
        ({"keep": "envelope"}, ""),
        ({"base": {"run_in": 19.0}}, "base"),
        ({"base": {"vehicle": truck(payload=1.0)}}, "base, vehicle"),
        ({"base": {"profile": pf.Profile.iso8608("B", length=50.0, seed=2)}}, "base"),
    ],
)
def test_the_store_of_another_sweep_is_refused(
    base: pf.Scenario, tmp_path: Path, changes: dict[str, Any], differs: str
) -> None:
    given = AXES | {"outputs": OUTPUTS, "store": tmp_path}
    first = pf.sweep(base, **given)
    other = base.model_copy(update=changes.get("base", {}))
    again = {name: value for name, value in changes.items() if name != "base"}
    if not differs:
        xr.testing.assert_identical(pf.sweep(other, **given | again), first)
        return
    with pytest.raises(ValueError, match=f"another study, of other {differs}: give another"):
        pf.sweep(other, **given | again)
    xr.testing.assert_identical(pf.sweep(base, **given), first)


def times(factor: float) -> Callable[[pf.Result], float]:
    def scaled(result: pf.Result) -> float:
        return factor * result.max_deflection

    return scaled


def test_a_store_knows_functions_by_code_and_values(base: pf.Scenario, tmp_path: Path) -> None:
    pf.sweep(base, vma=[25.0], outputs=times(2.0), store=tmp_path)
    pf.sweep(base, vma=[25.0], outputs=times(2.0), store=tmp_path)
    for other in (times(3.0), {"scaled": dip}, {"scaled": lambda result: 1.0}):
        with pytest.raises(ValueError, match="of other outputs"):
            pf.sweep(base, vma=[25.0], outputs=other, store=tmp_path)
    edited = {"a": lambda result: 1.0, "b": lambda result: 2.0}
    assert store.fingerprint(edited["a"]) != store.fingerprint(edited["b"])


def test_a_folder_of_other_files_is_no_store(base: pf.Scenario, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(ValueError, match=r"has files, but no study.json: give an empty folder"):
        pf.sweep(base, vma=[25.0], store=tmp_path)
    (tmp_path / "thesis.tex").unlink()
    # What is left of a write that did not end is none.
    (tmp_path / ".study.json.x.part").touch()
    pf.sweep(base, vma=[25.0], store=tmp_path)
    with pytest.raises(OSError, match="cannot write to the folder"):
        pf.sweep(base, vma=[25.0], store=tmp_path / "study.json")


def test_a_store_that_does_not_say_what_it_is(base: pf.Scenario, tmp_path: Path) -> None:
    pf.sweep(base, vma=[25.0], store=tmp_path)
    for text in ("{", "[]", '{"format": "pavefem study 1"}', '{"format": "2", "parts": {}}'):
        (tmp_path / "study.json").write_text(text)
        with pytest.raises(pf.FormatError, match=r"study\.json"):
            pf.sweep(base, vma=[25.0], store=tmp_path)


# --- executors ----------------------------------------------------------------------------------


class Backwards(Executor):
    """Does nothing until all is handed over that will be, and the last first."""

    def __init__(self) -> None:
        self.batches: list[int] = []
        self._waiting: list[tuple[Future[Any], Any, Any]] = []
        self._timer: threading.Timer | None = None

    def submit(self, function: Any, /, *arguments: Any, **options: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self._waiting.append((future, function, arguments))
        if self._timer is not None:
            self._timer.cancel()
        self._timer = threading.Timer(0.05, self._work)
        self._timer.start()
        return future

    def _work(self) -> None:
        waiting, self._waiting = self._waiting[::-1], []
        for future, function, arguments in waiting:
            batch = function(*arguments)
            self.batches.append(len(batch.outcomes))
            future.set_result(batch)


def test_batches_and_order_do_not_matter(
    base: pf.Scenario, expected: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    for seconds in (1e-9, 0.02, 100.0):
        monkeypatch.setattr(executors, "BATCH", seconds)
        backwards = Backwards()
        found = pf.sweep(base, **AXES, outputs=OUTPUTS, executor=backwards, workers=3)
        xr.testing.assert_identical(found, expected)
        assert sum(backwards.batches) == 54
        assert (max(backwards.batches) == 1) == (seconds < 1e-6)


def test_a_batch_takes_about_a_second() -> None:
    size = executors._batch_size
    assert size(np.inf, 10_000, 2) == 1  # nothing is known yet
    assert size(0.002, 10_000, 2) == 500
    assert size(5.0, 10_000, 2) == 1
    assert size(0.002, 400, 2) == 100  # towards the end all workers get a share
    assert size(0.002, 10, 2) == 25  # of some size


@pytest.mark.parametrize("workers", [2, 5])
def test_threads_answer_the_same(base: pf.Scenario, expected: xr.Dataset, workers: int) -> None:
    xr.testing.assert_identical(pf.sweep(base, **AXES, outputs=OUTPUTS, workers=workers), expected)
    with ThreadPoolExecutor(workers) as executor:
        found = pf.sweep(base, **AXES, outputs=OUTPUTS, executor=executor)
        xr.testing.assert_identical(found, expected)
        assert executor.submit(int).result() == 0  # it is still the user's


def spawned(workers: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))


class Once:
    """Does something in the first process that comes by, at one point of a sweep."""

    def __init__(self, flag: Path, what: int) -> None:
        self.flag, self.what, self.__name__ = flag, what, "once"

    def __repr__(self) -> str:
        return f"Once({self.flag})"

    def __call__(self, result: pf.Result) -> float:
        """Die at 65 km/h and 30 °C, the first time."""
        here = (result.scenario.speed_kmh, result.scenario.temperature_c) == (65.0, 30.0)
        if here and not self.flag.exists():
            self.flag.touch()
            os.kill(os.getpid(), self.what)
        return result.max_deflection


def test_processes_answer_the_same_and_what_breaks_them_loses_nothing(
    base: pf.Scenario, expected: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store, "INTERVAL", -1.0)
    folder = tmp_path / "store"
    outputs: Any = {"max_deflection": Once(tmp_path / "flag", signal.SIGKILL), "dlc": "dlc"}
    given = AXES | {"outputs": outputs, "store": folder}
    with (
        pytest.raises(pf.SweepError, match="the executor failed, BrokenProcessPool") as caught,
        spawned(2) as executor,
    ):
        pf.sweep(base, **given, executor=executor)
    kept = sum(len(chunk_points(path)) for path in folder.glob("chunk-*"))
    assert f"{kept} of 54 points were done, and are kept in {folder}" in str(caught.value)
    assert 0 < kept < 54
    found = pf.sweep(base, **given)  # the rest, by threads of this process
    for name in ("max_deflection", "dlc", "error", "warning"):
        xr.testing.assert_equal(found[name], expected[name])


def test_a_broken_executor_says_so(base: pf.Scenario) -> None:
    executor = ThreadPoolExecutor(1)
    executor.shutdown()
    with pytest.raises(pf.SweepError, match="0 of 2 points were done, and are lost"):
        pf.sweep(base, vma=[20.0, 25.0], executor=executor)


class Failing(Executor):
    """Cancels what is handed over, as a cluster that goes away does, but for one batch."""

    def __init__(self) -> None:
        self.done = 0

    def submit(self, function: Any, /, *arguments: Any, **options: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if self.done == 0:
            future.set_result(function(*arguments))
        else:
            future.cancel()
            future.set_running_or_notify_cancel()
        self.done += 1
        return future


def test_what_is_done_when_an_executor_gives_up_is_kept(
    base: pf.Scenario, evaluated: list[points.Row], tmp_path: Path
) -> None:
    given: dict[str, Any] = {"vma": [20.0, 22.0, 25.0], "store": tmp_path}
    with pytest.raises(pf.SweepError, match="CancelledError; 1 of 3 points were done, and are kep"):
        pf.sweep(base, **given, executor=Failing(), workers=1)
    evaluated.clear()
    xr.testing.assert_identical(pf.sweep(base, **given), pf.sweep(base, vma=given["vma"]))
    assert len(evaluated) == 2 + 3


def test_progress_counts_points(
    base: pf.Scenario, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    told: list[tuple[bool, int, int]] = []

    @contextmanager
    def bar(show: bool, _: str) -> Iterator[Callable[[int, int], None]]:
        yield lambda done, total: told.append((show, done, total))

    monkeypatch.setattr(evaluation, "progress_bar", bar)
    pf.sweep(base, temperature_c=[20.0, 21.0, 22.0], progress=True, workers=1)
    done = [count for _, count, _ in told]
    assert done == sorted(done) and told[-1] == (True, 3, 3) and len(told) == 3


def test_what_cannot_be_sent_is_refused(base: pf.Scenario) -> None:
    with spawned(1) as executor, pytest.raises(ValueError, match="cannot be sent to other proc"):
        pf.sweep(base, vma=[20.0], outputs={"a": lambda result: 1.0}, executor=executor)


def test_a_pool_that_forks_is_refused(base: pf.Scenario) -> None:
    context = multiprocessing.get_context("fork")
    with (
        ProcessPoolExecutor(1, mp_context=context) as executor,
        pytest.raises(ValueError, match=r"forks this process.*spawn"),
    ):
        pf.sweep(base, vma=[20.0], executor=executor)


def test_a_plan_is_opened_once_by_a_process(base: pf.Scenario) -> None:
    parcel = executors.Parcel.of(plan_of(base, ["payload"], "rebound"))
    other = executors.Parcel(bytes(bytearray(parcel.data)))
    assert parcel.open() is other.open()
    assert parcel.open().evaluate((5e3,)) == plan_of(base, ["payload"], "rebound").evaluate((5e3,))


def test_a_long_run_stops_when_it_is_no_longer_wanted() -> None:
    long = {"road": {"length": 30_000.0}, "scheme": "converged"}
    pool = executors.Threads(plan_of(long, ["vma"], "rebound"), 1)
    future = pool.submit([(20.0,)])
    time.sleep(1.0)
    assert not future.done()
    closed = time.monotonic()
    pool.close()
    assert isinstance(future.exception(timeout=60.0), executors._Stopped)
    assert time.monotonic() - closed < 1.5


INTERRUPTED = """
import signal, sys, time, pavefem as pf
# A shell's background process, and so its children, would ignore it.
signal.signal(signal.SIGINT, signal.default_int_handler)
def slow(result):
    time.sleep(0.02)
    return result.max_deflection
if __name__ == "__main__":
    pf.sweep({"scheme": {"solver": "window"}}, temperature_c=[i / 50 for i in range(1000)],
             outputs=slow, store=sys.argv[1])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_ends_a_sweep_and_keeps_what_is_done(tmp_path: Path) -> None:
    script, folder = tmp_path / "script.py", tmp_path / "store"
    script.write_text(INTERRUPTED)
    process = subprocess.Popen(
        [sys.executable, str(script), str(folder)],
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )
    try:
        limit = time.monotonic() + 60.0
        while not list(folder.glob("chunk-*")) and time.monotonic() < limit:
            time.sleep(0.05)
        pressed = time.monotonic()
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=30.0)
        took = time.monotonic() - pressed
    finally:
        process.kill()
    kept = sum(len(chunk_points(path)) for path in folder.glob("chunk-*"))
    assert 0 < kept < 1000
    assert "KeyboardInterrupt" in told and f"{kept} of 1000 points were done" in told
    assert took < 5.0  # half the sweep; a second, and the end of the process


# --- Dask ---------------------------------------------------------------------------------------


@pytest.fixture
def client() -> Iterator[Any]:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.mark.filterwarnings("default")
def test_a_dask_cluster_answers_the_same_with_a_worker_killed_half_way(
    base: pf.Scenario, expected: xr.Dataset, client: Any, tmp_path: Path
) -> None:
    before = set(client.run(os.getpid).values())
    once = Once(tmp_path / "flag", signal.SIGKILL)
    outputs: Any = {"max_deflection": once, "dlc": "dlc"}
    found = pf.sweep(base, **AXES, outputs=outputs, executor=client)
    assert (tmp_path / "flag").exists()
    assert len(before - set(client.run(os.getpid).values())) == 1  # it is gone
    for name in ("max_deflection", "dlc", "error", "warning"):
        xr.testing.assert_equal(found[name], expected[name])
    # What a point raises, there as here, is the point's.
    with pytest.warns(UserWarning, match="1 of 2 points failed"):
        failed = pf.sweep(
            base, temperature_c=[20.0, 65.0], outputs={"c": lambda r: 2.0}, executor=client
        )
    assert failed["c"][0] == 2.0 and "softening point" in failed["error"][1].item()

    async def refused() -> None:
        async with type(client)(client.cluster.scheduler_address, asynchronous=True) as other:
            with pytest.raises(ValueError, match="asynchronous"):
                pf.sweep(base, vma=[20.0], executor=other)

    asyncio.run(refused())
