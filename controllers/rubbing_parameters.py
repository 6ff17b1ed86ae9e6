"""Parameters of rubbing, and those that may be changed while it runs."""

from dataclasses import dataclass

from palpate.controllers.gains import ForceGain
from palpate.errors import check_positive
from palpate.runtime.live import LiveParameters
from palpate.spatial import Vector


@dataclass(frozen=True, slots=True)
class RubbingParameters:
    """Parameters of rubbing.

    Attributes:
        gain: Force gain with its margin.
        lead: How far ahead the normal is predicted [s]: the lag between a command and its effect.
        along: Direction of the first strokes, base frame; its component along the surface counts.
        tare_time: How long the sensor's zero is felt in free air, before and after [s].
        landing_speed: Of approach and seek [m/s].
        approach_distance: How far the surface is looked for at first [m].
        settle_time: At a new load, from when it is reached to the first motion [s]; the same after landing.
        pause: Pause before each motion [s].
        force_rate: How fast the set force goes from load to load [N/s].
        seek_distance: How far a lost surface is sought [m].
        lift_distance: How far the tip is lifted at the end [m].
        lift_speed: Of lifting [m/s].
        normal_smoothing: Time constant of the normal's filter [s].
        lever_smoothing: Of the filter of where on the tip it touches [s]: that noise moves what is turned about.
        slew: Bound on the change of commanded velocity [m/s^2].
    """

    gain: ForceGain
    lead: float
    along: Vector = (1.0, 0.0, 0.0)
    tare_time: float = 1.0
    landing_speed: float = 0.005
    approach_distance: float = 0.03
    settle_time: float = 0.5
    pause: float = 0.05
    force_rate: float = 2.0
    seek_distance: float = 0.005
    lift_distance: float = 0.005
    lift_speed: float = 0.02
    normal_smoothing: float = 0.02
    lever_smoothing: float = 0.05
    slew: float = 10.0

    def __post_init__(self) -> None:
        check_positive(self, **_UNITS)


_UNITS = {
    "lead": "s",
    "tare_time": "s",
    "landing_speed": "m/s",
    "approach_distance": "m",
    "settle_time": "s",
    "pause": "s",
    "force_rate": "N/s",
    "seek_distance": "m",
    "lift_distance": "m",
    "lift_speed": "m/s",
    "normal_smoothing": "s",
    "lever_smoothing": "s",
    "slew": "m/s^2",
}


def live_rubbing(parameters: RubbingParameters) -> LiveParameters:
    """Return what may be changed while it rubs: `force_gain`. Loads are the program's, for metrics go by them."""
    return LiveParameters(parameters.gain.live)
