"""Longitudinal road profiles: elevation against station along one wheel track."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final, Literal, Self, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

ISO8608_CENTRES: Final[dict[str, float]] = {
    "A": 16e-6,
    "B": 64e-6,
    "C": 256e-6,
    "D": 1024e-6,
    "E": 4096e-6,
    "F": 16384e-6,
    "G": 65536e-6,
    "H": 262144e-6,
}
"""Class centres of ISO 8608: G_d(n0), displacement PSD at n0 = 0.1 cycle/m, in m^3."""

ISO8608_N0: Final = 0.1
"""Reference spatial frequency of ISO 8608, cycle/m."""

UNIFORM_TOLERANCE: Final = 1e-3
"""Largest distance of a station from the uniform grid, as a fraction of the spacing."""

MAX_SAMPLES: Final = 100_000_000
"""Most samples that are generated or resampled in one profile (5000 km at 0.05 m)."""

UNIT_ORIGINS: Final = {"header": "the file says", "option": "as told", "default": "by default"}
"""Where a unit comes from, for people to read."""


@dataclass(frozen=True)
class ProfileSource:
    """What was understood of the file that a profile was read from.

    Parameters
    ----------
    path : str
        The file, as it was given.
    rows : int
        Samples in the file.
    header : tuple of str
        Column names as written in the file; empty without a header.
    columns : tuple of int
        Columns of station and of the elevation of each track, counted from 0; the station's is
        -1 where a spacing, of the file or of the caller, stands for it.
    delimiter, decimal : str, optional
        Field delimiter (a blank stands for any whitespace) and decimal mark of a text file.
    units : tuple of str
        Units of station and of each track in the file; the profile itself is in m.
    units_from : tuple of str
        Where each unit comes from: ``"header"``, ``"option"`` or ``"default"``.
    stations : {"as read", "rounding removed", "resampled"}
        ``"rounding removed"`` is a uniform grid whose printed stations were rounded;
        ``"resampled"`` is linear interpolation onto a uniform grid.
    resampled_from : tuple of float, optional
        Smallest and largest spacing in the file (m), where stations are not as read.
    format : str
        What kind of file it is, for people to read.
    """

    path: str
    rows: int
    header: tuple[str, ...] = ()
    columns: tuple[int, ...] = (0, 1)
    delimiter: str | None = None
    decimal: str | None = None
    units: tuple[str, ...] = ("m", "m")
    units_from: tuple[str, ...] = ("default", "default")
    stations: Literal["as read", "rounding removed", "resampled"] = "as read"
    resampled_from: tuple[float, float] | None = None
    format: str = ""

    def summary(self) -> dict[str, str]:
        """Return what was understood of the file, as text, by what it is."""
        columns = [i for i in self.columns if i >= 0] if self.header else []
        quantities = ["station", *["elevation"] * (len(self.units) - 1)]
        units = dict.fromkeys(
            f"{quantity} {unit} ({UNIT_ORIGINS[origin]})"
            for quantity, unit, origin in zip(quantities, self.units, self.units_from, strict=True)
        )
        stations: str = self.stations
        if self.resampled_from is not None:
            low, high = self.resampled_from
            stations += f", {low:.6g} to {high:.6g} m apart in the file"
        return {
            "file": self.path,
            "format": self.format,
            "samples in the file": f"{self.rows}",
            "columns read": ", ".join(self.header[i] for i in columns) or "without names",
            "units in the file": ", ".join(units),
            "stations of the file": stations,
        }


@dataclass(frozen=True, init=False, eq=False, repr=False)
class Profile:
    """Elevation of the road surface along one wheel track, or along several side by side.

    Between stations the elevation is linear; before the first and after the last it is level.
    Whatever takes one elevation for each station takes that of the first track, `z`; `track`
    gives another one. Two profiles are equal when stations, elevations, tracks and names are.

    Parameters
    ----------
    x : array_like, shape (n,)
        Stations, m; strictly increasing, n >= 2.
    z : array_like, shape (n,)
        Elevations, m; up is positive.
    name : str, optional
        What plots and tables call the profile.
    source : ProfileSource, optional
        What was understood of the file the profile was read from.
    tracks : mapping of str to array_like, shape (n,), optional
        Elevations, m, of each track of a profile with several, by name, such as ``"left"`` and
        ``"right"``; the first must be `z`.

    Attributes
    ----------
    x, z : ndarray of float64, shape (n,), read-only
        Stations and elevations, m; copies of what was given.
    name : str
    source : ProfileSource or None
    tracks : mapping of str to ndarray of float64, read-only
        Empty for a profile of one track; else `z` is the first of them.

    Raises
    ------
    ValueError
        If `x`, `z` and the tracks are not real, finite, one-dimensional and of one length of at
        least 2, if `x` does not increase strictly, or if the first track is not `z`.

    Examples
    --------
    >>> profile = Profile([0.0, 0.5, 1.0], [0.0, 0.01, 0.0], name="bump")
    >>> profile
    Profile('bump', 3 samples, 0 to 1 m every 0.5 m)
    >>> float(profile.elevation(0.25))
    0.005
    """

    x: NDArray[np.float64]
    z: NDArray[np.float64]
    name: str
    source: ProfileSource | None
    tracks: Mapping[str, NDArray[np.float64]]

    def __init__(
        self,
        x: ArrayLike,
        z: ArrayLike,
        name: str = "",
        source: ProfileSource | None = None,
        tracks: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        stations, elevations = finite_vector("x", x), finite_vector("z", z)
        if stations.size != elevations.size:
            raise ValueError(
                f"x has {stations.size} values and z has {elevations.size}; "
                "each station needs one elevation"
            )
        if stations.size < 2:
            raise ValueError(f"a profile needs at least 2 samples, got {stations.size}")
        _check_increasing(stations)
        if not isinstance(name, str):
            raise ValueError(f"name must be a string, got {name!r}")
        named = _checked_tracks(tracks or {}, elevations)
        for array in (stations, elevations, *named.values()):
            array.setflags(write=False)
        object.__setattr__(self, "x", stations)
        object.__setattr__(self, "z", elevations)
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "source", source)
        object.__setattr__(self, "tracks", MappingProxyType(named))

    @classmethod
    def smooth(cls, length: float, spacing: float = 0.25) -> Self:
        """Level road at elevation 0.

        Parameters
        ----------
        length : float
            Length, m. The last station is the last multiple of `spacing` within it.
        spacing : float, optional
            Distance between stations, m.

        Returns
        -------
        Profile
        """
        x = _uniform_stations(0.0, length, spacing)
        return cls(x, np.zeros_like(x), name="smooth")

    @classmethod
    def iso8608(
        cls,
        road_class: str,
        length: float,
        *,
        spacing: float = 0.05,
        seed: int = 0,
        n_min: float = 0.011,
        n_max: float = 2.83,
        waviness: float = 2.0,
        track_width: float | None = None,
    ) -> Self:
        """Random profile with the displacement PSD of an ISO 8608 road class.

        A sum of cosines, ``z(x) = sum_k sqrt(2 G_d(n_k) dn) cos(2 pi n_k x + phi_k)``, with
        ``G_d(n) = G_d(n0) (n / n0)**-w``, n0 = 0.1 cycle/m, phases uniform over a full turn, and
        frequencies ``n_k = k dn`` in the band [`n_min`, `n_max`]. The step dn is one cycle over
        the samples, so that the band is also restricted to waves no longer than the profile and
        longer than two spacings. G_d(n0) is the centre of the class (16e-6 m^3 for A, four times
        more from each class to the next), not its upper limit.

        With `track_width` there are two tracks, ``"left"`` (the profile without it) and
        ``"right"``, as far apart on a surface alike in all directions. Both have the PSD of the
        class; the phases of their waves differ by normal numbers of the variance ``-2 ln g``, whose
        cosines average to the coherence g of such tracks (`pavefem.roughness.track_coherence`).

        Parameters
        ----------
        road_class : {"A", "B", "C", "D", "E", "F", "G", "H"}
            Road class of ISO 8608.
        length : float
            Length, m. The last station is the last multiple of `spacing` within it.
        spacing : float, optional
            Distance between stations, m.
        seed : int, optional
            Seed of the phases, >= 0: the same arguments give the same profile.
        n_min, n_max : float, optional
            Band of spatial frequency, cycle/m; the default is the one of ISO 8608 for roads.
        waviness : float, optional
            Exponent w of the PSD; above 0 for two tracks.
        track_width : float, optional
            Distance between two tracks, m.

        Returns
        -------
        Profile

        Raises
        ------
        ValueError
            If an argument is out of range, or no wave of the profile falls into the band.
        """
        gd_n0 = _class_centre(road_class)
        _check_seed(seed)
        _check_positive(n_min=n_min, n_max=n_max)
        if not math.isfinite(waviness):
            raise ValueError(f"waviness must be finite, got {waviness}")
        x = _uniform_stations(0.0, length, spacing)
        dn = 1.0 / (x.size * spacing)
        wave = np.arange((x.size + 1) // 2)  # waves over the samples, below Nyquist
        n = wave * dn
        in_band = (wave > 0) & (n >= n_min) & (n <= n_max)
        if not in_band.any():
            raise ValueError(
                f"no wave between n_min = {n_min} and n_max = {n_max} cycle/m: a profile of "
                f"{length} m every {spacing} m holds waves from {dn:.4g} cycle/m up to "
                f"{0.5 / spacing:.4g} cycle/m (not included)"
            )
        random = np.random.default_rng(seed)
        phase = random.uniform(0.0, 2.0 * np.pi, np.count_nonzero(in_band))
        amplitude = np.sqrt(2.0 * gd_n0 * (n[in_band] / ISO8608_N0) ** -waviness * dn)

        def elevations(phase: NDArray[np.float64]) -> NDArray[np.float64]:
            spectrum = np.zeros(x.size // 2 + 1, dtype=np.complex128)
            spectrum[: wave.size][in_band] = 0.5 * x.size * amplitude * np.exp(1j * phase)
            return np.fft.irfft(spectrum, n=x.size)

        z, tracks = elevations(phase), {}
        if track_width is not None:
            from pavefem.roughness import track_coherence

            coherence = np.maximum(track_coherence(n[in_band], track_width, waviness), 1e-300)
            shift = np.sqrt(-2.0 * np.log(coherence)) * random.standard_normal(phase.size)
            tracks = {"left": z, "right": elevations(phase + shift)}
        return cls(x, z, name=f"ISO 8608 class {road_class}, seed {seed}", tracks=tracks)

    @property
    def by_track(self) -> Mapping[str, NDArray[np.float64]]:
        """Elevations, m, of every track by name; the only one of a profile has an empty name."""
        return self.tracks or {"": self.z}

    @property
    def length(self) -> float:
        """Distance from the first to the last station, m."""
        return float(self.x[-1] - self.x[0])

    @property
    def spacing(self) -> float:
        """Median distance between neighbouring stations, m."""
        return float(np.median(np.diff(self.x)))

    @property
    def is_uniform(self) -> bool:
        """Whether every station is within 0.1 % of a spacing of a uniform grid."""
        distance = np.abs(self.x - uniform_grid(self.x))
        return bool(distance.max() <= UNIFORM_TOLERANCE * self.length / (self.x.size - 1))

    @overload
    def elevation(self, x: float) -> np.float64: ...
    @overload
    def elevation(self, x: ArrayLike) -> NDArray[np.float64]: ...
    def elevation(self, x: ArrayLike) -> np.float64 | NDArray[np.float64]:
        """Elevation at any station.

        Parameters
        ----------
        x : float or array_like
            Stations, m, in any order.

        Returns
        -------
        float or ndarray, shape of `x`
            Elevation, m; linear between samples, level before the first and after the last.
        """
        return np.interp(np.asarray(x, dtype=np.float64), self.x, self.z)

    def resample(self, spacing: float) -> Self:
        """Profile at uniform stations, by linear interpolation.

        Nothing is filtered: where `spacing` is coarser than the profile's, waves shorter than
        two spacings alias.

        Parameters
        ----------
        spacing : float
            Distance between stations, m. They start at the first station of the profile; the
            last is the last multiple of `spacing` within its length.

        Returns
        -------
        Profile
        """
        x = _uniform_stations(float(self.x[0]), self.length, spacing)
        tracks = {name: np.interp(x, self.x, z) for name, z in self.tracks.items()}
        return replace(self, x=x, z=self.elevation(x), tracks=tracks)

    def slice(self, start: float, stop: float) -> Self:
        """Cut out the samples from one station to another, both included; stations stay.

        Parameters
        ----------
        start, stop : float
            First and last station, m, within the profile.

        Returns
        -------
        Profile

        Raises
        ------
        ValueError
            If the interval leaves the profile or holds fewer than 2 samples.
        """
        first, last = float(self.x[0]), float(self.x[-1])
        margin = 1e-6 * self.spacing
        if not first - margin <= start < stop <= last + margin:
            raise ValueError(
                f"slice from {start} to {stop} m must increase and stay within the profile, "
                f"{first:g} to {last:g} m"
            )
        kept = (self.x >= start - margin) & (self.x <= stop + margin)
        if np.count_nonzero(kept) < 2:
            raise ValueError(
                f"slice from {start} to {stop} m holds {np.count_nonzero(kept)} samples at a "
                f"spacing of {self.spacing:g} m, at least 2 are needed"
            )
        tracks = {name: z[kept] for name, z in self.tracks.items()}
        return replace(self, x=self.x[kept], z=self.z[kept], tracks=tracks)

    def iri(self, *, moving_average: bool = True) -> float:
        """International roughness index, in m/km; of the first track where there are several.

        Parameters
        ----------
        moving_average : bool, optional
            Whether elevations are averaged over 0.25 m, where they are less than 0.167 m apart.

        Returns
        -------
        float

        Raises
        ------
        ValueError
            If stations are irregular, more than 11 m apart, or fewer than the average takes.

        Warns
        -----
        ValidityWarning
            For stations more than 0.25 m apart, and for a profile shorter than 11 m.

        See Also
        --------
        pavefem.roughness.iri : Of segments and of each track, and how it is defined.
        """
        from pavefem.roughness import iri

        return float(iri(replace(self, tracks={}), moving_average=moving_average))

    def track(self, name: str) -> Self:
        """One of several tracks, as a profile of its own.

        Parameters
        ----------
        name : str
            One of `tracks`, such as ``"left"``.

        Returns
        -------
        Profile
            Its name ends with that of the track.

        Raises
        ------
        ValueError
            If there is no such track.
        """
        if name not in self.tracks:
            has = f"tracks {', '.join(self.tracks)}" if self.tracks else "one track, without a name"
            raise ValueError(f"track {name!r} is not in the profile, which has {has}")
        i, source = 1 + list(self.tracks).index(name), self.source
        if source is not None and len(source.columns) == len(source.units) == 1 + len(self.tracks):
            source = replace(
                source,
                columns=(source.columns[0], source.columns[i]),
                units=(source.units[0], source.units[i]),
                units_from=(source.units_from[0], source.units_from[i]),
            )
        title = f"{self.name}, {name}" if self.name else name
        return replace(self, z=self.tracks[name], name=title, source=source, tracks={})

    def summary(self) -> dict[str, str]:
        """Return what there is to know of the profile, as text with units, by what it is.

        Of a profile that was read from a file, that includes what was understood of the file.
        """
        gaps = np.diff(self.x)
        figures = {
            "name": self.name or "none",
            "tracks": ", ".join(self.tracks) or "one, without a name",
            "samples": f"{self.x.size}",
            "stations": f"{self.x[0]:.10g} to {self.x[-1]:.10g} m",
            "length": f"{self.length:.10g} m",
            "spacing": (
                f"{self.spacing:.6g} m"
                if self.is_uniform
                else f"irregular, {gaps.min():.6g} to {gaps.max():.6g} m, "
                f"median {self.spacing:.6g} m"
            ),
            **{
                f"{track} elevation".strip(): f"{z.min():.4f} to {z.max():.4f} m"
                for track, z in self.by_track.items()
            },
        }
        return figures if self.source is None else figures | self.source.summary()

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write stations and elevations (m) as comma-separated text, at full precision.

        `read_profile` reads the file back to the same numbers; for irregular stations it needs
        ``spacing="file"``, and for tracks that are not left, right or center ``columns=``.

        Parameters
        ----------
        path : str or os.PathLike
            File to write; an existing one is replaced.

        See Also
        --------
        pavefem.formats.text.write_csv : What the file holds.
        """
        from pavefem.formats.text import write_csv

        write_csv(self, path)

    def to_erd(self, path: str | os.PathLike[str]) -> None:
        """Write an ERD file, with elevations as text, in m, at full precision.

        Parameters
        ----------
        path : str or os.PathLike
            File to write; an existing one is replaced.

        Raises
        ------
        ValueError
            If the stations are not uniform, as the file holds their spacing instead of them, or
            if a name of a track is longer than 32 characters.

        See Also
        --------
        pavefem.formats.erd.write_erd : What the file holds.
        """
        from pavefem.formats.erd import write_erd

        write_erd(self, path)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Profile):
            return NotImplemented
        return (
            self.name == other.name
            and list(self.tracks) == list(other.tracks)
            and np.array_equal(self.x, other.x)
            and np.array_equal(self.z, other.z)
            and all(np.array_equal(z, other.tracks[name]) for name, z in self.tracks.items())
        )

    def __hash__(self) -> int:
        ends = (self.x[0], self.x[-1], self.z[0], self.z[-1])
        return hash((self.name, *self.tracks, self.x.size, *map(float, ends)))

    def __reduce__(self) -> tuple[type[Self], tuple[Any, ...]]:
        # numpy pickles no read-only flag: rebuild through the constructor
        return type(self), (self.x, self.z, self.name, self.source, dict(self.tracks))

    def __repr__(self) -> str:
        every = "every" if self.is_uniform else "irregular, median"
        return (
            f"{type(self).__name__}({self.name!r}, {self.x.size} samples, "
            f"{self.x[0]:g} to {self.x[-1]:g} m {every} {self.spacing:g} m"
            f"{', tracks ' if self.tracks else ''}{', '.join(self.tracks)})"
        )


def uniform_grid(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """As many stations as `x`, evenly spaced between the same ends."""
    return np.linspace(x[0], x[-1], x.size, dtype=np.float64)


def finite_vector(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Copy of `values` as a 1-D float64 array; ValueError unless they are real and finite."""
    vector = real_array(name, values)
    if vector.ndim != 1:
        raise ValueError(f"{name} must be one-dimensional, got shape {vector.shape}")
    finite = np.isfinite(vector)
    if not finite.all():
        i = int(np.argmin(finite))
        raise ValueError(f"{name}[{i}] is {vector[i]}; every value must be finite")
    return vector


def real_array(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Copy of `values` as a float64 array; ValueError unless they are real numbers."""
    try:
        array = np.asarray(values)
    except ValueError as error:  # nested sequences of unequal length
        raise ValueError(f"{name} must be a sequence of numbers: {error}") from None
    if array.dtype.kind not in "iuf" or np.ma.is_masked(values):
        what = "masked values" if np.ma.is_masked(values) else f"dtype {array.dtype}"
        raise ValueError(f"{name} must hold real numbers, got {what}")
    return np.array(array, dtype=np.float64)


def _checked_tracks(
    tracks: Mapping[str, ArrayLike], first: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Tracks as 1-D float64 arrays, of which the first is `first` itself."""
    checked: dict[str, NDArray[np.float64]] = {}
    for name, values in tracks.items():
        if not (isinstance(name, str) and name.isprintable() and name.strip() == name != ""):
            raise ValueError(f"name of a track must be printable text, got {name!r}")
        vector = finite_vector(f"track {name!r}", values)
        if vector.size != first.size:
            raise ValueError(
                f"track {name!r} has {vector.size} values and z has {first.size}; "
                "each station needs one elevation"
            )
        if not checked and not np.array_equal(vector, first):
            raise ValueError(f"z must be the first track, {name!r}; they differ")
        checked[name] = vector if checked else first
    return checked


def _check_increasing(x: NDArray[np.float64]) -> None:
    increases = x[1:] > x[:-1]
    if not increases.all():
        i = int(np.argmin(increases)) + 1
        raise ValueError(
            f"x[{i}] = {x[i]} does not increase (x[{i - 1}] = {x[i - 1]}); "
            "stations must increase strictly"
        )
    if not math.isfinite(float(x[-1]) - float(x[0])):
        raise ValueError(f"x from {x[0]} to {x[-1]} m is longer than a float can hold")


def _uniform_stations(start: float, length: float, spacing: float) -> NDArray[np.float64]:
    """Return ``start + i * spacing`` for every i that stays within `length` (all in m)."""
    _check_positive(length=length, spacing=spacing)
    steps = length / spacing * (1.0 + 1e-9)  # a length of 500 m holds 10 000 times 0.05 m
    if not 1.0 <= steps < MAX_SAMPLES:
        raise ValueError(
            f"a length of {length:g} m with a spacing of {spacing:g} m gives {steps:.4g} steps; "
            f"at least 1 and fewer than {MAX_SAMPLES} are allowed"
        )
    return start + spacing * np.arange(math.floor(steps) + 1, dtype=np.float64)


def _check_positive(**values: float) -> None:
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} must be positive and finite, got {value}")


def _check_seed(seed: int) -> None:
    if not isinstance(seed, (int, np.integer)) or seed < 0:
        raise ValueError(f"seed must be an integer >= 0, got {seed!r}")


def _class_centre(road_class: str) -> float:
    if road_class not in ISO8608_CENTRES:
        raise ValueError(
            f"road_class must be one of {', '.join(ISO8608_CENTRES)}, got {road_class!r}"
        )
    return ISO8608_CENTRES[road_class]
