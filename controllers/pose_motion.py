"""Straight motion of the tip frame through free air to a pose, from rest to rest.

State: the distance e from the goal and the angle to its orientation. Both are integrals of what is commanded a
delay T ago: de/dt = -v(t - T), with v = g e up to the largest speed; so is the angle. Each is stable for
g T < pi/2; with g T = x the phase margin is pi/2 - x and the gain margin pi/(2 x), as of force control
(`palpate.controllers.gains`). It brakes with g v at most.
"""

import math
from dataclasses import dataclass

from palpate.controllers.gains import LOOP_GAIN
from palpate.controllers.orientation import ACCELERATION_IN_RATES
from palpate.controllers.paths.path_follower import NEAR_PLACE
from palpate.errors import check_positive, positive
from palpate.kinematics.pose import rotvec_from_rotation, times, transposed
from palpate.runtime.data import ArmSample
from palpate.spatial import ZERO, Matrix, Vector, limit_norm, norm, scale, subtract, toward

GREATEST_GAIN = 5.0
"""[1/s] As `STEERING`: a tenth of what a servo of 100 rad/s allows; 20 mm/s brake with 0.1 m/s^2."""

ALIGNED = 2e-3
"""An orientation as near as this counts as reached [rad]."""

PATIENCE, SPARE = 2.0, 3.0
"""A motion that takes longer than so many times its nominal duration and so many seconds more does not arrive."""


@dataclass(frozen=True, slots=True)
class PoseMotionLimits:
    """How fast it goes.

    Attributes:
        speed: [m/s].
        turning: [rad/s]; 0 for a robot that cannot turn its tip.
        acceleration: [m/s^2].
        gain: g [1/s].
    """

    speed: float
    turning: float
    acceleration: float
    gain: float

    def __post_init__(self) -> None:
        check_positive(self, speed="m/s", acceleration="m/s^2", gain="1/s")

    @classmethod
    def stable(cls, speed: float, turning: float, acceleration: float, delay: float) -> "PoseMotionLimits":
        """Return limits with a gain of g T = 0.5 at most, for a delay T [s]: phase margin 61 degrees."""
        return cls(speed, turning, acceleration, min(GREATEST_GAIN, LOOP_GAIN / positive("delay", delay, "s")))


class PoseMotion:
    """Goes to a pose.

    Attributes:
        arrived: Whether it is there.
        late: Whether it takes longer than it should: something is in the way.
    """

    def __init__(self, limits: PoseMotionLimits, period: float) -> None:
        """Take its limits and the control period [s]."""
        self._limits = limits
        self._most_change = limits.acceleration * positive("period", period, "s")
        self._most_turn = ACCELERATION_IN_RATES * limits.turning * period
        self._goal: tuple[Vector, Matrix] | None = None
        self._velocity = self._turn = ZERO
        self.arrived, self.late = True, False
        self._until = math.inf

    def begin(self, now: ArmSample, time: float, position: Vector, rotation: Matrix) -> None:
        """Set off from where the arm is, at a time [s], to a position [m] and orientation, base frame."""
        self._goal = (position, rotation)
        distance = norm(subtract(position, now.position_base_tip))
        angle = norm(_turn_to(now.rotation_base_tip, rotation)) if self._limits.turning > 0.0 else 0.0
        nominal = distance / self._limits.speed + (angle / self._limits.turning if angle > 0.0 else 0.0)
        self._until = time + PATIENCE * nominal + SPARE
        self.arrived = self.late = False
        self._velocity = self._turn = ZERO

    def step(self, now: ArmSample, time: float) -> tuple[Vector, Vector]:
        """Return velocity [m/s] and angular velocity [rad/s] for the next period, base frame."""
        if self._goal is None:
            return ZERO, ZERO
        (position, rotation), limits = self._goal, self._limits
        away = subtract(position, now.position_base_tip)
        turned = _turn_to(now.rotation_base_tip, rotation) if limits.turning > 0.0 else ZERO
        self.arrived = norm(away) <= NEAR_PLACE and norm(turned) <= ALIGNED
        self.late = not self.arrived and time > self._until
        if self.arrived:
            return ZERO, ZERO
        self._velocity = toward(
            self._velocity, limit_norm(scale(limits.gain, away), limits.speed), self._most_change
        )
        self._turn = toward(self._turn, limit_norm(scale(limits.gain, turned), limits.turning), self._most_turn)
        return self._velocity, self._turn


def _turn_to(before: Matrix, after: Matrix) -> Vector:
    """Axis times angle [rad] of the turn from one orientation to another, base frame."""
    return rotvec_from_rotation(times(after, transposed(before)))
