"""Which parameter matters: the paper's case, one parameter at a time, by Morris and by Sobol.

Prints the three rankings, of the deflection at mid-length and of the largest tire force, and leaves
a picture of each.
"""

import warnings

import pavefem as pf
from pavefem import plotting, studies

# Between 35 and 40 °C the binder is softer than the stiffness formulas are for.
warnings.simplefilter("ignore", pf.ValidityWarning)

base = pf.Scenario(
    vehicle=pf.vehicles.tandem_truck(),
    profile=pf.Profile.iso8608("B", length=80.0, seed=1),
    run_in=50.0,
    scheme=pf.Scheme.paper(solver="window"),
)
ranges = {
    "temperature_c": (10.0, 40.0),
    "vma": (15.0, 30.0),
    "speed_kmh": (25.0, 105.0),
    "axle_spacing": (0.9, 2.2),
    "payload": (0.0, 12_400.0),
    "iri": (1.0, 5.0),
}
outputs = ["mid_deflection", "max_force"]

one = studies.tornado(base, ranges, outputs)
effects = studies.morris(base, ranges, outputs, trajectories=20, seed=1)
indices = studies.sobol(base, ranges, outputs, samples=64, seed=1)

for output in outputs:
    print(f"\n{output}")
    print(f"{'':<15}{'low to high':>14}{'mu*':>11}{'first order':>17}{'total':>17}")
    total = indices["total"].sel(output=output)
    for name in total.sortby(-total)["parameter"].to_numpy():
        at = {"output": output, "parameter": name}
        change = float((one["at_high"] - one["at_low"]).sel(at))
        row = f"{name:<15}{change:>+14.3g}{float(effects['mu_star'].sel(at)):>11.3g}"
        for index in ("first_order", "total"):
            value, reach = indices[index].sel(at), indices[f"{index}_confidence"].sel(at)
            row += f"{float(value):>9.2f} ± {float(reach):.2f} "
        print(row)

plotting.plot_tornado(one, "mid_deflection").savefig("tornado.png")
plotting.plot_morris(effects, "mid_deflection").savefig("morris.png")
plotting.plot_sobol(indices, "mid_deflection").savefig("sobol.png")
