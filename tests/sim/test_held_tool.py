"""A tool that a hand holds, as a robot with one fingertip."""

import numpy as np
import pytest

from palpate.experiments.explore.config import ExploreConfig
from palpate.robots.in_scene import check
from palpate.robots.robot import ROBOT_TEXT, load_robot, read_robot
from palpate.runtime import Command, Ending, Touch
from palpate.sim.hand.held_tool import GraspedTool
from support.explore_runs import carried_out, plan_of
from support.refusals import check_refusals
from support.run_bounds import below, check_bounds

PIN = load_robot("stage-pin")
SMALL = {"robot": "stage-pin", "force": 1.0, "speed": 0.02, "width": 0.012, "depth": 0.004}
EXACT = [(f"preset: nano17, specimen: {i}, cross_talk: 0.001, tare_s: 1", "preset: perfect") for i in (1, 2)]
EXACT.append(("noise: {force_N: 0.0045, moment_Nm: 0.00005}", "noise: {force_N: 0.0, moment_Nm: 0.0}"))


def changed(*changes):
    """The robot with words of its file replaced."""
    texts = dict(PIN.texts)
    for before, after in changes:
        assert before in texts[ROBOT_TEXT]
        texts[ROBOT_TEXT] = texts[ROBOT_TEXT].replace(before, after, 1)
    return read_robot(texts)


@pytest.mark.slow
def test_what_the_fingers_feel_together_is_what_the_pin_feels():
    planned = plan_of(ExploreConfig(**SMALL), changed(*EXACT))
    backend, touch = planned.backend(), Touch(*planned.fingers)
    assert isinstance(backend, GraspedTool)
    now = touch.sense(backend.start())
    assert np.abs(now.fingers[0].wrench).max() < 1e-4  # tared: neither weight nor squeeze
    while np.linalg.norm(now.fingers[0].force) < 1.0:  # down, until it presses
        now = touch.sense(backend.step(Command((0.0, 0.0, -0.003))))
    truth = backend.truth()
    arm = np.subtract(truth.position, now.arm.position_base_tip)
    moment = np.cross(arm, truth.force) + truth.torque
    assert now.fingers[0].wrench == pytest.approx([*truth.force, *moment], abs=2e-3)
    assert now.fingers[0].contact.centroid == pytest.approx(arm, abs=5e-5)
    assert np.linalg.norm(backend.pose_tip_tool().position) < 5e-6  # and it has not slipped


def test_what_cannot_hold_or_is_no_tool_is_refused():
    text, small = PIN.texts[ROBOT_TEXT], ExploreConfig(**SMALL)
    no_hand = text[: text.index("  hand:")] + text[text.index("  tool:") :]
    check_refusals(
        (
            r"backend.tool.grip_N = 1: must be at least 2.08 for forces of up to 2 N",
            lambda: plan_of(small, changed(("grip_N: 7 ", "grip_N: 1 "))),
        ),
        (
            r"fingers\[0\].noise.force_N = 0.001 .* together, 0.00442",
            lambda: plan_of(small, changed(("force_N: 0.0045,", "force_N: 0.001,"))),
        ),
        (
            r"tip: what the hand holds is .* change it there",
            lambda: plan_of(ExploreConfig(tip=(0.004,), **SMALL)),
        ),
        ("there is no hand that could hold it", lambda: read_robot({**PIN.texts, ROBOT_TEXT: no_hand})),
    )


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["stage-pin", "ur5e-pin"])
def test_a_pin_makes_a_map_with_an_error_that_is_true(robot):
    check(load_robot(robot))
    found = carried_out(plan_of(ExploreConfig(**{**SMALL, "robot": robot, "speed": 0.01})))
    # the pin yields by 25 um per 0.6 N across, and does not slip
    bounds = below(claimed_map__rms=0.02e-3, point_rms=0.05e-3, held_motion=0.1e-3)
    check_bounds(found, bounds, run__ending=Ending.DONE)
    assert found.truth.object_position == pytest.approx(np.zeros_like(found.truth.object_position))
