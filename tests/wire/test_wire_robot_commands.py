"""What people type, on robots behind real wires: rubbing, grasping, viewing, examining, taring.

Time is scaled where motion counts, for these share two cores with everything else. All on the loopback net.
"""

import json
import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from palpate.cli import main
from palpate.commands.calibrate.measurements import robot_backend, take_readings
from palpate.commands.replay.run import replay_log
from palpate.commands.view.scene import free_poses_in, shown_scene
from palpate.experiments.grasp.experiment import GraspObject
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.experiments.kit.recording import log_writer, write_result
from palpate.friction.friction_file import How
from palpate.open_kinds import as_written
from palpate.robots.robot import load_robot
from palpate.runtime import Ending
from palpate.runtime.log import log_in, read_log
from palpate.runtime.wrapped_backend import WrappedBackend
from palpate.viewing import frames_of_log
from palpate.yaml_text import yaml_text
from support.emulated_file import changed_file
from support.friction_runs import FRICTION
from support.grasp_runs import plan_of, run_grasp
from support.ur_library import needs_ur

pytestmark = needs_ur

SCALE = 0.25
"""Of time: a busy machine's stalls of 100 ms are then 25 ms of the robot's."""

GRASP = GraspObject()

BELIEVED = {"believed_friction": 0.45, "believed_spin_length": 0.0035}


def hand_file(folder, first):
    """The emulated hand at three addresses of its own."""
    return changed_file(
        folder,
        "emulated-hand",
        ("address: 127.0.0.2 ", f"address: 127.0.9.{first} "),
        ("[127.0.0.3, 127.0.0.4]", f"[127.0.9.{first + 1}, 127.0.9.{first + 2}]"),
    )


def patient(file):
    """The file of a rig at 500 Hz, with limits of age and silence above the stalls of a busy machine."""
    replaced = msgspec.structs.replace
    arm = replaced(file.backend.arm, watchdog=1.0)
    hand = replaced(file.backend.hand, watchdog=2.0, silent_after=1.0, reply_timeout=0.125)
    fingers = [replaced(its, sensor_device=replaced(its.sensor_device, silent_after=2.0)) for its in file.fingers]
    backend, limits = replaced(file.backend, arm=arm, hand=hand), replaced(file.limits, sample_age=1.0)
    return replaced(file, period=0.002, backend=backend, fingers=tuple(fingers), limits=limits)


def finished(experiment, plan, backend=None, sink=None):
    """What came of a run. This machine stands still for longer than it bears, now and then: then once more."""
    for _ in range(4):
        run = RecordedRun(plan, None if backend is None else backend())
        result = run.run((), () if sink is None else (sink(),))
        if result.ending is Ending.DONE:
            break
    return experiment.evaluate(plan, run.recorded(result))


@pytest.mark.slow
def test_what_rubbing_finds_over_the_wire_is_true():
    robot = load_robot("emulated-ur5e")
    entry = msgspec.structs.replace(robot.file.backend, address="127.0.9.70", time_scale=0.5)
    limits = msgspec.structs.replace(robot.file.limits, sample_age=0.3)
    robot = replace(robot, file=msgspec.structs.replace(robot.file, backend=entry, limits=limits))
    plan = FRICTION.plan(FRICTION.Config(robot="emulated-ur5e", quick=True), robot, {})
    rubbing = finished(FRICTION, plan)
    assert rubbing.run.ending is Ending.DONE, str(rubbing.run)
    # every motion is done in both directions: the arm comes up to its spin as soon as commanded
    for pair in rubbing.pairs:
        there, back = (float(np.trapezoid(its.angular_velocity[:, 2], its.time)) for its in pair.pair.both)
        assert abs(abs(there) - pair.rub.angle) < 0.05
        assert abs(there + back) < 0.05
    file = rubbing.file
    assert file.friction.how is How.MEASURED
    assert file.spin_length.how is How.MEASURED
    assert file.friction.lower <= 0.5 <= file.friction.upper
    assert file.spin_length.lower <= 0.003 <= file.spin_length.upper
    assert file.friction.value == pytest.approx(0.5, rel=0.01)
    assert file.spin_length.value == pytest.approx(0.003, rel=0.02)


@pytest.mark.slow
def test_a_grasp_on_an_emulated_hand_is_reported_replayed_and_viewed(tmp_path):
    planned = plan_of(robot=hand_file(tmp_path, 72))
    grasp = finished(GRASP, planned, sink=lambda: log_writer(GRASP, planned, tmp_path))
    assert grasp.run.ending is Ending.DONE, str(grasp.run)
    assert not grasp.dropped
    assert grasp.gave_way == ()
    assert 1.0 < grasp.tightest < grasp.grip_ratio < 1.4
    assert "robot" in dict(GRASP.report(grasp).settings)
    assert planned.true == plan_of().true
    assert replay_log(tmp_path).identical
    log = read_log(log_in(tmp_path))
    scene, frames = shown_scene(GRASP, LoggedRun.of(log).plan()), frames_of_log(log, free_poses_in(log))
    held = frames.posture(len(frames) // 2)
    # the arm's six joints are not the scene's slide: the hand is where it was all the same
    palm = scene.placement.poses(held)["palm"].position
    assert palm[2] == pytest.approx(held.pose_base_tip.position[2], abs=1e-9)
    assert palm[2] > frames.posture(0).pose_base_tip.position[2] + 0.03


@pytest.mark.slow
def test_a_hand_whose_truth_nobody_knows_has_the_same_report_without_it(tmp_path):
    """The devices of the emulated hand, felt through them alone, as a rig's are."""
    wired = plan_of(load="none", rise=0.3, robot=hand_file(tmp_path, 76), **BELIEVED)
    rig = load_robot("ur5e-hand")
    real = replace(wired, hand=replace(wired.hand, robot=rig))
    assert real.hand.real
    assert real.true == real.believed
    grasp = finished(GRASP, real, lambda: WrappedBackend(wired.backend()))
    assert grasp.run.ending is Ending.DONE, str(grasp.run)
    assert not grasp.dropped
    # the weight hangs on two fingers by friction: each feels half of it along its surface
    held = grasp.counted
    along = grasp.truth.loads[held, :, 1].mean(axis=0)
    assert along == pytest.approx([0.5 * wired.config.mass * 9.81] * 2, abs=0.05)
    assert np.isnan(grasp.least).all()
    report = GRASP.report(grasp)
    metrics = {metric.name: metric.value for metric in report.all_metrics}
    assert metrics["dropped"] == "no"
    assert math.isfinite(metrics["largest grip"])
    assert not [name for name in metrics if any(word in name for word in ("slip", "spin", "least"))]
    account = [getattr(part, "text") for part in report.sections[0].parts]  # noqa: B009
    message = " ".join((report.outcome, *account, *(" ".join(row) for row in report.settings)))
    assert "simulat" not in message
    assert "The object was held, as the fingers feel it." in message
    files = write_result(GRASP, grasp, report, tmp_path / "out").files
    assert "slip" not in files[1].read_text().splitlines()[0]
    assert "simulation" not in files[0].read_text()


@pytest.mark.parametrize("name", ["emulated-ur5e", "emulated-hand"])
@pytest.mark.slow
def test_the_doctor_starts_emulated_robots_and_ends_them(name, capsys, tmp_path):
    file = hand_file(tmp_path, 80)
    if name == "emulated-ur5e":
        file = changed_file(tmp_path, name, ("address: 127.0.0.2 ", "address: 127.0.9.83 "))
    main(["doctor", str(file), "--duration", "0.4", "--json"])
    found = json.loads(capsys.readouterr().out)["findings"]
    devices = {one["device"].split(" at ")[0] for one in found}
    assert {"this computer", "F/T sensor", "UR arm"} <= devices
    assert ("Dynamixel hand" in devices) == (name == "emulated-hand")
    # a busy computer may be unfit; noise of sensors is as their file says whatever the load
    noises = [one for one in found if one["what"].startswith("noise")]
    assert noises
    assert all(one["verdict"] == "good" and one["value"] > 1e-6 for one in noises)


@pytest.mark.slow
def test_a_sensor_is_tared_on_its_robot(tmp_path):
    changes = (("address: 127.0.0.2 ", "address: 127.0.9.84 "), ("sample_age_s: 0.1 ", "sample_age_s: 0.8 "))
    file = changed_file(tmp_path, "emulated-ur5e", *changes)
    with robot_backend(file) as backend:
        wrenches, specific_force = take_readings(backend, 0.5)
    # a tip of 30 g hangs on it, and the arm says which way down is
    assert specific_force == pytest.approx((0.0, 0.0, 9.81), abs=0.02)
    assert wrenches.mean(axis=0)[:3] == pytest.approx((0.0, 0.0, -0.03 * 9.81), abs=0.002)


@pytest.mark.slow
def test_a_rig_of_arm_hand_and_sensors_lifts_an_object(tmp_path):
    """As on a robot, in real time: a file of kind rig, and nobody who knows what is behind its wires."""
    for _ in range(4):  # see `finished`; each time with everything where it was
        robot = load_robot(hand_file(tmp_path, 86))
        with robot.file.backend.devices(robot) as rig:
            path = tmp_path / "cell.yaml"
            path.write_text(yaml_text(as_written(patient(rig.file))))
            planned = plan_of(robot=str(path), **BELIEVED)
            grasp = run_grasp(planned)
        lifted = float(np.ptp(grasp.truth.height[grasp.aloft])) if grasp.aloft.any() else 0.0
        # commands that a busy machine lets come late drop it, or lift it further; alone it holds every time
        if grasp.run.ending is Ending.DONE and not grasp.dropped and lifted < 0.042:
            break
    assert grasp.run.ending is Ending.DONE, str(grasp.run)
    assert planned.hand.real
    assert planned.period == 0.002
    assert not grasp.dropped
    along = grasp.truth.loads[grasp.counted, :, 1].mean(axis=0)
    assert along == pytest.approx([0.5 * 0.1 * 9.81] * 2, abs=0.05)
    assert 0.03 < lifted < 0.042
