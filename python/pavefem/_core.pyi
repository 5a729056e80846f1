"""The compiled core. Arrays are float64; see the modules that call it for units and errors."""

from collections.abc import Callable
from typing import Any, Final, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "DENSE_LIMIT",
    "GRAVITY",
    "IRI_BASE",
    "IRI_START",
    "TIRE_PRINT",
    "TRACK_SHARE",
    "Banded",
    "SimplySupportedBeam",
    "Stepper",
    "Strip",
    "Traffic",
    "Transition",
    "Vehicle",
    "Window",
    "WinklerBeam",
    "binder_stiffness",
    "fleet_forces",
    "forces_in_blocks",
    "iri",
    "mix_modulus",
    "two_way",
]

DENSE_LIMIT: Final[int]
GRAVITY: Final[float]
IRI_BASE: Final[float]
IRI_START: Final[float]
TIRE_PRINT: Final[float]
TRACK_SHARE: Final[float]

_Array = NDArray[np.float64]
_Progress = Callable[[int, int], object]
_Keep = tuple[list[str], bool, _Array, int]

def binder_stiffness(
    loading_time: _Array,
    temperature_c: _Array,
    softening_point_c: _Array,
    penetration_index: _Array,
) -> _Array: ...
def mix_modulus(binder_stiffness: _Array, vma: _Array) -> _Array: ...
def iri(
    elevations: _Array, spacing: float, moving_average: bool, segment: float | None = None
) -> _Array: ...

@final
class Strip:
    def __new__(
        cls, sections: _Array, element_length: float, foundation: str, ends: str
    ) -> Strip: ...
    @property
    def nodes(self) -> _Array: ...
    @property
    def mass(self) -> _Array: ...
    @property
    def damping(self) -> _Array: ...
    @property
    def stiffness(self) -> _Array: ...

@final
class Transition:
    def __new__(
        cls, mass: _Array, damping: _Array, stiffness: _Array, dt: float, form: str
    ) -> Transition: ...
    @staticmethod
    def of_strip(strip: Strip, dt: float) -> Transition: ...
    @staticmethod
    def from_rows(
        strip: Strip, dt: float, series: tuple[float, int, int], levels: _Array
    ) -> Transition: ...
    def to_rows(self) -> _Array: ...
    @property
    def phi(self) -> _Array: ...
    @property
    def gamma(self) -> _Array: ...
    @property
    def ramp(self) -> _Array: ...
    @property
    def dt(self) -> float: ...
    @property
    def norm(self) -> float: ...
    @property
    def terms(self) -> int: ...
    @property
    def squarings(self) -> int: ...

@final
class Stepper:
    def __new__(
        cls,
        strip: Strip,
        transition: Transition,
        weights: str,
        hold: str,
        keep: _Keep,
        *,
        print: float = 0.0,
    ) -> Stepper: ...
    def run(
        self, positions: _Array, forces: _Array, progress: _Progress | None = None
    ) -> tuple[_Array, _Array, _Array, NDArray[np.uint64], _Array]: ...

@final
class Banded:
    def __new__(
        cls,
        sections: _Array,
        element_length: float,
        foundation: str,
        ends: str,
        dt: float,
        weights: str,
        hold: str,
        keep: _Keep,
        *,
        print: float = 0.0,
    ) -> Banded: ...
    @property
    def nodes(self) -> _Array: ...
    def run(
        self, positions: _Array, forces: _Array, progress: _Progress | None = None
    ) -> tuple[_Array, _Array, _Array, NDArray[np.uint64], _Array]: ...

@final
class Window:
    def __new__(
        cls,
        sections: _Array,
        element_length: float,
        foundation: str,
        ends: str,
        dt: float,
        weights: str,
        hold: str,
        keep: _Keep,
        *,
        print: float = 0.0,
        extrapolate: bool = False,
    ) -> Window: ...
    @property
    def nodes(self) -> _Array: ...
    def run(
        self, positions: _Array, forces: _Array, progress: _Progress | None = None
    ) -> tuple[_Array, _Array, _Array, NDArray[np.uint64], _Array]: ...
    def warm_up(self, speed: float) -> float: ...
    def run_block(
        self,
        positions: _Array,
        forces: _Array,
        before: int,
        warm_up: int,
        progress: _Progress | None = None,
    ) -> tuple[int, tuple[_Array, _Array, _Array, NDArray[np.uint64], _Array]]: ...

@final
class Vehicle:
    def __new__(cls, bodies: _Array, springs: _Array, ends: _Array, tires: _Array) -> Vehicle: ...
    @property
    def mass(self) -> _Array: ...
    @property
    def damping(self) -> _Array: ...
    @property
    def stiffness(self) -> _Array: ...
    @property
    def static_loads(self) -> _Array: ...

def fleet_forces(
    vehicles: list[Vehicle],
    runs: _Array,
    x: _Array,
    z: _Array,
    interpolation: str,
    dt: float,
    lift_off: bool,
    tolerance: float,
    every: int | None,
    stations: _Array,
    threads: int,
    progress: _Progress | None = None,
) -> list[tuple[_Array, _Array, _Array]]: ...
def forces_in_blocks(
    vehicle: Vehicle,
    run: tuple[float, float, int, int],
    x: _Array,
    z: _Array,
    interpolation: str,
    dt: float,
    lift_off: bool,
    tolerance: float,
    instants: int,
    take: Callable[[_Array], object],
) -> None: ...
def two_way(
    vehicle: Vehicle,
    run: tuple[float, float, int, int],
    x: _Array,
    z: _Array,
    interpolation: str,
    dt: float,
    lift_off: bool,
    tolerance: float,
    road: Window,
    positions: _Array,
    progress: _Progress | None = None,
) -> tuple[_Array, _Array, int]: ...

@final
class Traffic:
    def __new__(
        cls,
        *,
        roads: list[tuple[_Array, _Array, _Array]],
        element_length: float,
        foundation: str,
        ends: str,
        weights: str,
        tire_print: float,
        hold: str,
        dt: float,
        profiles: list[tuple[_Array, _Array, str]],
        lanes: _Array,
        vehicles: list[Vehicle],
        passages: _Array,
        breaks: _Array,
        until: _Array,
        powers: list[float],
        bins: _Array,
        stations: _Array,
        begin: int,
        end: int,
        part: tuple[float, float],
        precision: str,
        threads: int,
    ) -> Traffic: ...
    @property
    def nodes(self) -> _Array: ...
    @property
    def tick(self) -> int: ...
    @property
    def finished(self) -> bool: ...
    @property
    def active(self) -> int: ...
    @property
    def vehicle_seconds(self) -> float: ...
    def advance(self, ticks: int, progress: _Progress | None = None) -> _Array: ...
    def lanes(self) -> list[dict[str, NDArray[Any]]]: ...
    def vehicles(self) -> _Array: ...
    def state(self) -> bytes: ...
    def restore(self, state: bytes) -> None: ...

@final
class WinklerBeam:
    def __new__(
        cls,
        *,
        bending_stiffness: float,
        bending_damping: float,
        mass: float,
        damping: float,
        stiffness: float,
    ) -> WinklerBeam: ...
    @property
    def decay(self) -> float: ...
    @property
    def critical_speed(self) -> float: ...
    def static_deflection(self, force: float, x: _Array) -> _Array: ...
    def static_moment(self, force: float) -> float: ...
    def moving_deflection(self, force: float, speed: float, xi: _Array, print: float) -> _Array: ...
    def moving_peak(self, force: float, speed: float, print: float) -> tuple[float, float]: ...

@final
class SimplySupportedBeam:
    def __new__(
        cls, *, length: float, bending_stiffness: float, mass: float
    ) -> SimplySupportedBeam: ...
    def static_deflection(self, force: float) -> float: ...
    def moving_deflection(
        self, force: float, speed: float, x: float, time: _Array, modes: int
    ) -> _Array: ...
