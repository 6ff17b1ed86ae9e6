"""Parameters of an exploration, and those that may be changed while it runs."""

from dataclasses import dataclass

from palpate.controllers.gains import ForceGain
from palpate.controllers.room import UNBOUNDED, Room
from palpate.errors import check_positive, positive
from palpate.runtime.live import LiveParameter, LiveParameters

ACCELERATION = 0.1
"""Default [m/s^2]. Friction turns with the motion, and with it the load on robot and contact: at
20 mm/s a corner then takes 0.2 s, slow enough for force control. On a UR5e (raster of 12 x 4 mm, 2 N, direct law)
corners at 0.5 m/s^2 cost a force error of 0.107 N RMS, at 0.1 m/s^2 half of that, 0.053 N."""

FORCE_RATE = 1.0 / 3.0
"""How far the set force moves in one delay of force control, in least forces. With dF/dt = k K (F_set - F)(t - T)
the force trails a ramp r by r T / (k K T); where the ramp ends it overshoots by about 0.2 r T at k K T = 0.6, the
largest live gain, and by 0.09 r T at the default 0.5: less than 5 % of where a ramp upwards can end."""


@dataclass(frozen=True, slots=True)
class ExploreParameters:
    """Parameters of an exploration.

    Attributes:
        force: Normal force to hold [N].
        speed: Along the surface [m/s].
        gain: Force gain with its margin.
        lead: How far ahead the normal is predicted [s]: the lag between a command and its effect.
        normal_smoothing: Time constant of the normal's filter [s].
        acceleration: Bound on tangential acceleration [m/s^2]; of a Circuit, also where it bends.
        landing_speed: Of approach and seek [m/s]. The landing peak grows with it: about 2 N at 5 mm/s and
            20 kN/m.
        approach_distance: How far down the surface is looked for at first [m].
        settle_time: From touching to sweeping [s].
        seek_distance: How far a lost surface is sought [m].
        lift_distance: How far the tip is lifted at the end [m].
        lift_speed: Of lifting [m/s].
        travel_speed: From place to place above the object [m/s]; between touches, lower than where the run began,
            the tip travels at landing speed. An obstacle is hit at these speeds.
        slew: Bound on the change of commanded velocity [m/s^2]. By default 10 mm/s in a millisecond: twice the
            landing speed, so that landing never waits for it, and far below what the supervisor stops at.
        force_range: Least and largest force that may be asked for while it runs [N]. By default from one and a
            half times the touch threshold of a `Finger` to three quarters of the supervisor's limit.
        speed_range: Likewise for the speed [m/s].
        room: Where the tip may be.
    """

    force: float
    speed: float
    gain: ForceGain
    lead: float
    normal_smoothing: float = 0.01
    acceleration: float = ACCELERATION
    landing_speed: float = 0.005
    approach_distance: float = 0.05
    settle_time: float = 0.3
    seek_distance: float = 0.005
    lift_distance: float = 0.005
    lift_speed: float = 0.02
    travel_speed: float = 0.02
    slew: float = 10.0
    force_range: tuple[float, float] = (0.3, 15.0)
    speed_range: tuple[float, float] = (0.001, 0.1)
    room: Room = UNBOUNDED

    def __post_init__(self) -> None:
        check_positive(self, **_UNITS)
        for name, unit in (("force_range", "N"), ("speed_range", "m/s")):
            for end in getattr(self, name):
                positive(name, end, unit)


_UNITS = {
    "force": "N",
    "speed": "m/s",
    "lead": "s",
    "normal_smoothing": "s",
    "acceleration": "m/s^2",
    "landing_speed": "m/s",
    "approach_distance": "m",
    "settle_time": "s",
    "seek_distance": "m",
    "lift_distance": "m",
    "lift_speed": "m/s",
    "travel_speed": "m/s",
    "slew": "m/s^2",
}


def live_parameters(parameters: ExploreParameters) -> LiveParameters:
    """Return what may be changed while an exploration runs. What was asked for at the start is always in bounds.

    `force` moves at `FORCE_RATE`; `speed` at the path's bound on acceleration, which the tip can keep to downwards
    too; `force_gain` within and at the rate that `ForceGain` states.
    """
    force, speed, gain = parameters.force, parameters.speed, parameters.gain
    (least, most), (slowest, fastest) = parameters.force_range, parameters.speed_range
    force_rate = FORCE_RATE * min(least, force) / gain.delay
    return LiveParameters(
        LiveParameter(
            "force", force, min(least, force), max(most, force), force_rate, "N", "normal force to hold"
        ),
        LiveParameter(
            "speed",
            speed,
            min(slowest, speed),
            max(fastest, speed),
            parameters.acceleration,
            "m/s",
            "speed along the surface",
        ),
        gain.live,
    )
