"""Rigs in robot files: what they may say, and what is made of it. Nothing is opened here."""

import msgspec
import numpy as np
import pytest

from palpate.cli import main
from palpate.commands.devices.config import DoctorConfig
from palpate.commands.devices.doctor import run_doctor
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.kit.recorded_periods import ContactTruth
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.plan import plan_regulation
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.rig import FreshlyTared, PolledHand, Rig
from palpate.hw.rig.placed_arm import ArmAtPlace, ArmFromHere
from palpate.hw.ur import UrArm, UrToolSensor
from palpate.open_kinds import as_written
from palpate.robots.in_scene import check
from palpate.robots.known_truth import scene_of
from palpate.robots.rig import assembled, parts_of
from palpate.robots.robot import load_robot
from palpate.robots.robot_file import read_robot_file
from palpate.robots.values import values_of
from palpate.runtime.truth import TruthTable, truth_source
from palpate.yaml_text import yaml_text
from support.explore_runs import plan_of
from support.rig_cell import ROBOT, robot_file


def rig(folder, *changes):
    """The robot of the test's file, with texts of it replaced."""
    text = ROBOT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return load_robot(str(robot_file(folder, "127.0.0.9", text)))


@pytest.mark.parametrize("name", ["ur5e-netft", "ur5e-hand"])
def test_ready_made_rigs_are_in_order_and_read_back_to_the_same(name):
    robot = load_robot(name)
    check(robot)
    assert read_robot_file(yaml_text(as_written(robot.file))) == robot.file


def test_the_devices_get_the_settings_of_the_file(tmp_path):
    payload = ("watchdog_s: 1.0", "watchdog_s: 0.2, payload: {mass_kg: 0.7, center_of_mass_m: [0.0, 0.01, 0.02]}")
    text = (payload[0], payload[1].replace(", ", "\n    ", 1))
    robot = rig(tmp_path, text, ("speed_m_per_s: 0.1", "speed_m_per_s: 0.07"))
    arm = parts_of(robot).arm
    assert isinstance(arm, UrArm)
    assert arm.name == "UR arm at 127.0.0.9"
    settings_read = arm.settings
    assert (settings_read.watchdog, settings_read.speed, settings_read.stale_after) == (0.2, 0.07, 1.0)
    assert settings_read.payload.mass == 0.7
    assert settings_read.payload.center == (0.0, 0.01, 0.02)
    turned = np.array(settings_read.pose_flange_tip.rotation)
    assert turned == pytest.approx(np.array([[0, -1, 0], [-1, 0, 0], [0, 0, -1]]), abs=1e-12)


def test_a_rig_stands_ready_and_nobody_knows_the_truth(tmp_path):
    robot = rig(tmp_path)
    planned = plan_of(ExploreConfig(robot=str(tmp_path / "rig.yaml"), force=1.0), robot)
    backend = planned.backend()
    assert isinstance(backend, FreshlyTared)
    assert isinstance(backend.backend.arm, ArmFromHere)
    assert scene_of(backend) is None
    assert truth_source(backend) is None
    assert planned.parameters.gain.delay > 0.02  # the arm's response, and a period


def test_an_arm_whose_place_is_known_must_be_at_the_start(tmp_path):
    robot = rig(tmp_path, ("    watchdog_s", "    robot_base: {position_m: [-0.4, 0.0, 0.0]}\n    watchdog_s"))
    backend = plan_of(ExploreConfig(robot=str(tmp_path / "rig.yaml")), robot).backend()
    assert isinstance(backend, FreshlyTared)
    assert type(backend.backend.arm) is ArmAtPlace


def test_without_a_tare_it_is_the_rig_itself(tmp_path):
    robot = rig(tmp_path, ("  kind: rig", "  kind: rig\n  tare_at_start: false"))
    assert isinstance(plan_of(ExploreConfig(robot=str(tmp_path / "rig.yaml")), robot).backend(), Rig)


def test_a_hand_has_a_sensor_per_finger_and_its_own_rate():
    robot = load_robot("ur5e-hand")
    built = assembled(robot, robot.file.period)
    assert isinstance(built.hand, PolledHand)
    assert len(built.fingers) == 2
    poses = built.settings.kinematics.sensor_poses((0.0, 0.0))
    assert poses[0].position == pytest.approx((0.04, 0.0, -0.08))
    hand = built.hand.hand
    assert isinstance(hand, DynamixelHand)
    assert [its.direction for its in hand.settings.servos] == [1, -1]


def test_every_kind_of_sensor_is_made(tmp_path):
    device = "sensor_device: {kind: netft, address: ADDRESS, silent_after_s: 2.0}"
    kinds = {
        "sensor_device: {kind: onrobot, address: ADDRESS, cutoff_Hz: 150.0}": "F/T sensor at 127.0.0.9",
        "sensor_device: {kind: bota, path: /dev/ttyFT}": "Bota sensor at /dev/ttyFT",
        "sensor_device: {kind: resense, path: /dev/ttyFT, force_range_N: [50, 50, 100], "
        "moment_range_Nm: [0.5, 0.5, 0.3]}": "Resense sensor at /dev/ttyFT",
        "sensor_device: {kind: ur_tool}": "tool sensor of the UR arm at 127.0.0.9",
    }
    for text, name in kinds.items():
        sensor = parts_of(rig(tmp_path, (device, text))).sensors[0]
        assert sensor.device.name == name
        assert sensor.in_arm == isinstance(sensor.device, UrToolSensor)


WRONG = [
    (("    address: ADDRESS\n    tcp", "    tcp"), "address"),
    (("watchdog_s: 1.0", "watchdog_s: 100"), "watchdog_s = 100"),
    (("kind: rig", "kind: rigg"), "rigg"),
    (("kind: netft", "kind: netfft"), "netfft"),
    (("    sensor_device: {kind: netft, address: ADDRESS, silent_after_s: 2.0}\n", ""), "sensor_device"),
    (("    noise: {force_N: 0.003, moment_Nm: 0.000016}\n", ""), "noise"),
    (("    noise", "    simulated_sensor: {preset: nano17}\n    noise"), "simulated_sensor"),
    (("pace: {kind: real_time}\n", ""), "real_time"),
    (("period_s: 0.002", "period_s: 0.002\nspeed: 3"), "speed"),
    (("silent_after_s: 2.0", "silent_after: 2.0"), "silent_after_s"),
]


@pytest.mark.parametrize(("change", "message"), WRONG)
def test_what_cannot_be_is_refused_with_its_place(tmp_path, change, message):
    with pytest.raises(InvalidValueError, match=message):
        rig(tmp_path, change)


def test_a_simulated_robot_has_no_real_sensors():
    stage = load_robot("stage")
    text = stage.texts["robot.yaml"] + "\n"
    finger = "  - surface:"
    assert finger in text
    real = text.replace(finger, "  - sensor_device: {kind: netft, address: 127.0.0.1}\n    surface:")
    with pytest.raises(InvalidValueError, match=r"sensor_device: is for real devices, backend\.kind: rig"):
        read_robot_file(real)


def test_what_an_experiment_cannot_do_with_it_is_refused(tmp_path):
    tool = (
        "sensor_device: {kind: netft, address: ADDRESS, silent_after_s: 2.0}",
        "sensor_device: {kind: ur_tool}",
    )
    with pytest.raises(InvalidValueError, match="mass_kg: 0"):
        check(rig(tmp_path, tool, ("payload: {mass_kg: 0.0}", "payload: {mass_kg: 0.1}")))
    robot = rig(tmp_path)
    armless = msgspec.structs.replace(robot.file.backend, arm=None)
    file = msgspec.structs.replace(robot.file, backend=armless)
    with pytest.raises(InvalidValueError, match=r"backend\.arm"):
        plan_of(ExploreConfig(robot=str(tmp_path / "rig.yaml")), type(robot)(file, robot.sensors, robot.texts))
    moving = RegulateConfig(robot=str(tmp_path / "rig.yaml"), surface="sine")
    with pytest.raises(InvalidValueError, match="surface = sine"):
        plan_regulation(moving, robot, {})


def test_noise_of_an_exploration_is_that_of_the_sensor_file(tmp_path):
    sensor = load_robot("stage-nano17").texts["sensor-0.yaml"]
    (tmp_path / "sensor.yaml").write_text(sensor.replace("noise_force_N: [0.003125", "noise_force_N: [0.004"))
    plain = "    payload: {mass_kg: 0.0}\n    noise: {force_N: 0.003, moment_Nm: 0.000016}\n"
    robot = rig(tmp_path, (plain, "    sensor: sensor.yaml\n"))
    assert values_of(robot)["force_noise"] == 0.004


def test_of_a_robot_nobody_knows_the_truth_of_any_period():
    truth = ContactTruth.of(TruthTable((), np.empty((5, 0))), 5)
    assert not truth.known
    assert len(truth) == 5
    assert not truth.touching.any()
    assert np.isnan(truth.force).all()


def rig_path(folder):
    return robot_file(folder, "127.0.0.9")


def test_the_doctor_wants_devices():
    with pytest.raises(InvalidValueError, match="no devices to connect to"):
        run_doctor(DoctorConfig("stage"))
    with pytest.raises(InvalidValueError, match=r"duration = 0\.01 s: must be from 0\.2"):
        DoctorConfig("ur5e-netft", duration=0.01)


def test_units_of_a_rig_are_shown_with_their_values(capsys, tmp_path):
    assert main(["robot", "check", str(rig_path(tmp_path))]) == 0
    message = " ".join(capsys.readouterr().out.split())
    assert "backend.arm.stiffness 30000 N/m" in message
    assert "backend.arm.watchdog 1 s" in message
