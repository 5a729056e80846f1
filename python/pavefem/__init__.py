"""What heavy vehicles on rough roads do to pavements.

A vehicle model rolls over a measured profile; its tire forces load a finite-element pavement, an
asphalt beam on damped bars whose stiffness follows from temperature, voids and loading time; the
pavement answers with deflections.

All quantities are SI unless a name ends in a unit, as `speed_kmh` and `temperature_c` do.
Deflections are up positive: a loaded pavement reads negative.

Examples
--------
>>> import pavefem as pf
>>> road = pf.Road(pf.Pavement.paper(), length=25.0)
>>> truck = pf.vehicles.tandem_truck(axle_spacing=1.3)
>>> result = pf.simulate(road, truck, speed_kmh=65.0, temperature_c=20.0)
>>> print(f"{result.max_deflection * 1e3:.3f} mm")
0.661 mm
"""

from importlib.metadata import version

from pavefem import analytical, metrics, roughness, studies, vehicles
from pavefem.asphalt import Asphalt
from pavefem.coupling import Coupling
from pavefem.errors import (
    CalibrationWarning,
    FormatError,
    PavefemError,
    SolverError,
    SweepError,
    ValidityWarning,
)
from pavefem.fleet import fleet_forces
from pavefem.forces import LiftOff, TireForces, tire_forces
from pavefem.formats import read_profile
from pavefem.pavement import Pavement
from pavefem.profile import Profile
from pavefem.result import Result, load_result
from pavefem.road import Road, Section
from pavefem.scenario import Scenario
from pavefem.scheme import Scheme
from pavefem.simulate import run, simulate
from pavefem.simulate_traffic import run_traffic, simulate_traffic
from pavefem.studies import (
    Calibration,
    DeflectionHistory,
    ForceDeflection,
    calibrate,
    simulate_traffic_in_parts,
    sweep,
)
from pavefem.traffic import Traffic, read_sumo
from pavefem.traffic_result import TrafficResult, load_traffic_result
from pavefem.traffic_scenario import TrafficScenario
from pavefem.transition import transition
from pavefem.units import AxleGroup, Suspension, Tires, Unit
from pavefem.vehicle import Body, Friction, Spring, Tire, Vehicle

__version__ = version("pavefem")

__all__ = [
    "Asphalt",
    "AxleGroup",
    "Body",
    "Calibration",
    "CalibrationWarning",
    "Coupling",
    "DeflectionHistory",
    "ForceDeflection",
    "FormatError",
    "Friction",
    "LiftOff",
    "PavefemError",
    "Pavement",
    "Profile",
    "Result",
    "Road",
    "Scenario",
    "Scheme",
    "Section",
    "SolverError",
    "Spring",
    "Suspension",
    "SweepError",
    "Tire",
    "TireForces",
    "Tires",
    "Traffic",
    "TrafficResult",
    "TrafficScenario",
    "Unit",
    "ValidityWarning",
    "Vehicle",
    "analytical",
    "calibrate",
    "fleet_forces",
    "load_result",
    "load_traffic_result",
    "metrics",
    "read_profile",
    "read_sumo",
    "roughness",
    "run",
    "run_traffic",
    "simulate",
    "simulate_traffic",
    "simulate_traffic_in_parts",
    "studies",
    "sweep",
    "tire_forces",
    "transition",
    "vehicles",
]
