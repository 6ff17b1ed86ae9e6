"""The real devices of a robot file: by themselves, and as a robot that stands ready for a task."""

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import InvalidValueError
from palpate.experiments.robot_entry import entry_of
from palpate.experiments.simulated_stage import RobotInScene, Task, surface_of_tip
from palpate.hw.devices import ArmDevice, SensorDevice
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.dynamixel.settings import HandSettings, ServoCalibration
from palpate.hw.ft_stream import StreamSettings
from palpate.hw.netft import NetFt, NetFtSettings, Scales, onrobot_settings
from palpate.hw.rig import FingerSensor, FreshlyTared, PolledHand, Rig, RigSettings
from palpate.hw.rig.finger_sensor import NO_LOAD
from palpate.hw.rig.placed_arm import ArmAtPlace, ArmFromHere, Beginning
from palpate.hw.serial_ft.bota import Bota
from palpate.hw.serial_ft.resense import Resense
from palpate.hw.serial_ft.serial_sensor import SerialSensor
from palpate.hw.ur import Payload as UrPayload
from palpate.hw.ur import UrArm, UrSettings, UrToolSensor
from palpate.kinematics.hand import HandKinematics
from palpate.kinematics.pose import Pose, rotation_from_rotvec
from palpate.runtime import Finger, FingerDescription, SensorFinger
from palpate.runtime.robot import Robot
from palpate.runtime.robot_rig import (
    BotaEntry,
    DynamixelEntry,
    NetFtEntry,
    OnRobotEntry,
    PoseEntry,
    ResenseEntry,
    RigEntry,
    SlideFingerEntry,
    UrEntry,
    UrToolEntry,
)
from palpate.runtime.robot_surface import SphereEntry
from palpate.sensing.compensation import Payload
from palpate.sensing.ft.sensor_file import SensorFile
from palpate.sim import Tip
from palpate.sim.hand.finger import Finger as FingerGeometry
from palpate.sim.hand.finger import HingeFinger, SlideFinger
from palpate.sim.hand.hand import Hand
from palpate.spatial import Vector, Wrench
from palpate.surfaces import Sphere

NEAR_START = 0.005
"""[m] By how much the tip may be elsewhere than where a run begins: more than anybody leads it wrong by hand, and
less than from there to what it is not to hit."""

MOST_TURNED = math.radians(5.0)
"""By which the middle of a tip 12 mm before its sensor is off by 1 mm."""

RAW = Scales(1.0, 1.0)
"""For a sensor file that calibrates: counts as they are."""


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
        InvalidValueError: They cannot be as it says.
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
            kinematics = _geometry(robot, entry.hand)
    elif len(robot.file.fingers) > 1:
        raise InvalidValueError(
            f"fingers: there are {len(robot.file.fingers)} and no backend.hand; give it, or one"
        )
    sensors = tuple(_sensor(robot, i, arm) for i in range(len(robot.file.fingers)))
    return RigParts(arm, hand, sensors, kinematics)


def check_rig(robot: Robot) -> None:
    """Refuse a rig that could do no task at all.

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
        InvalidValueError: It cannot be as the file says.
    """
    check_rig(robot)
    entry, parts = entry_of(robot, RigEntry), parts_of(robot)
    hand = None
    if parts.hand is not None and entry.hand is not None:
        hand = PolledHand(parts.hand, entry.hand.poll)
    arm: ArmDevice | None = parts.arm
    if parts.arm is not None and entry.arm is not None and start is not None:
        foot, beginning = entry.arm.foot, Beginning(start, NEAR_START, _most_turned(robot))
        arm = (
            ArmFromHere(parts.arm, beginning) if foot is None else ArmAtPlace(parts.arm, pose_of(foot), beginning)
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
        InvalidValueError: It cannot be what the file says, or not do the task.
    """
    entry = entry_of(robot, RigEntry)
    if entry.arm is None:
        raise InvalidValueError("backend.arm: there is none, and this experiment moves; give it")
    if len(robot.file.fingers) != 1:
        raise InvalidValueError(f"fingers: there are {len(robot.file.fingers)}; this experiment is done with one")
    rig = assembled(robot, task.period, task.start)
    finger, sensor = robot.file.fingers[0], robot.sensors[0]
    sensed = surface_of_tip(finger, tuple(length - task.compression for length in task.tip))
    described: FingerDescription
    if sensor is None:
        touch_force = task.touch_force
        described = Finger(sensed, payload_of(robot, 0), touch_force, touch_force / 2.0)
    else:
        touch_force = sensor.contact.touch_force
        described = SensorFinger(sensed, sensor)
    backend = FreshlyTared(rig) if entry.tare_at_start else rig
    return RobotInScene(backend, described, entry.arm.lag, entry.arm.response, entry.arm.stiffness, touch_force)


def pose_of(entry: PoseEntry) -> Pose:
    """Return a pose of a robot file."""
    return Pose(entry.position, rotation_from_rotvec(entry.rotvec))


def payload_of(robot: Robot, i: int) -> Payload:
    """Return what the sensor of finger i carries."""
    finger, sensor = robot.file.fingers[i], robot.sensors[i]
    entry = finger.payload if sensor is None else sensor.payload
    assert entry is not None  # FingerEntry has made sure that one of the two is given
    return entry.payload


def noise_of_finger(robot: Robot, i: int) -> Wrench:
    """Return the standard deviation of a reading of finger i at rest [N, N m]."""
    finger, sensor = robot.file.fingers[i], robot.sensors[i]
    if sensor is not None:
        a, b, c, d, e, f = sensor.noise
        return (a, b, c, d, e, f)
    assert finger.noise is not None  # RobotFile has made sure that one of the two is given
    force, moment = finger.noise.force, finger.noise.moment
    return (force, force, force, moment, moment, moment)


def ur_settings(robot: Robot, entry: UrEntry) -> UrSettings:
    """Return what a UR arm is told.

    Raises:
        InvalidValueError: A limit of the robot is beyond what the arm can be told.
    """
    limits, payload = robot.file.limits, entry.payload
    return UrSettings(
        pose_flange_tip=pose_of(entry.tcp),
        payload=None if payload is None else UrPayload(payload.mass, payload.center_of_mass),
        speed=limits.speed,
        angular_speed=limits.angular_speed,
        joint_speed=entry.joint_speed,
        force=limits.force,
        moment=limits.moment,
        acceleration=entry.acceleration,
        watchdog=entry.watchdog,
        stale_after=limits.sample_age,
        speed_slider=entry.speed_slider,
    )


def hand_settings(robot: Robot, entry: DynamixelEntry) -> HandSettings:
    """Return what a hand is told.

    Raises:
        InvalidValueError: Fingers that cannot close.
    """
    return HandSettings(
        tuple(ServoCalibration(servo.servo_id, servo.zero, servo.direction) for servo in entry.servos),
        _finger_geometry(entry),
        opening=entry.opening,
        tip_along=robot.file.fingers[0].surface.center[2],
        closing_speed=entry.closing_speed,
        baud_rate=entry.baud_rate,
        watchdog=entry.watchdog,
        silence=entry.silent_after,
    )


def _finger_geometry(entry: DynamixelEntry) -> FingerGeometry:
    if isinstance(entry.finger, SlideFingerEntry):
        return SlideFinger(pinion=entry.finger.pinion)
    return HingeFinger(length=entry.finger.length)


def _geometry(robot: Robot, entry: DynamixelEntry) -> Hand:
    """Where the sensors are in the hand frame; of the tip only its place matters."""
    along = robot.file.fingers[0].surface.center[2]
    tip = Tip(Sphere(0.008, center=np.array([0.0, 0.0, along])), mass=0.015)
    return Hand(len(entry.servos), _finger_geometry(entry), tip, opening=entry.opening, depth=entry.depth)


def _sensor(robot: Robot, i: int, arm: UrArm | None) -> FingerSensor:
    """The sensor behind finger i, and what it carries."""
    file, payload, entry = robot.sensors[i], payload_of(robot, i), robot.file.fingers[i].sensor_device
    bias = NO_LOAD
    if file is not None:
        a, b, c, d, e, f = file.bias
        bias = (a, b, c, d, e, f)
    if isinstance(entry, UrToolEntry):
        if arm is None:
            raise InvalidValueError(f"fingers[{i}].sensor_device.kind = ur_tool: there is no backend.arm")
        if payload.mass > 0.0:
            raise InvalidValueError(
                f"fingers[{i}]: a payload of {payload.mass:g} kg on the arm's own sensor: its controller takes "
                "the weight off (backend.arm.payload); write mass_kg: 0 here"
            )
        return FingerSensor(UrToolSensor(arm), payload, bias, in_arm=True)
    raw = file is not None and file.calibration is not None
    return FingerSensor(_device(robot, i, file), payload, bias, gives_wrenches=not raw)


def _device(robot: Robot, i: int, file: SensorFile | None) -> SensorDevice:
    entry, noise = robot.file.fingers[i].sensor_device, noise_of_finger(robot, i)
    match entry:
        case NetFtEntry():
            return NetFt(
                entry.address,
                NetFtSettings(
                    StreamSettings(noise, silent_after=entry.silent_after),
                    scales=RAW if file is not None and file.calibration is not None else None,
                    rdt_port=entry.port,
                    calibration_port=entry.calibration_port,
                ),
            )
        case OnRobotEntry():
            settings = onrobot_settings(
                noise, period=entry.record_period, cutoff=entry.cutoff, rdt_port=entry.port
            )
            return NetFt(entry.address, settings)
        case BotaEntry():
            stream = StreamSettings(noise, silent_after=entry.silent_after)
            return SerialSensor(entry.path, Bota(entry.sinc_length), stream)
        case ResenseEntry():
            stream = StreamSettings(noise, silent_after=entry.silent_after)
            make = Resense(entry.force_range, entry.moment_range, period=entry.record_period)
            return SerialSensor(entry.path, make, stream)
        case _:
            raise InvalidValueError(f"fingers[{i}].sensor_device: there is none")
