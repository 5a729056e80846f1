"""How the road is discretised in space and time."""

from __future__ import annotations

from typing import Any, Literal, Self

from pavefem._model import Model, Positive
from pavefem.road import Foundation


class Scheme(Model):
    """Mesh, foundation, nodal weights and time stepping of a run.

    `Scheme.paper` is the published scheme; `Scheme.converged` is the one to trust: with a bed in
    place of bars and weights that are consistent with the elements, deflections no longer depend
    on where an axle stands between two nodes. The fields default to the paper's.
    """

    foundation: Foundation = "bars"
    """A bar under every node, as printed, or a continuous Winkler bed with consistent matrices."""
    element_length: Positive = 0.5
    """Longest element, m."""
    weights: Literal["linear", "hermite"] = "linear"
    """Shares of an axle force on the nodes beside it: by distance (Fig. 6), or by the element's
    shape functions, moments included."""
    hold: Literal["zero", "first"] = "zero"
    """Nodal forces within a step: as at its beginning (first order in dt), or linear in time
    (second order)."""
    dt: Positive = 1e-3
    """Time step, s."""
    solver: Literal["dense", "window"] = "dense"
    """The whole road by its transition matrix, exact in time for such nodal forces, up to some
    500 m; or a window that moves with the vehicle, by a two-stage method of second order, for any
    length."""

    @classmethod
    def paper(cls, **changes: Any) -> Self:
        """Build the published scheme: 0.5 m bars, linear weights, zero-order hold, 1 ms."""
        return cls(**changes)

    @classmethod
    def converged(cls, **changes: Any) -> Self:
        """Build the converged scheme: a Winkler bed, 0.125 m, Hermite weights, second order.

        By the moving window, on a road of any length.
        """
        fields = {"foundation": "winkler", "element_length": 0.125, "solver": "window"} | changes
        return cls(**{"weights": "hermite", "hold": "first"} | fields)

    @classmethod
    def named(cls, name: str) -> Self:
        """Build a preset by its name, ``"paper"`` or ``"converged"``."""
        presets = {"paper": cls.paper, "converged": cls.converged}
        if not isinstance(name, str) or name not in presets:
            raise ValueError(f"scheme = {name!r}: must be one of {list(presets)} or a Scheme")
        return presets[name]()
