"""Pitch-plane vehicles: bodies, springs and tires (section IV of the paper, generalised)."""

from __future__ import annotations

import math
import os
import re
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Self

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import Field, TypeAdapter, model_validator

from pavefem import _core
from pavefem._model import Model, NotNegative, Number, Positive
from pavefem._tables import read_toml, told_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pavefem.vehicles.builder import Call


class Body(Model):
    """A rigid body in the pitch plane.

    A free body bounces, and pitches if it has a pitch inertia. A pinned body has its pitch only: a
    walking (equalizing) beam on the frame, a semitrailer on its fifth wheel.
    """

    name: Annotated[str, Field(min_length=1)]
    """What springs and tires call it."""
    mass: NotNegative
    """Mass, kg."""
    x: Number
    """Centre of gravity, m behind the front axle."""
    pitch_inertia: NotNegative = 0.0
    """Moment of inertia about the centre of gravity, kg m²; 0 for a body that does not pitch."""
    pinned_to: str | None = None
    """The body, listed before this one, that it is pinned to."""
    pin: Number | None = None
    """Place of the pin, m behind the front axle."""

    @model_validator(mode="after")
    def _pin_is_whole(self) -> Self:
        if (self.pinned_to is None) != (self.pin is None):
            raise ValueError("pinned_to and pin go together")
        return self


class Friction(Model):
    """Dry friction, as between the leaves of a leaf spring: it makes a vehicle non-linear.

    The force F follows the stretch u of its spring by ``dF = (sign(du) F_c - F) |du| / travel``,
    from no force at rest: P. S. Fancher et al., "Measurement and representation of the mechanical
    properties of truck leaf springs", SAE 800905 (1980), for what a leaf spring has beyond its
    stiffness.
    """

    force: Positive
    """Largest force F_c, N, both sides of the vehicle together: half the height of the loop."""
    travel: Positive
    """Stretch over which a change of direction takes effect by 63 %, m."""


class Spring(Model):
    """A spring and a damper between points of two bodies, both sides of the vehicle together.

    With several lower ends it acts on their mean height, and each of them takes an equal share of
    its force: an air suspension whose bellows are connected.
    """

    upper: str
    """Body at the upper end."""
    lower: str | Annotated[tuple[str, ...], Field(min_length=1)]
    """Body at the lower end, or bodies."""
    x: Number | Annotated[tuple[Number, ...], Field(min_length=1)]
    """Place of both ends, m behind the front axle; one for each of several lower ends."""
    stiffness: NotNegative
    """Spring constant, N/m."""
    damping: NotNegative
    """Damping constant, N s/m."""
    friction: Friction | None = None
    """Dry friction beside them."""

    @model_validator(mode="after")
    def _ends_are_whole(self) -> Self:
        bodies, places = len(self.lower_ends), 1 if isinstance(self.x, float) else len(self.x)
        if isinstance(self.lower, str) != isinstance(self.x, float) or bodies != places:
            raise ValueError(f"x has {places} places for {bodies} lower ends: must be one for each")
        if self.stiffness == self.damping == 0.0 and self.friction is None:
            raise ValueError("stiffness and damping are 0, and no friction: it does nothing")
        return self

    @property
    def lower_ends(self) -> tuple[tuple[str, float], ...]:
        """Body and place, m, of each lower end."""
        bodies = (self.lower,) if isinstance(self.lower, str) else self.lower
        places = (self.x,) if isinstance(self.x, float) else self.x
        return tuple(zip(bodies, places, strict=False))


PrintLength = Annotated[NotNegative, Field(le=2.0)]
"""Length of a tire print, m; prints are 0.2 to 0.3 m long."""


class Tire(Model):
    """The tires of one axle: a spring and a damper between a body and the road."""

    body: str
    """The body they carry."""
    x: Number
    """Place, m behind the front axle."""
    stiffness: Positive
    """Spring constant of all tires of the axle, N/m."""
    damping: NotNegative
    """Damping constant of all tires of the axle, N s/m."""
    print_length: PrintLength = 0.0
    """Length of the tire print, over which the elevation of the road is averaged, m; 0 for a
    point."""
    dual: bool = False
    """Whether two tires stand side by side at each end of the axle: plots show it."""


class Vehicle(Model):
    """A vehicle: its matrices, static loads and modes follow from bodies, springs and tires.

    Places are metres behind the front axle, heights are up positive, and a body's pitch is the
    slope of its line, positive with the tail up. M, C and K are sums of energy rows: one row of
    coefficients for each mass, spring-damper and tire. `vehicles.from_units` makes all three from
    trucks and trailers on groups of axles.

    Raises
    ------
    pydantic.ValidationError
        (a `ValueError`) for a value out of range, a name that is not a body's, or a tire that does
        not press on the road at rest.
    SolverError
        If a body is not held up by springs and tires.
    """

    name: str = "vehicle"
    """What tables and plots call it."""
    bodies: Annotated[tuple[Body, ...], Field(min_length=1)]
    """Bodies; a pinned one comes after the body it is pinned to."""
    springs: tuple[Spring, ...] = ()
    """Suspension springs and dampers."""
    tires: Annotated[tuple[Tire, ...], Field(min_length=1)]
    """Tires, an axle each, from the front to the rear."""

    @classmethod
    def from_toml(cls, path: str | os.PathLike[str]) -> Vehicle:
        """Read a vehicle file: what the table `vehicle` of a scenario file has, on its own.

        That is a `preset` with its options, or `units`, or `bodies`, `springs` and `tires`::

            name = "my lorry"
            [[units]]
            name = "lorry"
            mass = 9000.0
            x = 2.3
            pitch_inertia = 25000.0
            [[units.groups]]
            x = 0.0
            axle_mass = 700.0
            suspension = { stiffness = 8e5, damping = 2e4 }
            tires = { stiffness = 9e5, damping = 1e3 }
            [[units.groups]]
            x = 4.4
            axles = 2
            spacing = 1.3
            equalization = "walking-beam"
            axle_mass = 1000.0
            suspension = { stiffness = 2e6, damping = 5e4 }
            tires = { stiffness = 9e5, damping = 1e3, dual = true }

        Raises
        ------
        FormatError
            If the file is not TOML or holds wrong values: one line for each, with its key.
        OSError
            If the file cannot be read.
        """
        from pavefem.vehicles import VehicleTable  # which makes vehicles

        data = read_toml(path)
        with told_of(path, "vehicle"):
            return TypeAdapter(VehicleTable).validate_python(data)

    @model_validator(mode="after")
    def _check(self) -> Self:
        places = [tire.x for tire in self.tires]
        if places != sorted(set(places)):
            raise ValueError(f"tires stand at {places} m: each must be behind the one before it")
        _ = self.core  # builds the matrices and solves the static loads, or says what is wrong
        return self

    @cached_property
    def core(self) -> _core.Vehicle:
        """The vehicle as the solver has it."""
        numbers = {body.name: number for number, body in enumerate(self.bodies)}
        if len(numbers) < len(self.bodies):
            raise ValueError(f"two bodies share a name: {[body.name for body in self.bodies]}")

        def number(name: str, user: str) -> int:
            if name not in numbers:
                raise ValueError(f"{user} names no body: {name!r} is none of {list(numbers)}")
            return numbers[name]

        bodies = [
            (body.mass, body.pitch_inertia, body.x, math.nan, math.nan)
            if body.pinned_to is None or body.pin is None
            else (
                body.mass,
                body.pitch_inertia,
                body.x,
                number(body.pinned_to, f"pinned_to of body {body.name!r}"),
                body.pin,
            )
            for body in self.bodies
        ]
        springs, ends = [], []
        for i, spring in enumerate(self.springs):
            places = [x for _, x in spring.lower_ends]
            friction = spring.friction
            springs.append(
                (
                    number(spring.upper, f"upper end of spring {i}"),
                    sum(places) / len(places),
                    spring.stiffness,
                    spring.damping,
                    math.nan if friction is None else friction.force,
                    math.nan if friction is None else friction.travel,
                )
            )
            for body, x in spring.lower_ends:
                ends.append((i, number(body, f"lower end of spring {i}"), x))
        tires = [
            (
                number(tire.body, f"body of tire {i}"),
                tire.x,
                tire.print_length,
                tire.stiffness,
                tire.damping,
            )
            for i, tire in enumerate(self.tires)
        ]
        try:
            return _core.Vehicle(
                np.array(bodies, dtype=np.float64).reshape(-1, 5),
                np.array(springs, dtype=np.float64).reshape(-1, 6),
                np.array(ends, dtype=np.float64).reshape(-1, 3),
                np.array(tires, dtype=np.float64).reshape(-1, 5),
            )
        except ValueError as error:
            # The core counts bodies and tires; their names say more.
            found = re.match(r"(body|tire) (\d+): ", str(error))
            if found is None:
                raise
            kind, i = found[1], int(found[2])
            name = self.bodies[i].name if kind == "body" else self.tires[i].body
            verb = "is" if kind == "body" else "carries"
            raise ValueError(f"{error}; {kind} {i} {verb} {name!r}") from None

    @property
    def made_by(self) -> Call | None:
        """The call that made it, if a function of `pavefem.vehicles` or a `vehicles.builder` did.

        It is no part of the vehicle: copies, files and other processes do not have it.
        """
        return self.__dict__.get("_made_by")

    def remember(self, call: Call) -> None:
        """Take note of the call that made it, once it is made."""
        self.__dict__["_made_by"] = call

    def __repr__(self) -> str:
        return (
            f"Vehicle({self.name!r}, {self.total_mass / 1e3:.1f} t, {len(self.tires)} axles, "
            f"{len(self.unknowns)} degrees of freedom)"
        )

    __str__ = __repr__

    @property
    def axle_positions(self) -> NDArray[np.float64]:
        """Places of the axles, m behind the front axle, shape (axles,)."""
        return np.array([tire.x for tire in self.tires])

    @property
    def length(self) -> float:
        """Distance from the first to the last axle, m."""
        return self.tires[-1].x - self.tires[0].x

    @property
    def total_mass(self) -> float:
        """Mass of all bodies, kg."""
        return sum(body.mass for body in self.bodies)

    @property
    def static_loads(self) -> NDArray[np.float64]:
        """Static load of each axle, N, solved from weights and springs, shape (axles,)."""
        return self.core.static_loads

    @property
    def unknowns(self) -> list[str]:
        """Names of the degrees of freedom, in the order of the matrices."""
        names = []
        for body in self.bodies:
            if body.pinned_to is None:
                names.append(f"{body.name} bounce")
            if body.pitch_inertia > 0.0:
                names.append(f"{body.name} pitch")
        return names

    @property
    def mass_matrix(self) -> NDArray[np.float64]:
        """Mass matrix M, kg (and kg m, kg m² where pitch takes part), shape (n, n)."""
        return self.core.mass

    @property
    def damping_matrix(self) -> NDArray[np.float64]:
        """Damping matrix C, N s/m, the road held still, shape (n, n)."""
        return self.core.damping

    @property
    def stiffness_matrix(self) -> NDArray[np.float64]:
        """Stiffness matrix K, N/m, the road held still, shape (n, n)."""
        return self.core.stiffness

    def natural_frequencies(self) -> NDArray[np.float64]:
        """Undamped natural frequencies, Hz, ascending, shape (n,)."""
        return self._natural_frequencies.copy()

    def modes(self) -> xr.Dataset:
        """Modes of the damped vehicle, the road held still.

        Eigenvalues s of ``(M s² + C s + K) u = 0``: one of each complex pair, and every real one,
        which belongs to a motion that dies away without swinging. Dry friction is left out.

        Returns
        -------
        xarray.Dataset
            Of (mode), ascending: `frequency` |s| / 2 pi, Hz; `damping_ratio` -Re s / |s|, 1
            where s is real; `mover`, the unknown with most of the kinetic energy.
            Of (mode, unknown): `shape`, complex, m and rad, with its largest entry 1; and
            `kinetic_share`, the part of the kinetic energy, which may be below 0 where a body
            is pinned to one that moves against it.

        Examples
        --------
        >>> from pavefem.vehicles import tandem_truck
        >>> modes = tandem_truck().modes()
        >>> modes["frequency"].to_numpy()[:4].round(2)
        array([2.09, 2.13, 7.08, 8.87])
        """
        mass, n = self.mass_matrix, len(self.unknowns)
        inverse = np.linalg.inv(mass)
        state = np.block(
            [
                [np.zeros((n, n)), np.eye(n)],
                [-inverse @ self.stiffness_matrix, -inverse @ self.damping_matrix],
            ]
        )
        values, vectors = np.linalg.eig(state)
        order = np.argsort(np.abs(values), kind="stable")
        order = order[values[order].imag >= 0.0]
        values, shapes = values[order], vectors[:n, order].T
        largest = np.abs(shapes).argmax(axis=1, keepdims=True)
        shapes = shapes / np.take_along_axis(shapes, largest, axis=1)
        energies = (shapes.conj() * (shapes @ mass)).real
        shares = energies / energies.sum(axis=1, keepdims=True)
        names = np.array(self.unknowns)
        return xr.Dataset(
            {
                "frequency": (
                    "mode",
                    np.abs(values) / (2.0 * np.pi),
                    {"units": "Hz", "long_name": "frequency of a mode"},
                ),
                "damping_ratio": (
                    "mode",
                    -values.real / np.abs(values),
                    {"units": "1", "long_name": "damping ratio"},
                ),
                "mover": ("mode", names[shares.argmax(axis=1)]),
                "shape": (("mode", "unknown"), shapes.astype(np.complex128)),
                "kinetic_share": (
                    ("mode", "unknown"),
                    shares,
                    {"units": "1", "long_name": "part of the kinetic energy"},
                ),
            },
            coords={"mode": np.arange(1, values.size + 1), "unknown": names},
        )

    def plot(self) -> Figure:
        """Draw a side view with the static axle loads; see `plotting.plot_vehicle`."""
        from pavefem import plotting  # matplotlib takes half a second to import

        return plotting.plot_vehicle(self)

    @cached_property
    def _natural_frequencies(self) -> NDArray[np.float64]:
        from scipy.linalg import eigh  # scipy takes a while to import

        squares = eigh(self.stiffness_matrix, self.mass_matrix, eigvals_only=True)
        return np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)
