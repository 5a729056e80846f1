"""The profiles of Figs. 9 and 10: random ones, or a folder of one's own."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from pavefem.errors import FormatError
from pavefem.formats import read_profile
from pavefem.profile import Profile

COUNT: Final = 26
"""Profiles, as many as the paper's."""
SMOOTHEST: Final = 1.0
"""Lowest IRI of the random profiles, m/km."""
ROUGHEST: Final = 8.0
"""Highest, m/km."""
SPACING: Final = 0.25
"""Distance between their samples, m."""
RUN_IN: Final = 50.0
"""Length over which the truck settles ahead of the road, m, where a profile has it."""
CROSSED: Final = 25.0 + 6.0
"""Road and truck, m: what the front axle runs until the last axle leaves."""


@dataclass(frozen=True)
class Site:
    """A profile, as far as the truck goes over it."""

    name: str
    profile: Profile
    iri: float
    """m/km, of this length."""

    @property
    def run_in(self) -> float:
        """Length over which the truck settles ahead of the road, m."""
        return min(RUN_IN, max(0.0, self.profile.length - CROSSED))


@dataclass(frozen=True)
class Sites:
    """Profiles in the order of their IRI, and those that could not be used."""

    used: tuple[Site, ...]
    rejected: tuple[tuple[str, str], ...] = ()
    """File and what is wrong with it."""
    remarks: tuple[str, ...] = ()
    """What was warned of."""
    origin: str = ""


def random_sites() -> Sites:
    """Build seeded profiles of ISO 8608 with evenly spaced IRI."""
    used = []
    for seed, iri in enumerate(np.linspace(SMOOTHEST, ROUGHEST, COUNT).tolist()):
        made = Profile.iso8608("B", length=RUN_IN + CROSSED, spacing=SPACING, seed=seed)
        name = f"ISO 8608, seed {seed}"
        used.append(Site(name, Profile(made.x, made.z * (iri / made.iri()), name=name), iri))
    return Sites(
        tuple(used),
        origin=f"{COUNT} random profiles of ISO 8608 (seeded), scaled to an IRI of "
        f"{SMOOTHEST:g} to {ROUGHEST:g} m/km",
    )


Given = str | os.PathLike[str] | Iterable[Profile] | Sites | None
"""Profiles as a user names them: a folder, or the profiles themselves."""


def sites_of(profiles: Given) -> Sites:
    """Take random profiles, those of a folder, or those given.

    Raises
    ------
    ValueError
        If fewer than two can be used, or all are equally rough.
    OSError
        If the folder is none or cannot be read.
    """
    if profiles is None:
        return random_sites()
    if isinstance(profiles, Sites):
        return profiles
    if isinstance(profiles, str | os.PathLike):
        return _checked(_of_folder(Path(profiles)), os.fspath(profiles))
    if not isinstance(profiles, Iterable):
        raise ValueError(
            f"profiles is a {type(profiles).__name__}: must be a folder or a list of Profile"
        )
    return _checked(_of_profiles(list(profiles)), "the profiles given")


def _of_folder(folder: Path) -> Sites:
    if not folder.exists():
        raise FileNotFoundError(f"no such folder: {folder}")
    if not folder.is_dir():
        raise NotADirectoryError(f"{folder} is not a folder; give one that holds profiles")
    used, rejected, remarks = [], [], []
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or path.is_dir():
            continue
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                used.append(_site(path.name, read_profile(path)))
            except FormatError as error:
                place = "" if error.line is None else f"line {error.line}: "
                rejected.append((path.name, place + error.message))
            except (ValueError, OSError) as error:
                rejected.append((path.name, str(error)))
        remarks += [f"{path.name}: {warning.message}" for warning in caught]
    count = f"{len(used)} profile{'s' if len(used) != 1 else ''}"
    return Sites(tuple(used), tuple(rejected), tuple(remarks), f"{count} of the folder {folder}")


def _of_profiles(profiles: list[Profile]) -> Sites:
    used, rejected, remarks = [], [], []
    for number, profile in enumerate(profiles, start=1):
        if not isinstance(profile, Profile):
            raise ValueError(
                f"profiles has a {type(profile).__name__}: must be a folder or a list of Profile"
            )
        name = profile.name or f"profile {number}"
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                used.append(_site(name, profile))
            except ValueError as error:
                rejected.append((name, str(error)))
        remarks += [f"{name}: {warning.message}" for warning in caught]
    return Sites(tuple(used), tuple(rejected), tuple(remarks), f"{len(used)} profiles given")


def _site(name: str, profile: Profile) -> Site:
    """Cut out what the truck goes over, and find how rough it is."""
    if profile.length < CROSSED * (1.0 - 1e-9):
        raise ValueError(
            f"is {profile.length:g} m long: road and truck need {CROSSED:g} m, and "
            f"{RUN_IN + CROSSED:g} m let the truck settle"
        )
    start = float(profile.x[0])
    length = min(profile.length, RUN_IN + CROSSED)
    driven = profile.slice(start, start + length)
    iri = Profile(driven.x, driven.z, name=name, source=driven.source).iri()
    if not iri > 0.0:
        raise ValueError("is level: without roughness there is no sensitivity to it")
    return Site(name, driven, iri)


def _checked(sites: Sites, where: str) -> Sites:
    reasons = "".join(f"\n  {name}: {reason}" for name, reason in sites.rejected)
    if len(sites.used) < 2:
        found = "1 profile" if sites.used else "no profile"
        raise ValueError(f"{where}: {found} that can be used, at least 2 are needed{reasons}")
    used = tuple(sorted(sites.used, key=lambda site: site.iri))
    if not used[0].iri < used[-1].iri:
        raise ValueError(f"{where}: all profiles have an IRI of {used[0].iri:g} m/km; must differ")
    return Sites(used, sites.rejected, sites.remarks, sites.origin)
