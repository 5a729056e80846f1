"""The paper reproduced: runs, numbers, pictures and the page."""

from __future__ import annotations

import io
import json
import os
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from pavefem._files import check_writable, replacing
from pavefem._progress import progress_bar
from pavefem.road import Road
from pavefem.simulate import simulate
from pavefem.studies.paper import printed
from pavefem.studies.paper.cases import SPEEDS, Case, remarks, run_cases
from pavefem.studies.paper.figures import Compared, Curve, PaperFigure, figures_of
from pavefem.studies.paper.numbers import (
    PRINTED,
    PRINTED_RATIOS,
    Numbers,
    TableIII,
    cases_of,
    numbers_of,
)
from pavefem.studies.paper.readings import ASSUMPTIONS, READINGS
from pavefem.studies.paper.sites import Given, Sites, sites_of
from pavefem.studies.paper.wording import ROWS, difference, in_order, percent, sensitivity
from pavefem.vehicles import tandem_truck

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE: Final = "table_iii"
"""Name of the picture of Table III."""
DPI: Final = 150


def reproduce_paper(
    reading: str = "first",
    profiles: Given = None,
    progress: bool = False,
) -> Reproduction:
    """Compute the paper's Figs. 7 to 12 and Table III, to stand beside what it prints.

    Everything is run by the paper's scheme, on its 25 m of road and under its truck, by both
    readings of what the paper leaves open; Fig. 8 by the converged scheme too. Runs go over all
    processors.

    Parameters
    ----------
    reading : {"first", "second"}
        Which reading of Table I draws the figures: the first reproduces the sensitivities to
        temperature and VMA, the second the levels of Fig. 8.
    profiles : str, os.PathLike or iterable of Profile, optional
        A folder of profiles for Figs. 9 and 10 and the roughness and speed rows, or the profiles
        themselves; of each, what the truck goes over: up to 81 m from its start, of the first
        track. By default 26 seeded ISO 8608 profiles of 1 to 8 m/km. What cannot be used is in
        `Reproduction.rejected`.
    progress : bool
        Show progress where it takes over a second.

    Returns
    -------
    Reproduction

    Raises
    ------
    ValueError
        If there is no such reading, or fewer than two profiles can be used.
    OSError
        If the folder is none or cannot be read.

    Notes
    -----
    `ValidityWarning` is not given, but kept in `Reproduction.warnings`: the paper's Fig. 11 goes
    beyond the range of its stiffness formulas.
    """
    if not isinstance(reading, str) or reading not in READINGS:
        raise ValueError(f"reading = {reading!r}: must be one of {list(READINGS)}")
    sites = sites_of(profiles)
    cases = [
        case
        for name in READINGS
        for rows in cases_of(name, len(sites.used)).values()
        for row in rows
        for case in row
    ]
    with progress_bar(progress, "runs") as report:
        answers = run_cases(cases, sites.used, report)
    return Reproduction(
        reading=reading,
        numbers={name: numbers_of(name, answers, sites.used) for name in READINGS},
        sites=sites,
        warnings=remarks(cases),
        seconds=_time_a_run(),
    )


def _time_a_run() -> dict[str, float]:
    """Time the nominal run, s: best of three with its matrices computed, and with them at hand."""
    road, truck = Road.paper(), tandem_truck()

    def best(cache: bool) -> float:
        times = []
        for _ in range(3):
            start = time.perf_counter()
            simulate(road, truck, cache=cache)
            times.append(time.perf_counter() - start)
        return min(times)

    return dict(zip(printed.SECONDS, (best(False), best(True)), strict=True))


@dataclass(frozen=True, eq=False, repr=False)
class Reproduction:
    """The paper's figures and Table III, computed.

    Attributes
    ----------
    reading : str
        Which reading draws the figures.
    numbers : mapping of str to Numbers
        Peaks, histories and sensitivities by reading.
    sites : Sites
        The profiles.
    warnings : mapping of str to list of Case
        What is outside the range of the stiffness formulas, and where.
    seconds : mapping of str to float
        How long the nominal run takes, s.
    """

    reading: str
    numbers: Mapping[str, Numbers]
    sites: Sites
    warnings: Mapping[str, list[Case]]
    seconds: Mapping[str, float]

    def __repr__(self) -> str:
        return f"Reproduction({self.reading!r}, {len(self.sites.used)} profiles)"

    @property
    def table_iii(self) -> TableIII:
        """Sensitivities of the chosen reading."""
        return self.numbers[self.reading].table

    @property
    def rejected(self) -> tuple[tuple[str, str], ...]:
        """Profiles that could not be used, and why."""
        return self.sites.rejected

    @cached_property
    def all_figures(self) -> dict[str, tuple[PaperFigure, ...]]:
        """Figures by reading."""
        return {name: figures_of(found, self.sites.used) for name, found in self.numbers.items()}

    @property
    def figures(self) -> tuple[PaperFigure, ...]:
        """Figures of the chosen reading."""
        return self.all_figures[self.reading]

    def summary(self) -> dict[str, str]:
        """Return the mean sensitivities, as text with what is printed, by what they are."""
        table = self.table_iii
        means = {
            f"S of {label}": (
                f"{sensitivity(table.means[row])} (printed {sensitivity(PRINTED.means[row])}, "
                f"{difference(table.means[row], PRINTED.means[row])})"
            )
            for row, label in ROWS.items()
        }
        return {
            "reading": self.reading,
            "profiles": self.sites.origin,
            **means,
            "order": in_order(table.order),
        }

    def plot(self, name: str) -> Figure:
        """Draw a figure, ``"fig_7"`` to ``"fig_12"``, or ``"table_iii"``.

        Raises
        ------
        ValueError
            If there is no such figure.
        """
        from pavefem.studies.paper.drawing import draw_figure, draw_table  # matplotlib

        if name == TABLE:
            return draw_table({reading: found.table for reading, found in self.numbers.items()})
        figures = {figure.name: figure for figure in self.figures}
        if name not in figures:
            raise ValueError(f"no figure {name!r}: must be one of {[*figures, TABLE]}")
        return draw_figure(figures[name])

    @cached_property
    def pictures(self) -> dict[str, bytes]:
        """All pictures as PNG, by name."""
        drawn = {}
        for name in (*(figure.name for figure in self.figures), TABLE):
            png = io.BytesIO()
            self.plot(name).savefig(png, dpi=DPI, format="png")
            drawn[name] = png.getvalue()
        return drawn

    def data(self) -> dict[str, Any]:
        """Return all numbers, as they are in the JSON file; lengths in m, sensitivities bare.

        ``table_iii`` has rows ``temperature``, ``vma``, ``roughness`` and ``speed`` by speed in
        km/h, that of speed by the speed from which to the next; ``figures`` the curves.
        """
        return {
            "pavefem_version": version("pavefem"),
            "reading": self.reading,
            "table_iii": _table(self.table_iii),
            "ratios": self.table_iii.ratios,
            "figures": {figure.name: _figure(figure) for figure in self.figures},
            "printed": {"table_iii": _table(PRINTED), "ratios": PRINTED_RATIOS},
            "readings": {name: self._of_reading(name) for name in self.numbers},
            "assumptions": [vars(assumption) for assumption in ASSUMPTIONS],
            "profiles": [
                {"name": site.name, "iri_m_per_km": site.iri, "run_in": site.run_in}
                for site in self.sites.used
            ],
            "rejected_profiles": [
                {"name": name, "reason": reason} for name, reason in self.rejected
            ],
            "warnings": [
                *self.sites.remarks,
                *(f"{text}: {', '.join(places(cases))}" for text, cases in self.warnings.items()),
            ],
            "seconds": dict(self.seconds),
        }

    def _of_reading(self, name: str) -> dict[str, Any]:
        numbers = self.numbers[name]
        error = numbers.roughness_error
        return {
            "table_iii": _table(numbers.table),
            "difference_percent": {
                row: {
                    key: percent(value, printed_row[key])
                    for key, value in _table(numbers.table)[row].items()
                }
                for row, printed_row in _table(PRINTED).items()
            },
            "ratios": numbers.table.ratios,
            "roughness_standard_error": None if error is None else by_speed(error.tolist()),
            "roughness_from_profile_to_profile": (
                None
                if numbers.roughness_of_neighbours is None
                else by_speed(numbers.roughness_of_neighbours)
            ),
            "compared": {
                figure.name: [_compared(item) for item in figure.compared]
                for figure in self.all_figures[name]
            },
        }

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Write all numbers; see `data`. An old file is replaced as a whole."""
        text = json.dumps(self.data(), indent=1, ensure_ascii=False, allow_nan=False)
        _write(path, text + "\n")

    def to_html(self, path: str | os.PathLike[str]) -> None:
        """Write the page, which has the pictures in itself; an old file is replaced as a whole."""
        from pavefem.studies.paper.page import page

        _write(path, page(self))

    def save(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write the page, the numbers and all pictures into a folder, which is made if need be.

        Returns
        -------
        list of Path
            ``paper.html``, ``paper.json``, and a PNG file for each figure and Table III.

        Raises
        ------
        OSError
            If the folder cannot be made or written.
        """
        target = Path(folder)
        check_writable(target)
        files = [target / "paper.html", target / "paper.json"]
        self.to_html(files[0])
        self.to_json(files[1])
        for name, png in self.pictures.items():
            files.append(target / f"{name}.png")
            with replacing(files[-1]) as file:
                file.write_bytes(png)
        return files


def _write(path: str | os.PathLike[str], text: str) -> None:
    with replacing(path) as file:
        file.write_text(text, encoding="utf-8", newline="\n")


def by_speed(row: Iterable[float]) -> dict[str, float]:
    """Name values by the speed, km/h, that they belong to."""
    return {f"{speed:g}": value for speed, value in zip(SPEEDS, row, strict=False)}


def _table(table: TableIII) -> dict[str, dict[str, float]]:
    return {name: {**by_speed(row), "mean": table.means[name]} for name, row in table.rows.items()}


def _figure(figure: PaperFigure) -> dict[str, Any]:
    return {
        "title": figure.title,
        "understood_as": figure.understood,
        "printed": figure.known,
        "remark": figure.remark,
        "panels": [
            {
                "title": panel.title,
                "x": panel.x_label,
                "y": f"{panel.y_label} [m]",
                "printed": list(panel.printed),
                "curves": [_curve(curve) for curve in panel.curves],
            }
            for panel in figure.panels
        ],
    }


def _curve(curve: Curve) -> dict[str, Any]:
    spread = {} if curve.spread is None else {"standard_deviation": curve.spread.tolist()}
    return {"name": curve.name, "x": curve.x.tolist(), "y": curve.y.tolist()} | spread


def _compared(item: Compared) -> dict[str, Any]:
    """Write a number with its difference, a trend with whether it is the printed one."""
    if isinstance(item.ours, str) or isinstance(item.printed, str):
        return vars(item) | {"agrees": item.ours == item.printed}
    return vars(item) | {"difference_percent": percent(item.ours, item.printed)}


def places(cases: Iterable[Case]) -> list[str]:
    """Say where cases are."""
    return [
        f"{case.reading} reading at {case.temperature_c:.3g} °C, {case.vma:g} %, "
        f"{case.speed_kmh:g} km/h"
        for case in cases
    ]
