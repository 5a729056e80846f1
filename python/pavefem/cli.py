"""The command line: ``pavefem run``."""

from __future__ import annotations

import os
import tempfile
import warnings
from pathlib import Path
from typing import Annotated, Any, TextIO

import typer
from pydantic import ValidationError
from rich.console import Console
from rich.table import Table
from rich.text import Text

import pavefem
from pavefem import vehicles
from pavefem.errors import PavefemError
from pavefem.formats import PROFILE_READERS, read_profile
from pavefem.profile import Profile
from pavefem.result import Result
from pavefem.scenario import Scenario, explain
from pavefem.scheme import Scheme
from pavefem.simulate import run as run_scenario

DEFAULT_RUN_IN = 50.0
"""Run-in on the built-in profile, m."""

app = typer.Typer(
    help="""What heavy vehicles on rough roads do to pavements.

Units are SI unless an option says otherwise: lengths in m, masses in kg, times in s; speeds are in
km/h, temperatures in °C and voids (VMA) in percent. Deflections are up positive in files, and
printed in mm.""",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
console = Console()
errors = Console(stderr=True)


def _version(show: bool) -> None:
    if show:
        console.print(f"pavefem {pavefem.__version__}", highlight=False)
        raise typer.Exit


@app.callback()
def main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Take the options that stand before a command."""


@app.command()
def run(
    scenario: Annotated[
        Path | None,
        typer.Argument(help="Scenario file, TOML; without one, the default run.", metavar="FILE"),
    ] = None,
    profile: Annotated[
        Path | None,
        typer.Option(help=f"Profile: station and elevation, {', '.join(PROFILE_READERS)}."),
    ] = None,
    speed: Annotated[float | None, typer.Option(help="Speed, km/h.  [default: 65]")] = None,
    temperature: Annotated[
        float | None, typer.Option(help="Asphalt temperature, °C.  [default: 20]")
    ] = None,
    vma: Annotated[
        float | None, typer.Option(help="Voids in the mineral aggregate, %.  [default: 25]")
    ] = None,
    axle_spacing: Annotated[
        float | None, typer.Option(help="Spacing of the truck's tandem, m.  [default: 1.3]")
    ] = None,
    payload: Annotated[
        float | None, typer.Option(help="Payload of the truck, kg.  [default: 12400]")
    ] = None,
    run_in: Annotated[
        float | None,
        typer.Option(
            help="Length of profile ahead of the road over which the vehicle settles, m.  "
            "[default: 50 on the built-in profile, else 0]"
        ),
    ] = None,
    smooth: Annotated[
        bool, typer.Option("--smooth", help="A smooth road: constant static forces.")
    ] = False,
    scheme: Annotated[
        str | None, typer.Option(help='"paper" or "converged".  [default: paper]')
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for result.nc and the pictures.")] = Path("out"),
    cache: Annotated[
        bool, typer.Option(help="Keep transition matrices between runs, in memory and on disk.")
    ] = True,
) -> None:
    """Run one truck over one road: print a summary, write result.nc and pictures.

    Without options: the paper's 20 t tandem truck at 65 km/h and 20 °C over 25 m of pavement, on a
    built-in rough profile (ISO 8608 class B, seed 1). Options change the scenario file's values.
    """
    changes = {
        "speed_kmh": speed,
        "temperature_c": temperature,
        "run_in": run_in,
        "scheme": scheme,
    }
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _print_warning
            inputs = _scenario(
                scenario,
                {key: value for key, value in changes.items() if value is not None},
                profile=profile,
                smooth=smooth,
                vma=vma,
                truck={
                    key: value
                    for key, value in {"axle_spacing": axle_spacing, "payload": payload}.items()
                    if value is not None
                },
            )
            _check_writable(out)
            result = run_scenario(inputs, cache=cache, progress=True)
            _report(result, out)
    except ValidationError as error:
        for line in explain(error):
            _print_error(line)
        raise typer.Exit(2) from None
    except (PavefemError, ValueError, OSError) as error:
        _print_error(str(error))
        raise typer.Exit(2) from None
    except MemoryError:
        _print_error("no memory for this run: use a shorter road or a longer time step")
        raise typer.Exit(2) from None
    except KeyboardInterrupt:
        _print_error("stopped")
        raise typer.Exit(130) from None


def _scenario(
    path: Path | None,
    changes: dict[str, Any],
    *,
    profile: Path | None,
    smooth: bool,
    vma: float | None,
    truck: dict[str, Any],
) -> Scenario:
    """Take the scenario file, or the default run, with the options' changes."""
    if smooth and profile is not None:
        raise ValueError("--smooth and --profile exclude each other")
    base = Scenario() if path is None else Scenario.from_toml(path)
    if profile is not None:
        changes["profile"] = read_profile(profile)
    elif smooth:
        changes["profile"] = None
        changes.setdefault("run_in", 0.0)
    elif path is None:
        changes["profile"] = Profile.iso8608("B", length=100.0, seed=1)
        changes.setdefault("run_in", DEFAULT_RUN_IN)
    if truck:
        if path is not None and base.vehicle != vehicles.tandem_truck():
            raise ValueError(
                "--axle-spacing and --payload change the built-in tandem truck, "
                f"but {path} has a vehicle of its own"
            )
        changes["vehicle"] = vehicles.tandem_truck(**truck)
    if "scheme" in changes:
        changes["scheme"] = Scheme.named(changes["scheme"])
    if vma is not None:
        changes["road"] = base.road.with_asphalt(vma=vma)
    fields = {name: getattr(base, name) for name in Scenario.model_fields}
    return Scenario(**(fields | changes))


def _check_writable(out: Path) -> None:
    """Make the folder and try it before any work is done."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out):
            pass
    except OSError as error:
        raise OSError(f"cannot write to the folder {out}: {error.strerror or error}") from None


def _report(result: Result, out: Path) -> None:
    """Write the result, print the summary and, last, draw the pictures."""
    result.to_netcdf(out / "result.nc")
    table = Table(title="pavefem run", show_header=False, title_justify="left")
    for name, value in result.summary().items():
        table.add_row(name, Text(value))
    console.print(table)
    from pavefem import plotting  # matplotlib takes half a second to import

    pictures = {"response.png": result.plot()}
    scenario = result.scenario
    if scenario.profile is not None:
        start = float(scenario.profile.x[0]) + scenario.run_in
        road = (start, start + scenario.road.length)
        pictures["profile.png"] = plotting.plot_profile(scenario.profile, road)
    for name, figure in pictures.items():
        figure.savefig(out / name, dpi=150)
    names = ", ".join(["result.nc", *pictures])
    console.print(f"wrote {names} in {out}{os.sep}", highlight=False, soft_wrap=True)


def _print_error(message: str) -> None:
    errors.print(f"error: {message}", style="red", highlight=False, markup=False, soft_wrap=True)


def _print_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    errors.print(
        f"warning: {message}", style="yellow", highlight=False, markup=False, soft_wrap=True
    )
