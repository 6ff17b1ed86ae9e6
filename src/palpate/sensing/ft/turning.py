"""Taking weight and inertia of a payload off a force/torque measurement while the arm turns."""

from dataclasses import dataclass, field

import numpy as np

from palpate.errors import InvalidValueError
from palpate.sensing.compensation import Payload
from palpate.spatial import Matrix, Vector, Wrench, add, cross, rotate, scale

NO_INERTIA: Matrix = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
"""Of a point mass."""

INERTIA_TOLERANCE = 1e-9
"""Relative asymmetry and violation of the triangle inequality that pass as rounding."""


@dataclass(frozen=True, slots=True)
class TurningPayload:
    """A payload with its moments of inertia.

    Attributes:
        payload: Mass and centre of mass in the sensor frame.
        inertia: About the centre of mass, along the axes of the sensor frame [kg m^2].
    """

    payload: Payload = field(default_factory=Payload)
    inertia: Matrix = NO_INERTIA

    def __post_init__(self) -> None:
        matrix = np.array(self.inertia, dtype=np.float64)
        if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
            raise InvalidValueError(f"inertia = {self.inertia!r}: must be 3x3 finite numbers [kg m^2]")
        limit = INERTIA_TOLERANCE * float(np.abs(matrix).max())
        if np.abs(matrix - matrix.T).max() > limit:
            raise InvalidValueError(f"inertia = {self.inertia!r}: must be symmetric")
        low, middle, high = np.linalg.eigvalsh(matrix)
        if low < -limit or low + middle < high - limit:
            raise InvalidValueError(
                f"inertia has principal moments {low:.3g}, {middle:.3g}, {high:.3g} kg m^2: must be 0 or above, "
                "and none above the sum of the other two (no body has such)"
            )


def contact_wrench_turning(
    load: Wrench,
    acceleration: Vector,
    angular_velocity: Vector,
    angular_acceleration: Vector,
    turning: TurningPayload,
) -> Wrench:
    """Return what the object exerts on the finger, from the load on the sensor's tip side.

    Newton and Euler for the payload, a rigid body: with s = a + alpha x c + omega x (omega x c) the specific
    force at its centre of mass,
        contact force  = load force + m s
        contact moment = load moment + c x m s + I alpha + omega x I omega.
    At omega = alpha = 0 this is `palpate.sensing.compensation.contact_wrench`.

    Args:
        load: Measured wrench, sensor frame [N, N m].
        acceleration: Specific force at the sensor's origin, sensor frame [m/s^2] (gravity included).
        angular_velocity: Of the sensor, in its frame [rad/s].
        angular_acceleration: Likewise [rad/s^2].
        turning: What hangs on the sensor.
    """
    center = turning.payload.center_of_mass
    omega, alpha = angular_velocity, angular_acceleration
    s = add(acceleration, add(cross(alpha, center), cross(omega, cross(omega, center))))
    x, y, z = scale(turning.payload.mass, s)
    u, v, w = cross(center, (x, y, z))
    p, q, r = add(rotate(turning.inertia, alpha), cross(omega, rotate(turning.inertia, omega)))
    f0, f1, f2, m0, m1, m2 = load
    return (f0 + x, f1 + y, f2 + z, m0 + u + p, m1 + v + q, m2 + w + r)
