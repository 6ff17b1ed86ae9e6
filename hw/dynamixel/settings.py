"""Settings of a Dynamixel hand: servos, finger geometry and time limits."""

import math
from dataclasses import dataclass
from typing import Protocol

from palpate.errors import InvalidValueError, check_positive, not_negative
from palpate.hw.dynamixel.packets import LARGEST_ID
from palpate.hw.dynamixel.registers import WATCHDOG_UNIT
from palpate.kinematics.servo_model import ServoModel

LENGTHS = 8
"""How many lengths of reads take turns when replies fail, so that a late reply is recognised by its length; one
that is late by as many exchanges is not. The XL330 has 20 indirect addresses, 13 of which hold the state."""


class FingerGeometry(Protocol):
    """How a finger moves with its servo, in a plane through the hand's axis. Its coordinate grows as it closes.

    Where the sensors are at a coordinate, a hand's `HandKinematics` says.
    """

    @property
    def ratio(self) -> float:
        """Of the joint's motion to that of the servo's shaft [m/rad, or 1]."""
        ...

    def lever(self, q: float, tip_along: float) -> float:
        """Return the servo's torque per normal force [m] where the force is square to the hand's axis.

        Args:
            q: The joint's coordinate [rad or m].
            tip_along: How far the tip's centre lies before the sensor along the finger [m].
        """
        ...

    def closed(self, distance: float, tip_along: float) -> float:
        """Return the coordinate at which the tip's centre is this far [m] further in than at 0."""
        ...


@dataclass(frozen=True, slots=True)
class ServoCalibration:
    """One finger's servo.

    Attributes:
        servo_id: On the bus.
        zero: Where its shaft stands [rad] when the finger's joint is at 0, as `DynamixelHand.state` reports.
        direction: 1 if its position grows as the finger closes, -1 if it shrinks.
        model: Name that its model must have in it; None: any.
        motor: Its figures, if they are known better than its maker's, as friction that was measured.
    """

    servo_id: int
    zero: float = 0.0
    direction: int = 1
    model: str | None = None
    motor: ServoModel | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.servo_id <= LARGEST_ID:
            raise InvalidValueError(f"servo_id = {self.servo_id}: must be from 0 to {LARGEST_ID}")
        if not math.isfinite(self.zero):
            raise InvalidValueError(f"zero = {self.zero} rad of servo {self.servo_id}: must be finite")
        if self.direction not in (-1, 1):
            raise InvalidValueError(f"direction = {self.direction} of servo {self.servo_id}: must be 1 or -1")


@dataclass(frozen=True, slots=True)
class HandSettings:
    """A hand of alike fingers on one bus.

    Attributes:
        servos: One per finger, in the order of the fingers.
        finger: How each of them moves.
        opening: From the hand's axis to the tips' centres with all joints at 0 [m].
        tip_along: From the sensor to the tip's centre, along the finger [m].
        closing_speed: With which tips move while nothing obstructs them [m/s].
        baud_rate: That all servos are set to [1/s].
        watchdog: Servos stop when the bus has been silent for so long [s], in steps of 20 ms; 0: they never do.
        reply_timeout: How long a reply may take to begin [s]. Adapters keep bytes back for 1 ms, the operating
            system for longer now and then.
        silence: For how long exchanges may fail, one after the other, before the hand is given up [s]. Beyond
            `LENGTHS` times `reply_timeout` a reply that is late by as much is taken for a new one.
        direction_span: Share of a force over which currents change sides of the gears' friction when it sinks
            (`GearDirection`): 0.02 for three fingers and more that share a load.
    """

    servos: tuple[ServoCalibration, ...]
    finger: FingerGeometry
    opening: float
    tip_along: float
    closing_speed: float = 0.005
    baud_rate: int = 1_000_000
    watchdog: float = 0.1
    reply_timeout: float = 0.006
    silence: float = 0.03
    direction_span: float = 0.0

    def __post_init__(self) -> None:
        ids = [its.servo_id for its in self.servos]
        if not ids or len(set(ids)) != len(ids):
            raise InvalidValueError(f"servo ids {ids}: must be one or more, each with an id of its own")
        check_positive(self, opening="m", closing_speed="m/s", baud_rate="1/s", reply_timeout="s", silence="s")
        not_negative("direction_span", self.direction_span, "")
        if self.watchdog and not self.silence < self.watchdog <= 127 * WATCHDOG_UNIT:
            raise InvalidValueError(
                f"watchdog = {self.watchdog:g} s: must be above silence = {self.silence:g} s, or servos stop as "
                f"others are still waited for, and at most {127 * WATCHDOG_UNIT:g} s; 0 for none"
            )

    @property
    def closed(self) -> float:
        """Coordinate of the joints that no finger reaches with an object between them [rad or m]."""
        return self.finger.closed(self.opening, self.tip_along)
