"""A Sobol study of the paper's case, and some of its runs in numpy and scipy.

Six parameters: temperature, VMA, speed, axle spacing, payload and roughness (the IRI to which the
elevations of a class B profile are scaled, with 50 m of it to settle on). The output is the largest
deflection at mid-length, on the paper's mesh. 2048 samples make 16 384 runs with Saltelli's design,
of which each row of eight needs five pairs of Phi and Gamma: the other three runs differ from one
of these in the vehicle or the profile only. The study is timed as a user calls it, on two threads,
from ranges to indices: by the paper's dense matrices, and by the moving window, which needs no
matrices and answers the same but for its step in time.

The ratio to numpy is of whole rows of eight runs, spread over the study, all on one thread and by
turns, so that whatever else the machine does falls on all. It is a sample: all runs in numpy would
take the better part of an hour. Numpy shares Phi and Gamma within a row, too. It does what
`peers.py` does for the pavement (scipy's expm, one matrix-vector product a step) and the same for
the truck, whose matrices it takes from pavefem. The deflections must agree.

    python benches/sobol.py [--samples 2048] [--rows 6] [--solver dense] [--json sobol.json]

Needs SALib.
"""

from __future__ import annotations

# First of all, as these limit the threads of what numpy loads.
import fleet
import peers

# isort: split
import argparse
import json
import math
import platform
import sys
import time
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy.linalg
import xarray as xr
from numpy.typing import NDArray

import pavefem as pf

Array = NDArray[np.float64]

RANGES = {
    "temperature_c": (0.0, 40.0),
    "vma": (12.0, 30.0),
    "speed_kmh": (25.0, 105.0),
    "axle_spacing": (0.9, 2.2),
    "payload": (0.0, 12_400.0),
    "iri": (1.0, 5.0),
}
OUTPUT = "mid_deflection"
RUN_IN = 50.0
PROFILE = pf.Profile.iso8608("B", length=RUN_IN + 25.0, seed=1)
SOLVERS = ("dense", "window")
ROW = len(RANGES) + 2
"""Runs of one sample of Saltelli's design."""
AGREEMENT = {"dense": 1e-8, "window": 1e-2}
"""Largest difference to numpy that passes, as a part of the deflection."""


def base(solver: str) -> pf.Scenario:
    return pf.Scenario(
        vehicle=pf.vehicles.tandem_truck(),
        profile=PROFILE,
        run_in=RUN_IN,
        scheme=pf.Scheme.paper(solver=solver),
    )


# ----------------------------------------------------------------------------- a run in numpy


class Point(NamedTuple):
    temperature_c: float
    vma: float
    speed_kmh: float
    axle_spacing: float
    payload: float
    iri: float


def case_of(point: Point, truck: pf.Vehicle) -> peers.Case:
    """The paper's case with a point's asphalt, speed and axles."""
    of_asphalt = {
        "temperature_c": point.temperature_c,
        "vma": point.vma,
        "speed_kmh": point.speed_kmh,
    }
    stiffer = peers.Case(**of_asphalt).modulus / peers.CASE.modulus
    step = point.speed_kmh / 3.6 * peers.CASE.dt
    return peers.Case(
        **of_asphalt,
        asphalt_stiffness=stiffer * peers.CASE.asphalt_stiffness,
        axle_offsets=tuple(truck.axle_positions),
        steps=math.floor((peers.CASE.length + truck.length) / step + 1e-9),
    )


def track_forces(case: peers.Case, truck: pf.Vehicle, iri: float) -> Array:
    """Forces (step, axle) on the wheel track, after a run-in.

    The state of the truck under elevations that are linear between the steps, as `lsim` has it, but
    all products with the elevations before the loop, for which lsim takes three times as long.
    """
    speed, axles = case.speed, np.array(case.axle_offsets)
    skip = math.ceil(RUN_IN / (speed * case.dt) - 1e-9)
    time_of = case.dt * np.arange(skip + case.steps + 1, dtype=np.float64)
    position = RUN_IN + speed * (time_of - skip * case.dt)[:, np.newaxis] - axles
    elevation, rate = fleet.road_under(PROFILE, position, speed)
    scale = iri / PROFILE.iri()
    elevation = scale * (elevation - PROFILE.z[0])
    system = fleet.state_space(truck)
    n = len(system.a)
    augmented = np.zeros((n + 2 * axles.size, n + 2 * axles.size))
    augmented[:n, :n], augmented[:n, n : -axles.size] = system.a * case.dt, system.b * case.dt
    augmented[n : -axles.size, -axles.size :] = np.eye(axles.size)
    exponential = scipy.linalg.expm(augmented)
    total, ramp = exponential[:n, n : -axles.size], exponential[:n, -axles.size :]
    states = np.zeros((len(time_of), n))
    states[1:] = elevation[:-1] @ (total - ramp).T + elevation[1:] @ ramp.T
    y, dot = states[0], np.asfortranarray(exponential[:n, :n]).dot
    for state in states[1:]:
        state += dot(y)
        y = state
    answer = states @ system.c.T + elevation @ system.d.T
    forces = truck.static_loads + answer + system.damping * scale * rate
    return 0.5 * forces[skip : skip + case.steps]


def numpy_row(points: Array) -> Array:
    """Largest deflection at mid-length of one row of the design."""
    ready: dict[tuple[float, ...], tuple[Array, Array]] = {}
    found = []
    for values in points.tolist():
        point = Point(*values)
        truck = pf.vehicles.tandem_truck(axle_spacing=point.axle_spacing, payload=point.payload)
        case = case_of(point, truck)
        if point[:3] not in ready:
            ready[point[:3]] = peers.numpy_matrices(case)
        forces = track_forces(case, truck, point.iri)
        lowest = peers.numpy_loop(case, *ready[point[:3]], forces)
        found.append(-lowest[case.nodes // 2])
    return np.array(found)


# --------------------------------------------------------------------------- measuring, printing


def pavefem_row(solver: str, points: Array) -> Array:
    """Do one row of the design: nothing that others made is of use, each has its temperatures."""
    answers = pf.studies.evaluate(base(solver), [*RANGES], points, OUTPUT, workers=1)
    return answers.values[:, 0]


def by_turns(points: Array, rows: int, solvers: list[str]) -> dict[str, dict[str, float]]:
    """Time whole rows in numpy and in pavefem by turns."""
    chosen = np.linspace(0, len(points) // ROW - 1, rows).astype(int)
    taken = dict.fromkeys(("numpy", *solvers), 0.0)
    difference = dict.fromkeys(solvers, 0.0)
    numpy_row(points[:ROW])  # to warm up
    for row in chosen:
        of_row = points[ROW * row : ROW * (row + 1)]
        start = time.perf_counter()
        expected = numpy_row(of_row)
        taken["numpy"] += time.perf_counter() - start
        for solver in solvers:
            start = time.perf_counter()
            found = pavefem_row(solver, of_row)
            taken[solver] += time.perf_counter() - start
            worst = float(np.abs(found / expected - 1.0).max())
            difference[solver] = max(difference[solver], worst)
            if not worst < AGREEMENT[solver]:
                raise AssertionError(f"{solver}: differs from numpy by {worst:.1e}")
    count = rows * ROW
    print(f"\n{count} of the runs, one thread: numpy {1e3 * taken['numpy'] / count:.1f} ms a run")
    figures = {}
    for solver in solvers:
        figures[solver] = {
            "numpy_ms": 1e3 * taken["numpy"] / count,
            "pavefem_ms": 1e3 * taken[solver] / count,
            "ratio_to_numpy": taken["numpy"] / taken[solver],
            "difference_to_numpy": difference[solver],
        }
        print(
            f"{solver}: {figures[solver]['pavefem_ms']:.1f} ms, "
            f"{figures[solver]['ratio_to_numpy']:.1f} times faster; deflections differ by "
            f"{difference[solver]:.0e}"
        )
    return figures


def timed_study(solver: str, samples: int) -> tuple[xr.Dataset, dict[str, float]]:
    start, cpu = time.perf_counter(), time.process_time()
    study = pf.studies.sobol(
        base(solver), RANGES, OUTPUT, samples=samples, workers=2, progress=True
    )
    seconds, cpu = time.perf_counter() - start, time.process_time() - cpu
    runs = study.sizes["run"]
    print(
        f"{solver}: {runs} runs on two threads in {seconds:.1f} s, {1e4 * seconds / runs:.1f} s "
        f"for 10 000; {cpu:.1f} s of processor time"
    )
    return study, {"runs": runs, "seconds": seconds, "processor_seconds": cpu}


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="A Sobol study of the paper's case.")
    parser.add_argument("--samples", type=int, default=2048, help="samples, a power of 2")
    parser.add_argument("--rows", type=int, default=6, help="rows of eight runs done in numpy")
    parser.add_argument("--solver", choices=SOLVERS, help="only this one")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there too")
    options = parser.parse_args(argv)
    if not 1 <= options.rows <= options.samples:
        parser.error("--rows must be 1 or more, and no more than --samples")
    # At 40 degC the binder is softer than the formulas are for, as in the paper's Fig. 11.
    warnings.simplefilter("ignore", pf.ValidityWarning)

    versions = {"python": platform.python_version()} | {
        name: version(name) for name in ("numpy", "scipy", "SALib", "pavefem")
    }
    print(", ".join(f"{name} {number}" for name, number in versions.items()))
    solvers = [options.solver] if options.solver else [*SOLVERS]
    studies = {solver: timed_study(solver, options.samples) for solver in solvers}
    study, _ = studies[solvers[-1]]
    print(f"\n{'parameter':<16}{'first order':>20}{'total':>20}")
    for name in RANGES:
        of = study.sel(parameter=name, output=OUTPUT)
        shown = [
            f"{float(of[index]):.3f} +- {float(of[f'{index}_confidence']):.3f}"
            for index in ("first_order", "total")
        ]
        print(f"{name:<16}{shown[0]:>20}{shown[1]:>20}")

    turns = by_turns(study["points"].to_numpy(), options.rows, solvers)
    if options.json is not None:
        figures = {solver: studies[solver][1] | turns[solver] for solver in solvers}
        document = {"versions": versions, **figures}
        options.json.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
