"""Logs of experiments as other tools see them once a run is over; palpate replays them as before."""

from typing import Any

import numpy as np
import pytest

from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.experiments.kit.recording import log_writer, tell_log
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.script import plan_for
from palpate.runtime.live import live_parameters_of
from palpate.runtime.log import log_in, read_log
from palpate.runtime.replay import RecordedChanges
from runtime.log.test_standard_topics import messages, numbers


def carried_out(name, config, folder) -> Any:
    """A run, its log told to all; returns what was found."""
    experiment = experiment_named(name)
    plan = plan_for(experiment, config).prepared()
    run = RecordedRun(plan)
    result = run.run(sinks=(log_writer(experiment, plan, folder),))
    before = read_log(log_in(folder))
    found = experiment.found(plan, run.recorded(result))
    tell_log(plan, result, experiment.cloud(found))
    after = read_log(log_in(folder))
    assert after.rows.tobytes() == before.rows.tobytes()
    return found


@pytest.mark.slow
def test_an_exploration_has_its_map_and_is_replayed_bit_for_bit(tmp_path):
    found = carried_out("explore", ExploreConfig(width=0.01, depth=0.004, force_noise=0.01), tmp_path)
    told = messages(log_in(tmp_path))
    ((_, cloud),) = told["/map"]
    points = np.frombuffer(bytes(cloud.data), "<f4").reshape(cloud.width, -1)
    assert points[:, :3] == pytest.approx(found.map.mesh.vertices, abs=1e-7)
    assert [field.name for field in cloud.fields][3:7] == ["normal_x", "normal_y", "normal_z", "band"]
    assert len(told["/finger_0/contact"]) > 100
    logged = LoggedRun.of(read_log(log_in(tmp_path)))
    again = RecordedRun(logged.plan(), logged.backend())
    again.run(live=RecordedChanges(live_parameters_of(again.controller), logged.log.changes))
    commands = again._memory.kept_rows()[:, again._memory.codec.columns["command.velocity"]]
    columns = logged.log.codec.columns["command.velocity"]
    assert commands.tobytes() == logged.log.rows[: len(commands), columns].tobytes()
    assert len(commands) > 1000


@pytest.mark.slow
def test_the_fingers_of_a_hand_are_where_its_geometry_says(tmp_path):
    found = carried_out("grasp", GraspConfig(), tmp_path)
    hand = plan_for(experiment_named("grasp"), GraspConfig()).hand_kinematics
    log, told = read_log(log_in(tmp_path)), messages(log_in(tmp_path))
    rows = log.rows[log.sequence % 10 == 0][:, log.codec.columns["hand.joint_position"]]
    for joints, (_, message) in zip(rows[::50].tolist(), told["/tf"][::50], strict=True):
        poses = hand.sensor_poses(tuple(joints))
        for pose, transform in zip(poses, message.transforms[1:], strict=True):
            assert transform.header.frame_id == "hand"
            assert tuple(numbers(transform.transform.translation)) == pose.position
    assert "/map" not in told
    assert found.run.done
