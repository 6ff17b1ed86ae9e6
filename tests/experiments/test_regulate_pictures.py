"""Pictures of force control: errors only while it is held, single steps about their mean, the bandwidth marked."""

import numpy as np
import pytest

from palpate.experiments.regulate.pictures import bode_picture, error_picture, step_picture
from palpate.experiments.regulate.response import FrequencyResponse, StepResponse
from palpate.reporting.data import TimeSeries
from palpate.reporting.marks import Band, Line, Rule
from support.drawn import panels

TIME = np.arange(300) * 1e-2
PHASES = ["approach"] * 100 + ["hold"] * 150 + ["lift"] * 50
LAG = 0.02  # of a force of first order [s]


def series(phases):
    ones = np.ones(300)
    return TimeSeries(TIME, phases, 2.01 * ones, 2.0 * ones, 0.0 * ones, ones, true_force=1.99 * ones)


def steps(each):
    return StepResponse(TIME, each.mean(axis=0), each, len(each), float(each.max()))


def marks(picture, kind):
    return [mark for panel in picture.panels for mark in panel.marks if isinstance(mark, kind)]


def test_the_error_is_shown_while_the_force_is_held_and_no_longer():
    picture = error_picture(series(PHASES))
    lines = {line.name: line for line in marks(picture, Line)}
    for name, error in (("felt", 10.0), ("true", -10.0)):
        assert np.isfinite(lines[name].y).nonzero()[0].tolist() == list(range(100, 250))
        assert lines[name].y[100:250] == pytest.approx(error)  # [mN]
    assert (panels(picture)[0].x.low, panels(picture)[0].x.high) == pytest.approx((1.0, 2.5))
    assert error_picture(series(["approach"] * 300)) is None


def test_single_steps_lie_in_a_band_about_their_mean_whose_rise_is_marked():
    rising = 1.0 - np.exp(-TIME / LAG)
    picture = step_picture(steps(np.array([0.9 * rising, 1.1 * rising])), None)
    (band,), (mean,) = marks(picture, Band), marks(picture, Line)
    assert (band.low <= mean.y).all()
    assert (mean.y <= band.high).all()
    begin, end = (rule.at for rule in marks(picture, Rule) if rule.upright)
    assert end - begin == pytest.approx(1e3 * LAG * np.log(9.0), rel=0.15)  # [ms]
    assert step_picture(None, None) is None


@pytest.mark.parametrize(("corner", "told"), [(4.0, "at 4 Hz"), (1e3, "does not fall below -3 dB")])
def test_the_bandwidth_is_marked_in_gain_and_phase_if_there_is_one(corner, told):
    frequency = np.geomspace(0.5, 16.0, 31)
    picture = bode_picture({"true": FrequencyResponse(frequency, 1.0 / (1.0 + 1j * frequency / corner))})
    assert told in picture.caption
    marked = [rule.at for rule in marks(picture, Rule) if rule.upright]
    assert marked == ([pytest.approx(corner, rel=1e-3)] * 2 if corner < 16.0 else [])
    assert marks(picture, Line)[0].y[0] == pytest.approx(0.0, abs=0.1)
