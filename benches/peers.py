"""The paper's case in numpy/scipy, numba, OpenSeesPy and pavefem: same outputs, time and error.

A nominal three-axle truck (constant axle forces) crosses 25 m of pavement at 65 km/h: 50 beam
elements on 49 bars, both ends clamped, 98 degrees of freedom, 196 states, 1708 steps of 1 ms.
Every code returns the lowest deflection of each of the 49 free nodes over the run.

Source of the equations: Romero Navarrete, Lozano Guzman, Arroyo Contreras, "A Finite Element Model
to assess flexible pavement vehicle interaction": eqs. 1-6 (beam elements and bars), 7-8 (asphalt
stiffness), 9-12 (transition matrices), Fig. 6 (linear nodal weights), Tables I and II.

"cold" is everything from the constants: assembly, Phi and Gamma (OpenSeesPy: the model), the run.
"warm" is a run with Phi and Gamma (OpenSeesPy: the model and its factorized matrix) at hand.
numba's compile time is in neither. One process, one thread, codes in turn within each round, so
that whatever else the machine does falls on all of them alike. Phi is 307 kB and read in every
step, and a warm time moves by up to a third from one process to the next (where its pages fall,
presumably): run this more than once before reading anything into a smaller difference.

The error is the largest difference over the 49 nodes from a time-converged solution of the same
spatial model under a continuously moving load, over the largest deflection. The codes that hold
the load for a step (zero-order hold, the paper's scheme) share its error. A held load is late by
half a step, which shifts a history but not its lowest value: this error is second order in dt.

pavefem stands in the table twice: by its API and dense matrices, as the others do it, and by the
core's moving window alone, which steps by an implicit method of second order and has an error of
its own.

A second table is of long roads, which no dense matrix holds: the converged scheme (a Winkler bed,
0.125 m, Hermite weights, forces that move within a step) by pavefem's window, and on the whole road
by banded matrices and the trapezoidal rule (Newmark's average acceleration) in scipy, factored
once. Of the longest road scipy does some steps in the middle, for the rest would take minutes.

    python benches/peers.py [--rounds 15] [--json peers.json]

Needs numpy and scipy; numba, openseespy and pavefem are skipped when they are not installed.
"""

from __future__ import annotations

import os

# The thread pools read these when they are loaded, hence before numpy.
os.environ.update(
    {f"{pool}_NUM_THREADS": "1" for pool in ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMBA", "RAYON")}
)

import argparse
import gc
import importlib
import json
import math
import platform
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse
from numpy.typing import NDArray
from scipy.linalg.lapack import dpbtrs

Array = NDArray[np.float64]
Run = Callable[[], Array]


@dataclass(frozen=True)
class Case:
    """The paper's numbers, SI unless a name says otherwise; a track carries half an axle."""

    length: float = 25.0
    elements: int = 50
    inertia: float = 4.5e-5  # m^4
    element_mass: float = 1000.0
    beam_damping: float = 14_000.0  # c_d of eq. 4, N s/m
    bar_mass: float = 355.0  # kg a bar; a third of it moves with the node (consistent mass)
    bar_damping: float = 140_000.0
    subbase_stiffness: float = 9.5e7 / 0.5  # EA/h of eq. 3, N/m
    asphalt_stiffness: float = 56e6  # k_a,ref at the temperature, VMA and speed below, N/m
    penetration_index: float = -1.0
    softening_point_c: float = 60.0
    temperature_c: float = 20.0
    vma: float = 25.0  # voids in the mineral aggregate, percent
    tire_print: float = 0.300
    speed_kmh: float = 65.0
    axle_offsets: tuple[float, ...] = (0.0, 4.55, 5.85)  # behind the front axle
    axle_forces: tuple[float, ...] = (19_462.5, 38_167.5, 40_469.0)
    dt: float = 1e-3
    steps: int = 1708  # until the last axle leaves

    @property
    def h(self) -> float:
        return self.length / self.elements

    @property
    def per_metre(self) -> tuple[float, ...]:
        """EI, its damping, mass of the beam; stiffness, damping, mass of the bed; a metre of road.

        c_d h^3 is the beam's damping as a property of bending (eq. 4).
        """
        beam = (
            self.modulus * self.inertia,
            self.beam_damping * self.h**3,
            self.element_mass / self.h,
        )
        bed = (self.bar_stiffness, self.bar_damping, self.bar_mass / 3)
        return beam + tuple(constant / self.h for constant in bed)

    @property
    def nodes(self) -> int:
        """Free nodes."""
        return self.elements - 1

    @property
    def speed(self) -> float:
        return self.speed_kmh / 3.6

    @property
    def modulus(self) -> float:
        """Asphalt stiffness, eqs. 7-8, in Pa."""
        binder = (
            1.157e-7
            * (self.tire_print / self.speed) ** -0.368
            * math.exp(-self.penetration_index)
            * (self.softening_point_c - self.temperature_c) ** 5
        )
        n = 0.83 * math.log10(4e4 / binder)
        return binder * (1 + (257.5 - 2.5 * self.vma) / (n * (self.vma - 3))) ** n * 1e6

    @property
    def bar_stiffness(self) -> float:
        """Subbase and asphalt in series. E = E_ref here, so the asphalt spring is k_a,ref."""
        return 1 / (1 / self.subbase_stiffness + 1 / self.asphalt_stiffness)


CASE = Case()

# Lowest deflection under the paper's scheme (m): at mid-length, and over all nodes.
CHECK_MID = -0.643594386e-3
CHECK_LOWEST = -0.661134721e-3
CHECK_RTOL = 1e-8


class Measure(NamedTuple):
    """Times in ms; `lowest` are the 49 deflections (m, negative)."""

    cold: list[float]
    warm: list[float]
    lowest: Array


# ------------------------------------------------------------------- what numpy and numba share


def element_matrices(h: float) -> tuple[Array, Array]:
    """Bending times h^3, and consistent mass times 420 / (mass of the element), eqs. 1-2."""
    bending = np.array(
        [
            [12.0, 6 * h, -12.0, 6 * h],
            [6 * h, 4 * h * h, -6 * h, 2 * h * h],
            [-12.0, -6 * h, 12.0, -6 * h],
            [6 * h, 2 * h * h, -6 * h, 4 * h * h],
        ]
    )
    mass = np.array(
        [
            [156.0, 22 * h, 54.0, -13 * h],
            [22 * h, 4 * h * h, 13 * h, -3 * h * h],
            [54.0, 13 * h, 156.0, -22 * h],
            [-13 * h, -3 * h * h, -22 * h, 4 * h * h],
        ]
    )
    return bending, mass


def assemble(case: Case) -> tuple[Array, Array, Array]:
    """M, C, K (98, 98) of eqs. 1-5, ordered w of the free nodes, then theta of the free nodes."""
    h, size = case.h, 2 * (case.elements + 1)
    bending, mass = element_matrices(h)
    element = np.stack(
        [
            case.element_mass / 420 * mass,
            case.beam_damping * bending,
            case.modulus * case.inertia / h**3 * bending,
        ]
    )
    matrices = np.zeros((3, size, size))
    for i in range(0, size - 2, 2):
        matrices[:, i : i + 4, i : i + 4] += element
    w = np.arange(2, size - 2, 2)
    matrices[:, w, w] += np.array([[case.bar_mass / 3], [case.bar_damping], [case.bar_stiffness]])
    keep = np.concatenate([w, w + 1])
    m, c, k = matrices[:, keep[:, None], keep]
    return m, c, k


def state_matrix(m: Array, c: Array, k: Array) -> tuple[Array, float]:
    """A of eq. 9 for the state (u, u'/scale), and the scale.

    Velocities measured in a typical frequency make A's blocks alike in size: expm then needs
    fewer squarings. The displacements, the only output, are not touched.
    """
    n = len(m)
    inverse = scipy.linalg.solve(m, np.hstack([k, c]), assume_a="pos")
    scale = math.sqrt(np.abs(inverse[:, :n]).max())
    a = np.zeros((2 * n, 2 * n))
    a[:n, n:] = scale * np.eye(n)
    a[n:, :n] = -inverse[:, :n] / scale
    a[n:, n:] = -inverse[:, n:]
    return a, scale


def transition(case: Case) -> tuple[Array, Array]:
    """Phi (196, 196) and the columns of Gamma (196, 49) that belong to w of the free nodes."""
    m, c, k = assemble(case)
    n, nodes = len(m), case.nodes
    a, _ = state_matrix(m, c, k)
    phi = scipy.linalg.expm(a * case.dt)
    # A^-1 B = [-K^-1; 0], so Gamma = (I - Phi) [K^-1; 0]: a solve with K is all it needs.
    flexibility = scipy.linalg.solve(k, np.eye(n, nodes), assume_a="pos")
    gamma = -phi[:, :n] @ flexibility
    gamma[:n] += flexibility
    return phi, gamma


def nodal_loads(case: Case, times: Array, forces: Array | None = None) -> Array:
    """Loads (time, free node), up positive: linear weights of Fig. 6, clamped shares dropped.

    `forces` (time, axle) are those of the case if not given.
    """
    position = (case.speed * times[:, None] - np.array(case.axle_offsets)) / case.h
    left = np.floor(position).astype(np.int64)
    share = position - left
    row = np.arange(len(times))
    loads = np.zeros((len(times), case.elements + 1))
    forces = np.broadcast_to(case.axle_forces if forces is None else forces, left.shape)
    for axle in range(left.shape[1]):
        on = (left[:, axle] >= 0) & (left[:, axle] < case.elements)
        i, j, s, force = row[on], left[on, axle], share[on, axle], forces[on, axle]
        # One axle touches an entry once a step, so a plain indexed += loses nothing.
        loads[i, j] -= (1 - s) * force
        loads[i, j + 1] -= s * force
    return loads[:, 1:-1]


# ------------------------------------------------------------------------------- numpy and scipy


def numpy_loop(case: Case, phi: Array, gamma_t: Array, forces: Array | None = None) -> Array:
    """y_k+1 = Phi y_k + Gamma f_k (eq. 12).

    Gamma f of all steps is one matrix product, taken before the loop; the loop turns its rows
    into the states in place, and the envelope is one reduction after it. That beats indexing
    Gamma and calling np.minimum in every step (9.5 ms against 15 ms where this was written).
    """
    times = case.dt * np.arange(case.steps, dtype=np.float64)
    states = nodal_loads(case, times, forces) @ gamma_t
    y = np.zeros(len(phi))
    dot = phi.dot
    for state in states:
        state += dot(y)
        y = state
    return np.minimum(states[:, : case.nodes].min(axis=0), 0.0)


def numpy_matrices(case: Case) -> tuple[Array, Array]:
    """Phi and the transpose of Gamma, laid out for `numpy_loop`."""
    phi, gamma = transition(case)
    # Column-major Phi: OpenBLAS' gemv is faster that way at this size.
    return np.asfortranarray(phi), np.ascontiguousarray(gamma.T)


def numpy_case(case: Case) -> tuple[Run, Run]:
    ready = numpy_matrices(case)
    return lambda: numpy_loop(case, *numpy_matrices(case)), lambda: numpy_loop(case, *ready)


# ----------------------------------------------------------------------------------------- numba


def numba_kernels() -> dict[str, Callable[..., Array]]:
    """The time loop compiled twice: with BLAS for Phi y, and with loops of its own."""
    from numba import njit

    @njit(fastmath=True)
    def add_loads(z: Array, gamma_t: Array, position: Array, forces: Array) -> None:
        last = gamma_t.shape[0]
        for axle in range(position.size):
            s = position[axle]
            if s < 0.0 or s >= last + 1:
                continue
            j = int(s)
            s -= j
            # Node j is row j - 1 of gamma_t: the clamped end nodes have none.
            if j > 0:
                for i in range(z.size):
                    z[i] -= gamma_t[j - 1, i] * ((1.0 - s) * forces[axle])
            if j < last:
                for i in range(z.size):
                    z[i] -= gamma_t[j, i] * (s * forces[axle])

    @njit(fastmath=True)
    def with_blas(phi: Array, gamma_t: Array, positions: Array, forces: Array) -> Array:
        y, z = np.zeros(len(phi)), np.empty(len(phi))
        lowest = np.zeros(gamma_t.shape[0])
        for step in range(positions.shape[0]):
            np.dot(phi, y, z)
            add_loads(z, gamma_t, positions[step], forces)
            for i in range(lowest.size):
                lowest[i] = min(lowest[i], z[i])
            y, z = z, y
        return lowest

    @njit(fastmath=True)
    def add_product(phi: Array, y: Array, z: Array) -> None:
        # Four rows at a time (196 = 4 x 49) load y once for four sums. Measured against one, two,
        # seven and fourteen rows, and sums by columns. Written out inside the time loop, or with
        # sums that start from z, LLVM leaves it scalar: 29 ms a run in place of 6.
        for i in range(0, y.size, 4):
            a = b = c = d = 0.0
            for j in range(y.size):
                t = y[j]
                a += phi[i, j] * t
                b += phi[i + 1, j] * t
                c += phi[i + 2, j] * t
                d += phi[i + 3, j] * t
            z[i] += a
            z[i + 1] += b
            z[i + 2] += c
            z[i + 3] += d

    @njit(fastmath=True)
    def with_loops(phi: Array, gamma_t: Array, positions: Array, forces: Array) -> Array:
        y, z = np.zeros(len(phi)), np.empty(len(phi))
        lowest = np.zeros(gamma_t.shape[0])
        for step in range(positions.shape[0]):
            z[:] = 0.0
            add_loads(z, gamma_t, positions[step], forces)
            add_product(phi, y, z)
            for i in range(lowest.size):
                lowest[i] = min(lowest[i], z[i])
            y, z = z, y
        return lowest

    return {"blas": with_blas, "loops": with_loops}


def numba_case(case: Case, kernel: str) -> tuple[Run, Run]:
    loop = numba_kernels()[kernel]
    # Each kernel gets the layout it reads fastest: columns for BLAS' gemv, rows for the sums.
    order = np.asfortranarray if kernel == "blas" else np.ascontiguousarray

    def prepare() -> tuple[Array, Array]:
        phi, gamma = transition(case)
        return order(phi), np.ascontiguousarray(gamma.T)

    def run(phi: Array, gamma_t: Array) -> Array:
        travelled = case.speed * case.dt * np.arange(case.steps)
        positions = (travelled[:, None] - np.array(case.axle_offsets)) / case.h
        return loop(phi, gamma_t, positions, np.array(case.axle_forces))

    ready = prepare()
    return lambda: run(*prepare()), lambda: run(*ready)


# ------------------------------------------------------------------------------------ OpenSeesPy


def opensees_case(case: Case) -> tuple[Run, Run]:
    """The same M, C, K and loads; another time integration.

    Identical to the model above, term by term: the beams' consistent mass (-cMass); their damping,
    which has the shape of the stiffness (eq. 4), as stiffness-proportional damping with
    beta = c_d h^3 / EI; the bars as zero-length springs whose material carries the dashpot (they
    take no part in the Rayleigh damping); their mass as nodal mass. The horizontal freedoms a
    2D frame has besides are fixed, which leaves 98 equations. A node's load under linear weights
    is a sum of triangles in time, so a Path series with a knot wherever an axle passes a node is
    that load exactly.

    Not identical: Newmark's average acceleration (beta 1/4, gamma 1/2), which takes the loads at
    the end of each step and is second order in dt, in place of exact transition under a
    load held for the step. At 1/8 ms it agrees with the reference below to 2e-5 of the peak.

    The fastest settings found: a linear algorithm that factorizes once (40 % less time), a banded
    solver, and the library's own envelope recorder, in place of a Python loop that asks for
    49 displacements a step.
    """
    ops = importlib.import_module("openseespy.opensees")
    folder = tempfile.TemporaryDirectory(prefix="peers-")
    inner = range(1, case.elements)
    ground = 1000  # tag offset of the fixed ends of the bars

    def build() -> None:
        h, offsets = case.h, np.array(case.axle_offsets)
        forces = np.array(case.axle_forces)
        ops.wipe()
        ops.model("basic", "-ndm", 2, "-ndf", 3)
        for i in range(case.elements + 1):
            ops.node(i, i * h, 0.0)
        ops.fix(0, 1, 1, 1)
        ops.fix(case.elements, 1, 1, 1)
        ops.geomTransf("Linear", 1)
        ops.uniaxialMaterial("Elastic", 1, case.bar_stiffness, case.bar_damping)
        for i in range(case.elements):
            beam = (i, i + 1, 1.0, case.modulus, case.inertia, 1)
            density = case.element_mass / h
            ops.element("elasticBeamColumn", i, *beam, "-mass", density, "-cMass")
        for i in inner:
            ops.fix(i, 1, 0, 0)
            ops.mass(i, 0.0, case.bar_mass / 3, 0.0)
            ops.node(ground + i, i * h, 0.0)
            ops.fix(ground + i, 1, 1, 1)
            ops.element("zeroLength", ground + i, ground + i, i, "-mat", 1, "-dir", 2)
        ops.rayleigh(0.0, case.beam_damping * h**3 / (case.modulus * case.inertia), 0.0, 0.0)
        end = case.dt * (case.steps + 1)
        for i in inner:
            knots = (offsets[:, None] + h * np.array([i - 1, i, i + 1])) / case.speed
            t = np.unique(np.concatenate([[0.0], knots.ravel(), [end]]))
            weight = np.maximum(0.0, 1 - np.abs(case.speed * t[:, None] - offsets - i * h) / h)
            values = -(weight @ forces)
            ops.timeSeries("Path", i, "-time", *t.tolist(), "-values", *values.tolist())
            ops.pattern("Plain", i, i)
            ops.load(i, 0.0, 1.0, 0.0)
        ops.constraints("Plain")
        ops.numberer("RCM")
        ops.system("BandSPD")
        ops.algorithm("Linear", "-factorOnce")
        ops.integrator("Newmark", 0.5, 0.25)
        ops.analysis("Transient")

    def run() -> Array:
        path = os.path.join(folder.name, "envelope.out")
        ops.recorder(
            "EnvelopeNode", "-file", path, "-precision", 15, "-node", *inner, "-dof", 2, "disp"
        )
        if ops.analyze(case.steps, case.dt) != 0:
            raise RuntimeError("OpenSees: the analysis failed")
        ops.remove("recorders")  # this is what writes the file: minimum, maximum, largest
        with open(path, encoding="ascii") as file:
            return np.array(file.readline().split(), dtype=np.float64)

    def cold() -> Array:
        build()
        return run()

    def warm() -> Array:
        ops.reset()
        return run()

    return cold, warm


# --------------------------------------------------------------------------------------- pavefem


def pavefem_case(case: Case) -> tuple[Run, Run]:
    """pavefem's public API. Cold builds the objects and Phi, Gamma too; warm finds them cached."""
    pf = importlib.import_module("pavefem")

    def run(cache: bool, road: object, truck: object) -> Array:
        result = pf.simulate(
            road,
            truck,
            speed_kmh=case.speed_kmh,
            temperature_c=case.temperature_c,
            scheme="paper",
            keep="envelope",
            cache=cache,
        )
        return result.lowest[1:-1]  # the clamped ends are no output here

    def build() -> tuple[object, object]:
        mix = pf.Asphalt(
            vma=case.vma,
            softening_point_c=case.softening_point_c,
            penetration_index=case.penetration_index,
        )
        road = pf.Road(pf.Pavement.paper(asphalt=mix), length=case.length)
        return road, pf.vehicles.tandem_truck(axle_spacing=1.3)

    ready = build()
    return lambda: run(False, *build()), lambda: run(True, *ready)


def window_case(case: Case) -> tuple[Run, Run]:
    """The core's moving window, called without the rest of pavefem. Warm finds it built."""
    core = importlib.import_module("pavefem._core")

    def build() -> object:
        sections = np.array([[case.length, *case.per_metre]])
        mesh, keep = (case.h, "bars", "clamped"), ([], False, np.empty(0), 1)
        return core.Window(sections, *mesh, case.dt, "linear", "zero", keep)

    def run(window: Any) -> Array:
        travelled = case.speed * case.dt * np.arange(case.steps + 1)
        positions = travelled[:, None] - np.array(case.axle_offsets)
        # A wheel track, of which the forces here are, carries half of an axle.
        forces = np.tile(2 * np.array(case.axle_forces), (len(positions), 1))
        _, lowest, *_ = window.run(positions, forces)
        return np.asarray(lowest)[1:-1]

    ready = build()
    return lambda: run(build()), lambda: run(ready)


# ------------------------------------------------------------------------------------ long roads

ELEMENT = 0.125
ROADS = (500.0, 2000.0)
MOST_UNKNOWNS = 10_000
"""Up to which scipy crosses the whole road."""
EXCERPT = 1500
"""Steps of it on a road that is longer, from rest with the front axle in the middle."""
REFERENCE_LENGTH = 60.0
RUN_IN = 10.0
"""After which nothing is left of a start in the middle of the road, m."""
PASSED = 1.0
"""How far behind the last axle no node gets any lower, m."""


@dataclass(frozen=True)
class Passage:
    """Steps of the converged scheme on a road, from a first place of the front axle, m."""

    length: float
    dt: float
    start: float
    steps: int

    @classmethod
    def whole(cls, case: Case, length: float, dt: float) -> Passage:
        """Until the last axle leaves, or the step before."""
        distance = length + case.axle_offsets[-1]
        return cls(length, dt, 0.0, math.floor(distance / (case.speed * dt) + 1e-9))

    @property
    def unknowns(self) -> int:
        return 2 * (round(self.length / ELEMENT) - 1)

    @property
    def places(self) -> Array:
        """Places of the free nodes."""
        return ELEMENT * np.arange(1, self.unknowns // 2 + 1)

    def settled(self, case: Case) -> NDArray[np.bool_]:
        """Free nodes that every axle has passed, as if it had come from the beginning."""
        if self.start == 0.0:
            return np.ones(len(self.places), dtype=np.bool_)
        last = self.start + case.speed * self.dt * self.steps - case.axle_offsets[-1]
        return (self.places > self.start + RUN_IN) & (self.places < last - PASSED)


def banded(case: Case, unknowns: int) -> tuple[Array, Array, Array]:
    """M, C, K of the Winkler bed, both ends clamped, as lower bands (4, unknowns)."""
    h = ELEMENT
    bending, mass = element_matrices(h)
    bending, mass = bending / h**3, mass * h / 420
    ei, damping, beam_mass, stiffness, bed_damping, bed_mass = case.per_metre
    bands = []
    for element in (
        (beam_mass + bed_mass) * mass,
        damping * bending + bed_damping * mass,
        ei * bending + stiffness * mass,
    ):
        band = np.zeros((4, unknowns + 4))
        for i in range(4):
            for j in range(i + 1):
                band[i - j, j : j + unknowns + 1 : 2] += element[i, j]
        band = band[:, 2:-2]
        for below in range(1, 4):
            band[below, unknowns - below :] = 0.0
        bands.append(band)
    m, c, k = bands
    return m, c, k


def symmetric(band: Array) -> scipy.sparse.dia_matrix:
    """The whole of a matrix from its lower bands, by diagonals: the fastest product of scipy."""
    size = band.shape[1]
    lower = [band[below, : size - below] for below in range(4)]
    return scipy.sparse.dia_matrix(
        scipy.sparse.diags(lower + lower[1:], [0, -1, -2, -3, 1, 2, 3], shape=(size, size))
    )


def hermite_loads(case: Case, passage: Passage) -> tuple[NDArray[np.int64], Array]:
    """Unknowns under the axles, and loads there, (time, 4 axles), by the shape functions."""
    times = passage.dt * np.arange(passage.steps + 1)
    place = passage.start + case.speed * times[:, None] - np.array(case.axle_offsets)
    elements = round(passage.length / ELEMENT)
    element = np.clip(np.floor(place / ELEMENT).astype(np.int64), 0, elements - 1)
    s = place / ELEMENT - element
    weights = np.stack(
        [
            1 - 3 * s**2 + 2 * s**3,
            ELEMENT * (s - 2 * s**2 + s**3),
            3 * s**2 - 2 * s**3,
            ELEMENT * (s**3 - s**2),
        ],
        axis=-1,
    )
    weights[(place < 0) | (place > passage.length)] = 0.0
    unknown = 2 * element[..., None] + np.arange(-2, 2)
    held = (unknown < 0) | (unknown >= passage.unknowns)
    loads = np.where(held, 0.0, -weights * np.array(case.axle_forces)[:, None])
    rows = (len(times), -1)
    return np.where(held, 0, unknown).reshape(rows), loads.reshape(rows)


def scipy_passage(case: Case, passage: Passage) -> Array:
    """Lowest deflection of the free nodes, by the trapezoidal rule.

    (M + dt/2 C + dt^2/4 K) (v_0 + v_1) = 2 M v_0 - dt K u_0 + dt/2 (f_0 + f_1), and then
    u_1 = u_0 + dt/2 (v_0 + v_1): two products and one solve a step, and no product with C.
    """
    dt = passage.dt
    m, c, k = banded(case, passage.unknowns)
    factor = scipy.linalg.cholesky_banded(m + dt / 2 * c + dt**2 / 4 * k, lower=True)
    inertia, spring = symmetric(2 * m), symmetric(-dt * k)
    unknowns, loads = hermite_loads(case, passage)
    impulses = dt / 2 * loads
    u, v, lowest = (np.zeros(passage.unknowns) for _ in range(3))
    for step in range(passage.steps):
        right = inertia @ v
        right += spring @ u
        for instant in (step, step + 1):
            np.add.at(right, unknowns[instant], impulses[instant])
        total, _ = dpbtrs(factor, right, lower=1, overwrite_b=1)
        v = total - v
        u += dt / 2 * total
        np.minimum(lowest, u, out=lowest)
    return lowest[::2]


def on_long_road(short: Array, nodes: int) -> Array:
    """Lowest deflections of a long road from those of a short one: its ends, and its middle.

    30 m from the ends nothing is felt of them, and one node is like another.
    """
    half = len(short) // 2
    return np.concatenate([short[:half], np.full(nodes - 2 * half, short[half]), short[-half:]])


def pavefem_passage(case: Case, length: float) -> Array:
    pf = importlib.import_module("pavefem")
    mix = pf.Asphalt(
        vma=case.vma,
        softening_point_c=case.softening_point_c,
        penetration_index=case.penetration_index,
    )
    result = pf.simulate(
        pf.Road(pf.Pavement.paper(asphalt=mix), length=length),
        pf.vehicles.tandem_truck(axle_spacing=1.3),
        speed_kmh=case.speed_kmh,
        temperature_c=case.temperature_c,
        scheme=pf.Scheme.converged(element_length=ELEMENT),
        keep="envelope",
    )
    return np.asarray(result.lowest)[1:-1]


def long_roads(case: Case) -> list[dict[str, float | str]]:
    """Time and error of both codes; the reference is scipy's with a step 16 times shorter."""
    short = scipy_passage(case, Passage.whole(case, REFERENCE_LENGTH, case.dt / 16))
    rows: list[dict[str, float | str]] = []

    def add(code: str, passage: Passage, run: Run, runs: int) -> None:
        times, lowest = zip(*(timed(run) for _ in range(runs)), strict=True)
        reference = on_long_road(short, passage.unknowns // 2)
        nodes = passage.settled(case)
        error = np.abs(lowest[0] - reference)[nodes].max() / np.abs(reference).max()
        seconds = min(times) / 1e3
        rows.append(
            {
                "code": code,
                "road_m": passage.length,
                "steps": passage.steps,
                "seconds": seconds,
                "ms_per_vehicle_second": 1e3 * seconds / (passage.steps * passage.dt),
                "nodes": int(nodes.sum()),
                "error": float(error),
            }
        )

    for length in ROADS:
        whole = Passage.whole(case, length, case.dt)
        try:
            add("pavefem", whole, lambda length=length: pavefem_passage(case, length), 3)
        except ImportError:
            print("long roads: pavefem is not installed")
        part = whole
        if whole.unknowns > MOST_UNKNOWNS:
            part = Passage(length, case.dt, length / 2, EXCERPT)
        add("scipy, banded", part, lambda part=part: scipy_passage(case, part), 1)
    return rows


def report_roads(rows: list[dict[str, float | str]]) -> None:
    print(
        f"\n{'road m':>7}  {'code':<14}{'steps':>8}{'seconds':>9}{'ms/vehicle-s':>14}{'/pf':>8}"
        f"{'nodes':>8}{'error':>10}"
    )
    base: dict[float | str, float] = {}
    for row in rows:
        cost = float(row["ms_per_vehicle_second"])
        if row["code"] == "pavefem":
            base[row["road_m"]] = cost
        elif row["road_m"] in base:
            row["over_pavefem"] = cost / base[row["road_m"]]
        ratio = row.get("over_pavefem")
        shown = "-" if ratio is None else f"{ratio:.0f}"
        print(
            f"{row['road_m']:>7.0f}  {row['code']:<14}{row['steps']:>8}{row['seconds']:>9.3f}"
            f"{cost:>14.2f}{shown:>8}{row['nodes']:>8}{row['error']:>10.1e}"
        )


# --------------------------------------------------------------------------------- the reference


def converged(case: Case, substeps: int) -> Array:
    """The same spatial model under the continuously moving load: exact but for kinks and sampling.

    First-order hold: the transition is exact for a load that is linear within a (sub)step, which
    a linear-weight load is except in the few steps in which an axle passes a node. Phi and both
    input matrices come from one exponential of the augmented matrix (Van Loan), free of the
    cancellation that the closed forms have at a small step.
    """
    m, c, k = assemble(case)
    n, nodes = len(m), case.nodes
    a, scale = state_matrix(m, c, k)
    b = np.zeros((2 * n, nodes))
    b[n:] = scipy.linalg.solve(m, np.eye(n, nodes), assume_a="pos") / scale
    dt, size = case.dt / substeps, 2 * n + 2 * nodes
    augmented = np.zeros((size, size))
    augmented[: 2 * n, : 2 * n] = a * dt
    augmented[: 2 * n, 2 * n : 2 * n + nodes] = b * dt
    augmented[2 * n : 2 * n + nodes, 2 * n + nodes :] = np.eye(nodes)
    exponential = scipy.linalg.expm(augmented)
    phi = np.asfortranarray(exponential[: 2 * n, : 2 * n])
    total = exponential[: 2 * n, 2 * n : 2 * n + nodes]
    ramp = exponential[: 2 * n, 2 * n + nodes :]
    y, lowest = np.zeros(2 * n), np.zeros(nodes)
    # In pieces, because the loads of all substeps at once would take 200 MB.
    for first in range(0, case.steps * substeps, 4096):
        last = min(first + 4096, case.steps * substeps)
        loads = nodal_loads(case, dt * np.arange(first, last + 1, dtype=np.float64))
        states = loads[:-1] @ (total - ramp).T + loads[1:] @ ramp.T
        for state in states:
            state += phi.dot(y)
            y = state
        np.minimum(lowest, states[:, :nodes].min(axis=0), out=lowest)
    return lowest


# --------------------------------------------------------------------------- measuring, printing

CODES: dict[str, Callable[[Case], tuple[Run, Run]]] = {
    "numpy/scipy": numpy_case,
    "numba (BLAS)": lambda case: numba_case(case, "blas"),
    "numba (loops)": lambda case: numba_case(case, "loops"),
    "openseespy": opensees_case,
    "pavefem": pavefem_case,
    "pavefem window": window_case,
}
CHECKED = ("numpy/scipy", "numba (BLAS)", "numba (loops)", "pavefem")
PACKAGES = ("numpy", "scipy", "numba", "openseespy", "pavefem")


def prepare_codes(case: Case) -> dict[str, tuple[Run, Run]]:
    ready: dict[str, tuple[Run, Run]] = {}
    for name, make in CODES.items():
        try:
            ready[name] = make(case)
        except (ImportError, RuntimeError) as error:
            # openseespy raises RuntimeError when a shared library it needs is missing.
            reason = str(error).splitlines()[0]
            print(f"{name}: skipped ({reason})")
    return ready


def timed(run: Run) -> tuple[float, Array]:
    start = time.perf_counter()
    lowest = run()
    return 1e3 * (time.perf_counter() - start), lowest


def check(case: Case, name: str, lowest: Array) -> None:
    if lowest.shape != (case.nodes,):
        raise AssertionError(f"{name}: {lowest.shape} values in place of {case.nodes}")
    if name in CHECKED:
        mid = lowest[case.elements // 2 - 1]
        for value, expected in ((mid, CHECK_MID), (lowest.min(), CHECK_LOWEST)):
            if abs(value - expected) > CHECK_RTOL * abs(expected):
                raise AssertionError(f"{name}: {value:.12e} m in place of {expected:.9e} m")


def measure(case: Case, codes: dict[str, tuple[Run, Run]], rounds: int) -> dict[str, Measure]:
    results: dict[str, Measure] = {}
    for name, (cold, warm) in codes.items():
        # Untimed first calls: compilation, allocation, and the check of what is computed.
        lowest = cold()
        check(case, name, lowest)
        if np.abs(warm() - lowest).max() > 1e-12 * np.abs(lowest).max():
            raise AssertionError(f"{name}: the warm run differs from the cold one")
        results[name] = Measure([], [], lowest)
    gc.disable()
    try:
        for _ in range(rounds):
            for name, (cold, warm) in codes.items():
                gc.collect()
                results[name].cold.append(timed(cold)[0])
                results[name].warm.append(timed(warm)[0])
    finally:
        gc.enable()
    return results


def versions() -> dict[str, str]:
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def report(results: dict[str, Measure], reference: Array) -> list[dict[str, float | str]]:
    base = results.get("pavefem")
    rows: list[dict[str, float | str]] = []
    for name, (cold, warm, lowest) in results.items():
        row: dict[str, float | str] = {
            "code": name,
            "cold_best_ms": min(cold),
            "cold_median_ms": statistics.median(cold),
            "warm_best_ms": min(warm),
            "warm_median_ms": statistics.median(warm),
            "error": float(np.abs(lowest - reference).max() / np.abs(reference).max()),
            "lowest_mm": float(1e3 * lowest.min()),
            "mid_mm": float(1e3 * lowest[len(lowest) // 2]),
        }
        if base is not None:
            row["cold_over_pavefem"] = min(cold) / min(base.cold)
            row["warm_over_pavefem"] = min(warm) / min(base.warm)
        rows.append(row)

    print(
        f"\n{'code':<14}{'cold ms':>9}{'(median)':>10}{'warm ms':>9}{'(median)':>10}"
        f"{'cold/pf':>9}{'warm/pf':>9}{'error':>10}{'mid mm':>12}{'lowest mm':>12}"
    )
    for row in rows:
        ratios = [row.get(f"{kind}_over_pavefem") for kind in ("cold", "warm")]
        shown = "".join(f"{'-' if ratio is None else format(ratio, '.2f'):>9}" for ratio in ratios)
        print(
            f"{row['code']:<14}{row['cold_best_ms']:>9.2f}{row['cold_median_ms']:>10.2f}"
            f"{row['warm_best_ms']:>9.2f}{row['warm_median_ms']:>10.2f}{shown}"
            f"{row['error']:>10.1e}{row['mid_mm']:>12.6f}{row['lowest_mm']:>12.6f}"
        )
    return rows


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="The paper's case in pavefem and in its peers.")
    parser.add_argument("--rounds", type=int, default=15, help="timed runs of each code")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the table there too")
    options = parser.parse_args(argv)
    if options.rounds < 1:
        parser.error("--rounds must be 1 or more")

    case = CASE
    reference, coarser = converged(case, 64), converged(case, 32)
    # Second order in the substep: a third of the difference is what the finer one lacks still.
    doubt = float(np.abs(reference - coarser).max() / 3 / np.abs(reference).max())
    print(
        f"{case.elements} elements, {case.steps} steps of {1e3 * case.dt:g} ms, one thread, "
        f"{options.rounds} rounds; " + ", ".join(f"{k} {v}" for k, v in versions().items())
    )
    print(
        f"reference (1/64 ms): mid {1e3 * reference[case.nodes // 2]:.6f} mm, "
        f"lowest {1e3 * reference.min():.6f} mm; what is left of its own error: {doubt:.0e}"
    )
    results = measure(case, prepare_codes(case), options.rounds)
    if not set(CHECKED).isdisjoint(results):
        print(
            f"{', '.join(name for name in CHECKED if name in results)}: mid and lowest deflection "
            f"agree with {1e3 * CHECK_MID:.9f} and {1e3 * CHECK_LOWEST:.9f} mm "
            f"to {CHECK_RTOL:.0e}"
        )
    rows = report(results, reference)
    if {"numpy/scipy", "pavefem window"} <= results.keys():
        ratio = min(results["numpy/scipy"].cold) / min(results["pavefem window"].cold)
        print(f"numpy/scipy takes {ratio:.1f} times as long, cold, as the core's window")
    roads = long_roads(case)
    report_roads(roads)
    if options.json is not None:
        document = {
            "versions": versions(),
            "rounds": options.rounds,
            "reference_error": doubt,
            "codes": rows,
            "roads": roads,
        }
        options.json.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
