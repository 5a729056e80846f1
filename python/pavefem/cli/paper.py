"""``pavefem paper``: the published model's figures and table, beside what is printed."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from pavefem._files import check_writable
from pavefem.cli.terminal import console, print_figures, report_error, reporting
from pavefem.formats import PROFILE_READERS
from pavefem.studies import reproduce_paper
from pavefem.studies.paper.sites import sites_of


class Reading(StrEnum):
    """How the paper is read."""

    FIRST = "first"
    SECOND = "second"


@reporting()
def paper(
    out: Annotated[
        Path, typer.Option(help="Folder for paper.html, paper.json and the pictures.")
    ] = Path("paper"),
    reading: Annotated[
        Reading,
        typer.Option(
            help="Which reading of what the paper leaves open draws the figures; tables have both."
        ),
    ] = Reading.FIRST,
    profiles: Annotated[
        Path | None,
        typer.Option(
            help=f"Folder of profiles ({', '.join(PROFILE_READERS)}) for Figs. 9 and 10.  "
            "[default: 26 random ones]",
            metavar="FOLDER",
        ),
    ] = None,
) -> None:
    """Reproduce the paper's Figs. 7 to 12 and Table III, beside what is printed.

    Writes paper.html, a page that has everything in it, paper.json with all numbers, and a PNG
    file of each figure and of the table. A profile that cannot be used is reported and loses none
    of the others; the exit code is then 2.
    """
    sites = sites_of(profiles)
    check_writable(out)
    found = reproduce_paper(reading, sites, progress=True)
    files = found.save(out)
    print_figures("pavefem paper", found.summary())
    names = ", ".join(path.name for path in files)
    console.print(f"wrote {names} in {out}", highlight=False, markup=False, soft_wrap=True)
    for name, reason in found.rejected:
        report_error(f"{name}: {reason}")
    if found.rejected:
        raise typer.Exit(2)
