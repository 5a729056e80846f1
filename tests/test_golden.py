"""Ours against ourselves: golden/golden.json, which only golden/regenerate.py writes."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

FOLDER = Path(__file__).parent / "golden"
GOLDEN: dict[str, dict[str, Any]] = json.loads((FOLDER / "golden.json").read_text(encoding="utf-8"))


def _regenerate() -> ModuleType:
    spec = importlib.util.spec_from_file_location("regenerate", FOLDER / "regenerate.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


regenerate = _regenerate()
SCENARIOS = regenerate.scenarios()


def test_every_point_is_there() -> None:
    assert set(GOLDEN) == set(SCENARIOS)


@pytest.mark.parametrize("name", GOLDEN)
def test_golden(name: str) -> None:
    found, expected = regenerate.answer(SCENARIOS[name]), GOLDEN[name]
    # A window is cut in time by the lanes that a machine has, which may show in the eighth digit.
    part = 1e-7 if SCENARIOS[name].scheme.solver == "window" else 1e-9
    assert set(found) == set(expected)
    for key in ("max_deflection", "rebound", "middle"):
        assert found[key] == pytest.approx(expected[key], rel=part, abs=1e-15), key
    assert found["time_of_lowest"] == pytest.approx(expected["time_of_lowest"], abs=1e-12)
    for key in ("deflection", "tire_force"):
        assert found[key]["shape"] == expected[key]["shape"]
        assert found[key]["norm"] == pytest.approx(expected[key]["norm"], rel=part)
        samples, largest = np.array(expected[key]["samples"]), expected[key]["norm"]
        np.testing.assert_allclose(
            found[key]["samples"], samples, rtol=part, atol=1e-3 * part * largest, err_msg=key
        )
    assert [lift[:2] for lift in found["lift_off"]] == [lift[:2] for lift in expected["lift_off"]]
    np.testing.assert_allclose(
        [lift[2] for lift in found["lift_off"]],
        [lift[2] for lift in expected["lift_off"]],
        rtol=0,
        atol=1e-9,
    )


def test_points_differ() -> None:
    """Else a point tests nothing of its own."""
    peaks = [point["max_deflection"] for point in GOLDEN.values()]
    assert len(set(peaks)) == len(peaks)
    assert any(point["lift_off"] for point in GOLDEN.values())
