"""Films: what is drawn is what was computed, files of a bounded size, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
from conftest import Run
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from PIL import Image

import pavefem as pf
from pavefem.plotting import animation
from pavefem.plotting.animation import MOST_FRAMES, Film


def lines(film: Film, label: str) -> Line2D:
    """Find a line of a film by its label."""
    [found] = [
        line for axes in film.figure.axes for line in axes.lines if line.get_label() == label
    ]
    return found


def said(film: Film) -> str:
    """Give what is written around the picture."""
    return " ".join(text.get_text() for text in film.figure.texts)


def wheels(film: Film) -> list[tuple[float, float]]:
    """Give place and height of the hubs as they are drawn, m, front axle first."""
    axes = film.figure.axes[0]
    rims = [patch for patch in axes.patches if isinstance(patch, Circle) and patch.radius == 0.5]
    found = []
    for rim in rims:
        x, y = (rim.get_transform() - axes.transData).transform(rim.get_path().vertices).T
        found.append((0.5 * (x.min() + x.max()), 0.5 * (y.min() + y.max())))
    return found


@pytest.fixture
def film(rough_run: pf.Result) -> Film:
    """Give some frames over the rough profile."""
    return rough_run.animate(between=(0.6, 1.0), slow_motion=2.0)


# --- what is drawn ----------------------------------------------------------------------------


def test_the_road_is_elevation_and_deflection_times_the_stated_factors(
    rough_run: pf.Result, film: Film
) -> None:
    profile, scenario = rough_run.scenario.profile, rough_run.scenario
    assert rough_run.deflection is not None
    assert profile is not None
    stated = re.search(r"deflection × ([\d.]+), elevation × ([\d.]+)\.", said(film))
    assert stated is not None
    sinking, rising = (float(number) for number in stated.groups())
    assert (sinking, rising) == (film.deflection_scale, film.elevation_scale)
    assert rough_run.max_deflection * sinking > 0.15
    for frame in (0, 7):
        film.show(frame)
        x, drawn = (np.asarray(values) for values in lines(film, "road").get_data())
        row = int(np.abs(rough_run.time - film.time[frame]).argmin())
        deflection = np.interp(x, rough_run.x, rough_run.deflection[row], left=0.0, right=0.0)
        elevation = profile.elevation(x + profile.x[0] + scenario.run_in)
        level = drawn - sinking * deflection - rising * elevation
        assert np.ptp(level) < 1e-12
        assert deflection.min() < -1e-4
        low, high = film.figure.axes[0].get_xlim()
        assert x[0] <= low < high <= x[-1]


def test_the_strip_is_the_deflection_now_and_the_lowest_before(nominal: pf.Result) -> None:
    assert nominal.deflection is not None
    film = nominal.animate(between=(0.4, 0.8), slow_motion=1.0)
    for frame in (0, 3, film.time.size - 1):
        film.show(frame)
        row = int(np.abs(nominal.time - film.time[frame]).argmin())
        x, now = lines(film, "now").get_data()
        nodes = np.isin(nominal.x, x)
        assert nodes.sum() > 20
        np.testing.assert_array_equal(now, 1e3 * nominal.deflection[row, nodes])
        lowest = 1e3 * nominal.deflection[: row + 1, nodes].min(axis=0)
        np.testing.assert_array_equal(lines(film, "lowest").get_ydata(), lowest)
    assert film.figure.axes[1].get_ylabel() == "deflection [mm]"


def test_wheels_stand_on_the_road_where_the_axles_are(rough_run: pf.Result, film: Film) -> None:
    assert rough_run.forces is not None
    for frame in (0, 5):
        film.show(frame)
        row = int(np.abs(rough_run.time - film.time[frame]).argmin())
        places, heights = np.transpose(wheels(film))
        np.testing.assert_allclose(places, rough_run.forces.position[row], atol=1e-9)
        x, drawn = (np.asarray(values) for values in lines(film, "road").get_data())
        road = np.interp(places, x, drawn)
        np.testing.assert_allclose(heights - 0.5, road, atol=1e-9)


def test_arrows_are_the_tire_forces(rough_run: pf.Result, film: Film) -> None:
    assert rough_run.forces is not None
    film.show(4)
    row = int(np.abs(rough_run.time - film.time[4]).argmin())
    forces = rough_run.forces.force[row]
    axes = film.figure.axes[0]
    numbers = [text.get_text() for text in axes.texts if text.get_text().isdigit()]
    assert numbers == [f"{force / 1e3:.0f}" for force in forces]
    shafts = [line for line in axes.lines if line.get_linewidth() == 2.2]
    lengths = [float(-np.diff(np.asarray(shaft.get_ydata()))[0]) for shaft in shafts]
    np.testing.assert_allclose(np.array(lengths) / lengths[0], forces / forces[0])


def test_time_place_and_pace_are_written(film: Film, rough_run: pf.Result) -> None:
    film.show(3)
    speed = 65.0 / 3.6
    clock = film.figure.axes[0].texts[0].get_text()
    assert clock == f"t = {film.time[3]:.3f} s, front axle at x = {speed * film.time[3]:.2f} m"
    assert "2 times slower than real" in said(film)
    assert "65 km/h, 20 °C, ISO 8608 class C, seed 3" in said(film)
    np.testing.assert_allclose(np.diff(film.time), 1.0 / (2.0 * 20.0), atol=1e-9)
    fast = rough_run.animate(fps=10.0, slow_motion=0.25)
    assert "4 times faster than real" in said(fast)
    assert "Real time." in said(rough_run.animate(slow_motion=1.0))


def test_springs_stretch_between_the_wheels_and_a_body_on_their_mean_line(film: Film) -> None:
    film.show(6)
    places, heights = np.transpose(wheels(film))
    slope, offset = np.polyfit(places, heights - 0.5, 1)
    axes = film.figure.axes[0]
    coils = [line for line in axes.lines if np.size(line.get_xdata()) == 12]
    assert len(coils) == 3
    coil = coils[0]  # of the front axle, ahead of it
    x, y = (coil.get_transform() - axes.transData).transform(coil.get_xydata()).T
    np.testing.assert_allclose([x[0], y[0]], [places[0] + 0.17, heights[0]], atol=1e-9)
    np.testing.assert_allclose(y[-1], 1.75 + offset + slope * x[-1], atol=1e-9)


def test_a_long_road_is_followed_over_hills(truck: pf.Vehicle) -> None:
    flat = pf.Profile.iso8608("B", 260.0, seed=2)
    hills = pf.Profile(flat.x, flat.z + 4.0 * np.sin(2.0 * np.pi * flat.x / 150.0), "hills")
    scheme = pf.Scheme.paper(solver="window")
    result = pf.simulate(pf.Road(length=250.0), truck, profile=hills, scheme=scheme, every=10)
    film = result.animate()
    assert "elevation × 1." in said(film)
    axes = film.figure.axes[0]
    for frame in range(0, film.time.size, 10):
        film.show(frame)
        views = axes.get_xlim(), axes.get_ylim()
        for (low, high), values in zip(views, np.transpose(wheels(film)), strict=True):
            assert low + 0.5 < values.min() and values.max() < high - 0.5


def test_a_staircase_is_drawn_as_one(road: pf.Road, truck: pf.Vehicle) -> None:
    steps = pf.Profile(np.arange(0.0, 61.0), 0.005 * (np.arange(61) % 2), "steps")
    result = pf.simulate(road, truck, profile=steps, interpolation="staircase")
    film = result.animate(deflection_scale=1e-9, elevation_scale=2.0)
    film.show(film.time.size // 2)
    x, drawn = lines(film, "road").get_data()
    level = np.asarray(drawn) - np.min(drawn)
    assert set(np.round(level, 6)) == {0.0, 0.01}
    np.testing.assert_allclose(level, 0.01 * (np.floor(np.asarray(x) + 1e-7) % 2), atol=1e-6)


@pytest.mark.parametrize("name", ["quarter_car", "semitrailer", "b_double"])
def test_other_vehicles(name: str) -> None:
    """One axle; articulated; longer than the road."""
    vehicle = pf.vehicles.named(name)
    result = pf.simulate(pf.Road(length=6.0), vehicle)
    film = result.animate(fps=50.0)
    film.show(film.time.size // 2)
    film.figure.canvas.draw()
    assert len(wheels(film)) == len(vehicle.tires)


def test_scales_can_be_given(nominal: pf.Result) -> None:
    film = nominal.animate(deflection_scale=123.0)
    assert "deflection × 123." in said(film)
    assert "elevation" not in said(film)  # the road is smooth


def test_a_road_that_is_not_deflected_can_be_drawn(truck: pf.Vehicle) -> None:
    """Of a run that has kept only its first instants nothing is divided by the deflection."""
    result = pf.simulate(pf.Road(length=3.0), truck, every=40)
    film = result.animate(fps=5.0, slow_motion=1.0)
    film.show(0)
    assert result.deflection is not None
    np.testing.assert_array_equal(lines(film, "now").get_ydata(), 0.0)


# --- files ------------------------------------------------------------------------------------


def test_gif(rough_run: pf.Result, tmp_path: Path) -> None:
    path = tmp_path / "film.gif"
    assert rough_run.animate(path, between=(0.5, 0.8), slow_motion=2.0) is None
    assert [file.name for file in tmp_path.iterdir()] == ["film.gif"]
    with Image.open(path) as picture:
        assert (picture.format, picture.width) == ("GIF", 800)
        assert getattr(picture, "n_frames", 0) == 13  # 0.3 s times 2 times 20, and the first
        assert picture.info["duration"] == 50
        assert picture.info["loop"] == 0
    # As many as there may be stay below 2 MB.
    assert path.stat().st_size * MOST_FRAMES / 13 < 2e6


def test_a_gif_shows_the_colours_of_the_figure(nominal: pf.Result, tmp_path: Path) -> None:
    path = tmp_path / "film.gif"
    nominal.animate(path, between=(0.7, 0.8), slow_motion=1.0)
    film = nominal.animate(between=(0.7, 0.8), slow_motion=1.0)
    film.show(1)
    film.figure.canvas.draw()
    expected = np.asarray(film.figure.canvas.buffer_rgba())[..., :3]  # type: ignore[attr-defined]
    with Image.open(path) as picture:
        picture.seek(1)
        found = np.asarray(picture.convert("RGB"))
    assert found.shape == expected.shape
    difference = np.abs(found.astype(int) - expected)
    assert difference.max() < 48 and difference.mean() < 3.0


def test_html_needs_nothing_else(nominal: pf.Result, tmp_path: Path) -> None:
    path = tmp_path / "film.html"
    nominal.animate(path, between=(0.7, 0.9), slow_motion=1.0)
    page = path.read_text("utf-8")
    assert page.startswith("<!DOCTYPE html>")
    assert page.count("data:image/png;base64") == 5
    assert "http" not in page.replace("http://www.w3.org", "")
    assert ".fa-play:before" in page


def test_a_notebook_shows_it(nominal: pf.Result) -> None:
    film = nominal.animate(between=(0.7, 0.8), slow_motion=1.0)
    assert isinstance(film, matplotlib.animation.FuncAnimation)
    shown = film._repr_html_()
    assert shown.count("data:image/png;base64") == 3


def test_all_frames_are_in_the_page_whatever_matplotlib_would_embed(nominal: pf.Result) -> None:
    with matplotlib.rc_context({"animation.embed_limit": 0.01}):
        film = nominal.animate(between=(0.7, 0.8), slow_motion=1.0)
        assert film.to_jshtml().count("data:image/png;base64") == 3


def test_the_same_run_gives_the_same_files(rough_run: pf.Result, tmp_path: Path) -> None:
    for name in ("a", "b"):
        for suffix in animation.SUFFIXES:
            rough_run.animate(tmp_path / f"{name}{suffix}", between=(0.7, 0.8), slow_motion=1.0)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()
    pages = [(tmp_path / f"{name}.html").read_text("utf-8") for name in ("a", "b")]
    # matplotlib gives what belongs together on a page a name of its own.
    one, other = (re.sub(r"[0-9a-f]{32}", "", page) for page in pages)
    assert one == other


def test_a_film_is_as_wide_whatever_matplotlib_is_set_to(
    nominal: pf.Result, tmp_path: Path
) -> None:
    with matplotlib.rc_context({"figure.dpi": 250.0, "savefig.dpi": 300.0}):
        nominal.animate(tmp_path / "film.gif", between=(0.7, 0.8), slow_motion=1.0)
    with Image.open(tmp_path / "film.gif") as picture:
        assert picture.width == 800


def test_frames_may_be_shown_in_any_order(film: Film) -> None:
    def picture() -> np.ndarray[Any, Any]:
        film.show(5)
        film.figure.canvas.draw()
        return np.array(film.figure.canvas.buffer_rgba())  # type: ignore[attr-defined]

    before = picture()
    film.show(12)
    np.testing.assert_array_equal(picture(), before)


def test_default_films_are_bounded(rough_run: pf.Result, truck: pf.Vehicle) -> None:
    assert 60 < rough_run.animate().time.size <= MOST_FRAMES
    thinned = pf.simulate(pf.Road(), truck, every=100)
    film = thinned.animate()
    np.testing.assert_array_equal(film.time, thinned.time[: film.time.size])  # none is shown twice
    long = pf.simulate(pf.Road(length=150.0), truck, every=5)
    assert 30 < long.animate().time.size <= MOST_FRAMES


def test_pyplot_and_the_settings_are_left_alone(nominal: pf.Result, tmp_path: Path) -> None:
    current = plt.figure()
    before, settings = plt.get_fignums(), dict(matplotlib.rcParams)
    for suffix in animation.SUFFIXES:
        nominal.animate(tmp_path / f"film{suffix}", between=(0.7, 0.8), slow_motion=1.0)
    nominal.animate().show(0)
    assert plt.get_fignums() == before
    assert plt.gcf() is current
    assert dict(matplotlib.rcParams) == settings
    plt.close(current)


def test_a_film_that_fails_keeps_the_old_file(
    nominal: pf.Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "film.gif"
    path.write_bytes(b"old")

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Image.Image, "save", full)
    with pytest.raises(OSError, match="No space left"):
        nominal.animate(path, between=(0.7, 0.8), slow_motion=1.0)
    assert path.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["film.gif"]


# --- what is refused --------------------------------------------------------------------------


@pytest.mark.parametrize(
    "keep",
    [
        {"keep": "envelope"},
        {"keep": ["deflection"]},
        {"keep": ["tire_force"]},
        {"stations": [5.0, 12.5]},
    ],
    ids=["envelope", "no forces", "no deflection", "stations"],
)
def test_histories_of_all_nodes_and_forces_are_needed(
    keep: dict[str, Any], road: pf.Road, truck: pf.Vehicle
) -> None:
    result = pf.simulate(road, truck, **keep)
    with pytest.raises(ValueError, match=r'all nodes and the tire forces: run with keep=\["defl'):
        result.animate()


def test_one_instant_is_no_film(road: pf.Road, truck: pf.Vehicle) -> None:
    with pytest.raises(ValueError, match="one instant is no film: run with a smaller every"):
        pf.simulate(road, truck, every=5000).animate()


MISTAKES: list[tuple[dict[str, Any], str]] = [
    ({"path": "film.mp4"}, r"film\.mp4: an animation is written as \.gif or \.html"),
    ({"path": "film"}, "film: an animation is written as"),
    ({"fps": 0.0}, "fps = 0: must be 1 to 50"),
    ({"fps": float("nan")}, "fps = nan"),
    ({"path": "film.gif", "fps": 30.0}, "fps = 30: frames of a GIF last whole hundredths"),
    ({"slow_motion": 0.0}, "slow_motion = 0: must be finite and above 0"),
    ({"slow_motion": float("inf")}, "slow_motion = inf: must be a finite number"),
    ({"slow_motion": 100.0}, r"slow_motion = 100: instants 0\.001 s apart .* enough for 50 at 20"),
    ({"slow_motion": 40.0}, r"take 1367 frames: must be 2 to 120; change slow_motion"),
    ({"slow_motion": 0.01}, r"take 1 frames: must be 2 to"),
    ({"between": (0.8, 0.2)}, r"between = \(0\.8, 0\.2\) s: must be two instants"),
    ({"between": (0.5, 9.0)}, r"within the run, 0 to 1\.708 s"),
    ({"between": (float("nan"), 1.0)}, "between = "),
    ({"deflection_scale": 0.0}, "deflection_scale = 0: must be finite and above 0"),
    ({"deflection_scale": "2"}, "deflection_scale = '2': must be a finite number"),
    ({"between": 1.0}, "between = 1.0: must be two numbers"),
    ({"between": (0.0, None)}, "between = None: must be a finite number"),
    ({"fps": None}, "fps = None: must be a finite number"),
    ({"slow_motion": [2.0]}, r"slow_motion = \[2.0\]: must be a finite number"),
    ({"elevation_scale": float("nan")}, "elevation_scale = nan"),
]


@pytest.mark.parametrize(("options", "message"), MISTAKES, ids=[words for _, words in MISTAKES])
def test_mistakes_are_named(
    options: dict[str, Any],
    message: str,
    nominal: pf.Result,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=message):
        nominal.animate(**options)
    assert not list(tmp_path.iterdir())


def test_no_folder_to_write_to(nominal: pf.Result, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no such folder"):
        nominal.animate(tmp_path / "nowhere" / "film.gif")


# --- the command line -------------------------------------------------------------------------


@pytest.fixture
def short_films(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(animation, "MOST_FRAMES", 4)


def test_run_animate(pavefem: Run, short_films: None, tmp_path: Path) -> None:
    done = pavefem("run", "--animate")
    assert (done.code, done.err) == (0, "")
    assert "wrote result.nc, response.png, profile.png, animation.gif in out" in done.out
    with Image.open(tmp_path / "out" / "animation.gif") as picture:
        assert 2 <= getattr(picture, "n_frames", 0) <= 4


def test_a_film_needs_histories(pavefem: Run, tmp_path: Path) -> None:
    done = pavefem("run", "--animate", "--envelope")
    assert done.error() == "--animate needs the histories that --envelope leaves out"
    assert not list(tmp_path.iterdir())
