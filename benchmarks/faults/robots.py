"""A stranger's robot, as a rig to which the same faults are done."""

from importlib import import_module

from faults.fault_rig import FaultyBackend, Rig
from palpate.errors import InvalidValueError
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.experiment import Regulate
from palpate.robots.robot import Robot
from palpate.robots.values import load_named_robot
from palpate.runtime.touch import Touch

DURATION = 0.6
"""For which the force is held [s]."""


def robot_of(name: str) -> Robot:
    """Return the robot of a name, a file, or `module:factory`.

    Raises:
        InvalidValueError: There is none, or the factory makes something else.
    """
    module, colon, factory = name.partition(":")
    if not colon or (not module.isidentifier() and "." not in module):
        return load_named_robot(name)
    made = getattr(import_module(module), factory)()
    if not isinstance(made, Robot):
        raise InvalidValueError(
            f"robot = {name!r}: makes a {type(made).__name__}; must be a palpate.robots.robot.Robot"
        )
    return made


def planned_rig(name: str, seed: int) -> Rig:
    """Return a rig of this robot that holds a force, as `palpate regulate` plans it."""
    config = RegulateConfig(robot=name, duration=DURATION)
    plan = Regulate().plan(config, robot_of(name), {})
    return Rig(
        FaultyBackend(plan.backend()),
        Touch(*plan.fingers),
        plan.controller(),
        plan.limits,
        plan.longest_duration,
        expected=plan.expected_duration,
        stiffness=20e3,
    )
