"""A road: sections of pavement, laid end to end from x = 0."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Final, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from pavefem import _core
from pavefem._model import Model, Positive
from pavefem.analytical import WinklerBeam
from pavefem.pavement import Constants, Pavement

Foundation = Literal["bars", "winkler"]

CHOSEN_ELEMENT: Final = 0.35
"""Longest element that is chosen, in decay lengths: the peak under a moving force is within 1e-3 at
nodes, and within 2e-3 between them, most of it by the kink under the force, (0.35)³ / 24."""

FEWEST_ELEMENTS: Final = 20
"""Fewest elements of a road whose elements are chosen, if it is short beside its decay length."""


class Section(Model):
    """A length of road of one structure."""

    pavement: Pavement
    """Its structure."""
    length: Positive
    """Its length, m."""


class Road(Model):
    """Sections of pavement from x = 0, and how the two ends are held.

    Parameters
    ----------
    pavement : Pavement, optional
        The structure of a road of one section.
    length : float, optional
        Its length, m; 25 m by default, as in the paper.
    sections : sequence of (Pavement, float), optional
        Structures and lengths (m), in place of `pavement` and `length`.
    ends : {"clamped", "pinned", "free"}
        How both ends are held.

    Examples
    --------
    >>> Road(Pavement.paper(), length=25.0).length
    25.0
    """

    sections: Annotated[tuple[Section, ...], Field(min_length=1)]
    """Sections in the order of travel."""
    ends: Literal["clamped", "pinned", "free"] = "clamped"
    """How both ends are held: no displacement nor slope, no displacement, or not at all."""

    def __init__(
        self,
        pavement: Pavement | None = None,
        length: float | None = None,
        *,
        sections: Sequence[tuple[Pavement, float] | Section | dict[str, Any]] | None = None,
        **fields: Any,
    ) -> None:
        if sections is not None:
            fields["sections"] = sections
        if pavement is not None:
            fields["pavement"] = pavement
        if length is not None:
            fields["length"] = length
        super().__init__(**fields)

    @model_validator(mode="before")
    @classmethod
    def _one_section(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        data = dict(data)
        single = {key: data.pop(key) for key in ("pavement", "length") if key in data}
        if "sections" not in data:
            data["sections"] = [{"pavement": Pavement.paper(), "length": 25.0} | single]
        elif not isinstance(data["sections"], list | tuple):
            raise ValueError("sections must be a list of sections or of (pavement, length)")
        elif single:
            raise ValueError(f"give either sections or {' and '.join(single)}, not both")
        else:
            data["sections"] = [
                {"pavement": item[0], "length": item[1]}
                if isinstance(item, (tuple, list)) and len(item) == 2
                else item
                for item in data["sections"]
            ]
        return data

    @property
    def length(self) -> float:
        """Length of the road, m."""
        return sum(section.length for section in self.sections)

    def pavement_at(self, x: float) -> Pavement:
        """Structure at a place, m; between two sections, that of the one ahead."""
        ends = np.cumsum([section.length for section in self.sections[:-1]])
        return self.sections[int(np.searchsorted(ends, x, side="right"))].pavement

    @classmethod
    def paper(cls) -> Self:
        """Build the paper's road: 25 m of the pavement of Table I, both ends clamped."""
        return cls(Pavement.paper(), length=25.0)

    def with_asphalt(self, **changes: float) -> Self:
        """Build the same road with some fields of the asphalt of every section changed."""
        sections = [
            section.model_copy(
                update={
                    "pavement": section.pavement.model_copy(
                        update={"asphalt": section.pavement.asphalt.model_copy(update=changes)}
                    )
                }
            )
            for section in self.sections
        ]
        return type(self)(sections=sections, ends=self.ends)

    def table(self, temperature_c: float, speed_kmh: float) -> NDArray[np.float64]:
        """Constants of the sections.

        Parameters
        ----------
        temperature_c, speed_kmh : float
            Asphalt temperature, °C, and vehicle speed, km/h, which make the modulus.

        Returns
        -------
        ndarray, shape (sections, 7)
            Length, m, then the fields of `pavefem.pavement.Constants`.
        """
        lengths = [section.length for section in self.sections]
        return np.column_stack([lengths, self.constants_at(temperature_c, [speed_kmh])[0]])

    def constants_at(self, temperature_c: float, speed_kmh: ArrayLike) -> NDArray[np.float64]:
        """Constants of the sections under vehicles at many speeds, shape (speeds, sections, 6).

        See `Pavement.constants_at`.
        """
        # Sections of one structure are alike.
        found = {
            pavement: pavement.constants_at(temperature_c, speed_kmh)
            for pavement in {section.pavement for section in self.sections}
        }
        return np.stack([found[section.pavement] for section in self.sections], axis=1)

    def element_length(
        self, temperature_c: float, speed_kmh: float, *, table: NDArray[np.float64] | None = None
    ) -> float:
        """Length of the elements that a scheme without one is given, m.

        At most 0.35 of the shortest decay length, ``(4 EI / k)^(1/4)``, of any section, and a
        twentieth of the road; and a whole part of the spacing of the bars, or a whole multiple, so
        that nodes stand where bars would.

        Parameters
        ----------
        temperature_c, speed_kmh : float
            Asphalt temperature, °C, and vehicle speed, km/h, which make the modulus.
        table : ndarray, optional
            The constants at these (`table`), if they are at hand.
        """
        if table is None:
            table = self.table(temperature_c, speed_kmh)
        lengths = []
        for section, row in zip(self.sections, table, strict=True):
            decay = WinklerBeam.of(Constants(*row[1:])).decay
            longest = min(CHOSEN_ELEMENT / decay, self.length / FEWEST_ELEMENTS)
            spacing = section.pavement.spacing
            parts = math.ceil(spacing / longest)
            chosen = spacing / parts if parts > 1 else spacing * math.floor(longest / spacing)
            lengths.append(min(chosen, section.length))
        return min(lengths)

    def strip(
        self,
        temperature_c: float,
        speed_kmh: float,
        *,
        element_length: float | None = 0.5,
        foundation: Foundation = "bars",
    ) -> _core.Strip:
        """Mesh the road and assemble M, C, K (eqs. 1-6).

        Parameters
        ----------
        temperature_c, speed_kmh : float
            Asphalt temperature, °C, and vehicle speed, km/h.
        element_length : float, optional
            Longest element, m, None for `Road.element_length`; each section takes a whole number of
            equal elements.
        foundation : {"bars", "winkler"}
            A bar under every node, or a continuous bed with consistent matrices.

        Returns
        -------
        Strip
            With ``nodes`` (m, both ends included) and the dense matrices ``mass``, ``damping`` and
            ``stiffness`` of the unknowns (w, theta) that the ends do not hold.

        Raises
        ------
        ValueError
            If a section is shorter than an element.
        """
        sections = self.table(temperature_c, speed_kmh)
        if element_length is None:
            element_length = self.element_length(temperature_c, speed_kmh, table=sections)
        return _core.Strip(sections, element_length, foundation, self.ends)
