"""The picture of a grasp says what its numbers say."""

import numpy as np
import pytest
from matplotlib.patches import Rectangle

from palpate.errors import InvalidValueError
from palpate.grasp.contacts import GraspContacts
from palpate.reporting.encode import svg_uri
from palpate.reporting.grasp_force_picture import grasp_force_picture, limit_shares

PAIR = GraspContacts(
    [[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0]], [np.eye(3), np.diag([-1.0, -1.0, 1.0])], [0.5, 0.8], [0.005, 0.005]
)
FORCES = np.array([[10.0, 3.0, 0.0, 0.02], [10.0, 0.0, 0.0, 0.0]])
LOAD = np.array([0.0, 3.0, 0.0, 0.02, 0.0, 0.0])


def test_shares_are_of_the_limit():
    """3 N and 20 mN m of mu f = 5 N with e = 5 mm: 3 and 4 of 5, which is all there is."""
    assert limit_shares(PAIR, FORCES) == pytest.approx(np.array([[1.0, 0.6, 0.8], [0.0, 0.0, 0.0]]))
    assert np.isnan(limit_shares(PAIR, np.zeros((2, 4)))).all()


def test_it_is_drawn_with_bars_for_every_contact_and_a_line_at_the_limit():
    picture = grasp_force_picture(PAIR, FORCES, LOAD, np.array([0, 0, 0, 0.03, 0, 0.0]))
    space, bars = picture.full.axes
    drawn = [bar.get_width() for bar in bars.patches[:2] if isinstance(bar, Rectangle)]
    assert drawn == pytest.approx([1.0, 0.0])
    assert [label.get_text() for label in bars.get_yticklabels()] == ["1: 10.00 N", "2: 10.00 N"]
    assert len([line for line in bars.lines if list(line.get_xdata()) == [1.0, 1.0]]) == 1
    assert [text.get_text() for text in space.texts] == ["1", "2"]
    assert picture.narrow is not None
    for figure in (picture.full, picture.narrow):
        assert svg_uri(figure).startswith("data:image/svg+xml")


def test_it_is_drawn_without_load_and_for_one_contact():
    one = PAIR.chosen([0])
    assert svg_uri(grasp_force_picture(one, np.zeros((1, 4)), np.zeros(6)).full)


def test_shapes_that_do_not_go_together_are_refused():
    with pytest.raises(InvalidValueError, match=r"forces has shape \(3, 4\): must be \(2, 4\)"):
        grasp_force_picture(PAIR, np.zeros((3, 4)), LOAD)
    with pytest.raises(InvalidValueError, match=r"disturbance has shape \(3,\)"):
        grasp_force_picture(PAIR, FORCES, LOAD, np.zeros(3))
