"""Condition of a force/torque sensor: connect, measure at rest, disconnect."""

from collections.abc import Iterator
from time import monotonic, sleep

import numpy as np

from palpate.commands.doctor.watched import GLANCE, SLOW_SHARE, Watched, failure, timing_findings
from palpate.hw.devices import DeviceError, SensorDevice
from palpate.hw.finding import DeviceFinding, FindingVerdict, judged
from palpate.hw.rig import FingerSensor
from palpate.robots.finger_load import noise_of_finger
from palpate.robots.robot import Robot
from palpate.sensing.ft.arrays import AXES

NOISIER = 2.0
"""Largest ratio of measured noise to the sensor file's."""

UNITS = ("N",) * 3 + ("N m",) * 3


def sensor_findings(robot: Robot, i: int, finger: FingerSensor, seconds: float) -> Iterator[DeviceFinding]:
    """Start the sensor of finger i, and yield the findings on it.

    Args:
        robot: Supplies limits and the sensor's file.
        i: Number of the finger.
        finger: Its sensor.
        seconds: How long to watch it.
    """
    device = finger.device
    try:
        device.start()
        watched = _watched_sensor(device, seconds)
    except DeviceError as error:
        yield failure(device.name, error)
        return
    finally:
        device.close()
    yield from timing_findings(robot, device.name, watched)
    period, file = robot.file.period, robot.sensors[i]
    fix = f"its records repeat themselves: give device_rate_Hz: {watched.rate:.0f} in its sensor file"
    often = watched.rate * period >= SLOW_SHARE
    yield judged(
        device.name, "rate", watched.rate, "Hz", f"{1.0 / period:g}, the loop's", often, fix, FindingVerdict.NOTE
    )
    if file is not None:
        right = abs(file.sample_rate * period - 1.0) < 1e-6
        fix = f"write sample_rate_Hz: {1.0 / period:g}: it is read once per period, and filtered at that rate"
        yield judged(
            device.name, "sample_rate_Hz of its file", file.sample_rate, "Hz", f"{1.0 / period:g}", right, fix
        )
    yield from _noise(robot, i, device, watched)


def _noise(robot: Robot, i: int, device: SensorDevice, watched: Watched) -> Iterator[DeviceFinding]:
    expected = noise_of_finger(robot, i)
    raw = robot.sensors[i] is not None and robot.sensors[i].calibration is not None  # type: ignore[union-attr]
    sd = watched.values.std(axis=0, ddof=1)
    mean = watched.values.mean(axis=0)
    for k, axis in enumerate(AXES):
        unit = "" if raw else UNITS[k]
        fix = f"is something touched, or does it move? Else write {sd[k]:.2g} as its noise"
        yield judged(
            device.name,
            f"noise {axis}",
            float(sd[k]),
            unit,
            f"at most {NOISIER * expected[k]:.2g}",
            raw or sd[k] <= NOISIER * expected[k],
            fix,
        )
    for k, axis in enumerate(AXES):
        yield DeviceFinding(device.name, f"at rest {axis}", float(mean[k]), "" if raw else UNITS[k])
    if not (sd > 0.0).any():
        fix = "a reading that never changes is that of a dead sensor, unless it is an emulated one"
        yield DeviceFinding(device.name, "readings", "never change", "", "noise", FindingVerdict.NOTE, fix)


def _watched_sensor(device: SensorDevice, seconds: float) -> Watched:
    """Watch it.

    Raises:
        DeviceError: It is lost meanwhile.
    """
    first = device.read()
    times, ages, values, begin = [first.time], [], [first.wrench], monotonic()
    while monotonic() - begin < seconds:
        reading = device.read()
        ages.append(monotonic() - reading.time)
        if not reading.healthy:
            why = getattr(device, "problem", "") or "its status marks the reading as invalid"
            raise DeviceError(device.name, why, "take loads off, see its manual")
        if reading.time > times[-1]:
            times.append(reading.time)
            values.append(reading.wrench)
        sleep(GLANCE)
    if len(times) < 3:
        raise DeviceError(device.name, f"{len(times)} records in {seconds:g} s", "check its settings")
    return Watched(np.array(times), np.array(ages), np.array(values))
