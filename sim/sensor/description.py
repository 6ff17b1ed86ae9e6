"""The sensor file that goes with a simulated sensor, so that both come from one source."""

import datetime

from palpate.errors import InvalidValueError, positive
from palpate.sensing.ft.filter_specs import FilterSpec
from palpate.sensing.ft.filters import WrenchFilter
from palpate.sensing.ft.sensor_file import ContactEntry, PayloadEntry, SensorFile, repeats
from palpate.sim.sensor.model import SensorModel

TOUCH_SIGMAS = 6.0
"""Of the filtered noise of an axis: more than `touch_detector.MIN_SIGMAS`; noise alone exceeds it once in 1e7
samples (chi law)."""

TOUCH_SAMPLES = 3
"""Of the device, in a row, for a touch and for its end."""


def sensor_file(
    model: SensorModel,
    period: float,
    *,
    payload: PayloadEntry | None = None,
    filters: tuple[FilterSpec, ...] = (),
    contact: ContactEntry | None = None,
    serial_number: str = "simulated",
    date: str | None = None,
) -> SensorFile:
    """Return what a user who has calibrated and tared this sensor would know of it.

    Its bias at temperature 0 is known; cross-talk, drift and random walk are not: they are what remains.

    `device_delay` is what controllers must reckon with, from the load to the reading of a period: lag of the
    bandwidth, latency, and half a sample of the device's clock.

    Args:
        model: The sensor.
        period: At which it is read [s]; its inverse is the sample rate of the file, for which filters are made.
        payload: What it carries; nothing if not given.
        filters: What its wrench passes.
        contact: When a force is a touch; `TOUCH_SIGMAS` above the filtered noise if not given.
        serial_number: For the file.
        date: As YYYY-MM-DD; today if not given.

    Raises:
        InvalidValueError: The sensor has no rated load or an axis without noise (what never changes passes for
            dead), or the file would not be one.
    """
    rate = 1.0 / positive("period", period, "s")
    if model.rated is None:
        raise InvalidValueError(
            f"{model.name} has no rated load: a sensor file needs one; give `rated`, or take `Finger` without"
        )
    # one that is about as fast as its reader has nothing to repeat
    slower = model.clock.rate if model.clock is not None and repeats(rate, model.clock.rate) > 1 else None
    noise = model.noise_sd
    if not min(noise) > 0.0:
        raise InvalidValueError(
            f"{model.name} has an axis without noise, {noise}: a reading that never changes is taken for a dead "
            "sensor; give it noise or quantisation"
        )
    if contact is None:
        gain = WrenchFilter(filters, rate).held_noise_gain(repeats(rate, slower))
        touch = TOUCH_SIGMAS * max(noise[:3]) * gain
        wait = (TOUCH_SAMPLES - 1) / (slower or rate)
        contact = ContactEntry(touch_force=touch, release_force=0.5 * touch, touch_time=wait, release_time=wait)
    return SensorFile(
        model=model.name,
        serial_number=serial_number,
        date=date or datetime.date.today().isoformat(),
        provenance=model.source,
        sample_rate=rate,
        device_rate=slower,
        device_delay=model.delay,
        force_range=model.rated[:3],
        moment_range=model.rated[3:],
        noise_force=noise[:3],
        noise_moment=noise[3:],
        bias_force=model.bias[:3],
        bias_moment=model.bias[3:],
        payload=payload or PayloadEntry(),
        filters=filters,
        contact=contact,
    )
