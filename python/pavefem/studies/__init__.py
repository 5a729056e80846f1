"""Studies: many scenarios that differ in chosen fields, and what their runs answer."""

from __future__ import annotations

from pavefem.studies.calibration import Calibration, calibrate
from pavefem.studies.evaluation import Answers, evaluate
from pavefem.studies.measurements import DeflectionHistory, ForceDeflection
from pavefem.studies.paper import Reproduction, paper_sensitivity, reproduce_paper
from pavefem.studies.sensitivity import morris, sobol, tornado
from pavefem.studies.sweep import sweep
from pavefem.studies.traffic import simulate_traffic_in_parts

__all__ = [
    "Answers",
    "Calibration",
    "DeflectionHistory",
    "ForceDeflection",
    "Reproduction",
    "calibrate",
    "evaluate",
    "morris",
    "paper_sensitivity",
    "reproduce_paper",
    "simulate_traffic_in_parts",
    "sobol",
    "sweep",
    "tornado",
]
