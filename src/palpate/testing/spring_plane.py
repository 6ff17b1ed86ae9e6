"""A minimal back end with a contact: a ball that moves as commanded over a plane that yields like a spring."""

import math

from palpate.errors import InvalidValueError
from palpate.runtime.closing import Closing
from palpate.runtime.data import ArmSample, Command, Sample, WrenchSample
from palpate.runtime.pacing import Pacer, SimulatedTime
from palpate.sensing.ft.poses import STANDARD_GRAVITY
from palpate.spatial import IDENTITY, ZERO, Vector, add_scaled, norm

RADIUS, START_HEIGHT, STIFFNESS, FRICTION = 0.008, 5e-4, 5e3, 0.3
"""Radius of the ball [m], its height above the plane at the start [m]; stiffness [N/m], friction of the plane."""


class SpringPlane(Closing):
    """A `Backend` without weight or lag. The plane is z = 0; the tip frame's origin is the centre of the ball."""

    def __init__(self, period: float = 1e-3) -> None:
        """Take the control period [s]."""
        self.period = period
        self.pacer: Pacer = SimulatedTime()
        self._count, self._position, self._velocity = 0, (0.0, 0.0, RADIUS + START_HEIGHT), ZERO

    def start(self) -> Sample:
        """See `Backend`."""
        self._count, self._position, self._velocity = 0, (0.0, 0.0, RADIUS + START_HEIGHT), ZERO
        return self._sample()

    def step(self, command: Command) -> Sample:
        """See `Backend`.

        Raises:
            InvalidValueError: If an angular velocity is commanded, or the velocity is not three finite numbers.
        """
        velocity = command.velocity_base_tip
        if len(velocity) != 3 or not all(map(math.isfinite, velocity)):
            raise InvalidValueError(f"velocity_base_tip = {velocity}: must be three finite numbers [m/s]")
        if command.angular_velocity_base_tip != ZERO:
            raise InvalidValueError(f"angular_velocity_base_tip = {command.angular_velocity_base_tip}: must be 0")
        self._count += 1
        self._velocity = velocity
        self._position = add_scaled(self._position, self.period, velocity)
        return self._sample()

    def close(self) -> None:
        """See `Backend`."""
        self._velocity = ZERO

    def _sample(self) -> Sample:
        time, depth = self._count * self.period, RADIUS - self._position[2]
        press = max(0.0, STIFFNESS * depth)
        x, y, _ = self._velocity
        speed = norm((x, y, 0.0))
        rub = FRICTION * press / speed if speed > 0.0 else 0.0
        force: Vector = (-rub * x, -rub * y, press)
        lever = min(0.0, -RADIUS + max(0.0, depth))  # height of the contact relative to the centre
        wrench = (*force, -lever * force[1], lever * force[0], 0.0)
        arm = ArmSample(time, self._position, IDENTITY, self._velocity)
        return Sample(time, arm, (WrenchSample(time, wrench, (0.0, 0.0, STANDARD_GRAVITY)),))
