"""Lets a held object turn in the fingers to a wanted angle, by its own weight.

Its centre of mass lies beside the line of the contacts. The grip is lowered until weight and torque just exceed
what the contacts bear, and then holds the rate of the turn (`palpate.controllers.grip.slip_servo`). It never goes
below what the tangential force alone needs, with a margin: rather no turn than a drop. Before the angle it slows
down, then it grips as it held before.

By normality the object also slips: e^2 f_t / torque per radian. `palpate.controllers.grip.hand_motion.MoveAlong`
makes up for it.
"""

import math
from dataclasses import dataclass, field

from palpate.controllers.grip.belief import SurfaceBelief
from palpate.controllers.grip.hand_motion import HandMotion, StandStill
from palpate.controllers.grip.let_slip import LetSlip, LetSlipParameters
from palpate.controllers.grip.motion_source import MotionSource
from palpate.controllers.grip.need import grip_against_sliding
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.slip_servo import SlipServoParameters
from palpate.errors import InvalidValueError, not_negative
from palpate.friction.contact_load import ContactLoad
from palpate.runtime.data import Command, Observation, Phase
from palpate.runtime.live import LiveParameters
from palpate.spatial import ZERO

PIVOT_SERVO = SlipServoParameters(speed=0.5, acceleration=1.0, authority=200.0)
"""Authority: g / 2 r for a radius of gyration r of 25 mm, the most that any offset gives such an object."""


@dataclass(frozen=True, slots=True)
class PivotParameters:
    """How an object is pivoted.

    Attributes:
        angle: Wanted turn in the hand, as the source tells it: about the first finger's outward normal [rad].
        servo: How it is let slip, in rad.
        slip: What is common to all wanted slips.
        tangential_margin: Share of grip that stays beyond f_t / mu.
    """

    angle: float
    servo: SlipServoParameters = PIVOT_SERVO
    slip: LetSlipParameters = field(default_factory=LetSlipParameters)
    tangential_margin: float = 0.08

    def __post_init__(self) -> None:
        if not math.isfinite(self.angle):
            raise InvalidValueError(f"angle = {self.angle!r} rad: must be finite")
        not_negative("tangential_margin", self.tangential_margin, "")


class PivotController:
    """Turns a held object; ends with DONE at the angle, or LOST if it cannot get there; held in either case.

    It cannot where the weight turns the object the other way, or hangs below the contacts already.
    """

    def __init__(
        self,
        grip: SlipSafeGrip,
        belief: SurfaceBelief,
        source: MotionSource,
        period: float,
        parameters: PivotParameters,
        hand: HandMotion | None = None,
    ) -> None:
        """Take the pieces.

        Args:
            grip: That holds the object, as it stands.
            belief: What the contacts bear; of it, mu counts.
            source: Tells the angle.
            period: Of control [s].
            parameters: How.
            hand: What the hand does meanwhile; it stands still if not given.
        """
        self._hand, self._belief, self._parameters = hand or StandStill(), belief, parameters
        self._slips = LetSlip(grip, source, period, parameters.servo, parameters.slip)
        self._torque = 0.0

    @property
    def live(self) -> LiveParameters:
        """See `palpate.runtime.live.Tunable`."""
        return self._slips.grip.live

    @property
    def phase(self) -> Phase:
        """What it is doing: SETTLE, SCAN while it lets go, HOLD, then DONE or LOST."""
        return self._slips.phase

    @property
    def angle(self) -> float:
        """Of the object, as tracked [rad]."""
        return self._slips.tracker.value

    def start(self, first: Observation) -> None:
        """Take the first observation; the grip goes on as it is."""
        self._slips.start(first, self._parameters.angle)
        self._torque = 0.0

    def step(self, now: Observation) -> Command:
        """Return what hand and arm are to do during the next period."""
        slips, before = self._slips, self._slips.phase
        loads = [ContactLoad.of(finger.contact) for finger in now.fingers]
        forces = slips.step(
            now, grip_against_sliding(loads, self._belief, 1.0 + self._parameters.tangential_margin)
        )
        if before is Phase.SETTLE:
            # noise averages out; about the first finger's normal, which the second's is opposite to
            torque = loads[0].spin_torque - loads[1].spin_torque
            self._torque += torque if math.isfinite(torque) else 0.0
            if slips.phase is Phase.SCAN and not self._torque * slips.direction > 0.0:
                slips.give_up(now.time)
        moving = before is Phase.SCAN and slips.phase is Phase.SCAN
        return Command(self._hand.velocity(now, slips.rate) if moving else ZERO, slips.phase, forces)
