"""From a robot file to a robot that can move: which builder makes which kind of back end."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from palpate.errors import InvalidValueError
from palpate.robots.backend_entries import (
    BackendEntry,
    EmulatedHandEntry,
    EmulatedUr5eEntry,
    SimulatedUr5eEntry,
    StageEntry,
    TurningStageEntry,
)
from palpate.robots.emulated.ur5e import build_emulated_ur5e
from palpate.robots.finger_sensor import model_of_finger
from palpate.robots.hands import described_hand
from palpate.robots.impact_force import CONTACT, ImpactForce, rig_impact_force
from palpate.robots.rig_built import build_rig, check_rig
from palpate.robots.rig_entries import RigEntry
from palpate.robots.robot import Robot
from palpate.robots.simulated_stage import (
    RobotInScene,
    Task,
    build_stage,
    build_turning_stage,
    check_simulated,
    only_finger,
    tip_sizes,
)
from palpate.robots.simulated_ur5e import build_ur5e
from palpate.sim import Box, SeededSensor
from palpate.sim.presets import EXPLORE

PLATE, ABOVE = Box((0.1, 0.1, 0.02)), 0.003
"""What a robot stands over to see how it is built, and how far [m]."""

Builder = Callable[[Robot, Task], RobotInScene]
"""Raises InvalidValueError if the robot cannot be built as its file specifies, or cannot do the task."""


def _no_finger(robot: Robot, task: Task) -> RobotInScene:
    raise InvalidValueError(
        "backend.kind = emulated_hand: it is for `palpate grasp`; this experiment is done with one finger, take "
        "emulated-ur5e"
    )


@dataclass(frozen=True, slots=True)
class _Kind:
    """A kind of back end: its entry in the file, and what makes it."""

    entry: type[BackendEntry]
    build: Builder


KINDS = (
    _Kind(StageEntry, build_stage),
    _Kind(TurningStageEntry, build_turning_stage),
    _Kind(SimulatedUr5eEntry, build_ur5e),
    _Kind(EmulatedUr5eEntry, build_emulated_ur5e),
    _Kind(EmulatedHandEntry, _no_finger),
    _Kind(RigEntry, build_rig),
)
"""Every kind of `backend` that experiments can carry out."""


def build(robot: Robot, task: Task) -> RobotInScene:
    """Return a robot that stands ready for a task.

    Raises:
        InvalidValueError: It cannot be built as its file specifies, or cannot do the task; the message names what
            to change.
    """
    ready = _kind(robot).build(robot, task)
    ImpactForce(robot.file.limits, ready.landing_model(CONTACT)).check()
    return ready


def over_a_plate(robot: Robot, contact_stiffness: float = CONTACT) -> RobotInScene:
    """Return a robot with one fingertip that stands `ABOVE` a plate, on which it can press [N/m].

    Raises:
        InvalidValueError: It cannot be built as its file specifies.
    """
    tip, (x, y, z) = tip_sizes(robot), only_finger(robot).surface.center
    task = Task(
        tip=tip,
        compression=0.0,
        target=PLATE,
        law=replace(EXPLORE.law, stiffness=contact_stiffness),
        start=(-x, -y, PLATE.top + max(tip) + ABOVE - z),
        period=robot.file.period,
        sensor=SeededSensor(model_of_finger(only_finger(robot))),
        touch_force=EXPLORE.law.smallest_force,
    )
    return _kind(robot).build(robot, task)


def impact_force(robot: Robot) -> ImpactForce | None:
    """Return how hard a robot presses at its limits; None if it has no arm that could.

    Raises:
        InvalidValueError: It cannot be built as its file specifies.
    """
    if isinstance(robot.file.backend, EmulatedHandEntry):
        return None
    if isinstance(robot.file.backend, RigEntry):
        return rig_impact_force(robot)
    return ImpactForce(robot.file.limits, over_a_plate(robot).landing_model(CONTACT))


def check(robot: Robot) -> None:
    """Check that a robot can be built at all.

    Raises:
        InvalidValueError: It cannot; the message names what to change.
    """
    _kind(robot)  # there is one
    if isinstance(robot.file.backend, RigEntry):
        check_rig(robot)
    elif isinstance(robot.file.backend, EmulatedHandEntry):
        described_hand(robot)
    else:
        check_simulated(robot, robot.file.backend.time_step)
    pressed = impact_force(robot)
    if pressed is not None:
        pressed.check()


def _kind(robot: Robot) -> _Kind:
    for kind in KINDS:
        if isinstance(robot.file.backend, kind.entry):
            return kind
    raise InvalidValueError(f"backend.kind: no experiment runs on a {type(robot.file.backend).__name__} yet")
