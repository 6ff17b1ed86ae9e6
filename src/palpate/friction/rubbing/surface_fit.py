"""A whole limit surface from many slips: mu, c, the growth exponent gamma and the norm's exponent p.

At a normal force f_n and a slip (v, omega), v along the surface, the load lies where the limit surface's normal is
the slip (see `palpate.friction.limit_surface`): with a = v, b = e omega,

    (x, y) ~ (a, b)^(1/(p-1)),  |(x, y)|_p = 1,    f_t = mu f_n x,  tau = mu e f_n y,  e = c f_n^gamma.

Maximum likelihood over both components of every load, each with a standard deviation of `scatter` times itself
(real surfaces differ from stroke to stroke by some per cent) and the sensor's own, and what an error of the place
turned about does to the slip. p is determined by two things: how far a load of both lies from the axes, and how
fast it turns as the slip does; so slips of both kinds and several ratios are wanted, see
`palpate.friction.rubbing.stroke_plan`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares, minimize_scalar
from scipy.stats import norm
from scipy.stats import t as student

from palpate.errors import FloatArray, InvalidValueError, not_negative, positive
from palpate.friction.limit_surface import LARGEST_LOAD_EXPONENT, LimitSurface

MIN_EXPONENT = 1.01
"""Of p while it is searched: at 1 the load jumps from corner to corner of the diamond."""

SMALLEST_SCATTER, LARGEST_SCATTER = 0.003, 0.5
"""Between these it is looked for: less is not believed of any surface, more is no limit surface."""

PLACE_ERROR = 0.2e-3
"""How far beside the contact a finger that finds it by touch may turn [m]: the noise of the centroid, filtered.
Loads on the friction plant are off by what 0.06 mm does, but alike in slips that are alike, which counts as more:
with 0.1 mm p lay in its 95 % interval in 30 of 32 runs, with 0.2 mm in all (`benchmarks/friction.py`)."""

_ROUNDS = 4
"""Of fitting by deviations that depend on the fit: more change nothing."""

_STARTS = (1.15, 1.4, 1.8)
"""Values of p to begin with: near 1 the likelihood is flat where slips and axes are alike."""


@dataclass(frozen=True, slots=True)
class SlipLoad:
    """What a contact in full slip bore: mean of a motion there and back.

    Attributes:
        normal_force: [N].
        tangential_force: Its length, along the slip [N].
        spin_torque: Along the spin, so 0 or above but for noise [N m].
        speed: Of the slip along the surface, 0 or above [m/s].
        spin: Of the slip about the normal, 0 or above [rad/s].
    """

    normal_force: float
    tangential_force: float
    spin_torque: float
    speed: float
    spin: float

    def __post_init__(self) -> None:
        positive("normal_force", self.normal_force, "N")
        not_negative("speed", self.speed, "m/s")
        not_negative("spin", self.spin, "rad/s")
        if self.speed == self.spin == 0.0:
            raise InvalidValueError("speed = 0 m/s and spin = 0 rad/s: must slip, with one of them not 0")
        if not (math.isfinite(self.tangential_force) and math.isfinite(self.spin_torque)):
            raise InvalidValueError(
                f"tangential_force = {self.tangential_force} N, spin_torque = {self.spin_torque} N m: "
                "must be finite"
            )


@dataclass(frozen=True, slots=True, eq=False)
class LimitSurfaceFit:
    """A limit surface and how well it is known.

    Attributes:
        surface: The most likely one.
        covariance: Of (ln mu, ln c, gamma, p), shape (4, 4), such that 1.96 deviations hold 95 %. At an end of
            its range gamma or p is likelier within than this says.
        scatter: Of the loads about it, relative.
        loads: How many it rests on.
    """

    surface: LimitSurface
    covariance: FloatArray
    scatter: float
    loads: int

    @property
    def standard_deviations(self) -> tuple[float, float, float, float]:
        """Of mu, c [m], gamma and p."""
        mu, c, gamma, p = np.sqrt(np.diag(self.covariance)).tolist()
        return self.surface.friction * mu, self.surface.spin_length * c, gamma, p


def fit_limit_surface(
    loads: Sequence[SlipLoad],
    scatter: float | None = None,
    force_error: float = 1e-3,
    torque_error: float = 1e-5,
    place_error: float = 0.0,
) -> LimitSurfaceFit:
    """Return the most likely limit surface.

    Args:
        loads: At least four, of sliding, spinning and both; for gamma, at two normal forces or more.
        scatter: Standard deviation of a force or a torque from stroke to stroke, relative; found from the loads
            themselves if not given.
        force_error: The sensor's standard deviation of a mean force [N].
        torque_error: Likewise, of a torque [N m].
        place_error: By how much the finger may turn about another point than the contact, which slides it by
            `place_error` omega [m].

    Raises:
        InvalidValueError: Too few loads, or none of sliding or of spinning.
    """
    data = _Loads.of(loads)
    floor = (force_error, torque_error)
    best: tuple[float, FloatArray, float, FloatArray] | None = None
    for p in _STARTS:
        guess, spread = data.start(p), 0.03 if scatter is None else max(scatter, SMALLEST_SCATTER)
        rows = np.zeros((2 * len(loads), 4))
        for _ in range(_ROUNDS):
            # by the loads as predicted: measured ones would favour the small
            weights = data.weights(guess, spread, floor, place_error)
            result = least_squares(
                data.residuals, guess, bounds=(_LOW, _HIGH), x_scale=(0.1, 0.1, 0.1, 0.3), args=(weights,)
            )
            guess, rows = np.asarray(result.x), np.asarray(result.jac, dtype=np.float64)
            if scatter is None:
                spread = data.likeliest_scatter(guess, floor, place_error)
        unlikely = data.unlikelihood(guess, data.weights(guess, spread, floor, place_error))
        if best is None or unlikely < best[0]:
            best = (unlikely, guess, spread, rows)
    assert best is not None
    _, found, size, jacobian = best
    # what the loads leave undetermined, a uniform prior over the range determines
    information = jacobian.T @ jacobian + np.diag(_PRIOR)
    mu, c, gamma, p = math.exp(found[0]), math.exp(found[1]), float(found[2]), float(found[3])
    covariance = np.linalg.inv(information).astype(np.float64)
    if scatter is None:
        # seen with few degrees of freedom: Student's quantile over the normal's, so that 1.96 deviations hold 95 %
        covariance *= (student.ppf(0.975, 2 * len(loads) - 4) / norm.ppf(0.975)) ** 2
    return LimitSurfaceFit(LimitSurface(mu, c, gamma, p), covariance, size, len(loads))


_LOW = np.array([math.log(1e-3), math.log(1e-6), 0.0, MIN_EXPONENT])
_HIGH = np.array([math.log(1e2), math.log(1.0), LARGEST_LOAD_EXPONENT, 2.0])
_PRIOR = 12.0 / (_HIGH - _LOW) ** 2


@dataclass(frozen=True, slots=True, eq=False)
class _Loads:
    """As a structure of arrays; shape (n,), `measured` (2, n)."""

    normal_force: FloatArray
    measured: FloatArray
    speed: FloatArray
    spin: FloatArray

    @classmethod
    def of(cls, loads: Sequence[SlipLoad]) -> "_Loads":
        if len(loads) < 4:
            raise InvalidValueError(f"{len(loads)} loads: must be at least 4, of sliding, spinning and both")
        columns = np.array(
            [[l.normal_force, l.tangential_force, l.spin_torque, l.speed, l.spin] for l in loads]  # noqa: E741
        ).T
        if not (columns[3].any() and columns[4].any()):
            raise InvalidValueError("all loads are of one kind of slip: must be of sliding and of spinning")
        return cls(columns[0], columns[1:3].copy(), columns[3], columns[4])

    def start(self, p: float) -> FloatArray:
        """From the largest ratios seen of each kind: (ln mu, ln c, gamma, p)."""
        force, torque = self.measured
        mu = max(float((force / self.normal_force).max()), 1e-2)
        c = max(float((torque / self.normal_force).max()) / mu, 1e-5)
        return np.clip([math.log(mu), math.log(c), 0.15, p], _LOW + 1e-6, _HIGH - 1e-6)

    def predicted(self, theta: npt.NDArray[np.float64], speed: FloatArray | None = None) -> FloatArray:
        """Return tangential force and torque, shape (2, n)."""
        mu, c, gamma, p = math.exp(theta[0]), math.exp(theta[1]), theta[2], theta[3]
        e = c * self.normal_force**gamma
        a, b = self.speed if speed is None else speed, e * self.spin
        largest = np.maximum(a, b)
        power = 1.0 / (p - 1.0)
        x, y = (a / largest) ** power, (b / largest) ** power
        length = (x**p + y**p) ** (1.0 / p)
        most = mu * self.normal_force
        return np.stack([most * x / length, most * e * y / length])

    def residuals(self, theta: FloatArray, weights: FloatArray) -> FloatArray:
        """Return what is left, whitened, shape (2 n,)."""
        force, torque = self.predicted(theta) - self.measured
        return np.concatenate([weights[0] * force, weights[1] * torque - weights[2] * force])

    def unlikelihood(self, theta: FloatArray, weights: FloatArray, gain: float = 1.0) -> float:
        """Return -2 log likelihood but for a constant, squares of residuals multiplied by `gain`."""
        return float(gain * (self.residuals(theta, weights) ** 2).sum() - 2.0 * np.log(weights[:2]).sum())

    def likeliest_scatter(self, theta: FloatArray, floor: tuple[float, float], place_error: float) -> float:
        """Return the scatter that goes best with what is left about a surface; four parameters were fitted."""
        gain = self.measured.size / (self.measured.size - 4)

        def unlikely(log_scatter: float) -> float:
            return self.unlikelihood(theta, self.weights(theta, math.exp(log_scatter), floor, place_error), gain)

        ends = (math.log(SMALLEST_SCATTER), math.log(LARGEST_SCATTER))
        return math.exp(float(minimize_scalar(unlikely, bounds=ends, method="bounded").x))

    def weights(
        self, theta: FloatArray, scatter: float, floor: tuple[float, float], place_error: float
    ) -> FloatArray:
        """Return the inverse Cholesky factors of the loads' covariances, shape (3, n): 1, 1; 2, 2; and -(2, 1).

        Scatter and sensor change force and torque each by itself, an error of the slip both together.
        """
        loads = self.predicted(theta)
        a, c = (scatter * loads) ** 2 + np.square(floor)[:, None]
        b = np.zeros_like(a)
        if place_error > 0.0:
            off = place_error * self.spin
            faster, slower = (
                self.predicted(theta, self.speed + off),
                self.predicted(theta, np.abs(self.speed - off)),
            )
            # across the slip it adds in squares
            aside = self.predicted(theta, np.hypot(self.speed, off)) - loads
            for force, torque in (0.5 * (faster - slower), aside):
                a, b, c = a + force**2, b + force * torque, c + torque**2
        second = 1.0 / np.sqrt(c - b**2 / a)
        return np.stack([1.0 / np.sqrt(a), second, second * b / a])
