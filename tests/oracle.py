"""The model a second time, in plain dense numpy and scipy: slow, direct, and not ours to trust.

Nothing here calls the core. Matrices are assembled element by element from the printed formulas,
and time goes step by step with the matrix exponential of scipy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import lsim

import pavefem as pf

Array = NDArray[np.float64]


def bending(h: float) -> Array:
    """Stiffness of a Hermite beam element of EI = 1 (eq. 1)."""
    return np.array(
        [
            [12, 6 * h, -12, 6 * h],
            [6 * h, 4 * h**2, -6 * h, 2 * h**2],
            [-12, -6 * h, 12, -6 * h],
            [6 * h, 2 * h**2, -6 * h, 4 * h**2],
        ]
    ) / (h**3)


def consistent(h: float) -> Array:
    """Consistent mass of an element of 1 kg/m (eq. 2)."""
    return (h / 420.0) * np.array(
        [
            [156, 22 * h, 54, -13 * h],
            [22 * h, 4 * h**2, 13 * h, -3 * h**2],
            [54, 13 * h, 156, -22 * h],
            [-13 * h, -3 * h**2, -22 * h, 4 * h**2],
        ]
    )


def hermite(h: float, s: float) -> Array:
    """Shape functions at the fraction `s` of an element."""
    return np.array(
        [
            1 - 3 * s**2 + 2 * s**3,
            h * (s - 2 * s**2 + s**3),
            3 * s**2 - 2 * s**3,
            h * (s**3 - s**2),
        ]
    )


@dataclass
class DenseRoad:
    """Nodes, and M, C, K over all unknowns (w, theta), of which `free` are not held."""

    nodes: Array
    mass: Array
    damping: Array
    stiffness: Array
    free: NDArray[np.intp]

    @classmethod
    def of(
        cls, road: pf.Road, scheme: pf.Scheme, temperature_c: float, speed_kmh: float
    ) -> DenseRoad:
        elements: list[tuple[float, pf.Section]] = []
        for section in road.sections:
            h = scheme.element_length or road.element_length(temperature_c, speed_kmh)
            count = int(np.ceil(section.length / h - 1e-9))
            elements += [(section.length / count, section)] * count
        nodes = np.concatenate([[0.0], np.cumsum([h for h, _ in elements])])
        size = 2 * nodes.size
        matrices = np.zeros((3, size, size))
        for j, (h, section) in enumerate(elements):
            structure = section.pavement
            modulus = float(structure.asphalt.modulus(temperature_c, speed_kmh))
            spacing = structure.spacing
            bar = structure.bar_stiffness(modulus)
            if scheme.foundation == "winkler":
                bed = consistent(h) / spacing
            else:
                bed = np.diag([h / 2, 0.0, h / 2, 0.0]) / spacing
            at = np.ix_(range(2 * j, 2 * j + 4), range(2 * j, 2 * j + 4))
            matrices[0][at] += consistent(h) * structure.element_mass / spacing
            matrices[0][at] += bed * structure.bar_mass / 3.0
            matrices[1][at] += bending(h) * structure.beam_damping * spacing**3
            matrices[1][at] += bed * structure.bar_damping
            matrices[2][at] += bending(h) * modulus * structure.moment_of_inertia
            matrices[2][at] += bed * bar
        held = {
            "clamped": [0, 1, size - 2, size - 1],
            "pinned": [0, size - 2],
            "free": [],
        }[road.ends]
        free = np.setdiff1d(np.arange(size), held)
        return cls(nodes, matrices[0], matrices[1], matrices[2], free)

    def forces(self, places: Array, forces: Array, weights: str) -> Array:
        """Nodal forces of axles of which this wheel track carries half, up positive."""
        out = np.zeros(2 * self.nodes.size)
        for x, force in zip(places, forces, strict=True):
            if not 0.0 <= x <= self.nodes[-1]:
                continue
            j = min(int(np.searchsorted(self.nodes, x, side="right")), self.nodes.size - 1) - 1
            h = self.nodes[j + 1] - self.nodes[j]
            s = (x - self.nodes[j]) / h
            shape = hermite(h, s) if weights == "hermite" else np.array([1 - s, 0.0, s, 0.0])
            out[2 * j : 2 * j + 4] -= 0.5 * force * shape
        return out

    def step(
        self,
        positions: Array,
        forces: Array,
        dt: float,
        weights: str = "linear",
        hold: str = "zero",
    ) -> Array:
        """Deflection of every node at every instant, from rest."""
        free = np.ix_(self.free, self.free)
        mass, damping, stiffness = (m[free] for m in (self.mass, self.damping, self.stiffness))
        phi, gamma, ramp = exponential(mass, damping, stiffness, dt)
        n = self.free.size
        loads = np.array(
            [
                self.forces(place, force, weights)[self.free]
                for place, force in zip(positions, forces, strict=True)
            ]
        )
        state = np.zeros(2 * n)
        history = np.zeros((positions.shape[0], 2 * self.nodes.size))
        for k in range(positions.shape[0]):
            history[k, self.free] = state[:n]
            if k + 1 < positions.shape[0]:
                state = phi @ state + gamma @ loads[k]
                if hold == "first":
                    state += ramp @ (loads[k + 1] - loads[k])
        return history[:, ::2]


def state_matrices(mass: Array, damping: Array, stiffness: Array) -> tuple[Array, Array]:
    """Give A and B of the state form of ``M u'' + C u' + K u = f``."""
    n = mass.shape[0]
    inverse = np.linalg.inv(mass)
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]])
    return a, np.vstack([np.zeros((n, n)), inverse])


def exponential(
    mass: Array, damping: Array, stiffness: Array, dt: float
) -> tuple[Array, Array, Array]:
    """Give Phi, Gamma and the ramp's response from one exponential of an augmented matrix."""
    a, b = state_matrices(mass, damping, stiffness)
    two_n, n = b.shape
    augmented = np.zeros((two_n + 2 * n, two_n + 2 * n))
    augmented[:two_n, :two_n] = a * dt
    augmented[:two_n, two_n : two_n + n] = b * dt
    augmented[two_n : two_n + n, two_n + n :] = np.eye(n)
    whole = np.asarray(expm(augmented))
    return (
        whole[:two_n, :two_n],
        whole[:two_n, two_n : two_n + n],
        whole[:two_n, two_n + n :],
    )


def turning(history: Array) -> tuple[Array, Array]:
    """Find what each column goes down and up to, at vertices of parabolas through three rows."""
    left, middle, right = history[:-2], history[1:-1], history[2:]
    bend, slope = right - 2.0 * middle + left, (right - left) / 2.0
    # No vertex is further than half a step from the row it belongs to.
    part = np.minimum(np.abs(slope) / np.where(bend == 0.0, np.inf, np.abs(bend)), 0.5)
    depth = np.minimum(np.abs(slope) * part / 2.0, np.abs(bend) / 8.0)
    low = np.where(bend > 0.0, middle - depth, middle).min(axis=0)
    high = np.where(bend < 0.0, middle + depth, middle).max(axis=0)
    return np.minimum(low, history.min(axis=0)), np.maximum(high, history.max(axis=0))


def constant_forces(
    vehicle: pf.Vehicle, length: float, speed_kmh: float, dt: float
) -> tuple[Array, Array]:
    """Places and forces of a vehicle on a smooth road until its last axle leaves."""
    speed = speed_kmh / 3.6
    steps = int(np.floor((length + vehicle.length) / (speed * dt) + 1e-9))
    front = speed * dt * np.arange(steps + 1)
    positions = front[:, np.newaxis] - vehicle.axle_positions
    return positions, np.tile(vehicle.static_loads, (steps + 1, 1))


def vehicle_matrices(vehicle: pf.Vehicle) -> tuple[Array, Array, Array, Array, Array]:
    """Give M, C, K, the rows of the tires' heights, and the static loads of a vehicle.

    Every body has a bounce and a pitch at first. Pins, and bodies without inertia, are constraints
    that leave the unknowns of `Vehicle.unknowns`; the others follow from them.
    """
    number = {body.name: i for i, body in enumerate(vehicle.bodies)}
    size = 2 * len(vehicle.bodies)

    def height(name: str, x: float) -> Array:
        row = np.zeros(size)
        row[2 * number[name]] = 1.0
        row[2 * number[name] + 1] = x - vehicle.bodies[number[name]].x
        return row

    constraints, dependent = [], []
    for i, body in enumerate(vehicle.bodies):
        if body.pinned_to is not None and body.pin is not None:
            constraints.append(height(body.name, body.pin) - height(body.pinned_to, body.pin))
            dependent.append(2 * i)
        if body.pitch_inertia == 0.0:
            constraints.append(np.eye(size)[2 * i + 1])
            dependent.append(2 * i + 1)
    free = [i for i in range(size) if i not in dependent]
    basis = np.zeros((size, len(free)))
    basis[free] = np.eye(len(free))
    if dependent:
        held = np.array(constraints)
        basis[dependent] = -np.linalg.solve(held[:, dependent], held[:, free])
    springs = [
        height(spring.upper, float(np.mean([x for _, x in spring.lower_ends])))
        - np.mean([height(name, x) for name, x in spring.lower_ends], axis=0)
        for spring in vehicle.springs
    ]
    tires = [height(tire.body, tire.x) for tire in vehicle.tires]
    elements: list[pf.Spring | pf.Tire] = [*vehicle.springs, *vehicle.tires]
    rows = np.array([*springs, *tires]) @ basis
    masses = np.array([[body.mass, body.pitch_inertia] for body in vehicle.bodies]).ravel()
    mass = basis.T @ np.diag(masses) @ basis
    damping = rows.T @ np.diag([element.damping for element in elements]) @ rows
    stiffness = rows.T @ np.diag([element.stiffness for element in elements]) @ rows
    weight = basis.T @ (masses * np.tile([9.81, 0.0], len(vehicle.bodies)))
    felt = rows[len(springs) :]
    sinking = np.linalg.solve(stiffness, weight)
    loads = np.array([tire.stiffness for tire in vehicle.tires]) * (felt @ sinking)
    return mass, damping, stiffness, felt, loads


def road_under(
    profile: pf.Profile, places: Array, lengths: Array, speed: float
) -> tuple[Array, Array]:
    """Elevation above the first sample, mean over prints of these lengths, and its rate."""
    x = np.concatenate([[profile.x[0] - 100.0], profile.x, [profile.x[-1] + 100.0]])
    z = np.pad(profile.z - profile.z[0], 1, mode="edge")
    areas = np.concatenate([[0.0], np.cumsum(np.diff(x) * (z[1:] + z[:-1]) / 2.0)])

    def area(at: Array) -> Array:
        segment = np.searchsorted(x, at, side="right") - 1
        along = at - x[segment]
        slope = np.diff(z)[segment] / np.diff(x)[segment]
        return np.asarray(areas[segment] + along * (z[segment] + slope * along / 2.0))

    ahead, behind = places + lengths / 2.0, places - lengths / 2.0
    point = lengths == 0.0
    spread = np.where(point, 1.0, lengths)
    mean = np.where(point, np.interp(places, x, z), (area(ahead) - area(behind)) / spread)
    slopes = np.diff(z) / np.diff(x)
    here = slopes[np.searchsorted(x, places, side="right") - 1]
    across = (np.interp(ahead, x, z) - np.interp(behind, x, z)) / spread
    return mean, speed * np.where(point, here, across)


def tire_forces(vehicle: pf.Vehicle, elevation: Array, rate: Array, time: Array) -> Array:
    """Tire forces by scipy.signal.lsim, for an elevation that is linear within each step.

    The dampers' part of the input is the rate of the elevation. With v = v' + M^-1 R' c z it leaves
    the input, which is the elevation alone.
    """
    mass, damping, stiffness, felt, loads = vehicle_matrices(vehicle)
    n = mass.shape[0]
    k = np.array([tire.stiffness for tire in vehicle.tires])
    c = np.array([tire.damping for tire in vehicle.tires])
    a, b = state_matrices(mass, damping, stiffness)
    shift = b[n:] @ felt.T @ np.diag(c)
    inputs = np.vstack([shift, b[n:] @ felt.T @ np.diag(k) - b[n:] @ damping @ shift])
    system = a, inputs, np.eye(2 * n), np.zeros((2 * n, k.size))
    start = np.concatenate([np.zeros(n), -shift @ elevation[0]])  # at rest, whatever is felt
    _, states, _ = lsim(system, elevation, time, X0=start)
    heights = states[:, :n] @ felt.T
    speeds = (states[:, n:] + elevation @ shift.T) @ felt.T
    return np.asarray(loads + k * (elevation - heights) + c * (rate - speeds))
