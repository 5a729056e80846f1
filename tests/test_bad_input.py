"""What a user can get wrong, and what he is told; and that no valid input ever panics.

A `ValueError` for input, `SolverError` for numerics, `FormatError` and `OSError` for files; the
message holds the quantity, its value and the limit.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import pavefem as pf
from pavefem.analytical import SimplySupportedBeam, WinklerBeam

NAN, INF = float("nan"), float("inf")


def simulate(**changes: Any) -> pf.Result:
    inputs: dict[str, Any] = {
        "road": pf.Road(length=5.0),
        "vehicle": pf.vehicles.tandem_truck(),
        "profile": None,
    }
    return pf.simulate(**inputs | changes)


def creep(**changes: Any) -> pf.ForceDeflection:
    inputs: dict[str, Any] = {
        "force": [2e4, 4e4],
        "deflection": [2.5e-4, 5e-4],
        "speed_kmh": 15.0,
        "temperature_c": 10.0,
    }
    return pf.ForceDeflection(**inputs | changes)


def forces(**changes: Any) -> pf.TireForces:
    inputs: dict[str, Any] = {
        "vehicle": pf.vehicles.tandem_truck(),
        "profile": pf.Profile.smooth(30.0),
        "speed_kmh": 65.0,
    }
    return pf.tire_forces(**inputs | changes)


def modulus(temperature_c: Any = 20.0, speed_kmh: Any = 65.0, **mix: float) -> Any:
    return pf.Asphalt(**mix).modulus(temperature_c, speed_kmh)


def rough_with(value: float) -> pf.Profile:
    z = np.zeros(100)
    z[17] = value
    return pf.Profile(np.arange(100.0), z)


Call = Callable[[], object]
TABLE: list[tuple[str, Call, type[Exception], str]] = [
    # the road
    ("road shorter than an element", lambda: simulate(road=pf.Road(length=0.3)), ValueError,
     "section 0: length = 0.3 m: must be at least one element of 0.5 m"),
    ("road of one element", lambda: simulate(road=pf.Road(length=0.5)), ValueError,
     "road length = 0.5 m: must be at least two elements"),
    ("short section", lambda: simulate(
        road=pf.Road(sections=[(pf.Pavement.paper(), 5.0), (pf.Pavement.paper(), 0.1)])),
     ValueError, "section 1: length = 0.1 m"),
    ("road of no length", lambda: pf.Road(length=0.0), ValueError, "greater than 0"),
    ("road of NaN", lambda: pf.Road(length=NAN), ValueError, "length"),
    ("road without sections", lambda: pf.Road(sections=[]), ValueError, "sections"),
    ("sections that are no pairs", lambda: pf.Road(sections=[5.0]),  # type: ignore[list-item]
     ValueError, "sections.0"),
    ("sections that are no list", lambda: pf.Road(sections=5),  # type: ignore[arg-type]
     ValueError, "sections"),
    ("unknown ends", lambda: pf.Road(length=5.0, ends="glued"), ValueError, "ends"),
    ("road too long for dense matrices", lambda: simulate(road=pf.Road(length=5000.0)),
     ValueError, "the limit is 2000"),
    ("road of a million kilometres", lambda: simulate(road=pf.Road(length=1e9)),
     ValueError, ""),
    ("elements of a micrometre", lambda: simulate(scheme=pf.Scheme(element_length=1e-7)),
     ValueError, "the limit is 2000"),
    ("negative mass", lambda: pf.Pavement.paper(element_mass=-1.0), ValueError,
     "element_mass\n  Input should be greater than 0"),
    ("no mass", lambda: pf.Pavement.paper(element_mass=0.0), ValueError, "element_mass"),
    ("negative damping", lambda: pf.Pavement.paper(beam_damping=-1.0), ValueError, "beam_damping"),
    ("infinite stiffness", lambda: pf.Pavement.paper(bar_rigidity=INF), ValueError, "bar_rigidity"),
    ("unknown field", lambda: pf.Pavement.paper(colour="black"), ValueError, "colour"),
    ("text for a number", lambda: pf.Pavement.paper(bar_mass="heavy"), ValueError, "bar_mass"),
    # asphalt
    ("VMA too low", lambda: pf.Asphalt(vma=3.0), ValueError, "vma"),
    ("VMA above the whole", lambda: pf.Asphalt(vma=100.0), ValueError, "vma"),
    ("NaN penetration", lambda: pf.Asphalt(penetration_index=NAN), ValueError, "penetration_index"),
    ("above the softening point", lambda: simulate(temperature_c=60.0), ValueError,
     "temperature"),
    ("far above the softening point", lambda: modulus(temperature_c=100.0), ValueError,
     "temperature"),
    ("NaN temperature", lambda: simulate(temperature_c=NAN), ValueError, "temperature_c"),
    ("NaN temperature of a mix", lambda: modulus(temperature_c=NAN), ValueError, "temperature"),
    ("speed zero of a mix", lambda: modulus(speed_kmh=0.0), ValueError, "speed_kmh = 0: must be"),
    ("one bad speed of many", lambda: modulus(speed_kmh=[50.0, -1.0, 60.0]), ValueError,
     "speed_kmh = -1"),
    ("shapes that do not broadcast", lambda: modulus([1.0, 2.0], [50.0, 60.0, 70.0]), ValueError,
     "broadcast"),
    ("loading time zero", lambda: pf.Asphalt().binder_stiffness(20.0, 0.0), ValueError,
     "loading_time = 0.0 s"),
    ("text temperature", lambda: modulus(temperature_c="warm"), ValueError, "warm"),
    # speed
    ("speed zero", lambda: simulate(speed_kmh=0.0), ValueError, "speed_kmh"),
    ("negative speed", lambda: simulate(speed_kmh=-5.0), ValueError, "speed_kmh"),
    ("infinite speed", lambda: simulate(speed_kmh=INF), ValueError, "speed_kmh"),
    ("speed that crosses in one step", lambda: forces(speed_kmh=1e9), ValueError,
     "must be 1 to 100 million"),
    ("speed of a glacier", lambda: forces(speed_kmh=1e-9), ValueError, "must be 1 to 100 million"),
    ("speed zero of forces", lambda: forces(speed_kmh=0.0), ValueError, "speed_kmh = 0"),
    # the scheme
    ("dt zero", lambda: pf.Scheme(dt=0.0), ValueError, "dt"),
    ("dt NaN", lambda: pf.Scheme(dt=NAN), ValueError, "dt"),
    ("dt zero of forces", lambda: forces(dt=0.0), ValueError, "dt = 0 s"),
    ("unknown scheme", lambda: simulate(scheme="exact"), ValueError,
     "scheme = 'exact': must be one of"),
    ("scheme of the wrong type", lambda: simulate(scheme=5), ValueError, "scheme"),
    ("unknown weights", lambda: pf.Scheme(weights="cubic"), ValueError,
     "'linear' or 'hermite'"),
    ("element of no length", lambda: pf.Scheme(element_length=0.0), ValueError, "element_length"),
    # the vehicle
    ("vehicle of the wrong type", lambda: simulate(vehicle="truck"), ValueError, "vehicle"),
    ("negative body mass", lambda: pf.Body(name="b", mass=-1.0, x=0.0), ValueError, "mass"),
    ("body without a name", lambda: pf.Body(name="", mass=1.0, x=0.0), ValueError, "name"),
    ("infinite place", lambda: pf.Body(name="b", mass=1.0, x=INF), ValueError, "x"),
    ("spring without stiffness",
     lambda: pf.Spring(upper="a", lower="b", x=0.0, stiffness=0.0, damping=0.0), ValueError,
     "stiffness"),
    ("negative tire damping",
     lambda: pf.Tire(body="a", x=0.0, stiffness=1.0, damping=-1.0), ValueError, "damping"),
    ("spacing zero", lambda: pf.vehicles.tandem_truck(axle_spacing=0.0), ValueError,
     "axle_spacing"),
    ("spacing NaN", lambda: pf.vehicles.tandem_truck(axle_spacing=NAN), ValueError,
     "axle_spacing"),
    ("spacing beyond the steer axle", lambda: pf.vehicles.tandem_truck(axle_spacing=10.5),
     ValueError, "axle_spacing = 10.5 m"),
    ("payload below the tare", lambda: pf.vehicles.tandem_truck(payload=-5000.0), ValueError,
     "payload"),
    ("payload infinite", lambda: pf.vehicles.tandem_truck(payload=INF), ValueError, "payload"),
    ("no beam inertia", lambda: pf.vehicles.tandem_truck(beam_inertia=0.0), ValueError, "inertia"),
    # the profile
    ("NaN in a profile", lambda: rough_with(NAN), ValueError, "z[17] is nan"),
    ("infinity in a profile", lambda: rough_with(INF), ValueError, "z[17] is inf"),
    ("truck longer than the profile", lambda: forces(profile=pf.Profile.smooth(5.0)), ValueError,
     "is 5 m long, shorter than the three-axle tandem truck, 5.85 m"),
    ("profile shorter than the road", lambda: simulate(profile=pf.Profile.smooth(4.0)), ValueError,
     "is 4 m long, but the run-in of 0 m and the road of 5 m need 5 m"),
    ("profile of the wrong type", lambda: simulate(profile=[1.0, 2.0]), ValueError, "profile"),
    ("run-in beyond the profile", lambda: forces(run_in=30.0), ValueError,
     "run_in = 30 m: must be below the length of the profile, 30 m"),
    ("negative run-in", lambda: forces(run_in=-1.0), ValueError, "run_in = -1 m"),
    ("negative run-in of a run", lambda: simulate(run_in=-1.0), ValueError, "run_in"),
    ("negative distance", lambda: forces(distance=-1.0), ValueError, "distance = -1"),
    ("no distance on a smooth road", lambda: forces(profile=None), ValueError, "give the distance"),
    ("unknown interpolation", lambda: forces(interpolation="cubic"), ValueError, "interpolation"),
    ("unknown interpolation of a run", lambda: simulate(interpolation="cubic"), ValueError,
     "interpolation"),
    # what is kept
    ("unknown quantity", lambda: simulate(keep=["strain"]), ValueError, "keep = ['strain']"),
    ("quantity as text", lambda: simulate(keep="deflection"), ValueError, "keep = 'deflection'"),
    ("keep of the wrong type", lambda: simulate(keep=5), ValueError, "keep"),
    ("keep of nothing", lambda: simulate(keep=None), ValueError, "keep"),
    ("every zero", lambda: simulate(every=0), ValueError, "every = 0: must be a whole number"),
    ("every negative", lambda: simulate(every=-1), ValueError, "every = -1"),
    ("every half", lambda: simulate(every=1.5), ValueError, "every = 1.5"),
    ("every true", lambda: simulate(every=True), ValueError, "every = True"),
    ("station off the road", lambda: simulate(stations=[5.1]), ValueError,
     "station = 5.1 m: must be on the road, 0 to 5.0 m"),
    ("station before the road", lambda: simulate(stations=[-0.1]), ValueError, "station = -0.1 m"),
    ("station NaN", lambda: simulate(stations=[NAN]), ValueError, "station"),
    ("stations in a table", lambda: simulate(stations=[[1.0]]), ValueError,
     "stations must be one-dimensional, got shape (1, 1)"),
    ("station as a number", lambda: simulate(stations=1.0), ValueError,
     "stations must be one-dimensional, got shape ()"),
    ("station as text", lambda: simulate(stations=["1"]), ValueError,
     "stations must hold real numbers"),
    ("stations in a set", lambda: simulate(stations={1.0}), ValueError,
     "stations must hold real numbers"),
    ("complex station", lambda: simulate(stations=np.array([1.0 + 1.0j])), ValueError,
     "stations must hold real numbers"),
    ("masked station", lambda: simulate(stations=np.ma.masked_less([1.0, 2.0], 1.5)),
     ValueError, "stations must hold real numbers, got masked values"),
    ("quantity in an array", lambda: simulate(keep=[np.array([1, 2])]), ValueError,
     "must be \"envelope\" or some of"),
    ("every beyond all numbers", lambda: simulate(every=2**64), ValueError,
     "every = 18446744073709551616"),
    ("beam as thin as nothing", lambda: pf.Pavement(thickness=1e-300), ValueError, "thickness"),
    ("beam of no width", lambda: pf.Pavement(moment_of_inertia=1e-320), ValueError,
     "moment_of_inertia"),
    # studies
    ("masked force", lambda: creep(force=np.ma.masked_less([2e4, 4e4], 3e4)), ValueError,
     "force must hold real numbers, got masked values"),
    ("complex force", lambda: creep(force=np.array([2e4 + 1j, 4e4])), ValueError,
     "force must hold real numbers"),
    ("forces in a set", lambda: creep(force={2e4, 4e4}), ValueError,
     "force must hold real numbers"),
    ("two speeds of a creep test", lambda: creep(speed_kmh=[5.0, 6.0]), ValueError,
     "speed_kmh = [5.0, 6.0]"),
    ("no temperature of a creep test", lambda: creep(temperature_c=None), ValueError,
     "temperature_c = None"),
    ("place of a creep test as text", lambda: creep(x="5"), ValueError, "x = '5'"),
    ("start of a fit as text", lambda: pf.calibrate(
        pf.Road.paper(), creep(), {"vma": (20.0, 30.0)}, start={"vma": "25"}),  # type: ignore[dict-item]
     ValueError,
     "start of vma = '25'"),
    ("start of a fit as a number", lambda: pf.calibrate(
        pf.Road.paper(), creep(), {"vma": (20.0, 30.0)}, start=25.0),  # type: ignore[arg-type]
     ValueError, "start = 25.0: must be a mapping"),
    ("interval of a level as text", lambda: pf.calibrate(
        pf.Road.paper(), creep(), {"bar_rigidity": (1e7, 1e9)}).interval(
            "bar_rigidity", "95"), ValueError, "level = '95'"),  # type: ignore[arg-type]
    ("sensitivity beyond all numbers", lambda: pf.studies.paper_sensitivity(
        [1e-300, 1e300], [1e-300, 1e300]), ValueError, "too large"),
    # closed forms
    ("beam without stiffness", lambda: WinklerBeam(0.0, 1.0, 1.0).moving_deflection(1.0, 1.0, 0.0),
     ValueError, "bending_stiffness = 0"),
    ("bed without stiffness", lambda: WinklerBeam(1.0, 1.0, 0.0).moving_peak(1.0, 1.0),
     ValueError, "stiffness"),
    ("undamped at the critical speed", lambda: WinklerBeam(75e3, 2000.0, 1.2e8).moving_peak(
        1.0, WinklerBeam(75e3, 2000.0, 1.2e8).critical_speed), ValueError, "speed"),
    ("negative speed of a force", lambda: WinklerBeam(75e3, 2000.0, 1.2e8).moving_peak(1.0, -1.0),
     ValueError, "speed"),
    ("NaN stiffness at rest", lambda: WinklerBeam(NAN, 1.0, 1.0).static_deflection(1.0),
     ValueError, "stiffness"),
    ("no span", lambda: SimplySupportedBeam(0.0, 1.0, 1.0).static_deflection(1.0), ValueError,
     "length"),
    ("no modes", lambda: SimplySupportedBeam(1.0, 1.0, 1.0).moving_deflection(
        1.0, 1.0, 0.5, [0.5], modes=-1), (ValueError, OverflowError), ""),  # type: ignore[list-item]
    # files
    ("no profile file", lambda: pf.read_profile("none.csv"), FileNotFoundError, "none.csv"),
    ("profile of an unknown format", lambda: pf.read_profile("road.doc"), pf.FormatError, "'.doc'"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("call", "kind", "fragment"), [row[1:] for row in TABLE], ids=[row[0] for row in TABLE]
)
def test_bad_input(call: Call, kind: type[Exception], fragment: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pf.ValidityWarning)
        with pytest.raises(kind) as caught:
            call()
    assert re.search(re.escape(fragment), str(caught.value)), str(caught.value)


def test_result_into_an_unwritable_folder(tmp_path: Path) -> None:
    result = simulate()
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OSError, match="file"):
        result.to_netcdf(tmp_path / "file" / "result.nc")
    assert result.max_deflection > 0.0


def test_overflow_is_a_solver_error() -> None:
    """Elevations of 1e305 m are finite, the forces they make are not."""
    profile = pf.Profile(np.arange(40.0), 1e305 * (np.arange(40) % 2))
    with pytest.raises(pf.SolverError, match="tire force is not finite"):
        forces(profile=profile)


def test_warnings_name_quantity_value_and_limits() -> None:
    with pytest.warns(pf.ValidityWarning, match=r"loading time 0\.2\d* s .* 0\.01 to 0\.1 s"):
        modulus(speed_kmh=5.0)
    with pytest.warns(pf.ValidityWarning, match=r"vma 10 % .* 12 to 30 %"):
        modulus(vma=10.0)
    with pytest.warns(pf.ValidityWarning, match=r"penetration index 2 .* -1 to 1"):
        modulus(penetration_index=2.0)
    with pytest.warns(pf.ValidityWarning) as caught:
        modulus(temperature_c=52.0)
    texts = " ".join(str(warning.message) for warning in caught)
    assert "softening point minus temperature 8 °C" in texts
    assert "binder stiffness" in texts
    assert "above 5 MPa" in texts
    assert all(warning.filename == __file__ for warning in caught)


def test_warning_of_a_run_points_at_the_user() -> None:
    with pytest.warns(pf.ValidityWarning):
        simulate(temperature_c=52.0)


def test_limits_themselves_are_inside() -> None:
    modulus(vma=12.0, temperature_c=20.0)
    modulus(vma=30.0, temperature_c=20.0)
    modulus(penetration_index=1.0)
    modulus(speed_kmh=[10.8, 108.0])


# --- valid input never panics -----------------------------------------------------------------


def positive(low: float, high: float) -> st.SearchStrategy[float]:
    """Draw numbers over many orders of magnitude."""
    return st.floats(np.log10(low), np.log10(high)).map(lambda e: float(10.0**e))


pavements = st.builds(
    pf.Pavement,
    asphalt=st.builds(pf.Asphalt, vma=st.floats(4.0, 60.0), penetration_index=st.floats(-3.0, 3.0)),
    moment_of_inertia=positive(1e-8, 1e2),
    spacing=positive(0.1, 5.0),
    element_mass=positive(1.0, 1e5),
    beam_damping=st.one_of(st.just(0.0), positive(1.0, 1e6)),
    bar_mass=st.one_of(st.just(0.0), positive(1.0, 1e4)),
    bar_damping=st.one_of(st.just(0.0), positive(1.0, 1e7)),
    bar_rigidity=positive(1e3, 1e11),
    asphalt_bar_stiffness=positive(1e3, 1e11),
)


@given(
    st.lists(st.tuples(pavements, positive(0.6, 8.0)), min_size=1, max_size=3),
    st.sampled_from(["clamped", "pinned", "free"]),
    positive(5.0, 300.0),
    st.floats(-30.0, 55.0),
    st.builds(
        pf.Scheme,
        foundation=st.sampled_from(["bars", "winkler"]),
        element_length=st.floats(0.2, 0.6),
        weights=st.sampled_from(["linear", "hermite"]),
        hold=st.sampled_from(["zero", "first"]),
        dt=positive(2e-4, 5e-2),
    ),
    st.floats(0.4, 10.0),
    positive(1.0, 1e5),
    st.integers(0, 50),
)
@settings(max_examples=40, suppress_health_check=list(HealthCheck))
def test_random_valid_inputs_give_finite_answers(
    sections: list[tuple[pf.Pavement, float]],
    ends: str,
    speed_kmh: float,
    temperature_c: float,
    scheme: pf.Scheme,
    spacing: float,
    payload: float,
    seed: int,
) -> None:
    """Whatever is inside the fields' ranges: springs and dampers that cannot blow up, do not."""
    road = pf.Road(sections=sections, ends=ends)
    truck = pf.vehicles.tandem_truck(axle_spacing=spacing, payload=payload)
    profile = pf.Profile.iso8608("B", length=50.0, seed=seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pf.ValidityWarning)
        result = pf.simulate(
            road,
            truck,
            profile=profile,
            speed_kmh=speed_kmh,
            temperature_c=temperature_c,
            scheme=scheme,
            run_in=5.0,
            every=3,
            cache=False,
        )
    assert result.deflection is not None
    assert result.forces is not None
    for name in ("lowest", "highest", "time_of_lowest", "deflection"):
        assert np.isfinite(getattr(result, name)).all(), name
    assert np.isfinite(result.forces.force).all()
    assert (result.lowest <= result.highest).all()
    assert result.max_deflection >= 0.0
    assert result.summary()


numbers = st.floats(allow_nan=True, allow_infinity=True)


@given(numbers, numbers)
@settings(max_examples=200)
def test_any_number_is_an_answer_or_a_value_error(temperature: float, speed: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = float(modulus(temperature, speed))
        except ValueError:
            return
    assert np.isfinite(found)
    assert found >= 0.0


@given(st.lists(numbers, min_size=2, max_size=6), numbers, numbers, numbers)
@settings(max_examples=60)
def test_any_profile_and_numbers_never_panic(
    z: list[float], speed: float, dt: float, run_in: float
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = pf.tire_forces(
                pf.vehicles.tandem_truck(),
                pf.Profile(8.0 * np.arange(len(z)), z),
                speed,
                # Nobody wants a hundred million steps here.
                dt=max(dt, 1e-4) if dt > 0.0 else dt,
                run_in=run_in,
                distance=1e-3 * speed if speed > 1.0 else None,
            )
        except (ValueError, pf.SolverError):
            return
    assert np.isfinite(found.force).all()
