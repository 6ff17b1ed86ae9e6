"""What passes through the loop once per period.

All of it is immutable, and but for `Contact` made of plain tuples, so that a recorded run can be replayed bit for
bit. Times are when a quantity was sampled, never when it was logged.
"""

from dataclasses import dataclass
from enum import StrEnum

from palpate.sensing.contact import Contact
from palpate.sensing.ft.health import HEALTHY, Verdict
from palpate.spatial import ZERO, Matrix, Vector, Wrench


@dataclass(frozen=True, slots=True)
class ArmSample:
    """Where the arm holds the fingertip.

    Attributes:
        time: When it was sampled [s].
        position_base_tip: Origin of the tip frame in base coordinates [m].
        rotation_base_tip: Maps tip to base coordinates.
        velocity_base_tip: Velocity of the tip frame's origin in base coordinates [m/s].
    """

    time: float
    position_base_tip: Vector
    rotation_base_tip: Matrix
    velocity_base_tip: Vector


@dataclass(frozen=True, slots=True)
class WrenchSample:
    """What a force/torque sensor behind a fingertip said.

    Attributes:
        time: When it was sampled [s].
        wrench: Load on the sensor's tip side as the device gives it, in the sensor frame [N, N m]: contact
            plus the weight and inertia of what is mounted on it.
        acceleration: Specific force at the sensor's origin in the sensor frame [m/s^2], as an accelerometer
            gives it: at rest it points up and has length g.
    """

    time: float
    wrench: Wrench
    acceleration: Vector


@dataclass(frozen=True, slots=True)
class Sample:
    """What the devices said in one period.

    Attributes:
        time: Time of the period on the back end's clock [s].
        arm: State of the arm.
        wrenches: One per finger.
    """

    time: float
    arm: ArmSample
    wrenches: tuple[WrenchSample, ...]


@dataclass(frozen=True, slots=True)
class FingerObservation:
    """What touch makes of one finger's wrench. Its sensor frame is the tip frame of `ArmSample`.

    Attributes:
        wrench: What the object exerts on the finger: the device's wrench with weight and inertia taken off.
        contact: The contact that explains it.
        touching: Whether the force says that there is a contact at all (threshold with hysteresis).
        health: What is wrong with the sensor, if anything.
    """

    wrench: Wrench
    contact: Contact
    touching: bool
    health: Verdict = HEALTHY


@dataclass(frozen=True, slots=True)
class Observation:
    """What is known at one period: all that a controller sees.

    Attributes:
        time: As in the sample [s].
        arm: State of the arm.
        fingers: One per wrench of the sample.
    """

    time: float
    arm: ArmSample
    fingers: tuple[FingerObservation, ...]


class Phase(StrEnum):
    """What a controller is doing: for reports, and to tell the periods of a scan; DONE and LOST end a run."""

    APPROACH = "approach"
    SETTLE = "settle"
    SCAN = "scan"
    SEEK = "seek"
    LIFT = "lift"
    HOLD = "hold"
    DONE = "done"
    LOST = "lost"

    @property
    def is_final(self) -> bool:
        """Whether the run ends here."""
        return self in (Phase.DONE, Phase.LOST)


@dataclass(frozen=True, slots=True)
class Command:
    """What the arm is to do during the next period.

    Attributes:
        velocity_base_tip: Velocity of the tip frame's origin in base coordinates [m/s].
        phase: What the controller is doing.
    """

    velocity_base_tip: Vector = ZERO
    phase: Phase = Phase.HOLD
