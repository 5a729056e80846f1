"""The paper's truck on a smooth and on a rough road."""

import pavefem as pf

road = pf.Road(pf.Pavement.paper(), length=25.0)
truck = pf.vehicles.tandem_truck(axle_spacing=1.3)
rough = pf.Profile.iso8608("B", length=100.0, seed=1)

for profile in (None, rough):
    result = pf.simulate(road, truck, profile=profile, run_in=0.0 if profile is None else 50.0)
    for name, value in result.summary().items():
        print(f"{name:34} {value}")
    print()
    result.plot().savefig("smooth.png" if profile is None else "rough.png", dpi=120)
