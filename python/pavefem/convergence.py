"""How far a run is from what finer steps and elements would answer."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pavefem.errors import ValidityWarning
from pavefem.scenario import Scenario
from pavefem.scheme import Scheme
from pavefem.simulate import run

if TYPE_CHECKING:
    from pavefem.result import Result


@dataclass(frozen=True)
class ErrorEstimate:
    """Relative errors of the largest deflection of a node, positive where it is too large.

    By Richardson: if errors fall as the p-th power of a step, and the step halved takes d from y, y
    is too large by ``d / (1 - 2^-p)``.

    Attributes
    ----------
    x : float
        Place of the node, m.
    deflection : float
        Its largest deflection, m, by a parabola between the steps.
    time, space : float
        What of it is the error of the time step, and of the mesh.
    scheme : Scheme
        The scheme of the run, with the element length it had.
    """

    x: float
    deflection: float
    time: float
    space: float
    scheme: Scheme

    @property
    def total(self) -> float:
        """Both together."""
        return self.time + self.space

    @property
    def extrapolated(self) -> float:
        """The deflection without the errors, as far as they are known, m."""
        return self.deflection * (1.0 - self.total)

    def refined(self, tolerance: float) -> Scheme:
        """Give the scheme whose errors of step and mesh should each be half of `tolerance`.

        A step or mesh that is fine enough stays as it is; elements are cut into equal parts.
        """
        if not (math.isfinite(tolerance) and tolerance > 0.0):
            raise ValueError(f"tolerance = {tolerance!r}: must be finite and above 0")
        by_time, by_space = (
            max(1.0, (2.0 * abs(error) / tolerance) ** (1.0 / order))
            for error, order in zip((self.time, self.space), _orders(self.scheme), strict=True)
        )
        assert self.scheme.element_length is not None
        parts = math.ceil(by_space - 1e-9)
        update = {
            "dt": self.scheme.dt / by_time,
            "element_length": self.scheme.element_length / parts,
        }
        return self.scheme.model_copy(update=update)


def error_estimate(result: Result, x: float | None = None) -> ErrorEstimate:
    """Run a scenario again, with steps and then elements of half the length; see `Result`."""
    scenario, node = result.scenario, _node(result, x)
    place, element_length = float(result.x[node]), _element_length(result, node)
    scheme = scenario.scheme.model_copy(update={"element_length": element_length})
    changes = [{}, {"dt": scheme.dt / 2.0}, {"element_length": element_length / 2.0}]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ValidityWarning)  # the run itself has warned
        base, by_time, by_space = (
            _peak(scenario, scheme.model_copy(update=change), place) for change in changes
        )
    if not base > 0.0:
        raise ValueError(f"x = {place:g} m: nothing deflects there")
    time, space = (
        (base - finer) / base / (1.0 - 0.5**order)
        for finer, order in zip((by_time, by_space), _orders(scheme), strict=True)
    )
    return ErrorEstimate(place, base, time, space, scheme)


def _orders(scheme: Scheme) -> tuple[int, int]:
    """Orders in dt and in the element length."""
    consistent = (scheme.foundation, scheme.weights) == ("winkler", "hermite")
    return 1 if scheme.hold == "zero" else scheme.order, 4 if consistent else 2


def _node(result: Result, x: float | None) -> int:
    if x is None:
        return int(result.lowest.argmin())
    node = int(np.abs(result.x - x).argmin())
    if not abs(result.x[node] - x) <= 1e-9 * max(1.0, abs(x)):
        raise ValueError(f"x = {x!r} m: must be a node, the nearest is at {result.x[node]:g} m")
    return node


def _element_length(result: Result, node: int) -> float:
    """Length of the elements in the section of a node: half of it keeps the node."""
    ends = np.cumsum([section.length for section in result.scenario.road.sections])
    section = int(np.searchsorted(ends, result.x[node] * (1.0 - 1e-12)))
    start, end = ends[section] - result.scenario.road.sections[section].length, ends[section]
    inside = (result.x > start + 1e-9 * end) & (result.x < end * (1.0 - 1e-9))
    return float((end - start) / (inside.sum() + 1))


def _peak(scenario: Scenario, scheme: Scheme, x: float) -> float:
    """Largest deflection at a place, m, by a parabola between the steps."""
    again = scenario.model_copy(update={"scheme": scheme})
    deflection = run(again, keep=["deflection"], stations=[x]).deflection
    assert deflection is not None
    history = -deflection[:, 0]
    top = int(history.argmax())
    if not 0 < top < history.size - 1:
        return float(history[top])
    before, at, after = history[top - 1 : top + 2]
    curvature = before - 2.0 * at + after
    return float(at - (before - after) ** 2 / (8.0 * curvature) if curvature < 0.0 else at)
