"""A hand, before anything moves: what planning must know of it. Simulated, emulated, or of a rig."""

from dataclasses import dataclass

from palpate.robots.hand_task import PERIOD, HandTask
from palpate.robots.robot import Robot, load_robot, shipped_robots
from palpate.runtime import Backend, Finger, FingerDescription, Limits
from palpate.sensing.compensation import SensorPayload
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import three_finger_hand, two_finger_hand
from palpate.sim.hand.hand_model import HandModel

LIMITS = Limits(force=24.0, grip_force=24.0, moment=0.25)
"""Of the simulated hand: as its sensors', and above the largest grip that is commanded."""


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

    geometry: HandModel
    fingers: tuple[FingerDescription, ...]
    period: float = PERIOD
    limits: Limits = LIMITS
    robot: Robot | None = None

    @property
    def real(self) -> bool:
        """Whether it is a rig's, so that the truth is unknown."""
        return self.robot is not None and self.robot.file.backend.REAL


def simulated_hand(fingers: int) -> HandDescription:
    """Return the simulated hand with two or three fingers."""
    geometry = two_finger_hand() if fingers == 2 else three_finger_hand()
    tip = geometry.tip
    return HandDescription(geometry, (Finger(tip.surface, SensorPayload(tip.mass, tip.center_of_mass)),) * fingers)


def robots_with_hand() -> str:
    """Return the names of those that come with palpate, as a list in a sentence."""
    robots = {name: load_robot(name) for name in shipped_robots()}
    return ", ".join(name for name, robot in robots.items() if robot.file.backend.has_hand(robot))


def hand_backend(hand: HandDescription, task: HandTask) -> Backend:
    """Return what carries a task out; nothing is opened before it starts.

    Raises:
        InvalidValueError: It cannot be simulated, or not be built as its robot file specifies.
    """
    if hand.robot is None:
        return HandBackend(task.scene(), task.period, sensor=task.sensor, load=task.load)
    return hand.robot.file.backend.hand_backend(hand, task)
