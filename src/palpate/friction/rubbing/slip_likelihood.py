"""How likely loads in full slip are of a limit surface: the law, the scatter about it, and its tails.

Both components of a load have a standard deviation of `scatter` times themselves (real surfaces differ from stroke
to stroke by some per cent), of `spread` times the largest friction force (what is wrong with a slip, and not with
the size of its load), the sensor's own, and what an error of the place turned about does to the slip.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.friction.rubbing.slip_load import SlipLoad

TAIL = 3.0
"""Degrees of freedom of Student's distribution where tails are heavy: outliers of any size carry no weight."""


@dataclass(frozen=True, slots=True)
class LoadErrors:
    """Standard deviations of loads.

    Attributes:
        force: The sensor's, of a mean force [N].
        torque: Likewise, of a torque [N m].
        place: How far beside the contact the finger may turn [m].
    """

    force: float
    torque: float
    place: float


@dataclass(frozen=True, slots=True, eq=False)
class SlipLoads:
    """Loads as a structure of arrays, shape (n,); `measured` (2, n).

    Theta is (ln mu, ln e at the middle force, gamma, p, a, b), mu along the slip being
    mu sqrt(1 + a cos 2h + b sin 2h) at a heading h: an ellipse of two sliding axes.
    """

    normal_force: FloatArray
    measured: FloatArray
    speed: FloatArray
    spin: FloatArray
    heading: FloatArray
    middle_force: float

    @classmethod
    def of(cls, loads: Sequence[SlipLoad]) -> "SlipLoads":
        """Return them as arrays.

        Raises:
            InvalidValueError: Too few, or all of one kind.
        """
        if len(loads) < 4:
            raise InvalidValueError(f"{len(loads)} loads: must be at least 4, of sliding, spinning and both")
        rows = [(one.normal_force, one.tangential_force, one.spin_torque, one.speed, one.spin) for one in loads]
        columns = np.array(rows).T
        if not (columns[3].any() and columns[4].any()):
            raise InvalidValueError("all loads are of one kind of slip: must be of sliding and of spinning")
        middle = float(np.exp(np.log(columns[0]).mean()))
        heading = np.array([one.heading for one in loads])
        return cls(columns[0], columns[1:3].copy(), columns[3], columns[4], heading, middle)

    def predicted(self, theta: FloatArray, speed: FloatArray | None = None) -> npt.NDArray[np.float64]:
        """Return tangential force and torque, shape (2, n)."""
        gamma, p = float(theta[2]), float(theta[3])
        e = np.exp(theta[1]) * (self.normal_force / self.middle_force) ** gamma
        along = np.sqrt(1.0 + theta[4] * np.cos(2.0 * self.heading) + theta[5] * np.sin(2.0 * self.heading))
        a, b = along * (self.speed if speed is None else speed), e * self.spin
        largest = np.maximum(a, b)
        power = 1.0 / (p - 1.0)
        x, y = (a / largest) ** power, (b / largest) ** power
        length = (x**p + y**p) ** (1.0 / p)
        most = np.exp(theta[0]) * self.normal_force
        return np.stack([most * along * x / length, most * e * y / length])

    def whitening(self, theta: FloatArray, scatter: float, spread: float, errors: LoadErrors) -> FloatArray:
        """Return the inverse Cholesky factors of the loads' covariances, shape (3, n): 1, 1; 2, 2; and -(2, 1).

        Scatter and sensor change force and torque each by itself, an error of the slip both together.
        """
        loads = self.predicted(theta)
        e = np.exp(theta[1]) * (self.normal_force / self.middle_force) ** float(theta[2])
        aside = spread * np.exp(theta[0]) * self.normal_force
        a = (scatter * loads[0]) ** 2 + aside**2 + errors.force**2
        c = (scatter * loads[1]) ** 2 + (aside * e) ** 2 + errors.torque**2
        b = np.zeros_like(a)
        if errors.place > 0.0:
            off = errors.place * self.spin
            faster, slower = self.predicted(theta, self.speed + off), self.predicted(theta, abs(self.speed - off))
            # across the slip it adds in squares
            across = self.predicted(theta, np.hypot(self.speed, off)) - loads
            for force, torque in (0.5 * (faster - slower), across):
                a, b, c = a + force**2, b + force * torque, c + torque**2
        second = 1.0 / np.sqrt(c - b**2 / a)
        return np.stack([1.0 / np.sqrt(a), second, second * b / a])

    def whitened(self, theta: FloatArray, whitening: FloatArray) -> npt.NDArray[np.float64]:
        """Return what the prediction is above the measured, in standard deviations, shape (2, n)."""
        force, torque = self.predicted(theta) - self.measured
        return np.stack([whitening[0] * force, whitening[1] * torque - whitening[2] * force])

    def unlikelihood(self, theta: FloatArray, whitening: FloatArray, *, heavy: bool, gain: float) -> float:
        """Return -2 log likelihood but for a constant, squares of residuals multiplied by `gain`."""
        squares = gain * (self.whitened(theta, whitening) ** 2).sum(axis=0)
        if heavy:
            squares = (TAIL + 2.0) * np.log1p(squares / TAIL)
        return float(squares.sum() - 2.0 * np.log(whitening[:2]).sum())
