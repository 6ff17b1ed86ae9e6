"""Loads in full slip over the limit surface that was found, for their figure."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.friction.result import FrictionResult
from palpate.friction import LimitSurface
from palpate.friction.rubbing.twisting import SpinMeasured


@dataclass(frozen=True, slots=True, eq=False)
class SurfacePoints:
    """Loads in full slip, over what the contact bears of each alone.

    Attributes:
        surface: As found.
        true: As simulated, if that is known.
        exponent_measured: Whether p of `surface` was measured, not assumed.
        points: f_t / (mu f_n) and tau / (mu e f_n), shape (n, 2).
        errors: Half of the 95 % interval of each, shape (n, 2).
        loads: Normal force that was asked for at each, shape (n,) [N].
        exponents: Between which p lies.
    """

    surface: LimitSurface
    true: LimitSurface | None
    exponent_measured: bool
    points: FloatArray
    errors: FloatArray
    loads: FloatArray
    exponents: tuple[float, float]


def slip_points(result: FrictionResult) -> SurfacePoints | None:
    """Return them; None if nothing slipped both along the surface and about its normal."""
    found, file = result.found, result.file
    spun = any(isinstance(at.spin, SpinMeasured) for at in found.loads)
    if file is None or file.spin_length is None or not file.friction.measured or not found.slips or not spun:
        return None
    surface = file.limit_surface()
    points = np.array(
        [
            (
                slip.tangential_force / (surface.friction * slip.normal_force),
                slip.spin_torque
                / (surface.friction * surface.spin_length_at(slip.normal_force) * slip.normal_force),
            )
            for slip in found.slips
        ]
    )
    scatter = 0.0 if found.fitted is None else found.fitted.scatter
    half = 0.5 * (file.friction.upper - file.friction.lower) / file.friction.value
    torque = 0.5 * (file.spin_length.upper - file.spin_length.lower) / file.spin_length.value
    relative = np.array([np.hypot(half, 2.0 * scatter), np.hypot(torque, 2.0 * scatter)])
    asked = [at.load for at in found.loads]
    return SurfacePoints(
        surface,
        result.plan.true_limit_surface,
        found.fitted is not None,
        points,
        np.abs(points) * relative,
        np.array([min(asked, key=lambda load: abs(load - slip.normal_force)) for slip in found.slips]),
        (file.norm_exponent.lower, file.norm_exponent.upper),
    )
