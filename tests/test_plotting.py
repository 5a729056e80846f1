"""What all pictures share: names are shown as they are, and pyplot is left alone."""

from __future__ import annotations

import io

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.collections import PolyCollection

import pavefem as pf
from pavefem import plotting
from pavefem.plotting.style import BINS, MOST_POINTS, draw_line, new_figure


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


def test_a_long_line_is_drawn_as_what_is_between_its_extremes() -> None:
    axes = new_figure(6.0, 3.0).add_subplot()
    x = np.linspace(0.0, 500.0, 100_000)
    y = np.sin(40.0 * x)
    y[61_803] = 7.0
    draw_line(axes, x, y, "black", label="a")
    [band] = [drawn for drawn in axes.collections if isinstance(drawn, PolyCollection)]
    at, height = np.asarray(band.get_paths()[0].vertices).T
    assert (height.min(), height.max()) == (y.min(), 7.0)
    assert np.abs(at[height == 7.0] - x[61_803]).max() <= 500.0 / BINS
    [line] = axes.lines
    means = y.reshape(BINS, -1).mean(axis=1)
    np.testing.assert_allclose(np.asarray(line.get_ydata(), float), means, atol=1e-12)
    assert line.get_label() == "a"
    bottom, top = axes.get_ylim()
    assert bottom < -1.0 and top > 7.0


def test_a_short_line_is_drawn_as_it_is() -> None:
    axes = new_figure(6.0, 3.0).add_subplot()
    y = np.sin(np.arange(MOST_POINTS, dtype=np.float64))
    draw_line(axes, np.arange(MOST_POINTS, dtype=np.float64), y, "black")
    assert not axes.collections
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), y)


def test_of_a_long_run_the_history_shows_the_passage(truck: pf.Vehicle) -> None:
    scheme = pf.Scheme.paper(solver="window")
    result = pf.simulate(pf.Road(length=300.0), truck, scheme=scheme, stations=[200.0])
    assert result.deflection is not None
    history = result.plot().axes[0]
    [line] = [line for line in history.lines if np.size(line.get_xdata()) > 2]
    time = np.asarray(line.get_xdata())
    first, last = 200.0 / (65.0 / 3.6), (200.0 + truck.length) / (65.0 / 3.6)
    assert time[0] == pytest.approx(first - 1.0, abs=2e-3)
    assert time[-1] == pytest.approx(last + 1.0, abs=2e-3)
    assert np.asarray(line.get_ydata()).min() == 1e3 * result.deflection.min()
    # All of the road is in the other panels.
    envelope, forces = result.plot().axes[1:]
    assert envelope.get_xlim()[1] > 299.0 and forces.get_xlim()[1] > 299.0
