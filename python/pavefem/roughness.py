"""Roughness of profiles: IRI, spectral density, ISO 8608 classes, and filters.

Sources
-------
Sayers, "On the calculation of international roughness index from longitudinal road profile",
    Transportation Research Record 1501 (1995); ASTM E1926: the golden car and its algorithm.
Sayers, Gillespie and Paterson, World Bank Technical Paper 46 (1986), and ASTM E1364: profiles of
    Class 1 are sampled at least every 0.25 m.
ISO 8608: displacement PSD, octave bands, the fitted straight line and the classes.
Kamash and Robson, "The application of isotropy in road surface modelling", Journal of Sound and
    Vibration 57 (1978), after Dodds and Robson, 31 (1973): coherence of two tracks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from pavefem import _core
from pavefem._validity import warn_validity
from pavefem.profile import ISO8608_CENTRES, ISO8608_N0, UNIFORM_TOLERANCE, Profile

# scipy.signal and scipy.special take longer to import than all of pavefem: where they are needed.

__all__ = [
    "RoadClass",
    "butterworth",
    "iri",
    "iso8608_class",
    "moving_average",
    "mri",
    "octave_means",
    "psd",
    "track_coherence",
    "wheel_tracks",
]

PSD_WINDOW: Final = 400.0
"""Shortest window of `psd` on a long profile, m: the octave from 0.011 cycle/m is resolved."""

RESOLVED: Final = 4.0
"""Lower limit of the lowest octave that is averaged, in steps of the spatial frequency.

Below it a Hann window lets in too much of the longer waves: 25 % and more for a waviness of 2.
"""

OCTAVES: Final = tuple(2.0**k for k in range(-6, 2))
"""Centres of the octave bands of ISO 8608 for roads, 0.011 to 2.83 cycle/m."""


def iri(
    profile: Profile, *, segment: float | None = None, moving_average: bool = True
) -> xr.DataArray:
    """International roughness index, in m/km.

    The mean of ``|z_s' - z_u'|``, the difference in slope between the paths of sprung and unsprung
    mass of the golden car, a quarter car at 80 km/h. The slope of the road is constant from each
    sample to the next. The car starts with the mean slope of the first 11 m.

    Parameters
    ----------
    profile : Profile
        Uniform stations, no more than 0.25 m apart. Each track is a road of its own.
    segment : float, optional
        Length of segments, m, counted from the first station; by default the profile is one. The
        car runs on from one to the next. The last one may be shorter, as its `length` says; what
        is left of the profile is no segment where it is too short for the moving average.
    moving_average : bool, optional
        Whether elevations are averaged over 0.25 m, to the nearest number of samples: the slope is
        that of a chord so long. It has no effect on samples 0.167 m apart or more. False is for
        profiles that were smoothed before.

    Returns
    -------
    xarray.DataArray
        IRI, m/km: of dimension `track` for a profile with several, and `start` with segments, the
        station (m) where a segment starts, which has another coordinate `length` (m). Without
        either it holds one number, and `float` gives it.

    Raises
    ------
    ValueError
        If stations are irregular or more than 11 m apart, if the profile is shorter than the
        moving average, or a segment shorter than the spacing.

    Warns
    -----
    ValidityWarning
        For stations more than 0.25 m apart, where waves that count are lost, and for a profile
        shorter than 11 m, where what is found depends on the start.

    See Also
    --------
    mri : Mean of both wheel tracks.

    Examples
    --------
    >>> road = Profile.iso8608("B", length=250.0, spacing=0.25, seed=1)
    >>> print(f"{road.iri():.2f} m/km")
    4.30 m/km
    >>> iri(road, segment=100.0).length.values
    array([100., 100.,  50.])
    """
    spacing = _uniform_spacing(profile, "IRI")
    # What was interpolated from coarser samples has no more waves than they.
    coarsest = spacing
    if profile.source is not None and profile.source.resampled_from is not None:
        coarsest = max(spacing, profile.source.resampled_from[1])
    if coarsest > _core.IRI_BASE * (1.0 + UNIFORM_TOLERANCE):
        where = "in the file " if coarsest > spacing else ""
        _warn(
            f"the samples of the profile are {where}up to {coarsest:g} m apart; IRI is for "
            f"{_core.IRI_BASE:g} m and less, shorter waves count in it"
        )
    if profile.length < _core.IRI_START * (1.0 - 1e-9):
        _warn(
            f"the profile is {profile.length:g} m long; IRI starts with the slope of "
            f"{_core.IRI_START:g} m, and on less depends on the start"
        )
    length = None if segment is None else float(segment)
    rows = [_core.iri(z, spacing, bool(moving_average), length) for z in profile.by_track.values()]
    index = _labelled(profile, np.stack(rows), "start").rename("iri")
    index.attrs = {"units": "m/km", "long_name": "international roughness index"}
    if length is None:
        return index.isel(start=0)
    offset = length * np.arange(rows[0].size)
    lengths = np.minimum(length, profile.length - offset)
    metres = {"units": "m"}
    return index.assign_coords(
        start=("start", profile.x[0] + offset, metres | {"long_name": "start of the segment"}),
        length=("start", lengths, metres | {"long_name": "length of the segment"}),
    )


def mri(
    profile: Profile, *, segment: float | None = None, moving_average: bool = True
) -> xr.DataArray:
    """Mean roughness index, in m/km: the mean of the IRI of both wheel tracks (ASTM E1926).

    Parameters
    ----------
    profile : Profile
        With two tracks, or with tracks ``"left"`` and ``"right"`` among others.
    segment, moving_average : optional
        As those of `iri`, which also says what is raised and warned.

    Returns
    -------
    xarray.DataArray
        MRI, m/km, with dimension `start` if there are segments.

    Raises
    ------
    ValueError
        If the profile has not two wheel tracks.
    """
    if not wheel_tracks(profile):
        has = f"tracks {', '.join(profile.tracks)}" if profile.tracks else "one track"
        raise ValueError(f"MRI is the mean of two wheel tracks; the profile has {has}")
    return wheel_mean(profile, iri(profile, segment=segment, moving_average=moving_average))


def wheel_mean(profile: Profile, index: xr.DataArray) -> xr.DataArray:
    """Average an IRI, as `iri` gives it, over the two wheel tracks of its profile: the MRI."""
    mean = index.sel(track=wheel_tracks(profile)).mean("track").rename("mri")
    return mean.assign_attrs(units="m/km", long_name="mean roughness index")


def wheel_tracks(profile: Profile) -> list[str]:
    """Names of the two tracks in which the wheels of a vehicle run.

    Parameters
    ----------
    profile : Profile

    Returns
    -------
    list of str
        ``"left"`` and ``"right"`` if the profile has them, else both of its tracks if there are
        two; empty if it has not two wheel tracks.
    """
    names = list(profile.tracks)
    if {"left", "right"} <= set(names):
        return ["left", "right"]
    return names if len(names) == 2 else []


def psd(
    profile: Profile,
    *,
    quantity: Literal["displacement", "slope"] = "displacement",
    window: float | None = None,
) -> xr.DataArray:
    """One-sided power spectral density by Welch's method.

    Hann windows that overlap by half, each detrended by a straight line.

    Parameters
    ----------
    profile : Profile
        Uniform stations.
    quantity : {"displacement", "slope"}, optional
        Displacement PSD ``G_d``, m³ (that is m² per cycle/m), or slope PSD
        ``G_v = (2 pi n)² G_d``, m, which ISO 8608 calls the velocity PSD.
    window : float, optional
        Length of a window, m. By default the whole profile, or from 600 m on windows of 400 m and
        somewhat more that fill it.

    Returns
    -------
    xarray.DataArray
        PSD against `spatial_frequency`, cycle/m, from one cycle in a window to half a cycle in a
        spacing; with dimension `track` for a profile with several. Its sum times the step of the
        spatial frequency is the variance.

    Raises
    ------
    ValueError
        If stations are irregular, if the profile or `window` holds 8 samples or fewer, or if
        `window` is longer than the profile.
    """
    from scipy import signal

    if quantity not in ("displacement", "slope"):
        raise ValueError(f"quantity must be 'displacement' or 'slope', got {quantity!r}")
    spacing = _uniform_spacing(profile, "a PSD")
    samples = profile.x.size
    if samples <= 8:
        raise ValueError(f"a PSD needs more than 8 samples, the profile has {samples}")
    if window is None:
        window = 2.0 * samples * spacing / (1 + max(1, int(2 * samples * spacing / PSD_WINDOW) - 1))
    _check_length("window", window, 8 * spacing, samples * spacing, profile)
    rows = np.stack(list(profile.by_track.values()))
    with np.errstate(over="ignore", invalid="ignore"):
        n, density = signal.welch(
            rows,
            fs=1.0 / spacing,
            window="hann",
            nperseg=round(window / spacing),
            detrend=signal.detrend,
        )
    if not np.isfinite(density).all():
        raise ValueError(f"elevations of {np.abs(rows).max():g} m are too large for a PSD")
    n, density = n[1:], density[:, 1:]
    if quantity == "slope":
        density = density * (2.0 * np.pi * n) ** 2
    spectrum = _labelled(profile, density, "spatial_frequency").rename(f"{quantity}_psd")
    spectrum.attrs = {
        "units": "m^3" if quantity == "displacement" else "m",
        "long_name": f"{quantity} PSD",
    }
    frequency = ("spatial_frequency", n, {"units": "cycle/m"})
    return spectrum.assign_coords(spatial_frequency=frequency)


def octave_means(spectrum: xr.DataArray) -> xr.DataArray:
    """Means of a PSD over the octave bands of ISO 8608.

    Parameters
    ----------
    spectrum : xarray.DataArray
        PSD, as `psd` gives it.

    Returns
    -------
    xarray.DataArray
        PSD against the `spatial_frequency` at the centre of each octave, 1/64 to 2 cycle/m. Only
        octaves that the spectrum holds whole are there, and that start at 4 cycles in a window or
        more.
    """
    n = spectrum["spatial_frequency"].to_numpy()
    if n.size < 2:
        raise ValueError(f"the spectrum holds {n.size} frequencies: must be at least 2")
    step, centres = float(n[1] - n[0]), np.array(OCTAVES)
    low, high = centres / math.sqrt(2.0), centres * math.sqrt(2.0)
    # Each line of the spectrum holds for half a step to both sides.
    power = spectrum.cumsum("spatial_frequency") * step
    power = power.assign_coords(spatial_frequency=n + 0.5 * step)
    above, below = (power.interp(spatial_frequency=limits) for limits in (high, low))
    means: xr.DataArray = (above - below.to_numpy()) / (high - low)
    means = means.assign_coords(
        spatial_frequency=("spatial_frequency", centres, {"units": "cycle/m"})
    )
    whole = (low >= max(RESOLVED * step, n[0] - 0.5 * step)) & (high <= n[-1])
    return means[..., whole].assign_attrs(spectrum.attrs)


@dataclass(frozen=True)
class RoadClass:
    """Road class of ISO 8608, from the straight line ``G_d(n) = G_d(n0) (n / n0)**-w``."""

    road_class: str
    """Letter of the class, A to H."""
    gd_n0: float
    """Displacement PSD of the line at n0 = 0.1 cycle/m, m³."""
    waviness: float
    """Exponent w of the line."""
    band: tuple[float, float]
    """Spatial frequencies between which it was fitted, cycle/m."""


def iso8608_class(profile: Profile) -> RoadClass:
    """Fit the straight line of ISO 8608 to the PSD of a profile, and class the road by it.

    The line is the least-squares one, in logarithms, through the means of the displacement PSD
    over the octaves from 0.011 to 2.83 cycle/m, as far as the profile holds them (`octave_means`).
    The mean over an octave is the value at its centre for a waviness of 2; it is 6 % above for one
    of 3. A class reaches from half to twice its centre: A ends at 32e-6 m³, and each other class
    at four times the end of the one before it. The road is of the class in which ``G_d(n0)`` lies,
    of A or H beyond them.

    Parameters
    ----------
    profile : Profile
        Uniform stations; of several tracks the first is taken.

    Returns
    -------
    RoadClass

    Raises
    ------
    ValueError
        If stations are irregular, if the profile holds fewer than two of the octaves, or if it is
        smooth.
    """
    octaves = octave_means(psd(replace(profile, tracks={})))
    n = octaves["spatial_frequency"].to_numpy()
    if n.size < 2:
        raise ValueError(
            f"a class needs 2 octaves of the PSD, each from 4 cycles in the profile up to half a "
            f"cycle in a spacing, between 0.011 and 2.83 cycle/m; the profile, {profile.length:g} "
            f"m long with samples every {profile.spacing:g} m, holds {n.size}"
        )
    if not octaves.min() > 0.0:
        raise ValueError("a class needs a rough profile; some octave of its PSD is zero")
    slope, level = np.polyfit(np.log(n / ISO8608_N0), np.log(octaves.to_numpy()), 1)
    gd_n0 = math.exp(level)
    letter = next((c for c, centre in ISO8608_CENTRES.items() if gd_n0 < 2.0 * centre), "H")
    band = float(n[0] / math.sqrt(2.0)), float(n[-1] * math.sqrt(2.0))
    return RoadClass(letter, gd_n0, -float(slope), band)


def track_coherence(
    n: ArrayLike, track_width: float, waviness: float = 2.0
) -> np.float64 | NDArray[np.float64]:
    """Cross-PSD of two parallel tracks on an isotropic surface, over the PSD of each.

    ``g(n) = 2 (pi n B)**nu K_nu(2 pi n B) / Gamma(nu)`` with ``nu = w / 2``; for w = 2 it is
    ``2 pi n B K_1(2 pi n B)``. A surface alike in all directions has a spectrum
    ``S(k) ~ k**-(w + 1)`` of the wave vector's length if its tracks have ``G_d(n) ~ n**-w``, and g
    is the integral of ``S(sqrt(n² + m²)) cos(2 pi m B)`` over the frequency m across the tracks,
    over the same integral without the cosine (Basset's integral of K_nu).

    Parameters
    ----------
    n : array_like
        Spatial frequency, cycle/m, above 0.
    track_width : float
        Distance B between the tracks, m.
    waviness : float, optional
        Exponent w of the PSD, above 0.

    Returns
    -------
    float64 or ndarray, shape of `n`
        From 1 for waves much longer than the track width to 0 for much shorter ones. The ordinary
        coherence is its square.

    Raises
    ------
    ValueError
        If an argument is not above 0.
    """
    from scipy import special

    frequency = np.asarray(n, dtype=np.float64)
    for name, values in (
        ("n", frequency),
        ("track_width", np.float64(track_width)),
        ("waviness", np.float64(waviness)),
    ):
        if not (np.isfinite(values) & (values > 0.0)).all():
            raise ValueError(f"{name} must be above 0 and finite, got {values}")
    nu, half = 0.5 * waviness, np.pi * frequency * track_width
    log = nu * np.log(half) - special.gammaln(nu) - 2.0 * half
    with np.errstate(over="ignore", invalid="ignore"):  # of K_nu near 0, where g is 1
        g = 2.0 * np.exp(log) * special.kve(nu, 2.0 * half)
    coherence: NDArray[np.float64] = np.where(np.isfinite(g), np.minimum(g, 1.0), 1.0)
    return coherence[()]


def moving_average(profile: Profile, base: float) -> Profile:
    """Average the profile over a base around each station: a low-pass.

    The mean of the profile, linear between samples, from half a base behind a station to half a
    base ahead. Waves of the spatial frequency n are left with ``sin(pi b n) / (pi b n)`` of their
    amplitude. Within half a base of an end, the base is shortened on both sides alike, to nothing
    at the end itself, so that straight lines stay as they are. Stations need not be uniform.

    Parameters
    ----------
    profile : Profile
        Profile; every track of it is averaged.
    base : float
        Base b, m, at most the length of the profile.

    Returns
    -------
    Profile

    Raises
    ------
    ValueError
        If `base` is not above 0 or longer than the profile.
    """
    _check_length("base", base, 0.0, profile.length, profile)
    x = profile.x
    half = np.minimum(0.5 * base, np.minimum(x - x[0], x[-1] - x))
    inside = half > 0.0
    places = np.stack([(x - half)[inside], (x + half)[inside]])
    cell = np.clip(np.searchsorted(x, places, side="right") - 1, 0, x.size - 2)
    into = places - x[cell]

    def average(z: NDArray[np.float64]) -> NDArray[np.float64]:
        level = float(z.mean())
        z = z - level
        areas = np.concatenate([[0.0], np.cumsum(0.5 * (z[1:] + z[:-1]) * np.diff(x))])
        slope = np.diff(z) / np.diff(x)
        to_left, to_right = areas[cell] + into * (z[cell] + 0.5 * into * slope[cell])
        averaged = z.copy()
        averaged[inside] = (to_right - to_left) / (2.0 * half[inside])
        return averaged + level

    return _filtered(profile, average)


def butterworth(
    profile: Profile,
    *,
    shortest: float | None = None,
    longest: float | None = None,
    order: int = 4,
) -> Profile:
    """Keep the waves of a range of wavelengths: Butterworth filters, forth and back.

    `shortest` makes a low-pass (of spatial frequency), `longest` a high-pass, both a band-pass. No
    wave is shifted. A wave of the spatial frequency n keeps ``1 / (1 + r**(2 order))`` of its
    amplitude, half of it at the limit: ``r = tan(pi n d) / tan(pi d / l)`` for the shortest
    wavelength l and the spacing d, the inverse of it for the longest.

    Beyond each end the profile goes on as its point reflection in the end (an odd extension), as
    far as the transients last: what lies within a wavelength of a limit from an end depends on it.

    Parameters
    ----------
    profile : Profile
        Uniform stations; every track is filtered.
    shortest, longest : float, optional
        Wavelengths, m, at least one of them; longer than two spacings, shorter than the profile.
    order : int, optional
        Order of the filter that is run forth and then back, 1 to 10.

    Returns
    -------
    Profile

    Raises
    ------
    ValueError
        If stations are irregular or an argument is out of range.
    """
    from scipy import signal

    spacing = _uniform_spacing(profile, "a Butterworth filter")
    if shortest is None and longest is None:
        raise ValueError("give the shortest wavelength to keep, the longest, or both")
    if shortest is not None and longest is not None and not shortest < longest:
        raise ValueError(f"shortest = {shortest:g} m must be below longest = {longest:g} m")
    if not (isinstance(order, int | np.integer) and 1 <= order <= 10):
        raise ValueError(f"order must be a whole number from 1 to 10, got {order!r}")
    limits: tuple[tuple[str, Literal["lowpass", "highpass"], float | None], ...] = (
        ("shortest", "lowpass", shortest),
        ("longest", "highpass", longest),
    )
    sections, padding = [], 0  # as the longer of the limits calls for, which comes last
    for name, kind, limit in limits:
        if limit is not None:
            _check_length(name, limit, 2.0 * spacing, profile.length, profile)
            sections.append(signal.butter(order, 1.0 / limit, kind, output="sos", fs=1.0 / spacing))
            padding = min(profile.x.size - 1, math.ceil(order * limit / spacing))
    cascade = np.vstack(sections)
    return _filtered(profile, lambda z: signal.sosfiltfilt(cascade, z, padlen=padding))


def _labelled(profile: Profile, rows: NDArray[np.float64], along: str) -> xr.DataArray:
    """Label rows, one for each track, with the tracks' names; a single track has no dimension."""
    array = xr.DataArray(rows, dims=("track", along))
    if profile.tracks:
        return array.assign_coords(track=list(profile.tracks))
    return array.isel(track=0)


def _filtered(
    profile: Profile, filtered: Callable[[NDArray[np.float64]], NDArray[np.float64]]
) -> Profile:
    """Filter every track of a profile."""
    tracks = {name: filtered(z) for name, z in profile.tracks.items()}
    z = next(iter(tracks.values())) if tracks else filtered(profile.z)
    return replace(profile, z=z, tracks=tracks)


def _uniform_spacing(profile: Profile, what: str) -> float:
    if not profile.is_uniform:
        steps = np.diff(profile.x)
        raise ValueError(
            f"{what} needs uniform stations; those of the profile are {steps.min():g} to "
            f"{steps.max():g} m apart: resample it first, profile.resample({profile.spacing:.3g})"
        )
    return profile.length / (profile.x.size - 1)


def _check_length(name: str, value: float, low: float, high: float, profile: Profile) -> None:
    """Check that a length in m is above `low` and not above `high`."""
    rounding = 1.0 + 1e-9
    if not low * rounding < value <= high * rounding:
        raise ValueError(
            f"{name} = {value!r} m: must be above {low:g} m and at most {high:g} m for a profile "
            f"{profile.length:g} m long with samples every {profile.spacing:g} m"
        )


def _warn(message: str) -> None:
    warn_validity(message, stacklevel=3)
