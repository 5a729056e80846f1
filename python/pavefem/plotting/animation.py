"""A film of a run: the vehicle rolls over the road, and the pavement gives way below its wheels."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable
from functools import partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Self

import numpy as np
from matplotlib import rc_context
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.text import Text
from matplotlib.transforms import Affine2D, Transform
from numpy.polynomial import polynomial
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from pavefem._files import replacing
from pavefem._model import finite_number, two_numbers
from pavefem._progress import progress_bar
from pavefem.plotting.style import KN, MM, colour, heading, new_figure
from pavefem.plotting.vehicle import BOX, FRAME, HUB, SideView

if TYPE_CHECKING:
    from pavefem.result import Result
    from pavefem.scenario import Scenario

MOST_FRAMES: Final = 120
"""Most frames of a film: a GIF of so many stays below 2 MB."""
SUFFIXES: Final = (".gif", ".html")

# What is drawn how large, m of the picture of the vehicle.
SHORTEST_VIEW: Final = 15.0
DENT: Final = 0.32
"""The largest deflection, at most: what a wheel still fits into."""
BUMPS: Final = 0.3
"""How far elevations differ within the picture, at most."""
ASPHALT: Final = 0.16

# The figure, inches.
DPI: Final = 100
WIDTH: Final = 8.0
MARGIN: Final = (0.75, 0.12)
ARROW: Final = 0.55
"""The largest tire force."""
GROUND: Final = 0.25
"""What lies below the longest arrow."""
SKY: Final = 0.3
"""What is above the highest box."""
HEAD: Final = 0.34
STRIP: Final = 1.25
FOOT: Final = 0.88

GREY: Final = "#4d4d4d"
DEFLECTED: Final = colour(0)
COLOURS: Final = 64
"""Of a GIF: enough for these pictures, and half the room of 256."""

# The page that matplotlib makes fetches the signs on its buttons from a server.
_ICONS: Final = re.compile(r"<link rel=\"stylesheet\"\s+href=\"[^\"]*font-awesome[^\"]*\">")
_SIGNS: Final = """<style>
.fa { font-style: normal; }
.fa-minus:before { content: "\\2212"; }
.fa-plus:before { content: "+"; }
.fa-fast-backward:before { content: "\\00ab"; }
.fa-step-backward:before { content: "\\2039"; }
.fa-play:before { content: "\\25b6\\fe0e"; }
.fa-pause:before { content: "\\2016"; }
.fa-step-forward:before { content: "\\203a"; }
.fa-fast-forward:before { content: "\\00bb"; }
.fa-flip-horizontal { display: inline-block; transform: scaleX(-1); }
</style>"""


class Film(FuncAnimation):
    """A `matplotlib.animation.FuncAnimation` that a notebook shows, and that needs no network.

    Attributes
    ----------
    figure : matplotlib.figure.Figure
        The figure; ``film.show(frame)`` draws a frame in it, counted from 0.
    time : ndarray, shape (frames,)
        Instants of the frames, s.
    slow_motion : float
        How many times slower than real it runs.
    deflection_scale, elevation_scale : float
        Exaggeration of deflections and of elevations.
    """

    def __init__(self, scene: _Scene, fps: float) -> None:
        shots = scene.shots
        self.figure, self.show = scene.figure, scene.show
        self.time, self.slow_motion = scene.time[shots.instants], shots.slow_motion
        self.deflection_scale = scene.deflection_scale
        self.elevation_scale = scene.elevation_scale
        frames, interval = shots.instants.size, 1e3 / fps
        super().__init__(
            self.figure, self.show, frames=frames, interval=interval, cache_frame_data=False
        )

    def __del__(self) -> None:
        """Say nothing: a film of which one frame was looked at was of use, too."""

    def to_jshtml(
        self, fps: int | None = None, embed_frames: bool = True, default_mode: str | None = None
    ) -> str:
        """Return the film as HTML with its frames inside; see matplotlib."""
        # Frames beyond matplotlib's limit would be left out without a word.
        with rc_context({"animation.embed_limit": 100.0, "savefig.dpi": "figure"}):
            page: str = super().to_jshtml(fps, embed_frames, default_mode)
        return _ICONS.sub(lambda _: _SIGNS, page)

    def _repr_html_(self) -> str:
        return self.to_jshtml()


def animate(
    result: Result,
    path: str | os.PathLike[str] | None = None,
    *,
    between: tuple[float, float] | None = None,
    fps: float = 20.0,
    slow_motion: float | None = None,
    deflection_scale: float | None = None,
    elevation_scale: float | None = None,
    progress: bool = False,
) -> Film | None:
    """Show the vehicle moving over the profile and the deflecting pavement.

    The picture follows the vehicle, which is to scale. Below it lies the road, its elevation and
    its deflection exaggerated by factors that the picture states; arrows are the tire forces, and
    a strip shows the deflection in mm, with the lowest that each place has come to. Each wheel
    stands on the deflected road. What a body does on its springs is not kept by a run: bodies are
    drawn on the straight line through the heights of the wheels. Before and behind the pavement the
    road goes on rigid.

    Parameters
    ----------
    result : Result
        A run with the histories of all nodes and the tire forces.
    path : path-like, optional
        File to write, ``.gif`` or ``.html``; an old one is replaced as a whole.
    between : (float, float), optional
        Instants between which the film runs, s; by default the whole run. Of a long road, choose
        a second or two. A frame shows the nearest instant that was kept.
    fps : float
        Frames a second; of a GIF 100 divided by a whole number, because its frames last whole
        hundredths of a second.
    slow_motion : float, optional
        How many times slower than real the film runs; by default as slow as 120 frames allow.
    deflection_scale, elevation_scale : float, optional
        Exaggeration of the deflection and of the elevation; by default so that they can be seen.
        Give them to compare films.
    progress : bool
        Show progress when writing the file takes over a second.

    Returns
    -------
    Film or None
        A `matplotlib.animation.FuncAnimation` where no path is given: a notebook shows it. None
        where a file is written.

    Raises
    ------
    ValueError
        If the run did not keep what is to be drawn, the suffix is another, a number is out of
        range, or more than 120 frames were needed.
    OSError
        If the file cannot be written.
    """
    suffix = _checked_suffix(path)
    shots = _shots(result, between, fps, slow_motion)
    if suffix == ".gif" and abs(100.0 / fps - round(100.0 / fps)) > 1e-9:
        raise ValueError(
            f"fps = {fps:g}: frames of a GIF last whole hundredths of a second; take 50, 25, 20 "
            "or another 100 divided by a whole number"
        )
    scene = _Scene(result, shots, deflection_scale, elevation_scale)
    film = Film(scene, fps)
    if path is None:
        return film
    with replacing(path) as file, progress_bar(progress, "film") as scene.report:
        if suffix == ".gif":
            film.save(str(file), writer=_Gif(fps), dpi=DPI)
        else:
            file.write_text(_page(film, result.scenario.vehicle.name), encoding="utf-8")
    return None


class _Shots(NamedTuple):
    """Which instants of the histories the frames show."""

    instants: NDArray[np.intp]
    slow_motion: float


def _checked_suffix(path: str | os.PathLike[str] | None) -> str:
    if path is None:
        return ""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"{os.fspath(path)}: an animation is written as {' or '.join(SUFFIXES)}")
    return suffix


def _shots(
    result: Result, between: tuple[float, float] | None, fps: float, slow_motion: float | None
) -> _Shots:
    """Check what is to be shown, and spread the frames over it."""
    if result.deflection is None or result.stations is not None or result.forces is None:
        raise ValueError(
            "an animation needs the deflection of all nodes and the tire forces: run with "
            'keep=["deflection", "tire_force"] and without stations'
        )
    if not 1.0 <= finite_number("fps", fps) <= 50.0:
        raise ValueError(f"fps = {fps:g}: must be 1 to 50 frames a second")
    time = result.time
    if time.size < 2:
        raise ValueError("one instant is no film: run with a smaller every")
    start, end = (time[0], time[-1]) if between is None else two_numbers("between", between)
    if not time[0] <= start < end <= time[-1]:
        raise ValueError(
            f"between = ({start:g}, {end:g}) s: must be two instants, the earlier first, "
            f"within the run, {time[0]:g} to {time[-1]:g} s"
        )
    kept = time[1] - time[0]
    slowest = 1.0 / (fps * kept)
    if slow_motion is None:
        slow_motion = _round_down(min(slowest, (MOST_FRAMES - 1) / (fps * (end - start))))
    slow_motion = _checked("slow_motion", slow_motion)
    if slow_motion > slowest * (1.0 + 1e-9):
        raise ValueError(
            f"slow_motion = {slow_motion:g}: instants {kept:g} s apart were kept, enough for "
            f"{slowest:.3g} at {fps:g} frames a second; run with a smaller every or use fewer fps"
        )
    step = 1.0 / (fps * slow_motion * kept)
    first = int(np.abs(time - start).argmin())
    count = math.floor((end - time[first]) / (step * kept) + 1e-6) + 1
    if not 2 <= count <= MOST_FRAMES:
        raise ValueError(
            f"{end - start:g} s, {slow_motion:g} times slower than real and at {fps:g} frames a "
            f"second, take {count} frames: must be 2 to {MOST_FRAMES}; change slow_motion, fps or "
            "between"
        )
    instants = first + np.floor(step * np.arange(count) + 0.5).astype(np.intp)
    return _Shots(np.minimum(instants, time.size - 1), slow_motion)


def _round_down(number: float) -> float:
    """Largest number of one digit, or one over such a number, that is not above."""
    if number < 1.0:
        power = 10.0 ** math.floor(math.log10(1.0 / number))
        return 1.0 / (power * math.ceil(1.0 / number / power - 1e-9))
    power = 10.0 ** math.floor(math.log10(number))
    return power * math.floor(number / power + 1e-9)


class _Hanging(Transform):
    """From places on a vehicle to the road: what is above the wheels moves with the bodies.

    In between, which is where springs are, it stretches.
    """

    input_dims = output_dims = 2
    pass_through = True  # it keeps nothing that could still be valid

    def __init__(self, axles: NDArray[np.float64]) -> None:
        super().__init__()
        self._axles = axles
        self._front, self._wheels = 0.0, np.zeros(axles.size)
        self._line: NDArray[np.float64] = np.zeros(2)

    def move(self, front: float, wheels: NDArray[np.float64]) -> None:
        """Put the front axle to a place, m, and the wheels to heights, m."""
        self._front, self._wheels = front, wheels
        degree = min(1, wheels.size - 1)
        self._line = np.asarray(polynomial.polyfit(self._axles, wheels, degree), np.float64)
        self.invalidate()

    def transform_non_affine(self, values: ArrayLike) -> NDArray[np.float64]:
        """Transform points, shape (points, 2)."""
        x, y = np.asarray(values, dtype=np.float64).T
        body = polynomial.polyval(x, self._line)
        wheel = np.interp(x, self._axles, self._wheels)
        part = np.clip((y - 2.0 * HUB) / (FRAME[0] - 2.0 * HUB), 0.0, 1.0)
        return np.column_stack([self._front - x, y + part * body + (1.0 - part) * wheel])


class _Arrow(NamedTuple):
    """A tire force, and its number."""

    shaft: Line2D
    head: Line2D
    label: Text

    @classmethod
    def on(cls, axes: Axes, ink: str) -> Self:
        """Begin one."""
        [shaft] = axes.plot([], [], color=ink, linewidth=2.2, zorder=2.5)
        [head] = axes.plot([], [], "v", color=ink, markersize=7.0, zorder=2.5)
        return cls(shaft, head, axes.text(0.0, 0.0, "", ha="center", va="top", clip_on=True))


class _Scene:
    """The figure, and what of it changes from frame to frame."""

    def __init__(
        self,
        result: Result,
        shots: _Shots,
        deflection_scale: float | None,
        elevation_scale: float | None,
    ) -> None:
        assert result.deflection is not None
        assert result.forces is not None
        self.shots, self.time = shots, result.time
        self.report: Callable[[int, int], None] | None = None
        self._x = result.x
        self._deflection = result.deflection
        self._position, self._force = result.forces.position, result.forces.force
        scenario = result.scenario
        view = SideView(scenario.vehicle)
        left, right = view.ends
        self._width = max(SHORTEST_VIEW, 1.5 * (right - left))
        # Behind the front axle, as the vehicle's places are.
        self._ahead = (left + right) / 2.0 - self._width / 2.0
        fronts = self._position[shots.instants, 0]
        edges = fronts[0] - self._ahead - self._width, fronts[-1] - self._ahead
        self._grid, self._elevation = _surface(scenario, result.x, *edges)
        self._views = [self._seen(front) for front in fronts]
        self._scale_deflection(result.max_deflection, deflection_scale)
        self._scale_elevation(scenario, elevation_scale)
        self._lowest_so_far = _running_lowest(self._deflection, shots.instants)
        self._draw(result, view)

    def _seen(self, front: float) -> slice:
        """Part of the grid within the picture, and a point on both sides."""
        end = front - self._ahead
        first, last = np.searchsorted(self._grid, [end - self._width, end])
        return slice(max(0, int(first) - 1), int(last) + 1)

    def _scale_deflection(self, largest: float, given: float | None) -> None:
        if given is None:
            given = _round_down(DENT / largest) if largest > 0.0 else 1.0
        self.deflection_scale = _checked("deflection_scale", given)

    def _scale_elevation(self, scenario: Scenario, given: float | None) -> None:
        """Choose the exaggeration and, for each frame, the elevation that is drawn as level."""
        most = max(float(np.ptp(self._elevation[seen])) for seen in self._views)
        if given is None:
            given = max(1.0, _round_down(BUMPS / most)) if most > 0.0 else 1.0
        self.elevation_scale = _checked("elevation_scale", given)
        whole = float(np.ptp(self._elevation))
        if self.elevation_scale * whole <= 1.5 * BUMPS:
            self._level = np.full(len(self._views), np.mean(self._elevation))
        else:  # over hills the picture goes up and down with the road
            self._level = np.array([np.mean(self._elevation[seen]) for seen in self._views])

    def _draw(self, result: Result, view: SideView) -> None:
        """Draw all that there is; `show` moves it."""
        scenario = result.scenario
        left, right = MARGIN
        inside = WIDTH - left - right
        self._inch = self._width / inside  # of the figure, in m of the road
        top = BOX[1] + BUMPS + SKY * self._inch
        self._bottom = -DENT - BUMPS - (ARROW + GROUND) * self._inch
        scene = (top - self._bottom) / self._inch
        height = HEAD + scene + STRIP + FOOT
        self.figure = new_figure(WIDTH, height)
        self.figure.set_layout_engine("none")
        self.figure.set_dpi(DPI)
        FigureCanvasAgg(self.figure)
        across = left / WIDTH, inside / WIDTH
        self._road = self.figure.add_axes(
            (across[0], (STRIP + FOOT) / height, across[1], scene / height)
        )
        self._strip = self.figure.add_axes(
            (across[0], FOOT / height, across[1], STRIP / height), sharex=self._road
        )
        self._draw_texts(scenario, height)
        self._road.set(ylim=(self._bottom, top), yticks=[])
        self._draw_road(scenario)
        self._draw_vehicle(view)
        self._draw_strip(result)

    def _draw_texts(self, scenario: Scenario, height: float) -> None:
        inch = 1.0 / height
        self.figure.text(
            MARGIN[0] / WIDTH,
            1.0 - 0.22 * inch,
            heading(scenario),
            weight="bold",
            va="center",
        )
        self._clock = self._road.text(
            0.995, 0.985, "", transform=self._road.transAxes, ha="right", va="top"
        )
        slow = self.shots.slow_motion
        pace = "real time"
        if slow > 1.0:
            pace = f"{slow:.3g} times slower than real"
        elif slow < 1.0:
            pace = f"{1.0 / slow:.3g} times faster than real"
        drawn = f"deflection × {self.deflection_scale:g}"
        if scenario.profile is not None:
            drawn += f", elevation × {self.elevation_scale:g}"
        caption = (
            f"Road: {drawn}. Arrows: tire forces, kN. {pace[0].upper()}{pace[1:]}.\n"
            "Wheels stand on the road, bodies on the line through the wheels: "
            "their bounce and pitch are not drawn."
        )
        self.figure.text(
            MARGIN[0] / WIDTH, 0.06 * inch, caption, fontsize="small", color=GREY, va="bottom"
        )

    def _draw_road(self, scenario: Scenario) -> None:
        axes = self._road
        axes.tick_params(bottom=False, labelbottom=False)
        axes.spines[["left", "right", "top", "bottom"]].set_visible(False)
        self._base = Polygon([(0.0, 0.0)], facecolor="#e8dcc8", zorder=0.2)
        axes.add_patch(self._base)
        self._asphalt = Polygon([(0.0, 0.0)], facecolor=GREY, zorder=0.4)
        axes.add_patch(self._asphalt)
        [self._top] = axes.plot([], [], color="black", linewidth=1.2, zorder=1.2, label="road")
        self._arrows = [_Arrow.on(axes, colour(axle)) for axle in range(self._force.shape[1])]
        self._arrow_scale = ARROW * self._inch / max(1.0, float(self._force.max()))

    def _draw_vehicle(self, view: SideView) -> None:
        axes = self._road
        tires = view.vehicle.tires
        self._hanging = _Hanging(view.vehicle.axle_positions)
        self._wheels = [Affine2D() for _ in tires]
        for artist in _added(axes, view.draw_bodies):
            artist.set_transform(self._hanging + axes.transData)
            if isinstance(artist, Text):  # masses, for which a film has no room
                artist.remove()
        for tire, wheel in zip(tires, self._wheels, strict=True):
            for artist in _added(axes, partial(view.draw_wheel, tire=tire)):
                artist.set_transform(wheel + axes.transData)

    def _draw_strip(self, result: Result) -> None:
        axes = self._strip
        axes.axhline(0.0, color=GREY, linewidth=0.6)
        self._fill = Polygon([(0.0, 0.0)], facecolor=DEFLECTED, alpha=0.25)
        axes.add_patch(self._fill)
        [self._line] = axes.plot([], [], color=DEFLECTED, linewidth=1.4, label="now")
        [self._past] = axes.plot([], [], color=GREY, linewidth=0.8, linestyle=":", label="lowest")
        low, high = -result.max_deflection * MM, max(0.0, float(result.highest.max())) * MM
        room = 0.12 * max(high - low, 1e-9)
        axes.set(ylim=(low - room, high + room), xlabel="x [m]", ylabel="deflection [mm]")
        axes.legend(
            loc="upper right",
            bbox_to_anchor=(1.0, -0.17),
            borderaxespad=0.0,
            frameon=False,
            fontsize="small",
            ncols=2,
        )
        axes.grid(alpha=0.3)

    def show(self, frame: int) -> Iterable[Artist]:
        """Draw a frame, counted from 0."""
        if self.report is not None:
            self.report(frame, self.shots.instants.size)
        instant = self.shots.instants[frame]
        front = self._position[instant, 0]
        end = front - self._ahead
        self._road.set_xlim(end - self._width, end)
        self._clock.set_text(f"t = {self.time[instant]:.3f} s, front axle at x = {front:.2f} m")
        self._show_road(frame)
        self._show_vehicle(frame)
        self._show_deflection(frame)
        return ()

    def _height(
        self, frame: int, x: NDArray[np.float64], elevation: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """How high the road is drawn at some places, m."""
        deflection = self._deflection[self.shots.instants[frame]]
        sunk = np.interp(x, self._x, deflection, left=0.0, right=0.0)
        height: NDArray[np.float64] = self.elevation_scale * (elevation - self._level[frame])
        height += self.deflection_scale * sunk
        return height

    def _show_road(self, frame: int) -> None:
        seen = self._views[frame]
        x = self._grid[seen]
        surface = self._height(frame, x, self._elevation[seen])
        self._top.set_data(x, surface)
        self._base.set_xy(_between(x, surface, self._bottom))
        paved = (x >= self._x[0]) & (x <= self._x[-1])
        self._asphalt.set_xy(_between(x[paved], surface[paved], surface[paved] - ASPHALT))

    def _show_vehicle(self, frame: int) -> None:
        instant = self.shots.instants[frame]
        places, forces = self._position[instant], self._force[instant]
        wheels = self._height(frame, places, np.interp(places, self._grid, self._elevation))
        self._hanging.move(places[0], wheels)
        for transform, wheel in zip(self._wheels, wheels, strict=True):
            transform.clear().scale(-1.0, 1.0).translate(places[0], wheel)
        for arrow, place, force, wheel in zip(self._arrows, places, forces, wheels, strict=True):
            tip = wheel - self._arrow_scale * max(0.0, force)
            arrow.shaft.set_data([place, place], [wheel, tip])
            arrow.head.set_data([place], [tip])
            arrow.label.set_position((place, tip - 0.06 * self._inch))
            arrow.label.set_text(f"{force * KN:.0f}")

    def _show_deflection(self, frame: int) -> None:
        first, last = np.searchsorted(self._x, self._road.get_xlim())
        nodes = slice(max(0, int(first) - 1), int(last) + 1)
        x, now = self._x[nodes], self._deflection[self.shots.instants[frame], nodes] * MM
        self._line.set_data(x, now)
        self._past.set_data(x, self._lowest_so_far[frame, nodes] * MM)
        self._fill.set_xy(_between(x, now, 0.0))


class _Gif(PillowWriter):
    """Frames in one set of colours, of which only what changes is written."""

    def __init__(self, fps: float) -> None:
        super().__init__(fps=fps)  # type: ignore[arg-type]
        self._taken: list[Image.Image] = []

    def grab_frame(self, **_: Any) -> None:
        """Take the figure as it was just drawn."""
        canvas = self.fig.canvas
        assert isinstance(canvas, FigureCanvasAgg)
        pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        self._taken.append(Image.fromarray(pixels).convert("RGB"))

    def finish(self) -> None:
        """Write the file."""
        palette = _palette(self._taken[len(self._taken) // 2])
        first, *others = (
            frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in self._taken
        )
        first.save(
            self.outfile,
            format="GIF",
            save_all=True,
            append_images=others,
            duration=round(1e3 / self.fps),
            loop=0,
        )


def _palette(frame: Image.Image) -> Image.Image:
    """Choose the colours of a GIF: those of areas as they are, and what is between them."""
    pixels = frame.width * frame.height
    areas = [found for count, found in frame.getcolors(pixels) or [] if count > 0.02 * pixels]
    others = frame.quantize(COLOURS - len(areas), method=Image.Quantize.MAXCOVERAGE).getpalette()
    palette = Image.new("P", (1, 1))
    palette.putpalette([*np.ravel(areas).tolist(), *(others or [])])
    return palette


def _page(film: Film, title: str) -> str:
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head><meta charset="utf-8">'
        f"<title>{escape(title)}</title></head>\n<body>{film.to_jshtml()}</body>\n</html>\n"
    )


def _surface(
    scenario: Scenario, nodes: NDArray[np.float64], start: float, end: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places between which the road is drawn straight, m from its beginning, and elevations."""
    profile = scenario.profile
    places = [nodes, np.array([start, end])]
    if profile is None:
        grid = np.unique(np.concatenate(places))
        return grid, np.zeros(grid.size)
    origin = float(profile.x[0]) + scenario.run_in
    samples = profile.x - origin
    samples = samples[(samples > start) & (samples < end)]
    if scenario.interpolation == "linear":
        grid = np.unique(np.concatenate([*places, samples]))
        return grid, profile.elevation(grid + origin)
    # A step is drawn from just ahead of a sample.
    grid = np.unique(np.concatenate([*places, samples, samples - 1e-6]))
    sample = np.searchsorted(profile.x, grid + origin + 1e-9, side="right") - 1
    return grid, profile.z[np.clip(sample, 0, profile.z.size - 1)]


def _running_lowest(
    deflection: NDArray[np.float64], instants: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Lowest deflection of each node up to each of the instants."""
    starts = np.concatenate([[0], instants[:-1] + 1])
    return np.minimum.accumulate(
        np.minimum.reduceat(deflection[: instants[-1] + 1], starts, axis=0), axis=0
    )


def _between(
    x: NDArray[np.float64], one: NDArray[np.float64], other: NDArray[np.float64] | float
) -> NDArray[np.float64]:
    """Corners of what is between two lines; none where there is nothing."""
    other = np.broadcast_to(other, x.shape)
    return np.column_stack([np.concatenate([x, x[::-1]]), np.concatenate([one, other[::-1]])])


def _added(axes: Axes, draw: Callable[[Axes], None]) -> list[Artist]:
    """Draw, and return what was added."""
    before = set(axes.get_children())
    draw(axes)
    return [artist for artist in axes.get_children() if artist not in before]


def _checked(name: str, scale: float) -> float:
    scale = finite_number(name, scale)
    if not scale > 0.0:
        raise ValueError(f"{name} = {scale:g}: must be finite and above 0")
    return scale
