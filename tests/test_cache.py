"""The files of transition matrices: written once, believed when sound, rebuilt when not.

A file that is sound but holds other numbers changes the answer: that shows that it is read, without
a clock.
"""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import forget_steppers

import pavefem as pf
from pavefem import _core, cache
from pavefem.cache import Recent

ROAD = pf.Road(length=5.0)
TRUCK = pf.vehicles.tandem_truck()


def peak(**options: bool) -> float:
    """Run a short road, as a fresh process would find the cache."""
    forget_steppers()
    return pf.simulate(ROAD, TRUCK, keep="envelope", **options).max_deflection  # type: ignore[arg-type]


def the_file(folder: Path) -> Path:
    (path,) = folder.iterdir()
    return path


def scale_numbers(path: Path, factor: float) -> None:
    """Multiply the matrices of a file, and mend its checksum."""
    data = path.read_bytes()
    size = cache._HEADER.size
    header = list(cache._HEADER.unpack(data[:size]))
    body = (factor * np.frombuffer(data[size:], dtype="<f8")).tobytes()
    header[-1] = cache._checksum(data[: size - 4], body)
    path.write_bytes(cache._HEADER.pack(*header) + body)


def test_one_file_is_written_and_read_again(cache_folder: Path) -> None:
    assert not cache_folder.exists()
    first = peak()
    path = the_file(cache_folder)
    before = path.stat()
    assert peak() == first
    assert the_file(cache_folder) == path
    after = path.stat()
    assert (after.st_ino, after.st_mtime_ns) == (before.st_ino, before.st_mtime_ns)


def test_sound_file_is_believed(cache_folder: Path) -> None:
    """Half of all responses: if the file is used, the answer is another."""
    first = peak()
    scale_numbers(the_file(cache_folder), 0.5)
    assert peak() < 0.9 * first
    assert peak(cache=False) == first


def test_memory_comes_before_the_file(cache_folder: Path) -> None:
    first = peak()
    scale_numbers(the_file(cache_folder), 0.5)
    # Not forgotten in between: the prepared road is still there.
    forget_steppers()
    tampered = pf.simulate(ROAD, TRUCK, keep="envelope").max_deflection
    the_file(cache_folder).unlink()
    assert pf.simulate(ROAD, TRUCK, keep="envelope").max_deflection == tampered != first


def _flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def _other_key(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[12] ^= 1
    path.write_bytes(data)


def _huge(path: Path) -> None:
    """A header that calls for more than there is."""
    data = bytearray(path.read_bytes())
    data[40:48] = (2**61).to_bytes(8, "little")
    path.write_bytes(data)


def _other_layout(path: Path) -> None:
    data = path.read_bytes()
    path.write_bytes(b"pavefem0" + data[8:])


def _nan(path: Path) -> None:
    scale_numbers(path, float("nan"))


def _folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


@pytest.mark.parametrize(
    "damage",
    [
        lambda path: path.write_bytes(b""),
        lambda path: path.write_bytes(path.read_bytes()[:20]),
        lambda path: path.write_bytes(path.read_bytes()[:-8]),
        lambda path: path.write_bytes(path.read_bytes() + b"more"),
        lambda path: path.write_text("something else entirely\n" * 1000),
        _flip,
        _other_key,
        _other_layout,
        _huge,
        _nan,
    ],
    ids=[
        "empty", "cut in the header", "cut", "longer", "foreign", "bit flipped", "other key",
        "other layout", "huge", "not finite",
    ],
)  # fmt: skip
def test_damaged_file_is_rebuilt(damage: Callable[[Path], object], cache_folder: Path) -> None:
    first = peak()
    path = the_file(cache_folder)
    sound = path.read_bytes()
    damage(path)
    assert peak() == first
    assert the_file(cache_folder) == path
    assert path.read_bytes() == sound


def test_folder_in_the_place_of_the_file(cache_folder: Path) -> None:
    first = peak()
    _folder(the_file(cache_folder))
    assert peak() == first


def test_file_of_another_road_is_not_believed(cache_folder: Path) -> None:
    first = peak()
    mine = the_file(cache_folder)
    sound = mine.read_bytes()
    mine.unlink()
    pf.simulate(pf.Road(length=5.0, ends="pinned"), TRUCK, keep="envelope")
    other = the_file(cache_folder)
    assert other.name != mine.name
    os.replace(other, mine)
    assert peak() == first
    assert mine.read_bytes() == sound


def test_folder_that_cannot_be_made(
    cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Below a regular file no folder can be, not even by an administrator."""
    first = peak(cache=False)
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("PAVEFEM_CACHE_DIR", str(tmp_path / "file" / "cache"))
    assert peak() == first
    assert (tmp_path / "file").read_text() == "in the way"


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="an administrator may write anywhere"
)
def test_read_only_folder(cache_folder: Path) -> None:
    first = peak(cache=False)
    cache_folder.mkdir(parents=True)
    cache_folder.chmod(0o500)
    try:
        assert peak() == first
        assert not list(cache_folder.iterdir())
    finally:
        cache_folder.chmod(0o700)


def test_failed_write_leaves_nothing_behind(
    cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = peak(cache=False)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    assert peak() == first
    assert not list(cache_folder.iterdir())


def test_off_by_option_reads_and_writes_nothing(cache_folder: Path) -> None:
    first = peak(cache=False)
    assert not cache_folder.exists()
    peak()
    scale_numbers(the_file(cache_folder), 0.5)
    assert peak(cache=False) == first
    # Nor does a run without the cache put anything into memory.
    assert peak() < 0.9 * first


def test_roads_have_files_of_their_own(cache_folder: Path) -> None:
    for scheme in (
        pf.Scheme.paper(),
        pf.Scheme.paper(dt=2e-3),
        pf.Scheme.paper(foundation="winkler"),
    ):
        pf.simulate(ROAD, TRUCK, scheme=scheme, keep="envelope")
    assert len(list(cache_folder.iterdir())) == 3
    # Weights and hold are no matter of the transition.
    pf.simulate(
        ROAD, TRUCK, scheme=pf.Scheme.paper(hold="first", weights="hermite"), keep="envelope"
    )
    assert len(list(cache_folder.iterdir())) == 3


def test_folder_follows_the_variable(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PAVEFEM_CACHE_DIR", str(tmp_path / "here"))
    assert cache.folder() == tmp_path / "here"
    monkeypatch.delenv("PAVEFEM_CACHE_DIR")
    assert cache.folder().name == "pavefem"
    monkeypatch.setenv("PAVEFEM_CACHE_DIR", "")
    assert cache.folder().name == "pavefem"


SCRIPT = """
import sys, pavefem as pf
road, truck = pf.Road(length=5.0), pf.vehicles.tandem_truck()
print("ready", flush=True)
sys.stdin.readline()
print(repr(pf.simulate(road, truck, keep="envelope").max_deflection))
"""


def test_processes_at_once(cache_folder: Path) -> None:
    """Two processes start on the same empty folder at the same moment."""
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", SCRIPT], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        for _ in range(2)
    ]
    try:
        for process in processes:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
        for process in processes:
            assert process.stdin is not None
            process.stdin.write("go\n")
            process.stdin.flush()
        answers = [float(process.communicate(timeout=60)[0]) for process in processes]
    finally:
        for process in processes:
            process.kill()
            process.wait()
    assert [process.returncode for process in processes] == [0, 0]
    assert the_file(cache_folder).suffix == ".bin"
    assert answers == [peak(), peak(cache=False)]


# --- in memory --------------------------------------------------------------------------------


def test_recent_keeps_the_last_within_its_budget() -> None:
    made: list[str] = []
    recent: Recent[str] = Recent(budget=10)

    def get(key: str, size: int = 4) -> str:
        def make() -> str:
            made.append(key)
            return key

        return recent.get(key, size, make)

    get("a"), get("b"), get("a"), get("c")  # c does not fit beside both: b goes, a was used later
    assert made == ["a", "b", "c"]
    get("a"), get("c")
    assert made == ["a", "b", "c"]
    get("b")
    assert made == ["a", "b", "c", "b"]
    get("too large", 11), get("too large", 11)
    assert made[4:] == ["too large", "too large"]
    get("b")
    assert len(made) == 6
    recent.clear()
    get("b")
    assert len(made) == 7


def test_digest_tells_tables_apart() -> None:
    table = np.arange(6.0)
    keys = {
        cache.digest(table.reshape(2, 3), "bars", 1e-3),
        cache.digest(table.reshape(3, 2), "bars", 1e-3),
        cache.digest(table.reshape(2, 3), "winkler", 1e-3),
        cache.digest(table.reshape(2, 3), "bars", 2e-3),
        cache.digest(table.reshape(2, 3) + 1e-12, "bars", 1e-3),
    }
    assert len(keys) == 5
    assert all(len(key) == 32 for key in keys)


def test_rows_of_a_transition_come_back(cache_folder: Path) -> None:
    strip = ROAD.strip(20.0, 65.0)
    found = _core.Transition.of_strip(strip, 1e-3)
    series = (found.norm, found.terms, found.squarings)
    again = _core.Transition.from_rows(strip, 1e-3, series, found.to_rows())
    for name in ("phi", "gamma", "ramp", "dt", "norm", "terms", "squarings"):
        np.testing.assert_array_equal(getattr(again, name), getattr(found, name))


@pytest.mark.parametrize(
    "shape", [(0, 0), (4, 1), (3, 18), (73, 18), (108, 18), (72, 17), (18, 72)]
)
def test_rows_of_a_wrong_shape_are_refused(shape: tuple[int, int]) -> None:
    strip = ROAD.strip(20.0, 65.0)  # 9 free nodes
    with pytest.raises(ValueError, match="shape"):
        _core.Transition.from_rows(strip, 1e-3, (1.0, 1, 1), np.zeros(shape))


def test_store_is_bounded() -> None:
    assert importlib.import_module("pavefem.simulate")._STEPPERS._budget <= 2**30
