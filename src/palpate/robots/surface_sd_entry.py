"""How well the surface of a fingertip is known, in robot files."""

import msgspec
import numpy as np

from palpate.errors import InvalidValueError, not_negative
from palpate.runtime.robot_ranges import at_most
from palpate.sensing.tip_uncertainty import PARAMETERS, TipUncertainty

LARGEST_SD = 0.01
"""[m] of size and position: beyond, it is a number in millimetres."""

LARGEST_TURN = 0.5
"""[rad]: beyond, it is a number in degrees."""


class SurfaceSdEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Standard deviations of a fingertip's surface, independent of one another; or their covariance, whole.

    Attributes:
        size: By how much it may lie further out along its normals: the radius of a sphere [m].
        position: Of the tip in the sensor frame, each axis, or of the point that moments are about [m].
        rotation: About each axis through its center [rad].
        stiffness: Of a compliant tip, relative.
        covariance: Of position (3), rotation (3), size and stiffness, 8 rows of 8, as a calibration finds it; the
            others are left out then.
    """

    size: float = msgspec.field(name="size_m", default=0.0)
    position: float = msgspec.field(name="position_m", default=0.0)
    rotation: float = msgspec.field(name="rotation_rad", default=0.0)
    stiffness: float = 0.0
    covariance: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        for key, value, most, unit in (
            ("size_m", self.size, LARGEST_SD, "m"),
            ("position_m", self.position, LARGEST_SD, "m"),
            ("rotation_rad", self.rotation, LARGEST_TURN, "rad"),
            ("stiffness", self.stiffness, 1.0, ""),
        ):
            at_most(key, not_negative(key, value, unit), most, unit)
            if value and self.covariance:
                raise InvalidValueError(f"{key} = {value:g}: leave it out, covariance says it")
        if self.covariance:
            if [len(row) for row in self.covariance] != [PARAMETERS] * PARAMETERS:
                lengths = ", ".join(str(len(row)) for row in self.covariance)
                raise InvalidValueError(
                    f"covariance has rows of {lengths} numbers: must be {PARAMETERS} of {PARAMETERS}"
                )
            sd = np.sqrt(np.diag(self.uncertainty.covariance))
            at_most("covariance, size or position", float(sd[[0, 1, 2, 6]].max()), LARGEST_SD, "m")
            at_most("covariance, rotation", float(sd[3:6].max()), LARGEST_TURN, "rad")

    @property
    def uncertainty(self) -> TipUncertainty:
        """The same, as covariances of contacts take it."""
        if self.covariance:
            return TipUncertainty(np.array(self.covariance))
        return TipUncertainty.independent(self.size, self.position, self.rotation, self.stiffness)
