"""The page: one HTML file with everything in it, pictures too."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from importlib.metadata import version
from importlib.resources import files
from typing import Final

from pavefem.studies.paper import printed
from pavefem.studies.paper.cases import SPACINGS, SPEEDS
from pavefem.studies.paper.figures import PaperFigure
from pavefem.studies.paper.notes import Note, agreements, caveats, differences
from pavefem.studies.paper.numbers import PRINTED, PRINTED_RATIOS, TableIII
from pavefem.studies.paper.readings import ASSUMPTIONS, READINGS
from pavefem.studies.paper.reproduction import Reproduction, places
from pavefem.studies.paper.wording import (
    HEADS,
    RATIOS,
    difference,
    millimetres,
    sensitivity,
)

TITLE: Final = "A Finite Element Model to assess flexible pavement vehicle interaction"
AUTHORS: Final = "Romero Navarrete, Lozano Guzmán and Arroyo Contreras"


def page(paper: Reproduction) -> str:
    """Write the page of a reproduction."""
    numbers = paper.numbers[paper.reading]
    sections = {
        "At a glance": _notes(agreements(numbers)),
        "Table III": _table_iii(paper),
        "Figures": "".join(_figure(paper, figure) for figure in paper.figures),
        "Readings": _readings(),
        "Caveats": _notes(caveats(paper.numbers, paper.reading)),
        "Profiles": _profiles(paper),
        "Warnings": _warnings(paper),
        "Time": _time(paper),
    }
    ids = {title: title.lower().replace(" ", "-") for title in sections}
    links = "\n".join(f'<a href="#{ids[title]}">{title}</a>' for title in sections)
    body = "\n".join(
        f'<section id="{ids[title]}">\n<h2>{title}</h2>\n{content}\n</section>'
        for title, content in sections.items()
    )
    style = files(__package__).joinpath("page.css").read_text(encoding="utf-8")
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>The paper, reproduced</title>
<style>
{style}</style>
</head>
<body>
<header>
<h1>The paper, reproduced</h1>
<p class="lead">{AUTHORS}, <i>{TITLE}</i>: Figs. 7 to 12 and Table III, computed anew by the
paper’s own scheme, beside what is printed.</p>
<dl>
<dt>Reading that draws the figures</dt><dd>{paper.reading} of two; both stand in every table</dd>
<dt>Profiles</dt><dd>{escape(paper.sites.origin)}</dd>
<dt>Printed values</dt><dd>Table III, and of figures the ranges and trends that were at hand</dd>
</dl>
<nav>
{links}
</nav>
</header>
<main>
{body}
</main>
<footer>pavefem {version("pavefem")}. The numbers, all of them, are in paper.json.</footer>
</body>
</html>
"""


# --- pieces -----------------------------------------------------------------------------------


def _paragraph(text: str) -> str:
    return f"<p>{escape(text)}</p>\n" if text else ""


def _bullets(items: Iterable[str]) -> str:
    return "<ul>\n" + "".join(f"<li>{item}</li>\n" for item in items) + "</ul>\n"


def _notes(notes: Iterable[Note]) -> str:
    return _bullets(f"<b>{escape(note.about)}.</b> {escape(note.text)}" for note in notes)


def _number(text: str, after: str = "") -> str:
    """Write a cell that stands right, with something small behind it."""
    small = f"<br><small>{escape(after)}</small>" if after else ""
    return f'<td class="n">{escape(text)}{small}</td>'


def _table(heads: Sequence[str], rows: Iterable[str], numeric: int = 1) -> str:
    """Write a table; heads from the `numeric`-th on stand over numbers."""
    cells = "".join(
        f"<th{' class=n' if column >= numeric else ''}>{escape(head)}</th>"
        for column, head in enumerate(heads)
    )
    return (
        f'<div class="scroll"><table>\n<thead><tr>{cells}</tr></thead>\n<tbody>\n'
        + "".join(f"{row}\n" for row in rows)
        + "</tbody>\n</table></div>\n"
    )


def _picture(paper: Reproduction, name: str, alt: str) -> str:
    data = base64.b64encode(paper.pictures[name]).decode("ascii")
    return f'<figure><img src="data:image/png;base64,{data}" alt="{escape(alt)}"></figure>\n'


# --- sections ---------------------------------------------------------------------------------


def _table_iii(paper: Reproduction) -> str:
    """Write Table III and its ratios, both readings beside what is printed."""
    tables = {"printed": PRINTED} | {
        f"{name} reading": numbers.table for name, numbers in paper.numbers.items()
    }
    rows = []
    for row, label in HEADS.items():
        for name, table in tables.items():
            head = f"<th rowspan={len(tables)}>{label}</th>" if table is PRINTED else ""
            kind = ' class="printed"' if table is PRINTED else ""
            rows.append(f"<tr{kind}>{head}<td>{name}</td>{_sensitivities(table, row)}</tr>")
    heads = ["Sensitivity of the peak to", "", *(f"{speed:g} km/h" for speed in SPEEDS), "mean"]
    text = (
        "S is the mean of (|Δy| / y) / (|Δx| / x) over forward differences: from 10 to 40 °C in "
        "steps of 10, from 15 to 30 % VMA in steps of 5, from the smoother to the rougher half of "
        "the profiles, and from one speed to the next. The last two keep their sign. Beneath ours "
        "stands the difference from the printed value."
    )
    return (
        _paragraph(text)
        + _table(heads, rows, numeric=2)
        + _ratios(paper)
        + "<h3>Where it differs, and why</h3>\n"
        + _notes(differences(paper.numbers[paper.reading]))
    )


def _sensitivities(table: TableIII, row: str) -> str:
    values, theirs = ([*t.rows[row], t.means[row]] for t in (table, PRINTED))
    cells = [
        _number(sensitivity(value), "" if table is PRINTED else difference(value, other))
        for value, other in zip(values, theirs, strict=True)
    ]
    gap = [] if len(cells) == len(SPEEDS) + 1 else ["<td></td>"]
    return "".join([*cells[:-1], *gap, cells[-1]])


def _ratios(paper: Reproduction) -> str:
    rows = []
    for name, label in RATIOS.items():
        theirs = PRINTED_RATIOS[name]
        source = "" if name in printed.RATIOS else "from its entries"
        ours = "".join(
            _number(f"{table.ratios[name]:.4g}", difference(table.ratios[name], theirs))
            for table in (numbers.table for numbers in paper.numbers.values())
        )
        rows.append(f"<tr><th>{label}</th>{_number(f'{theirs:.4g}', source)}{ours}</tr>")
    heads = ["Ratio of means", "printed", *(f"{name} reading" for name in paper.numbers)]
    return _table(heads, rows)


def _figure(paper: Reproduction, figure: PaperFigure) -> str:
    return (
        f'<section class="figure">\n<h3>{escape(figure.heading)}</h3>\n'
        + _picture(paper, figure.name, f"{figure.title}, {paper.reading} reading")
        + f"<dl>\n<dt>Understood as</dt><dd>{escape(figure.understood)}</dd>\n"
        + f"<dt>Printed</dt><dd>{escape(figure.known)}</dd>\n</dl>\n"
        + _compared(paper, figure)
        + (_levels(paper) if figure.name == "fig_8" else "")
        + _paragraph(figure.remark)
        + "</section>\n"
    )


def _compared(paper: Reproduction, figure: PaperFigure) -> str:
    """Write what the paper says of a figure beside both readings."""
    if not figure.compared:
        return ""
    by_reading = [
        next(other for other in figures if other.name == figure.name).compared
        for figures in paper.all_figures.values()
    ]
    rows = []
    for items in zip(*by_reading, strict=True):
        what, theirs = items[0].what, items[0].printed
        ours = "".join(
            _number(millimetres(item.ours), difference(item.ours, item.printed)) for item in items
        )
        rows.append(f"<tr><th>{escape(what)}</th>{_number(millimetres(theirs))}{ours}</tr>")
    return _table(["", "printed", *(f"{name} reading" for name in paper.numbers)], rows)


def _levels(paper: Reproduction) -> str:
    """Write the peaks of Fig. 8 at the three spacings, by both readings and both schemes."""
    rows = []
    for name, numbers in paper.numbers.items():
        for number, speed in enumerate(SPEEDS):
            head = f"<th rowspan={len(SPEEDS)}>{name} reading</th>" if number == 0 else ""
            pairs = zip(
                numbers.at_spacings[number], numbers.at_spacings_converged[number], strict=True
            )
            cells = "".join(
                _number(millimetres(float(coarse)), f"converged {millimetres(float(fine))}")
                for coarse, fine in pairs
            )
            rows.append(f"<tr>{head}{_number(f'{speed:g} km/h')}{cells}</tr>")
    heads = ["Peaks by spacing", "speed", *(f"{spacing:g} m" for spacing in SPACINGS)]
    return _table(heads, rows)


def _readings() -> str:
    """Write both readings side by side, and all that is assumed beside them."""
    lead = "What the paper leaves open can be read in two ways that both have something for them."
    made_for = _notes(
        Note(f"The {name} reading", reading.made_for) for name, reading in READINGS.items()
    )
    rows = [
        f"<tr><th>{escape(item.what)}</th>"
        + "".join(f"<td>{escape(t)}</td>" for t in (item.says, item.first, item.second, item.why))
        + "</tr>"
        for item in ASSUMPTIONS
    ]
    heads = ["What is open", "The paper says", *(f"{n} reading" for n in READINGS), "Why"]
    return _paragraph(lead) + made_for + _table(heads, rows, numeric=len(heads))


def _profiles(paper: Reproduction) -> str:
    numbers = paper.numbers[paper.reading]
    rows = [
        f'<tr><td class="name">{escape(site.name)}</td>'
        + "".join(map(_number, (f"{site.iri:.2f}", f"{site.run_in:.4g} m")))
        + "".join(_number(millimetres(float(peak))) for peak in numbers.by_site[:, number])
        + "</tr>"
        for number, site in enumerate(paper.sites.used)
    ]
    heads = ["Profile", "IRI, m/km", "run-in", *(f"peak at {speed:g} km/h" for speed in SPEEDS)]
    text = f"{paper.sites.origin}. IRI is that of the length the truck goes over."
    unused = ""
    if paper.rejected:
        unused = "<h3>Not used</h3>\n" + _bullets(
            f"<b>{escape(name)}</b>: {escape(reason)}" for name, reason in paper.rejected
        )
    return _paragraph(text) + unused + _table(heads, rows)


def _warnings(paper: Reproduction) -> str:
    found = [*map(escape, paper.sites.remarks)]
    found += [
        f"{escape(text)}: {escape('; '.join(places(cases)))}"
        for text, cases in paper.warnings.items()
    ]
    return _bullets(found) if found else _paragraph("None.")


def _time(paper: Reproduction) -> str:
    signs = ("", "under ")
    rows = [
        f"<tr><th>{escape(what)}</th>{_number(f'{sign}{seconds:g} s')}"
        f"{_number(f'{paper.seconds[what] * 1e3:.1f} ms')}</tr>"
        for sign, (what, seconds) in zip(signs, printed.SECONDS.items(), strict=True)
    ]
    text = "One run of the truck over the 25 m, on the machine that made this page, best of three."
    return _paragraph(text) + _table(["", "printed", "ours"], rows)
