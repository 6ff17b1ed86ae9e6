"""Two sensors with payloads, and what they show of them in static poses."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.sensing.compensation import SensorPayload
from palpate.sensing.ft.payload import identify_payload
from palpate.sensing.ft.poses import specific_force_from_rotations


@dataclass(frozen=True)
class Sensor:
    payload: SensorPayload
    force_sd: float
    moment_sd: float


# Residuals of an ATI sensor on an arm, 100 static poses after least squares: 0.29 N and 1.25 mNm, rounded up.
WRIST = Sensor(SensorPayload(1.5, (0.005, -0.012, 0.045)), 0.3, 1.3e-3)
# Resolution of ATI's Nano17, calibration SI-12-0.12, as one standard deviation: 1/320 N, 1/64 N mm.
NANO17 = Sensor(SensorPayload(0.030, (0.0005, 0.001, 0.018)), 1 / 320, 1e-3 / 64)


def poses(count, seed):
    """Specific forces of random poses."""
    return specific_force_from_rotations(Rotation.random(count, rng=np.random.default_rng(seed)).as_matrix())


def about(axis, angles):
    """Specific forces of poses turned about one axis."""
    return specific_force_from_rotations(Rotation.from_rotvec(np.outer(angles, axis)).as_matrix())


def measured(sensor, specific_force, rng, noise=1.0):
    """Wrenches of the payload at rest, with a random bias, written out per pose; and the bias."""
    bias = rng.normal(size=6) * [5.0, 5.0, 5.0, 0.1, 0.1, 0.1]
    weight = -sensor.payload.mass * specific_force
    moment = np.cross(sensor.payload.center_of_mass, weight)
    sd = np.repeat([sensor.force_sd, sensor.moment_sd], 3)
    return np.hstack([weight, moment]) + bias + noise * sd * rng.normal(size=(len(weight), 6)), bias


def identify(sensor, up, wrench):
    return identify_payload(up, wrench, force_sd=sensor.force_sd, moment_sd=sensor.moment_sd)
