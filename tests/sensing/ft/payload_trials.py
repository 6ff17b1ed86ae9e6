"""Simulated payload identifications: how often the answer is as good as asked, and as good as it claims.

PYTHONPATH=tests .venv/bin/python -m sensing.ft.payload_trials [seeds]
"""

import sys
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.sensing.compensation import SensorPayload
from palpate.sensing.ft.payload import TWO_SIDED, identify_payload
from palpate.sensing.ft.poses import specific_force_from_rotations


@dataclass(frozen=True)
class Sensor:
    name: str
    payload: SensorPayload
    force_sd: float
    moment_sd: float
    center_limit: float


WRIST = Sensor(
    # Residuals of an ATI sensor on an arm, 100 static poses after least squares: 0.29 N and 1.25 mNm, rounded up.
    "1.5 kg on a wrist sensor, 0.3 N, 1.3 mNm",
    SensorPayload(1.5, (0.005, -0.012, 0.045)),
    0.3,
    1.3e-3,
    1e-3,
)
NANO17 = Sensor(
    # Resolution of ATI's Nano17, calibration SI-12-0.12, as one standard deviation: 1/320 N, 1/64 N mm.
    "30 g fingertip on a Nano17, 1/320 N, 1/64 Nmm",
    SensorPayload(0.030, (0.0005, 0.001, 0.018)),
    1 / 320,
    1e-3 / 64,
    2e-3,
)


def measured(sensor, specific_force, rng, noise=1.0):
    """Wrenches of the payload at rest, with a random bias, written out per pose."""
    bias = rng.normal(size=6) * [5.0, 5.0, 5.0, 0.1, 0.1, 0.1]
    weight = -sensor.payload.mass * specific_force
    moment = np.cross(sensor.payload.center_of_mass, weight)
    sd = np.repeat([sensor.force_sd, sensor.moment_sd], 3)
    return np.hstack([weight, moment]) + bias + noise * sd * rng.normal(size=(len(weight), 6)), bias


def trials(sensor, seeds, poses=24):
    """Rows: mass error / mass, centre error [m], mass in interval, each centre coordinate in interval, OK."""
    rows = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        up = specific_force_from_rotations(Rotation.random(poses, rng=rng).as_matrix())
        wrench, _ = measured(sensor, up, rng)
        found = identify_payload(up, wrench, force_sd=sensor.force_sd, moment_sd=sensor.moment_sd)
        true = np.array(sensor.payload.center_of_mass)
        inside = np.abs(found.payload.center_of_mass - true) <= TWO_SIDED * found.center_sd
        rows.append(
            [
                abs(found.payload.mass / sensor.payload.mass - 1.0),
                np.linalg.norm(found.payload.center_of_mass - true),
                abs(found.payload.mass - sensor.payload.mass) <= TWO_SIDED * found.mass_sd,
                *inside,
                found.verdict.ok,
            ]
        )
    return np.array(rows, dtype=float)


def main():
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    for sensor in (WRIST, NANO17):
        rows = trials(sensor, seeds)
        mass_error, center_error = rows[:, 0], rows[:, 1]
        sys.stdout.write(
            f"{sensor.name}, 24 random poses, {seeds} seeds\n"
            f"  mass within 2 %: {100 * (mass_error < 0.02).mean():.2f} %, worst {100 * mass_error.max():.2f} %, "
            f"in its 95 % interval {100 * rows[:, 2].mean():.1f} %\n"
            f"  centre within {1e3 * sensor.center_limit:g} mm: "
            f"{100 * (center_error < sensor.center_limit).mean():.2f} %, worst {1e3 * center_error.max():.3f} mm, "
            f"in its 95 % intervals {100 * rows[:, 3:6].mean():.1f} %\n"
            f"  verdict OK: {100 * rows[:, 6].mean():.1f} %\n"
        )


if __name__ == "__main__":
    main()
