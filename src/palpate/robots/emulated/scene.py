"""The simulated UR5e behind emulated devices, ready to be run in a process of its own."""

from dataclasses import dataclass, replace

import msgspec

from palpate.hw.emulators.host import Host
from palpate.hw.emulators.netft.box import BoxSettings, NetFtServer
from palpate.hw.emulators.ur.arm import ArmMounting
from palpate.hw.emulators.ur.server import UrServer
from palpate.kinematics import Pose
from palpate.robots.backend_entries import EmulatedUr5eEntry, SimulatedUr5eEntry
from palpate.robots.emulated.scene_plant import ScenePlant
from palpate.robots.emulated.truth import TruthTrace
from palpate.robots.pace_entries import SimulatedPaceEntry
from palpate.robots.robot import Robot
from palpate.robots.simulated_stage import RobotInScene, Task
from palpate.robots.simulated_ur5e import build_ur5e
from palpate.runtime.urgency import be_urgent
from palpate.sim import MujocoBackend
from palpate.sim.carriers.arm_carrier import LOOKING_DOWN

CYCLE = 0.002
"""[s] Of an e-Series controller, and so of the plant behind it."""

SENSOR_RATE = 1000.0
"""[1/s] Records of the emulated F/T box per second of the robot's time."""

HEADROOM = 1.5
"""Range of the F/T box over what the supervisor lets the sensor feel: the tip's weight and inertia come on top."""


@dataclass(frozen=True, slots=True, eq=False)
class EmulatedUr5e:
    """What `EmulatorProcess` takes: a UR controller and an F/T box, the simulated arm over its object behind them.

    Attributes:
        robot: Of kind `emulated_ur5e`.
        task: What it is to touch.
        process: That has made the memory for the truth.
        memory: Its descriptor there.
    """

    robot: Robot
    task: Task
    process: int
    memory: int

    def __call__(self) -> Host:
        """Return a host that listens and is ready to run.

        Raises:
            InvalidValueError: The scene cannot be, or the address is not free.
            OSError: A port of the F/T box is not free, or nobody wants the truth any more.
        """
        be_urgent()
        entry, limits = emulated_entry(self.robot), self.robot.file.limits
        ready = build_ur5e(simulated_twin(self.robot), replace(self.task, period=CYCLE))
        scene = simulated(ready)
        trace = TruthTrace.of_process(self.process, self.memory)
        plant = ScenePlant(scene, trace)
        arm = UrServer(entry.address, mounting=mounting_of(entry))
        force, moment = HEADROOM * limits.force, HEADROOM * limits.moment
        ranges = (force, force, force, moment, moment, moment)
        settings = BoxSettings(entry.address, rate=SENSOR_RATE * entry.time_scale, ranges=ranges)
        try:
            box = NetFtServer(settings)
        except BaseException:
            arm.close()
            raise
        return Host(plant, [arm, box], arm=arm, scale=entry.time_scale)


def simulated(ready: RobotInScene) -> MujocoBackend:
    """Return the back end of a simulated robot.

    Raises:
        TypeError: It is another one: whoever built it is wrong.
    """
    if not isinstance(ready.backend, MujocoBackend):
        raise TypeError(f"a {type(ready.backend).__name__} is no simulation")
    return ready.backend


def emulated_entry(robot: Robot) -> EmulatedUr5eEntry:
    """Return the robot's back end, which is an emulated one.

    Raises:
        TypeError: It is of another kind: whoever chose this is wrong.
    """
    entry = robot.file.backend
    if not isinstance(entry, EmulatedUr5eEntry):
        raise TypeError(f"a {type(entry).__name__} is no EmulatedUr5eEntry")
    return entry


def simulated_twin(robot: Robot) -> Robot:
    """Return the same robot without wires, as fast as it can be computed."""
    entry = emulated_entry(robot)
    simulated = SimulatedUr5eEntry(
        robot_base_distance=entry.robot_base_distance,
        tool_length=entry.tool_length,
        bandwidth=entry.bandwidth,
        following_error_limit=entry.following_error_limit,
        time_step=entry.time_step,
    )
    file = msgspec.structs.replace(robot.file, backend=simulated, pace=SimulatedPaceEntry())
    return replace(robot, file=file)


def pose_base_robot(entry: EmulatedUr5eEntry) -> Pose:
    """Return where the arm's own base frame is in that of the scene."""
    return Pose((-entry.robot_base_distance, 0.0, 0.0))


def pose_flange_tip(entry: EmulatedUr5eEntry) -> Pose:
    """Return where the tip frame is on the flange."""
    return Pose((0.0, 0.0, entry.tool_length), LOOKING_DOWN)


def mounting_of(entry: EmulatedUr5eEntry) -> ArmMounting:
    """Return how the emulated controller's arm stands in the scene."""
    return ArmMounting(pose_base_robot=pose_base_robot(entry), pose_flange_tip=pose_flange_tip(entry))
