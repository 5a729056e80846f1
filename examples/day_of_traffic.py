"""A day of traffic: 10 km of road, two lanes, and where and when it bends most.

Prints the worst places and vehicles, and what a stronger section is worth; draws a map and a
time-distance plot. ``python day_of_traffic.py --hours 24`` runs the whole day: some hours, and the
same call goes on where it was stopped.
"""

import argparse
import warnings

import pavefem as pf

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--hours", type=float, default=0.02, help="how much of the day (default: 0.02)")
parser.add_argument("--length", type=float, default=10_000.0, help="length of the road, m")
arguments = parser.parse_args()

# Who crawls loads the asphalt for longer than the stiffness formulas are for.
warnings.simplefilter("ignore", pf.ValidityWarning)

length = arguments.length
usual = pf.Pavement.paper()
strong = pf.Pavement.paper(asphalt=pf.Asphalt(vma=18.0))
road = pf.Road(sections=[(usual, 0.4 * length), (strong, 0.2 * length), (usual, 0.4 * length)])
profiles = {lane: pf.Profile.iso8608("B", length=length + 100.0, seed=10 + lane) for lane in (1, 2)}
# Nobody overtakes in his lane.
traffic = pf.Traffic.generate(duration=3600.0 * arguments.hours, seed=1, length=length)
day = pf.simulate_traffic(
    road,
    traffic,
    profile=profiles,
    temperature_c=25.0,
    scheme=pf.Scheme.converged(element_length=0.5),
    store="day",
    progress=True,
)
for name, figure in day.summary().items():
    print(f"{name}: {figure}")

worst = day.worst(5)
print("\nWorst places")
for rank in worst["rank"].to_numpy():
    row = worst.sel(rank=rank)
    print(
        f"  {float(row['max_deflection']) * 1e3:.3f} mm in lane {int(row['lane'])} at "
        f"x = {float(row['x']):.0f} m after {float(row['time']) / 3600.0:.3f} h; "
        f"damage {float(row['relative_damage']):.1f} times the mean"
    )

print("\nVehicles that bent it most")
vehicles = day.worst_vehicles(3)
for number in range(vehicles.sizes["passage"]):
    one = vehicles.isel(passage=number)
    print(f"  {one['vehicle'].item()}: {float(one['max_deflection']) * 1e3:.3f} mm")

damage = day.damage(4.0, of="strain", reference=1e-4).sum("lane")
inside = (damage["x"] > 0.4 * length) & (damage["x"] < 0.6 * length)
saved = 1.0 - float(damage[inside].mean() / damage[~inside].mean())
print(f"\nThe strong section takes {100.0 * saved:.0f} % less damage by strain")

day.plot().savefig("day_map.png", dpi=150)
day.plot_time_distance().savefig("day_time_distance.png", dpi=150)
