"""How well the surface of a fingertip is known, in robot files."""

import msgspec
import numpy as np

from palpate.errors import InvalidValueError, not_negative
from palpate.runtime.robot_ranges import at_most
from palpate.sensing.tip_uncertainty import POSITION, ROTATION, SIZE, STIFFNESS, TipUncertainty

LARGEST_SD = 0.01
"""[m] of size and position: beyond, it is a number in millimetres."""

LARGEST_TURN = 0.5
"""[rad]: beyond, it is a number in degrees."""


LARGEST_STIFFNESS = 1.0
"""Relative: beyond, nothing is known of it."""

Row = tuple[float, float, float, float, float, float, float, float]


class SurfaceSdEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How uncertain a fingertip's surface is: independent standard deviations, or their covariance.

    Attributes:
        size: By how much it may lie further out along its normals: the radius of a sphere [m].
        position: Of the tip in the sensor frame, each axis, or of the point that moments are about [m].
        rotation: About each axis through its center [rad].
        stiffness: Of a compliant tip, relative.
        covariance: Instead of these, as a calibration finds it: of position (3), rotation (3), size and stiffness,
            eight rows of eight, in their units.
    """

    size: float = msgspec.field(name="size_m", default=0.0)
    position: float = msgspec.field(name="position_m", default=0.0)
    rotation: float = msgspec.field(name="rotation_rad", default=0.0)
    stiffness: float = 0.0
    covariance: tuple[Row, Row, Row, Row, Row, Row, Row, Row] | None = None

    def __post_init__(self) -> None:
        not_negative("size_m", self.size, "m")
        not_negative("position_m", self.position, "m")
        not_negative("rotation_rad", self.rotation, "rad")
        not_negative("stiffness", self.stiffness, "")
        if self.covariance is not None and any((self.size, self.position, self.rotation, self.stiffness)):
            raise InvalidValueError("covariance: beside it no standard deviation counts; leave them out, or it")
        sd = np.sqrt(np.diag(self.uncertainty.covariance))
        for key, value, most, unit in (
            ("size_m", sd[SIZE], LARGEST_SD, "m"),
            ("position_m", sd[POSITION].max(), LARGEST_SD, "m"),
            ("rotation_rad", sd[ROTATION].max(), LARGEST_TURN, "rad"),
            ("stiffness", sd[STIFFNESS], LARGEST_STIFFNESS, ""),
        ):
            at_most(key, float(value), most, unit)

    @property
    def uncertainty(self) -> TipUncertainty:
        """The same, as covariances of contacts take it."""
        if self.covariance is not None:
            return TipUncertainty(np.array(self.covariance))
        return TipUncertainty.independent(self.size, self.position, self.rotation, self.stiffness)
