"""The command line: ``pavefem run``, ``traffic``, ``iri``, ``info`` and ``paper``."""

from __future__ import annotations

from typing import Annotated

import typer

import pavefem
from pavefem.cli import info, iri, paper, run, traffic
from pavefem.cli.terminal import console

app = typer.Typer(
    help="""What heavy vehicles on rough roads do to pavements.

Units are SI unless an option says otherwise: lengths in m, masses in kg, times in s; speeds are in
km/h, temperatures in °C, voids (VMA) in percent and roughness (IRI) in m/km. Deflections are up
positive in files, and printed in mm.""",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
app.command("run")(run.run)
app.command("traffic")(traffic.traffic)
app.command("iri")(iri.iri)
app.command("info")(info.info)
app.command("paper")(paper.paper)


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
