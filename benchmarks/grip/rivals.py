"""Grips that others use, through the seam of ours: each takes the place of `SlipSafeGrip` in a lift.

They know what ours knows, the believed limit surface and what every finger feels, and command the same servos.
What they do not have is left out on purpose: no look ahead, no hearing, no bound of friction.
"""

import math

from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.runtime.data import Observation

CONSTANT_MARGIN = 0.5
"""Of a constant grip."""

RATIO_MARGIN, DAMPING = 0.12, 0.01
"""Of the ratio that is aimed at, as ours; and [s] by which its rate counts: two thirds of the actuator's lag."""

SLIP_GAIN = 1.08
"""By which a grip is raised for each slip (Romano et al. 2011)."""

LOW, HIGH = 20.0, 100.0
"""[Hz] Of the band in which a slip shakes the tangential force: above what is carried, below a sample's noise."""

SHAKEN = 0.04
"""Share of the grip beyond which that is a slip, and three standard deviations of 10 mN on 1 N."""

ONCE = 0.05
"""[s] From one raise to the next: until the last is felt."""


class _Rival(SlipSafeGrip):
    """What all of them share: they raise and let down a grip as fast as ours."""

    def start(self, grip: float) -> None:
        """See `SlipSafeGrip`."""
        super().start(grip)
        self._kept = self.targets

    def pressing(self, force: float, at_least: float) -> tuple[float, ...]:
        """Return what each finger is to press with next [N], on the way to a grip."""
        least = max(force, at_least, self.live.value("least_grip"))
        self.targets = self._kept = self._towards((least,) * self._fingers, self._kept)
        return self.targets


class ConstantGrip(_Rival):
    """The most that the load has needed so far, by what is believed, and half as much again; never let down."""

    def start(self, grip: float) -> None:
        """See `SlipSafeGrip`."""
        super().start(grip)
        self._most = 0.0

    def step(self, now: Observation, at_least: float = 0.0, *, hanging: bool = True) -> tuple[float, ...]:
        """See `SlipSafeGrip`."""
        super().step(now, at_least, hanging=hanging)
        self._most = max(self._most, (1.0 + CONSTANT_MARGIN) * self.needed)
        return self.pressing(self._most, at_least)


class RatioGrip(_Rival):
    """Follows a ratio of load to grip below that of slip, as people do (Westling & Johansson 1984), by PD control.

    The load is |f_t| alone: a ratio knows no spin.
    """

    def start(self, grip: float) -> None:
        """See `SlipSafeGrip`."""
        super().start(grip)
        self._level = grip

    def step(self, now: Observation, at_least: float = 0.0, *, hanging: bool = True) -> tuple[float, ...]:
        """See `SlipSafeGrip`."""
        super().step(now, at_least, hanging=hanging)
        wanted = max(
            (1.0 + RATIO_MARGIN)
            * math.hypot(*finger.contact.tangential_force.tolist())
            / self.belief.surface(i).friction
            for i, finger in enumerate(now.fingers)
        )
        wanted = self._level if math.isnan(wanted) else wanted
        share = self._period / self.parameters.smoothing
        before = self._level
        self._level += share * (wanted - self._level)
        rate = (self._level - before) / self._period
        return self.pressing(self._level + DAMPING * rate, at_least)


class SlipTriggeredGrip(_Rival):
    """Holds with what is believed to be least, and raises it by 8 % for every slip that is felt as a shaking.

    After Romano, Hsiao, Niemeyer, Chitta, Kuchenbecker: Human-inspired robotic grasp control with tactile sensing,
    IEEE Transactions on Robotics 27(6), 2011: force disturbances in a band tell slip, and the grip target is
    multiplied by 1.08. Their accelerometer in the palm is not here; the band is that of these sensors.
    """

    def start(self, grip: float) -> None:
        """See `SlipSafeGrip`."""
        super().start(grip)
        self._gain, self._raised = 1.0, -math.inf
        self._fast: list[float] = []
        self._slow: list[float] = []

    def step(self, now: Observation, at_least: float = 0.0, *, hanging: bool = True) -> tuple[float, ...]:
        """See `SlipSafeGrip`."""
        super().step(now, at_least, hanging=hanging)
        loads = [math.hypot(*finger.contact.tangential_force.tolist()) for finger in now.fingers]
        shares = [-math.expm1(-2.0 * math.pi * frequency * self._period) for frequency in (HIGH, LOW)]
        fast, slow = self._fast or loads, self._slow or loads
        self._fast = [a + shares[0] * (b - a) for a, b in zip(fast, loads, strict=True)]
        self._slow = [a + shares[1] * (b - a) for a, b in zip(slow, loads, strict=True)]
        shaken = any(
            abs(a - b) > SHAKEN * finger.contact.normal_force
            for a, b, finger in zip(self._fast, self._slow, now.fingers, strict=True)
        )
        if shaken and hanging and now.time > self._raised + ONCE:
            self._gain, self._raised = SLIP_GAIN * self._gain, now.time
        return self.pressing(self._gain * self.needed, at_least)
