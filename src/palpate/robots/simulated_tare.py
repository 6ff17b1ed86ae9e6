"""What people do before a run: hold the fingertip in free air, and take the average reading for the bias."""

from palpate.errors import InvalidValueError
from palpate.sensing.compensation import contact_wrench
from palpate.sensing.ft.bias import MIN_READINGS, average_bias
from palpate.sensing.ft.sensor_file import SensorFile
from palpate.sensing.ft.sensor_updates import with_bias
from palpate.sim.fidelity import GRAVITY
from palpate.sim.sensor.model import SensorModel
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
