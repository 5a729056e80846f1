"""Results: what the dataset says of itself, files that come back identical, summaries and plots."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import pavefem as pf
from pavefem import plotting

PNG = b"\x89PNG\r\n\x1a\n"

Keep = dict[str, Any]
KEEPS: dict[str, Keep] = {
    "all": {},
    "envelope": {"keep": "envelope"},
    "deflection": {"keep": ["deflection"]},
    "tire force": {"keep": ["tire_force"]},
    "stations": {"stations": [5.0, 12.6]},
    "stations alone": {"keep": ["deflection"], "stations": [12.6]},
    "thinned": {"every": 7},
}


@pytest.fixture(params=KEEPS)
def any_result(
    request: pytest.FixtureRequest, road: pf.Road, truck: pf.Vehicle, rough: pf.Profile
) -> tuple[str, pf.Result]:
    """Give a rough run for each way of keeping."""
    keep = KEEPS[request.param]
    return request.param, pf.simulate(road, truck, profile=rough, run_in=40.0, **keep)


def identical(one: pf.Result, other: pf.Result) -> None:
    assert one.scenario == other.scenario
    for name in ("x", "lowest", "highest", "time_of_lowest", "time", "deflection", "stations"):
        ours, theirs = getattr(one, name), getattr(other, name)
        assert (ours is None) == (theirs is None), name
        if ours is not None:
            np.testing.assert_array_equal(ours, theirs, err_msg=name)
            assert ours.dtype == theirs.dtype
    assert (one.forces is None) == (other.forces is None)
    if one.forces is not None and other.forces is not None:
        for name in ("time", "position", "force", "static_loads"):
            np.testing.assert_array_equal(
                getattr(one.forces, name), getattr(other.forces, name), err_msg=name
            )
        assert one.forces.lift_off == other.forces.lift_off


# --- dataset ----------------------------------------------------------------------------------


def test_dataset_dimensions_and_units(rough_run: pf.Result) -> None:
    dataset = rough_run.dataset
    assert dataset["deflection"].dims == ("time", "x")
    assert dataset["tire_force"].dims == ("time", "axle")
    assert dict(dataset.sizes) == {
        "x": 51,
        "time": 1709,
        "axle": 3,
        "profile_station": rough_run.scenario.profile.x.size,  # type: ignore[union-attr]
    }
    units = {
        "x": "m",
        "time": "s",
        "lowest": "m",
        "highest": "m",
        "time_of_lowest": "s",
        "peak_deflection": "m",
        "deflection": "m",
        "tire_force": "N",
        "axle_position": "m",
        "static_load": "N",
        "min_force": "N",
        "max_force": "N",
        "profile_station": "m",
        "profile_elevation": "m",
    }
    assert set(dataset.variables) == {*units, "axle"}
    assert {name: dataset[name].attrs["units"] for name in units} == units
    assert dataset["deflection"].attrs["positive"] == "up"


def test_dataset_holds_every_input(rough_run: pf.Result) -> None:
    attributes = rough_run.dataset.attrs
    assert attributes["speed_kmh"] == 65.0
    assert attributes["temperature_c"] == 20.0
    assert attributes["max_deflection"] == rough_run.max_deflection
    assert attributes["pavefem_version"] == pf.__version__
    scenario = json.loads(attributes["scenario"])
    assert set(scenario) == set(pf.Scenario.model_fields)
    assert scenario["run_in"] == 40.0
    profile = rough_run.scenario.profile
    assert profile is not None
    np.testing.assert_array_equal(rough_run.dataset["profile_elevation"], profile.z)


def test_envelope_and_tire_forces_are_views_of_it(rough_run: pf.Result) -> None:
    assert set(rough_run.envelope.data_vars) == {"lowest", "highest", "time_of_lowest"}
    assert (rough_run.envelope["lowest"] <= rough_run.envelope["highest"]).all()
    assert rough_run.tire_forces.shape == (1709, 3)
    assert rough_run.tire_forces.attrs["units"] == "N"


def test_tire_forces_that_were_not_kept(road: pf.Road, truck: pf.Vehicle) -> None:
    with pytest.raises(ValueError, match='keep=\\["tire_force"'):
        _ = pf.simulate(road, truck, keep="envelope").tire_forces


# --- histories --------------------------------------------------------------------------------


def test_history_at_a_node(nominal: pf.Result) -> None:
    history = nominal.history(x=12.5)
    assert isinstance(history, xr.DataArray)
    assert history.dims == ("time",)
    assert history.attrs["units"] == "m"
    assert float(history.min()) == nominal.lowest[25]
    assert float(history["x"]) == 12.5
    np.testing.assert_array_equal(history["time"], nominal.time)


def test_history_at_a_station(road: pf.Road, truck: pf.Vehicle) -> None:
    result = pf.simulate(road, truck, stations=[3.3, 12.6])
    assert result.deflection is not None
    np.testing.assert_array_equal(result.history(12.6), result.deflection[:, 1])
    with pytest.raises(ValueError, match=r"x = 12\.5 m, the nearest is at 12\.6 m"):
        result.history(12.5)


def test_history_where_none_was_kept(nominal: pf.Result, road: pf.Road, truck: pf.Vehicle) -> None:
    with pytest.raises(ValueError, match=r"x = 12\.6 m, the nearest is at 12\.5 m.*stations=\["):
        nominal.history(12.6)
    for place in (float("nan"), None, "5", True, [5.0], 10**400):
        with pytest.raises(ValueError, match="must be a finite number"):
            nominal.history(place)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"no history of \['moment'\] was kept"):
        nominal.history(5.0, ["moment"])  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="no history was kept"):
        nominal.history(-3.0)
    with pytest.raises(
        ValueError, match=r"no history of 'deflection' was kept.*keep=\['deflection'\]"
    ):
        pf.simulate(road, truck, keep="envelope").history(12.5)


# --- files ------------------------------------------------------------------------------------


def test_netcdf_round_trip(any_result: tuple[str, pf.Result], tmp_path: Path) -> None:
    _, result = any_result
    path = tmp_path / "result.nc"
    result.to_netcdf(path)
    back = pf.load_result(path)
    identical(result, back)
    assert back.max_deflection == result.max_deflection
    assert back.summary() == result.summary()
    assert [file.name for file in tmp_path.iterdir()] == ["result.nc"]


def test_round_trip_of_all_the_rest(truck: pf.Vehicle, tmp_path: Path) -> None:
    """Sections, free ends, another scheme, a profile with an odd name, lift-off."""
    road = pf.Road(
        sections=[(pf.Pavement.paper(), 3.3), (pf.Pavement.paper(pf.Asphalt(vma=20.0)), 5.0)],
        ends="free",
    )
    awful = pf.Profile.iso8608("H", 60.0, seed=1)
    profile = pf.Profile(awful.x + 100.0, awful.z, name='Straße "7", km 0.1')
    result = pf.simulate(
        road,
        truck,
        profile=profile,
        run_in=30.0,
        speed_kmh=80.0,
        temperature_c=25.5,
        scheme=pf.Scheme.converged(element_length=0.4, dt=2e-3),
        interpolation="staircase",
        lift_off=True,
    )
    assert result.forces is not None
    assert result.forces.lift_off
    result.to_netcdf(tmp_path / "all.nc")
    back = pf.load_result(str(tmp_path / "all.nc"))
    identical(result, back)
    assert back.scenario.profile is not None
    assert back.scenario.profile.name == 'Straße "7", km 0.1'
    identical(pf.run(back.scenario), result)


def test_a_file_opens_without_pavefem(nominal: pf.Result, tmp_path: Path) -> None:
    nominal.to_netcdf(tmp_path / "result.nc")
    with xr.open_dataset(tmp_path / "result.nc", engine="h5netcdf") as dataset:
        xr.testing.assert_identical(dataset.load(), nominal.dataset)


def test_writing_replaces_the_old_file(
    nominal: pf.Result, rough_run: pf.Result, tmp_path: Path
) -> None:
    path = tmp_path / "result.nc"
    nominal.to_netcdf(path)
    rough_run.to_netcdf(path)
    identical(pf.load_result(path), rough_run)


def test_failed_write_keeps_the_old_file_and_the_result(
    road: pf.Road, truck: pf.Vehicle, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = pf.simulate(road, truck)
    path = tmp_path / "result.nc"
    result.to_netcdf(path)
    before = path.read_bytes()

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(xr.Dataset, "to_netcdf", full)
        with pytest.raises(OSError, match="No space left"):
            result.to_netcdf(path)
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["result.nc"]
    assert result.max_deflection > 0.0
    result.to_netcdf(path)
    identical(pf.load_result(path), result)


def test_writing_into_no_folder(nominal: pf.Result, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        nominal.to_netcdf(tmp_path / "nowhere" / "result.nc")
    (tmp_path / "result").mkdir()
    with pytest.raises(OSError, match="result"):
        nominal.to_netcdf(tmp_path / "result")
    assert [file.name for file in tmp_path.iterdir()] == ["result"]


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:3000])


def _other_dataset(path: Path) -> None:
    path.unlink()
    xr.Dataset({"t": ("x", [1.0, 2.0])}).to_netcdf(path, engine="h5netcdf")


def _drop(name: str) -> Callable[[Path], None]:
    def change(path: Path) -> None:
        dataset = xr.load_dataset(path, engine="h5netcdf").drop_vars(name)
        dataset.to_netcdf(path, engine="h5netcdf")

    return change


def _scenario(text: str) -> Callable[[Path], None]:
    def change(path: Path) -> None:
        dataset = xr.load_dataset(path, engine="h5netcdf")
        dataset.attrs["scenario"] = text
        dataset.to_netcdf(path, engine="h5netcdf")

    return change


@pytest.mark.parametrize(
    "damage",
    [
        lambda path: path.write_bytes(b""),
        lambda path: path.write_bytes(b"not a netCDF file at all\n" * 50),
        lambda path: path.write_bytes(PNG + bytes(5000)),
        _cut,
        _other_dataset,
        _drop("lowest"),
        _drop("axle_position"),
        _scenario("{"),
        _scenario("[]"),
        _scenario('{"speed_kmh": -1}'),
        _scenario('{"colour": "red"}'),
    ],
    ids=[
        "empty", "text", "picture", "cut", "other dataset", "no lowest", "no positions",
        "broken json", "json list", "bad value", "unknown key",
    ],
)  # fmt: skip
def test_garbage_is_a_format_error(
    damage: Callable[[Path], object], nominal: pf.Result, tmp_path: Path
) -> None:
    path = tmp_path / "result.nc"
    nominal.to_netcdf(path)
    damage(path)
    with pytest.raises(pf.FormatError, match=r"not a (sound netCDF file|pavefem result)") as caught:
        pf.load_result(path)
    assert caught.value.path == str(path)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda d: d.assign_coords(time=d["time"] * np.nan), "time is not finite"),
        (lambda d: d.assign_coords(x=d["x"].astype(str)), "x is .*, expected float64"),
        (lambda d: d.isel(x=slice(0, 0)), "x is empty"),
        (lambda d: d.isel(time=slice(0, 0)), "time is empty"),
        (lambda d: d.assign_coords(station=d["station"] * np.nan), "station is not finite"),
        (lambda d: d.drop_vars("min_force"), "it has no min_force"),
        (
            lambda d: d.assign(moment=d["moment"].assign_attrs(units="kN m")),
            "moment has units 'kN m', expected 'N m'",
        ),
    ],
)
def test_damaged_coordinates_and_units_are_told(
    damage: Callable[[xr.Dataset], xr.Dataset],
    message: str,
    road: pf.Road,
    truck: pf.Vehicle,
    tmp_path: Path,
) -> None:
    scheme = pf.Scheme.paper(solver="window")
    found = pf.simulate(road, truck, scheme=scheme, keep=["moment"], stations=[5.0], every=50)
    path = tmp_path / "result.nc"
    damage(found.dataset).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(pf.FormatError, match=message):
        pf.load_result(path)


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"nothing\.nc"):
        pf.load_result(tmp_path / "nothing.nc")
    with pytest.raises(FileNotFoundError):
        pf.load_result(tmp_path)


# --- summary ----------------------------------------------------------------------------------


def test_summary_of_the_nominal_case(nominal: pf.Result) -> None:
    summary = nominal.summary()
    assert summary["vehicle"] == "three-axle tandem truck, 20.0 t"
    assert summary["speed"] == "65 km/h"
    assert summary["temperature"] == "20 °C"
    assert summary["road"] == "25 m"
    assert summary["profile"] == "smooth"
    assert summary["largest deflection"] == "0.6611 mm at x = 24 m, t = 1.660 s"
    assert summary["largest deflection at mid-length"] == "0.6436 mm at x = 12.5 m"
    assert summary["largest rebound"].endswith(" mm")
    assert summary["axle 2"] == "static 76.33 kN, 76.33 to 76.33 kN"


def test_summary_tells_of_lift_off_and_the_profile(road: pf.Road, truck: pf.Vehicle) -> None:
    awful = pf.Profile.iso8608("H", 80.0, seed=1)
    result = pf.simulate(road, truck, profile=awful, run_in=40.0, speed_kmh=90.0)
    assert result.forces is not None
    summary = result.summary()
    assert summary["profile"] == "ISO 8608 class H, seed 1"
    for lift in result.forces.lift_off:
        text = summary[f"axle {lift.axle} would lift off"]
        assert text == f"at {lift.instants} instants, first at x = {lift.position:.2f} m"


def test_what_axles_went_through_is_kept_whatever_else(road: pf.Road, truck: pf.Vehicle) -> None:
    """Extremes and lift-off are of every instant, also where no history is kept."""
    awful = pf.Profile.iso8608("H", 80.0, seed=1)
    run: dict[str, Any] = {"profile": awful, "run_in": 40.0, "speed_kmh": 90.0}
    whole = pf.simulate(road, truck, **run)
    bare = pf.simulate(road, truck, keep="envelope", **run)
    assert whole.forces is not None
    assert bare.forces is None
    np.testing.assert_array_equal(bare.axles.lowest, whole.forces.force.min(axis=0))
    np.testing.assert_array_equal(bare.axles.highest, whole.forces.force.max(axis=0))
    assert bare.axles.lift_off == whole.forces.lift_off
    assert bare.axles.lift_off
    assert bare.summary() == whole.summary()


# --- plots ------------------------------------------------------------------------------------

HISTORY, SHAPE = "Deflection at x =", "Deflected shape at t ="
ENVELOPE, FORCES = "Envelope of the deflection", "Tire forces of each axle (dotted: static)"
PANELS = {
    "all": [HISTORY, SHAPE, ENVELOPE, FORCES],
    "envelope": [ENVELOPE],
    "deflection": [HISTORY, ENVELOPE],
    "tire force": [ENVELOPE, FORCES],
    "stations": [HISTORY, ENVELOPE, FORCES],
    "stations alone": [HISTORY, ENVELOPE],
    "thinned": [HISTORY, SHAPE, ENVELOPE, FORCES],
}
LABELS = {
    HISTORY: ("time [s]", "deflection [mm]"),
    SHAPE: ("x [m]", "deflection [mm]"),
    ENVELOPE: ("x [m]", "deflection [mm]"),
    FORCES: ("x [m]", "tire force [kN]"),
}


def test_panels(any_result: tuple[str, pf.Result], tmp_path: Path) -> None:
    name, result = any_result
    figure = result.plot()
    assert isinstance(figure, Figure)
    titles = [axes.get_title() for axes in figure.axes]
    assert len(titles) == len(PANELS[name])
    for axes, title, panel in zip(figure.axes, titles, PANELS[name], strict=True):
        assert title.startswith(panel)
        assert (axes.get_xlabel(), axes.get_ylabel()) == LABELS[panel]
        for line in axes.get_lines():
            assert np.isfinite(np.asarray(line.get_ydata(), dtype=float)).all()
    title = figure.get_suptitle()
    for part in ("three-axle tandem truck", "65 km/h", "20 °C", "ISO 8608 class C, seed 3"):
        assert part in title
    figure.savefig(tmp_path / "picture.png", dpi=50)
    assert (tmp_path / "picture.png").read_bytes().startswith(PNG)


def test_panels_show_the_numbers(nominal: pf.Result) -> None:
    history, shape, envelope, forces = nominal.plot().axes
    assert history.get_title() == "Deflection at x = 12.5 m"
    drawn = np.asarray(history.get_lines()[0].get_ydata(), dtype=float)
    np.testing.assert_allclose(drawn, nominal.history(12.5).to_numpy() * 1e3, rtol=1e-14)
    legend = history.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [
        f"axle {i} passes" for i in (1, 2, 3)
    ]
    assert shape.get_title() == "Deflected shape at t = 1.660 s"
    lowest = np.asarray(shape.get_lines()[0].get_ydata(), dtype=float).min()
    assert lowest == pytest.approx(-1e3 * nominal.max_deflection)
    labels = [text.get_text() for text in envelope.get_legend().get_texts()]  # type: ignore[union-attr]
    assert "largest deflection 0.661 mm" in labels
    statics = {float(np.asarray(line.get_ydata())[0]) for line in forces.get_lines()}
    assert {round(value, 3) for value in statics} == {38.925, 76.335, 80.938}
    assert "smooth road" in nominal.plot().get_suptitle()


def test_plot_at_another_place(nominal: pf.Result) -> None:
    assert nominal.plot(x=5.0).axes[0].get_title() == "Deflection at x = 5 m"
    with pytest.raises(ValueError, match="the nearest is at 5 m"):
        nominal.plot(x=5.1)


def test_plot_without_any_axle_passing(truck: pf.Vehicle) -> None:
    """At the very end of the road no axle has passed within the run: still a picture."""
    result = pf.simulate(pf.Road(length=3.0), truck)
    assert result.plot(x=3.0).axes


def test_plotting_leaves_the_current_figure_alone(nominal: pf.Result) -> None:
    current = plt.figure()
    before = plt.get_fignums()
    nominal.plot()
    plotting.plot_profile(pf.Profile.smooth(10.0))
    assert plt.get_fignums() == before
    assert plt.gcf() is current
    plt.close(current)


def test_plot_of_a_profile(rough: pf.Profile, tmp_path: Path) -> None:
    figure = plotting.plot_profile(rough, (40.0, 65.0))
    (axes,) = figure.axes
    assert axes.get_title() == "ISO 8608 class C, seed 3"
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("station [m]", "elevation above 0.008 m [mm]")
    drawn = np.asarray(axes.get_lines()[0].get_ydata())
    np.testing.assert_allclose(drawn, (rough.z - rough.z[0]) * 1e3)
    figure.savefig(tmp_path / "profile.png", dpi=50)
    assert (tmp_path / "profile.png").read_bytes().startswith(PNG)
    assert plotting.plot_profile(pf.Profile([0, 1], [0, 0])).axes[0].get_title() == "road profile"


def test_panels_need_what_they_draw(road: pf.Road, truck: pf.Vehicle) -> None:
    bare = pf.simulate(road, truck, keep="envelope")
    axes = plotting.plot_profile(pf.Profile.smooth(10.0)).axes[0]
    with pytest.raises(ValueError, match="deflected shape needs"):
        plotting.draw_worst_instant(axes, bare)
    with pytest.raises(ValueError, match="tire forces were not kept"):
        plotting.draw_forces(axes, bare)
