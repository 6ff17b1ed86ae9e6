"""A robot over, or a hand around, something that it could touch, for whoever only looks at its devices."""

from palpate.robots.finger_sensor import model_of_finger
from palpate.robots.fingertip import fingertip, only_finger, start_above
from palpate.robots.hand_task import HandTask
from palpate.robots.robot import Robot
from palpate.robots.task import Task
from palpate.sim import Box, SceneObject, SeededSensor, SphereObject
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.hand_model import HandModel, opening_of
from palpate.sim.hand.scene import HeldObject
from palpate.sim.objects.table import Table
from palpate.sim.presets import EXPLORE
from palpate.sim.sensor.model import SensorModel
from palpate.sim.sensor.stages import WhiteNoise, alike

RADIUS = 0.04
"""Of the sphere below the tip [m]."""

PLATE = Box((0.1, 0.1, 0.02))
"""Edge lengths [m]."""

CLEARANCE = 0.003
"""From the tip to what is below [m]."""

LEAST_TOUCH_FORCE = 0.2
"""[N]"""

FORCE_NOISE, MOMENT_NOISE = 0.01, 1e-4
"""[N], [N m] Standard deviations of a fingertip's sensor by default: of a Nano17."""


def idle_task(robot: Robot) -> Task:
    """Return a task in which a robot stands over a sphere.

    Raises:
        InvalidValueError: It has no fingertip that can be simulated.
    """
    return _over(robot, SphereObject(RADIUS), LEAST_TOUCH_FORCE)


def plate_task(robot: Robot) -> Task:
    """Return a task in which a robot stands over a plate that is as stiff as experiments assume.

    Raises:
        InvalidValueError: It has no fingertip that can be simulated.
    """
    return _over(robot, PLATE, EXPLORE.law.smallest_force)


def _over(robot: Robot, target: SceneObject, touch_force: float) -> Task:
    tip = fingertip(robot)
    return Task(
        tip=tip,
        compression=0.0,
        target=target,
        law=EXPLORE.law,
        start=start_above(tip, target.top, CLEARANCE),
        period=robot.file.period,
        sensor=SeededSensor(model_of_finger(only_finger(robot))),
        touch_force=touch_force,
    )


def idle_hand_task(hand: HandModel) -> HandTask:
    """Return a task for a hand that only stands there, open around a ball: to examine its devices."""
    ball = SphereObject(0.5 * opening_of(hand))
    noise = WhiteNoise(alike(FORCE_NOISE, MOMENT_NOISE))
    sensor = SeededSensor(SensorModel(noise=noise))
    return HandTask(hand, HeldObject(ball), GraspContact(), Table(-ball.radius), sensor=sensor)
