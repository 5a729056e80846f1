"""Pictures of profiles: elevations, IRI and spectral density."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from pavefem.plotting.style import MM, colour, draw_line, new_figure, plain
from pavefem.profile import ISO8608_CENTRES, ISO8608_N0, Profile
from pavefem.roughness import iri, octave_means, psd


def plot_profile(profile: Profile, road: tuple[float, float] | None = None) -> Figure:
    """Draw a profile.

    Parameters
    ----------
    profile : Profile
        The profile.
    road : (float, float), optional
        Stations between which the pavement lies, m, to be shaded.
    """
    figure = new_figure(9.0, 3.0)
    axes = figure.add_subplot()
    level = profile.z[0]
    draw_line(axes, profile.x, (profile.z - level) * MM, "black", linewidth=0.9)
    if road is not None:
        axes.axvspan(*road, color=colour(0), alpha=0.15, label="pavement")
        axes.legend(fontsize="small")
    title = plain(profile.name) or "road profile"
    label = f"elevation above {level:.3f} m [mm]"
    axes.set(title=title, xlabel="station [m]", ylabel=label)
    axes.grid(alpha=0.3)
    return figure


def plot_iri(profile: Profile, segment: float = 100.0) -> Figure:
    """Draw the IRI of segments along the road, and of the whole as a line.

    Parameters
    ----------
    profile : Profile
        The profile; each of its tracks has a line of its own.
    segment : float, optional
        Length of the segments, m.
    """
    figure = new_figure(9.0, 3.4)
    axes = figure.add_subplot()
    index, whole = iri(profile, segment=segment), iri(profile)
    start, length = index["start"].to_numpy(), index["length"].to_numpy()
    edges = np.append(start, start[-1] + length[-1])
    tracks = len(profile.by_track)
    rows, means = index.to_numpy().reshape(tracks, -1), whole.to_numpy().ravel()
    for number, (name, steps, mean) in enumerate(zip(profile.by_track, rows, means, strict=True)):
        if tracks == 1:
            axes.stairs(steps, edges, color=colour(number), alpha=0.25, fill=True)
        axes.stairs(steps, edges, baseline=None, color=colour(number), linewidth=1.8)
        axes.axhline(
            mean,
            color=colour(number),
            linewidth=1.2,
            linestyle="--",
            label=f"{name} {mean:.2f} m/km".strip(),
        )
    axes.legend(title="whole profile", fontsize="small", title_fontsize="small", ncols=tracks)
    axes.set(
        title=f"IRI on segments of {segment:g} m, {plain(profile.name) or 'road profile'}",
        xlabel="station [m]",
        ylabel="IRI [m/km]",
        xlim=(edges[0], edges[-1]),
    )
    axes.set_ylim(0.0, 1.3 * float(rows.max()))  # room for the legend
    axes.grid(alpha=0.3, axis="y")
    return figure


def plot_psd(profile: Profile) -> Figure:
    """Draw the displacement PSD, its octave means, and the classes of ISO 8608.

    Parameters
    ----------
    profile : Profile
        The profile; each of its tracks is drawn.
    """
    figure = new_figure(7.0, 5.4)
    axes = figure.add_subplot()
    spectrum = psd(profile)
    octaves = octave_means(spectrum)
    rows = (np.atleast_2d(values) for values in (spectrum, octaves))
    for number, (name, lines, means) in enumerate(zip(profile.by_track, *rows, strict=True)):
        axes.loglog(
            spectrum["spatial_frequency"], lines, color=colour(number), linewidth=0.7, alpha=0.6
        )
        axes.loglog(
            octaves["spatial_frequency"],
            means,
            "o",
            color=colour(number),
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
        title=f"{plain(profile.name) or 'Road profile'}, classes of ISO 8608",
        xlabel="spatial frequency [cycle/m]",
        ylabel="displacement PSD [m³]",
        xlim=(0.4 * n[0], 3.0 * n[1]),
        ylim=(1e-2 * ISO8608_CENTRES["A"] * law[1], 10.0 * ISO8608_CENTRES["H"] * law[0]),
    )
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
    return figure
