"""All that is shown is run: the blocks of README and docs, the examples, the doctests."""

from __future__ import annotations

import doctest
import importlib
import os
import pkgutil
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import pavefem

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
PAGES = [README, *sorted((ROOT / "docs").glob("**/*.md"))]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
MODULES = sorted(
    ["pavefem", *(m.name for m in pkgutil.walk_packages(pavefem.__path__, "pavefem."))]
)

PYTHON = {"python", "py"}
SHELL = {"sh", "bash", "shell", "console"}
_BLOCK = re.compile(
    r"^(?P<indent>[ \t]*)```(?P<language>\w*)[^\n]*\n(?P<code>.*?)^(?P=indent)```[ \t]*$",
    re.MULTILINE | re.DOTALL,
)


@dataclass
class Block:
    """A fenced block of a page."""

    language: str
    code: str
    line: int


def blocks(text: str) -> Iterator[Block]:
    """Find the fenced blocks of a Markdown text."""
    for match in _BLOCK.finditer(text):
        indent = match["indent"]
        code = "".join(line.removeprefix(indent) for line in match["code"].splitlines(True))
        yield Block(match["language"].lower(), code, text.count("\n", 0, match.start("code")) + 1)


def commands(code: str) -> Iterator[list[str]]:
    """Find the `pavefem` commands of a shell block, continued lines joined."""
    for line in code.replace("\\\n", " ").splitlines():
        command = line.strip().removeprefix("$ ")
        if command.startswith("pavefem "):
            yield shlex.split(command, comments=True)[1:]


def pictures(text: str) -> list[str]:
    """Find the pictures that a page shows."""
    return re.findall(r"!\[[^\]]*\]\(([^)]+)\)", text)


def run_process(*arguments: str, cwd: Path, timeout: float = 120.0) -> str:
    """Run the interpreter in `cwd` without a display; an error if it fails."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=cwd,
        env=os.environ | {"MPLBACKEND": "Agg", "PYTHONIOENCODING": "utf-8", "COLUMNS": "200"},
        capture_output=True,
        encoding="utf-8",
        timeout=timeout,
        check=False,
    )
    assert done.returncode == 0, f"{arguments}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def test_finding_blocks() -> None:
    text = (
        "a\n```python\nx = 1\n```\n\n1. b\n\n"
        "   ```bash\n   $ pavefem run \\\n     --smooth # c\n   ls\n   ```\n"
    )
    python, shell = blocks(text)
    assert (python.language, python.code, python.line) == ("python", "x = 1\n", 3)
    assert list(commands(shell.code)) == [["run", "--smooth"]]


def test_readme_shows_python() -> None:
    found = [block for block in blocks(README.read_text("utf-8")) if block.language in PYTHON]
    assert found, "README.md has no python block"


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_blocks_of_a_page(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In order, Python in one namespace, commands in between, all in one empty folder."""
    monkeypatch.chdir(tmp_path)
    namespace: dict[str, Any] = {"__name__": "__main__"}
    for block in blocks(page.read_text("utf-8")):
        if block.language in PYTHON:
            # Empty lines put the block where it stands in the page: tracebacks then name its line.
            code = "\n" * (block.line - 1) + block.code
            if ">>>" in block.code:
                _doctest(block, page, namespace)
            else:
                exec(compile(code, str(page), "exec"), namespace)
        elif block.language in SHELL:
            for command in commands(block.code):
                main = "import sys; from pavefem.cli import app; sys.argv[0] = 'pavefem'; app()"
                run_process("-c", main, *command, cwd=tmp_path)
    if page.parent.name == "how-to":
        saved = {path.name for path in tmp_path.glob("*.png")}
        assert saved == set(pictures(page.read_text("utf-8")))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_of_a_page(page: Path) -> None:
    """Files that a page shows or refers to are there."""
    text = page.read_text("utf-8")
    links = re.findall(r"\]\(([^)#\s]+)", text)
    assert set(pictures(text)) <= set(links)
    for link in links:
        assert link.startswith("https://") or (page.parent / link).exists(), link


def _doctest(block: Block, page: Path, namespace: dict[str, Any]) -> None:
    test = doctest.DocTestParser().get_doctest(
        block.code, namespace, f"{page.name}:{block.line}", str(page), block.line - 1
    )
    report: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    runner.run(test, out=report.append, clear_globs=False)
    namespace.update(test.globs)
    assert runner.summarize(verbose=False).failed == 0, "".join(report)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.name)
def test_examples(example: Path, tmp_path: Path, cache_folder: Path) -> None:
    run_process(str(example), cwd=tmp_path)


@pytest.mark.parametrize("name", MODULES)
def test_doctests(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    # As an attribute of the package, a module may be hidden by a function of its name.
    importlib.import_module(name)
    module = sys.modules[name]
    assert module.__doc__ or name == "pavefem._core", f"{name} has no docstring"
    failed, _ = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert failed == 0, capsys.readouterr().out


def test_some_module_has_doctests() -> None:
    """Else the test above would pass on nothing."""
    finder = doctest.DocTestFinder()
    found = [test for name in MODULES for test in finder.find(sys.modules[name]) if test.examples]
    assert len(found) >= 4


def test_public_names_are_documented() -> None:
    for name in pavefem.__all__:
        assert getattr(pavefem, name).__doc__, name


def test_run_python_sees_the_right_package(run_python: Callable[..., Any]) -> None:
    """A process of the tests imports the package under test, not one installed elsewhere."""
    done = run_python("-c", "import pavefem; print(pavefem.__file__)")
    assert done.stdout.strip() == pavefem.__file__
