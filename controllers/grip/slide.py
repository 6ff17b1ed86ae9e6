"""Lets a held object slide down between the fingers by a wanted way, by its own weight.

The grip is lowered until the weight exceeds what friction bears, and then holds the speed
(`palpate.controllers.grip.slip_servo`). It does not turn only as long as its centre of mass hangs below the line
of the contacts: a contact that slides bears little torque, tau = e^2 f_t omega / v by normality, and what turn the
torque felt foretells is added up on the way. If that is too much the slide is given up.
"""

import math
from dataclasses import dataclass, field

from palpate.controllers.grip.belief import SurfaceBelief
from palpate.controllers.grip.let_slip import LetSlip, LetSlipParameters
from palpate.controllers.grip.motion_source import MotionSource
from palpate.controllers.grip.need import grip_against_sliding
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.slip_servo import SlipServoParameters
from palpate.errors import InvalidValueError, positive
from palpate.friction.contact_load import ContactLoad
from palpate.runtime.data import Command, Observation, Phase
from palpate.runtime.live import LiveParameters
from palpate.spatial import ZERO, norm

STANDARD_GRAVITY = 9.80665
"""[m/s^2] By definition (CGPM 1901)."""

SLIDE_SERVO = SlipServoParameters(speed=0.01, acceleration=0.05, authority=STANDARD_GRAVITY, bandwidth=25.0)

SLIDE_SMOOTHING = 0.015
"""[s] Of readings to 50 um every 2 ms: leaves 20 um and 0.6 mm/s; longer ones let it go on in jerks."""

LEAST_SHARE = 0.5
"""Of the grip that bears the weight: as little as that is gripped, and nothing falls faster than g / 2."""


@dataclass(frozen=True, slots=True)
class SlideParameters:
    """How an object is let slide.

    Attributes:
        way: Wanted way in the hand, as the source tells it [m].
        servo: How it is let slip, in m; what falls has the authority g.
        slip: What is common to all wanted slips.
        largest_turn: That the torque may foretell before the slide is given up [rad].
    """

    way: float
    servo: SlipServoParameters = SLIDE_SERVO
    slip: LetSlipParameters = field(default_factory=lambda: LetSlipParameters(smoothing=SLIDE_SMOOTHING))
    largest_turn: float = 0.2

    def __post_init__(self) -> None:
        if not math.isfinite(self.way):
            raise InvalidValueError(f"way = {self.way!r} m: must be finite")
        positive("largest_turn", self.largest_turn, "rad")


class SlideController:
    """Lets a held object slide; ends with DONE after the way, or LOST if it cannot; held in either case.

    Attributes:
        turn: What the torque foretells of it so far [rad].
    """

    def __init__(
        self,
        grip: SlipSafeGrip,
        belief: SurfaceBelief,
        source: MotionSource,
        period: float,
        parameters: SlideParameters,
    ) -> None:
        """Take the pieces.

        Args:
            grip: That holds the object, as it stands.
            belief: What the contacts bear.
            source: Tells the way, which grows as the object slides down.
            period: Of control [s].
            parameters: How.
        """
        self._belief, self._parameters, self._period = belief, parameters, period
        self._slips = LetSlip(grip, source, period, parameters.servo, parameters.slip)
        self.turn = 0.0

    @property
    def live(self) -> LiveParameters:
        """See `palpate.runtime.live.Tunable`."""
        return self._slips.grip.live

    @property
    def phase(self) -> Phase:
        """What it is doing: SETTLE, SCAN while it lets go, HOLD, then DONE or LOST."""
        return self._slips.phase

    @property
    def way(self) -> float:
        """Of the object, as tracked [m]."""
        return self._slips.tracker.value

    def start(self, first: Observation) -> None:
        """Take the first observation; the grip goes on as it is."""
        self._slips.start(first, self._parameters.way)
        self.turn = 0.0

    def step(self, now: Observation) -> Command:
        """Return what hand and arm are to do during the next period."""
        slips, before = self._slips, self._slips.phase
        loads = [ContactLoad.of(finger.contact) for finger in now.fingers]
        forces = slips.step(now, grip_against_sliding(loads, self._belief, LEAST_SHARE))
        if slips.phase is Phase.SCAN:
            if before is Phase.SETTLE and slips.direction < 0.0:
                slips.give_up(now.time)  # weight moves nothing up
            elif before is Phase.SCAN:
                self.turn += self._turn_per_way(loads) * slips.rate * self._period
                if abs(self.turn) > self._parameters.largest_turn:
                    slips.give_up(now.time)
        return Command(ZERO, slips.phase, forces)

    def _turn_per_way(self, loads: list[ContactLoad]) -> float:
        """Return omega / v by normality, about the first finger's normal [rad/m]; the mean of both fingers."""
        ratios = []
        for i, load in enumerate(loads):
            slip = self._belief.surface(i).slip_direction(load)
            speed = norm(slip.velocity)
            ratios.append(slip.spin / speed if speed > 0.0 else 0.0)
        return 0.5 * (ratios[0] - ratios[1])
