"""Full slip on the turntable, at all angles between sliding and spinning, against the limit surface asked for."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.sim import ContactLaw, Fidelity
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.presets import EXPLORE
from simulation.turntable import LAW, ride

SLIP_SPEED = 0.02  # |(v, e w)| [m/s]
LIMIT_ANGLES = tuple(np.linspace(0.0, 90.0, 13).tolist())  # [deg]
LIMIT_SECONDS = 0.05  # of each angle


@dataclass(frozen=True, slots=True)
class LimitSurface:
    """Full slip at all angles between sliding and spinning.

    Attributes:
        error: Largest | |(f_t / mu f_n, torque / mu e f_n)| - 1 |.
        turned: Largest angle between load and slip, of the tangential force or of its share of the torque [deg].
        touching: Least share of the time in contact.
    """

    error: float
    turned: float
    touching: float


def limit_surface(
    fidelity: Fidelity = EXPLORE.fidelity,
    law: ContactLaw = LAW,
    plant: FrictionLaw | None = None,
    angles: Sequence[float] = LIMIT_ANGLES,
) -> LimitSurface:
    """Return how far full slip is from MuJoCo's own limit surface, an ellipse.

    Args:
        fidelity: How it is computed.
        law: Its friction and spin length count for the plant, too.
        plant: Friction by the plant.
        angles: From sliding, 0, to spinning, 90 [deg].
    """
    errors, turned, touching = [0.0], [0.0], [1.0]
    for angle in np.radians(angles).tolist():
        v, w = SLIP_SPEED * math.cos(angle), SLIP_SPEED * math.sin(angle) / law.spin_length
        ridden = ride(fidelity, law, v, w, plant, seconds=LIMIT_SECONDS)
        touching.append(ridden.touching)
        most = law.friction * ridden.normal_force
        if not len(most) or not most.all():
            continue
        x, y = ridden.tangential_force / most, np.abs(ridden.spin_torque) / (law.spin_length * most)
        errors.append(float(np.abs(np.hypot(x, y) - 1.0).max()))
        of_slip = np.arctan2(law.spin_length * np.abs(ridden.slip[:, 1]), ridden.slip[:, 0])
        turned.append(float(np.degrees(np.abs(np.arctan2(y, x) - of_slip)).max()))
        if math.degrees(angle) < 80.0:  # there is a direction to speak of
            turned.append(float(np.degrees(np.abs(ridden.direction)).max()))
    return LimitSurface(max(errors), max(turned), min(touching))
