"""Scenes from files in experiments: what is known of them, how they are replayed, what they yield."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from palpate.commands.view.free_bodies import free_poses_in
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.scene_texts import SCENE_FILES_TEXT, SCENE_TEXT
from palpate.runtime.log import read_log
from palpate.sim.contact_truth import OBJECT_ROTATION
from palpate.viewing.frames import frames_of_log
from support.explore_runs import carried_out, plan_of
from support.regulate_runs import logged, planned

SCENES = Path(__file__).parents[2] / "examples" / "scenes"
SMALL = {"speed": 0.04, "width": 0.008, "depth": 0.006, "force_noise": 0.01, "moment_noise": 1e-5}


@pytest.fixture
def own(tmp_path):
    """The scenes, in a folder that can be deleted."""
    return Path(shutil.copytree(SCENES, tmp_path / "own"))


def rms(error):
    return float(np.sqrt(np.mean(np.square(error))))


@pytest.mark.slow
def test_a_ball_from_a_file_is_mapped_as_exactly_as_the_built_in_one(own):
    (own / "ball.xml").write_text('<mujoco><worldbody><geom size="0.012" pos="1 2 3"/></worldbody></mujoco>')
    one = carried_out(plan_of(ExploreConfig(object="sphere", size=(0.012,), **SMALL)))
    other = carried_out(plan_of(ExploreConfig(object="scene", file=own / "ball.xml", **SMALL)))
    assert other.point_rms <= 1.1 * one.point_rms
    assert rms(other.map.error) <= 1.1 * rms(one.map.error)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "touch"), [("bottle", "bottle"), ("handle", "lever")])
def test_an_exploration_is_planned_and_carried_out_again_from_what_the_log_keeps(own, name, touch):
    config = ExploreConfig(object="scene", file=own / f"{name}.xml", touch=touch, **SMALL)
    first = plan_of(config)
    texts = dict(first.texts())
    found = carried_out(first)
    shutil.rmtree(own)
    again = plan(first.config, first.robot, texts)
    assert again.texts() == texts
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
    again = LoggedRun.of(read_log(path)).found()
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
    assert contact.mounting.stiffness == pytest.approx(2.0 / 0.06**2, rel=1e-9)
    assert contact.mounting.damping == pytest.approx(0.08 / 0.06**2, rel=1e-9)
    assert 0.15 < contact.mounting.mass < 0.3
    with pytest.raises(InvalidValueError, match=r"contact stiffness = 20000 N/m.*take a stiffness of at most"):
        planned(object="scene", file=SCENES / "handle.xml", touch="lever")
    assert planned(object="scene", file=SCENES / "handle.xml", touch="leaf").contact.mounting is None
