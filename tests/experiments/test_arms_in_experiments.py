"""What experiments do with arms from files: their planned paths, and arms that cannot turn their tip."""

import pytest

from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan as explore_plan
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.friction.plan import plan as friction_plan
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.plan import plan_regulation
from palpate.robots.robot import load_robot
from support.file_arms import GANTRY

ROBOT = """
palpate_robot: 1
name: gantry
backend: {kind: mjcf, file: gantry.xml, base: {position_m: [-0.27, 0, -0.5]}}
period_s: 0.001
fingers: [{surface: {kind: sphere, radius_m: 0.008}, payload: {mass_kg: 0.03}}]
limits: {force_N: 20, impact_force_N: 50}
"""


@pytest.fixture
def gantry(tmp_path):
    """It stands where its first slide ends 30 mm beyond the middle of the object."""
    flange = GANTRY.replace('<site name="flange"/>', '<site name="flange" zaxis="0 0 -1"/>')
    (tmp_path / "gantry.xml").write_text(flange)
    (tmp_path / "gantry.yaml").write_text(ROBOT)
    return str(tmp_path / "gantry.yaml")


def test_a_dry_run_says_how_near_the_joints_come_to_their_limits(gantry):
    config = ExploreConfig(robot=gantry, width=0.01, depth=0.004)
    figures = {each.name: each for each in explore_plan(config, load_robot(gantry), {}).dry_run().figures}
    assert figures["room of joints"].value == pytest.approx(0.025, abs=1e-3)
    assert "of joint 1, after" in figures["room of joints"].note
    assert figures["fastest joint"].value == pytest.approx(100.0 * config.speed / 0.5, rel=0.02)


def test_a_path_that_the_joints_cannot_follow_is_refused_before_a_run(gantry):
    robot = load_robot(gantry)
    with pytest.raises(InvalidValueError, match=r"gantry cannot follow the path: .* of joint 1, after"):
        explore_plan(ExploreConfig(robot=gantry, object="bumps", width=0.03, depth=0.004), robot, {})
    config = RegulateConfig(robot=gantry, motion="sine", motion_size=0.02)
    with pytest.raises(InvalidValueError, match=r"gantry cannot follow the path: .* of joint 1, after"):
        plan_regulation(config, robot, {})


def test_friction_of_an_arm_of_three_joints_is_without_twists(gantry):
    planned = friction_plan(FrictionConfig(robot=gantry, quick=True), load_robot(gantry), {})
    assert planned.wanted.most_spin == 0.0
    with pytest.raises(InvalidValueError, match="it cannot turn its tip, which --fit-exponents asks for"):
        friction_plan(FrictionConfig(robot=gantry, fit_exponents=True), load_robot(gantry), {})
