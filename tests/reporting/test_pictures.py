"""What pictures show: no noise blown up, no line hidden, no phase without a colour."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.colors import to_hex

from mapping.raster import cloud_of, raster, sphere_cap
from palpate.reporting import TimeSeries
from palpate.reporting.force_picture import force_overview, force_zoom
from palpate.reporting.spin_picture import LEAST_SPIN, spin_picture
from palpate.reporting.style import MEASURED, PHASE_COLOURS, TRUE
from palpate.reporting.surface_picture import LEAST_RELIEF, View, touched_surface
from palpate.runtime.data import Phase

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
CAP = sphere_cap(half=0.006, step=4e-4)


def lines(axes: Axes):
    """The measured and the true line."""
    by_colour = {to_hex(line.get_color()): line for line in axes.lines}
    return by_colour[MEASURED], by_colour[TRUE]


@pytest.mark.parametrize(
    "picture", [force_overview(SERIES), force_zoom(SERIES), spin_picture(SERIES, CAP)], ids=["run", "scan", "spin"]
)
def test_the_measured_line_is_thin_and_on_top_of_the_true_one(picture):
    for figure in (picture.full, picture.narrow):
        measured, true = lines(figure.axes[0])
        assert measured.get_zorder() > true.get_zorder()
        assert measured.get_linewidth() < true.get_linewidth()


def test_noise_does_not_cover_the_true_line():
    noise = np.random.default_rng(0).normal(size=len(TIME))
    series = dataclasses.replace(
        SERIES, measured_force=SERIES.true_force + 0.01 * noise, spin_torque=SERIES.true_spin_torque + 1e-4 * noise
    )
    for picture in (force_overview(series), force_zoom(series), spin_picture(series, CAP)):
        measured, true = lines(picture.full.axes[0])
        assert measured.get_zorder() < true.get_zorder()


def legend(picture) -> list[str]:
    return [text.get_text() for text in picture.full.legends[0].get_texts()]


def test_legends_name_the_phases_that_can_be_seen():
    assert set(legend(force_zoom(SERIES))) == {"scan", "true", "measured", "set"}
    assert {"approach", "scan", "lift"} <= set(legend(force_overview(SERIES)))
    assert "done" not in legend(force_overview(SERIES))  # one sample: no width


@settings(max_examples=8, deadline=None)
@given(exponent=st.floats(-18.0, 0.0))
def test_spin_torque_is_never_shown_larger_than_it_matters(exponent):
    """The scale is at least the floor, and holds the values."""
    peak = 10.0**exponent  # N m
    series = dataclasses.replace(SERIES, spin_torque=peak * np.sin(60.0 * TIME), true_spin_torque=None)
    low, high = spin_picture(series, CAP).full.axes[0].get_ylim()
    assert low <= -LEAST_SPIN < LEAST_SPIN <= high
    assert low <= -0.99e3 * peak < 0.99e3 * peak <= high


@pytest.mark.parametrize("relief", [0.0, 8e-6, 1e-3, 0.03])
@pytest.mark.parametrize("height", [0.0, 0.02, 7.0])
def test_colours_of_heights_hold_all_and_make_flat_look_flat(relief, height):
    xy = raster()
    z = height + relief * (xy[:, 0] - xy[0, 0]) / np.ptp(xy[:, 0])
    cloud = cloud_of(np.column_stack([xy, z]), np.tile([0.0, 0.0, 1.0], (len(xy), 1)))
    norm = View.around(cloud).norm
    assert norm.vmin is not None
    assert norm.vmax is not None
    assert norm.vmin <= 1e3 * z.min() + 1e-9
    assert norm.vmax >= 1e3 * z.max() - 1e-9
    span = 1e3 * max(np.ptp(z), LEAST_RELIEF * np.ptp(xy[:, 0]))
    assert norm.vmax - norm.vmin == pytest.approx(span)


def test_the_colour_bar_shows_whole_heights():
    xy = raster()
    z = 20.0 + 8e-6 * xy[:, 0]  # far above the base: where matplotlib would write an offset
    cloud = cloud_of(np.column_stack([xy, z]), np.tile([0.0, 0.0, 1.0], (len(xy), 1)))
    figure = touched_surface(cloud, None).full
    figure.draw_without_rendering()
    assert [axes.xaxis.get_offset_text().get_text() for axes in figure.axes] == ["", ""]


def test_every_phase_has_a_colour_of_its_own():
    assert set(PHASE_COLOURS) == set(Phase)
    assert len(set(PHASE_COLOURS.values())) == len(Phase)
