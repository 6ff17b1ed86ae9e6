"""A robot over something that it could touch, for whoever only looks at its devices."""

from palpate.robots.finger_sensor import model_of_finger
from palpate.robots.simulated_stage import Task, only_finger, tip_sizes
from palpate.runtime.robot import Robot
from palpate.sim import SeededSensor, SphereObject
from palpate.sim.presets import EXPLORE

RADIUS = 0.04
"""Of the sphere below the tip [m]."""

CLEARANCE = 0.003
"""From the tip to it [m]."""

LEAST_TOUCH_FORCE = 0.2
"""[N]"""


def idle_task(robot: Robot) -> Task:
    """Return a task in which a robot stands over a sphere.

    Raises:
        InvalidValueError: It has no fingertip that can be simulated.
    """
    tip = tip_sizes(robot)
    target = SphereObject(RADIUS)
    x, y, z = only_finger(robot).surface.center
    return Task(
        tip=tip,
        compression=0.0,
        target=target,
        law=EXPLORE.law,
        start=(-x, -y, target.top + max(tip) + CLEARANCE - z),
        period=robot.file.period,
        sensor=SeededSensor(model_of_finger(robot.file.fingers[0])),
        touch_force=LEAST_TOUCH_FORCE,
    )
