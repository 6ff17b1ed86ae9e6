"""The real devices of a robot file: by themselves, and as a robot that stands ready for a task."""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError
from palpate.hw.devices import ArmDevice
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.rig import FingerSensor, FreshlyTared, PolledHand, Rig, RigSettings
from palpate.hw.rig.placed_arm import ArmAtPlace, ArmFromHere, Beginning
from palpate.hw.ur import UrArm
from palpate.kinematics.hand import HandKinematics
from palpate.robots.entry import entry_of
from palpate.robots.rig_entries import RigEntry
from palpate.robots.rig_sensors import finger_sensor
from palpate.robots.rig_settings import (
    hand_geometry,
    hand_settings,
    noise_of_finger,
    payload_of,
    pose_of,
    ur_settings,
)
from palpate.robots.robot import Robot
from palpate.robots.simulated_stage import RobotInScene, Task, surface_of_tip
from palpate.robots.surface_entries import SphereEntry
from palpate.runtime import Backend, Finger, FingerDescription, SensorFinger
from palpate.sensing.solver import Surface
from palpate.spatial import Vector

NEAR_START = 0.005
"""[m] Largest distance of the tip from the start of a run: more than a careful hand-guided placement errs, less
than the clearance to obstacles."""

MOST_TURNED = math.radians(5.0)
"""By which the middle of a tip 12 mm before its sensor is off by 1 mm."""


@dataclass(frozen=True, slots=True)
class RigParts:
    """The devices of a rig, not started.

    Attributes:
        arm: None: they stand.
        hand: None: there is one finger.
        sensors: One per finger.
        kinematics: Of the hand.
    """

    arm: UrArm | None
    hand: DynamixelHand | None
    sensors: tuple[FingerSensor, ...]
    kinematics: HandKinematics | None


def parts_of(robot: Robot) -> RigParts:
    """Return the devices that a robot file names; nothing is opened.

    Raises:
        InvalidValueError: They cannot be as the file specifies.
    """
    entry = entry_of(robot, RigEntry)
    arm = None if entry.arm is None else UrArm(entry.arm.address, ur_settings(robot, entry.arm))
    hand, kinematics = None, None
    if entry.hand is not None:
        if len(entry.hand.servos) != len(robot.file.fingers):
            raise InvalidValueError(
                f"backend.hand.servos: there are {len(entry.hand.servos)} for {len(robot.file.fingers)} fingers; "
                "give one per finger"
            )
        hand = DynamixelHand(entry.hand.port, hand_settings(robot, entry.hand))
        if len(robot.file.fingers) > 1:
            kinematics = hand_geometry(robot, entry.hand)
    elif len(robot.file.fingers) > 1:
        raise InvalidValueError(
            f"fingers: there are {len(robot.file.fingers)} and no backend.hand; give it, or one"
        )
    sensors = tuple(finger_sensor(robot, i, arm) for i in range(len(robot.file.fingers)))
    return RigParts(arm, hand, sensors, kinematics)


def check_rig(robot: Robot) -> None:
    """Check that a rig can be built at all.

    Raises:
        InvalidValueError: It could not.
    """
    parts = parts_of(robot)
    if entry_of(robot, RigEntry).tare_at_start:
        for i, sensor in enumerate(parts.sensors):
            if not sensor.gives_wrenches:
                raise InvalidValueError(
                    f"fingers[{i}].sensor: it calibrates raw channels, which are not tared at the start; write "
                    "backend.tare_at_start: false, and use `palpate calibrate tare`"
                )


def assembled(robot: Robot, period: float, start: Vector | None = None) -> Rig:
    """Return the rig of a robot file.

    Args:
        robot: Of kind `rig`.
        period: Of control [s].
        start: Where the tip begins, base frame [m]; None: anywhere, in the arm's own base frame.

    Raises:
        InvalidValueError: It cannot be as the file specifies.
    """
    check_rig(robot)
    entry, parts = entry_of(robot, RigEntry), parts_of(robot)
    hand = None
    if parts.hand is not None and entry.hand is not None:
        hand = PolledHand(parts.hand, entry.hand.poll)
    arm: ArmDevice | None = parts.arm
    if parts.arm is not None and entry.arm is not None and start is not None:
        robot_base, beginning = entry.arm.robot_base, Beginning(start, NEAR_START, _most_turned(robot))
        arm = (
            ArmFromHere(parts.arm, beginning)
            if robot_base is None
            else ArmAtPlace(parts.arm, pose_of(robot_base), beginning)
        )
    settings = RigSettings(period, robot.file.limits.sample_age, kinematics=parts.kinematics)
    return Rig(robot.file.pace.pacer(period), settings, arm=arm, hand=hand, fingers=parts.sensors)


def _most_turned(robot: Robot) -> float:
    """How far the tip may be turned [rad]: experiments take its axes for those of the base, but for a sphere."""
    surface = robot.file.fingers[0].surface
    return math.pi if isinstance(surface, SphereEntry) and not any(surface.center) else MOST_TURNED


def build_rig(robot: Robot, task: Task) -> RobotInScene:
    """Return the rig of a robot file, ready for a task; nothing is opened before its back end starts.

    Raises:
        InvalidValueError: It cannot be as the file specifies, or cannot do the task.
    """
    entry = entry_of(robot, RigEntry)
    if entry.arm is None:
        raise InvalidValueError("backend.arm: there is none, and this experiment moves; give it")
    if len(robot.file.fingers) != 1:
        raise InvalidValueError(f"fingers: there are {len(robot.file.fingers)}; this experiment is done with one")
    rig = assembled(robot, task.period, task.start)
    finger, sensor, arm = robot.file.fingers[0], robot.sensors[0], entry.arm
    sensed = surface_of_tip(finger, tuple(length - task.compression for length in task.tip))
    return RobotInScene(
        tared_if_configured(robot, rig),
        described_finger(robot, 0, sensed, task.touch_force),
        arm.lag,
        arm.response,
        arm.stiffness,
        task.touch_force if sensor is None else sensor.contact.touch_force,
        angular_acceleration=arm.acceleration,
    )


def tared_if_configured(robot: Robot, rig: Rig) -> Backend:
    """Return a rig that is tared whenever a run begins, if its robot file requests it."""
    return FreshlyTared(rig) if entry_of(robot, RigEntry).tare_at_start else rig


def described_finger(robot: Robot, i: int, surface: Surface, touch_force: float) -> FingerDescription:
    """Return the description of finger i for touch.

    Args:
        robot: Of kind `rig`.
        i: Number of the finger.
        surface: Of its tip, sensor frame.
        touch_force: That counts as a touch on a sensor without a file [N].
    """
    sensor = robot.sensors[i]
    if sensor is None:
        return Finger(surface, payload_of(robot, i), touch_force, touch_force / 2.0, noise_of_finger(robot, i))
    return SensorFinger(surface, sensor)
