"""A run of traffic in a folder: written every so often, and gone on with to the same numbers.

`run.json` says which run it is. `state-0.bin` and `state-1.bin` take turns: the state of the core,
with a checksum; where the last one is damaged, the run goes on from the other. `result.nc` is what
the run came to, and histories stand beside it, in files of the rows from a number on, until the run
is finished. Each file takes its place in one step.
"""

from __future__ import annotations

import hashlib
import json
import struct
import time
import warnings
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pavefem._files import check_writable, replacing
from pavefem.errors import FormatError
from pavefem.store import DAMAGED, reading
from pavefem.traffic_result import TrafficResult, read_traffic_result

INTERVAL: Final = 30.0
"""Least time between two writings, s."""
_PART: Final = 0.05
"""Part of the time of a run that writing may take."""

_FORMAT: Final = "pavefem traffic 1"
_NAME: Final = "run.json"
_RESULT: Final = "result.nc"
_HEAD: Final = struct.Struct("<16sQQd")  # checksum of the rest, number, rows, wall time


class State(NamedTuple):
    """How far a run is."""

    number: int
    """How often it was written."""
    rows: int
    """Rows of the histories that are written."""
    wall_time: float
    """How long it took so far, s."""
    core: bytes
    """State of the core."""

    def to_file(self, path: Path) -> None:
        """Write it in one step."""
        body = _HEAD.pack(b"", self.number, self.rows, self.wall_time)[16:]
        with replacing(path) as part, part.open("wb") as file:
            file.write(_checksum(body, self.core))
            file.write(body)
            file.write(self.core)

    @classmethod
    def from_file(cls, path: Path) -> State:
        """Read it; one of `DAMAGED` if it is not as it was written."""
        data = path.read_bytes()
        try:
            checksum, number, rows, wall_time = _HEAD.unpack_from(data)
        except struct.error as error:
            raise ValueError(str(error)) from None
        core = data[_HEAD.size :]
        if checksum != _checksum(data[16 : _HEAD.size], core):
            raise ValueError("the checksum is another")
        return cls(number, rows, wall_time, core)


class TrafficStore:
    """The folder of a run of traffic, to be written.

    Parameters
    ----------
    folder : Path
        Made if need be.
    run : str
        Digest of all that the numbers depend on.

    Raises
    ------
    ValueError
        If the folder has another run, or other files.
    FormatError
        If its description is damaged.
    OSError
        If it cannot be written.
    """

    def __init__(self, folder: Path, run: str) -> None:
        self.folder = folder
        check_writable(folder)
        description = folder / _NAME
        if description.exists():
            with reading(folder):
                found = json.loads(description.read_text("utf-8"))
                form, there = found["format"], found["run"]
            if form != _FORMAT:
                raise FormatError(f"format {form!r}: must be {_FORMAT!r}", path=description)
            if there != run:
                raise ValueError(
                    f"{folder} holds the run of other inputs or of another version of pavefem: "
                    "remove it, or name another store"
                )
        # What begins with a dot is a part of a file that was being written.
        elif any(not path.name.startswith(".") for path in folder.iterdir()):
            raise ValueError(f"store {folder} has files, but no {_NAME}: give an empty folder")
        else:
            with replacing(description) as file:
                file.write_text(json.dumps({"format": _FORMAT, "run": run}), "utf-8")
        self._state = self._last_state()
        self._due = time.monotonic() + INTERVAL
        self.finished = False
        if (folder / _RESULT).exists():
            with suppress(FormatError):
                self.finished = bool(read_traffic_result(folder / _RESULT).is_finished)

    @property
    def state(self) -> State | None:
        """How far the run is; None at its beginning."""
        return self._state

    @property
    def rows(self) -> int:
        """Rows of the histories that are written."""
        return 0 if self._state is None else self._state.rows

    def is_due(self) -> bool:
        """Whether to write."""
        return time.monotonic() > self._due

    def write(
        self,
        core: bytes,
        wall_time: float,
        result: TrafficResult,
        rows: NDArray[np.float64],
    ) -> None:
        """Write how far the run is, with the rows of the histories since it was last written."""
        began = time.monotonic()
        if len(rows) > 0:
            with (
                replacing(self.folder / f"history-{self.rows:012d}.npy") as part,
                part.open("wb") as file,
            ):
                np.save(file, rows)
        number = 0 if self._state is None else self._state.number + 1
        state = State(number, self.rows + len(rows), wall_time, core)
        state.to_file(self.folder / f"state-{number % 2}.bin")
        self._state = state._replace(core=b"")
        result.with_attributes(rows=state.rows).to_netcdf(self.folder / _RESULT)
        now = time.monotonic()
        self._due = now + max(INTERVAL, (now - began) / _PART)

    def history(self) -> Iterator[NDArray[np.float64]]:
        """Rows of the histories that are written, file by file."""
        return _history(self.folder, self.rows)

    def finish(self, result: TrafficResult) -> None:
        """Write the answer, histories and all, and let the rest go."""
        result.to_netcdf(self.folder / _RESULT)
        self.finished = True
        for pattern in ("state-*.bin", "history-*.npy"):
            for path in self.folder.glob(pattern):
                path.unlink()

    def result(self) -> TrafficResult:
        """Return the answer of a run that is finished."""
        return read_traffic_result(self.folder / _RESULT)

    def _last_state(self) -> State | None:
        """Find the last state that is sound, as the histories up to it are."""
        states = []
        for path in self.folder.glob("state-*.bin"):
            with suppress(*DAMAGED):
                states.append(State.from_file(path))
        for state in sorted(states, key=lambda state: state.number, reverse=True):
            with suppress(*DAMAGED):
                for _ in _history(self.folder, state.rows):
                    pass
                return state
        return None


def is_traffic_store(path: Path) -> bool:
    """Whether there is the folder of a run of traffic."""
    return (path / _NAME).is_file()


def open_traffic(folder: Path) -> TrafficResult:
    """Open the folder of a run as far as it goes; see `pavefem.load_traffic_result`."""
    if not (folder / _RESULT).exists():
        raise FormatError("nothing of its run is done", path=folder)
    result = read_traffic_result(folder / _RESULT)
    if result.is_finished:
        return result
    with reading(folder):
        rows = result.dataset.attrs.get("rows", 0)
        result = result.with_history(_history(folder, rows))
    warnings.warn(
        f"{folder}: the run is not finished, this is {result.so_far}; the call that began it goes "
        "on there",
        stacklevel=3,
    )
    return result


def _history(folder: Path, rows: int) -> Iterator[NDArray[np.float64]]:
    """Read so many rows of the histories; one of `DAMAGED` where they are not there."""
    done = 0
    while done < rows:
        found = np.load(folder / f"history-{done:012d}.npy", allow_pickle=False)
        if not np.isfinite(found).all() or len(found) == 0:
            raise ValueError("a history is not finite")
        found = found[: rows - done]
        done += len(found)
        yield found


def _checksum(*parts: bytes) -> bytes:
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        digest.update(part)
    return digest.digest()
