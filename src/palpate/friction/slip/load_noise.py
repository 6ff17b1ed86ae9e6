"""How well a load is known from one sample."""

from __future__ import annotations

import math
from dataclasses import dataclass

from palpate.errors import check_positive, not_negative, positive


@dataclass(frozen=True, slots=True)
class LoadNoise:
    """Standard deviations of one sample's white noise, alike along every axis.

    Of the load, not of the sensor: see `of_touch`.

    Attributes:
        force: Of the tangential force [N]; of the normal force it is no more.
        torque: Of the spin torque [N m].
    """

    force: float = 0.010
    """10 mN: what an ATI Nano17 leaves at 500 Hz of bandwidth."""
    torque: float = 0.1e-3
    """0.1 mN m: likewise."""

    def __post_init__(self) -> None:
        check_positive(self, force="N", torque="N m")

    @classmethod
    def of_touch(cls, force: float, moment: float, radius: float, lever: float = 0.0) -> LoadNoise:
        """Return what a sensor's noise makes of a load whose normal touch takes from the contact centroid.

        Noise of the moment shifts the centroid by moment / f and so turns the normal by moment / (f R): that much
        of f appears as tangential force, whatever f is. It is the moment about the tip's centre that counts: the
        noise of the force adds to it by its lever.

        Args:
            force: Of the sensor [N].
            moment: Likewise [N m].
            radius: Of the fingertip [m].
            lever: From the sensor's origin to the tip's centre [m].
        """
        moment = math.hypot(moment, not_negative("lever", lever, "m") * force)
        return cls(math.hypot(force, moment / positive("radius", radius, "m")), moment)
