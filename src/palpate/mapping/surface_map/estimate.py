"""What a map estimates at points, and with what uncertainty."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr, ndtri

from palpate.errors import FloatArray, InvalidValueError

NEWTON_STEPS = 8
"""Newton's iteration for a half-width starts within a tenth of it and converges quadratically."""


class Knowledge(IntEnum):
    """Whether the surface at a point was felt."""

    OBSERVED = 0
    """Within reach of contacts, on all sides."""
    EXTRAPOLATED = 1
    """Within reach of a contact, but beyond the edge of what was felt: the surface is drawn on, not claimed."""
    UNOBSERVED = 2
    """Farther than the reach from every contact: nothing is known, whatever the standard deviation."""


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceEstimate:
    """Distance, normal and uncertainty of a map at n points, in the robot's base frame.

    Attributes:
        distance: Signed distance to the surface, positive outside, shape (n,) [m]; NaN where no patch reaches.
        nearest: Nearest points of the surface, shape (n, 3) [m].
        normal: Outward unit normals there, shape (n, 3).
        sd: Standard deviation of the surface's place along the normal from random errors, shape (n,) [m].
        bias: Largest constant offset beyond that, the budget of the settings [m].
        contact_distance: From the nearest point to the nearest stretch of contacts, shape (n,) [m].
        knowledge: Values of `Knowledge`, shape (n,).
        surprise: How ill what was felt there fits the model, 1 where it fits, shape (n,).
    """

    distance: FloatArray
    nearest: FloatArray
    normal: FloatArray
    sd: FloatArray
    bias: float
    contact_distance: FloatArray
    knowledge: npt.NDArray[np.int8]
    surprise: FloatArray

    def __len__(self) -> int:
        """Number of points."""
        return len(self.distance)

    @property
    def observed(self) -> npt.NDArray[np.bool_]:
        """Where the map claims the surface, shape (n,)."""
        return np.asarray(self.knowledge == Knowledge.OBSERVED)

    def band(self, probability: float = 0.95) -> FloatArray:
        """Return half-widths that hold the true surface with at least `probability`, shape (n,) [m].

        See `half_widths`. It says nothing about points that are not `observed`.
        """
        return half_widths(self.sd, self.bias, probability)


def half_widths(sd: FloatArray, bias: float, probability: float = 0.95) -> FloatArray:
    """Return t such that |b + e| <= t with `probability` for the worst |b| <= bias and e normal with `sd`.

    The worst b is the budget itself, so t solves F((t - b) / sd) - F((-t - b) / sd) = probability: 1.96 sd without
    bias, b + 1.645 sd where the bias is larger than the noise, since an error then leaves on one side only (Imbens
    and Manski, Econometrica 72, 2004, eq. 7). Adding 1.96 sd and b claims less than is known.

    Raises:
        InvalidValueError: `probability` is not between 0 and 1.
    """
    if not 0.0 < probability < 1.0:
        raise InvalidValueError(f"probability = {probability}: must lie between 0 and 1, as 0.95")
    sd = np.asarray(sd, np.float64)
    scale = np.where(sd > 0.0, sd, 1.0)
    b = bias / scale
    t = b + ndtri(0.5 + 0.5 * probability)  # from above: the left side is concave there
    for _ in range(NEWTON_STEPS):
        slope = np.exp(-0.5 * (t - b) ** 2) + np.exp(-0.5 * (t + b) ** 2)
        t -= (ndtr(t - b) - ndtr(-t - b) - probability) * np.sqrt(2.0 * np.pi) / slope
    return np.asarray(np.where(sd > 0.0, t * scale, np.where(np.isnan(sd), np.nan, bias)))
