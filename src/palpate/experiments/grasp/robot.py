"""From a planned grasp to the hand that carries it out: simulated, emulated on the wire, or a rig's."""

import itertools
import os
import tempfile
from pathlib import Path

from palpate.experiments.grasp.plan import GraspPlan
from palpate.robots.emulated.hand import HandWires, grasp_on_the_wire
from palpate.robots.rig_built import assembled, tared_if_told
from palpate.runtime import Backend
from palpate.runtime.robot import Robot
from palpate.runtime.robot_backend import EmulatedHandEntry

_buses = itertools.count()


def hand_backend(planned: GraspPlan) -> Backend:
    """Return what carries a grasp out, over the object; nothing is opened before it starts.

    Raises:
        InvalidValueError: It cannot be.
    """
    hand, robot = planned.hand, planned.hand.robot
    if robot is None:
        return planned.backend()
    if isinstance(robot.file.backend, EmulatedHandEntry):
        return grasp_on_the_wire(planned, hand_wires(robot.file.backend))
    start = (0.0, 0.0, hand.hand.depth + hand.hand.tip_along)
    return tared_if_told(robot, assembled(robot, hand.period, start))


def hand_wires(entry: EmulatedHandEntry) -> HandWires:
    """Return where the devices of an emulated hand listen; the bus where nobody else's is."""
    bus = Path(tempfile.gettempdir()) / f"palpate-hand-{os.getpid()}-{next(_buses)}"
    return HandWires(entry.address, entry.sensors, bus, entry.time_scale)


def name_of(robot: Robot | None) -> str:
    """Return what a report calls it."""
    return "simulated hand" if robot is None else robot.file.name
