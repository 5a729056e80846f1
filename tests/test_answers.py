"""What the pavement answers besides its deflection: closed forms, and derivatives of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import pavefem as pf
from pavefem.analytical import WinklerBeam
from pavefem.quantities import QUANTITIES, Quantity

Array = NDArray[np.float64]

SPEED_KMH = 65.0
LENGTH, MIDDLE = 60.0, 30.0


def wheel(load: float = 40e3) -> pf.Vehicle:
    return pf.Vehicle(
        name="wheel",
        bodies=[pf.Body(name="mass", mass=load / 9.81, x=0.0)],
        tires=[pf.Tire(body="mass", x=0.0, stiffness=1e6, damping=0.0)],
    )


def steady(pavement: pf.Pavement, scheme: pf.Scheme, **keep: object) -> pf.Result:
    return pf.simulate(
        pf.Road(pavement, length=LENGTH),
        wheel(),
        speed_kmh=SPEED_KMH,
        scheme=scheme,
        keep=["deflection", "velocity", "curvature", "moment", "strain", "pressure"],
        stations=[MIDDLE, MIDDLE + 0.03],
        **keep,  # type: ignore[arg-type]
    )


def closed_form(pavement: pf.Pavement, place: float, time: Array) -> dict[str, Array]:
    """Steady state on an infinite beam at `place`: derivatives by differences of the deflection."""
    constants = pavement.constants(20.0, SPEED_KMH)
    beam, speed = WinklerBeam.of(constants), SPEED_KMH / 3.6
    ahead = place - speed * time

    def w(shift: float) -> Array:
        return -np.asarray(beam.moving_deflection(20e3, speed, ahead + shift))

    d = 2e-3
    slope = (w(d) - w(-d)) / (2 * d)
    curvature = (w(d) - 2 * w(0.0) + w(-d)) / d**2
    rate = (w(2 * d) - 2 * w(d) + 2 * w(-d) - w(-2 * d)) / (2 * d**3) * -speed
    velocity = -speed * slope
    moment = constants.bending_stiffness * curvature + constants.bending_damping * rate
    reaction = -(constants.bed_stiffness * w(0.0) + constants.bed_damping * velocity)
    return {
        "deflection": w(0.0),
        "velocity": velocity,
        "curvature": curvature,
        "moment": moment,
        "strain": curvature * 0.10 / 2,
        "pressure": reaction / 0.54,
    }


@pytest.mark.parametrize("name", QUANTITIES)
@pytest.mark.parametrize("station", [0, 1], ids=["at a node", "between nodes"])
def test_a_moving_wheel_has_its_closed_form(name: str, station: int) -> None:
    pavement = pf.Pavement.paper()
    result = steady(pavement, pf.Scheme.converged(dt=2.5e-4))
    assert result.stations is not None
    expected = closed_form(pavement, result.stations[station], result.time)[name]
    found = result.dataset[name].to_numpy()[:, station]
    inside = np.abs(result.time * SPEED_KMH / 3.6 - MIDDLE) < 5.0
    if name == "moment":  # which has a kink under a point force
        inside &= np.abs(result.time * SPEED_KMH / 3.6 - result.stations[station]) > 0.2
    error = np.abs(found - expected)[inside].max() / np.abs(expected).max()
    assert error < (0.025 if name in ("curvature", "moment", "strain") else 5e-3), error
    if name != "moment":
        assert found[inside].max() == pytest.approx(expected[inside].max(), rel=5e-3)


@pytest.mark.parametrize(("name", "ratio"), [("curvature", 3.5), ("moment", 1.8)])
def test_curvature_converges(name: Quantity, ratio: float) -> None:
    """Curvature to second order, a moment's kink under a point force to first."""
    pavement = pf.Pavement.paper()
    errors = []
    for h in (0.25, 0.125):
        result = steady(pavement, pf.Scheme.converged(dt=1.25e-4, element_length=h))
        expected = closed_form(pavement, MIDDLE, result.time)[name]
        inside = np.abs(result.time * SPEED_KMH / 3.6 - MIDDLE) < 5.0
        found = result.history(MIDDLE, name).to_numpy()
        errors.append(np.abs(found - expected)[inside].max() / np.abs(expected).max())
    assert errors[0] / errors[1] > ratio, errors


def test_velocity_is_the_rate_of_the_deflection() -> None:
    result = steady(pf.Pavement.paper(), pf.Scheme.converged())
    deflection, velocity = (result.history(MIDDLE, name) for name in ("deflection", "velocity"))
    slope = np.gradient(deflection.to_numpy(), 1e-3)
    assert np.abs(velocity - slope).max() < 5e-3 * np.abs(slope).max()


def test_the_bed_carries_the_wheel() -> None:
    """The pressure over the strip, and inertia's part gone by, is the load of one track."""
    pavement = pf.Pavement.paper()
    result = pf.simulate(
        pf.Road(pavement, length=LENGTH),
        wheel(),
        speed_kmh=15.0,
        scheme=pf.Scheme.converged(dt=2e-3),
        keep=["pressure"],
    )
    middle = int(MIDDLE / (15.0 / 3.6) / 2e-3)
    carried = result.dataset["pressure"][middle].integrate("x") * pavement.width
    assert float(carried) == pytest.approx(20e3, rel=2e-3)


def test_sections_have_their_own_thickness() -> None:
    thin, thick = pf.Pavement.paper(), pf.Pavement.paper(thickness=0.2)
    road = pf.Road(sections=[(thin, 10.0), (thick, 10.0)])
    result = pf.simulate(
        road,
        wheel(),
        scheme="converged",
        keep=["curvature", "strain"],
        stations=[5.0, 10.0, 15.0],
    )
    ratio = result.dataset["strain"] / result.dataset["curvature"]
    np.testing.assert_allclose(ratio[200], [0.05, 0.1, 0.1], rtol=1e-12)


def test_bars_bend_between_their_nodes() -> None:
    """On bars the curvature at a node is the mean of both elements' own."""
    scheme = pf.Scheme.paper(solver="window")
    result = steady(pf.Pavement.paper(), scheme)
    everywhere = pf.simulate(
        pf.Road(length=LENGTH), wheel(), speed_kmh=SPEED_KMH, scheme=scheme, keep=["curvature"]
    )
    np.testing.assert_allclose(
        result.history(MIDDLE, "curvature"), everywhere.history(MIDDLE, "curvature"), atol=1e-15
    )
    # The beam sags under the wheel, and hogs ahead of it and behind.
    curvature = everywhere.history(MIDDLE, "curvature")
    assert float(curvature.max()) > 2 * -float(curvature.min()) > 0.0


def test_peaks_of_each_axle() -> None:
    """One peak an axle: heavier axles press deeper, and the deepest is the envelope."""
    truck = pf.vehicles.tandem_truck()
    result = pf.simulate(pf.Road(length=40.0), truck, scheme="converged", keep=["deflection"])
    peaks = result.dataset["peak_deflection"]
    assert peaks.dims == ("axle", "x")
    np.testing.assert_allclose(peaks.max("axle"), -result.lowest, atol=1e-15)
    inside = peaks.sel(x=slice(5.0, 35.0))
    assert (inside.sel(axle=1) < 0.7 * inside.sel(axle=2)).all()
    # While an axle is the nearest: from the history.
    history, speed = result.history(20.0).to_numpy(), SPEED_KMH / 3.6
    edges = [(20.0 + x) / speed for x in (4.55 / 2, (4.55 + 5.85) / 2)]
    for axle, (start, end) in enumerate(zip([0.0, *edges], [*edges, 9.0], strict=True)):
        during = history[(result.time > start) & (result.time < end)]
        found = float(peaks.sel(x=20.0)[axle])
        assert 0.0 <= found + during.min() < 1e-3 * found


def test_a_file_keeps_them(tmp_path: Path) -> None:
    result = steady(pf.Pavement.paper(), pf.Scheme.converged())
    result.to_netcdf(tmp_path / "result.nc")
    again = pf.load_result(tmp_path / "result.nc")
    assert list(again.histories) == list(result.histories)
    for name, values in result.histories.items():
        np.testing.assert_array_equal(again.histories[name], values)
        assert again.dataset[name].attrs["units"] == QUANTITIES[name].units
    np.testing.assert_array_equal(again.peak_deflection, result.peak_deflection)


def test_they_are_drawn() -> None:
    result = steady(pf.Pavement.paper(), pf.Scheme.converged())
    axes = result.plot(MIDDLE).axes
    titles = [each.get_title() for each in axes]
    for name in QUANTITIES:
        assert f"{name.capitalize()} at x = 30 m" in titles
    envelope = axes[titles.index("Envelope of the deflection")]
    (peaks,) = [
        line for line in envelope.get_lines() if line.get_label() == "lowest as axle 1 passes"
    ]
    np.testing.assert_allclose(np.asarray(peaks.get_ydata()), -1e3 * result.peak_deflection[0])


def test_the_transition_matrix_answers_deflections_only() -> None:
    with pytest.raises(ValueError, match='solver="dense" answers deflections only; for strain use'):
        pf.simulate(pf.Road(), wheel(), keep=["strain"])


def test_what_was_not_kept_is_said() -> None:
    result = pf.simulate(pf.Road(), wheel(), keep=["deflection"])
    with pytest.raises(ValueError, match="no history of 'strain' was kept, only of deflection"):
        result.history(12.5, "strain")
    with pytest.raises(ValueError, match="no history of 'stress' was kept"):
        result.history(12.5, "stress")  # type: ignore[arg-type]
