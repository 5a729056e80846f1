"""Roughness: published and closed-form numbers, other ways to the same number, and what is refused.

Sources
-------
Sayers, Transportation Research Record 1501 (1995), and ASTM E1926: the golden car, its gains.
Sroubek, Sorel and Zak, Int. J. Pavement Res. Technol. (2021), and the repository that belongs to
    it: IRI of a measured profile.
ISO 8608: PSD, octaves, classes.
Kamash and Robson, J. Sound Vib. 57 (1978): two tracks on an isotropic surface.
"""

from __future__ import annotations

import itertools
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import DATA
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.patches import StepPatch
from scipy import integrate, signal, special

import pavefem as pf
from pavefem import roughness
from pavefem.plotting import plot_iri, plot_psd

SPEED = 80.0 / 3.6
TIRE, SPRING, DAMPER, UNSPRUNG = 653.0, 63.3, 6.0, 0.15
CAR = (
    np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-SPRING, -DAMPER, SPRING, DAMPER],
            [0.0, 0.0, 0.0, 1.0],
            [SPRING / UNSPRUNG, DAMPER / UNSPRUNG, -(SPRING + TIRE) / UNSPRUNG, -DAMPER / UNSPRUNG],
        ]
    ),
    np.array([[0.0], [0.0], [0.0], [TIRE / UNSPRUNG]]),
    np.array([[0.0, 1.0, 0.0, -1.0]]),
    np.zeros((1, 1)),
)
"""State (z_s, z_s', z_u, z_u'), input the road, output the difference of the two rates."""

WAVES = [(2.4, 1.6640), (5.0, 1.1697), (10.0, 1.2597), (15.4, 1.5351), (30.0, 0.4548)]

needs_profiles = pytest.mark.skipif(
    not (DATA / "iri_sorel").is_dir(),
    reason="measured profiles not beside the project (shared/data)",
)


def gain(n: float) -> float:
    """Amplitude of z_s' - z_u' for a unit sinusoidal slope: both equations of motion by hand."""
    s = 2j * np.pi * n * SPEED
    link = SPRING + DAMPER * s
    sprung = link / (s * s + link)  # z_s over z_u
    unsprung = TIRE / (UNSPRUNG * s * s + link + TIRE - link * sprung)
    return float(abs((sprung - 1.0) * unsprung))


def random_road(length: float, spacing: float, seed: int = 11, **options: float) -> pf.Profile:
    return pf.Profile.iso8608("B", length, spacing=spacing, seed=seed, **options)


def sine(wavelength: float, length: float, spacing: float, amplitude: float = 1.0) -> pf.Profile:
    x = spacing * np.arange(round(length / spacing) + 1)
    return pf.Profile(x, amplitude * np.sin(2.0 * np.pi * x / wavelength))


def amplitude_within(profile: pf.Profile, wavelength: float, margin: float) -> complex:
    """Amplitude of a sine, imaginary part: of a cosine, away from the ends."""
    inside = (profile.x > margin) & (profile.x < profile.x[-1] - margin)
    phase = 2.0 * np.pi * profile.x[inside] / wavelength
    basis = np.stack([np.sin(phase), np.cos(phase)], axis=1)
    (of_sine, of_cosine), *_ = np.linalg.lstsq(basis, profile.z[inside], rcond=None)
    return complex(of_sine, of_cosine)


# --- IRI: published numbers -------------------------------------------------------------------


@pytest.mark.parametrize(("wavelength", "published"), WAVES)
def test_gain_in_closed_form(wavelength: float, published: float) -> None:
    assert gain(1.0 / wavelength) == pytest.approx(published, abs=0.5e-4)


@pytest.mark.parametrize(("wavelength", "published"), WAVES)
def test_iri_of_a_sine(wavelength: float, published: float) -> None:
    """IRI = (2/pi) gain times slope amplitude; chords of 0.25 m take sin(u)/u of it, u = pi b n."""
    slope = 3e-3
    hundred = 100 * wavelength
    road = sine(wavelength, 3 * hundred, 0.01, slope * wavelength / (2.0 * np.pi))
    last = float(roughness.iri(road, segment=hundred, moving_average=False)[1])
    assert last * np.pi / 2.0 / (1e3 * slope) == pytest.approx(published, rel=1e-4)
    averaged = float(roughness.iri(road, segment=hundred)[1])
    assert averaged / last == pytest.approx(np.sinc(0.25 / wavelength), rel=1e-4)


@needs_profiles
def test_iri_of_a_measured_profile() -> None:
    """Printed to 5 and 4 decimals. Their car starts with the slope of 0.5 s, 11.11 m, ours of 11 m.

    That is what the whole and the first segment may differ by, and the others may not.
    """
    profile = pf.read_profile(DATA / "iri_sorel" / "profile_1.txt")
    assert profile.iri() == pytest.approx(3.33546, abs=1e-5)
    segments = roughness.iri(profile, segment=100.0)
    published = [3.2985, 2.4421, 3.5551, 4.0855, 2.7079]
    np.testing.assert_allclose(segments[:5], published, rtol=0, atol=0.5e-4)
    np.testing.assert_allclose(segments.start, 478.0 + 100.0 * np.arange(6))
    np.testing.assert_allclose(segments.length, [100.0] * 5 + [44.0])


def expected_iri(n_min: float, n_max: float, base: float) -> float:
    """IRI of a Gaussian road of class A, m/km: sqrt(2/pi) times the standard deviation."""

    def density(log_n: float) -> float:
        n = float(np.exp(log_n))
        slope = (2.0 * np.pi * 0.1) ** 2 * 16e-6
        return n * slope * (gain(n) * float(np.sinc(base * n))) ** 2

    variance, _ = integrate.quad(density, np.log(n_min), np.log(n_max), limit=500)
    return float(1e3 * np.sqrt(2.0 / np.pi * variance))


def test_iri_of_class_a() -> None:
    """2.219 and 2.173 m/km are for all waves of an endless road sampled without steps.

    The band of ISO 8608, 0.011 to 2.83 cycle/m, leaves 2.218 of the first.
    """
    assert expected_iri(1e-4, 1e3, 0.0) == pytest.approx(2.219, abs=0.5e-3)
    assert expected_iri(1e-4, 1e3, 0.25) == pytest.approx(2.173, abs=0.5e-3)
    assert expected_iri(0.011, 2.83, 0.0) == pytest.approx(2.218, abs=0.5e-3)
    road = pf.Profile.iso8608("A", 100e3, spacing=0.05, n_max=9.9, seed=2)
    assert road.iri(moving_average=False) == pytest.approx(2.219, rel=0.01)
    assert road.iri() == pytest.approx(2.173, rel=0.01)


@pytest.mark.parametrize("road_class", list("BCDEFGH"))
def test_iri_scales_with_the_root_of_the_psd(road_class: str) -> None:
    ratio = 2.0 ** "ABCDEFGH".index(road_class)
    of_a, found = (pf.Profile.iso8608(c, 300.0, seed=4).iri() for c in ("A", road_class))
    assert found / of_a == pytest.approx(ratio, rel=1e-12)


# --- IRI: the same number by other ways -------------------------------------------------------


@pytest.mark.parametrize("spacing", [0.05, 0.25])
def test_iri_by_an_integration_of_the_displacements(spacing: float) -> None:
    """scipy.signal.lsim of the quarter car over elevations that are linear between samples."""
    road = random_road(400.0, spacing)
    rise = SPEED * (road.z[round(11.0 / spacing)] - road.z[0]) / 11.0
    start = np.array([road.z[0], rise, road.z[0], rise])
    _, rate, _ = signal.lsim(CAR, road.z, road.x / SPEED, X0=start)
    expected = 1e3 * np.mean(np.abs(rate[1:])) / SPEED
    assert road.iri(moving_average=False) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("spacing", "base"), [(0.05, 5), (0.1, 3), (0.125, 2), (0.2, 1)])
def test_iri_with_the_average_by_a_digital_filter(spacing: float, base: int) -> None:
    """scipy.signal: the car as a zero-order-hold discrete system, fed the chords of E1926."""
    road = random_road(300.0, spacing)
    discrete = signal.cont2discrete(CAR, spacing / SPEED)
    chords = (road.z[base:] - road.z[:-base]) / (base * spacing)
    lead = round(11.0 / spacing)
    start = (road.z[lead] - road.z[0]) / (lead * spacing)
    _, _, states = signal.dlsim(discrete, np.append(chords, 0.0), x0=[start, 0.0, start, 0.0])
    steps = np.abs(states[1:, 0] - states[1:, 2])
    assert road.iri() == pytest.approx(1e3 * steps.mean(), rel=1e-10)
    # Segments hold the steps that start in them; the last is short of what the base needs.
    segment = round(50.0 / spacing)
    expected = [1e3 * steps[i : i + segment].mean() for i in range(0, 6 * segment, segment)]
    np.testing.assert_allclose(roughness.iri(road, segment=50.0), expected, rtol=1e-10)


@given(
    grade=st.floats(-0.2, 0.2),
    level=st.floats(-1e3, 5e3),
    spacing=st.sampled_from([0.025, 0.1, 0.25]),
)
def test_level_and_grade_are_no_roughness(grade: float, level: float, spacing: float) -> None:
    road = random_road(60.0, spacing)
    tilted = pf.Profile(road.x + level, road.z + level + grade * road.x)
    plane = pf.Profile(road.x, level + grade * road.x)
    assert plane.iri() < 1e-6
    # Another grade starts another car only in as far as the road starts rough.
    assert tilted.iri() == pytest.approx(road.iri(), rel=1e-7)


# --- IRI: tracks, segments, limits ------------------------------------------------------------


@pytest.fixture(scope="module")
def two_tracks() -> pf.Profile:
    return pf.Profile.iso8608("C", 1000.0, seed=6, track_width=1.6)


def test_each_track_is_a_road_of_its_own(two_tracks: pf.Profile) -> None:
    whole = roughness.iri(two_tracks)
    assert whole.dims == ("track",) and list(whole.track.values) == ["left", "right"]
    assert float(whole.sel(track="right")) == two_tracks.track("right").iri()
    assert float(whole[0]) == two_tracks.iri() == two_tracks.track("left").iri()
    segments = roughness.iri(two_tracks, segment=300.0)
    assert segments.dims == ("track", "start") and segments.attrs["units"] == "m/km"
    np.testing.assert_allclose(segments.start, [0.0, 300.0, 600.0, 900.0])
    np.testing.assert_allclose(segments.length, [300.0, 300.0, 300.0, 100.0])
    assert segments.start.attrs["units"] == segments.length.attrs["units"] == "m"
    one = roughness.iri(two_tracks.track("right"), segment=300.0)
    assert one.dims == ("start",) and np.array_equal(one, segments.sel(track="right"))


def test_mri_is_the_mean_of_both_tracks(two_tracks: pf.Profile) -> None:
    each, mean = roughness.iri(two_tracks, segment=100.0), roughness.mri(two_tracks, segment=100.0)
    np.testing.assert_allclose(mean, 0.5 * (each[0] + each[1]), rtol=1e-14)
    assert mean.dims == ("start",) and mean.name == "mri" and mean.attrs["units"] == "m/km"
    left, right = two_tracks.tracks.values()
    three = pf.Profile(
        two_tracks.x, right, tracks={"right": right, "center": 0.0 * left, "left": left}
    )
    assert float(roughness.mri(three)) == pytest.approx(float(roughness.mri(two_tracks)), rel=1e-14)
    with pytest.raises(ValueError, match="two wheel tracks; the profile has one track"):
        roughness.mri(two_tracks.track("left"))
    for name in ("inner", "outer"):
        alone = pf.Profile(two_tracks.x, left, tracks={name: left})
        with pytest.raises(ValueError, match=f"the profile has tracks {name}"):
            roughness.mri(alone)


def test_stations_do_not_matter() -> None:
    road = random_road(250.0, 0.1)
    shifted = pf.Profile(road.x + 12_345.6, road.z)
    np.testing.assert_allclose(
        roughness.iri(shifted, segment=100.0), roughness.iri(road, segment=100.0), rtol=1e-6
    )


def test_coarse_samples_are_warned_of() -> None:
    road = random_road(300.0, 0.25)
    rounded = pf.Profile(np.round(road.x, 3) * (1.0 + 1e-4), road.z)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert road.iri() == pytest.approx(rounded.iri(), rel=1e-3)
    with pytest.warns(pf.ValidityWarning, match=r"0.5 m apart; IRI is for 0.25 m"):
        assert road.resample(0.5).iri() < road.iri()


def test_a_profile_shorter_than_the_start_is_warned_of() -> None:
    road = random_road(10.0, 0.1)
    with pytest.warns(pf.ValidityWarning, match="10 m long; IRI starts with the slope of 11 m"):
        found = road.iri()
    assert 0.0 < found < 20.0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: pf.Profile([0.0, 0.2, 0.5], [0.0] * 3).iri(),
         r"IRI needs uniform stations; .* 0.2 to 0.3 m apart: resample it first, profile.resample"),
        (lambda: pf.Profile(0.05 * np.arange(5), np.zeros(5)).iri(),
         "samples of the profile = 5: must be at least 6"),
        (lambda: pf.Profile([0.0, 12.0], [0.0, 0.0]).iri(),
         "spacing = 12.0 m: must be 1e-6 to 11 m"),
        (lambda: roughness.iri(random_road(50.0, 0.25), segment=0.1),
         "segment = 0.1 m: must be the spacing or longer"),
        (lambda: roughness.iri(random_road(50.0, 0.25), segment=float("nan")), "segment = NaN m"),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore::pavefem.ValidityWarning")
def test_iri_says_what_is_wrong(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


def test_elevations_beyond_a_double_are_an_error_not_a_nan() -> None:
    wild = pf.Profile(0.25 * np.arange(100), np.where(np.arange(100) % 2, 1e308, -1e308))
    with pytest.raises(pf.SolverError, match="slope is not finite"):
        wild.iri()


@pytest.mark.parametrize("spacing", [0.25, 0.025])
def test_a_hundred_kilometres_in_less_than_a_second(spacing: float) -> None:
    x = spacing * np.arange(round(100e3 / spacing) + 1)
    road = pf.Profile(x, 1e-2 * np.sin(2.0 * np.pi * x / 15.4))
    start = time.perf_counter()
    found = roughness.iri(road, segment=100.0)
    assert time.perf_counter() - start < 1.0
    assert found.size == 1000


# --- PSD --------------------------------------------------------------------------------------


def test_psd_sums_to_the_variance() -> None:
    rng = np.random.default_rng(3)
    road = pf.Profile(0.1 * np.arange(100_000), rng.standard_normal(100_000))
    spectrum = roughness.psd(road, window=200.0)
    n = spectrum.spatial_frequency.to_numpy()
    np.testing.assert_allclose(n, np.arange(1, 1001) / 200.0)
    assert float(spectrum.sum() * n[0]) == pytest.approx(1.0, rel=0.02)
    assert float(spectrum.mean()) == pytest.approx(1.0 / 5.0, rel=0.02)  # white, up to 5 cycle/m
    assert spectrum.attrs["units"] == "m^3"
    assert spectrum.spatial_frequency.attrs["units"] == "cycle/m"


def test_psd_of_a_sine_is_half_its_square() -> None:
    spectrum = roughness.psd(sine(12.5, 2000.0, 0.05, amplitude=0.02))
    peak = spectrum.sel(spatial_frequency=slice(0.07, 0.09))
    assert float(peak.sum() * spectrum.spatial_frequency[0]) == pytest.approx(2e-4, rel=1e-3)


def test_slope_psd_is_that_of_the_derivative(two_tracks: pf.Profile) -> None:
    slope = roughness.psd(two_tracks, quantity="slope", window=50.0)
    displacement = roughness.psd(two_tracks, window=50.0)
    assert slope.dims == ("track", "spatial_frequency") and slope.attrs["units"] == "m"
    n = slope.spatial_frequency
    np.testing.assert_allclose(slope, displacement * (2.0 * np.pi * n) ** 2, rtol=1e-12)
    left = two_tracks.track("left")
    derivative = pf.Profile(left.x, np.gradient(left.z, left.x))
    band = slice(0.1, 1.0)
    of_derivative = roughness.psd(derivative, window=50.0).sel(spatial_frequency=band)
    ratio = of_derivative / slope.sel(track="left", spatial_frequency=band)
    n = n.sel(spatial_frequency=band)
    # Central differences over 0.1 m.
    np.testing.assert_allclose(ratio, np.sinc(0.1 * n) ** 2, rtol=0.05)


@pytest.mark.parametrize("length", [30.0, 599.0, 600.0, 799.0, 5000.0])
def test_default_windows_fill_the_profile(length: float) -> None:
    samples = round(length / 0.1)
    road = random_road((samples - 1) * 0.1, 0.1)
    window = 1.0 / float(roughness.psd(road).spatial_frequency[0])
    if length < 600.0:
        assert window == pytest.approx(length)
    else:
        assert 400.0 <= window < 600.0
        halves = 2.0 * length / window
        assert halves == pytest.approx(round(halves), abs=0.01)


def test_octave_means_of_the_class() -> None:
    """For w = 2 the mean over an octave is the value at its centre."""
    means = [
        roughness.octave_means(roughness.psd(random_road(20e3, 0.1, seed=seed, n_min=1e-3)))
        for seed in range(3)
    ]
    n = means[0].spatial_frequency.to_numpy()
    np.testing.assert_allclose(n, 2.0 ** np.arange(-6, 2))
    np.testing.assert_allclose(sum(means) / 3.0, 64e-6 * (n / 0.1) ** -2, rtol=0.05)


def test_octaves_that_the_profile_does_not_hold_are_left_out() -> None:
    means = roughness.octave_means(roughness.psd(random_road(100.0, 0.25)))
    np.testing.assert_allclose(means.spatial_frequency, 2.0 ** np.arange(-4, 1))
    assert roughness.octave_means(roughness.psd(random_road(100.0, 10.0))).size == 0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: roughness.psd(random_road(50.0, 0.1), window=60.0),
         r"window = 60.0 m: must be above 0.8 m and at most 50.1 m for a profile 50 m long"),
        (lambda: roughness.psd(random_road(50.0, 0.1), window=0.8), "window = 0.8 m"),
        (lambda: roughness.psd(random_road(50.0, 0.1), window=float("nan")), "window = nan m"),
        (lambda: roughness.psd(random_road(50.0, 0.1), quantity="speed"),  # type: ignore[arg-type]
         "quantity must be 'displacement' or 'slope', got 'speed'"),
        (lambda: roughness.psd(pf.Profile([0.0, 1.0, 3.0], [0.0] * 3)), "resample"),
        (lambda: roughness.psd(pf.Profile([0.0, 1.0, 2.0], [0.0] * 3)),
         "needs more than 8 samples, the profile has 3"),
        (lambda: roughness.psd(pf.Profile(np.arange(100.0), 1e200 * (-1.0) ** np.arange(100))),
         r"elevations of 1e\+200 m are too large"),
    ],
)  # fmt: skip
def test_psd_says_what_is_wrong(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


# --- classes ----------------------------------------------------------------------------------


@pytest.mark.parametrize("road_class", list("ABCDEFGH"))
@pytest.mark.parametrize("length", [60.0, 500.0, 5000.0])
def test_a_generated_road_is_of_its_class(road_class: str, length: float) -> None:
    found = roughness.iso8608_class(pf.Profile.iso8608(road_class, length, seed=8))
    assert found.road_class == road_class
    assert found.waviness == pytest.approx(2.0, abs=0.2 if length < 100.0 else 0.1)


@pytest.mark.parametrize("waviness", [1.5, 2.0, 2.5, 3.0])
def test_the_line_is_recovered(waviness: float) -> None:
    """The mean over an octave is above the value at its centre for w > 2, by 6 % for w = 3."""
    road = random_road(20e3, 0.1, waviness=waviness, n_min=1e-3)
    found = roughness.iso8608_class(road)
    assert found.waviness == pytest.approx(waviness, abs=0.03)
    assert found.gd_n0 == pytest.approx(64e-6, rel=0.1)
    assert found.band == pytest.approx((2.0**-6.5, 2.0**1.5))


@pytest.mark.parametrize(("upper", "below", "above"), [(32e-6, "A", "B"), (512e-6, "C", "D")])
def test_limits_are_at_twice_the_centres(upper: float, below: str, above: str) -> None:
    road = random_road(500.0, 0.1)
    scale = np.sqrt(upper / roughness.iso8608_class(road).gd_n0)
    for factor, expected in ((0.999, below), (1.001, above)):
        scaled = pf.Profile(road.x, factor * scale * road.z)
        assert roughness.iso8608_class(scaled).road_class == expected


def test_beyond_the_classes() -> None:
    road = random_road(500.0, 0.1)
    for scale, expected in ((1e-3, "A"), (1e3, "H")):
        scaled = pf.Profile(road.x, scale * road.z)
        assert roughness.iso8608_class(scaled).road_class == expected


def test_the_first_track_is_classed(two_tracks: pf.Profile) -> None:
    left = roughness.iso8608_class(two_tracks.track("left"))
    assert roughness.iso8608_class(two_tracks) == left
    assert roughness.iso8608_class(two_tracks.track("right")) != left


@pytest.mark.parametrize(
    ("profile", "message"),
    [
        (random_road(3.0, 0.1), r"needs 2 octaves .* 3 m long .* every 0.1 m, holds 1"),
        (random_road(100.0, 10.0), "holds 0"),
        (pf.Profile.smooth(100.0), "needs a rough profile"),
        (pf.Profile(np.cumsum(1.0 + np.arange(200) % 2), np.zeros(200)), "resample"),
    ],
)
def test_classes_say_what_is_wrong(profile: pf.Profile, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        roughness.iso8608_class(profile)


# --- filters ----------------------------------------------------------------------------------


@pytest.mark.parametrize("wavelength", [0.7, 1.3, 2.5, 10.0, 80.0])
@pytest.mark.parametrize("base", [0.25, 2.0, 7.77])
def test_gain_of_the_moving_average(wavelength: float, base: float) -> None:
    """sin(pi b n) / (pi b n), and (pi n d)^2 / 3 less for the lines between samples."""
    averaged = roughness.moving_average(sine(wavelength, 200.0, 0.01), base)
    found = amplitude_within(averaged, wavelength, base)
    expected = np.sinc(base / wavelength) * np.sinc(0.01 / wavelength) ** 2
    assert abs(found - expected) < 1e-6


def test_moving_average_by_brute_force() -> None:
    """Of irregular stations, near the ends too, where the base is cut on both sides alike."""
    rng = np.random.default_rng(5)
    x = np.cumsum(rng.uniform(0.05, 0.5, 60))
    road = pf.Profile(x, rng.standard_normal(60))
    averaged = roughness.moving_average(road, 3.0)
    for i in (0, 1, 5, 30, 57, 59):
        half = min(1.5, x[i] - x[0], x[-1] - x[i])
        if half == 0.0:
            assert averaged.z[i] == pytest.approx(road.z[i], abs=1e-14)
            continue
        fine = np.union1d(np.linspace(x[i] - half, x[i] + half, 11), x)
        fine = fine[(fine >= x[i] - half) & (fine <= x[i] + half)]
        expected = integrate.trapezoid(np.interp(fine, x, road.z), fine) / (2.0 * half)
        assert averaged.z[i] == pytest.approx(expected, abs=1e-12)


def butterworth_gain(n: float, spacing: float, limit: float, order: int) -> float:
    """Of a low-pass run twice; warped by the bilinear transform."""
    ratio = np.tan(np.pi * n * spacing) / np.tan(np.pi * spacing / limit)
    return float(1.0 / (1.0 + ratio ** (2 * order)))


@pytest.mark.parametrize("wavelength", [0.4, 1.0, 3.0, 5.0, 12.0, 30.0, 60.0])
@pytest.mark.parametrize("order", [1, 2, 4])
def test_gain_of_the_butterworth_filters(wavelength: float, order: int) -> None:
    road, d, n = sine(wavelength, 600.0, 0.05), 0.05, 1.0 / wavelength
    low = butterworth_gain(n, d, 3.0, order)
    high = 1.0 - butterworth_gain(n, d, 30.0, order)
    for limits, expected in (
        ({"shortest": 3.0}, low),
        ({"longest": 30.0}, high),
        ({"shortest": 3.0, "longest": 30.0}, low * high),
    ):
        filtered = roughness.butterworth(road, order=order, **limits)
        found = amplitude_within(filtered, wavelength, 150.0)
        assert abs(found - expected) < 1e-4, limits
    if wavelength in (3.0, 30.0):
        assert min(low, high) == pytest.approx(0.5)


def test_straight_lines_pass_a_low_pass_and_no_high_pass() -> None:
    x = 0.1 * np.arange(6000)
    line = pf.Profile(x, 583.0 - 0.06 * x)
    np.testing.assert_allclose(roughness.moving_average(line, 11.0).z, line.z, atol=1e-9)
    np.testing.assert_allclose(roughness.butterworth(line, shortest=5.0).z, line.z, atol=1e-5)
    np.testing.assert_allclose(roughness.butterworth(line, longest=50.0).z, 0.0, atol=1e-4)


def test_filters_leave_what_they_keep_at_the_ends_too() -> None:
    """A wave well inside the kept range: within 5 % of its amplitude right up to the ends."""
    road = sine(10.0, 200.0, 0.05)
    kept = roughness.butterworth(road, shortest=1.0, longest=100.0)
    assert np.abs(kept.z - road.z).max() < 0.05


def test_filters_take_every_track_and_keep_the_rest(two_tracks: pf.Profile) -> None:
    filters: list[Callable[[pf.Profile], pf.Profile]] = [
        lambda profile: roughness.moving_average(profile, 0.25),
        lambda profile: roughness.butterworth(profile, longest=40.0),
    ]
    for of in filters:
        filtered = of(two_tracks)
        assert list(filtered.tracks) == ["left", "right"] and filtered.name == two_tracks.name
        assert np.array_equal(filtered.x, two_tracks.x)
        for name in filtered.tracks:
            assert np.array_equal(filtered.tracks[name], of(two_tracks.track(name)).z)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda p: roughness.moving_average(p, 0.0), "base = 0.0 m: must be above 0 m"),
        (lambda p: roughness.moving_average(p, 51.0), "base = 51.0 m: .* at most 50 m"),
        (lambda p: roughness.moving_average(p, float("nan")), "base = nan m"),
        (lambda p: roughness.butterworth(p), "give the shortest wavelength to keep, the longest"),
        (lambda p: roughness.butterworth(p, shortest=0.2), "shortest = 0.2 m: must be above 0.2 m"),
        (lambda p: roughness.butterworth(p, longest=60.0), "longest = 60.0 m: .* at most 50 m"),
        (lambda p: roughness.butterworth(p, shortest=5.0, longest=5.0),
         "shortest = 5 m must be below longest = 5 m"),
        (lambda p: roughness.butterworth(p, longest=5.0, order=0), "order must be .* got 0"),
        (lambda p: roughness.butterworth(p, longest=5.0, order=2.5),  # type: ignore[arg-type]
         "order must be .* got 2.5"),
        (lambda p: roughness.butterworth(pf.Profile([0.0, 1.0, 3.0], [0.0] * 3), longest=2.0),
         "a Butterworth filter needs uniform stations"),
    ],
)  # fmt: skip
def test_filters_say_what_is_wrong(call: Callable[[pf.Profile], pf.Profile], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(random_road(50.0, 0.1))


# --- two tracks -------------------------------------------------------------------------------


@pytest.mark.parametrize("waviness", [1.0, 1.7, 2.0, 3.0])
@pytest.mark.parametrize("n", [0.02, 0.1, 0.4])
def test_coherence_is_the_integral_over_an_isotropic_surface(waviness: float, n: float) -> None:
    width = 1.8

    def surface(m: float) -> float:
        return float((n * n + m * m) ** (-0.5 * (waviness + 1.0)))

    along, _ = integrate.quad(surface, 0.0, np.inf, epsabs=0.0)
    # Half turns of the cosine alternate: partial sums averaged twice converge.
    turns = (np.arange(400) + 0.5) / (2.0 * width)
    edges = np.concatenate([[0.0], turns])
    parts = [
        integrate.quad(lambda m: surface(m) * np.cos(2.0 * np.pi * m * width), *pair)[0]
        for pair in itertools.pairwise(edges)
    ]
    sums = np.cumsum(parts)
    across = np.mean([sums[-1] + sums[-2], sums[-2] + sums[-3]]) / 2.0
    found = roughness.track_coherence(n, width, waviness)
    assert found == pytest.approx(across / along, abs=1e-6)


def test_coherence_for_a_waviness_of_two() -> None:
    n = np.geomspace(1e-3, 5.0, 50)
    x = 2.0 * np.pi * n * 1.5
    np.testing.assert_allclose(roughness.track_coherence(n, 1.5), x * special.kv(1, x), rtol=1e-12)


def test_coherence_at_its_ends() -> None:
    np.testing.assert_allclose(roughness.track_coherence([1e-300, 1e4], 1.8), [1.0, 0.0])
    assert roughness.track_coherence(1.0, 1e-200, 9.0) == 1.0
    for arguments, name in (
        ((0.0, 1.8), "n"),
        ((1.0, -1.8), "track_width"),
        ((1.0, 1.8, 0.0), "w"),
    ):
        with pytest.raises(ValueError, match=f"{name}.* must be above 0"):
            roughness.track_coherence(*arguments)


def test_the_left_track_is_the_profile_without_a_second() -> None:
    one = pf.Profile.iso8608("B", 200.0, seed=9)
    two = pf.Profile.iso8608("B", 200.0, seed=9, track_width=1.8)
    assert list(two.tracks) == ["left", "right"] and not one.tracks
    assert np.array_equal(one.z, two.z)
    assert two == pf.Profile.iso8608("B", 200.0, seed=9, track_width=1.8)


@pytest.mark.parametrize("waviness", [2.0, 2.6])
def test_both_tracks_have_the_psd_of_the_class(waviness: float) -> None:
    profile = pf.Profile.iso8608("D", 400.0, seed=3, track_width=1.8, waviness=waviness)
    count = profile.x.size
    dn = 1.0 / (count * 0.05)
    n = dn * np.arange(count // 2 + 1)
    in_band = (n >= 0.011) & (n <= 2.83)
    for z in profile.tracks.values():
        power = 2.0 * np.abs(np.fft.rfft(z) / count) ** 2 / dn
        np.testing.assert_allclose(
            power[in_band], 1024e-6 * (n[in_band] / 0.1) ** -waviness, rtol=1e-6
        )
        assert power[~in_band].max() < 1e-18


@pytest.mark.parametrize(("width", "waviness"), [(1.8, 2.0), (1.0, 2.0), (1.8, 1.5), (0.5, 3.0)])
def test_measured_coherence_of_the_tracks(width: float, waviness: float) -> None:
    """Cross-spectrum over the PSD, by octaves; the standard error of an octave is below 0.01."""
    found = []
    for seed in range(10):
        profile = pf.Profile.iso8608(
            "B", 10e3, seed=seed, track_width=width, waviness=waviness, spacing=0.1
        )
        left, right = profile.tracks.values()
        n, cross = signal.csd(left, right, fs=10.0, nperseg=2000)
        power = np.sqrt(signal.welch(left, 10.0, nperseg=2000)[1])
        power *= np.sqrt(signal.welch(right, 10.0, nperseg=2000)[1])
        found.append(cross / power)
    ratio = np.mean(found, axis=0)
    formula = np.zeros(n.size)
    formula[1:] = roughness.track_coherence(n[1:], width, waviness)
    for k in range(-5, 1):
        band = (n >= 2.0 ** (k - 0.5)) & (n < 2.0 ** (k + 0.5))
        assert ratio.real[band].mean() == pytest.approx(formula[band].mean(), abs=0.03)
        assert ratio.imag[band].mean() == pytest.approx(0.0, abs=0.03)


def test_tracks_without_distance_are_one_and_far_apart_are_two() -> None:
    near = pf.Profile.iso8608("B", 2000.0, seed=1, track_width=1e-7)
    np.testing.assert_allclose(near.tracks["right"], near.z, atol=1e-6 * np.abs(near.z).max())
    far = pf.Profile.iso8608("B", 20e3, seed=1, track_width=1e5, spacing=0.1)
    assert np.corrcoef(far.z, far.tracks["right"])[0, 1] == pytest.approx(0.0, abs=0.15)
    # The IRI of the mean of two roads that know nothing of each other is 1/sqrt(2) of theirs.
    mean = pf.Profile(far.x, 0.5 * (far.z + far.tracks["right"]))
    assert mean.iri() / far.iri() == pytest.approx(np.sqrt(0.5), rel=0.02)


@pytest.mark.parametrize("width", [0.0, -1.8, float("nan"), float("inf")])
def test_track_width_must_be_a_distance(width: float) -> None:
    with pytest.raises(ValueError, match="track_width must be above 0 and finite"):
        pf.Profile.iso8608("B", 100.0, track_width=width)


# --- figures ----------------------------------------------------------------------------------


def test_figures(two_tracks: pf.Profile) -> None:
    (axes,) = plot_iri(two_tracks, segment=250.0).axes
    steps = [patch.get_data() for patch in axes.patches if isinstance(patch, StepPatch)]
    index = roughness.iri(two_tracks, segment=250.0)
    for (values, edges, _), expected in zip(steps, index.to_numpy(), strict=True):
        np.testing.assert_array_equal(values, expected)
        np.testing.assert_array_equal(edges[:-1], index["start"])  # of both tracks alike
        assert edges[-1] == two_tracks.x[-1]
    assert axes.get_ylabel() == "IRI [m/km]" and "250 m" in axes.get_title()
    (axes,) = plot_psd(two_tracks.track("left")).axes
    assert axes.get_xscale() == axes.get_yscale() == "log"
    assert [text.get_text() for text in axes.texts] == list("ABCDEFGH")
    assert axes.get_ylabel() == "displacement PSD [m³]"


def test_samples_that_were_coarser_in_the_file_are_warned_of(tmp_path: Path) -> None:
    """Interpolation onto the median spacing brings no waves back."""
    x = np.cumsum(np.tile([0.1, 0.1, 0.4], 60))
    file = tmp_path / "irregular.txt"
    file.write_text("".join(f"{a:.2f} {1e-3 * np.sin(a):.6f}\n" for a in x))
    profile = pf.read_profile(file)
    assert profile.spacing == pytest.approx(0.1)
    with pytest.warns(pf.ValidityWarning, match=r"in the file up to 0\.4 m apart"):
        profile.iri()
