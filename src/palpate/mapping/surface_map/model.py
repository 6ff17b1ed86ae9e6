"""Prior of a map: how a surface bends, and how contacts err."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from palpate.errors import FloatArray, positive


@dataclass(frozen=True, slots=True)
class SurfaceModel:
    """Numbers of a Gaussian process on heights and of the noise of a finger along its path.

    Heights over a patch's plane have a Matern-5/2 covariance. Noise of positions and normals keeps along the path:
    its correlation between contacts a path s apart is exp(-s / length), since what errs (calibration,
    friction, the shape of the tip) changes with place, not with every sample. Defaults are those of a calibrated
    Nano17-class finger; `learn` fits all but the last to what was felt.

    Attributes:
        length: Length scale of the surface [m].
        curvature: Standard deviation of its second derivatives [1/m]; that of heights is curvature length^2 / 5.
        noise: Standard deviation of positions along the normal [m].
        noise_length: Path over which noise keeps its value [m].
        tilt: Standard deviation of a normal about each tangent [rad].
        tilt_length: Path over which the noise of normals keeps its value [m].
        plane: Standard deviation of the height of a patch's plane at its centre [m]. The centre is a contact, so
            millimetres say nothing. It is not learned, nor may it follow the length: the evidence of every patch
            falls with its logarithm, which made the shortest length the most probable one of a gentle surface.

    Raises:
        InvalidValueError: A number is not positive.
    """

    length: float = 10e-3
    curvature: float = 50.0
    noise: float = 0.03e-3
    noise_length: float = 1.0e-3
    tilt: float = math.radians(0.5)
    tilt_length: float = 1.0e-3
    plane: float = 2.0e-3

    def __post_init__(self) -> None:
        units = ("m", "1/m", "m", "m", "rad", "m", "m")
        for field, unit in zip(dataclasses.fields(self), units, strict=True):
            positive(field.name, getattr(self, field.name), unit)

    @property
    def height(self) -> float:
        """Standard deviation of heights before anything is felt [m]; see Rasmussen & Williams (2006), eq. 4.17."""
        return self.curvature * self.length**2 / 5.0

    @property
    def logarithms(self) -> FloatArray:
        """The six numbers that are learned as natural logarithms, in the order of `Parameter`, shape (6,)."""
        return np.log(dataclasses.astuple(self)[:6])

    def bent(self, bend: "PatchCurvature") -> Self:
        """Return the same noise on a surface that bends otherwise."""
        return dataclasses.replace(
            self, length=bend.length * self.length, curvature=bend.curvature * self.curvature
        )

    def bend_of(self, other: Self) -> "PatchCurvature":
        """Return how a surface like `other` bends compared with this one; it is as rare as the other bends."""
        return PatchCurvature(other.length / self.length, other.curvature / self.curvature, RARE)


@dataclass(frozen=True, slots=True)
class PatchCurvature:
    """How one patch of a surface bends compared with the rest of it.

    Attributes:
        length: Its length scale over that of the model.
        curvature: Its curvature over that of the model.
        odds: Logarithm of the probability of such a patch over that of an ordinary one.
    """

    length: float
    curvature: float
    odds: float


RARE = -3.0
"""Odds of a bend that is not the ordinary one: 1 to 20."""

BENDS = (PatchCurvature(1.0, 1.0, 0.0), PatchCurvature(0.25, 1.0, RARE), PatchCurvature(1.0, 0.01, RARE))
"""Ordinary; with an edge, where curvature changes within a patch; flat. A stationary process knows one kind of
bend only: on a box with rounded edges it would call the faces as uncertain as the edges. The log evidence prefers
another bend by 50 to 100 there and by less than 3 on an ellipsoid (298 of 298 patches), so odds of 1 to 20 keep
homogeneous surfaces ordinary."""
