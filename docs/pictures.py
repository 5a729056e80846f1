"""Run the Python of the how-to pages and keep the pictures that it saves, beside the pages.

    python docs/pictures.py [PAGE...]

Without pages, of all of them, and also the film that heads the README. A picture is so always what
the code next to it draws. Where a page needs no new pictures, git sees
no change: they depend on nothing but the page, pavefem and the version of matplotlib.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
from doctest import DocTestParser
from pathlib import Path

import matplotlib
from PIL import Image

import pavefem as pf

matplotlib.use("Agg")

HOME = Path(__file__).resolve().parent
PAGES = HOME / "how-to"
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COLOURS = 256
"""Enough for a plot; a file of so many takes half the room."""


def python_of(page: Path) -> str:
    """Return the code of a page, that of its prompts included."""
    parser = DocTestParser()
    blocks = []
    for block in BLOCK.findall(page.read_text("utf-8")):
        examples = parser.get_examples(block)
        # What is shown to fail is not run.
        shown = [example.source for example in examples if example.exc_msg is None]
        blocks.append("".join(shown) if examples else block)
    return "\n".join(blocks)


def draw(page: Path) -> None:
    """Run a page in a folder of its own and take its pictures from there."""
    home = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            exec(compile(python_of(page), str(page), "exec"), {"__name__": "__main__"})
            for picture in sorted(Path(folder).glob("*.png")):
                image = Image.open(picture).convert("RGB").quantize(COLOURS)
                image.save(page.parent / picture.name, optimize=True)
                print(f"{page.name}: {picture.name}, {image.width} x {image.height}")
        finally:
            os.chdir(home)


def film() -> None:
    """Draw the film that heads the README: the default run, on the converged scheme."""
    result = pf.simulate(
        pf.Road.paper(),
        pf.vehicles.tandem_truck(),
        profile=pf.Profile.iso8608("B", length=100.0, seed=1),
        run_in=50.0,
        scheme="converged",
    )
    result.animate(HOME / "animation.gif", between=(0.3, 1.2), slow_motion=3.5)
    print(f"animation.gif, {(HOME / 'animation.gif').stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    if not sys.argv[1:]:
        film()
    for page in map(Path, sys.argv[1:] or sorted(PAGES.glob("*.md"))):
        draw(page.resolve())
