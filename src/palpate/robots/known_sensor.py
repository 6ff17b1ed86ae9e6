"""The assumed model of a simulated sensor: its file, or its own description; tared on request.

A file that contradicts the simulation is refused: it would degrade force control without a visible cause.
"""

import msgspec

from palpate.errors import InvalidValueError
from palpate.robots.finger_sensor import KEY, without_bias
from palpate.robots.robot_file import FingerEntry
from palpate.robots.simulated_sensor_entry import SimulatedSensorEntry
from palpate.sensing.compensation import contact_wrench
from palpate.sensing.ft.arrays import AXES
from palpate.sensing.ft.bias import MIN_READINGS, average_bias
from palpate.sensing.ft.filters import WrenchFilter
from palpate.sensing.ft.sensor_file import SensorFile, repeats
from palpate.sensing.ft.sensor_updates import with_bias
from palpate.sensing.ft.touch_detector import MIN_SIGMAS
from palpate.sim.fidelity import GRAVITY
from palpate.sim.sensor.description import sensor_file
from palpate.sim.sensor.model import SeededSensor, SensorModel
from palpate.sim.sensor.simulation import simulated_sensor
from palpate.spatial import Vector, Wrench

UP: Vector = (0.0, 0.0, GRAVITY)
"""Specific force at rest, sensor frame [m/s^2]: simulated tips are held upright."""

NO_LOAD: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

OTHER_SEEDS = 2**64
"""Added to a run's seed, beyond all of those: what is drawn for the tare is not drawn again in the run."""


def tared(sensor: SensorFile, model: SensorModel, period: float, duration: float, seed: int) -> SensorFile:
    """Return a sensor file with the bias that was found at rest in free air, just before a run.

    What cross-talk makes of the payload's weight is part of it, as on a real sensor.

    Args:
        sensor: What is known so far.
        model: What is simulated.
        period: At which it is read [s].
        duration: For how long [s].
        seed: Of the run: the same seed gives the same tare.

    Raises:
        InvalidValueError: The readings do not rest, or the bias is beyond the sensor's range.
    """
    device = simulated_sensor(model, period, OTHER_SEEDS + seed)
    x, y, z, p, q, r = contact_wrench(NO_LOAD, UP, sensor.payload.payload)
    load: Wrench = (-x, -y, -z, -p, -q, -r)
    count = max(MIN_READINGS, round(duration / period))
    # before time 0, at which warm-up begins
    readings = [device.step((i - count) * period, load, UP).wrench for i in range(count)]
    noise = [max(pair) for pair in zip(sensor.noise, model.noise_sd, strict=True)]
    try:
        return with_bias(
            sensor,
            average_bias(readings, noise=noise),
            UP,
            date=sensor.date,
            provenance=f"{sensor.provenance}; tared over {count * period:g} s before the run"[:1000],
        )
    except InvalidValueError as error:
        raise InvalidValueError(f"fingers[0].simulated_sensor.tare_s = {duration:g}: {error}") from None


FILE = "fingers[0].sensor"
"""Where the robot file names the sensor file, for messages."""

TOUCH_SHARE = 0.002
"""Least force that is a touch, over the full load: what drift over a few kelvin and cross-talk of a payload's
weight leave of a zero must not be one (see `palpate.sim.sensor.presets.ZERO_DRIFT`)."""

SAME_RATE = 1e-9
"""Relative, between two numbers that people meant to be the same."""

SAME_DEVICE_RATE = 0.05
"""Relative: two clocks are never the same."""

SAME_DELAY = 0.1
"""Of the delay, or of the control period: less makes no difference to force control."""


def known_sensor(
    finger: FingerEntry, file: SensorFile | None, sensor: SeededSensor, period: float
) -> SensorFile | None:
    """Return what is known of a finger's simulated sensor.

    Args:
        finger: As in the robot file.
        file: Its sensor file, if it has one.
        sensor: What is simulated.
        period: At which it is read [s].

    Returns:
        The sensor file, tared if the robot file requests it; without one, a description of the simulated sensor
        that knows all but its bias, cross-talk and drift. None for a sensor that has but white noise, or none.

    Raises:
        InvalidValueError: The simulation would not show what is known.
    """
    entry, model = finger.simulated_sensor or SimulatedSensorEntry(), sensor.model
    if file is not None:
        check_known(file, model, period, tared=entry.tare > 0.0)
    known = described(finger, model, period) if file is None else file
    if known is None:
        return None
    _check_end(known, model, KEY if file is None else FILE)
    return tared(known, model, period, entry.tare, sensor.seed) if entry.tare else known


def described(finger: FingerEntry, model: SensorModel, period: float) -> SensorFile | None:
    """Return the description of a simulated sensor: all but its bias, cross-talk and drift.

    None for a sensor that has but white noise, or none.

    Raises:
        InvalidValueError: It cannot be described; the message names what to add.
    """
    if model.rated is not None:
        _check_alive(KEY, model)
        try:
            return _touching_above_zero_errors(sensor_file(without_bias(model), period, payload=finger.payload))
        except InvalidValueError as error:
            raise InvalidValueError(f"{KEY}: {error}") from None
    if model == SensorModel(model.name, model.source, noise=model.noise):
        return None
    raise InvalidValueError(
        f"{KEY}: no range: a sensor with more than noise needs one, as a sensor file has; give range "
        "(full load per axis), another preset, or sensor (a sensor file)"
    )


def _touching_above_zero_errors(file: SensorFile) -> SensorFile:
    """The same, with a touch of at least `TOUCH_SHARE`."""
    contact, least = file.contact, TOUCH_SHARE * min(file.force_range)
    if contact.touch_force >= least:
        return file
    higher = msgspec.structs.replace(contact, touch_force=least, release_force=0.5 * least)
    return msgspec.structs.replace(file, contact=higher)


def check_known(file: SensorFile, model: SensorModel, period: float, *, tared: bool) -> None:
    """Refuse a sensor file that contradicts the simulated sensor.

    Args:
        file: The sensor file.
        model: What is simulated.
        period: At which that is read [s].
        tared: Whether a bias of which the file knows nothing (zero) is found before the run.

    Raises:
        InvalidValueError: It does; the message names what to write.
    """
    if file.calibration is not None:
        raise InvalidValueError(
            f"{FILE}: calibration: a simulated sensor gives wrenches, not raw channels; leave it out"
        )
    for axis, known, true, noise in zip(AXES, file.bias, model.bias, file.noise, strict=True):
        if abs(known - true) > noise and not (tared and known == 0.0):
            raise InvalidValueError(
                f"{FILE}: bias of {axis} = {known:g}: the simulated sensor shows {true:g}; write that, or 0 and "
                "have it tared before the run (simulated_sensor: {tare_s: 1})"
            )
    if abs(file.sample_rate * period - 1.0) > SAME_RATE:
        raise InvalidValueError(
            f"{FILE}: sample_rate_Hz = {file.sample_rate:g}: a simulated sensor is read once per control "
            f"period, {period:g} s; write {1.0 / period:g}, or change period_s (--period); a slower device "
            "has a device_rate_Hz besides"
        )
    _check_clock(file, model)
    if abs(file.device_delay - model.delay) > SAME_DELAY * max(model.delay, period):
        raise InvalidValueError(
            f"{FILE}: device_delay_s = {file.device_delay:g}: the simulated sensor has {model.delay:.3g} (lag, "
            "latency, half a sample of its clock); write that"
        )
    _check_alive(FILE, model, file)
    force = max(model.noise_sd[:3]) * WrenchFilter(file.filters, file.sample_rate).held_noise_gain(file.repeats)
    if file.contact.touch_force < MIN_SIGMAS * force:
        raise InvalidValueError(
            f"{FILE}: contact: touch_force_N = {file.contact.touch_force:g}: the simulated sensor's noise, "
            f"{force:.3g} N after the filters, would pass for a touch; give at least {MIN_SIGMAS * force:.3g} "
            f"({MIN_SIGMAS:g} standard deviations), filter more, or simulate less noise"
        )


def _check_clock(file: SensorFile, model: SensorModel) -> None:
    slower = None
    if model.clock is not None and repeats(file.sample_rate, model.clock.rate) > 1:
        slower = model.clock.rate
    known = file.device_rate if file.repeats > 1 else None
    if slower == known or (slower and known and abs(known / slower - 1.0) <= SAME_DEVICE_RATE):
        return
    right = "as often as it is read; leave it out" if slower is None else f"{slower:g} times a second; write that"
    given = "left out" if known is None else f"= {known:g}"
    raise InvalidValueError(f"{FILE}: device_rate_Hz {given}: the simulated sensor samples {right}")


def _check_alive(where: str, model: SensorModel, file: SensorFile | None = None) -> None:
    """Refuse readings that never change: they are taken for those of a dead sensor."""
    if min(model.dithering) > 0.0:
        return
    steps = (0.0,) * 6 if model.quantisation is None else model.quantisation.step
    enough = file.noise if file is not None else steps
    raise InvalidValueError(
        f"{where}: a reading that never changes is taken for a dead sensor; give the simulated one some noise: "
        f"force_N: {max(enough[:3]):g}, moment_Nm: {max(enough[3:]):g} (--force-noise, --moment-noise)"
    )


def _check_end(known: SensorFile, model: SensorModel, where: str) -> None:
    """Refuse readings that end before an overload could be seen."""
    if model.saturation is None:
        return
    for axis, end, limit in zip(AXES, model.saturation.limit, known.axis_limits, strict=True):
        if end <= limit:
            raise InvalidValueError(
                f"{where}: range of {axis} = {limit:g}: the simulated sensor's readings end at {end:g}, so "
                "that an overload would not be seen; give a range below that, or let saturation begin above"
            )
