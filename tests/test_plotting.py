"""What all pictures share: names are shown as they are, and pyplot is left alone."""

from __future__ import annotations

import io

import matplotlib.pyplot as plt
import pytest

import pavefem as pf
from pavefem import plotting


def test_a_dollar_in_a_name_begins_no_formula(road: pf.Road) -> None:
    profile = pf.Profile.iso8608("B", 60.0, seed=1)
    named = pf.Profile(profile.x, profile.z, r"cost $\frac$ of $5_x$")
    truck = pf.vehicles.rigid_truck().model_copy(update={"name": r"$\truck$"})
    result = pf.simulate(road, truck, profile=named, keep="envelope")
    figures = [result.plot(), truck.plot(), plotting.plot_profile(named), plotting.plot_psd(named)]
    for figure in figures:
        figure.savefig(io.BytesIO(), format="png")


def test_a_picture_that_is_refused_leaves_no_figure_open() -> None:
    irregular = pf.Profile([0.0, 1.0, 1.5, 40.0], [0.0, 0.0, 0.01, 0.0])
    before = plt.get_fignums()
    with pytest.raises(ValueError, match="uniform stations"):
        plotting.plot_iri(irregular)
    assert plt.get_fignums() == before
