"""Tire forces of 1000 five-axle trucks over 10 km of road, and of some of them by scipy's lsim.

Semitrailers on air springs (8 unknowns) of 1000 payloads at 1000 speeds from 60 to 90 km/h cross
10 km of ISO 8608 class B, sampled every 0.25 m, in steps of 1 ms, in one call of
`pavefem.fleet_forces`, which keeps the statistics of every axle: on one thread, then on two. The
error is that of the standard deviations of the forces of some of the trucks, against steps of
1/16 ms.

The ratio to `scipy.signal.lsim` is per truck and second, both on one thread: lsim is timed alone,
its matrices and the elevations under the tires at hand; pavefem is timed from vehicles to
statistics. They run in turn, so that whatever else the machine does falls on both. lsim takes its
input as linear between the steps: at 90 km/h and with axles whole steps apart all samples of the
road fall on steps, and both must agree to rounding. (At the very sample the slope under a tire is
either of two; those instants are left out.)

One step of a truck is the product of a matrix of 2 x 8 + 5 = 21 rows, padded to 24, and as many
columns with a vector: 504 fused multiply-adds. Beside them stands what numpy's matrix product does
in a second on the same thread, which is near the peak of the machine.

    python benches/fleet.py [--trucks 1000] [--rounds 3] [--json fleet.json]

Needs a Unix, for the memory.
"""

from __future__ import annotations

import os

# The thread pools read these when they are loaded, hence before numpy.
os.environ.update({f"{pool}_NUM_THREADS": "1" for pool in ("OMP", "OPENBLAS", "MKL", "BLIS")})

import argparse
import json
import platform
import resource
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.signal import lsim

import pavefem as pf

Array = NDArray[np.float64]

LENGTH = 10_000.0
SPACING = 0.25
DT = 1e-3
FINE = 16
"""Steps of the reference in one of the run's."""
AGREEMENT = 1e-7
"""Largest difference to lsim that passes, as a part of the static load."""
FULL_SPEED_KMH = 90.0
ROWS = 8
"""Rows to which the core pads the matrix of a step."""
SLICE = 64
"""Trucks that take turns with lsim."""
CHECKED = 8
"""Trucks that are run with the reference's steps."""


class Fleet(NamedTuple):
    trucks: list[pf.Vehicle]
    speeds_kmh: Array
    road: pf.Profile

    def run(self, numbers: slice, threads: int, dt: float = DT) -> xr.Dataset:
        speeds = self.speeds_kmh[numbers]
        return pf.fleet_forces(self.trucks[numbers], self.road, speeds, dt=dt, threads=threads)

    def seconds(self, numbers: slice) -> float:
        """Time that the trucks are on the road, s."""
        return float(np.sum(self.road.length / (self.speeds_kmh[numbers] / 3.6)))


def fleet(trucks: int) -> Fleet:
    part = np.arange(trucks) / trucks
    road = pf.Profile.iso8608("B", LENGTH, spacing=SPACING, seed=1)
    return Fleet(
        [pf.vehicles.semitrailer(suspension="air", payload=22_400.0 * p) for p in part],
        60.0 + 30.0 * (np.arange(trucks) * 7 % trucks) / trucks,
        road,
    )


# ------------------------------------------------------------------------------------------ lsim


class StateSpace(NamedTuple):
    """x' = A x + B z, F = C x + D z + c z', for the elevations z under the tires."""

    a: Array
    b: Array
    c: Array
    d: Array
    damping: Array


def state_space(truck: pf.Vehicle) -> StateSpace:
    """Matrices of the truck, with the dampers' part of the input shifted into the state.

    With v = v' + M^-1 S c z, where S puts the tires on the unknowns, the state (u, v') is driven by
    the elevation alone, which is continuous.
    """
    n, axles = len(truck.unknowns), len(truck.tires)
    select = np.zeros((n, axles))
    for axle, tire in enumerate(truck.tires):
        select[truck.unknowns.index(f"{tire.body} bounce"), axle] = 1.0
    stiffness = np.diag([tire.stiffness for tire in truck.tires])
    damping = np.diag([tire.damping for tire in truck.tires])
    inverse = np.linalg.inv(truck.mass_matrix)
    shift = inverse @ select @ damping
    a = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-inverse @ truck.stiffness_matrix, -inverse @ truck.damping_matrix],
        ]
    )
    b = np.vstack([shift, inverse @ select @ stiffness - inverse @ truck.damping_matrix @ shift])
    c = -np.hstack([stiffness @ select.T, damping @ select.T])
    d = stiffness - damping @ select.T @ shift
    return StateSpace(a, b, c, d, np.diag(damping))


def road_under(road: pf.Profile, position: Array, speed: float) -> tuple[Array, Array]:
    """Elevation under the tires, and its rate; level off the road."""
    x, z = road.x, road.z
    slope = np.append(np.diff(z) / np.diff(x), 0.0)
    sample = np.searchsorted(x, position + 1e-9, side="right") - 1
    rate = np.where(sample >= 0, slope[np.maximum(sample, 0)], 0.0) * speed
    return np.interp(position, x, z), rate


def lsim_run(fleet: Fleet, truck: pf.Vehicle) -> tuple[float, float]:
    """Time lsim at full speed, in s, and find how far the forces of pavefem are from its."""
    forces = pf.tire_forces(truck, fleet.road, FULL_SPEED_KMH, dt=DT)
    system = state_space(truck)
    elevation, rate = road_under(fleet.road, forces.position, FULL_SPEED_KMH / 3.6)
    # It starts at rest on the level of the first sample.
    elevation -= fleet.road.z[0]
    start = time.perf_counter()
    _, answer, _ = lsim(system[:4], elevation, forces.time)
    taken = time.perf_counter() - start

    expected = truck.static_loads + answer + system.damping * rate
    steps = forces.position / SPACING
    on_line = np.abs(steps - np.round(steps)) > 1e-6
    if not 0.5 < on_line.mean() < 1.0:
        raise AssertionError("samples of the road do not fall on steps of the trucks")
    difference = (np.abs(forces.force - expected) / truck.static_loads)[on_line].max()
    if not difference < AGREEMENT:
        raise AssertionError(f"{truck.name}: {difference:.1e} of the static load from lsim")
    return taken, float(difference)


# --------------------------------------------------------------------------- measuring, printing


def timed(run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def multiply_adds_a_second() -> float:
    """Rate of numpy's product of two matrices, best of several."""
    size = 1024
    matrix = np.random.default_rng(0).normal(size=(size, size))
    return size**3 / min(timed(lambda: matrix @ matrix) for _ in range(5))


def multiply_adds_a_step(truck: pf.Vehicle) -> int:
    """Those of the padded matrix of a step."""
    size = 2 * len(truck.unknowns) + len(truck.tires)
    return size * (-(-size // ROWS) * ROWS)


def peak_megabytes() -> float:
    """Most memory that the process has held so far."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (2**20 if sys.platform == "darwin" else 2**10)


def in_turn(fleet: Fleet, rounds: int) -> dict[str, float]:
    """Time lsim and pavefem by turns, per truck and second."""
    count = len(fleet.trucks)
    some = slice(0, SLICE)
    seconds = fleet.road.length / (FULL_SPEED_KMH / 3.6)
    ours, theirs, differences = [], [], []
    for number in range(rounds):
        taken, difference = lsim_run(fleet, fleet.trucks[count * number // rounds])
        theirs.append(taken / seconds)
        differences.append(difference)
        ours.append(timed(lambda: fleet.run(some, 1)) / fleet.seconds(some))
    return {
        "lsim_us_a_step": 1e6 * DT * min(theirs),
        "pavefem_us_a_step": 1e6 * DT * min(ours),
        "ratio_to_lsim": min(theirs) / min(ours),
        "difference_to_lsim": max(differences),
    }


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Tire forces of a fleet of five-axle trucks.")
    parser.add_argument("--trucks", type=int, default=1000, help="number of trucks")
    parser.add_argument("--rounds", type=int, default=3, help="timed runs of lsim, a truck each")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there too")
    options = parser.parse_args(argv)
    if options.rounds < 1 or options.trucks < options.rounds:
        parser.error("--rounds must be 1 or more, and --trucks as many or more")

    versions = {"python": platform.python_version()} | {
        name: version(name) for name in ("numpy", "scipy", "pavefem")
    }
    cars = fleet(options.trucks)
    everyone = slice(None)
    seconds = cars.seconds(everyone)
    print(
        f"{options.trucks} trucks, {len(cars.trucks[0].tires)} axles, "
        f"{len(cars.trucks[0].unknowns)} unknowns, {LENGTH / 1e3:g} km, {1e3 * DT:g} ms: "
        f"{seconds:.0f} truck-seconds; " + ", ".join(f"{k} {v}" for k, v in versions.items())
    )
    figures: dict[str, float] = {"truck_seconds": seconds, "megabytes_before": peak_megabytes()}
    peak, taken = multiply_adds_a_second(), {}
    for threads in (1, 2):
        start = time.perf_counter()
        found = cars.run(everyone, threads)
        taken[threads] = time.perf_counter() - start
    figures["megabytes_after"] = peak_megabytes()
    peak = max(peak, multiply_adds_a_second())
    work = multiply_adds_a_step(cars.trucks[0])
    print(f"\n{'threads':<9}{'s':>8}{'times real time':>17}{'ns a step':>11}{'of peak':>9}")
    for threads, time_taken in taken.items():
        rate = seconds / time_taken
        share = rate / DT * work / (threads * peak)
        print(f"{threads:<9}{time_taken:>8.2f}{rate:>17.0f}{1e9 * DT / rate:>11.1f}{share:>9.0%}")
        figures |= {f"seconds_{threads}": time_taken, f"times_real_time_{threads}": rate}
        figures[f"share_of_peak_{threads}"] = share
    print(
        f"peak: {peak / 1e9:.1f}e9 multiply-adds a second and thread, {work} a step; memory: "
        f"{figures['megabytes_before']:.0f} MB before, {figures['megabytes_after']:.0f} MB after"
    )

    some = slice(0, options.trucks, -(-options.trucks // CHECKED))
    exact = cars.run(some, 2, DT / FINE)["std_force"].to_numpy()
    error = np.abs(found["std_force"].to_numpy()[some] / exact - 1.0).max()
    figures["error_of_std"] = float(error)
    print(
        f"standard deviation of the force, {len(exact)} trucks: within {error:.2e} of steps of "
        f"1/{FINE} ms"
    )

    figures |= in_turn(cars, options.rounds)
    print(
        f"lsim, one thread, best of {options.rounds}: {figures['lsim_us_a_step']:.2f} us a step, "
        f"pavefem {figures['pavefem_us_a_step']:.4f} us: {figures['ratio_to_lsim']:.0f} times "
        f"faster; forces differ by {figures['difference_to_lsim']:.0e} of the static load"
    )
    if options.json is not None:
        document = {"versions": versions, "trucks": options.trucks, **figures}
        options.json.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
