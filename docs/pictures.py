"""Run the Python of the how-to pages and keep the pictures that it saves, beside the pages.

    python docs/pictures.py [PAGE...]

A picture is so always what the code next to it draws. Where a page needs no new pictures, git sees
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

matplotlib.use("Agg")

PAGES = Path(__file__).parent / "how-to"
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


if __name__ == "__main__":
    for page in map(Path, sys.argv[1:] or sorted(PAGES.glob("*.md"))):
        draw(page.resolve())
