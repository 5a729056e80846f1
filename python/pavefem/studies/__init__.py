"""Studies: many scenarios that differ in chosen fields; the paper reproduced, and its measures."""

from __future__ import annotations

from pavefem.studies.paper import Reproduction, reproduce_paper
from pavefem.studies.sensitivity import paper_sensitivity
from pavefem.studies.sweep import sweep
from pavefem.studies.work import Answers, evaluate

__all__ = [
    "Answers",
    "Reproduction",
    "evaluate",
    "paper_sensitivity",
    "reproduce_paper",
    "sweep",
]
