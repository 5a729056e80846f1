"""A side view of a vehicle: places to scale, heights only for show."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Rectangle, Wedge

from pavefem.plotting.style import COLOURS, KN, colour, new_figure, plain

if TYPE_CHECKING:
    from pavefem.vehicle import Body, Spring, Tire, Vehicle

# Heights, m. A beam that is pinned to another hangs lower by a step.
HUB: Final = 0.5
BEAM: Final = 1.35
STEP: Final = 0.3
FRAME: Final = (1.75, 1.95)
BOX: Final = (2.1, 3.7)

OVERHANG: Final = 0.9
"""What a body has beyond its outermost support, m."""
APART: Final = 0.17
"""How far a spring and a damper stand from the place that they share, m."""
SHORTEST: Final = 7.0
"""What a picture shows at least, m."""
INK: Final = "black"
SHARED: Final = COLOURS[0]
TIRES: Final = {False: ("#dcdcdc", "single tires"), True: ("#9c9c9c", "dual tires")}
"""Colours of tires, and their names, by whether they are dual."""


def plot_vehicle(vehicle: Vehicle) -> Figure:
    """Draw a vehicle from its left, its front to the left, with its static axle loads.

    Places along the vehicle are to scale. Bodies have a mark at their centre of gravity; springs
    and dampers stand below them, walking beams and semitrailers turn about pins, and a line links
    the axles that share one spring.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    """
    view = SideView(vehicle)
    left, right = view.ends
    width = float(np.clip(0.55 * (right - left), 5.5, 13.0))
    figure = new_figure(width, 5.3 * width / (right - left) + 1.3)
    axes = figure.add_subplot()
    view.draw_bodies(axes)
    for number, (tire, load) in enumerate(zip(vehicle.tires, vehicle.static_loads, strict=True)):
        view.draw_wheel(axes, tire)
        _load(axes, tire.x, load, colour(number))
    axes.axhline(0.0, color=INK, linewidth=1.2)
    axes.set(xlim=(left, right), ylim=(-1.3, BOX[1] + 0.1), aspect="equal", yticks=[])
    axes.set_xlabel("m behind the front axle")
    axes.spines[["left", "right", "top"]].set_visible(False)
    figure.legend(handles=view.legend(), loc="outside lower center", ncols=5, fontsize="small")
    figure.suptitle(f"{plain(vehicle.name)}, {vehicle.total_mass / 1e3:.1f} t")
    return figure


class SideView:
    """What a vehicle's bodies are, and where: metres behind the front axle, heights for show."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        wheels = {tire.body for tire in vehicle.tires}
        axles = [body for body in vehicle.bodies if body.name in wheels and not body.pitch_inertia]
        self.beams = [body for body in vehicle.bodies if self._balances(body)]
        self.units = [body for body in vehicle.bodies if body not in axles + self.beams]
        self.height = {body.name: FRAME[0] for body in vehicle.bodies}
        """Where springs hang from a body or stand on it."""
        self.height.update({axle.name: HUB for axle in axles})
        for beam in self.beams:
            above = self.height[str(beam.pinned_to)]
            self.height[beam.name] = BEAM if above == FRAME[0] else above - STEP

    def supports(self, body: Body) -> list[float]:
        """Places where a body rests on springs and tires, or others are pinned to it."""
        springs = [s for s in self.vehicle.springs if s.upper == body.name]
        return [
            *(x for spring in springs for _, x in spring.lower_ends),
            *(tire.x for tire in self.vehicle.tires if tire.body == body.name),
            *(_pin(other) for other in self.vehicle.bodies if other.pinned_to == body.name),
        ]

    def _balances(self, body: Body) -> bool:
        """Whether a body is a beam, balanced on its pin; a trailer lies to one side of it."""
        supports = self.supports(body)
        return bool(supports) and min(supports) < _pin(body) < max(supports)

    def extent(self, unit: Body) -> tuple[float, float]:
        """Both ends of a unit."""
        places = [*self.supports(unit), unit.x]
        if unit.pinned_to is not None:
            places.append(_pin(unit))
        for beam in self.beams:
            if beam.pinned_to == unit.name:
                places += self.supports(beam)
        return min(places) - OVERHANG, max(places) + OVERHANG

    @cached_property
    def ends(self) -> tuple[float, float]:
        """Both ends of the picture."""
        wheels = [(tire.x - 1.0, tire.x + 1.0) for tire in self.vehicle.tires]
        extents = [*map(self.extent, self.units), *wheels]
        left, right = min(start for start, _ in extents), max(end for _, end in extents)
        margin = max(0.4, (SHORTEST - (right - left)) / 2.0)
        return left - margin, right + margin

    def draw_bodies(self, axes: Axes) -> None:
        """Draw all but the wheels."""
        for unit in self.units:
            self._draw_unit(axes, unit)
        for beam in self.beams:
            self._draw_beam(axes, beam)
        for spring in self.vehicle.springs:
            self._draw_spring(axes, spring)
        for tire in self.vehicle.tires:
            # What joins a wheel to a body that has no axle.
            if self.height[tire.body] > HUB:
                _line(axes, [tire.x, tire.x], [HUB, self.height[tire.body]], width=2.0)

    def draw_wheel(self, axes: Axes, tire: Tire) -> None:
        """Draw a wheel."""
        for radius, face in ((HUB, TIRES[tire.dual][0]), (0.6 * HUB, "white")):
            axes.add_patch(Circle((tire.x, HUB), radius, facecolor=face, edgecolor=INK, zorder=1.5))
        axes.plot(tire.x, HUB, "o", color=INK, markersize=4.0)

    def _draw_unit(self, axes: Axes, unit: Body) -> None:
        """Draw a frame, and on it a box as far as a semitrailer leaves room."""
        left, right = self.extent(unit)
        start, end = left, right
        for other in self.units:
            if other.name == unit.pinned_to:
                start = min(self.extent(other)[1] + 0.15, *self.supports(unit))
                _draw_pin(axes, _pin(unit), (FRAME[1] + BOX[0]) / 2.0)
            if other.pinned_to == unit.name:
                end = min(end, self.extent(other)[0] - 0.15)
        _box(axes, start, right, FRAME)
        boxed = end - left > 1.5 * OVERHANG
        if boxed:
            _box(axes, left, end, BOX)
            for x in (max(left, start) + 0.3, end - 0.3):
                _line(axes, [x, x], [FRAME[1], BOX[0]])
        middle = sum(BOX if boxed and left < unit.x < end else FRAME) / 2.0
        _centre_of_gravity(axes, unit, middle)

    def _draw_beam(self, axes: Axes, beam: Body) -> None:
        """Draw a walking beam, and what holds its pin."""
        places, pin, height = self.supports(beam), _pin(beam), self.height[beam.name]
        _line(axes, [min(places) - APART, max(places) + APART], [height, height], width=4.0)
        _line(axes, [pin, pin], [height, self.height[str(beam.pinned_to)]], width=2.0)
        _draw_pin(axes, pin, height)

    def _draw_spring(self, axes: Axes, spring: Spring) -> None:
        """Draw a spring, a damper, or both beside each other."""
        top = self.height[spring.upper]
        shared = len(spring.lower_ends) > 1
        for body, x in spring.lower_ends:
            bottom = self.height[body]
            if shared:
                _bellows(axes, x - APART, bottom, top)
            elif spring.stiffness > 0.0:
                _coil(axes, x - APART, bottom, top)
            if spring.damping > 0.0:
                _damper(axes, x + APART, bottom, top)
        if shared:
            places = [x - APART for _, x in spring.lower_ends]
            height = 0.3 * HUB + 0.7 * top
            _line(axes, [min(places), max(places)], [height, height], ink=SHARED, width=1.5)

    def legend(self) -> list[Line2D | Patch]:
        """Explain what there is."""
        entries: list[Line2D | Patch] = [
            Patch(facecolor=TIRES[dual][0], edgecolor=INK, label=TIRES[dual][1])
            for dual in sorted({tire.dual for tire in self.vehicle.tires})
        ]
        if any(body.pinned_to is not None for body in self.vehicle.bodies):
            entries.append(
                Line2D([], [], color=INK, marker="o", mfc="white", linestyle="", label="pin")
            )
        if any(len(spring.lower_ends) > 1 for spring in self.vehicle.springs):
            entries.append(Line2D([], [], color=SHARED, label="load-sharing spring"))
        return entries


def _pin(body: Body) -> float:
    """Place of a body's pin; nowhere if it has none."""
    return float("nan") if body.pin is None else body.pin


def _line(
    axes: Axes, x: list[float], y: list[float], *, ink: str = INK, width: float = 1.1
) -> None:
    axes.plot(x, y, color=ink, linewidth=width, solid_capstyle="round")


def _box(axes: Axes, left: float, right: float, heights: tuple[float, float]) -> None:
    bottom, top = heights
    box = Rectangle((left, bottom), right - left, top - bottom, facecolor="#f0f0f0", edgecolor=INK)
    axes.add_patch(box)


def _draw_pin(axes: Axes, x: float, height: float) -> None:
    axes.plot(x, height, "o", color=INK, markerfacecolor="white", markersize=5.5, zorder=5.0)


def _centre_of_gravity(axes: Axes, body: Body, height: float) -> None:
    place, radius = (body.x, height), 0.2
    axes.add_patch(Circle(place, radius, facecolor="white", edgecolor=INK, zorder=3.0))
    for angle in (0.0, 180.0):
        axes.add_patch(Wedge(place, radius, angle, angle + 90.0, facecolor=INK, zorder=3.0))
    axes.text(body.x + 0.3, height, f"{body.mass / 1e3:.1f} t", va="center", fontsize="small")


def _coil(axes: Axes, x: float, bottom: float, top: float) -> None:
    side = [0.0, 0.1, -0.1, 0.1, -0.1, 0.1, -0.1, 0.1, -0.1, 0.0]
    wound = bottom + (top - bottom) * np.linspace(0.12, 0.88, len(side))
    _line(axes, [x, *(x + step for step in side), x], [bottom, *wound, top])


def _bellows(axes: Axes, x: float, bottom: float, top: float) -> None:
    _line(axes, [x, x], [bottom, top], ink=SHARED)
    for part in (0.475, 0.725):
        place, radius = (x, bottom + part * (top - bottom)), 0.125 * (top - bottom)
        axes.add_patch(Circle(place, radius, facecolor="white", edgecolor=SHARED, zorder=4.0))


def _damper(axes: Axes, x: float, bottom: float, top: float) -> None:
    low, middle, high = (bottom + part * (top - bottom) for part in (0.3, 0.475, 0.65))
    left, right = x - 0.08, x + 0.08
    _line(axes, [x, x], [bottom, low])
    _line(axes, [left, left, right, right], [high, low, low, high])
    _line(axes, [left, right], [middle, middle])
    _line(axes, [x, x], [middle, top])


def _load(axes: Axes, x: float, load: float, ink: str) -> None:
    arrow = {"arrowstyle": "-|>", "color": ink, "linewidth": 1.6}
    axes.annotate("", (x, -0.75), (x, 0.0), arrowprops=arrow)
    axes.text(x, -0.8, f"{load * KN:.1f} kN", ha="center", va="top", fontsize="small", color=ink)
