"""The simulated stage of a robot file, one that turns or not, above the object that it is to touch."""

import math
from dataclasses import dataclass, replace

import numpy as np

from palpate.controllers import LandingModel, series_stiffness, tracking_delay
from palpate.controllers.landing import moved_mass
from palpate.errors import InvalidValueError
from palpate.kinematics import FollowingErrorLimit
from palpate.open_kinds import name_of_kind
from palpate.robots.backend_entries import StageEntry, TurningStageEntry
from palpate.robots.entry import entry_of
from palpate.robots.finger_sensor import check_age, model_of_finger
from palpate.robots.known_sensor import known_sensor
from palpate.robots.robot import Robot
from palpate.robots.robot_file import FingerEntry
from palpate.robots.surface_entries import EllipsoidEntry, SphereEntry
from palpate.runtime import Backend, Finger, FingerDescription, SensorFinger
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.ft.sensor_file import PayloadEntry, SensorFile
from palpate.sim import (
    Carrier,
    ContactLaw,
    Fidelity,
    MujocoBackend,
    SceneObject,
    SeededSensor,
    Stage,
    Target,
    Tip,
    TurningStage,
    build_scene,
)
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.presets import EXPLORE
from palpate.spatial import Vector
from palpate.surfaces import Ellipsoid, Sphere

SAME_PLACE = 1e-9
"""[m] tolerance of positions that are meant to be equal."""

SAME_RATE = 1e-9
"""Relative, likewise."""


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """What a robot is to touch, and how it is sensed.

    Attributes:
        tip: Half lengths of the fingertip: one (a sphere's radius) or three (semi-axes) [m].
        compression: How far the tip yields at the set force [m]; sensing assumes a tip smaller by this.
        target: What is touched.
        law: Contact between the two.
        start: Where the tip frame starts, base frame [m].
        period: Control period [s].
        sensor: Behind the tip.
        touch_force: Force that counts as a touch on a sensor of which nothing is known [N].
        rubbing: How the friction plant rubs; None: MuJoCo rubs.
    """

    tip: tuple[float, ...]
    compression: float
    target: SceneObject | Target
    law: ContactLaw
    start: Vector
    period: float
    sensor: SeededSensor
    touch_force: float
    rubbing: FrictionLaw | None = None


@dataclass(frozen=True, slots=True, eq=False)
class RobotInScene:
    """A robot that stands ready.

    Attributes:
        backend: The robot.
        finger: For touch.
        lag: How far it runs behind a ramp [s].
        response: Delay that stands for its servos in force control [s].
        stiffness: With which it holds its tip [N/m].
        touch_force: Force that counts as a touch [N].
        angular_acceleration: With which it can begin to turn [rad/s^2].
    """

    backend: Backend
    finger: FingerDescription
    lag: float
    response: float
    stiffness: float
    touch_force: float
    angular_acceleration: float = math.inf

    def landing_model(self, contact_stiffness: float) -> LandingModel:
        """Return how hard it presses on a contact of this stiffness [N/m]."""
        return LandingModel(
            series_stiffness(contact_stiffness, self.stiffness),
            tracking_delay(self.backend.period, self.response, self.finger.pipeline().delay),
            contact_stiffness,
            moved_mass(self.stiffness, self.response),
        )


def build_stage(robot: Robot, task: Task) -> RobotInScene:
    """Return the simulated stage of a robot file.

    Raises:
        InvalidValueError: The simulation cannot be built as the file specifies, or cannot do the task.
    """
    entry = entry_of(robot, StageEntry)
    stage = Stage(entry.mass, entry.bandwidth, entry.following_error_limit)
    tip = simulated_tip(robot, task)
    fidelity = replace(EXPLORE.fidelity, time_step=entry.time_step)
    return on_a_carrier(robot, task, tip, stage, fidelity, stage.lag, stage.lag, stage.stiffness(tip.mass))


def build_turning_stage(robot: Robot, task: Task) -> RobotInScene:
    """Return the simulated turning stage of a robot file.

    Raises:
        InvalidValueError: The simulation cannot be built as the file specifies, or cannot do the task.
    """
    entry, tip = entry_of(robot, TurningStageEntry), simulated_tip(robot, task)
    following_error_limit = FollowingErrorLimit(entry.following_error_limit, entry.angular_following_error)
    stage = TurningStage(entry.mass, entry.bandwidth, following_error_limit, entry.inertia)
    # implicitfast: the servo of its ball joint counts on damping that is implicit
    fidelity = Fidelity(entry.time_step)
    return on_a_carrier(robot, task, tip, stage, fidelity, stage.lag, stage.lag, stage.stiffness(tip.mass))


def simulated_tip(robot: Robot, task: Task) -> Tip:
    """Return the tip that a task is done with.

    Raises:
        InvalidValueError: The simulation cannot be built as the robot file specifies.
    """
    finger, sensor = only_finger(robot), robot.sensors[0]
    payload = _payload(finger, sensor)
    check_age(robot, task.sensor.model, task.period)
    return Tip(surface_of_tip(finger, task.tip), payload.mass)


def on_a_carrier(
    robot: Robot,
    task: Task,
    tip: Tip,
    carrier: Carrier,
    fidelity: Fidelity,
    lag: float,
    response: float,
    stiffness: float,
) -> RobotInScene:
    """Return a robot that stands ready.

    Args:
        robot: From its file.
        task: What it is to do.
        tip: From `simulated_tip`.
        carrier: What carries the tip.
        fidelity: How it is computed.
        lag: How far the carrier runs behind a ramp [s].
        response: Delay that stands for its servos in force control [s].
        stiffness: With which it holds its tip [N/m].

    Raises:
        InvalidValueError: The simulation cannot be built as the file specifies, or cannot do the task.
    """
    finger = only_finger(robot)
    sensor = known_sensor(finger, robot.sensors[0], task.sensor, task.period)
    scene = build_scene(tip, task.target, task.law, task.start, carrier, fidelity, friction=task.rubbing)
    sensed = surface_of_tip(finger, tuple(length - task.compression for length in task.tip))
    described: FingerDescription
    if sensor is None:
        touch_force = task.touch_force
        payload, noise = SensorPayload(tip.mass, tip.center_of_mass), task.sensor.model.dithering
        described = Finger(sensed, payload, touch_force, touch_force / 2.0, noise)
    else:
        touch_force = sensor.contact.touch_force
        described = SensorFinger(sensed, sensor)
    backend = MujocoBackend(scene, task.period, task.sensor, robot.file.pace.pacer(task.period))
    return RobotInScene(backend, described, lag, response, stiffness, touch_force)


def check_simulated(robot: Robot, time_step: float) -> None:
    """Refuse a simulated robot whose finger or times [s] could do no task at all.

    Raises:
        InvalidValueError: They could not.
    """
    finger, sensor = only_finger(robot), robot.sensors[0]
    _payload(finger, sensor)
    steps = robot.file.period / time_step
    if round(steps) < 1 or abs(round(steps) / steps - 1.0) > SAME_RATE:
        raise InvalidValueError(
            f"period_s = {robot.file.period:g}: must be a whole number of backend.time_step_s, {time_step:g}"
        )
    model = model_of_finger(finger)
    check_age(robot, model, robot.file.period)
    known_sensor(finger, sensor, SeededSensor(model), robot.file.period)


def only_finger(robot: Robot) -> FingerEntry:
    """Return the finger of a robot with one, whose tip can be simulated.

    Raises:
        InvalidValueError: It has several, or a tip of another shape.
    """
    if len(robot.file.fingers) != 1:
        raise InvalidValueError(
            f"robot: it has {len(robot.file.fingers)} fingers, this takes one; for a hand there is palpate grasp"
        )
    finger = robot.file.fingers[0]
    if not isinstance(finger.surface, SphereEntry | EllipsoidEntry):
        kind = name_of_kind(finger.surface)
        raise InvalidValueError(
            f"fingers[0].surface.kind = {kind}: a simulated fingertip is a sphere or an ellipsoid"
        )
    return finger


def tip_sizes(robot: Robot) -> tuple[float, ...]:
    """Return the half lengths of a simulated robot's fingertip [m]: one of a sphere, three of an ellipsoid.

    Raises:
        InvalidValueError: As in `only_finger`.
    """
    surface = only_finger(robot).surface
    if isinstance(surface, SphereEntry):
        return (surface.radius,)
    assert isinstance(surface, EllipsoidEntry)  # only_finger has made sure of it
    return surface.semi_axes


def surface_of_tip(finger: FingerEntry, lengths: tuple[float, ...]) -> Sphere | Ellipsoid:
    """Return the fingertip of these half lengths [m], where the robot file puts it."""
    center, rotation = np.array(finger.surface.center), finger.surface.rotation
    if len(lengths) == 1:
        return Sphere(lengths[0], center=center, rotation=rotation)
    return Ellipsoid((lengths[0], lengths[1], lengths[2]), center=center, rotation=rotation)


def _payload(finger: FingerEntry, sensor: SensorFile | None) -> PayloadEntry:
    """What the tip weighs, and where; the simulation has it at the centre of the surface."""
    key = "payload" if sensor is None else f"payload in {finger.sensor}"
    payload = sensor.payload if sensor is not None else finger.payload
    assert payload is not None  # FingerEntry has made sure that one of the two is given
    if not payload.mass > 0.0:
        raise InvalidValueError(
            f"fingers[0], {key}: mass_kg = {payload.mass:g}: a simulated tip weighs something; 0.03 is usual"
        )
    if math.dist(payload.center_of_mass, finger.surface.center) > SAME_PLACE:
        raise InvalidValueError(
            f"fingers[0], {key}: center_of_mass_m = {list(payload.center_of_mass)}: a simulated tip has it at the "
            f"centre of its surface; write center_of_mass_m: {list(finger.surface.center)}, or move "
            "surface.center_m there"
        )
    return payload
