"""Parameters of a slip-safe grip, and those that may be changed while it runs."""

from dataclasses import dataclass

from palpate.errors import InvalidValueError, check_not_negative, check_positive
from palpate.runtime.live import LiveParameter, LiveParameters

MAX_MARGIN = 3.0
"""Largest live margin: four times the force that is needed."""


@dataclass(frozen=True, slots=True)
class GripParameters:
    """Parameters of a slip-safe grip.

    Attributes:
        margin: Share of grip beyond what the limit surface needs: for what mu, e and the sensors are wrong by.
        reserve: Grip beyond that [N]: for noise.
        lead: How far ahead the load is looked [s]: the lag between a command and the grip.
        smoothing: Time constant with which the load is tracked [s].
        grip_rate: How fast the grip may be raised [N/s]. No loop gain: what is wanted does not depend on the grip
            while contacts stick. What slips bears what the grip lets it, so that a faster one feels, and asks for,
            more: a step of 2.5 N in 5 ms that nobody announces slides 1.0 mm with 300 N/s (worst of 16: 1.3) and
            0.7 mm with 450 (0.9), at peaks of 14 and 18 N. Beyond 500 the simulated hand's servos gain nothing.
        release_time: Time constant with which it is let down [s],
        release_rate: and how fast at most [N/s].
        least_grip: [N] Below that the wanted grip is never let down. The command may be, where the fingers feel
            more than is wanted: by `correction_down`, and never to less than half of it.
        largest_grip: [N] Above that it is never raised.
        correction_time: Time constant with which the command is corrected by what the fingers feel [s].
        correction_share: Bound on that correction upwards, as a share of the grip,
        correction_down: and downwards. What gears hold by friction besides what is commanded does no harm; to
            work against it ends in stick-slip, which shakes an object out of fingers that share it unevenly.
        play: [N] By how much what is wanted must have fallen before the command follows: gears that change their
            direction with every bit of noise shake the object.
        regrip: Share by which the grip is raised when a slip begins.
        regrip_time: For how long it then stays there [s].
        fault_raise: Share by which the grip is raised while a finger feels nothing, or nothing to be believed.
    """

    margin: float = 0.12
    reserve: float = 0.05
    lead: float = 0.015
    smoothing: float = 0.004
    grip_rate: float = 450.0
    release_time: float = 0.1
    release_rate: float = 10.0
    least_grip: float = 0.5
    largest_grip: float = 20.0
    correction_time: float = 0.1
    correction_share: float = 0.3
    correction_down: float = 0.3
    play: float = 0.0
    regrip: float = 0.3
    regrip_time: float = 0.5
    fault_raise: float = 0.3

    def __post_init__(self) -> None:
        check_not_negative(
            self,
            margin="",
            correction_share="",
            correction_down="",
            regrip="",
            fault_raise="",
            reserve="N",
            play="N",
            lead="s",
            regrip_time="s",
        )
        check_positive(
            self,
            smoothing="s",
            grip_rate="N/s",
            release_time="s",
            release_rate="N/s",
            least_grip="N",
            largest_grip="N",
            correction_time="s",
        )
        if not self.least_grip < self.largest_grip:
            raise InvalidValueError(
                f"least_grip = {self.least_grip:g} N: must be below largest_grip = {self.largest_grip:g} N"
            )
        if self.margin > MAX_MARGIN:
            raise InvalidValueError(f"margin = {self.margin:g}: must be at most {MAX_MARGIN:g}")


def live_grip(parameters: GripParameters) -> LiveParameters:
    """Return what may be changed while a grip is kept: `margin` and `least_grip`."""
    p = parameters
    return LiveParameters(
        LiveParameter("margin", p.margin, 0.0, MAX_MARGIN, 1.0, "", "share of grip beyond what is needed"),
        LiveParameter(
            "least_grip", p.least_grip, min(0.1, p.least_grip), p.largest_grip, 5.0, "N", "grip wanted at least"
        ),
    )
