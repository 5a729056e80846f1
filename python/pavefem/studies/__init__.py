"""Studies: many scenarios that differ in chosen fields, and what their runs answer."""

from __future__ import annotations

from pavefem.studies.sweep import sweep
from pavefem.studies.work import Answers, evaluate

__all__ = ["Answers", "evaluate", "sweep"]
