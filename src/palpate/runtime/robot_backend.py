"""Back ends in robot files: what `backend` may be.

Plain data. What a kind of robot is made of, `palpate.sim` and `palpate.hw` know; experiments bring the two together.
A new kind is one more entry here and one more builder there.
"""

import msgspec

from palpate.errors import positive
from palpate.runtime.robot_surface import at_most

LARGEST_MASS = 1000.0
"""[kg] of a stage: more is a number in grams."""

LARGEST_BANDWIDTH = 1e4
"""[rad/s] of a servo: beyond any that moves a mass."""

LARGEST_LEASH = 0.1
"""[m]: more is a number in millimetres."""

LARGEST_TIME_STEP = 0.01
"""[s] of a simulation: more is a number in milliseconds."""


class StageEntry(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="stage"
):
    """The simulated three-axis stage: see `palpate.sim.stage.Stage`.

    Attributes:
        mass: Moving mass without the tip [kg].
        bandwidth: Natural frequency of its servos [rad/s].
        leash: Largest distance of the servos' reference from the actual position [m].
        time_step: Of the simulation [s]; the control period is a whole number of them.
    """

    mass: float = msgspec.field(name="mass_kg")
    bandwidth: float = msgspec.field(name="bandwidth_rad_per_s")
    leash: float = msgspec.field(name="leash_m")
    time_step: float = msgspec.field(name="time_step_s")

    def __post_init__(self) -> None:
        for key, value, unit, largest in (
            ("mass_kg", self.mass, "kg", LARGEST_MASS),
            ("bandwidth_rad_per_s", self.bandwidth, "rad/s", LARGEST_BANDWIDTH),
            ("leash_m", self.leash, "m", LARGEST_LEASH),
            ("time_step_s", self.time_step, "s", LARGEST_TIME_STEP),
        ):
            positive(key, value, unit)
            at_most(key, value, largest, unit)


BackendEntry = StageEntry
"""Every kind of back end; a union, told apart by `kind`, once there are more."""
