"""What pictures over time show: no noise blown up, no line hidden, no phase without a colour."""

import dataclasses

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.raster import sphere_cap
from palpate.experiments.explore.spin_picture import LEAST_SPIN, spin_picture
from palpate.reporting.data import TimeSeries
from palpate.reporting.force_picture import force_overview, force_zoom
from palpate.reporting.marks import Dash, Line, Span
from palpate.reporting.phases import GROUNDS
from palpate.reporting.plots import plots
from palpate.runtime.data import Phase

CAP = sphere_cap(half=0.006, step=4e-4)
TIME = np.arange(400) * 1e-3
PHASES = ["approach"] * 100 + ["scan"] * 200 + ["lift"] * 99 + ["done"]
SERIES = TimeSeries(
    time=TIME,
    phase=PHASES,
    measured_force=2.0 + 0.01 * np.sin(60.0 * TIME),
    set_force=np.full(400, 2.0),
    spin_torque=1e-17 * np.sin(60.0 * TIME),
    speed=np.full(400, 0.02),
    true_force=2.0 + 0.01 * np.sin(60.0 * TIME),
    true_spin_torque=1e-17 * np.cos(60.0 * TIME),
)


def drawn(series):
    return force_overview(series), force_zoom(series), spin_picture(series, CAP)


def lines(picture):
    """The felt and the true line of the first panel, and whether the felt one is on top."""
    named = [(mark.name, mark) for mark in picture.panels[0].marks if isinstance(mark, Line)]
    order = [name for name, _ in named]
    return dict(named)["felt"], dict(named)["true"], order.index("felt") > order.index("true")


def test_neither_what_is_felt_nor_what_is_true_hides_the_other():
    for picture in drawn(SERIES):
        felt, true, on_top = lines(picture)
        assert not on_top
        assert (felt.dash, true.dash) == (Dash.SOLID, Dash.DOTTED)


def test_legends_name_the_phases_that_can_be_seen():
    def phases(picture):
        return {mark.name for mark in picture.panels[0].marks if isinstance(mark, Span)}

    assert phases(force_zoom(SERIES)) == {"scan"}
    assert phases(force_overview(SERIES)) == {"approach", "scan", "lift"}, "done is one sample: it has no width"


@settings(max_examples=8, deadline=None)
@given(exponent=st.floats(-18.0, 0.0))
def test_spin_torque_is_never_shown_larger_than_it_matters(exponent):
    """The scale is at least the floor, and holds the values."""
    peak = 10.0**exponent  # N m
    series = dataclasses.replace(SERIES, spin_torque=peak * np.sin(60.0 * TIME), true_spin_torque=None)
    low, high = plots(spin_picture(series, CAP))[0]["layout"]["yaxis"].get("range", (-np.inf, np.inf))
    assert high - low >= 2.0 * LEAST_SPIN
    assert low <= -0.99e3 * peak < 0.99e3 * peak <= high


def test_every_phase_has_a_colour_of_its_own():
    assert set(GROUNDS) == set(Phase)
    shades = np.array([[int(each.light[i : i + 2], 16) for i in (1, 3, 5)] for each in GROUNDS.values()])
    assert len(np.unique(shades, axis=0)) == len(Phase)
    stop, done = (shades[list(GROUNDS).index(phase)] for phase in (Phase.STOP, Phase.DONE))
    assert np.abs(stop - done).max() > 12, "they stand side by side at the end of every run"
