"""What pictures show: no noise blown up, no line hidden, no phase without a colour."""

import dataclasses
import functools
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb

from mapping.raster import cloud_of, raster, sphere_cap
from palpate.experiments.explore.layer_picture import layer_picture
from palpate.experiments.explore.spin_picture import LEAST_SPIN, spin_picture
from palpate.experiments.explore.surface_picture import LEAST_RELIEF, View, touched_surface
from palpate.mapping import MapSettings, SurfaceMap, surface_mesh
from palpate.mapping.layers import VertexLayer
from palpate.reporting.data import TimeSeries
from palpate.reporting.force_picture import force_overview, force_zoom
from palpate.reporting.style import MEASURED, PHASE_COLOURS, TRUE
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
    assert set(legend(force_zoom(SERIES))) == {"scan", "true", "felt", "set"}
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
    stop, done = (to_rgb(PHASE_COLOURS[phase]) for phase in (Phase.STOP, Phase.DONE))
    assert np.abs(np.subtract(stop, done)).max() > 0.05, "they stand side by side at the end of every run"


# --- layers ---


@functools.cache
def cap_mesh():
    """What was felt of the cap as a surface: it takes a second, and so not before a test asks."""
    return surface_mesh(SurfaceMap.learned(CAP, MapSettings.for_rows(2e-3, bias=1e-6)), 1e-3)


def drawn(name, mean, sd=0.1):
    """The picture of a layer and its colours."""
    count = len(cap_mesh().vertices)
    picture = layer_picture(cap_mesh(), VertexLayer(name, np.broadcast_to(mean, count), np.full(count, sd)))
    surface, bar = picture.full.axes[0].collections[0], picture.full.axes[1]
    return picture, surface, bar.get_xlabel()


@pytest.mark.parametrize(
    ("name", "mean", "sd", "told", "label"),
    [
        ("friction", 0.3, 0.01, "median 0.3 scattering between neighbours by 0.01. ", "Friction"),
        ("stiffness", 4e4, 2e3, "median 40 ± 2 kN/m. ", "Stiffness of the object [kN/m]"),
        ("curvature_mean", 25.0, 0.5, "median 25 ± 0.5 1/m. ", "Mean curvature [1/m]"),
        ("warmth", 300.0, 2.0, "Warmth: median 300 ± 2. ", "Warmth"),
    ],
)
def test_a_layer_is_told_in_its_own_words_and_unit(name, mean, sd, told, label):
    picture, surface, shown = drawn(name, mean, sd)
    assert told in picture.caption
    assert shown == label
    assert ("while sliding" in picture.caption) == (name == "friction")
    low, high = surface.get_clim()
    assert low <= surface.get_array().min() <= surface.get_array().max() <= high
    assert float(re.search(r"median ([\d.]+)", told)[1]) == pytest.approx(surface.get_array())


@given(bent=st.floats(-100.0, 100.0))
@settings(max_examples=10)
def test_colours_of_curvature_tell_hollow_from_bulge(bent):
    _, surface, _ = drawn("curvature_mean", bent)
    low, high = surface.get_clim()
    assert low <= bent <= high
    assert high - low >= 10.0 - 1e-9
    assert low == -high or not low < 0.0 < high


def test_a_ball_is_not_all_of_the_last_colour():
    """Its curvature is of one sign: about zero, all of it would lie at one end of the scale."""
    bent = 25.0 + np.linspace(-2.0, 2.0, len(cap_mesh().vertices))
    _, surface, _ = drawn("curvature_mean", bent)
    low, high = surface.get_clim()
    assert (low, high) == (pytest.approx(20.0), pytest.approx(30.0))


def test_what_differs_by_less_than_its_deviation_looks_alike():
    mean = 4e4 + 100.0 * np.sin(np.arange(len(cap_mesh().vertices)))
    _, surface, _ = drawn("stiffness", mean, 2e3)
    low, high = surface.get_clim()
    assert high - low == pytest.approx(4.0)


def test_a_layer_of_which_nothing_is_known_has_no_picture_and_a_part_is_told():
    nothing = np.full(len(cap_mesh().vertices), np.nan)
    assert layer_picture(cap_mesh(), VertexLayer("stiffness", nothing, nothing)) is None
    half = np.where(np.arange(len(cap_mesh().vertices)) < len(cap_mesh().vertices) // 2, 0.3, np.nan)
    assert "Known on 50 % of the map" in drawn("friction", half)[0].caption
