"""Traffic on a road: vehicle-seconds a second, and how many times real time with 1000 at once.

``python benches/traffic.py [--trucks N] [--kilometres L]``: trucks on four lanes, evenly spaced,
over a rough profile in steps of 1 ms, by elements of 0.5 m and 0.125 m, on one thread and on two,
in double and in single precision; each with the error of the largest deflection, against double
precision in steps of half the length.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import pavefem as pf

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--trucks", type=int, default=160)
parser.add_argument("--kilometres", type=float, default=2.0)
arguments = parser.parse_args()

LANES = 4
SPEED = 80.0
VEHICLES = {"three axles": pf.vehicles.tandem_truck(), "five axles": pf.vehicles.semitrailer()}
SCHEMES = {
    "0.5 m": pf.Scheme.converged(element_length=0.5),
    "0.125 m": pf.Scheme.converged(element_length=0.125),
}


def traffic(vehicle: pf.Vehicle) -> pf.Traffic:
    """Trucks that come evenly onto four lanes, each a little faster or slower than the mean."""
    number = np.arange(arguments.trucks)
    entry = 2.2 * (number // LANES) + 0.3 * (number % LANES)
    speed = SPEED + 2.0 * np.sin(number)
    zeros = np.zeros(number.size)
    return pf.Traffic([vehicle], zeros, entry, speed, lane=1 + number % LANES)


def run(vehicle: pf.Vehicle, scheme: pf.Scheme, **options: object) -> tuple[float, float, float]:
    """Vehicle-seconds, the seconds they took, and the largest deflection in mm."""
    length = 1000.0 * arguments.kilometres
    road = pf.Road(pf.Pavement.paper(), length=length)
    profile = pf.Profile.iso8608("B", length=length + 100.0, seed=1)
    inputs = traffic(vehicle)
    start = time.perf_counter()
    result = pf.simulate_traffic(road, inputs, profile=profile, scheme=scheme, **options)
    seconds = time.perf_counter() - start
    stay = (length + vehicle.length) / (inputs.speed_kmh / 3.6)
    return float(stay.sum()), seconds, 1e3 * result.max_deflection


for kind, vehicle in VEHICLES.items():
    for mesh, scheme in SCHEMES.items():
        finer = scheme.model_copy(update={"dt": 0.5e-3})
        *_, fine = run(vehicle, finer, threads=2)
        for threads, precision in ((1, "double"), (2, "double"), (2, "single")):
            done, seconds, found = run(vehicle, scheme, threads=threads, precision=precision)
            print(
                f"{kind}, {mesh}, {threads} thread(s), {precision}: {done / seconds:.0f} "
                f"vehicle-seconds a second, {done / seconds / 1000:.1f} times real time with 1000 "
                f"at once; largest deflection {100 * (found / fine - 1):+.3f} % from 0.5 ms",
                flush=True,
            )
