"""What passes through the loop once per period.

All of it is immutable, and but for `Contact` made of plain tuples, so that a recorded run can be replayed bit for
bit. Times are when a quantity was sampled, never when it was logged.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from palpate.quick_init import quick_init
from palpate.sensing.contact import Contact, ContactStatus
from palpate.sensing.ft.health import HEALTHY, SampleHealth
from palpate.spatial import ZERO, Matrix, Vector, Wrench


@quick_init
@dataclass(frozen=True, slots=True)
class ArmSample:
    """Where the arm holds the fingertip.

    Attributes:
        time: When it was sampled [s].
        position_base_tip: Origin of the tip frame in base coordinates [m].
        rotation_base_tip: Maps tip to base coordinates.
        velocity_base_tip: Velocity of the tip frame's origin in base coordinates [m/s].
        joint_position: Of each joint [rad, or m if it slides]; empty if the arm does not tell.
        angular_velocity_base_tip: Of the tip frame, in base coordinates [rad/s].
        tip_force_base: What the surroundings exert on all that the flange carries, in base coordinates, weight
            taken off [N], as the arm itself measures it with a sensor in its flange or its motors: a second
            channel beside the fingertip's sensor. None if the arm does not report it, or has no other sensor.
    """

    time: float
    position_base_tip: Vector
    rotation_base_tip: Matrix
    velocity_base_tip: Vector
    joint_position: tuple[float, ...] = ()
    angular_velocity_base_tip: Vector = ZERO
    tip_force_base: Vector | None = None


@quick_init
@dataclass(frozen=True, slots=True)
class HandSample:
    """State that a hand reported.

    Attributes:
        time: When it was sampled [s].
        joint_position: Of each joint [rad, or m if it slides]: first those that close the fingers, then those
            that move the fingers sideways, then those that nobody drives, as an object that turns between the
            fingertips.
    """

    time: float
    joint_position: tuple[float, ...]


@quick_init
@dataclass(frozen=True, slots=True)
class WrenchSample:
    """Reading of a force/torque sensor behind a fingertip.

    Attributes:
        time: When it was sampled [s].
        wrench: Load on the sensor's tip side as the device gives it, in the sensor frame [N, N m]: contact
            plus the weight and inertia of what is mounted on it. Raw channels, if the sensor file calibrates.
        acceleration: Specific force at the sensor's origin in the sensor frame [m/s^2], as an accelerometer
            gives it: at rest it points up and has length g.
    """

    time: float
    wrench: tuple[float, ...]
    acceleration: Vector


@quick_init
@dataclass(frozen=True, slots=True)
class Sample:
    """What the devices reported in one period.

    Attributes:
        time: Time of the period on the back end's clock [s]; it advances from sample to sample.
        arm: State of the arm.
        wrenches: One per finger.
        hand: State of the hand; None if there is none.
    """

    time: float
    arm: ArmSample
    wrenches: tuple[WrenchSample, ...]
    hand: HandSample | None = None


@quick_init
@dataclass(frozen=True, slots=True)
class FingerObservation:
    """What touch makes of one finger's wrench. Its sensor frame is the tip frame of `ArmSample`.

    Attributes:
        time: When the wrench was sampled [s].
        wrench: What the object exerts on the finger: the device's wrench with weight and inertia taken off.
        contact: The contact that explains it.
        touching: Whether the force says that there is a contact at all (threshold with hysteresis).
        health: What is wrong with the sensor, if anything.
    """

    time: float
    wrench: Wrench
    contact: Contact
    touching: bool
    health: SampleHealth = HEALTHY

    @property
    def force(self) -> Vector:
        """Of `wrench` [N]."""
        x, y, z, _, _, _ = self.wrench
        return (x, y, z)

    @property
    def believed(self) -> bool:
        """Whether it touches, and what it feels can be believed."""
        return self.touching and self.health.ok and self.contact.status is ContactStatus.OK


@quick_init
@dataclass(frozen=True, slots=True)
class Observation:
    """What is known at one period: all that a controller sees.

    Attributes:
        time: As in the sample [s].
        arm: State of the arm.
        fingers: One per wrench of the sample.
        hand: State of the hand; None if there is none.
    """

    time: float
    arm: ArmSample
    fingers: tuple[FingerObservation, ...]
    hand: HandSample | None = None


class Phase(StrEnum):
    """What a controller is doing: for reports, and to tell the periods of a scan.

    TRAVEL is motion from place to place above an object; DONE and LOST end a run; STOP is how supervisor and loop
    bring it to rest.
    """

    APPROACH = "approach"
    SETTLE = "settle"
    SCAN = "scan"
    SEEK = "seek"
    LIFT = "lift"
    TRAVEL = "travel"
    HOLD = "hold"
    STOP = "stop"
    DONE = "done"
    LOST = "lost"

    @property
    def is_final(self) -> bool:
        """Whether the run ends here."""
        return self in (Phase.DONE, Phase.LOST)


@quick_init
@dataclass(frozen=True, slots=True)
class Command:
    """What arm and hand are to do during the next period.

    Attributes:
        velocity_base_tip: Velocity of the tip frame's origin in base coordinates [m/s].
        phase: What the controller is doing.
        grip_force: Normal force with which each finger of the hand is to press [N]; None: as before. So no
            command that says nothing of the hand, a stop above all, makes it let go.
        angular_velocity_base_tip: Of the tip frame, in base coordinates [rad/s]; a robot that cannot turn its tip
            refuses any but zero.
        finger_velocity: Velocity with which each fingertip of the hand is to move, in its sensor frame [m/s]; None
            for a finger, or for all: it only presses. A finger that presses, along x of that frame, moves by the
            other two components; one whose grip force is 0 by all three. A hand whose fingers cannot move so
            refuses.
    """

    velocity_base_tip: Vector = ZERO
    phase: Phase = Phase.HOLD
    grip_force: tuple[float, ...] | None = None
    angular_velocity_base_tip: Vector = ZERO
    finger_velocity: tuple[Vector | None, ...] | None = None

    def __post_init__(self) -> None:
        # tuples go by at no cost; whoever computes with arrays may give them as they are
        if type(self.velocity_base_tip) is not tuple:
            object.__setattr__(self, "velocity_base_tip", _plain(self.velocity_base_tip))
        if type(self.angular_velocity_base_tip) is not tuple:
            object.__setattr__(self, "angular_velocity_base_tip", _plain(self.angular_velocity_base_tip))


def _plain(given: Any) -> Any:
    """Return an array or a list as a tuple, all else as it is: the supervisor refuses what is no vector."""
    return tuple(np.ravel(given).tolist()) if isinstance(given, np.ndarray | list) else given
