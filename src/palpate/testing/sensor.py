"""Check of a force/torque sensor's driver."""

from collections.abc import Callable, Sequence
from time import sleep

import numpy as np

from palpate.errors import FloatArray
from palpate.hw.devices import SensorDevice, SensorReading
from palpate.spatial import Wrench
from palpate.testing.devices import examine_clock, examine_device
from palpate.testing.nonconformity import Inspection
from palpate.testing.wrenches import examine_stamps, examine_wrenches

READING_COUNT, READ_INTERVAL = 200, 2e-3
"""Number of readings in each part of the check, and the time between two [s]."""

MAX_LOAD_ERROR = 0.1
"""Largest relative difference between a reading and a known load: finds order, sign and unit, not calibration."""

MAX_SIGMAS = 6.0
"""Largest further difference of a mean, in standard deviations."""

MAX_NOISE_RATIO = 30.0
"""Largest ratio of measured to declared noise, and of declared to measured noise: 1000 means another unit."""

MIN_NOISE_RATIO = 1e-6
"""Smallest ratio of measured to declared noise: below, the sensor has no noise, as some emulators."""


def check_sensor(make: Callable[[], SensorDevice], noise: Wrench, load: Wrench | None = None) -> None:
    """Check a force/torque sensor at rest: time stamps, units, order, tare, close, and exceptions.

    Args:
        make: Function that returns the device, not started. It is called once; the device is started twice.
        noise: Declared standard deviation of a reading at rest [N, N m], as in a robot file.
        load: Known load on its tip side during the check, sensor frame [N, N m], such as a hanging weight. Without
            a load, order and sign of the axes cannot be checked.

    Raises:
        ConformanceError: If the sensor breaks a rule.
    """
    examine_device(make, lambda inspection, device: _examine_readings(inspection, device, np.array(noise), load))


def _examine_readings(
    inspection: Inspection, device: SensorDevice, noise: FloatArray, load: Wrench | None
) -> None:
    readings = _taken(device)
    if not examine_wrenches(inspection, [reading.wrench for reading in readings]):
        return
    examine_clock(inspection, device.read)
    examine_stamps(inspection, "readings", [(reading.time, reading.wrench) for reading in readings])
    lost = [reading.lost for reading in readings]
    inspection.require(
        all(isinstance(reading.healthy, bool) for reading in readings) and lost == sorted(lost) and lost[0] >= 0,
        "health",
        f"healthy = {readings[-1].healthy!r}, lost from {lost[0]} to {lost[-1]}",
        "a bool, and a count of lost records that never falls",
        "count from the start of the stream",
    )
    rows = np.array([reading.wrench for reading in readings])
    scatter = rows.std(axis=0)
    loud = scatter > MAX_NOISE_RATIO * noise
    quiet = (scatter > MIN_NOISE_RATIO * noise) & (scatter < noise / MAX_NOISE_RATIO)
    inspection.require(
        not (loud | quiet).any(),
        "units by noise",
        f"readings at rest scatter by {_short(scatter)}, declared are {_short(noise)}",
        f"the same within a factor of {MAX_NOISE_RATIO:g}",
        "newtons and newton metres, force before moment; or declare the noise that it has, and keep it at rest",
    )
    if load is not None:
        _examine_load(inspection, rows.mean(axis=0), noise, np.array(load))
    with inspection.part("tare"):
        device.tare()
        zero = np.mean([reading.wrench for reading in _taken(device)], axis=0)
        inspection.require(
            (np.abs(zero) <= MAX_SIGMAS * np.maximum(noise, scatter)).all(),
            "tare",
            f"after it, readings are {_short(zero)} in the mean",
            "0 within the noise",
            "subtract the mean of readings that came after the call",
        )


def _examine_load(inspection: Inspection, mean: FloatArray, noise: FloatArray, load: FloatArray) -> None:
    allowed = MAX_SIGMAS * noise + MAX_LOAD_ERROR * np.repeat(
        [np.linalg.norm(load[:3]), np.linalg.norm(load[3:])], 3
    )
    if (np.abs(mean - load) <= allowed).all():
        return
    guesses = {
        "the moment stands before the force": np.roll(load, 3),
        "the sign is that of what the sensor exerts: give what acts on its tip side": -load,
        "moments are in N mm: divide by 1000": load * np.repeat([1.0, 1e3], 3),
        "forces are in mN or moments in N mm": load * 1e3,
    }
    fits = [
        text for text, guess in guesses.items() if np.allclose(mean, guess, rtol=0.2, atol=0.2 * abs(guess).max())
    ]
    inspection.require(
        False,
        "load",
        f"{_short(mean)} N, N m",
        f"{_short(load)} within {100.0 * MAX_LOAD_ERROR:g} %",
        fits[0] if fits else "force before moment, newtons and newton metres, the axes of its own frame",
    )


def _taken(device: SensorDevice) -> Sequence[SensorReading]:
    readings = []
    for _ in range(READING_COUNT):
        readings.append(device.read())
        sleep(READ_INTERVAL)
    return readings


def _short(values: FloatArray) -> list[float]:
    return [float(f"{value:.3g}") for value in values.tolist()]
