"""Pictures of a replay: recorded and replayed over one another, and how far they are apart."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.commands.replay.pictures import difference_picture, felt_picture, velocity_picture
from palpate.reporting.marks import Line, Points
from support.drawn import panels

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


def marks(panel, kind):
    return [mark for mark in panel.marks if isinstance(mark, kind)]


def test_without_a_difference_or_contact_there_is_no_picture_of_it():
    assert difference_picture(side(), side()) is None
    assert felt_picture(side(touched=False), side(touched=False)) is None
    assert felt_picture(side(touched=False), side()) is not None


def test_each_axis_has_both_lines_the_replayed_one_thin_and_on_top():
    picture = velocity_picture(*OTHER)
    assert [panel.y.label for panel in panels(picture)] == ["x [mm/s]", "y [mm/s]", "z [mm/s]"]
    for i, panel in enumerate(panels(picture)):
        recorded, replayed = marks(panel, Line)
        assert panel.x.run_time
        assert recorded.width > 2.0 * replayed.width
        for line, own in zip((recorded, replayed), OTHER, strict=True):
            assert line.y == pytest.approx(1e3 * own.command[:, i])


def test_the_difference_is_drawn_on_a_logarithmic_scale_from_where_there_is_one():
    picture = difference_picture(*OTHER)
    (panel,) = panels(picture)
    (line,) = marks(panel, Line)
    assert panel.y.logarithmic
    assert np.isnan(line.y[:APART_FROM]).all()
    assert line.y[APART_FROM:] == pytest.approx(1e2 * np.linalg.norm(side().command[APART_FROM:], axis=1))
    assert re.search(r"largest is [\d.]+ mm/s", picture.caption)


def test_a_difference_of_one_period_is_seen():
    replayed = side()
    replayed.command[2000, 0] += 1e-9
    (panel,) = difference_picture(side(), replayed).panels
    (points,) = marks(panel, Points)
    assert points.x == TIME[2000], "a line through one point would not show"
