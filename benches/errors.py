"""What a scheme costs in accuracy: the tables of docs/which-scheme.md, as Markdown.

A wheel rolls over the paper's pavement; its largest deflection, at nodes and between them, is held
against the closed form of a moving force on a Winkler bed. And the study of the tandem's spacing
(the paper's Fig. 8), by the paper's scheme and by the converged one.

Run as ``python benches/errors.py``. A test runs it too and compares the page with it.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import numpy as np

import pavefem as pf
from pavefem.analytical import WinklerBeam

SPEEDS = (25.0, 65.0, 105.0)
TEMPERATURES = (0.0, 20.0, 40.0)
PRINT = 0.3
SCHEMES = {
    "paper": pf.Scheme.paper(),
    "paper, Hermite weights": pf.Scheme.paper(weights="hermite"),
    "Winkler bed, Hermite weights, 0.5 m": pf.Scheme.converged(element_length=0.5),
    "converged": pf.Scheme.converged(),
}
SPACINGS = (0.7, 1.3, 1.6, 2.2)
READINGS = {
    "default": pf.Pavement.paper(),
    "second": pf.Pavement.paper(
        pf.Asphalt(penetration_index=-0.16), bar_damping=14e3, asphalt_bar_stiffness=84.3e6
    ),
}
LENGTH = 25.0
FRACTIONS = np.array([0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875])

Row = tuple[str, list[float]]


def wheel() -> pf.Vehicle:
    """Build a mass on a tire: on a smooth road, a constant force."""
    return pf.Vehicle(
        name="wheel",
        bodies=[pf.Body(name="mass", mass=8000.0, x=0.0)],
        tires=[pf.Tire(body="mass", x=0.0, stiffness=1e6, damping=1e4)],
    )


def peak_errors(scheme: pf.Scheme, temperature_c: float, speed_kmh: float) -> list[float]:
    """Errors of the peak in percent, the largest of several nodes, and of places between them."""
    road, vehicle = pf.Road(pf.Pavement.paper(), LENGTH), wheel()
    h = scheme.element_length or road.element_length(temperature_c, speed_kmh)
    places = 12.0 + h * np.add.outer(np.arange(5), FRACTIONS).ravel()
    result = pf.simulate(
        road,
        vehicle,
        temperature_c=temperature_c,
        speed_kmh=speed_kmh,
        scheme=scheme,
        keep=["deflection"],
        stations=places.tolist(),
    )
    assert result.deflection is not None
    beam = WinklerBeam.of(road.sections[0].pavement.constants(temperature_c, speed_kmh))
    force = vehicle.static_loads[0] / 2.0
    exact, _ = beam.moving_peak(force, speed_kmh / 3.6, scheme.tire_print)
    errors = 100.0 * (refined_peaks(result.deflection) / exact - 1.0).reshape(-1, FRACTIONS.size)
    return [float(part.flat[np.abs(part).argmax()]) for part in (errors[:, :1], errors[:, 1:])]


def refined_peaks(history: np.ndarray) -> np.ndarray:
    """Largest downward deflection of every column, by a parabola through three samples."""
    down, column = -history, np.arange(history.shape[1])
    top = down.argmax(axis=0)
    before, at, after = (down[top + step, column] for step in (-1, 0, 1))
    return at - (before - after) ** 2 / (8.0 * (before - 2.0 * at + after))


def errors(tire_print: float, temperatures: tuple[float, ...]) -> Iterator[Row]:
    """Rows of a table of errors, percent: for each scheme, at nodes and between them."""
    for temperature_c in temperatures:
        for speed_kmh in SPEEDS:
            modulus = float(pf.Asphalt().modulus(temperature_c, speed_kmh)) / 1e9
            row = []
            for scheme in SCHEMES.values():
                spread = scheme.model_copy(update={"tire_print": tire_print})
                row += peak_errors(spread, temperature_c, speed_kmh)
            yield f"{temperature_c:g} °C, {speed_kmh:g} km/h, {modulus:.2g} GPa", row


def spacings() -> Iterator[Row]:
    """Rows of a table of peaks at mid-length, mm, by the spacing of the tandem's axles."""
    for reading, pavement in READINGS.items():
        for speed_kmh in SPEEDS:
            for name in ("paper", "converged"):
                peaks = []
                for spacing in SPACINGS:
                    result = pf.simulate(
                        pf.Road(pavement, LENGTH),
                        pf.vehicles.tandem_truck(axle_spacing=spacing),
                        speed_kmh=speed_kmh,
                        scheme=SCHEMES[name],
                        keep=["deflection"],
                        stations=[LENGTH / 2.0],
                    )
                    assert result.deflection is not None
                    peaks.append(1e3 * float(refined_peaks(result.deflection)[0]))
                yield f"{reading} reading, {speed_kmh:g} km/h, {name}", peaks


def tables() -> list[list[Row]]:
    """All of them: errors of a force in a point, of one with a print, and peaks by spacing."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pf.ValidityWarning)  # 40 °C is beyond the formulas' range
        return [[*errors(0.0, TEMPERATURES)], [*errors(PRINT, (20.0,))], [*spacings()]]


def markdown(rows: list[Row]) -> str:
    """Rows as those of a Markdown table."""
    return "\n".join(
        f"| {label} | " + " | ".join(f"{number:.3f}" for number in numbers) + " |"
        for label, numbers in rows
    )


if __name__ == "__main__":
    print("\n\n".join(markdown(rows) for rows in tables()))
