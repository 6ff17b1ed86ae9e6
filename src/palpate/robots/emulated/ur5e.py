"""The emulated UR5e of a robot file: the simulated one over real wires, with the client library of its maker."""

from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial

import msgspec

from palpate.errors import InvalidValueError
from palpate.hw.emulators.ur.arm import ArmMounting
from palpate.hw.ft_stream.streamed_sensor import StreamSettings
from palpate.hw.netft import NetFt, NetFtSettings
from palpate.hw.rig import FingerSensor, FramedArm, Rig, RigSettings
from palpate.hw.ur import UrArm, UrSettings
from palpate.hw.ur.library import refuse_unsupported
from palpate.robots.emulated.backend import EmulatedBackend, Emulation
from palpate.robots.emulated.devices import DEVICE_TIMEOUT, arm_entry, rig_of, running
from palpate.robots.emulated.loopback import TIME_SCALES, loopback_address
from palpate.robots.emulated.scene import CYCLE, EmulatedUr5e, simulated
from palpate.robots.idle import idle_task
from palpate.robots.pace_entries import SimulatedPaceEntry
from palpate.robots.rig import RigEntry
from palpate.robots.robot import Robot
from palpate.robots.simulated_ur5e import SimulatedUr5eEntry
from palpate.robots.task import RobotInScene, Task
from palpate.sensing.compensation import SensorPayload

WIRE_CYCLES = 2.5
"""Cycles of the controller from a command to its motion and back to what is sensed of it, beyond the arm's own
delay: one in the client's loop, one in the controller's, half of one until it is read."""

QUIET = (1e-3, 1e-3, 1e-3, 1e-5, 1e-5, 1e-5)
"""Least noise of a tare [N, N m]; nothing is tared here, for the emulated box has no bias."""


class EmulatedUr5eEntry(SimulatedUr5eEntry, frozen=True, kw_only=True):
    """The simulated UR5e behind an emulated controller and F/T box, run over the real wires and client libraries.

    The controller's cycle of 2 ms is a whole number of the simulation's time steps.

    Attributes:
        address: Where controller and F/T box listen: one of the loopback net, for ports are fixed.
        time_scale: Seconds of the robot per second of wall time: less where the computer is too busy for 1.
    """

    UNATTENDED = False
    RANGES = (
        *SimulatedUr5eEntry.RANGES,
        ("time_scale", *TIME_SCALES),
    )

    address: str = "127.0.0.2"
    time_scale: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        loopback_address("address", self.address)

    def check_drivers(self) -> None:
        """See `RobotKind`."""
        refuse_unsupported()

    def build(self, robot: Robot, task: Task) -> RobotInScene:
        """See `RobotKind`; nothing runs before its back end is started."""
        if isinstance(robot.file.pace, SimulatedPaceEntry):
            raise InvalidValueError(
                "pace.kind = simulated: devices on a wire keep their own time; write real_time"
            )
        twin = simulated_twin(robot)
        ready = twin.file.backend.build(twin, task)
        scene = simulated(ready).scene
        wall_period = task.period / self.time_scale
        settings = UrSettings(
            pose_flange_tip=self.pose_flange_tip,
            speed=robot.file.limits.speed,
            angular_speed=robot.file.limits.angular_speed,
            watchdog=DEVICE_TIMEOUT,
            stale_after=DEVICE_TIMEOUT,
        )
        arm = FramedArm(UrArm(self.address, settings), self.pose_base_robot)
        sensor = NetFt(self.address, NetFtSettings(StreamSettings(QUIET, silent_after=DEVICE_TIMEOUT)))
        tip = scene.tip
        rig = Rig(
            robot.file.pace.pacer(wall_period),
            RigSettings(wall_period, oldest=robot.file.limits.sample_age / self.time_scale),
            arm=arm,
            fingers=(FingerSensor(sensor, SensorPayload(tip.mass, tip.center_of_mass)),),
        )
        return replace(
            ready,
            backend=EmulatedBackend(scene, self._emulation(twin, task), rig, self.time_scale),
            response=ready.response + WIRE_CYCLES * CYCLE,
            angular_acceleration=settings.acceleration,
        )

    def devices(self, robot: Robot) -> AbstractContextManager[Robot]:
        """See `RobotKind`: in real time, for rates are to be those of real devices."""
        rig = rig_of(robot, RigEntry(arm=arm_entry(self.address, self.pose_flange_tip)), (self.address,))
        at_once = msgspec.structs.replace(self, time_scale=1.0)
        return running(rig, at_once._emulation(simulated_twin(robot), idle_task(robot)))

    def _emulation(self, twin: Robot, task: Task) -> Emulation:
        mounting = ArmMounting(pose_base_robot=self.pose_base_robot, pose_flange_tip=self.pose_flange_tip)
        return partial(EmulatedUr5e, twin, mounting, task, self.address, self.time_scale)


def simulated_twin(robot: Robot) -> Robot:
    """Return an emulated UR5e without wires, as fast as it can be computed.

    Raises:
        TypeError: It is another robot: whoever chose this is wrong.
    """
    entry = robot.file.backend
    if not isinstance(entry, EmulatedUr5eEntry):
        raise TypeError(f"a {type(entry).__name__} is no EmulatedUr5eEntry")
    fields = msgspec.structs.fields(SimulatedUr5eEntry)
    backend = SimulatedUr5eEntry(**{field.name: getattr(entry, field.name) for field in fields})
    return replace(robot, file=msgspec.structs.replace(robot.file, backend=backend, pace=SimulatedPaceEntry()))
