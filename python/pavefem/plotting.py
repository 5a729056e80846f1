"""Figures for a report: deflections in mm, forces in kN, places in m."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pavefem.profile import ISO8608_CENTRES, ISO8608_N0

if TYPE_CHECKING:
    from pavefem.profile import Profile
    from pavefem.result import Result

MM: Final = 1e3
KN: Final = 1e-3
AXLE_COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")


def plot_result(result: Result, x: float | None = None) -> Figure:
    """Draw a run: history at `x`, worst instant, envelope, tire forces along the road.

    Parameters
    ----------
    result : Result
        The run; panels whose history it did not keep are left out.
    x : float, optional
        Place of the history, m; by default the node or station nearest to mid-length.

    Returns
    -------
    matplotlib.figure.Figure
        Made without touching the current figure; ``figure.savefig(path)`` writes it.
    """
    panels = [draw_envelope]
    if result.deflection is not None:
        places = result.places
        middle = places[np.abs(places - result.scenario.road.length / 2.0).argmin()]
        place = float(middle if x is None else x)
        panels.insert(0, lambda axes, result: draw_history(axes, result, place))
        if result.stations is None and result.forces is not None:
            panels.insert(1, draw_worst_instant)
    if result.forces is not None:
        panels.append(draw_forces)
    columns = 1 if len(panels) == 1 else 2
    rows = -(-len(panels) // columns)
    figure = plt.figure(figsize=(6.0 * columns, 3.4 * rows + 0.5), layout="constrained")
    for number, panel in enumerate(panels, start=1):
        panel(figure.add_subplot(rows, columns, number), result)
    scenario = result.scenario
    profile = "smooth road" if scenario.profile is None else scenario.profile.name
    figure.suptitle(
        f"{scenario.vehicle.name}, {scenario.speed_kmh:g} km/h, "
        f"{scenario.temperature_c:g} °C, {profile}"
    )
    plt.close(figure)  # the caller shows or saves it; pyplot need not keep it
    return figure


def draw_history(axes: Axes, result: Result, x: float) -> None:
    """Draw the deflection at `x` over time, marking when each axle passes."""
    history = result.history(x)
    axes.plot(result.time, history.to_numpy() * MM, color="black", linewidth=1.2)
    if result.forces is not None:
        for axle, position in enumerate(result.forces.position.T):
            if position[0] <= x <= position[-1]:
                axes.axvline(
                    np.interp(x, position, result.forces.time),
                    color=_colour(axle),
                    linewidth=0.9,
                    linestyle="--",
                    label=f"axle {axle + 1} passes",
                )
        axes.legend(fontsize="small")
    axes.set(title=f"Deflection at x = {x:g} m", xlabel="time [s]", ylabel="deflection [mm]")
    axes.grid(alpha=0.3)


def draw_worst_instant(axes: Axes, result: Result) -> None:
    """Draw the deflected shape when the deflection is largest, with the axles on the road."""
    deflection, forces = result.deflection, result.forces
    if deflection is None or forces is None:
        raise ValueError("the deflected shape needs the histories of all nodes and the forces")
    instant = int(np.abs(result.time - result.time_of_lowest[result.lowest.argmin()]).argmin())
    marker = "." if result.x.size <= 101 else ""
    axes.plot(result.x, deflection[instant] * MM, color="black", marker=marker, linewidth=1.2)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.4 * (high - low))  # room for the forces, written above the axles
    label = high + 0.38 * (high - low)
    for axle, (place, force) in enumerate(
        zip(forces.position[instant], forces.force[instant], strict=True)
    ):
        if result.x[0] <= place <= result.x[-1]:
            axes.annotate(
                f"{force * KN:.0f} kN",
                (place, np.interp(place, result.x, deflection[instant]) * MM),
                (place, label),
                ha="center",
                va="top",
                rotation=90,
                fontsize="small",
                color=_colour(axle),
                arrowprops={"arrowstyle": "->", "color": _colour(axle)},
            )
    title = f"Deflected shape at t = {result.time[instant]:.3f} s"
    axes.set(title=title, xlabel="x [m]", ylabel="deflection [mm]")
    axes.grid(alpha=0.3)


def draw_envelope(axes: Axes, result: Result) -> None:
    """Draw the extremes of every node, and the largest deflection."""
    worst = int(result.lowest.argmin())
    axes.fill_between(
        result.x, result.lowest * MM, result.highest * MM, alpha=0.25, color="#0072b2"
    )
    axes.plot(result.x, result.lowest * MM, color="#0072b2", label="lowest")
    axes.plot(result.x, result.highest * MM, color="#d55e00", label="highest")
    axes.plot(
        result.x[worst],
        result.lowest[worst] * MM,
        "v",
        color="black",
        label=f"largest deflection {result.max_deflection * MM:.3f} mm",
    )
    axes.set(title="Envelope of the deflection", xlabel="x [m]", ylabel="deflection [mm]")
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3)


def draw_forces(axes: Axes, result: Result) -> None:
    """Draw the tire force of each axle along the road, and its static load."""
    forces = result.forces
    if forces is None:
        raise ValueError("the tire forces were not kept")
    for axle, static in enumerate(forces.static_loads):
        place = forces.position[:, axle]
        on_road = (place >= result.x[0]) & (place <= result.x[-1])
        axes.plot(
            place[on_road],
            forces.force[on_road, axle] * KN,
            color=_colour(axle),
            linewidth=1.0,
            label=f"axle {axle + 1}",
        )
        axes.axhline(static * KN, color=_colour(axle), linewidth=0.7, linestyle=":")
    title = "Tire forces of each axle (dotted: static)"
    axes.set(title=title, xlabel="x [m]", ylabel="tire force [kN]")
    axes.legend(fontsize="small", ncols=min(6, forces.static_loads.size), loc="upper center")
    axes.set_ylim(top=axes.get_ylim()[1] + 0.12 * np.ptp(axes.get_ylim()))
    axes.grid(alpha=0.3)


def plot_profile(profile: Profile, road: tuple[float, float] | None = None) -> Figure:
    """Draw a profile.

    Parameters
    ----------
    profile : Profile
        The profile.
    road : (float, float), optional
        Stations between which the pavement lies, m, to be shaded.
    """
    figure = plt.figure(figsize=(9.0, 3.0), layout="constrained")
    axes = figure.add_subplot()
    level = profile.z[0]
    axes.plot(profile.x, (profile.z - level) * MM, color="black", linewidth=0.9)
    if road is not None:
        axes.axvspan(*road, color="#0072b2", alpha=0.15, label="pavement")
        axes.legend(fontsize="small")
    title = profile.name or "road profile"
    label = f"elevation above {level:.3f} m [mm]"
    axes.set(title=title, xlabel="station [m]", ylabel=label)
    axes.grid(alpha=0.3)
    plt.close(figure)
    return figure


def plot_iri(profile: Profile, segment: float = 100.0) -> Figure:
    """Draw the IRI of segments along the road, and of the whole as a line.

    Parameters
    ----------
    profile : Profile
        The profile; each of its tracks has bars of its own.
    segment : float, optional
        Length of the segments, m.
    """
    from pavefem.roughness import iri

    figure = plt.figure(figsize=(9.0, 3.4), layout="constrained")
    axes = figure.add_subplot()
    index, whole = iri(profile, segment=segment), iri(profile)
    start, length = index["start"].to_numpy(), index["length"].to_numpy()
    names = list(profile.tracks) or [""]
    width = length / len(names)
    for number, name in enumerate(names):
        bars, mean = (index[number], whole[number]) if name else (index, whole)
        axes.bar(
            start + number * width,
            bars.to_numpy(),
            width,
            align="edge",
            color=_colour(number),
            alpha=0.6,
            edgecolor="white",
            linewidth=0.5,
        )
        axes.axhline(
            float(mean),
            color=_colour(number),
            linewidth=1.2,
            linestyle="--",
            label=f"{name} {float(mean):.2f} m/km".strip(),
        )
    axes.legend(title="whole profile", fontsize="small", title_fontsize="small", ncols=len(names))
    axes.set(
        title=f"IRI on segments of {segment:g} m, {profile.name or 'road profile'}",
        xlabel="station [m]",
        ylabel="IRI [m/km]",
        xlim=(start[0], start[-1] + length[-1]),
    )
    axes.set_ylim(top=1.25 * axes.get_ylim()[1])  # room for the legend
    axes.grid(alpha=0.3, axis="y")
    plt.close(figure)
    return figure


def plot_psd(profile: Profile) -> Figure:
    """Draw the displacement PSD, its octave means, and the classes of ISO 8608.

    Parameters
    ----------
    profile : Profile
        The profile; each of its tracks is drawn.
    """
    from pavefem.roughness import octave_means, psd

    figure = plt.figure(figsize=(7.0, 5.4), layout="constrained")
    axes = figure.add_subplot()
    spectrum = psd(profile)
    octaves = octave_means(spectrum)
    for number, name in enumerate(list(profile.tracks) or [""]):
        lines, means = (spectrum[number], octaves[number]) if name else (spectrum, octaves)
        axes.loglog(
            lines["spatial_frequency"], lines, color=_colour(number), linewidth=0.7, alpha=0.6
        )
        axes.loglog(
            means["spatial_frequency"],
            means,
            "o",
            color=_colour(number),
            label=f"{name} means of octaves".strip(),
        )
    # The limits of the classes, over the band that they are for; what is far from them is left out.
    n = np.array([0.011, 2.83])
    law = (n / ISO8608_N0) ** -2
    for letter, centre in ISO8608_CENTRES.items():
        if letter != "H":
            axes.loglog(n, 2.0 * centre * law, color="black", linewidth=0.7)
        axes.annotate(
            letter, (n[1], centre * law[1]), (4, 0), textcoords="offset points", va="center"
        )
    axes.set(
        title=f"{profile.name or 'Road profile'}, classes of ISO 8608",
        xlabel="spatial frequency [cycle/m]",
        ylabel="displacement PSD [m³]",
        xlim=(0.4 * n[0], 3.0 * n[1]),
        ylim=(1e-2 * ISO8608_CENTRES["A"] * law[1], 10.0 * ISO8608_CENTRES["H"] * law[0]),
    )
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
    plt.close(figure)
    return figure


def _colour(axle: int) -> str:
    return AXLE_COLOURS[axle % len(AXLE_COLOURS)]
