"""Pictures of a replay: recorded and replayed over one another, and how far they are apart."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import to_hex

from palpate.commands.replay.pictures import (
    RECORDED,
    REPLAYED,
    difference_picture,
    felt_picture,
    velocity_picture,
)

COUNT = 4000
TIME = np.arange(COUNT) * 1e-3
PHASES = np.array(["approach"] * 1000 + ["scan"] * 2900 + ["lift"] * 100)
APART_FROM = 1500


def side(scale=1.0, force=2.0, touched=True):
    """What pictures take of a record."""
    velocity = np.stack([0.02 * np.sin(TIME), 0.01 * np.cos(TIME), np.full(COUNT, -0.005)], axis=1)
    velocity[APART_FROM:] *= scale
    touching = (TIME >= 1.0) & touched
    return SimpleNamespace(
        time=TIME, phase=PHASES, command=velocity, touching=touching, normal_force=np.full(COUNT, force)
    )


OTHER = side(), side(1.1, 2.01)


def lines(axes):
    return {to_hex(line.get_color()): line for line in axes.lines}


def test_without_a_difference_or_contact_there_is_no_picture_of_it():
    assert difference_picture(side(), side()) is None
    assert felt_picture(side(touched=False), side(touched=False)) is None
    assert felt_picture(side(touched=False), side()) is not None


def test_each_axis_has_both_lines_the_replayed_one_thin_and_on_top():
    picture = velocity_picture(*OTHER)
    for figure in (picture.full, picture.narrow):
        assert [axes.get_ylabel() for axes in figure.axes] == ["x [mm/s]", "y [mm/s]", "z [mm/s]"]
        assert figure.axes[-1].get_xlabel() == "time [s]"
        for i, axes in enumerate(figure.axes):
            recorded, replayed = lines(axes)[RECORDED], lines(axes)[REPLAYED]
            assert axes.lines.index(replayed) > axes.lines.index(recorded)
            assert recorded.get_linewidth() > 2.0 * replayed.get_linewidth()
            # no peak is lost
            for line, own in zip((recorded, replayed), OTHER, strict=True):
                drawn = np.asarray(line.get_ydata())
                assert np.max(drawn) == pytest.approx(1e3 * own.command[:, i].max())
                assert np.min(drawn) == pytest.approx(1e3 * own.command[:, i].min())


def test_the_difference_is_drawn_on_a_logarithmic_scale_from_where_there_is_one():
    picture = difference_picture(*OTHER)
    (axes,) = picture.full.axes
    assert axes.get_yscale() == "log"
    assert axes.get_xlim()[0] == TIME[0]
    (line,) = axes.lines
    time, drawn = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
    assert np.isnan(drawn[time < TIME[APART_FROM]]).all()
    assert np.isfinite(drawn[time >= TIME[APART_FROM]]).all()
    apart = 1e3 * 0.1 * np.linalg.norm(side().command[APART_FROM:], axis=1)
    assert np.nanmax(drawn) == pytest.approx(apart.max())
    assert re.search(r"largest is [\d.]+ mm/s", picture.caption)


def test_a_difference_of_one_period_is_seen():
    replayed = side()
    replayed.command[2000, 0] += 1e-9
    (axes,) = difference_picture(side(), replayed).full.axes
    (line,) = axes.lines
    assert np.isfinite(np.asarray(line.get_ydata())).sum() == 1
    assert line.get_marker() == "."  # a line through one point would not show
