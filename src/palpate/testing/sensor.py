"""Whether a force/torque sensor's driver is what a rig takes it for."""

from collections.abc import Callable, Sequence
from time import sleep

import numpy as np

from palpate.errors import FloatArray
from palpate.hw.devices import SensorDevice, SensorReading
from palpate.spatial import Wrench
from palpate.testing.devices import examine_clock, examine_device
from palpate.testing.nonconformity import Inspection
from palpate.testing.wrenches import examine_stamps, examine_wrenches

READINGS, BETWEEN = 200, 2e-3
"""Readings by which a sensor is judged, and the time between two [s]."""

OF_LOAD = 0.1
"""By which a reading may differ from a load that is known: order, sign and unit, not calibration."""

SIGMAS = 6.0
"""Standard deviations that a mean may differ besides."""

NOISE_FACTOR = 30.0
"""Times the declared noise, or part of it, that readings at rest may scatter: a factor of 1000 is another unit."""

ROUNDING = 1e-6
"""Of the declared noise: what scatters less has none, as some emulators."""


def check_sensor(make: Callable[[], SensorDevice], noise: Wrench, load: Wrench | None = None) -> None:
    """Check a force/torque sensor at rest: time stamps, units, order, tare, close, and what it raises.

    Args:
        make: Returns the device, not started. It is called once; the device is started twice.
        noise: Declared standard deviation of a reading at rest [N, N m], as in a robot file.
        load: What acts on its tip side meanwhile, in its own frame [N, N m], if that is known, as of a weight that
            hangs on it: the only thing by which an order or a sign can be told.

    Raises:
        ConformanceError: It breaks a rule.
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
    loud = scatter > NOISE_FACTOR * noise
    quiet = (scatter > ROUNDING * noise) & (scatter < noise / NOISE_FACTOR)
    inspection.require(
        not (loud | quiet).any(),
        "units by noise",
        f"readings at rest scatter by {_short(scatter)}, declared are {_short(noise)}",
        f"the same within a factor of {NOISE_FACTOR:g}",
        "newtons and newton metres, force before moment; or declare the noise that it has, and keep it at rest",
    )
    if load is not None:
        _examine_load(inspection, rows.mean(axis=0), noise, np.array(load))
    with inspection.part("tare"):
        device.tare()
        zero = np.mean([reading.wrench for reading in _taken(device)], axis=0)
        inspection.require(
            (np.abs(zero) <= SIGMAS * np.maximum(noise, scatter)).all(),
            "tare",
            f"after it, readings are {_short(zero)} in the mean",
            "0 within the noise",
            "subtract the mean of readings that came after the call",
        )


def _examine_load(inspection: Inspection, mean: FloatArray, noise: FloatArray, load: FloatArray) -> None:
    allowed = SIGMAS * noise + OF_LOAD * np.repeat([np.linalg.norm(load[:3]), np.linalg.norm(load[3:])], 3)
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
        f"{_short(load)} within {100.0 * OF_LOAD:g} %",
        fits[0] if fits else "force before moment, newtons and newton metres, the axes of its own frame",
    )


def _taken(device: SensorDevice) -> Sequence[SensorReading]:
    readings = []
    for _ in range(READINGS):
        readings.append(device.read())
        sleep(BETWEEN)
    return readings


def _short(values: FloatArray) -> list[float]:
    return [float(f"{value:.3g}") for value in values.tolist()]
