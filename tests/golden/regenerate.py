"""Write golden.json: what this version answers at a few points. Say in the commit why it changed.

The numbers are ours against ourselves, to every digit that does not depend on the machine: they
notice a change, they do not say which side is right. That is what test_literature.py is for.

Run as ``python tests/golden/regenerate.py``; nothing else writes the file.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

import pavefem as pf

GOLDEN = Path(__file__).with_name("golden.json")

Numbers = dict[str, Any]


def scenarios() -> dict[str, pf.Scenario]:
    """Give the points, by name."""
    rough = pf.Profile.iso8608("C", length=90.0, seed=7)
    sections = pf.Road(
        sections=[
            (pf.Pavement.paper(), 4.2),
            (pf.Pavement.paper(pf.Asphalt(vma=18.0), bar_rigidity=4e7), 3.0),
        ],
        ends="free",
    )
    return {
        "nominal": pf.Scenario(),
        "25 km/h, 10 °C, VMA 15 %": pf.Scenario(
            road=pf.Road.paper().with_asphalt(vma=15.0), speed_kmh=25.0, temperature_c=10.0
        ),
        "105 km/h, spacing 1.6 m, payload 5 t": pf.Scenario(
            vehicle=pf.vehicles.tandem_truck(axle_spacing=1.6, payload=5000.0), speed_kmh=105.0
        ),
        "rough": pf.Scenario(profile=rough, run_in=50.0),
        "rough, staircase, first-order hold": pf.Scenario(
            profile=rough,
            run_in=50.0,
            interpolation="staircase",
            scheme=pf.Scheme.paper(hold="first"),
        ),
        "very rough, lifting off": pf.Scenario(
            profile=pf.Profile.iso8608("H", length=90.0, seed=2),
            run_in=40.0,
            speed_kmh=90.0,
            lift_off=True,
        ),
        "converged, 8 m": pf.Scenario(road=pf.Road(length=8.0), scheme=pf.Scheme.converged()),
        "sections, free ends, rough": pf.Scenario(
            road=sections,
            profile=rough,
            run_in=30.0,
            speed_kmh=80.0,
            temperature_c=28.0,
            scheme=pf.Scheme.converged(element_length=0.25),
        ),
    }


def digest(values: np.ndarray) -> Numbers:
    """Condense a history: its size, its norm, and what it is at a few instants and places."""
    rows = np.linspace(0, values.shape[0] - 1, 9).round().astype(int)[1:]
    columns = np.linspace(0, values.shape[1] - 1, 5).round().astype(int)
    return {
        "shape": list(values.shape),
        "norm": float(np.sqrt((values**2).sum())),
        "samples": values[np.ix_(rows, columns)].tolist(),
    }


def answer(scenario: pf.Scenario) -> Numbers:
    """Run a scenario without the cache and condense the result."""
    result = pf.run(scenario, cache=False)
    assert result.deflection is not None
    assert result.forces is not None
    return {
        "max_deflection": result.max_deflection,
        "rebound": float(result.highest.max()),
        "middle": float(result.lowest[result.x.size // 2]),
        "time_of_lowest": float(result.time_of_lowest[result.lowest.argmin()]),
        "deflection": digest(result.deflection),
        "tire_force": digest(result.forces.force),
        "lift_off": [[lift.axle, lift.instants, lift.position] for lift in result.forces.lift_off],
    }


if __name__ == "__main__":
    answers = {name: answer(scenario) for name, scenario in scenarios().items()}
    text = json.dumps(answers, indent=1, ensure_ascii=False)
    GOLDEN.write_text(text + "\n", encoding="utf-8")
    print(f"wrote {len(answers)} answers to {GOLDEN}")
