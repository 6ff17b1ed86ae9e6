"""Robots that are simulated with one fingertip: a carrier in a scene, as `backend` of a robot file."""

from dataclasses import dataclass
from typing import ClassVar

import msgspec

from palpate.controllers import LandingModel
from palpate.errors import InvalidValueError
from palpate.open_kinds import name_of_kind
from palpate.robots.device_settings import Range, RangedSettings
from palpate.robots.finger_sensor import check_age, model_of_finger
from palpate.robots.fingertip import only_finger
from palpate.robots.idle import plate_task
from palpate.robots.known_sensor import known_sensor
from palpate.robots.robot import Robot
from palpate.robots.robot_file import FingerEntry
from palpate.robots.robot_kind import RobotKind
from palpate.robots.surface_entries import SurfaceKind
from palpate.robots.task import RobotInScene, Task
from palpate.runtime import Finger, FingerDescription, SensorFinger
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.ft.sensor_file import SensorFile
from palpate.sim import Carrier, Fidelity, MujocoBackend, SeededSensor, Tip, build_scene
from palpate.surfaces import CompliantTip

SAME_RATE = 1e-9
"""Relative tolerance of times that are meant to be equal."""


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

    def tip_carrier(self, robot: Robot, tip: Tip, task: Task) -> TipCarrier:
        """Return what carries a tip to where a task starts.

        Raises:
            InvalidValueError: It cannot, for the start is out of reach, or settings contradict one another.
        """
        raise NotImplementedError

    def check(self, robot: Robot) -> None:
        """See `RobotKind`."""
        finger, sensor = only_finger(robot), robot.sensors[0]
        _tip(finger, sensor, finger.surface)
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
        tip = _tip(finger, file, task.tip)
        moved = self.tip_carrier(robot, tip, task)
        sensor = known_sensor(finger, file, task.sensor, task.period)
        scene = build_scene(
            tip, task.target, task.law, task.start, moved.carrier, moved.fidelity, friction=task.rubbing
        )
        described: FingerDescription
        if sensor is None:
            touch_force = task.touch_force
            payload, noise = SensorPayload(tip.mass, tip.center_of_mass), task.sensor.model.dithering
            described = Finger(task.sensed, payload, touch_force, touch_force / 2.0, noise)
        else:
            touch_force = sensor.contact.touch_force
            described = SensorFinger(task.sensed, sensor)
        return RobotInScene(
            MujocoBackend(scene, task.period, task.sensor, robot.file.pace.pacer(task.period)),
            described,
            moved.lag,
            moved.response,
            moved.stiffness,
            touch_force,
            following_error_limit=moved.following_error_limit,
        )

    def approximation(self, robot: Robot) -> str:
        """See `RobotKind`."""
        finger = only_finger(robot)
        return _tip(finger, robot.sensors[0], finger.surface).approximation

    def landing_model(self, robot: Robot) -> LandingModel | None:
        """See `RobotKind`: as on a plate."""
        task = plate_task(robot)
        return self.build(robot, task).landing_model(task.law.stiffness)


def _tip(finger: FingerEntry, sensor: SensorFile | None, kind: SurfaceKind) -> Tip:
    """Return the tip on its sensor, as heavy as the robot file or its sensor file says.

    Raises:
        InvalidValueError: It cannot be simulated.
    """
    key = "payload" if sensor is None else f"payload in {finger.sensor}"
    payload = sensor.payload if sensor is not None else finger.payload
    assert payload is not None  # FingerEntry has made sure that one of the two is given
    if not payload.mass > 0.0:
        raise InvalidValueError(
            f"fingers[0], {key}: mass_kg = {payload.mass:g}: a simulated tip weighs something; 0.03 is usual"
        )
    surface = kind.surface()
    try:
        shape = surface.surface if isinstance(surface, CompliantTip) else surface
        return Tip(shape, payload.mass, balance=payload.center_of_mass)
    except InvalidValueError as error:
        word = name_of_kind(kind)
        raise InvalidValueError(f"fingers[0].surface.kind = {word}: it cannot be simulated: {error}") from None
