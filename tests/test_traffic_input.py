"""Traffic as a table: from arrays and tables, drawn at random, and from floating-car data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pavefem as pf

SUMO = Path(__file__).parents[2] / "shared" / "data" / "sumo_fcd"
KINDS: dict[str, pf.Vehicle | str] = {"rigid2": "rigid_truck", "artic5": "tridem_semitrailer"}
LORRY = pf.vehicles.rigid_truck()

needs_sumo = pytest.mark.skipif(not SUMO.exists(), reason="needs ../shared/data/sumo_fcd")


def test_rows_are_sorted_by_entry() -> None:
    traffic = pf.Traffic([LORRY], [0, 0, 0], [3.0, 1.0, 2.0], [80.0, 70.0, 60.0])
    assert traffic.entry_time.tolist() == [1.0, 2.0, 3.0]
    assert traffic.speed_kmh.tolist() == [70.0, 60.0, 80.0]
    assert traffic.vehicle_id == (1, 2, 0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"vehicle": [1]}, r"vehicle = 1 of passage 0: must be a whole number, 0 to 0"),
        ({"entry_time": [np.nan]}, "entry_time = nan of passage 0: must be finite"),
        ({"speed_kmh": [-1.0]}, "speed_kmh = -1 of passage 0: must be not below 0"),
        ({"lane": [0]}, "lane = 0 of passage 0"),
        ({"direction": [0]}, "direction = 0 of passage 0: must be 1 or -1"),
        ({"lateral_offset": [7.0]}, "lateral_offset = 7 of passage 0"),
        ({"speed_kmh": [1.0, 2.0]}, "must be 1 numbers or one"),
        ({"courses": [([0.0, 1.0], [5.0, 4.0])]}, "places must not go back"),
        ({"courses": [([0.0], [5.0])]}, "at least 2"),
    ],
)
def test_mistakes_are_named(changes: dict[str, Any], message: str) -> None:
    columns: dict[str, Any] = {"vehicle": [0], "entry_time": [0.0], "speed_kmh": [80.0], **changes}
    with pytest.raises(ValueError, match=message):
        pf.Traffic([LORRY], **columns)


def test_a_dataframe_goes_round() -> None:
    pytest.importorskip("pandas")
    traffic = pf.Traffic([LORRY], [0, 0], [1.0, 2.5], 80.0, lane=[1, 2], lateral_offset=0.1)
    again = pf.Traffic.from_dataframe(traffic.to_dataframe(), {LORRY.name: LORRY})
    for name in ("entry_time", "vehicle", "speed_kmh", "lane", "direction", "lateral_offset"):
        np.testing.assert_array_equal(getattr(again, name), getattr(traffic, name))
    with pytest.raises(ValueError, match="unknown"):
        pf.Traffic.from_dataframe(traffic.to_dataframe().assign(weight=1.0), {LORRY.name: LORRY})


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    flow=st.floats(50.0, 900.0),
    headway=st.floats(0.5, 3.0),
)
def test_headways_are_kept_along_the_road(seed: int, flow: float, headway: float) -> None:
    length = 3000.0
    traffic = pf.Traffic.generate(
        duration=900.0, seed=seed, flow=flow, lanes=1, min_headway=headway, length=length
    )
    places = np.linspace(0.0, length, 31)
    passed = []
    for number in range(len(traffic)):
        times, along = traffic.course(number)
        if times.size == 1:
            passed.append(times[0] + places / (traffic.speed_kmh[number] / 3.6))
        else:
            passed.append(np.interp(places, along, times))
    gaps = np.diff(np.array(passed), axis=0)
    assert gaps.size == 0 or gaps.min() >= headway * (1.0 - 1e-9)


def test_shares_and_flow_are_those_asked_for() -> None:
    traffic = pf.Traffic.generate(
        duration=36_000.0,
        seed=3,
        flow=300.0,
        lanes=3,
        classes={"rigid_truck": 1.0, "semitrailer": 3.0},
    )
    count = len(traffic)
    # Headways vary less than those of a Poisson process: five of its standard deviations are many.
    assert abs(count - 9000) < 5.0 * 9000**0.5
    rigid = [len(traffic.vehicles[number].tires) == 2 for number in traffic.vehicle]
    assert abs(sum(rigid) - 0.25 * count) < 4.0 * (count * 0.25 * 0.75) ** 0.5
    again = pf.Traffic.generate(
        duration=36_000.0,
        seed=3,
        flow=300.0,
        lanes=3,
        classes={"rigid_truck": 1.0, "semitrailer": 3.0},
    )
    np.testing.assert_array_equal(again.entry_time, traffic.entry_time)
    assert len(traffic.vehicles) <= 22


@needs_sumo
def test_floating_car_data_are_the_same_as_xml_and_csv() -> None:
    xml = pf.read_sumo(SUMO / "fcd_default.xml", KINDS, ignore=["car"])
    table = pf.read_sumo(SUMO / "fcd.csv", KINDS, ignore=["car"])
    assert len(xml) > 5
    assert xml.counts["read"] == xml.counts["kept"] + xml.counts["ignored"]
    assert dict(xml.counts) == dict(table.counts)
    np.testing.assert_array_equal(xml.breaks_time, table.breaks_time)
    np.testing.assert_array_equal(xml.breaks_place, table.breaks_place)
    np.testing.assert_array_equal(xml.lane, table.lane)
    with pytest.raises(ValueError, match="type 'car': must be one of"):
        pf.read_sumo(SUMO / "fcd.csv", KINDS)


@needs_sumo
def test_broken_records_are_refused_or_counted(tmp_path: Path) -> None:
    lines = (SUMO / "fcd.csv").read_text(encoding="utf-8").splitlines()
    at = next(i for i, line in enumerate(lines) if "artic5" in line and i > 100)
    lines[at] = lines[at].replace(".", "x")
    broken = tmp_path / "broken.csv"
    broken.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(pf.FormatError, match=f"line {at + 1}"):
        pf.read_sumo(broken, KINDS, ignore=["car"])
    found = pf.read_sumo(broken, KINDS, ignore=["car"], on_error="skip")
    assert found.counts["broken"] == 1
    assert found.problems[0][0] == at + 1
