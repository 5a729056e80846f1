"""A folder of finished points, from which an interrupted study goes on.

``study.json`` says which study it is, by digests of its parts. Each ``chunk-*.json`` has some of
its points: one line with a checksum, and the rest as JSON, whose numbers are exact. Files appear as
a whole. A chunk that is damaged is deleted, and its points are computed again.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import time
import warnings
from collections.abc import Mapping
from functools import partial
from importlib.metadata import version
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, Final

import numpy as np

from pavefem._files import check_writable, replacing
from pavefem._model import Model
from pavefem.errors import FormatError
from pavefem.profile import Profile
from pavefem.studies.points import Outcome, Plan

INTERVAL: Final = 2.0
"""Least time between two chunks, s: batches that come in meanwhile go into one."""

_FORMAT: Final = "pavefem study 1"
_NAME: Final = "study.json"


class Store:
    """Finished points of one study in a folder.

    Parameters
    ----------
    folder : path
        Made if need be.
    plan : Plan
        What the points have in common.
    axes : mapping of str
        Where they differ: for each field the values of the study.
    count : int
        Number of points.

    Raises
    ------
    ValueError
        If the folder has another study, or other files.
    FormatError
        If its description is damaged.
    OSError
        If it cannot be written.
    """

    def __init__(
        self, folder: str | os.PathLike[str], plan: Plan, axes: Mapping[str, Any], count: int
    ) -> None:
        self.folder, self._plan, self._count = Path(folder), plan, count
        self._waiting: dict[int, Outcome] = {}
        self._written = time.monotonic()
        identity = _identity(plan, axes)
        self._digest = fingerprint(identity)
        check_writable(self.folder)
        description = self.folder / _NAME
        if description.exists():
            self._check(description, identity)
            return
        # What begins with a dot is a part of a file that was being written.
        if any(not path.name.startswith(".") for path in self.folder.iterdir()):
            raise ValueError(f"store {self.folder} has files, but no {_NAME}: give an empty folder")
        with replacing(description) as file:
            file.write_text(json.dumps({"format": _FORMAT, "parts": identity}, indent=1), "utf-8")

    def _check(self, description: Path, identity: Mapping[str, str]) -> None:
        try:
            found = json.loads(description.read_text("utf-8"))
            form, parts = found["format"], dict(found["parts"])
        except (ValueError, LookupError, TypeError, RecursionError) as error:
            raise FormatError(
                f"damaged, it no longer says of which study the points are: {error}",
                path=description,
            ) from None
        if form != _FORMAT:
            raise FormatError(f"format {form!r}: must be {_FORMAT!r}", path=description)
        if parts != identity:
            names = [*identity, *(name for name in parts if name not in identity)]
            differ = [name for name in names if parts.get(name) != identity.get(name)]
            raise ValueError(
                f"store {self.folder} has another study, of other {', '.join(differ)}: give "
                "another folder"
            )

    def read(self) -> dict[int, Outcome]:
        """Return the points that are there by number, and delete chunks that are damaged."""
        found: dict[int, Outcome] = {}
        damaged = 0
        for path in sorted(self.folder.glob("chunk-*.json")):
            try:
                found |= self._read(path)
            except (ValueError, LookupError, TypeError, RecursionError):
                path.unlink()
                damaged += 1
        if damaged:
            warnings.warn(
                f"store {self.folder}: {damaged} damaged chunks deleted; their points are computed "
                "again",
                stacklevel=4,
            )
        return found

    def _read(self, path: Path) -> dict[int, Outcome]:
        checksum, _, body = path.read_bytes().partition(b"\n")
        if checksum.decode() != _checksum(body):
            raise ValueError("the checksum is another")
        data = json.loads(body)
        found = {number: Outcome(*outcome) for number, *outcome in data["points"]}
        sound = all(
            0 <= number < self._count
            and len(outcome.values) == (0 if outcome.error else len(self._plan.outputs))
            and all(isinstance(value, float) and math.isfinite(value) for value in outcome.values)
            and isinstance(outcome.error, str)
            and isinstance(outcome.warning, str)
            for number, outcome in found.items()
        )
        if data["study"] != self._digest or not sound:
            raise ValueError("it is of another study")
        return found

    def add(self, outcomes: Mapping[int, Outcome]) -> None:
        """Take finished points, and write them if the last ones were written a while ago."""
        self._waiting |= outcomes
        if time.monotonic() - self._written > INTERVAL:
            self.flush()

    def flush(self) -> None:
        """Write what is not yet written."""
        if not self._waiting:
            return
        points = [(number, *outcome) for number, outcome in sorted(self._waiting.items())]
        body = json.dumps({"study": self._digest, "points": points}, allow_nan=False).encode()
        checksum = _checksum(body)
        name = f"chunk-{points[0][0]:09d}-{checksum[:8]}.json"
        with replacing(self.folder / name) as file:
            file.write_bytes(checksum.encode() + b"\n" + body)
        self._waiting.clear()
        self._written = time.monotonic()


def _checksum(body: bytes) -> str:
    return hashlib.blake2b(body, digest_size=16).hexdigest()


def _identity(plan: Plan, axes: Mapping[str, Any]) -> dict[str, str]:
    """Digests of all that the answers of a study depend on, by what it is."""
    free = any(output.keep is None for output in plan.outputs)
    parts = {
        "pavefem": version("pavefem"),
        "base": (plan.base, plan.base.profile),
        "vehicle": plan.call and (plan.call.function, dict(plan.call.arguments)),
        "outputs": [(output.name, output.function) for output in plan.outputs],
        "histories": (plan.keep, plan.stations) if free else None,
        "fields": [item.path for item in plan.fields],
    }
    return {name: fingerprint(part) for name, part in (parts | dict(axes)).items()}


def fingerprint(value: Any) -> str:
    """Digest of a value that is the same in another process.

    A function is known by its name, its code and the values that it brings along; one of pavefem
    by its name.
    """
    return hashlib.blake2b(repr(_plain(value)).encode(), digest_size=16).hexdigest()


def _plain(value: Any) -> Any:
    """Take a value apart into what it consists of, in types whose text says all."""
    match value:
        case Model():
            return type(value).__name__, value.model_dump_json()
        case Profile():
            tracks = {name: z.tobytes() for name, z in value.tracks.items()}
            return value.name, value.x.tobytes(), value.z.tobytes(), tracks
        case np.ndarray():
            return value.dtype.str, value.shape, value.tobytes()
        case dict():
            return {name: _plain(item) for name, item in value.items()}
        case list() | tuple():
            return [_plain(item) for item in value]
        case partial():
            return _plain([value.func, value.args, value.keywords])
        case FunctionType():
            name = value.__module__, value.__qualname__
            if value.__module__.startswith("pavefem."):
                return name
            inner = [cell.cell_contents for cell in value.__closure__ or ()]
            # Of a function that it calls the code is enough; it may be itself.
            inner = [getattr(item, "__code__", item) for item in inner]
            return name, _plain([value.__code__, value.__defaults__, value.__kwdefaults__, inner])
        case CodeType():
            return value.co_code, value.co_names, _plain(value.co_consts)
        case _:
            return value
