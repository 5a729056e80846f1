"""How the road is discretised in space and time."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from pavefem._model import Model, NotNegative, Positive
from pavefem.road import Foundation


class Scheme(Model):
    """Mesh, foundation, nodal weights and time stepping of a run.

    `Scheme.paper` is the published scheme; `Scheme.converged` is the one to trust: with a bed in
    place of bars and weights that are consistent with the elements, deflections no longer depend
    on where an axle stands between two nodes. The fields default to the paper's.
    """

    foundation: Foundation = "bars"
    """A bar under every node, as printed, or a continuous Winkler bed with consistent matrices."""
    element_length: Positive | None = 0.5
    """Longest element, m; None is chosen from the decay length (`Road.element_length`)."""
    weights: Literal["linear", "hermite"] = "linear"
    """Shares of an axle force on the nodes beside it: by distance (Fig. 6), or by the element's
    shape functions, moments included."""
    tire_print: Annotated[NotNegative, Field(le=10)] = 0.0
    """Length of road over which an axle force is evenly spread, m; 0 is a point. (The paper's
    loading time is that of a print of 0.3 m.)"""
    hold: Literal["zero", "first"] = "zero"
    """Nodal forces within a step: as at its beginning (first order in dt), or linear in time
    (second order)."""
    dt: Positive = 1e-3
    """Time step, s."""
    solver: Literal["dense", "banded", "window"] = "dense"
    """The whole road by its transition matrix, exact in time for such nodal forces, up to some
    500 m; or a window that moves with the vehicle, on a road of any length: by a band of that
    matrix, as exact, or by a two-stage method of second order, some times faster."""
    order: Literal[2, 3] = 2
    """Order in dt of the window: 3, at three times the work, is extrapolated from steps of dt and
    dt / 2, for runs that verify others."""

    @model_validator(mode="after")
    def _order_is_of_the_window(self) -> Self:
        if self.order == 3 and (self.solver, self.hold) != ("window", "first"):
            raise ValueError('order = 3: needs solver="window" and hold="first"')
        return self

    @classmethod
    def paper(cls, **changes: Any) -> Self:
        """Build the published scheme: 0.5 m bars, linear weights, zero-order hold, 1 ms."""
        return cls(**changes)

    @classmethod
    def converged(cls, **changes: Any) -> Self:
        """Build the converged scheme: a Winkler bed, Hermite weights, second order.

        Elements follow from the decay length. By the moving window, on a road of any length.
        """
        fields = {"foundation": "winkler", "element_length": None, "solver": "window"} | changes
        return cls(**{"weights": "hermite", "hold": "first"} | fields)

    @classmethod
    def named(cls, name: str) -> Self:
        """Build a preset by its name, ``"paper"`` or ``"converged"``."""
        presets = {"paper": cls.paper, "converged": cls.converged}
        if not isinstance(name, str) or name not in presets:
            raise ValueError(f"scheme = {name!r}: must be one of {list(presets)} or a Scheme")
        return presets[name]()
