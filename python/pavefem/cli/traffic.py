"""``pavefem traffic``: thousands of vehicles on one road."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Final

import typer
from rich.table import Table
from rich.text import Text

from pavefem._files import check_writable
from pavefem.cli.terminal import console, print_figures, reporting
from pavefem.profile import Profile
from pavefem.road import Road
from pavefem.scheme import Scheme
from pavefem.simulate_traffic import TrafficRun, hours
from pavefem.traffic import Traffic
from pavefem.traffic_result import TrafficResult
from pavefem.traffic_scenario import TrafficScenario

_LENGTH: Final = 2000.0
_DURATION: Final = 600.0


@reporting()
def traffic(
    scenario: Annotated[
        Path | None,
        typer.Argument(help="Scenario file, TOML; without one, the default run.", metavar="FILE"),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for result.nc and the pictures.")] = Path("out"),
    store: Annotated[
        Path | None,
        typer.Option(
            help="Folder in which what is done outlasts a kill. The same command again goes on "
            "where one was stopped."
        ),
    ] = None,
    threads: Annotated[
        int | None, typer.Option(help="Threads to use.  [default: all processors]")
    ] = None,
    worst: Annotated[int, typer.Option(help="How many of the worst places to print.")] = 10,
) -> None:
    """Run traffic over a road: print a summary and the worst places, write result.nc and pictures.

    Without a file: ten minutes of generated traffic on 2 km of the paper's pavement, on a built-in
    rough profile (ISO 8608 class B), in elements of 0.5 m. Ctrl-C keeps what is done: it is written
    all the same.
    """
    inputs = default_scenario() if scenario is None else TrafficScenario.from_toml(scenario)
    if worst < 1:
        raise ValueError(f"--worst {worst}: must be at least 1")
    check_writable(out)
    run = TrafficRun(inputs, threads=threads, store=store)
    try:
        run.finish(progress=True)
    except KeyboardInterrupt as stop:
        result = run.result()
        _report(result, out, worst)
        stop.add_note(f"{out}{os.sep} has what was done, {result.so_far}")
        raise
    _report(run.result(), out, worst)


def default_scenario() -> TrafficScenario:
    """Build the run without a file."""
    return TrafficScenario(
        road=Road(length=_LENGTH),
        traffic=Traffic.generate(duration=_DURATION, seed=1, length=_LENGTH),
        profile=Profile.iso8608("B", length=_LENGTH + 100.0, seed=1),
        scheme=Scheme.converged(element_length=0.5),
    )


def _report(result: TrafficResult, out: Path, worst: int) -> None:
    """Write the result, print the summary and the worst places and, last, draw the pictures."""
    result.to_netcdf(out / "result.nc")
    print_figures("pavefem traffic", result.summary())
    _print_worst(result, worst)
    pictures = {"map.png": result.plot(), "time-distance.png": result.plot_time_distance()}
    for name, figure in pictures.items():
        figure.savefig(out / name, dpi=150)
    names = ", ".join(["result.nc", *pictures])
    console.print(f"wrote {names} in {out}{os.sep}", highlight=False, soft_wrap=True)


def _print_worst(result: TrafficResult, n: int) -> None:
    places = result.worst(n)
    table = Table(title=Text("worst places"), title_justify="left")
    for name in ("", "lane", "x [m]", "deflection [mm]", "time", "axle passes", "relative damage"):
        table.add_column(Text(name), justify="right")
    names = ("rank", "lane", "x", "max_deflection", "time", "passes", "relative_damage")
    columns = [places[name].to_numpy().tolist() for name in names]
    for rank, lane, x, deflection, time, passes, damage in zip(*columns, strict=True):
        table.add_row(
            f"{rank}",
            f"{lane}",
            f"{x:.2f}",
            f"{deflection * 1e3:.3f}",
            hours(time),
            f"{passes}",
            f"{damage:.2f}",
        )
    console.print(table)
