"""The same exploration by a stage that can also turn: one word is changed."""

import pytest

from palpate.errors import InvalidValueError
from palpate.open_kinds import as_written
from palpate.robots.in_scene import check
from palpate.robots.robot import load_robot
from palpate.robots.robot_file import read_robot_file
from palpate.robots.simulated_stage import TurningStageEntry
from palpate.sim import TurningStage
from palpate.yaml_text import yaml_text


def test_what_its_file_leaves_out_is_what_the_stage_is_by_itself():
    entry, stage = TurningStageEntry(), TurningStage()
    assert (entry.mass, entry.inertia, entry.bandwidth) == (stage.mass, stage.inertia, stage.bandwidth)
    assert (entry.following_error_limit, entry.angular_following_error) == (
        stage.following_error_limit.distance,
        stage.following_error_limit.angle,
    )


def test_its_file_reads_back_to_the_same():
    robot = load_robot("turning-stage")
    check(robot)
    assert isinstance(robot.file.backend, TurningStageEntry)
    assert read_robot_file(yaml_text(as_written(robot.file))) == robot.file


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("inertia_kg_m2", "0"),
        ("inertia_kg_m2", "1e3"),
        ("angular_following_error_rad", "3.4"),
        ("angular_following_error_rad", "-1"),
    ],
)
def test_what_cannot_be_is_refused_with_its_key(key, value):
    text = yaml_text(as_written(load_robot("turning-stage").file))
    line = next(line for line in text.splitlines() if line.strip().startswith(key))
    with pytest.raises(InvalidValueError, match=rf"{key} = .*must be from"):
        read_robot_file(text.replace(line, f"{line.split(':')[0]}: {value}"))
