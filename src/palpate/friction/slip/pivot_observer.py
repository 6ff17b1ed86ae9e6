"""Angle and rate of an object that turns in the fingers.

The object hangs on the grip axis like a pendulum with friction:

    I theta'' = -m g l sin(theta) - tau,

theta the angle of its centre of mass from straight down, tau the sum of the torques that the object exerts on the
fingers about the grip axis. Measured is tau + b, b what drift and a weight not quite known put it off by. An
extended Kalman filter of theta, theta' and b integrates this. What holds the integral:

- while the contacts stick the rate is 0 and the torques balance: sin(theta) = -tau / (m g l). Towards the
  horizontal that says ever less, and it cannot tell an angle from its supplement: the filter stays on the side it
  is on;
- an angle sensor, if there is one.

Without an angle sensor the angle drifts while the object slips, and is put right as soon as it sticks.
"""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, not_negative, positive
from palpate.spatial import Matrix, Vector, dot, rotate

SETTLING = 0.02
"""[s] of sticking after which torque and weight balance: what stopped the object, and its ringing, is over."""


@dataclass(frozen=True, slots=True)
class PivotingObject:
    """What is known of the object.

    Attributes:
        weight_lever: m g l, weight times distance of the centre of mass from the grip axis [N m]; above 0.
        inertia: About the grip axis [kg m^2].
    """

    weight_lever: float
    inertia: float

    def __post_init__(self) -> None:
        positive("weight_lever", self.weight_lever, "N m")
        positive("inertia", self.inertia, "kg m^2")


@dataclass(frozen=True, slots=True)
class PivotNoise:
    """How far what is measured and assumed can be trusted, standard deviations.

    Attributes:
        torque: Of one sample of tau [N m].
        offset: Of b at the start [N m].
        wander: By which b changes in a second [N m].
        angle: Of one sample of the angle sensor [rad]; 0.2 degrees.
        standstill: Of the rate while the contacts stick [rad/s].
    """

    torque: float = 0.15e-3
    offset: float = 0.3e-3
    wander: float = 0.02e-3
    angle: float = math.radians(0.2)
    standstill: float = 1e-3

    def __post_init__(self) -> None:
        positive("torque", self.torque, "N m")
        not_negative("offset", self.offset, "N m")
        not_negative("wander", self.wander, "N m")
        positive("angle", self.angle, "rad")
        positive("standstill", self.standstill, "rad/s")


@dataclass(frozen=True, slots=True)
class Pivot:
    """An estimate.

    Attributes:
        angle: From straight down [rad].
        rate: [rad/s].
        angle_deviation: Its standard deviation [rad].
        rate_deviation: [rad/s].
    """

    angle: float
    rate: float
    angle_deviation: float
    rate_deviation: float


class PivotObserver:
    """Follows a pivoting object. One call of `step` per period."""

    def __init__(
        self,
        target: PivotingObject,
        period: float,
        angle: float,
        angle_deviation: float,
        noise: PivotNoise | None = None,
    ) -> None:
        """Begin at rest.

        Args:
            target: What pivots.
            period: Between two samples [s].
            angle: At the start, from straight down [rad].
            angle_deviation: Its standard deviation [rad].
            noise: Of what is measured.

        Raises:
            InvalidValueError: One of them cannot be.
        """
        if not math.isfinite(angle):
            raise InvalidValueError(f"angle = {angle!r} rad: must be finite")
        self._target, self._noise = target, noise or PivotNoise()
        self._period = positive("period", period, "s")
        self._state = [angle, 0.0, 0.0]
        self._resting = math.inf  # it was at rest before
        deviation = not_negative("angle_deviation", angle_deviation, "rad")
        self._cov: Matrix = (
            (deviation**2, 0.0, 0.0),
            (0.0, self._noise.standstill**2, 0.0),
            (0.0, 0.0, self._noise.offset**2),
        )

    def step(self, spin_torque: float, sticks: bool, measured_angle: float | None = None) -> Pivot:
        """Take one sample.

        Args:
            spin_torque: tau as measured, the sum over the fingers about one and the same axis [N m]; NaN if
                unknown: then it is taken as balanced.
            sticks: Whether the contacts are known to stick: their load well inside the limit surface, no slip
            told.
            measured_angle: From straight down [rad], if there is a sensor.

        Returns:
            The estimate, this sample included.
        """
        known = math.isfinite(spin_torque)
        self._predict(spin_torque if known else None)
        state, lever = self._state, self._target.weight_lever
        self._resting = self._resting + self._period if sticks else 0.0
        if sticks:
            self._correct((0.0, 1.0, 0.0), -state[1], self._noise.standstill**2)
            if known and self._resting >= SETTLING:
                expected = state[2] - lever * math.sin(state[0])
                slopes = (-lever * math.cos(state[0]), 0.0, 1.0)
                self._correct(slopes, spin_torque - expected, self._noise.torque**2)
        if measured_angle is not None and math.isfinite(measured_angle):
            self._correct((1.0, 0.0, 0.0), measured_angle - state[0], self._noise.angle**2)
        return Pivot(state[0], state[1], math.sqrt(self._cov[0][0]), math.sqrt(self._cov[1][1]))

    def _predict(self, torque: float | None) -> None:
        T, own, state, cov = self._period, self._target, self._state, self._cov
        stiffness = own.weight_lever * math.cos(state[0]) / own.inertia
        gravity, by_offset = own.weight_lever * math.sin(state[0]), 1.0 / own.inertia
        if torque is None:
            acceleration, stiffness, by_offset = 0.0, 0.0, 0.0
        else:
            acceleration = -(gravity + torque - state[2]) / own.inertia
        # semi-implicit Euler: a pendulum that keeps its energy
        state[1] += T * acceleration
        state[0] += T * state[1]
        # `rotate` is but a matrix times a vector
        rate = (-T * stiffness, 1.0, T * by_offset)
        angle = (1.0 - T * T * stiffness, T, T * T * by_offset)
        # covariance: F P F', F's rows are `angle`, `rate` and (0, 0, 1)
        to_angle, to_rate = rotate(cov, angle), rotate(cov, rate)
        noise = (T * self._noise.torque / own.inertia) ** 2
        aa = dot(to_angle, angle) + T * T * noise
        ar = dot(to_angle, rate) + T * noise
        rr = dot(to_rate, rate) + noise
        bb = cov[2][2] + T * self._noise.wander**2
        self._cov = ((aa, ar, to_angle[2]), (ar, rr, to_rate[2]), (to_angle[2], to_rate[2], bb))

    def _correct(self, slopes: Vector, off: float, variance: float) -> None:
        """Take in one number: its slopes by the state, by how much it is more than expected, its variance."""
        state = self._state
        (aa, ar, ab), (_, rr, rb), (_, _, bb) = self._cov
        x, y, z = rotate(self._cov, slopes)
        total = slopes[0] * x + slopes[1] * y + slopes[2] * z + variance
        u, v, w = x / total, y / total, z / total
        state[0] += u * off
        state[1] += v * off
        state[2] += w * off
        ar, ab, rb = ar - u * y, ab - u * z, rb - v * z
        aa, rr, bb = max(aa - u * x, 0.0), max(rr - v * y, 0.0), max(bb - w * z, 0.0)
        self._cov = ((aa, ar, ab), (ar, rr, rb), (ab, rb, bb))
