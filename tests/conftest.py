"""Shared by all tests: a cache of their own, the command line, and the models they start from."""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib
import pytest
from hypothesis import HealthCheck, settings
from matplotlib.figure import Figure
from typer.testing import CliRunner

import pavefem as pf
from pavefem import cli
from pavefem.cli import terminal

matplotlib.use("Agg")

settings.register_profile(
    "pavefem",
    deadline=None,
    derandomize=True,
    database=None,
    max_examples=30,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
settings.load_profile("pavefem")

TESTS = Path(__file__).parent
DATA = TESTS.parents[1] / "shared" / "data"
"""Measured data beside the project, where there are any."""


class Outcome:
    """What one command did."""

    def __init__(self, code: int, out: str, err: str) -> None:
        self.code, self.out, self.err = code, out, err

    def error(self) -> str:
        """Give the one line of a failure."""
        assert self.code == 2, (self.code, self.out, self.err)
        assert "Traceback" not in self.err + self.out
        lines = self.err.strip().splitlines()
        assert len(lines) == 1, self.err
        assert lines[0].startswith("error: ")
        return lines[0].removeprefix("error: ")


Run = Callable[..., Outcome]
"""Runs a command, given its words."""


def pytest_configure(config: pytest.Config) -> None:
    """Register the markers of this suite."""
    config.addinivalue_line("markers", "draws: the command line draws its pictures")


def forget_steppers() -> None:
    """Empty the store of prepared roads: what follows is a cold start as far as memory goes."""
    # As an attribute of the package, `simulate` is the function.
    importlib.import_module("pavefem.simulate")._STEPPERS.clear()


@pytest.fixture(scope="session", autouse=True)
def _session_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep fixtures that outlive one test out of the user's cache folder, too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PAVEFEM_CACHE_DIR", str(tmp_path_factory.mktemp("session_cache")))
        yield


@pytest.fixture(autouse=True)
def cache_folder(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give each test an empty cache, in memory and in a folder that does not exist yet."""
    folder = tmp_path_factory.mktemp("cache") / "matrices"
    monkeypatch.setenv("PAVEFEM_CACHE_DIR", str(folder))
    forget_steppers()
    return folder


@pytest.fixture
def run_python(cache_folder: Path, tmp_path: Path) -> Callable[..., Any]:
    """Run the interpreter as a fresh process in `tmp_path`, without a display."""
    import subprocess
    import sys

    def _run(*arguments: str, timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, *arguments],
            cwd=tmp_path,
            env=os.environ | {"MPLBACKEND": "Agg", "COLUMNS": "200", "PYTHONIOENCODING": "utf-8"},
            capture_output=True,
            text=True,
            encoding="utf-8",
            timeout=timeout,
            check=False,
        )

    return _run


@pytest.fixture
def pictures(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the drawing out, which takes most of a run's time, where a test is not about it."""
    if "draws" in request.keywords:
        return

    def save(_: Figure, path: Path, **__: object) -> None:
        path.write_bytes(b"")

    monkeypatch.setattr(Figure, "savefig", save)


@pytest.fixture
def pavefem(tmp_path: Path, pictures: None, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run the command in an empty folder, on a wide terminal."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    for console in (terminal.console, terminal.errors):
        monkeypatch.setattr(console, "_width", 200, raising=False)

    def _run(*arguments: str) -> Outcome:
        result = CliRunner().invoke(cli.app, list(arguments))
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return Outcome(result.exit_code, result.stdout, result.stderr)

    return _run


@pytest.fixture(scope="session")
def road() -> pf.Road:
    """Give the paper's road: 25 m, clamped."""
    return pf.Road.paper()


@pytest.fixture(scope="session")
def truck() -> pf.Vehicle:
    """Give the paper's truck."""
    return pf.vehicles.tandem_truck()


@pytest.fixture(scope="session")
def rough() -> pf.Profile:
    """Give a rough profile, long enough for a run-in of 40 m ahead of 25 m of road."""
    return pf.Profile.iso8608("C", length=80.0, seed=3)


@pytest.fixture(scope="session")
def nominal(road: pf.Road, truck: pf.Vehicle) -> pf.Result:
    """Give the paper's nominal case: constant forces, 65 km/h, 20 °C, VMA 25 %."""
    return pf.simulate(road, truck, speed_kmh=65.0, temperature_c=20.0)


@pytest.fixture(scope="session")
def rough_run(road: pf.Road, truck: pf.Vehicle, rough: pf.Profile) -> pf.Result:
    """Give the same truck over the rough profile."""
    return pf.simulate(road, truck, profile=rough, run_in=40.0)
