"""Robot files that name an arm's own file: read, kept in logs, shown, refused with file and line."""

import numpy as np
import pytest

from commands.test_view_robot import plan_of
from palpate.errors import InvalidValueError
from palpate.kinematics.posture import Posture
from palpate.robots.arm_from_file import ARM_TEXT
from palpate.robots.in_scene import check, over_a_plate
from palpate.robots.robot import load_robot, read_robot, robot_path
from palpate.sim.carriers.arm_file import ARMS
from support.file_arms import own_arm


def beside(folder, ending="xml", arm=None, **changes):
    """A robot file next to an arm's file."""
    text = robot_path("panda-sim").read_text()
    arm_text = (ARMS / f"panda.{ending}").read_text() if arm is None else arm
    (folder / f"mine.{ending}").write_text(arm_text)
    kind = {"xml": "mjcf", "urdf": "urdf"}[ending]
    lines = {"kind: mjcf": f"kind: {kind}", "file: panda ": f"file: mine.{ending} ", **changes}
    for before, after in lines.items():
        assert before in text
        text = text.replace(before, after)
    (folder / "robot.yaml").write_text(text)
    return folder / "robot.yaml"


def test_an_own_file_is_the_same_robot_and_goes_on_from_a_log_without_it(tmp_path):
    path = beside(tmp_path)
    robot = load_robot(str(path))
    check(robot)
    assert robot.texts[ARM_TEXT] == (ARMS / "panda.xml").read_text()
    stiffness = over_a_plate(load_robot("panda-sim")).stiffness
    assert over_a_plate(robot).stiffness == stiffness
    (tmp_path / "mine.xml").unlink()
    again = read_robot(robot.texts)
    assert again.texts == robot.texts
    assert over_a_plate(again).stiffness == stiffness


def test_a_log_keeps_the_arm_that_was_not_what_the_file_became(tmp_path):
    robot = load_robot(str(beside(tmp_path)))
    (tmp_path / "mine.xml").write_text("<mujoco/>")
    assert over_a_plate(read_robot(robot.texts)).stiffness == over_a_plate(robot).stiffness


def test_a_urdf_is_the_arm_that_its_mjcf_is(tmp_path):
    home = "[0, -0.7853981633974483, 0, -2.356194490192345, 0, 1.5707963267948966, 0.7853981633974483]"
    robot = load_robot(str(beside(tmp_path, "urdf", **{"flange: flange": f"home_rad: {home}\n  flange: flange"})))
    assert over_a_plate(robot).stiffness == pytest.approx(
        over_a_plate(load_robot("panda-sim")).stiffness, rel=1e-9
    )


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ('name="flange"', 'name="tool"', r"mine\.xml: flange = 'flange': no site, body or link .* tool"),
        (
            'range="-1.7628 1.7628" ',
            'range="1 -1" ',
            r"mine\.xml, line \d+: the range of joint joint2 is empty, 1 to -1",
        ),
        ('mass="3.228604"', 'mass="0"', r"mine\.xml, line \d+: .*mass.*"),
        (
            "0.088 0 0",
            "88 0 0",
            r"mine\.xml, line \d+: body link7: .* is 88 m; must be at most 10 m: write metres",
        ),
    ],
)
def test_a_bad_arm_is_refused_with_its_file_and_line_before_anything_moves(before, after, message, tmp_path):
    text = (ARMS / "panda.xml").read_text()
    assert before in text
    path = beside(tmp_path, arm=text.replace(before, after))
    with pytest.raises(InvalidValueError, match=message):
        check(load_robot(str(path)))


def test_what_is_not_there_is_refused(tmp_path):
    path = beside(tmp_path)
    (tmp_path / "mine.xml").unlink()
    with pytest.raises(InvalidValueError, match=r"cannot read .*mine\.xml: .* relative to the robot file"):
        load_robot(str(path))
    path.write_text(path.read_text().replace("mine.xml", "pandda"))
    with pytest.raises(
        InvalidValueError, match=r"backend.file = 'pandda': must be a file .* arms panda, ur10e, ur16e, .* xarm6"
    ):
        load_robot(str(path))


@pytest.mark.parametrize(
    ("name", "message"),
    [("panda" + 400 * " a", "one of the arms panda"), (400 * "a" + ".xml", "cannot read .* too long")],
)
def test_a_name_that_no_file_can_have_is_refused(name, message, tmp_path):
    with pytest.raises(InvalidValueError, match=message):
        load_robot(str(beside(tmp_path, **{"file: mine.xml ": f"file: {name} "})))


@pytest.mark.parametrize(
    ("base", "message"),
    [("[-3, 0, 0]", r"cannot hold its tip at .* stretched out reach"), ("[-0.9, 0, 0]", "singular|off")],
)
def test_a_start_that_cannot_be_is_refused_before_a_run(base, message, tmp_path):
    path = beside(tmp_path, **{"position_m: [-0.45, 0, 0]": f"position_m: {base}"})
    with pytest.raises(InvalidValueError, match=message):
        check(load_robot(str(path)))


def test_a_start_at_the_end_of_a_range_is_refused_before_a_run(tmp_path):
    scene = plan_of("explore", "panda-sim").view()
    end = f'range="{scene.placement.start.arm[3] - 0.001}'
    path = beside(tmp_path, arm=(ARMS / "panda.xml").read_text().replace('range="-3.0718', end))
    with pytest.raises(InvalidValueError, match=r"joint 4 at -2\.\d+, .* from the end of its range"):
        plan_of("explore", str(path)).view()


@pytest.mark.parametrize("name", ["panda", "xarm6"])
def test_a_view_shows_the_arm_where_its_joints_are(name):
    scene = plan_of("explore", f"{name}-sim").view()
    start, arm = scene.placement.start, own_arm(f"{name}.xml")
    bodies = {part.body for part in scene.parts}
    assert {f"arm/link{i + 1}" for i in range(len(arm.joints))} <= bodies
    turned = tuple(np.add(start.arm, 0.1 * np.eye(len(start.arm))[1]))
    before, after = (scene.placement.poses(Posture(start.pose_base_tip, q)) for q in (start.arm, turned))
    assert before["arm/link1"] == after["arm/link1"]
    assert before["arm/link5"] != after["arm/link5"]
