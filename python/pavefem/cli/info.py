"""``pavefem info``: what is in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Final

import typer

from pavefem import roughness, vehicles
from pavefem._tables import read_toml
from pavefem.cli.profiles import read, with_reader_options
from pavefem.cli.terminal import each_file, print_figures, reporting
from pavefem.errors import FormatError
from pavefem.formats import PROFILE_READERS
from pavefem.profile import Profile
from pavefem.result import load_result
from pavefem.scenario import Scenario
from pavefem.store import is_store
from pavefem.traffic_result import is_of_traffic, load_traffic_result
from pavefem.traffic_scenario import TrafficScenario
from pavefem.traffic_store import is_traffic_store
from pavefem.vehicle import Vehicle

OTHERS: Final = "vehicles and scenarios (.toml) and results (.nc, .zarr)"
"""What is summed up beside profiles."""


@reporting()
@with_reader_options
def info(
    files: Annotated[
        list[Path],
        typer.Argument(
            help=f"Profiles ({', '.join(PROFILE_READERS)}), {OTHERS}.",
            metavar="FILE",
            readable=False,
        ),
    ],
    *,
    reader: dict[str, Any],
) -> None:
    """Print what is in files, and what was understood of them.

    Of a profile: stations, tracks, units, IRI, ISO 8608 class. Of a vehicle: axle loads and modes.
    Of a scenario, its inputs; of a result, its largest deflection and forces. The options are those
    for profiles. A file that cannot be used is reported and loses none of the others; the exit code
    is then 2.
    """
    found, failed = each_file(files, lambda path: _summary(path, reader))
    for kind, path, figures in found:
        print_figures(f"{path}: {kind}", figures)
    if failed:
        raise typer.Exit(2)


def _summary(path: Path, reader: dict[str, Any]) -> tuple[str, Path, dict[str, str]]:
    """Return what kind of file it is, and its figures."""
    suffix = path.suffix.lower()
    if is_traffic_store(path) or is_of_traffic(path):
        return "result of traffic", path, load_traffic_result(path).summary()
    if suffix == ".nc" or is_store(path):
        return "result", path, load_result(path).summary()
    if suffix == ".toml":
        keys = read_toml(path).keys()
        if vehicles.TABLE_KEYS & keys:
            return "vehicle", path, _of_vehicle(Vehicle.from_toml(path))
        if "traffic" in keys:
            return "scenario of traffic", path, _of_traffic(TrafficScenario.from_toml(path))
        return "scenario", path, _of_scenario(Scenario.from_toml(path))
    try:
        profile = read(path, reader)
    except FormatError as error:
        if suffix in PROFILE_READERS or not path.is_file():
            raise
        raise FormatError(f"{error.message}; info also takes {OTHERS}", path=path) from None
    return "profile", path, profile.summary() | _of_roughness(profile)


def _of_roughness(profile: Profile) -> dict[str, str]:
    """Roughness as far as the profile has it: a short or coarse one may have none."""
    figures = {}
    try:
        index = roughness.iri(profile)
        values = zip(profile.by_track, index.to_numpy().ravel(), strict=True)
        figures["IRI"] = ", ".join(f"{name} {value:.2f} m/km".strip() for name, value in values)
        if roughness.wheel_tracks(profile):
            figures["MRI"] = f"{float(roughness.wheel_mean(profile, index)):.2f} m/km"
    except ValueError as error:
        figures["IRI"] = f"none: {error}"
    try:
        found = roughness.iso8608_class(profile)
        first = next((f", of track {name}" for name in profile.tracks), "")
        figures["ISO 8608 class"] = (
            f"{found.road_class}, G_d(n0) = {found.gd_n0:.3g} m³, "
            f"waviness {found.waviness:.2f}{first}"
        )
    except ValueError as error:
        figures["ISO 8608 class"] = f"none: {error}"
    return figures


def _of_vehicle(vehicle: Vehicle) -> dict[str, str]:
    """Axle loads, and modes with their damping ratio and what moves most in them."""
    modes = vehicle.modes()
    columns = (modes[name].to_numpy() for name in ("frequency", "damping_ratio", "mover"))
    return _of_axles(vehicle) | {
        f"mode {number}": f"{frequency:.2f} Hz, damping {100.0 * damping:.0f} %, {mover}"
        for number, (frequency, damping, mover) in enumerate(zip(*columns, strict=True), start=1)
    }


def _of_axles(vehicle: Vehicle) -> dict[str, str]:
    axles = zip(vehicle.axle_positions, vehicle.static_loads, strict=True)
    return {
        "vehicle": f"{vehicle.name}, {vehicle.total_mass / 1e3:.2f} t",
        **{
            f"axle {number}": f"at {place:.5g} m, static load {load / 1e3:.2f} kN"
            for number, (place, load) in enumerate(axles, start=1)
        },
    }


def _of_scenario(scenario: Scenario) -> dict[str, str]:
    profile = scenario.profile
    return {
        "speed": f"{scenario.speed_kmh:g} km/h",
        "temperature": f"{scenario.temperature_c:g} °C",
        "road": f"{scenario.road.length:g} m",
        "profile": (
            "none: a smooth road"
            if profile is None
            else f"{profile.name}, {profile.length:g} m, run-in {scenario.run_in:g} m"
        ),
        "scheme": f"{scenario.scheme}",
        **_of_axles(scenario.vehicle),
    }


def _of_traffic(scenario: TrafficScenario) -> dict[str, str]:
    profiles = {profile.name for profile in scenario.profiles if profile is not None}
    return {
        "temperature": f"{scenario.temperature_c:g} °C",
        "road": f"{scenario.road.length:g} m",
        "profiles": ", ".join(sorted(profiles)) or "none: a smooth road",
        "scheme": f"{scenario.scheme}",
        **scenario.traffic.summary(),
    }
