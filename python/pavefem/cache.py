"""Transition matrices kept between runs: in memory, and in files as the paper reads its own.

A file is named by a digest of everything its matrices depend on, is written beside its place and
moved there in one step (so several processes may write it at once), and carries a checksum: one
that is damaged or of another layout is computed and written anew.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import struct
import zlib
from collections import OrderedDict
from collections.abc import Callable, Hashable
from importlib.metadata import version
from pathlib import Path
from threading import Lock
from typing import Final, Generic, TypeVar

import numpy as np
import platformdirs

from pavefem import _core
from pavefem._files import replacing

FOLDER_VARIABLE: Final = "PAVEFEM_CACHE_DIR"
"""Environment variable that names the folder of the files."""

_VERSION: Final = version("pavefem")  # once: looking it up takes a millisecond
_MAGIC: Final = b"pavefem2"
_HEADER: Final = struct.Struct("<8s32sQdQLL")  # magic, key, n, norm, terms, squarings, checksum

T = TypeVar("T")


def folder() -> Path:
    """Folder of the files: ``$PAVEFEM_CACHE_DIR``, or the user's cache folder."""
    chosen = os.environ.get(FOLDER_VARIABLE)
    return Path(chosen) if chosen else platformdirs.user_cache_path("pavefem")


def digest(table: np.ndarray, *rest: object) -> bytes:
    """Key of 32 bytes of a table of numbers and whatever else matrices depend on."""
    text = repr((_VERSION, table.shape, rest)).encode()
    return hashlib.blake2b(table.tobytes() + text, digest_size=32).digest()


def transition(key: bytes, strip: _core.Strip, dt: float) -> _core.Transition:
    """Transition of a strip, from its file if there is a sound one, else computed and written."""
    path = folder() / f"{key.hex()}.bin"
    found = _read(path, key, strip, dt)
    if found is None:
        found = _core.Transition.of_strip(strip, dt)
        # A cache that cannot be written costs time, not the result.
        with contextlib.suppress(OSError):
            _write(path, key, found)
    return found


def _read(path: Path, key: bytes, strip: _core.Strip, dt: float) -> _core.Transition | None:
    try:
        if path.stat().st_size > _HEADER.size + 64 * _core.DENSE_LIMIT**2:
            return None
        data = path.read_bytes()
        magic, named, n, norm, terms, squarings, checksum = _HEADER.unpack_from(data)
        body = memoryview(data)[_HEADER.size :]
        if (magic, named) != (_MAGIC, key) or len(body) not in (32 * n * n, 64 * n * n):
            return None
        if _checksum(data[: _HEADER.size - 4], body) != checksum:
            return None
        rows = np.frombuffer(body, dtype="<f8").reshape(-1, n)
        return _core.Transition.from_rows(strip, dt, (norm, terms, squarings), rows)
    except (OSError, struct.error, ValueError, RuntimeError, OverflowError):
        return None


def _checksum(header: bytes, body: bytes | memoryview) -> int:
    return zlib.crc32(body, zlib.crc32(header))


def _write(path: Path, key: bytes, found: _core.Transition) -> None:
    rows = np.ascontiguousarray(found.to_rows(), dtype="<f8")
    body = rows.tobytes()
    fields = (_MAGIC, key, rows.shape[1], found.norm, found.terms, found.squarings)
    start = _HEADER.pack(*fields, 0)[:-4]
    header = _HEADER.pack(*fields, _checksum(start, body))
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as file:
        file.write_bytes(header + body)


class Recent(Generic[T]):
    """The values used last, as many as fit into a number of bytes."""

    def __init__(self, budget: int) -> None:
        self._budget = budget
        self._used = 0
        self._values: OrderedDict[Hashable, tuple[T, int]] = OrderedDict()
        self._lock = Lock()

    def get(self, key: Hashable, size: int, make: Callable[[], T]) -> T:
        """Value of `key`, made if it is not there; `size` is what it takes, in bytes."""
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
                return self._values[key][0]
        value = make()
        with self._lock:
            if key not in self._values and size <= self._budget:
                self._values[key] = (value, size)
                self._used += size
                while self._used > self._budget:
                    _, (_, freed) = self._values.popitem(last=False)
                    self._used -= freed
        return value

    def clear(self) -> None:
        """Forget all."""
        with self._lock:
            self._values.clear()
            self._used = 0
