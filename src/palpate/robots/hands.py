"""From a robot file to a hand: what planning must know of it, and what moves. Simulated, emulated, or of a rig."""

import itertools
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.errors import InvalidValueError
from palpate.robots.backend_entries import EmulatedHandEntry
from palpate.robots.emulated.hand import HandWires, emulated_hand
from palpate.robots.entry import entry_of
from palpate.robots.hand_task import PERIOD, HandTask
from palpate.robots.rig_built import assembled, described_finger, tared_if_configured
from palpate.robots.rig_entries import RigEntry
from palpate.robots.rig_settings import hand_geometry, noise_of_finger
from palpate.robots.robot import Robot, load_robot, shipped_robots
from palpate.robots.surface_entries import SphereEntry
from palpate.runtime import Backend, Finger, FingerDescription, Limits
from palpate.sensing.compensation import SensorPayload
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import Hand, three_finger_hand, two_finger_hand
from palpate.surfaces import Sphere

LONGEST_PERIOD = 4e-3
"""[s] Of a rig: a controller must react to slip within some ten periods, 40 ms."""

LIMITS = Limits(force=24.0, grip_force=24.0, moment=0.25)
"""Of the simulated hand: as its sensors', and above the largest grip that is commanded."""

LEAST_TOUCH, SIGMAS = 0.2, 5.0
"""[N], and standard deviations of a reading: above both it is a touch."""

ALIKE = 1e-6
"""[m, kg] between an emulated fingertip in a file and the simulated one."""

_buses = itertools.count()


@dataclass(frozen=True, slots=True, eq=False)
class HandDescription:
    """A hand, before anything moves.

    Attributes:
        geometry: Where fingers and sensors are.
        fingers: For touch, one per finger.
        period: Of control [s].
        limits: For the supervisor.
        robot: That has it; None: it is simulated, and nothing else.
    """

    geometry: Hand
    fingers: tuple[FingerDescription, ...]
    period: float = PERIOD
    limits: Limits = LIMITS
    robot: Robot | None = None

    @property
    def real(self) -> bool:
        """Whether it is a rig's, so that the truth is unknown."""
        return self.robot is not None and isinstance(self.robot.file.backend, RigEntry)


def simulated_hand(fingers: int) -> HandDescription:
    """Return the simulated hand with two or three fingers."""
    geometry = two_finger_hand() if fingers == 2 else three_finger_hand()
    tip = geometry.tip
    return HandDescription(geometry, (Finger(tip.surface, SensorPayload(tip.mass, tip.center_of_mass)),) * fingers)


def has_hand(robot: Robot) -> bool:
    """Return whether it has fingers that close on an object."""
    backend = robot.file.backend
    if isinstance(backend, RigEntry):
        return backend.hand is not None and len(robot.file.fingers) > 1
    return isinstance(backend, EmulatedHandEntry)


def robots_with_hand() -> str:
    """Return the names of those that come with palpate, as a list in a sentence."""
    return ", ".join(name for name in shipped_robots() if has_hand(load_robot(name)))


def described_hand(robot: Robot) -> HandDescription:
    """Return the hand of a robot that has one (see `has_hand`).

    Raises:
        InvalidValueError: Nothing can be held with it as its file specifies; the message names what to change.
    """
    return _emulated(robot) if isinstance(robot.file.backend, EmulatedHandEntry) else _of_rig(robot)


def hand_backend(hand: HandDescription, task: HandTask) -> Backend:
    """Return what carries a task out; nothing is opened before it starts.

    Raises:
        InvalidValueError: It cannot be simulated, or not be built as its robot file specifies.
    """
    robot = hand.robot
    if robot is None:
        return HandBackend(task.scene(), task.period, sensor=task.sensor, load=task.load)
    if isinstance(robot.file.backend, EmulatedHandEntry):
        return emulated_hand(task, hand_wires(robot.file.backend))
    start = (0.0, 0.0, hand.geometry.depth + hand.geometry.tip_along)
    return tared_if_configured(robot, assembled(robot, hand.period, start))


def hand_wires(entry: EmulatedHandEntry) -> HandWires:
    """Return where the devices of an emulated hand listen; the bus where nobody else's is."""
    bus = Path(tempfile.gettempdir()) / f"palpate-hand-{os.getpid()}-{next(_buses)}"
    return HandWires(entry.address, entry.sensors, bus, entry.time_scale)


def _emulated(robot: Robot) -> HandDescription:
    simulated = simulated_hand(len(robot.file.fingers))
    if robot.file.period != PERIOD:
        raise InvalidValueError(f"period_s = {robot.file.period:g}: must be {PERIOD:g} for an emulated hand")
    tip = simulated.geometry.tip
    assert isinstance(tip.surface, Sphere)
    radius, mass, center = tip.surface.radius, tip.mass, tip.center_of_mass
    for i, finger in enumerate(robot.file.fingers):
        surface, payload = finger.surface, finger.payload
        alike = (
            isinstance(surface, SphereEntry)
            and payload is not None
            and np.allclose(surface.center, center, atol=ALIKE)
            and abs(surface.radius - radius) < ALIKE
            and abs(payload.mass - mass) < ALIKE
            and np.allclose(payload.center_of_mass, center, atol=ALIKE)
        )
        if not alike:
            raise InvalidValueError(
                f"fingers[{i}]: an emulated hand has spheres of {radius:g} m around {list(center)} m, of {mass:g} "
                "kg with their centre of mass there, and no sensor file; write surface and payload so"
            )
    limits = robot.file.limits
    return HandDescription(simulated.geometry, simulated.fingers, PERIOD, limits, robot)


def _of_rig(robot: Robot) -> HandDescription:
    entry = entry_of(robot, RigEntry)
    assert entry.hand is not None  # it has a hand
    if entry.arm is None:
        raise InvalidValueError("backend.arm: there is none, and a grasp lifts; give it")
    if robot.file.period > LONGEST_PERIOD:
        raise InvalidValueError(
            f"period_s = {robot.file.period:g}: must be at most {LONGEST_PERIOD:g} for a grasp"
        )
    surfaces = [finger.surface for finger in robot.file.fingers]
    if not all(isinstance(each, SphereEntry) and not any(each.center[:2]) for each in surfaces):
        raise InvalidValueError("fingers: a grasp is planned for spheres on the sensors' z axis; see surface")
    fingers = tuple(
        described_finger(
            robot, i, surface.surface(), max(LEAST_TOUCH, SIGMAS * max(noise_of_finger(robot, i)[:3]))
        )
        for i, surface in enumerate(surfaces)
    )
    return HandDescription(hand_geometry(robot, entry.hand), fingers, robot.file.period, robot.file.limits, robot)
