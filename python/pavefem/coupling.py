"""Two-way coupling: tires that feel the deflection they cause, and what that changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple, Self

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pavefem import _core
from pavefem.forces import TOLERANCE, Progress, TireForces, with_places
from pavefem.scenario import Scenario

_LEVEL: Final = (np.array([0.0, 1.0]), np.array([0.0, 0.0]))
"""A smooth road: it goes on level beyond both samples."""


@dataclass(frozen=True, eq=False)
class Coupling:
    """What a road that gives way under the tires changes: the error of one-way coupling.

    Attributes
    ----------
    force_change : ndarray, shape (axles,)
        Largest change of the tire force of each axle at any instant, as a part of its static load.
    deflection_change : float
        Change of the largest deflection of any node, as a part of that of one-way coupling.
    iterations : int
        Most iterations that a step took until its forces and deflections fitted each other.
    axle_deflection : ndarray, shape (times, axles), or None
        Deflection under each axle, m, up positive, 0 off the road, if tire forces are kept.
    """

    force_change: NDArray[np.float64]
    deflection_change: float
    iterations: int
    axle_deflection: NDArray[np.float64] | None = None

    def summary(self) -> str:
        """Say it in a line."""
        forces = ", ".join(f"{100.0 * change:.2g}" for change in self.force_change)
        return (
            f"tire forces change by up to {forces} % of static, the largest deflection by "
            f"{100.0 * self.deflection_change:+.2g} %"
        )

    def assign_to(self, dataset: xr.Dataset) -> xr.Dataset:
        """Add it to the dataset of a result, with units."""
        forces = {"units": "1", "long_name": "largest change of a tire force, of its static load"}
        deflection = {"units": "1", "long_name": "change of the largest deflection"}
        iterations = {"units": "1", "long_name": "most iterations of a step of coupling"}
        dataset = dataset.assign(
            force_change=("axle", self.force_change, forces),
            deflection_change=((), self.deflection_change, deflection),
            coupling_iterations=((), self.iterations, iterations),
        )
        if self.axle_deflection is None:
            return dataset
        attributes = {"units": "m", "long_name": "deflection under an axle", "positive": "up"}
        return dataset.assign(axle_deflection=(("time", "axle"), self.axle_deflection, attributes))

    @classmethod
    def of(cls, dataset: xr.Dataset) -> Self | None:
        """Take it from the dataset of a result, if it was coupled two way."""
        if "force_change" not in dataset:
            return None
        kept = "axle_deflection" in dataset
        return cls(
            force_change=dataset["force_change"].to_numpy(),
            deflection_change=float(dataset["deflection_change"]),
            iterations=int(dataset["coupling_iterations"]),
            axle_deflection=dataset["axle_deflection"].to_numpy() if kept else None,
        )


class Coupled(NamedTuple):
    """A vehicle and a road that feel each other."""

    forces: TireForces
    axle_deflection: NDArray[np.float64]
    iterations: int

    def against(
        self, one_way: TireForces, deepest: tuple[float, float], every: int | None
    ) -> Coupling:
        """Compare with one-way coupling, and keep every n-th instant or none.

        `deepest` is the lowest deflection of any node, m, one way and two way.
        """
        change = np.abs(self.forces.force - one_way.force).max(axis=0)
        before, after = deepest
        return Coupling(
            force_change=change / one_way.static_loads,
            deflection_change=after / before - 1.0 if before < 0.0 else 0.0,
            iterations=self.iterations,
            axle_deflection=None if every is None else self.axle_deflection[::every],
        )


def couple(
    scenario: Scenario,
    positions: NDArray[np.float64],
    window: _core.Window,
    report: Progress | None,
) -> Coupled:
    """Find the tire forces over a road that gives way, the axles being at `positions` on it.

    Raises
    ------
    SolverError
        If forces and deflections of a step do not settle, and as of `tire_forces`.
    """
    run, vehicle, profile = scenario.plan, scenario.vehicle, scenario.profile
    x, z = _LEVEL if profile is None else (profile.x, profile.z)
    force, under, iterations = _core.two_way(
        vehicle=vehicle.core,
        run=run.row,
        x=x,
        z=z,
        interpolation=scenario.interpolation,
        dt=run.dt,
        lift_off=scenario.lift_off,
        tolerance=TOLERANCE,
        road=window,
        positions=positions,
        progress=report,
    )
    forces = with_places(run, vehicle, force).seen_from(scenario.origin)
    return Coupled(forces, under, iterations)
