"""Figures for a report: deflections in mm, forces in kN, places in m.

Figures are made without touching the current one; ``figure.savefig(path)`` writes them.
"""

from pavefem.plotting.animation import animate
from pavefem.plotting.calibration import plot_calibration
from pavefem.plotting.metrics import plot_aggregate_force, plot_dlc, plot_spatial_repeatability
from pavefem.plotting.profile import plot_iri, plot_profile, plot_psd
from pavefem.plotting.result import (
    draw_envelope,
    draw_forces,
    draw_history,
    draw_worst_instant,
    plot_result,
)
from pavefem.plotting.sensitivity import plot_morris, plot_sobol, plot_tornado
from pavefem.plotting.traffic import plot_time_distance, plot_traffic_map
from pavefem.plotting.vehicle import plot_vehicle

__all__ = [
    "animate",
    "draw_envelope",
    "draw_forces",
    "draw_history",
    "draw_worst_instant",
    "plot_aggregate_force",
    "plot_calibration",
    "plot_dlc",
    "plot_iri",
    "plot_morris",
    "plot_profile",
    "plot_psd",
    "plot_result",
    "plot_sobol",
    "plot_spatial_repeatability",
    "plot_time_distance",
    "plot_tornado",
    "plot_traffic_map",
    "plot_vehicle",
]
