"""The emulated UR5e of a robot file: the simulated one over real wires, with the client library of its maker."""

from dataclasses import replace

from palpate.errors import InvalidValueError
from palpate.hw.ft_stream.streamed_sensor import StreamSettings
from palpate.hw.netft import NetFt, NetFtSettings
from palpate.hw.rig import FingerSensor, FramedArm, Rig, RigSettings
from palpate.hw.ur import UrArm, UrSettings
from palpate.robots.emulated.backend import EmulatedBackend
from palpate.robots.emulated.scene import (
    CYCLE,
    EmulatedUr5e,
    emulated_entry,
    pose_base_robot,
    pose_flange_tip,
    simulated,
    simulated_twin,
)
from palpate.robots.pace_entries import SimulatedPaceEntry
from palpate.robots.robot import Robot
from palpate.robots.simulated_stage import RobotInScene, Task
from palpate.robots.simulated_ur5e import build_ur5e
from palpate.sensing.compensation import SensorPayload

DEVICE_TIMEOUT = 0.5
"""[s] Without a word after which a device counts as lost: this is one computer that does everything, and its own
stalls are no faults of a robot. The supervisor's limit on the age of samples comes first."""

WIRE_CYCLES = 2.5
"""Cycles of the controller from a command to its motion and back to what is sensed of it, beyond the arm's own
delay: one in the client's loop, one in the controller's, half of one until it is read."""

QUIET = (1e-3, 1e-3, 1e-3, 1e-5, 1e-5, 1e-5)
"""Least noise of a tare [N, N m]; nothing is tared here, for the emulated box has no bias."""


def build_emulated_ur5e(robot: Robot, task: Task) -> RobotInScene:
    """Return the emulated UR5e of a robot file, at the task's start; nothing runs before its back end is started.

    Raises:
        InvalidValueError: The simulation cannot be built as the file specifies, or cannot do the task.
    """
    entry = emulated_entry(robot)
    if isinstance(robot.file.pace, SimulatedPaceEntry):
        raise InvalidValueError("pace.kind = simulated: devices on a wire keep their own time; write real_time")
    ready = build_ur5e(simulated_twin(robot), task)
    scene = simulated(ready).scene
    wall_period = task.period / entry.time_scale
    settings = UrSettings(
        pose_flange_tip=pose_flange_tip(entry),
        speed=robot.file.limits.speed,
        angular_speed=robot.file.limits.angular_speed,
        watchdog=DEVICE_TIMEOUT,
        stale_after=DEVICE_TIMEOUT,
    )
    arm = FramedArm(UrArm(entry.address, settings), pose_base_robot(entry))
    sensor = NetFt(entry.address, NetFtSettings(StreamSettings(QUIET, silent_after=DEVICE_TIMEOUT)))
    tip = scene.tip
    rig = Rig(
        robot.file.pace.pacer(wall_period),
        RigSettings(wall_period, oldest=robot.file.limits.sample_age / entry.time_scale),
        arm=arm,
        fingers=(FingerSensor(sensor, SensorPayload(tip.mass, tip.center_of_mass)),),
    )
    backend = EmulatedBackend(
        scene, lambda process, memory: EmulatedUr5e(robot, task, process, memory), rig, entry.time_scale
    )
    return replace(
        ready,
        backend=backend,
        response=ready.response + WIRE_CYCLES * CYCLE,
        angular_acceleration=settings.acceleration,
    )
