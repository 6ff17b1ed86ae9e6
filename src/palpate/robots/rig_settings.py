"""Settings of a rig's devices from a robot file."""

import numpy as np

from palpate.errors import InvalidValueError
from palpate.hw.dynamixel.settings import LENGTHS, HandSettings, ServoCalibration
from palpate.hw.ur import FlangePayload, UrSettings
from palpate.kinematics.pose import Pose, rotation_from_rotvec
from palpate.robots.rig_entries import DynamixelEntry, PoseEntry, SlideFingerEntry, UrEntry
from palpate.robots.robot import Robot
from palpate.robots.surface_entries import SphereEntry
from palpate.sensing.compensation import SensorPayload
from palpate.sim import Tip
from palpate.sim.hand.finger import FingerJoint, HingeFinger, SlideFinger
from palpate.sim.hand.hand import Hand
from palpate.spatial import Wrench
from palpate.surfaces import Sphere

LEAST_TIP_MASS = 1e-6
"""[kg] A simulated tip has some; here only its place matters."""

USUAL_RADIUS = 0.008
"""[m] Stands for a tip that is no sphere, likewise."""


def pose_of(entry: PoseEntry) -> Pose:
    """Return a pose of a robot file."""
    return Pose(entry.position, rotation_from_rotvec(entry.rotvec))


def payload_of(robot: Robot, i: int) -> SensorPayload:
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
    """Return the settings of a UR arm.

    Raises:
        InvalidValueError: A limit of the robot is beyond what the arm accepts.
    """
    limits, payload = robot.file.limits, entry.payload
    return UrSettings(
        pose_flange_tip=pose_of(entry.tcp),
        payload=None if payload is None else FlangePayload(payload.mass, payload.center_of_mass),
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
    """Return the settings of a hand.

    Raises:
        InvalidValueError: Fingers that cannot close, or times with which a late reply is taken for a new one.
    """
    longest = LENGTHS * entry.reply_timeout
    if entry.silent_after > longest * (1.0 + 1e-9):
        raise InvalidValueError(
            f"backend.hand.silent_after_s = {entry.silent_after:g}: must be at most {longest:g}, {LENGTHS} times "
            "reply_timeout_s: a reply later than that cannot be told from a new one"
        )
    return HandSettings(
        tuple(ServoCalibration(servo.servo_id, servo.zero, servo.direction) for servo in entry.servos),
        _finger_geometry(entry),
        opening=entry.opening,
        tip_along=robot.file.fingers[0].surface.center[2],
        closing_speed=entry.closing_speed,
        baud_rate=entry.baud_rate,
        watchdog=entry.watchdog,
        reply_timeout=entry.reply_timeout,
        silence=entry.silent_after,
    )


def _finger_geometry(entry: DynamixelEntry) -> FingerJoint:
    if isinstance(entry.finger, SlideFingerEntry):
        return SlideFinger(pinion=entry.finger.pinion)
    return HingeFinger(length=entry.finger.length)


def hand_geometry(robot: Robot, entry: DynamixelEntry) -> Hand:
    """Return where the sensors and tips are in the hand frame.

    Raises:
        InvalidValueError: Fingers that cannot close, or neither two nor three of them.
    """
    surface = robot.file.fingers[0].surface
    radius = surface.radius if isinstance(surface, SphereEntry) else USUAL_RADIUS
    sphere = Sphere(radius, center=np.array([0.0, 0.0, surface.center[2]]))
    return Hand(
        len(entry.servos),
        _finger_geometry(entry),
        Tip(sphere, max(payload_of(robot, 0).mass, LEAST_TIP_MASS)),
        opening=entry.opening,
        depth=entry.depth,
        closing_speed=entry.closing_speed,
        bus_period=entry.poll,
    )
