"""Sensors that tests of calibration and of sensor files start from."""

import numpy as np

from palpate.sensing.ft.filter_specs import Butterworth, CriticallyDamped, FirstOrder, Notch
from palpate.sensing.ft.sensor_file import CalibrationEntry, ContactEntry, PayloadEntry, SensorFile

RANGES = np.array([12.0, 12.0, 17.0, 0.12, 0.12, 0.12])


def linear_sensor(channels, rng, condition=3.0):
    """Sensitivity of a sensor, with the given condition number in units of its ranges; and an offset."""
    left = np.linalg.qr(rng.normal(size=(channels, 6)))[0]
    right = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    return (left * np.geomspace(1.0, 1.0 / condition, 6)) @ right / RANGES, rng.normal(size=channels)


def known_loads(count, rng):
    """Loads of up to half of the ranges, in all directions."""
    return RANGES * rng.uniform(-0.5, 0.5, (count, 6))


def matrix(channels, seed=0):
    """A well-conditioned calibration matrix for ranges of about 10 N and 0.1 N m at 5 V."""
    rng = np.random.default_rng(seed)
    rows = np.linalg.qr(rng.normal(size=(channels, 6)))[0].T * np.repeat([2.0, 0.02], 3)[:, None]
    return tuple(map(tuple, rows.tolist()))


def fingertip(channels=6):
    """A small raw-channel sensor with everything in it."""
    return SensorFile(
        model="ATI Nano17 SI-12-0.12",
        serial_number="0012345",
        date="2026-11-21",
        provenance="25 known loads, µN balance; payload from 24 poses",
        sample_rate=1000.0,
        device_delay=0.0005,
        force_range=(12.0, 12.0, 17.0),
        moment_range=(0.12, 0.12, 0.12),
        noise_force=(1 / 320, 1 / 320, 1 / 320),
        noise_moment=(1e-3 / 64, 1e-3 / 64, 1e-3 / 64),
        bias_force=(0.1, -0.2, 1 / 3),
        bias_moment=(1e-3, 0.0, -2e-4),
        payload=PayloadEntry(mass=0.030, center_of_mass=(0.0005, 0.001, 0.018)),
        filters=(Butterworth(100.0), Notch(50.0, 5.0), CriticallyDamped(400.0), FirstOrder(450.0)),
        contact=ContactEntry(touch_force=0.1, release_force=0.05, touch_time=0.003, release_time=0.002),
        calibration=CalibrationEntry(
            raw_unit="V",
            matrix=matrix(channels),
            offset=tuple(0.01 * k for k in range(channels)),
            raw_range=(-5.0, 5.0),
            condition=3.7,
        ),
    )
