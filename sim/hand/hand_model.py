"""What a simulated hand is to scenes and back ends, whatever its fingers are made of."""

import math
from typing import Any, Protocol

import mujoco

from palpate.kinematics.hand import HandKinematics
from palpate.kinematics.pose import Pose
from palpate.runtime.data import HandSample
from palpate.sim.carriers.carrier import CarriedMass
from palpate.sim.tip import Tip
from palpate.spatial import Vector


class HandDrive(Protocol):
    """What moves the fingers of a hand in a compiled scene, and tells where they are; one per run."""

    sample: HandSample
    """Of the last exchange with the fingers."""

    def start(self) -> None:
        """Stand still, open, where the joints are."""
        ...

    def command(self, forces: tuple[float, ...]) -> None:
        """Take the force with which each finger is to press [N], more than it can included; 0 opens it.

        Raises:
            InvalidValueError: Another number of forces than of fingers, or one that is negative or not finite.
        """
        ...

    def move(self, velocities: tuple[Vector | None, ...] | None) -> None:
        """Take the velocity with which each fingertip is to move, as `Command.finger_velocity` [m/s].

        Raises:
            InvalidValueError: Another number of velocities than of fingers, one that is not finite, or one that
                this hand cannot move with.
        """
        ...

    def advance(self) -> None:
        """Set the torques of the next time step; the simulation's step comes next."""
        ...

    def last(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return all joint positions at the last time step, without rounding, and each finger's current [A].

        The current is 0 where a finger's motors are not modelled.
        """
        ...

    def state(self) -> Any:
        """Return all that it remembers, opaque."""
        ...

    def set_state(self, state: Any) -> None:
        """Take back what `state` gave."""
        ...


class HandModel(CarriedMass, HandKinematics, Protocol):
    """A hand that can be put into a scene.

    The hand frame lies in the palm, z along the hand's axis, away from the fingers: up, when it reaches down.
    Each sensor frame has x in the direction in which its finger closes.

    Attributes:
        fingers: How many it has.
        tips: What each finger carries on its sensor.
        start: Joint positions with which a scene starts, as in `HandSample.joint_position` [rad or m].
        center: Middle of the fingertips, hand frame, at the start [m].
        bus_period: At which goals and positions are exchanged with the fingers [s].
        closing_speed: With which fingers close in free space [m/s].
    """

    @property
    def fingers(self) -> int: ...  # noqa: D102
    @property
    def tips(self) -> tuple[Tip, ...]: ...  # noqa: D102
    @property
    def start(self) -> tuple[float, ...]: ...  # noqa: D102
    @property
    def center(self) -> Vector: ...  # noqa: D102
    @property
    def bus_period(self) -> float: ...  # noqa: D102
    @property
    def closing_speed(self) -> float: ...  # noqa: D102

    def add_to(self, spec: mujoco.MjSpec, palm: mujoco.MjsBody) -> None:
        """Add palm, fingers, tips and motors to a scene, joints at `start`.

        Finger i's tip has its own body `finger<i>_tip`, geom and sensor site, each with that prefix.

        Args:
            spec: The scene.
            palm: A body without mass, whose frame is the hand frame.
        """
        ...

    def drive(self, model: mujoco.MjModel, data: mujoco.MjData) -> HandDrive:
        """Return what moves it in a compiled scene."""
        ...


def opening_of(hand: HandModel, first: int = 0) -> float:
    """Return how far the middle of the nearest fingertip is from the hand's axis at the start [m].

    Args:
        hand: The hand.
        first: Fingers before this one do not count.
    """
    pairs = list(zip(hand.sensor_poses(hand.start), hand.tips, strict=True))[first:]
    middles = [(pose @ Pose(tip.center_of_mass)).position for pose, tip in pairs]
    return min(math.hypot(x, y) for x, y, _ in middles)
