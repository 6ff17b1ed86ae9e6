"""Two fingers hold an object, a third one explores it."""

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.robots.in_scene import check
from palpate.robots.robot import ROBOT_TEXT, load_robot, read_robot
from palpate.runtime import Command, Ending
from palpate.sim.hand.exploring_finger import ExploringFinger
from support.explore_runs import carried_out, plan_of

HAND = load_robot("pinch-and-index")
SMALL = {"robot": "pinch-and-index", "force": 0.5, "speed": 0.02, "width": 0.012, "depth": 0.006}
SHAPES = {
    "sphere": (0.025,),
    "ellipsoid": (0.025, 0.02, 0.02),
    "box": (0.04, 0.04, 0.04),
    "cylinder": (0.02, 0.05),
}
NEAR, SLIPPED = 0.02e-3, 0.02e-3
"""[m] of points from the true surface, RMS, and of the object in its fingers."""


def changed(*changes):
    """The robot with words of its file replaced."""
    texts = dict(HAND.texts)
    for before, after in changes:
        assert before in texts[ROBOT_TEXT]
        texts[ROBOT_TEXT] = texts[ROBOT_TEXT].replace(before, after, 1)
    return read_robot(texts)


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_the_map_of_a_held_object_is_in_its_frame(shape, noise):
    config = ExploreConfig(object=shape, size=SHAPES[shape], force_noise=noise, moment_noise=1e-2 * noise, **SMALL)
    found = carried_out(plan_of(config))
    assert found.run.ending is Ending.DONE
    assert found.point_rms < NEAR
    assert found.held_motion < SLIPPED
    assert found.claimed_map.rms < NEAR
    assert found.force_rms < 0.05


def test_the_object_is_held_where_it_was_put_until_it_is_pushed():
    backend = plan_of(ExploreConfig(size=(0.025,), **SMALL)).backend()
    assert isinstance(backend, ExploringFinger)
    first = backend.start()
    assert first.time == 0.0
    assert first.arm.position_base_tip[2] > 0.031
    assert np.array(backend.truth().pose_base_object.rotation) == pytest.approx(np.eye(3), abs=1e-9)
    for _ in range(200):
        sample = backend.step(Command((0.002, 0.0, 0.0)))
    moved = np.subtract(sample.arm.position_base_tip, first.arm.position_base_tip)
    assert moved == pytest.approx((0.0004, 0.0, 0.0), abs=3e-5)
    assert sample.arm.velocity_base_tip == pytest.approx((0.002, 0.0, 0.0), abs=2e-4)
    assert np.abs(backend.truth().pose_base_object.position).max() < 1e-7


def test_a_grip_that_would_slip_is_refused_with_the_least_that_would_do():
    config = ExploreConfig(size=(0.025,), **SMALL)
    with pytest.raises(
        InvalidValueError, match=r"backend.grip_N = 2: must be at least [0-9.]+ for an object of 0.2 kg"
    ):
        plan_of(config, changed(("grip_N: 10 ", "grip_N: 2 ")))


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ((", right_sensor]", "]"), "it has 2 fingers, and there are 3 under fingers"),
        (("file: pinch-and-index ", "file: grabber "), "must be a file .*, or one of the hands pinch-and-index"),
        (("[index_sensor,", "[thumb_sensor,"), "no site, body or link is called 'thumb_sensor'"),
        (("radius_m: 0.006", "radius_m: 0.3"), "links stretched out reach"),
    ],
)
def test_a_hand_that_cannot_be_is_refused(change, match):
    with pytest.raises(InvalidValueError, match=match):
        check(changed(change))
