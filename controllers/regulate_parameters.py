"""Parameters of force regulation, and those that may be changed while it runs."""

from dataclasses import dataclass

from palpate.controllers.gains import ForceGain
from palpate.controllers.surface_motion import FASTEST_SURFACE
from palpate.errors import InvalidValueError, check_not_negative, check_positive, positive, vector
from palpate.runtime.live import LiveParameter, LiveParameters
from palpate.spatial import Vector, norm, scale

FORCE_RATE = 2.0
"""How fast the live force moves [N/s]: its rate is known, and is fed forward as a ramp's."""

WEAKEST_LIVE, STRONGEST_LIVE = 0.1, 1.2
"""Shares of the force gain that a live change may go to: as `ForceGain.live_range`, in which the default loop gain
of 0.5 may go down to 0.05 and up to 0.6."""


@dataclass(frozen=True, slots=True)
class RegulateParameters:
    """Parameters of force regulation.

    Attributes:
        gain: Force gain with its margin.
        lead: How far ahead the normal is predicted [s]: the lag between a command and its effect.
        duration: How long the profile is held [s].
        force: That the profile is about [N]: the live parameter `force` moves the whole profile from there.
        force_range: Smallest and largest that it may be moved to [N].
        axis: Along which force is regulated and the surface approached, into the object, base frame; None: down
            onto it, then along the contact's normal.
        damping_time: c / K of the contact [s], by which its force leads its depth; 0 if nobody knows.
        step_time: Time constant with which a force that jumps is gone over to [s]; 0: as fast as the loop.
        landing_speed: Of approach and seek [m/s].
        approach_distance: How far the surface is looked for at first [m].
        settle_time: From touching to the profile's beginning [s].
        seek_distance: How far a lost surface is sought [m].
        lift_distance: How far the tip is lifted at the end [m].
        lift_speed: Of lifting [m/s].
        retreat_speed: Largest speed away from the surface when the force is too large [m/s].
        fastest_push: Largest speed into the surface once it has settled, and of lifting [m/s].
        tangential_acceleration: Bound on the change of what moves it along the surface [m/s^2].
        normal_smoothing: Time constant of the normal's filter [s].
        slew: Bound on the change of commanded velocity [m/s^2].
    """

    gain: ForceGain
    lead: float
    duration: float
    force: float
    force_range: tuple[float, float]
    axis: Vector | None = None
    damping_time: float = 0.0
    step_time: float = 0.0
    landing_speed: float = 0.004
    approach_distance: float = 0.05
    settle_time: float = 0.5
    seek_distance: float = 0.005
    lift_distance: float = 0.005
    lift_speed: float = 0.02
    retreat_speed: float = FASTEST_SURFACE
    fastest_push: float = FASTEST_SURFACE
    tangential_acceleration: float = 0.5
    normal_smoothing: float = 0.01
    slew: float = 10.0

    def __post_init__(self) -> None:
        check_positive(self, **_UNITS)
        check_not_negative(self, damping_time="s", step_time="s")
        least, most = self.force_range
        if not least <= self.force <= most:
            raise InvalidValueError(
                f"force = {self.force:g} N: must lie in its range, {least:g} to {most:g} N (force_range)"
            )
        if self.axis is not None:
            vector("axis", self.axis, 3, "")
            length = positive("length of axis", norm(self.axis), "")
            object.__setattr__(self, "axis", scale(1.0 / length, self.axis))


_UNITS = {
    "lead": "s",
    "duration": "s",
    "force": "N",
    "landing_speed": "m/s",
    "approach_distance": "m",
    "settle_time": "s",
    "seek_distance": "m",
    "lift_distance": "m",
    "lift_speed": "m/s",
    "retreat_speed": "m/s",
    "fastest_push": "m/s",
    "tangential_acceleration": "m/s^2",
    "normal_smoothing": "s",
    "slew": "m/s^2",
}


def live_regulation(parameters: RegulateParameters) -> LiveParameters:
    """Return what may be changed while a force is regulated: `force` and `force_gain`."""
    gain, (least, most) = parameters.gain.gain, parameters.force_range
    return LiveParameters(
        LiveParameter(
            "force", parameters.force, least, most, FORCE_RATE, "N", "force to hold; a profile moves with it"
        ),
        LiveParameter(
            "force_gain",
            gain,
            WEAKEST_LIVE * gain,
            STRONGEST_LIVE * gain,
            gain,  # as far as it is in a second: so that the push does not jump
            "m/s/N",
            "normal velocity per force error",
        ),
    )
