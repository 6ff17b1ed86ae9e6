"""From a robot file to a robot that can move."""

from dataclasses import replace

from palpate.robots.idle import plate_task
from palpate.robots.impact_force import CONTACT, ImpactForce
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene, Task


def build(robot: Robot, task: Task) -> RobotInScene:
    """Return a robot that stands ready for a task.

    Raises:
        InvalidValueError: It cannot be built as its file specifies, or cannot do the task; the message names what
            to change.
    """
    ready = robot.file.backend.build(robot, task)
    ImpactForce(robot.file.limits, ready.landing_model(CONTACT)).check()
    return ready


def over_a_plate(robot: Robot, contact_stiffness: float = CONTACT) -> RobotInScene:
    """Return a robot with one fingertip that stands over a plate, on which it can press [N/m].

    Raises:
        InvalidValueError: It cannot be built as its file specifies.
    """
    task = plate_task(robot)
    return robot.file.backend.build(robot, replace(task, law=replace(task.law, stiffness=contact_stiffness)))


def impact_force(robot: Robot) -> ImpactForce | None:
    """Return how hard a robot presses at its limits; None if it has no arm that could.

    Raises:
        InvalidValueError: It cannot be built as its file specifies.
    """
    landing = robot.file.backend.landing_model(robot)
    return None if landing is None else ImpactForce(robot.file.limits, landing)


def check(robot: Robot) -> ImpactForce | None:
    """Check that a robot can be built at all; return how hard it presses at its limits, as `impact_force` does.

    Raises:
        InvalidValueError: It cannot; the message names what to change.
    """
    robot.file.backend.check(robot)
    pressed = impact_force(robot)
    if pressed is not None:
        pressed.check()
    return pressed
