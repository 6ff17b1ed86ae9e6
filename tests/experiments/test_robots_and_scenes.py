"""Experiments on hands, arms and scenes from files: planned, refused, carried out and replayed."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from palpate.commands.view.scene import free_poses_in
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan
from palpate.experiments.explore.plan import plan as explore_plan
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.friction.plan import plan as friction_plan
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.scene import SCENE_FILES_TEXT, SCENE_TEXT
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.plan import plan_regulation
from palpate.robots.in_scene import check
from palpate.robots.robot import load_robot
from palpate.runtime import Command, Ending
from palpate.runtime.log import read_log
from palpate.sim.contact_truth import OBJECT_ROTATION
from palpate.sim.hand.exploring_finger import ExploringFinger
from palpate.viewing.frames import frames_of_log
from support.emulated_file import changed_robot
from support.explore_runs import carried_out, plan_of
from support.file_arms import GANTRY
from support.regulate_runs import logged, planned
from support.run_bounds import below, check_bounds

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


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_the_map_of_a_held_object_is_in_its_frame(shape, noise):
    config = ExploreConfig(object=shape, size=SHAPES[shape], force_noise=noise, moment_noise=1e-2 * noise, **SMALL)
    found = carried_out(plan_of(config))
    bounds = below(point_rms=NEAR, held_motion=SLIPPED, claimed_map__rms=NEAR, force_rms=0.05)
    check_bounds(found, bounds, run__ending=Ending.DONE)


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
        check(changed_robot(HAND, change))


def test_a_grip_that_would_slip_is_refused_with_the_least_that_would_do():
    robot = changed_robot(HAND, ("grip_N: 10 ", "grip_N: 2 "))
    with pytest.raises(InvalidValueError, match=r"grip_N = 2: must be at least [0-9.]+ for an object of 0.2 kg"):
        plan_of(ExploreConfig(size=(0.025,), **SMALL), robot)


# --- Scenes from files in experiments: what is known of them, how they are replayed, what they yield ---


SCENES = Path(__file__).parents[2] / "examples" / "scenes"
SMALL_EXPERIMENTS = {"speed": 0.04, "width": 0.008, "depth": 0.006, "force_noise": 0.01, "moment_noise": 1e-5}


@pytest.fixture
def own(tmp_path):
    """The scenes, in a folder that can be deleted."""
    return Path(shutil.copytree(SCENES, tmp_path / "own"))


def rms(error):
    return float(np.sqrt(np.mean(np.square(error))))


@pytest.mark.slow
def test_a_ball_from_a_file_is_mapped_as_exactly_as_the_built_in_one(own):
    (own / "ball.xml").write_text('<mujoco><worldbody><geom size="0.012" pos="1 2 3"/></worldbody></mujoco>')
    one = carried_out(plan_of(ExploreConfig(object="sphere", size=(0.012,), **SMALL_EXPERIMENTS)))
    other = carried_out(plan_of(ExploreConfig(object="scene", file=own / "ball.xml", **SMALL_EXPERIMENTS)))
    assert other.point_rms <= 1.1 * one.point_rms
    assert rms(other.map.error) <= 1.1 * rms(one.map.error)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "touch"), [("bottle", "bottle"), ("handle", "lever")])
def test_an_exploration_is_planned_and_carried_out_again_from_what_the_log_keeps(own, name, touch):
    config = ExploreConfig(object="scene", file=own / f"{name}.xml", touch=touch, **SMALL_EXPERIMENTS)
    first = plan_of(config)
    texts = dict(first.attachments())
    found = carried_out(first)
    shutil.rmtree(own)
    again = plan(first.config, first.robot, texts)
    assert again.attachments() == texts
    second = carried_out(again)
    assert np.array_equal(second.record.command, found.record.command)
    assert np.array_equal(second.truth.force, found.truth.force)
    assert np.array_equal(second.point_error, found.point_error)
    assert found.point_rms < 1e-5
    for missing in (SCENE_TEXT, SCENE_FILES_TEXT):
        with pytest.raises(InvalidValueError, match=rf"'{missing}' is missing"):
            plan(first.config, first.robot, {key: text for key, text in texts.items() if key != missing})


@pytest.mark.slow
def test_a_force_is_held_on_a_lever_that_gives_way_and_its_log_needs_no_file(own, tmp_path):
    path = tmp_path / "run.mcap"
    found = logged(
        planned(object="scene", file=own / "handle.xml", touch="lever", stiffness=4e3, duration=3.0), path
    )
    shutil.rmtree(own)
    again = LoggedRun.of(read_log(path)).evaluate()
    for one in ("true_force", "sensed_force", "set_force"):
        known = getattr(again, one)  # until the controller was done
        assert np.array_equal(known, getattr(found, one)[: len(known)], equal_nan=True)
    assert found.true_rms < 0.05
    log, view = read_log(path), LoggedRun.of(read_log(path)).plan().view()
    truth, frames = log.truth.column(*OBJECT_ROTATION), frames_of_log(log, free_poses_in(log))
    for i in (0, len(frames) // 2):
        shown = view.placement.poses(frames.posture(i))["object_scene/handle"]
        assert np.ravel(shown.rotation) == pytest.approx(truth[i], abs=1e-9)
    assert truth[len(frames) // 2, 6] < -0.03


def test_the_spring_of_a_hinge_is_what_the_gain_is_made_for():
    # pressed 60 mm from the hinge, where the spring of 2 N m/rad and the damper of 0.08 N m s/rad
    contact = planned(object="scene", file=SCENES / "handle.xml", touch="lever", stiffness=4e3).contact
    found = [contact.mounting.stiffness, contact.mounting.damping]
    assert found == pytest.approx([2.0 / 0.06**2, 0.08 / 0.06**2], rel=1e-9)
    assert 0.15 < contact.mounting.mass < 0.3
    with pytest.raises(InvalidValueError, match=r"contact stiffness = 20000 N/m.*take a stiffness of at most"):
        planned(object="scene", file=SCENES / "handle.xml", touch="lever")
    assert planned(object="scene", file=SCENES / "handle.xml", touch="leaf").contact.mounting is None


# --- What experiments do with arms from files: their planned paths, and arms that cannot turn their tip ---


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
    metrics = {each.name: each for each in explore_plan(config, load_robot(gantry), {}).dry_run().metrics}
    assert metrics["room of joints"].value == pytest.approx(0.025, abs=1e-3)
    assert "of joint 1, after" in metrics["room of joints"].note
    assert metrics["fastest joint"].value == pytest.approx(100.0 * config.speed / 0.5, rel=0.02)


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
