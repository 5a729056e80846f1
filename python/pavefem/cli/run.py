"""``pavefem run``: one truck over one road."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from pavefem import vehicles
from pavefem._files import check_writable
from pavefem.cli.profiles import read, with_reader_options
from pavefem.cli.terminal import console, print_figures, reporting
from pavefem.formats import PROFILE_READERS
from pavefem.profile import Profile
from pavefem.result import Result
from pavefem.scenario import Scenario
from pavefem.scheme import Scheme
from pavefem.simulate import HISTORIES, Keep
from pavefem.simulate import run as run_scenario
from pavefem.vehicle import Vehicle

RUN_IN: Final = 50.0
"""Length of profile over which the vehicle settles where it is not said, m, if there is as much."""


@reporting()
@with_reader_options
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
    vehicle: Annotated[
        str | None,
        typer.Option(
            help=f"A ready-made vehicle, one of {', '.join(vehicles.PRESETS)}, or a vehicle file, "
            "TOML.  [default: tandem_truck]",
            metavar="NAME|FILE",
        ),
    ] = None,
    suspension: Annotated[
        str | None,
        typer.Option(help='"steel" or "air", of a ready-made vehicle that has both.'),
    ] = None,
    axle_spacing: Annotated[
        float | None,
        typer.Option(help="Spacing of the tandem of tandem_truck, m.  [default: 1.3]"),
    ] = None,
    payload: Annotated[
        float | None,
        typer.Option(help="Payload of a ready-made vehicle, kg.  [default: its own]"),
    ] = None,
    run_in: Annotated[
        float | None,
        typer.Option(
            help="Length of profile ahead of the road over which the vehicle settles, m.  "
            "[default: up to 50, as the profile is longer than the road]"
        ),
    ] = None,
    length: Annotated[
        float | None, typer.Option(help="Length of a road of one section, m.  [default: 25]")
    ] = None,
    lift_off: Annotated[
        bool, typer.Option("--lift-off", help="Let tires leave the road where they would pull.")
    ] = False,
    coupling: Annotated[
        str | None,
        typer.Option(
            help='"two-way" lets tires feel the deflection under them; for --scheme converged.  '
            "[default: one-way]"
        ),
    ] = None,
    smooth: Annotated[
        bool, typer.Option("--smooth", help="A smooth road: constant static forces.")
    ] = False,
    scheme: Annotated[
        str | None, typer.Option(help='"paper" or "converged".  [default: paper]')
    ] = None,
    envelope: Annotated[
        bool,
        typer.Option("--envelope", help="Keep no histories: for roads of many kilometres."),
    ] = False,
    animate: Annotated[
        bool,
        typer.Option("--animate", help="Draw a film of the run, too; it takes some 10 s."),
    ] = False,
    store: Annotated[
        Path | None,
        typer.Option(
            help="Zarr store, written as the run goes, in place of --out: for roads of any length. "
            "The same command again goes on where one was stopped."
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for result.nc and the pictures.")] = Path("out"),
    cache: Annotated[
        bool, typer.Option(help="Keep transition matrices between runs, in memory and on disk.")
    ] = True,
    *,
    reader: dict[str, Any],
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
        "lift_off": lift_off or None,
        "coupling": coupling,
    }
    options = {"suspension": suspension, "axle_spacing": axle_spacing, "payload": payload}
    inputs = _scenario(
        scenario,
        {key: value for key, value in changes.items() if value is not None},
        profile=profile,
        reader=reader,
        smooth=smooth,
        length=length,
        vma=vma,
        vehicle=vehicle,
        options={key: value for key, value in options.items() if value is not None},
    )
    if envelope and animate:
        raise ValueError("--animate needs the histories that --envelope leaves out")
    if store is not None:
        if animate:
            raise ValueError("--animate needs the histories of all nodes, which --store leaves out")
        kept: Keep = "envelope" if envelope else ("tire_force",)
        result = run_scenario(inputs, keep=kept, progress=True, store=store)
        print_figures("pavefem run", result.summary())
        console.print(f"wrote {store}", highlight=False, soft_wrap=True)
        return
    check_writable(out)
    keep: Keep = "envelope" if envelope else HISTORIES
    result = run_scenario(inputs, keep=keep, cache=cache, progress=True)
    _report(result, out, animate)


def _scenario(
    path: Path | None,
    changes: dict[str, Any],
    *,
    profile: Path | None,
    reader: dict[str, Any],
    smooth: bool,
    length: float | None,
    vma: float | None,
    vehicle: str | None,
    options: dict[str, Any],
) -> Scenario:
    """Take the scenario file, or the default run, with the options' changes."""
    if smooth and profile is not None:
        raise ValueError("--smooth and --profile exclude each other")
    if reader and profile is None:
        raise ValueError(f"{_flags(reader)}: for the file of --profile, and none is given")
    base = Scenario() if path is None else Scenario.from_toml(path)
    road = base.road
    if length is not None:
        if len(road.sections) > 1:
            raise ValueError(f"--length is for a road of one section, {path} has several")
        road = road.model_copy(update={"sections": ((road.sections[0].pavement, length),)})
    changes["road"] = road if vma is None else road.with_asphalt(vma=vma)
    if profile is not None:
        changes["profile"] = read(profile, reader)
    elif smooth:
        changes["profile"] = None
        changes.setdefault("run_in", 0.0)
    elif path is None:
        length = max(100.0, RUN_IN + road.length)
        changes["profile"] = Profile.iso8608("B", length=length, seed=1)
    if path is None and isinstance(changes.get("profile"), Profile):
        rest = changes["profile"].length - road.length
        changes.setdefault("run_in", min(RUN_IN, max(0.0, rest)))
    if vehicle is not None:
        changes["vehicle"] = _named_or_read(vehicle, options)
    elif options:
        if base.vehicle != vehicles.tandem_truck():
            raise ValueError(
                f"{_flags(options)}: {path} has a vehicle of its own; name one with --vehicle"
            )
        changes["vehicle"] = vehicles.named("tandem_truck", **options)
    if "scheme" in changes:
        changes["scheme"] = Scheme.named(changes["scheme"])
    fields = {name: getattr(base, name) for name in Scenario.model_fields}
    return Scenario(**(fields | changes))


def _named_or_read(vehicle: str, options: dict[str, Any]) -> Vehicle:
    """Build a ready-made vehicle, or read one that is complete."""
    if vehicle in vehicles.PRESETS:
        return vehicles.named(vehicle, **options)
    if not Path(vehicle).exists():
        raise ValueError(
            f"--vehicle {vehicle}: neither a file nor one of {', '.join(vehicles.PRESETS)}"
        )
    if options:
        raise ValueError(f"{_flags(options)}: for ready-made vehicles only; {vehicle} is a file")
    return Vehicle.from_toml(vehicle)


def _flags(options: dict[str, Any]) -> str:
    return " and ".join(f"--{name.replace('_', '-')}" for name in options)


def _report(result: Result, out: Path, animate: bool) -> None:
    """Write the result, print the summary and, last, draw the pictures."""
    result.to_netcdf(out / "result.nc")
    print_figures("pavefem run", result.summary())
    from pavefem import plotting  # matplotlib takes half a second to import

    pictures = {"response.png": result.plot()}
    scenario = result.scenario
    if scenario.profile is not None:
        start = float(scenario.profile.x[0]) + scenario.run_in
        road = (start, start + scenario.road.length)
        pictures["profile.png"] = plotting.plot_profile(scenario.profile, road)
    for name, figure in pictures.items():
        figure.savefig(out / name, dpi=150)
    names = ["result.nc", *pictures]
    if animate:
        result.animate(out / "animation.gif", progress=True)
        names.append("animation.gif")
    console.print(f"wrote {', '.join(names)} in {out}{os.sep}", highlight=False, soft_wrap=True)
