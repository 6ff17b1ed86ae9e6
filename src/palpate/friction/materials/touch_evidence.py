"""Evidence of one touch about a surface, in a form that adds up.

In full slip the measured logarithms are linear in ln mu, ln c, gamma and p, but for mu's dependence on the speed,
which is each material's own:

    stroke   ln(f_t / f_n)  = ln mu(v)
    twist    ln(tau / f_n)  = ln mu(e omega) + ln c + gamma ln f_n
    fit      all four, as fitted to many slips together.

A surface that never slipped says that one of these is at least so much, at rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError, check_not_negative, not_negative, numbers, positive
from palpate.friction.materials.material import PARAMETERS
from palpate.friction.rubbing.sliding import FrictionBound, FrictionMeasured
from palpate.friction.rubbing.surface_fit import LimitSurfaceFit
from palpate.friction.rubbing.twisting import SpinBound, SpinMeasured

STROKE_ROW: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)
"""How a stroke's logarithm depends on ln mu, ln c, gamma and p."""


def twist_row(normal_force: float) -> tuple[float, ...]:
    """Return how a twist's logarithm depends on ln mu, ln c, gamma and p at a normal force [N]."""
    return 1.0, 1.0, math.log(positive("normal_force", normal_force, "N")), 0.0


@dataclass(frozen=True, slots=True, eq=False)
class TouchEvidence:
    """One touch that slipped: values = rows (ln mu, ln c, gamma, p) + error; m values.

    Attributes:
        values: Shape (m,).
        rows: Shape (m, 4).
        covariance: Of the measurement alone, not of the surface's scatter, shape (m, m).
        speed: Of the slip along the surface [m/s]; of a fit, the one its mu belongs to.
        spin: Of the slip about the normal [rad/s].
        normal_force: At which that spins [N]: it slips as fast as e spin.
    """

    values: FloatArray
    rows: FloatArray
    covariance: FloatArray
    speed: float
    spin: float = 0.0
    normal_force: float = 1.0

    def __post_init__(self) -> None:
        m = len(self.values)
        for name, shape in (("values", (m,)), ("rows", (m, PARAMETERS)), ("covariance", (m, m))):
            array = numbers(name, getattr(self, name))
            if m == 0 or array.shape != shape or not np.isfinite(array).all():
                raise InvalidValueError(
                    f"{name} of a touch, {array.tolist()}: must have shape {shape}, all finite, m at least 1"
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        spread = np.linalg.eigvalsh(self.covariance)
        largest = float(np.abs(self.covariance).max())
        if np.abs(self.covariance - self.covariance.T).max() > 1e-9 * largest or spread[0] < -1e-9 * largest:
            raise InvalidValueError(f"covariance = {self.covariance.tolist()}: must be symmetric, nothing below 0")
        check_not_negative(self, speed="m/s", spin="rad/s")
        positive("normal_force", self.normal_force, "N")

    @classmethod
    def stroke(cls, friction: float, error: float, speed: float) -> TouchEvidence:
        """Return what a stroke says.

        Args:
            friction: Tangential over normal force.
            error: Standard deviation of its measurement, relative.
            speed: Of the slip [m/s].
        """
        value = math.log(positive("friction", friction, ""))
        return cls(np.array([value]), np.array([STROKE_ROW]), _square(error), speed)

    @classmethod
    def twist(cls, torque_ratio: float, error: float, normal_force: float, spin: float) -> TouchEvidence:
        """Return what a twist says.

        Args:
            torque_ratio: Spin torque over normal force, mu e [m].
            error: Standard deviation of its measurement, relative.
            normal_force: [N].
            spin: Of the slip about the normal [rad/s].
        """
        value = math.log(positive("torque_ratio", torque_ratio, "m"))
        return cls(np.array([value]), np.array([twist_row(normal_force)]), _square(error), 0.0, spin, normal_force)

    @classmethod
    def of_stroke(cls, found: FrictionMeasured) -> TouchEvidence:
        """Return what measured strokes say; those of one place count as one touch."""
        mu = found.friction
        return cls.stroke(mu.value, mu.standard_deviation / mu.value, found.speed)

    @classmethod
    def of_twist(cls, found: SpinMeasured) -> TouchEvidence:
        """Return what measured twists say; those of one place count as one touch."""
        ratio = found.torque_ratio
        error = ratio.standard_deviation / ratio.value
        return cls.twist(ratio.value, error, found.normal_force, found.spin)

    @classmethod
    def of_fit(cls, found: LimitSurfaceFit, speed: float) -> TouchEvidence:
        """Return what a whole limit surface says, as one touch: its slips' scatter counts twice, to be safe.

        Args:
            found: From slips at one place.
            speed: Slip speed of all of them [m/s].
        """
        surface = found.surface
        logs = (math.log(surface.friction), math.log(surface.spin_length))
        values = np.array([*logs, surface.load_exponent, surface.norm_exponent])
        return cls(values, np.eye(PARAMETERS), found.covariance, speed)


@dataclass(frozen=True, slots=True)
class NeverSlipped:
    """One touch that did not slip: row (ln mu, ln c, gamma, p) is at least `least`, with the static mu.

    Attributes:
        least: Logarithm of mu, or of mu e [m], that was borne.
        row: Four numbers.
    """

    least: float
    row: tuple[float, ...]

    def __post_init__(self) -> None:
        if math.isnan(self.least) or self.least == math.inf:
            raise InvalidValueError(
                f"least = {self.least}: must be a number, or -infinity where nothing was borne"
            )

    @classmethod
    def stroke(cls, least_friction: float) -> NeverSlipped:
        """Return what a stroke says that never slipped; a bound of 0 says nothing."""
        return cls(_log(not_negative("least_friction", least_friction, "")), STROKE_ROW)

    @classmethod
    def twist(cls, least_torque_ratio: float, normal_force: float) -> NeverSlipped:
        """Return what a twist says that never spun: mu e [m] is at least so much at a normal force [N]."""
        return cls(_log(not_negative("least_torque_ratio", least_torque_ratio, "m")), twist_row(normal_force))

    @classmethod
    def of_stroke(cls, found: FrictionBound) -> NeverSlipped:
        """Return what measured strokes say."""
        return cls.stroke(found.least_friction)

    @classmethod
    def of_twist(cls, found: SpinBound) -> NeverSlipped:
        """Return what measured twists say."""
        return cls.twist(found.least_torque_ratio, found.normal_force)


def _square(error: float) -> FloatArray:
    return np.array([[not_negative("error", error, "") ** 2]])


def _log(value: float) -> float:
    return math.log(value) if value > 0.0 else -math.inf
