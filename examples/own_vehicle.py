"""A two-axle lorry from bodies, springs and tires, over a bump, against the paper's truck."""

import numpy as np

import pavefem as pf

lorry = pf.Vehicle(
    name="two-axle lorry",
    bodies=[
        pf.Body(name="frame", mass=12_000.0, x=2.6, pitch_inertia=45_000.0),
        pf.Body(name="front axle", mass=500.0, x=0.0),
        pf.Body(name="rear axle", mass=900.0, x=4.2),
    ],
    springs=[
        pf.Spring(upper="frame", lower="front axle", x=0.0, stiffness=4e5, damping=2e4),
        pf.Spring(upper="frame", lower="rear axle", x=4.2, stiffness=8e5, damping=3e4),
    ],
    tires=[
        pf.Tire(body="front axle", x=0.0, stiffness=1.6e6, damping=2e3),
        pf.Tire(body="rear axle", x=4.2, stiffness=3.2e6, damping=4e3),
    ],
)
x = np.arange(0.0, 60.0, 0.05)
bump = np.where(abs(x - 30.0) < 0.5, 0.02 * np.cos(np.pi * (x - 30.0)), 0.0)
profile = pf.Profile(x, bump, name="bump of 20 mm")

for vehicle in (lorry, pf.vehicles.tandem_truck()):
    forces = pf.tire_forces(vehicle, profile, speed_kmh=50.0)
    print(vehicle.name)
    print("  modes [Hz]       ", vehicle.natural_frequencies().round(2))
    print("  static loads [kN]", (forces.static_loads / 1e3).round(1))
    print("  largest [kN]     ", (forces.force.max(axis=0) / 1e3).round(1))
    for lift in forces.lift_off:
        print(f"  axle {lift.axle} lifts off at {lift.position:.2f} m")
