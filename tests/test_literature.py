"""Numbers that others published, and closed forms: what the model is to reproduce.

Sources
-------
Romero Navarrete, Lozano Guzman, Arroyo Contreras, "A Finite Element Model to assess flexible
    pavement vehicle interaction": eqs. 1-12, Tables I and II, section VI. What the paper leaves
    open is read as in the docstrings of `Asphalt`, `Pavement` and `vehicles.tandem_truck`; the
    deflections are those of an independent program that follows the same reading.
Ullidtz, Pavement Analysis (1987), and Heukelom and Klomp (1964): eqs. 7-8.
Hetenyi, Beams on Elastic Foundation (1946): an infinite beam under a force at rest.
Fryba, Vibration of Solids and Structures under Moving Loads (1972), ch. 1 and 13: the same under a
    moving force; the simply supported beam.

Goal: closed forms to rounding, the paper's nominal case to all digits of the reference, and the
converged scheme within the errors its mesh and time step have (asserted with their order).
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import pavefem as pf
from pavefem.analytical import SimplySupportedBeam, WinklerBeam

MM = 1e-3


# --- asphalt (eqs. 7-8) -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("penetration_index", "temperature_c", "speed_kmh", "gpa"),
    [
        (-1.0, 20.0, 65.0, 4.38521),
        (0.0, 20.0, 65.0, 2.163),
        (0.0, 20.0, 25.0, 1.673),
        (0.0, 20.0, 105.0, 2.457),
        (0.0, 10.0, 65.0, 4.747),
    ],
)
def test_modulus(
    penetration_index: float, temperature_c: float, speed_kmh: float, gpa: float
) -> None:
    mix = pf.Asphalt(vma=25.0, softening_point_c=60.0, penetration_index=penetration_index)
    half_a_digit = 0.5e-5 if penetration_index == -1.0 else 0.5e-3
    assert mix.modulus(temperature_c, speed_kmh) / 1e9 == pytest.approx(gpa, abs=half_a_digit)


def test_modulus_of_the_hot_road_comes_with_a_warning() -> None:
    """The paper's Fig. 11 goes to 40 °C, beyond its own limit of 5 MPa of binder stiffness."""
    mix = pf.Asphalt(penetration_index=0.0)
    with pytest.warns(pf.ValidityWarning, match="binder stiffness"):
        assert mix.modulus(40.0, 65.0) / 1e9 == pytest.approx(0.149, abs=0.5e-3)


def test_binder_stiffness_by_hand() -> None:
    """Eq. 8 at t = 0.02 s, T_RB - T = 40 °C, PI = 0: 1.157e-7 * 0.02^-0.368 * 40^5 MPa."""
    mix = pf.Asphalt(softening_point_c=60.0, penetration_index=0.0)
    expected = 1.157e-7 * 0.02**-0.368 * 40.0**5 * 1e6
    assert mix.binder_stiffness(20.0, 0.02) == pytest.approx(expected, rel=1e-14)


def test_mix_stiffness_by_hand() -> None:
    mix = pf.Asphalt(vma=18.0, penetration_index=0.5)
    binder = float(mix.binder_stiffness(15.0, 0.3 / (80.0 / 3.6))) / 1e6
    n = 0.83 * np.log10(4e4 / binder)
    expected = binder * (1 + (257.5 - 2.5 * 18.0) / (n * (18.0 - 3.0))) ** n
    assert mix.modulus(15.0, 80.0) / 1e6 == pytest.approx(expected, rel=1e-14)


# --- pavement (eqs. 1-6, Table I) -------------------------------------------------------------


def test_bar_of_table_one() -> None:
    """95e6 N read as EA over 0.5 m, in series with the asphalt's 56e6 N/m."""
    pavement = pf.Pavement.paper()
    assert pavement.subbase_stiffness == 1.9e8
    bar = pavement.bar_stiffness(pavement.reference_modulus)
    assert bar == pytest.approx(1.0 / (1.0 / 1.9e8 + 1.0 / 56e6), rel=1e-14)


def test_size_of_the_road(road: pf.Road) -> None:
    """Section VI.B: 50 elements, 49 free nodes, 98 degrees of freedom, 196 states."""
    strip = road.strip(20.0, 65.0)
    assert strip.nodes.size == 51
    assert strip.mass.shape == strip.damping.shape == strip.stiffness.shape == (98, 98)


def test_first_rows_of_the_matrices(road: pf.Road) -> None:
    """The first free node: two elements and a bar, from eqs. 1, 2, 4 and 6 by hand."""
    h, strip, pavement = 0.5, road.strip(20.0, 65.0), road.sections[0].pavement
    modulus = float(pavement.asphalt.modulus(20.0, 65.0))
    ei, bar = modulus * 4.5e-5, pavement.bar_stiffness(modulus)
    expected = {
        "stiffness": [24 * ei / h**3 + bar, 0.0, -12 * ei / h**3, 6 * ei / h**2],
        "mass": [
            1000 * 312 / 420 + 355 / 3,
            0.0,
            1000 * 54 / 420,
            -1000 * 13 * h / 420,
        ],
        "damping": [24 * 14e3 + 140e3, 0.0, -12 * 14e3, 6 * h * 14e3],
    }
    for name, row in expected.items():
        np.testing.assert_allclose(
            getattr(strip, name)[0, :4], row, rtol=1e-12, atol=1e-6, err_msg=name
        )
        assert np.all(getattr(strip, name)[0, 4:] == 0.0)


# --- the nominal case -------------------------------------------------------------------------


def test_nominal_case_of_the_paper(nominal: pf.Result) -> None:
    """Constant forces, 65 km/h, 20 °C, VMA 25 %, 1 ms: 1708 steps, node 25 of 51 in the middle."""
    assert nominal.time.size == 1709
    assert nominal.x[25] == 12.5
    np.testing.assert_allclose(nominal.x, 0.5 * np.arange(51), rtol=0, atol=1e-12)
    assert -nominal.lowest[25] == pytest.approx(0.643594386 * MM, rel=1e-8)
    assert nominal.max_deflection == pytest.approx(0.661134721 * MM, rel=1e-8)
    assert nominal.highest[25] == pytest.approx(0.0606088 * MM, rel=1e-6)


def test_loads_of_the_nominal_case(nominal: pf.Result) -> None:
    """A wheel track carries 19 462.5, 38 167.5 and 40 469 N; axles 0, 4.55 and 5.85 m behind."""
    np.testing.assert_allclose(
        nominal.tire_forces[0] / 2.0, [19_462.5, 38_167.5, 40_469.0], rtol=1e-10
    )
    assert nominal.forces is not None
    np.testing.assert_allclose(nominal.forces.position[0], [0.0, -4.55, -5.85], atol=1e-12)
    assert nominal.forces.position[-1, 2] < 25.0 < nominal.forces.position[-1, 2] + 0.02


# --- truck (section IV, Table II) -------------------------------------------------------------


def test_truck_static_loads(truck: pf.Vehicle) -> None:
    np.testing.assert_allclose(truck.static_loads, [38_925.0, 76_335.0, 80_938.0], rtol=1e-11)
    assert truck.total_mass * 9.81 == pytest.approx(38_925.0 + 76_335.0 + 80_938.0, rel=1e-12)


def test_truck_modes(truck: pf.Vehicle) -> None:
    expected = [2.0700, 2.1335, 8.8021, 10.8981, 11.9158, 22.1452]
    np.testing.assert_allclose(truck.natural_frequencies(), expected, rtol=0, atol=0.5e-4)


def test_truck_geometry(truck: pf.Vehicle) -> None:
    bodies = {body.name: body for body in truck.bodies}
    np.testing.assert_allclose(truck.axle_positions, [0.0, 4.55, 5.85], atol=1e-12)
    assert bodies["equalizing beam"].pin == pytest.approx(5.22174, abs=0.5e-5)
    assert bodies["equalizing beam"].pin == pytest.approx(4.55 + 0.67174, abs=1e-5)
    assert bodies["sprung mass"].x == pytest.approx(4.21102, abs=0.5e-5)


# --- a beam on a Winkler bed ------------------------------------------------------------------

EI, MASS, STIFFNESS, FORCE = 75e3, 2000.0, 1.2e8, 40e3
CRITICAL_DAMPING = 2.0 * np.sqrt(STIFFNESS * MASS)


def winkler(zeta: float = 0.0) -> WinklerBeam:
    return WinklerBeam(EI, MASS, STIFFNESS, damping=zeta * CRITICAL_DAMPING)


def test_static_closed_form() -> None:
    beam = winkler()
    assert beam.decay == pytest.approx(4.472136, abs=0.5e-6)
    assert beam.static_deflection(FORCE) == pytest.approx(0.745356 * MM, abs=0.5e-9)
    assert beam.static_moment(FORCE) == pytest.approx(2236.068, abs=0.5e-3)


def test_static_shape() -> None:
    """w = w0 e^-|lx| (cos lx + sin |lx|), which satisfies EI w'''' + k w = 0 and carries P."""
    beam = winkler()
    x = np.linspace(-2.0, 2.0, 41)
    phase = beam.decay * np.abs(x)
    expected = (
        FORCE * beam.decay / (2 * STIFFNESS) * np.exp(-phase) * (np.cos(phase) + np.sin(phase))
    )
    np.testing.assert_allclose(beam.static_deflection(FORCE, x), expected, rtol=1e-12, atol=1e-18)
    fine = np.linspace(-5.0, 5.0, 200_001)
    carried = STIFFNESS * np.trapezoid(beam.static_deflection(FORCE, fine), fine)
    assert carried == pytest.approx(FORCE, rel=1e-8)


def test_critical_speed() -> None:
    beam = winkler()
    assert beam.critical_speed == pytest.approx(54.7723, abs=0.5e-4)
    assert beam.critical_speed == pytest.approx((4 * STIFFNESS * EI / MASS**2) ** 0.25, rel=1e-14)


@pytest.mark.parametrize(
    ("ratio", "zeta", "expected"),
    [
        (0.5, 0.0, 1.15470),
        (0.5, 0.10, 1.15027),
        (0.5, 1.0, 0.89144),
        (0.9, 0.10, 2.06040),
    ],
)
def test_moving_peak(ratio: float, zeta: float, expected: float) -> None:
    beam = winkler(zeta)
    speed = ratio * beam.critical_speed
    peak, place = beam.moving_peak(FORCE, speed)
    assert peak / beam.static_deflection(FORCE) == pytest.approx(expected, abs=0.5e-5)
    around = beam.moving_deflection(FORCE, speed, place + np.linspace(-0.2, 0.2, 401))
    assert around.max() <= peak * (1.0 + 1e-12)
    assert beam.moving_deflection(FORCE, speed, place) == pytest.approx(peak, rel=1e-12)
    # Undamped, the peak is under the force; damping makes it lag behind.
    assert place == pytest.approx(0.0, abs=1e-6) if zeta == 0.0 else place < 0.0


def test_peak_without_damping() -> None:
    """1 / sqrt(1 - (v / v_cr)²) for an undamped bed."""
    beam = winkler()
    for ratio in (0.1, 0.5, 0.9, 0.99):
        peak, _ = beam.moving_peak(FORCE, ratio * beam.critical_speed)
        expected = beam.static_deflection(FORCE) / np.sqrt(1.0 - ratio**2)
        assert peak == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("zeta", "bending"), [(0.1, 0.0), (0.3, 400.0)])
def test_moving_closed_form_satisfies_its_equation(zeta: float, bending: float) -> None:
    """By Fourier transform: w(q) = P / D(iq), summed on a long grid."""
    speed = 30.0
    damping = zeta * CRITICAL_DAMPING
    beam = WinklerBeam(EI, MASS, STIFFNESS, damping=damping, bending_damping=bending)
    n, length = 2**16, 100.0
    q = 2.0 * np.pi * np.fft.fftfreq(n, length / n)
    s = 1j * q
    d = (
        -speed * bending * s**5
        + EI * s**4
        + MASS * speed**2 * s**2
        - speed * damping * s
        + STIFFNESS
    )
    by_fourier = np.fft.ifft(FORCE / d).real * n / length
    x = np.fft.fftfreq(n, 1.0 / length)
    near = np.abs(x) < 4.0
    found = beam.moving_deflection(FORCE, speed, x[near])
    np.testing.assert_allclose(
        found, by_fourier[near], rtol=0, atol=1e-7 * float(beam.static_deflection(FORCE))
    )


def test_slow_force_deflects_as_one_at_rest() -> None:
    beam = winkler(0.1)
    x = np.linspace(-1.0, 1.0, 21)
    slow = beam.moving_deflection(FORCE, 1e-3, x)
    np.testing.assert_allclose(slow, beam.static_deflection(FORCE, x), atol=1e-4 * slow.max())


# --- the finite elements against them ---------------------------------------------------------


def one_axle(load: float) -> pf.Vehicle:
    """Build a mass on a tire, which presses on the road with `load`, N."""
    return pf.Vehicle(
        name="one axle",
        bodies=[pf.Body(name="mass", mass=load / 9.81, x=0.0)],
        tires=[pf.Tire(body="mass", x=0.0, stiffness=1e6, damping=1e4)],
    )


def steady_error(pavement: pf.Pavement, speed_kmh: float, **changes: float) -> float:
    """Largest difference from the infinite beam, over its static deflection.

    Histories at two nodes, while the axle is within 2 m of the middle of 14 m of road (some sixty
    decay lengths): the force has gone far enough to be steady, and the ends are far away.
    """
    road = pf.Road(pavement, length=14.0)
    stations = [7.0, 7.25]
    scheme = pf.Scheme.converged(**changes)
    result = pf.simulate(
        road,
        one_axle(2 * FORCE),
        speed_kmh=speed_kmh,
        scheme=scheme,
        stations=stations,
        keep=["deflection", "tire_force"],
    )
    assert result.deflection is not None
    assert result.forces is not None
    beam = WinklerBeam.of(pavement.constants(20.0, speed_kmh))
    place = result.forces.position[:, 0]
    middle = np.abs(place - 7.0) < 2.0
    expected = np.column_stack(
        [-beam.moving_deflection(FORCE, speed_kmh / 3.6, x - place[middle]) for x in stations]
    )
    error = np.abs(result.deflection[middle] - expected).max()
    return float(error / beam.static_deflection(FORCE))


@pytest.mark.parametrize("speed_kmh", [25.0, 65.0, 105.0])
def test_converged_scheme_against_the_moving_force(speed_kmh: float) -> None:
    """The preset as it is: 0.1 m and 1 ms. A full second-order step costs most at high speed."""
    assert steady_error(pf.Pavement.paper(), speed_kmh) < 1e-3


def test_converged_scheme_converges_to_the_moving_force() -> None:
    """Fourth order in h where the time step is fine, second in dt where the mesh is."""
    pavement = pf.Pavement.paper()
    by_mesh = [steady_error(pavement, 65.0, element_length=h, dt=1.25e-4) for h in (0.25, 0.125)]
    by_step = [steady_error(pavement, 65.0, element_length=0.125, dt=dt) for dt in (4e-3, 2e-3)]
    assert 3.7 < np.log2(by_mesh[0] / by_mesh[1]) < 4.8, by_mesh
    assert 1.8 < np.log2(by_step[0] / by_step[1]) < 2.2, by_step
    assert by_mesh[1] < 1.1e-4
    assert steady_error(pavement, 65.0) < 2.1e-4  # as it is by default, 0.1 m and 1 ms


def test_converged_scheme_under_a_crawling_force() -> None:
    """Slow, and with little damping: Hetenyi's static form, but for (v / v_cr)²."""
    pavement = pf.Pavement.paper(bar_damping=14e3, beam_damping=0.0)
    road = pf.Road(pavement, length=8.0)
    result = pf.simulate(
        road, one_axle(2 * FORCE), speed_kmh=11.0, scheme="converged", stations=[4.0]
    )
    beam = WinklerBeam.of(pavement.constants(20.0, 11.0))
    assert result.deflection is not None
    assert -result.deflection.min() == pytest.approx(beam.static_deflection(FORCE), rel=5e-3)


def test_paper_scheme_is_below_the_infinite_beam() -> None:
    """Bars 0.5 m apart sample a bed coarsely: peaks are some 10 % low at nodes, 30 % between."""
    pavement = pf.Pavement.paper()
    road = pf.Road(pavement, length=14.0)
    result = pf.simulate(road, one_axle(2 * FORCE), scheme="paper", stations=[7.0, 7.25])
    peak, _ = WinklerBeam.of(pavement.constants(20.0, 65.0)).moving_peak(FORCE, 65.0 / 3.6)
    assert result.deflection is not None
    at_node, between = 1.0 + result.deflection.min(axis=0) / peak
    assert 0.07 < at_node < 0.15
    assert 0.25 < between < 0.42


# --- simply supported beam --------------------------------------------------------------------

BRIDGE = SimplySupportedBeam(length=25.0, bending_stiffness=3.5e10 * 1.3901, mass=18_358.0)


def test_simply_supported_static() -> None:
    """A published vehicle-bridge code: 3.773997e-4 m under 5750 kg."""
    assert BRIDGE.static_deflection(5750 * 9.81) == pytest.approx(3.773997e-4, abs=0.5e-10)


def test_simply_supported_moving_force_by_hand() -> None:
    """Fryba's series: modes j of frequency j² w1, each driven at j pi v / L."""
    force, speed, length = 5750 * 9.81, 25.0, 25.0
    ei, mass = 3.5e10 * 1.3901, 18_358.0
    time = np.linspace(0.0, 1.0, 23)
    j = np.arange(1, 201)[:, np.newaxis]
    w = (j * np.pi / length) ** 2 * np.sqrt(ei / mass)
    drive = j * np.pi * speed / length
    modes = (2 * force / (mass * length)) * (
        (np.sin(drive * time) - drive / w * np.sin(w * time)) / (w**2 - drive**2)
    )
    for x in (6.25, 12.5, 20.0):
        expected = (modes * np.sin(j * np.pi * x / length)).sum(axis=0)
        found = BRIDGE.moving_deflection(force, speed, x, time, modes=200)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


def test_simply_supported_slow_force_is_static() -> None:
    force = 1e5
    found = BRIDGE.moving_deflection(force, 0.01, 12.5, [1250.0])
    assert found == pytest.approx(BRIDGE.static_deflection(force), rel=1e-3)


def test_pinned_road_is_the_simply_supported_beam() -> None:
    """A road with pinned ends on the softest of beds, crossed slowly: Fryba's bridge."""
    length, speed_kmh = 5.0, 54.0
    soft = pf.Pavement.paper(
        beam_damping=0.0,
        bar_mass=0.0,
        bar_damping=0.0,
        bar_rigidity=1e-6,
        asphalt_bar_stiffness=1e-6,
        moment_of_inertia=1e-2,
    )
    constants = soft.constants(20.0, speed_kmh)
    beam = SimplySupportedBeam(length, constants.bending_stiffness, constants.mass)
    road = pf.Road(soft, length, ends="pinned")
    scheme = pf.Scheme.converged(dt=2e-4)
    result = pf.simulate(
        road, one_axle(2 * FORCE), speed_kmh=speed_kmh, scheme=scheme, stations=[1.25, 2.5]
    )
    assert result.deflection is not None
    for column, x in enumerate((1.25, 2.5)):
        expected = beam.moving_deflection(FORCE, speed_kmh / 3.6, x, result.time)
        np.testing.assert_allclose(
            result.deflection[:, column],
            -expected,
            rtol=0,
            atol=2e-4 * beam.static_deflection(FORCE),
        )


def test_decay_length_of_the_pavement() -> None:
    """1 / lambda of Table I at 20 °C and 65 km/h, which the README holds against the 0.5 m mesh."""
    beam = pf.analytical.WinklerBeam.of(pf.Pavement.paper().constants(20.0, 65.0))
    assert 1.0 / beam.decay == pytest.approx(0.309, abs=5e-4)


def peak_at_mid_length(temperature_c: float, vma: float, speed_kmh: float) -> float:
    """Give the mid-node peak of the study's truck, tandem spacing 1.6 m, constant forces."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pf.ValidityWarning)  # the study leaves the laws' range
        result = pf.simulate(
            pf.Road.paper().with_asphalt(vma=vma),
            pf.vehicles.tandem_truck(axle_spacing=1.6),
            speed_kmh=speed_kmh,
            temperature_c=temperature_c,
            keep="envelope",
        )
    return -float(result.lowest[25])


@pytest.mark.parametrize(
    ("speed_kmh", "temperature", "vma"),
    [(25.0, 3.279, 2.014), (65.0, 2.770, 1.884), (105.0, 2.832, 1.646)],
)
def test_sensitivities_of_table_three(speed_kmh: float, temperature: float, vma: float) -> None:
    """Table III within 10 %: mean relative change of the peak over that of the input (Fig. 13)."""

    def sensitivity(points: list[float], peaks: list[float]) -> float:
        x, y = np.array(points), np.array(peaks)
        return float(np.mean(np.abs(np.diff(y) / y[:-1]) / (np.diff(x) / x[:-1])))

    hot = [10.0, 20.0, 30.0, 40.0]
    voids = [15.0, 20.0, 25.0, 30.0]
    of_hot = sensitivity(hot, [peak_at_mid_length(t, 25.0, speed_kmh) for t in hot])
    of_voids = sensitivity(voids, [peak_at_mid_length(20.0, v, speed_kmh) for v in voids])
    assert of_hot == pytest.approx(temperature, rel=0.1)
    assert of_voids == pytest.approx(vma, rel=0.1)
