"""Robots that are simulated with one fingertip: a carrier in a scene, as `backend` of a robot file."""

import math
from dataclasses import dataclass
from typing import ClassVar

import msgspec

from palpate.controllers import LandingModel
from palpate.errors import InvalidValueError
from palpate.robots.device_settings import Range, RangedSettings
from palpate.robots.finger_sensor import check_age, model_of_finger
from palpate.robots.fingertip import only_finger, surface_of_tip
from palpate.robots.idle import plate_task
from palpate.robots.known_sensor import known_sensor
from palpate.robots.robot import Robot
from palpate.robots.robot_file import FingerEntry
from palpate.robots.robot_kind import RobotKind
from palpate.robots.task import RobotInScene, Task
from palpate.runtime import Finger, FingerDescription, SensorFinger
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.ft.sensor_file import PayloadEntry, SensorFile
from palpate.sim import Carrier, Fidelity, MujocoBackend, SeededSensor, Tip, build_scene

SAME_PLACE = 1e-9
"""[m] tolerance of positions that are meant to be equal."""

SAME_RATE = 1e-9
"""Relative, likewise."""


@dataclass(frozen=True, slots=True, eq=False)
class TipCarrier:
    """A carrier that stands ready for a task.

    Attributes:
        carrier: What carries the tip.
        fidelity: How it is computed.
        lag: How far it runs behind a ramp [s].
        response: Delay that stands for its servos in force control [s].
        stiffness: With which it holds its tip [N/m].
        following_error_limit: By which its reference may lead the tip [m].
    """

    carrier: Carrier
    fidelity: Fidelity
    lag: float
    response: float
    stiffness: float
    following_error_limit: float


class SimulatedKind(RobotKind, RangedSettings, frozen=True, kw_only=True):
    """A carrier in a scene; which, a kind says in `tip_carrier`.

    Attributes:
        time_step: Of the simulation [s]; the control period is a whole number of them.
    """

    METHODS = ("tip_carrier",)
    UNATTENDED = True
    RANGES: ClassVar[tuple[Range, ...]] = (("time_step_s", 1e-6, 0.01, "s"),)

    time_step: float = msgspec.field(name="time_step_s", default=0.0005)

    def tip_carrier(self, tip: Tip, task: Task) -> TipCarrier:
        """Return what carries a tip to where a task starts.

        Raises:
            InvalidValueError: It cannot, for the start is out of reach, or settings contradict one another.
        """
        raise NotImplementedError

    def check(self, robot: Robot) -> None:
        """See `RobotKind`."""
        finger, sensor = only_finger(robot), robot.sensors[0]
        _payload(finger, sensor)
        steps = robot.file.period / self.time_step
        if round(steps) < 1 or abs(round(steps) / steps - 1.0) > SAME_RATE:
            raise InvalidValueError(
                f"period_s = {robot.file.period:g}: must be a whole number of backend.time_step_s, "
                f"{self.time_step:g}"
            )
        model = model_of_finger(finger)
        check_age(robot, model, robot.file.period)
        known_sensor(finger, sensor, SeededSensor(model), robot.file.period)

    def build(self, robot: Robot, task: Task) -> RobotInScene:
        """See `RobotKind`."""
        finger, file = only_finger(robot), robot.sensors[0]
        check_age(robot, task.sensor.model, task.period)
        tip = Tip(surface_of_tip(finger, task.tip), _payload(finger, file).mass)
        moved = self.tip_carrier(tip, task)
        sensor = known_sensor(finger, file, task.sensor, task.period)
        scene = build_scene(
            tip, task.target, task.law, task.start, moved.carrier, moved.fidelity, friction=task.rubbing
        )
        sensed = surface_of_tip(finger, tuple(length - task.compression for length in task.tip))
        described: FingerDescription
        if sensor is None:
            touch_force = task.touch_force
            payload, noise = SensorPayload(tip.mass, tip.center_of_mass), task.sensor.model.dithering
            described = Finger(sensed, payload, touch_force, touch_force / 2.0, noise)
        else:
            touch_force = sensor.contact.touch_force
            described = SensorFinger(sensed, sensor)
        return RobotInScene(
            MujocoBackend(scene, task.period, task.sensor, robot.file.pace.pacer(task.period)),
            described,
            moved.lag,
            moved.response,
            moved.stiffness,
            touch_force,
            following_error_limit=moved.following_error_limit,
        )

    def landing_model(self, robot: Robot) -> LandingModel | None:
        """See `RobotKind`: as on a plate."""
        task = plate_task(robot)
        return self.build(robot, task).landing_model(task.law.stiffness)


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
