"""A measured number with an interval that includes model errors beside noise."""

import math
from dataclasses import dataclass

from scipy.special import ndtri, stdtrit  # scipy.stats takes half a second to import

from palpate.errors import InvalidValueError, check_not_negative, check_positive


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number, and how far it may be off.

    Attributes:
        value: Best guess, in the quantity's own unit.
        noise: Its standard deviation by noise, seen in the data.
        model: Its standard deviation by what repeating the measurement would not show: calibration, drift, tilt.
        freedom: Degrees of freedom that `noise` was seen with; infinite if it was known.
    """

    value: float
    noise: float
    model: float
    freedom: float = math.inf

    @property
    def standard_deviation(self) -> float:
        """Of both together."""
        return math.hypot(self.noise, self.model)

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """Return where the true value lies with a probability of `level`."""
        if not 0.0 < level < 1.0:
            raise InvalidValueError(f"level = {level!r}: must lie between 0 and 1")
        known = float(ndtri(0.5 + 0.5 * level))
        seen = float(stdtrit(self.freedom, 0.5 + 0.5 * level)) if math.isfinite(self.freedom) else known
        half = math.hypot(seen * self.noise, known * self.model)
        return self.value - half, self.value + half


@dataclass(frozen=True, slots=True)
class SensorErrors:
    """What a force/torque sensor may be off by; as it is of the Nano17 class.

    Attributes:
        force_noise: Standard deviation of a sample of each force [N].
        moment_noise: Likewise, of each moment [N m].
        force_zero: Standard deviation of its zero while it rubs [N]: 5 s of drift after a tare.
        moment_zero: Likewise [N m].
        force_drift: How fast that moves [N/s].
        moment_drift: Likewise [N m/s].
        calibration: Standard deviation of the ratio of two loads on different axes, relative. The default is of a
            sensor calibrated where it is used; one that shows 1 % of its range on other axes, as data sheets
            allow, needs 0.02 (16 such specimens: 1.7 % in mu, 3.4 % in e, standard deviations).
    """

    force_noise: float = 0.010
    moment_noise: float = 1e-4
    force_zero: float = 0.005
    moment_zero: float = 5e-5
    force_drift: float = 1e-3
    moment_drift: float = 1e-5
    calibration: float = 0.003

    def __post_init__(self) -> None:
        check_positive(self, force_noise="N", moment_noise="N m")
        check_not_negative(
            self, force_zero="N", moment_zero="N m", force_drift="N/s", moment_drift="N m/s", calibration=""
        )

    def of_friction(self, normal_force: float) -> float:
        """Return the relative error of mu at a load [N], standard deviation.

        A wrong zero or gain of the normal force makes the torque over it wrong alike: e has none of it.
        """
        return math.hypot(self.calibration, self.force_zero / normal_force)
