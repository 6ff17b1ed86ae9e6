"""What a contact in full slip bore, from which a limit surface is fitted."""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, check_not_negative, positive


@dataclass(frozen=True, slots=True)
class SlipLoad:
    """What a contact in full slip bore: mean of a motion there and back.

    Attributes:
        normal_force: [N].
        tangential_force: Its length, along the slip [N].
        spin_torque: Along the spin, so 0 or above but for noise [N m].
        speed: Of the slip along the surface, 0 or above [m/s].
        spin: Of the slip about the normal, 0 or above [rad/s].
        heading: Of the slip along the surface, from any fixed direction in it [rad].
    """

    normal_force: float
    tangential_force: float
    spin_torque: float
    speed: float
    spin: float
    heading: float = 0.0

    def __post_init__(self) -> None:
        positive("normal_force", self.normal_force, "N")
        check_not_negative(self, speed="m/s", spin="rad/s")
        if self.speed == self.spin == 0.0:
            raise InvalidValueError("speed = 0 m/s and spin = 0 rad/s: must slip, with one of them not 0")
        if not all(map(math.isfinite, (self.tangential_force, self.spin_torque, self.heading))):
            raise InvalidValueError(
                f"tangential_force = {self.tangential_force} N, spin_torque = {self.spin_torque} N m, heading = "
                f"{self.heading} rad: must be finite"
            )
