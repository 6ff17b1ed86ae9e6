"""The picture of a grasp says what its numbers say."""

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.grasp.problem.contacts import GraspContacts
from palpate.reporting.grasp_force_picture import grasp_force_picture, limit_shares
from palpate.reporting.marks import Bars, Rule
from palpate.reporting.solids import Arrows, Surface
from support.drawn import panels

PAIR = GraspContacts(
    [[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0]], [np.eye(3), np.diag([-1.0, -1.0, 1.0])], [0.5, 0.8], [0.005, 0.005]
)
FORCES = np.array([[10.0, 3.0, 0.0, 0.02], [10.0, 0.0, 0.0, 0.0]])
LOAD = np.array([0.0, 3.0, 0.0, 0.02, 0.0, 0.0])


def test_shares_are_of_the_limit():
    """3 N and 20 mN m of mu f = 5 N with e = 5 mm: 3 and 4 of 5, which is all there is."""
    assert limit_shares(PAIR, FORCES) == pytest.approx(np.array([[1.0, 0.6, 0.8], [0.0, 0.0, 0.0]]))
    assert np.isnan(limit_shares(PAIR, np.zeros((2, 4)))).all()


def test_arrows_end_at_contacts_cones_open_by_friction_and_bars_stand_beside_the_limit():
    space, bars = panels(grasp_force_picture(PAIR, FORCES, LOAD, np.array([0, 0, 0, 0.03, 0, 0.0])))
    arrows = {mark.name: mark for mark in space.marks if isinstance(mark, Arrows)}
    assert set(arrows) == {"contact force", "load", "worst moment"}
    pushes, load = arrows["contact force"], arrows["load"]
    assert pushes.starts + pushes.along == pytest.approx(PAIR.positions)
    # both on the same scale
    assert np.linalg.norm(load.along) / np.linalg.norm(pushes.along[1]) == pytest.approx(0.3)
    (cones,) = (mark for mark in space.marks if isinstance(mark, Surface))
    apex, *rim = cones.vertices[: len(cones.vertices) // 2]
    along = np.array(rim) - apex
    assert np.hypot(along[:, 1], along[:, 2]) == pytest.approx(0.5 * along[:, 0])
    together = next(mark for mark in bars.marks if isinstance(mark, Bars))
    assert together.length == pytest.approx([1.0, 0.0])
    assert [mark.at for mark in bars.marks if isinstance(mark, Rule)] == [1.0]
    assert [name for _, name in bars.y.ticks] == ["1: 10.00 N", "2: 10.00 N"]


def test_one_contact_without_load_is_a_picture():
    space, _ = grasp_force_picture(PAIR.chosen([0]), np.zeros((1, 4)), np.zeros(6)).panels
    assert all(np.isfinite(mark.along).all() for mark in space.marks if isinstance(mark, Arrows))


def test_shapes_that_do_not_go_together_are_refused():
    with pytest.raises(InvalidValueError, match=r"forces has shape \(3, 4\): must be \(2, 4\)"):
        grasp_force_picture(PAIR, np.zeros((3, 4)), LOAD)
    with pytest.raises(InvalidValueError, match=r"disturbance has shape \(3,\)"):
        grasp_force_picture(PAIR, FORCES, LOAD, np.zeros(3))
