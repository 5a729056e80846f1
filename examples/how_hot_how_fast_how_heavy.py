"""How hot, how fast, how heavy: a sweep over the temperature, the speed and the payload of a truck.

Prints the largest deflection at mid-length for all combinations, what one step of each costs, and
the payload that a hot road bears like a full truck on a mild day.
"""

import warnings

import numpy as np

import pavefem as pf
from pavefem.plotting.style import colour, new_figure

# A hot binder is softer than the stiffness formulas are for, as in the paper's Fig. 11.
warnings.simplefilter("ignore", pf.ValidityWarning)

profile = pf.Profile.iso8608("B", length=80.0, seed=1)
base = pf.Scenario(
    road=pf.Road.paper(),
    vehicle=pf.vehicles.tandem_truck(),
    profile=profile,
    run_in=50.0,
    scheme=pf.Scheme.paper(solver="window"),  # no matrices, as each temperature has its own
)
temperatures, speeds = [10.0, 20.0, 30.0, 40.0], [25.0, 65.0, 105.0]
payloads = [0.0, 6200.0, 12_400.0, 18_600.0]
study = pf.sweep(
    base,
    temperature_c=temperatures,
    speed_kmh=speeds,
    payload=payloads,
    outputs=["mid_deflection", "max_force"],
)
study.to_netcdf("study.nc", engine="h5netcdf")
deflection = 1e3 * study["mid_deflection"]

print("Largest deflection at mid-length [mm]")
for temperature in temperatures:
    print(f"\n{temperature:g} °C" + "".join(f"{payload / 1e3:8.1f} t" for payload in payloads))
    for speed in speeds:
        row = deflection.sel(temperature_c=temperature, speed_kmh=speed).to_numpy()
        print(f"{speed:5g} km/h" + "".join(f"{value:10.3f}" for value in row))

nominal = {"temperature_c": 20.0, "speed_kmh": 65.0, "payload": 12_400.0}
print("\nFrom 20 °C, 65 km/h and 12.4 t, and what one step of each changes")
for name, value in nominal.items():
    others = {other: at for other, at in nominal.items() if other != name}
    along = deflection.sel(others) / float(deflection.sel(nominal))
    for step in along[name].to_numpy():
        if step != value:
            print(f"  {name} {step:g}: {100.0 * (float(along.sel({name: step})) - 1.0):+.0f} %")

bound = float(deflection.sel(nominal))
by_payload = deflection.sel(temperature_c=30.0, speed_kmh=65.0).to_numpy()
alike = float(np.interp(bound, by_payload, payloads))
print(f"\n{alike / 1e3:.1f} t at 30 °C bend the road like 12.4 t at 20 °C: {bound:.3f} mm")

figure = new_figure(7.0, 4.0)
axes = figure.add_subplot()
for number, payload in enumerate(payloads):
    line = deflection.sel(speed_kmh=65.0, payload=payload)
    axes.plot(temperatures, line, "o-", color=colour(number), label=f"{payload / 1e3:g} t")
axes.set(title="At 65 km/h", xlabel="temperature [°C]", ylabel="deflection at mid-length [mm]")
axes.legend(title="payload")
axes.grid(alpha=0.3)
figure.savefig("how_hot_how_fast_how_heavy.png")
