"""Ready-made vehicles, and vehicles from units or from measured axles.

All are `Vehicle` objects; `PRESETS` has those that a file or a command can name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, Final

from pydantic import BeforeValidator

from pavefem._tables import make
from pavefem.units import from_units
from pavefem.vehicle import Vehicle
from pavefem.vehicles.builder import builder
from pavefem.vehicles.paper import tandem_truck
from pavefem.vehicles.presets import (
    b_double,
    quarter_car,
    rigid_truck,
    semitrailer,
    tridem_semitrailer,
)
from pavefem.vehicles.records import from_axles

__all__ = [
    "PRESETS",
    "b_double",
    "builder",
    "from_axles",
    "from_units",
    "named",
    "quarter_car",
    "rigid_truck",
    "semitrailer",
    "tandem_truck",
    "tridem_semitrailer",
]

PRESETS: Final[Mapping[str, Callable[..., Vehicle]]] = {
    "quarter_car": quarter_car,
    "rigid_truck": rigid_truck,
    "tandem_truck": tandem_truck,
    "semitrailer": semitrailer,
    "tridem_semitrailer": tridem_semitrailer,
    "b_double": b_double,
}
"""Ready-made vehicles by name."""


def named(name: str, **options: Any) -> Vehicle:
    """Build a ready-made vehicle by its name.

    Parameters
    ----------
    name : str
        One of `PRESETS`.
    **options
        What the preset takes.

    Raises
    ------
    ValueError
        If there is no such preset, or it has no such option or value.

    Examples
    --------
    >>> named("rigid_truck", suspension="air", payload=6000.0)
    Vehicle('2-axle truck on air', 13.0 t, 2 axles, 4 degrees of freedom)
    """
    return make("preset", PRESETS, {"preset": name, **options})


def _from_table(table: Any) -> Any:
    """Build the vehicle of a table that names a preset or has units; leave others to the model."""
    if isinstance(table, Mapping) and "preset" in table:
        return make("preset", PRESETS, dict(table))
    if isinstance(table, Mapping) and "units" in table:
        return from_units(**table)
    return table


VehicleTable = Annotated[Vehicle, BeforeValidator(_from_table)]
"""A vehicle as a file has it: a ``preset`` with options, ``units``, or ``bodies``, ``springs`` and
``tires``."""

TABLE_KEYS: Final = frozenset({"preset", "units", "bodies"})
"""Keys of which such a table has one, and a scenario file none."""
