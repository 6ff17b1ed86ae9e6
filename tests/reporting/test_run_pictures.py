"""Pictures of runs: curves over time, recorded and replayed runs, thinned series, a confusion matrix."""

import dataclasses
import re
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.raster import sphere_cap
from palpate.commands.replay.report import difference_figure, felt_figure, velocity_figure
from palpate.experiments.explore.report import MIN_SPIN_SPAN, spin_figure
from palpate.experiments.friction.recognised import LONGEST_NAME, MOST_FIGURES, confusion_figure
from palpate.friction.materials.trials import UNKNOWN, Confusion
from palpate.reporting.data import TimeSeries
from palpate.reporting.marks import Dash, Line, Points, Span, envelope
from palpate.reporting.plots import plots
from palpate.reporting.run_figures import GROUNDS, force_overview, force_zoom
from palpate.runtime.data import Phase
from support.drawn import marks, panels

CAP = sphere_cap(half=0.006, step=4e-4)
TIME = np.arange(400) * 1e-3
SERIES = TimeSeries(
    time=TIME,
    phase=["approach"] * 100 + ["scan"] * 200 + ["lift"] * 99 + ["done"],
    measured_force=2.0 + 0.01 * np.sin(60.0 * TIME),
    set_force=np.full(400, 2.0),
    spin_torque=1e-17 * np.sin(60.0 * TIME),
    speed=np.full(400, 0.02),
    true_force=2.0 + 0.01 * np.sin(60.0 * TIME),
    true_spin_torque=1e-17 * np.cos(60.0 * TIME),
)


@pytest.mark.parametrize(
    ("picture", "phases"),
    [
        (force_overview(SERIES), {"approach", "scan", "lift"}),
        (force_zoom(SERIES), {"scan"}),
        (spin_figure(SERIES, CAP), None),
    ],
)
def test_the_true_line_is_over_the_measured_line_and_legends_name_the_phases_with_a_width(picture, phases):
    """The phase "done" is a single sample."""
    panel = panels(picture)[0]
    lines = {mark.name: mark for mark in marks(panel, Line)}
    assert (lines["felt"].dash, lines["true"].dash) == (Dash.SOLID, Dash.DOTTED)
    assert list(lines).index("felt") < list(lines).index("true")
    assert phases in ({mark.name for mark in marks(panel, Span)}, None)


@settings(max_examples=8, deadline=None)
@given(exponent=st.floats(-18.0, 0.0))
def test_the_scale_of_spin_torque_holds_its_values_and_a_minimum_range(exponent):
    peak = 10.0**exponent  # N m
    series = dataclasses.replace(SERIES, spin_torque=peak * np.sin(60.0 * TIME), true_spin_torque=None)
    low, high = plots(spin_figure(series, CAP))[0]["layout"]["yaxis"].get("range", (-np.inf, np.inf))
    assert high - low >= 2.0 * MIN_SPIN_SPAN
    assert low <= -0.99e3 * peak < 0.99e3 * peak <= high


def test_every_phase_has_its_own_colour():
    assert set(GROUNDS) == set(Phase)
    shades = np.array([[int(each.light[i : i + 2], 16) for i in (1, 3, 5)] for each in GROUNDS.values()])
    assert len(np.unique(shades, axis=0)) == len(Phase)
    stop, done = (shades[list(GROUNDS).index(phase)] for phase in (Phase.STOP, Phase.DONE))
    assert np.abs(stop - done).max() > 12, "they stand side by side at the end of every run"


COUNT = 4000
APART_FROM = 1500
"""Row from which the replayed run differs from the recorded run."""


def run_record(scale=1.0, force=2.0, touched=True):
    """Return the columns of a run that pictures of a replay read."""
    time = np.arange(COUNT) * 1e-3
    velocity = np.stack([0.02 * np.sin(time), 0.01 * np.cos(time), np.full(COUNT, -0.005)], axis=1)
    velocity[APART_FROM:] *= scale
    phase = np.array(["approach"] * 1000 + ["scan"] * 2900 + ["lift"] * 100)
    touching = (time >= 1.0) & touched
    return SimpleNamespace(
        time=time, phase=phase, command=velocity, touching=touching, normal_force=np.full(COUNT, force)
    )


def test_without_a_difference_or_contact_there_is_no_picture_of_a_replay():
    assert difference_figure(run_record(), run_record()) is None
    assert felt_figure(run_record(touched=False), run_record(touched=False)) is None
    assert felt_figure(run_record(touched=False), run_record()) is not None


def test_each_axis_has_the_recorded_line_and_a_thin_replayed_line_over_it():
    runs = run_record(), run_record(1.1, 2.01)
    for i, panel in enumerate(panels(velocity_figure(*runs))):
        lines = marks(panel, Line)
        assert (panel.x.run_time, panel.y.label) == (True, f"{'xyz'[i]} [mm/s]")
        assert lines[0].width > 2.0 * lines[1].width
        for line, run in zip(lines, runs, strict=True):
            assert line.y == pytest.approx(1e3 * run.command[:, i])


def test_a_difference_is_drawn_on_a_logarithmic_scale_from_its_first_row_or_as_a_point():
    picture = difference_figure(run_record(), run_record(1.1, 2.01))
    (panel,) = panels(picture)
    (line,) = marks(panel, Line)
    assert panel.y.logarithmic
    assert np.isnan(line.y[:APART_FROM]).all()
    assert line.y[APART_FROM:] == pytest.approx(1e2 * np.linalg.norm(run_record().command[APART_FROM:], axis=1))
    assert re.search(r"largest is [\d.]+ mm/s", picture.caption)
    replayed = run_record()
    replayed.command[2000, 0] += 1e-9
    (points,) = marks(panels(difference_figure(run_record(), replayed))[0], Points)
    assert points.x == replayed.time[2000], "a line through one point would not show"


@settings(max_examples=200, deadline=None)
@given(count=st.integers(1, 3000), bins=st.integers(1, 200), missing=st.floats(0.0, 1.0), seed=st.integers(0, 99))
def test_a_thinned_series_keeps_extremes_ends_and_order(count, bins, missing, seed):
    rng = np.random.default_rng(seed)
    time, value = np.arange(count) * 0.5, rng.normal(size=count)
    value[rng.random(count) < missing] = np.nan
    t, v = envelope(time, value, bins)
    assert len(t) == len(v) <= max(3 * bins + 2, 2 * bins)
    assert (np.diff(t) > 0.0).all()
    np.testing.assert_array_equal(v, value[(2 * t).astype(int)])  # samples of the series
    if np.isfinite(value).any():
        assert (np.nanmin(v), np.nanmax(v)) == (np.nanmin(value), np.nanmax(value))
    assert (t[0], t[-1]) == (time[0], time[-1])
    assert np.isnan(v).any() == np.isnan(value).any()


def test_a_thinned_series_keeps_the_peak_of_every_bin_and_every_gap():
    time, value = np.arange(100_000.0), np.zeros(100_000)
    peaks = np.random.default_rng(0).choice(100_000, 50, replace=False)
    value[peaks] = 1.0 + peaks
    value[50_001] = np.nan
    t, v = envelope(time, value, 1000)
    last_peaks = {peak // 100: float(peak) for peak in sorted(peaks.tolist())}
    assert set(t[v > 0].tolist()) >= set(last_peaks.values())
    assert t[np.isnan(v)].tolist() == [50_001.0]


def test_short_series_are_drawn_whole():
    time = np.arange(20.0)
    t, v = envelope(time, time**2, 10)
    assert t is time
    np.testing.assert_array_equal(v, time**2)


def cells(confusion):
    (panel,) = panels(confusion_figure(confusion))
    return panel.marks[0]


def test_every_share_is_written_in_its_cell_and_rare_ones_are_not_rounded_away():
    counts = np.array([[998, 1, 1], [0, 500, 500], [0, 0, 0], [0, 0, 7]])
    shown = cells(Confusion(("a", "b", "c", "brick"), ("a", "b", UNKNOWN), counts))
    assert shown.texts == (">99", "<1", "<1", "", "50", "50", "", "", "", "", "", "100")
    assert (shown.rows, shown.columns) == (("a", "b", "c", "brick"), ("a", "b", UNKNOWN))
    assert np.isfinite(shown.colouring.values).tolist() == [text != "" for text in shown.texts]


@pytest.mark.parametrize("count", [2, MOST_FIGURES + 5])
def test_long_names_stay_distinct_and_many_rows_have_no_numbers(count):
    names = tuple(f"as {'very ' * 9}long as {i}" for i in range(count))
    shown = cells(Confusion(names, (*names, UNKNOWN), np.eye(count, count + 1, dtype=np.int64)))
    assert bool(shown.texts) == (count < MOST_FIGURES)
    assert len(set(shown.rows)) == count
    assert all(len(name) <= LONGEST_NAME + 4 for name in shown.rows)
