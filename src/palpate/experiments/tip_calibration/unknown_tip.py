"""A simulated fingertip that is not as its robot file says: to try the calibration out, and for its metrics."""

from dataclasses import dataclass
from math import radians

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from palpate.errors import InvalidValueError
from palpate.experiments.tip_calibration.config import TipCalibrationConfig
from palpate.open_kinds import name_of_kind
from palpate.robots.surface_entries import PlacedSurface, SurfaceKind
from palpate.spatial import ZERO, Vector, as_vector

SIZE, CENTER, TURN, STIFFNESS = 0.05, 1e-3, radians(3.0), 2.0
"""Largest errors that are drawn: relative, [m] along each axis, [rad], and a factor."""


@dataclass(frozen=True, slots=True)
class TipErrors:
    """How a simulated tip differs from the typed one.

    Attributes:
        size: Of its lengths, relative.
        center: Sensor frame [m].
        turn: Axis times angle, sensor frame [rad].
        stiffness: Factor.
    """

    size: float
    center: Vector
    turn: Vector
    stiffness: float

    @classmethod
    def of(cls, config: TipCalibrationConfig) -> "TipErrors":
        """Return the errors of a configuration, or random ones."""
        if config.unknown_tip is None:
            return cls(config.size_error, config.center_error, ZERO, config.stiffness_ratio)
        rng = np.random.default_rng(config.unknown_tip)
        axis = rng.normal(size=3)
        return cls(
            float(rng.uniform(-SIZE, SIZE)),
            as_vector(rng.uniform(-CENTER, CENTER, 3)),
            as_vector(TURN * axis / np.linalg.norm(axis)),
            float(STIFFNESS ** rng.uniform(-1.0, 1.0)),
        )


def true_tip(typed: SurfaceKind, errors: TipErrors) -> SurfaceKind:
    """Return the tip that is simulated in the place of the typed one.

    Raises:
        InvalidValueError: Its kind has no lengths and centre to be wrong.
    """
    inner = getattr(typed, "tip", typed)
    if not isinstance(inner, PlacedSurface):
        raise InvalidValueError(
            f"unknown_tip: a fingertip of kind {name_of_kind(typed)} has no sizes that could be wrong; take a "
            "sphere, an ellipsoid, a capsule or a superellipsoid"
        )
    lengths = {attribute: _scaled(getattr(inner, attribute), 1.0 + errors.size) for attribute, _ in inner.LENGTHS}
    center = as_vector(np.array(inner.center) + errors.center)
    turned = Rotation.from_rotvec(errors.turn) * Rotation.from_rotvec(inner.rotvec)
    return msgspec.structs.replace(inner, **lengths, center=center, rotvec=as_vector(turned.as_rotvec()))


def _scaled(length: float | tuple[float, ...], factor: float) -> float | tuple[float, ...]:
    return tuple(factor * each for each in length) if isinstance(length, tuple) else factor * length
