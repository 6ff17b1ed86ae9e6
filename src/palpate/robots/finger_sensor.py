"""The simulated force/torque sensor behind a finger, as a robot file and an experiment want it."""

import math
from dataclasses import replace
from typing import Protocol

from palpate.errors import InvalidValueError
from palpate.robots.robot import Robot
from palpate.robots.robot_file import FingerEntry
from palpate.robots.simulated_sensor import model_of, with_noise
from palpate.sim.sensor.model import SeededSensor, SensorModel


class Pressing(Protocol):
    """The options of a configuration about pressing and about the sensor."""

    @property
    def tip(self) -> tuple[float, ...]:
        """Half lengths of the fingertip [m]."""
        ...

    @property
    def force(self) -> float:
        """Set normal force [N]."""
        ...

    @property
    def force_noise(self) -> float | None:
        """Standard deviation of the sensor's force noise, each axis [N]; None: the robot file's."""
        ...

    @property
    def moment_noise(self) -> float | None:
        """Likewise of its moments [N m]."""
        ...

    @property
    def period(self) -> float | None:
        """Of control [s]; None: the robot file's."""
        ...

    @property
    def seed(self) -> int:
        """Of the noise."""
        ...


KEY = "fingers[0].simulated_sensor"
"""Its key in the robot file, for messages."""

COARSEST = 0.1
"""Largest noise of where on the tip it touches, over the tip's smallest half length, of samples 1 ms apart: on a
sphere, that of the contact's direction in radians. Of samples further apart it weighs with the square root of
their distance, for it is their density that force control cannot filter away. MEASURED on the stage at 2 N and
20 mm/s (`benchmarks/explorations.py`): at this limit the force is off by an eighth of what is set; at three
times as much, with this check lifted, the tip got lost, filtered or not."""

DENSITY_TIME = 1e-3
"""[s] between the samples of `COARSEST`."""

UNLIKELY = 1e-6
"""Probability of more lost samples in a row than assumed: once in a quarter of an hour at 1 kHz."""


def model_of_finger(finger: FingerEntry) -> SensorModel:
    """Return the simulated sensor of a finger, as the robot file specifies.

    Raises:
        InvalidValueError: It cannot be.
    """
    try:
        return model_of(finger.simulated_sensor, finger.noise)
    except InvalidValueError as error:
        raise InvalidValueError(f"{KEY}: {error}") from None


def noise_of(model: SensorModel) -> tuple[float, float]:
    """Return the white noise of a sensor's force [N] and moment [N m], each on its noisiest axis."""
    return (0.0, 0.0) if model.noise is None else (max(model.noise.sd[:3]), max(model.noise.sd[3:]))


def model_with_noise(finger: FingerEntry, force: float | None, moment: float | None) -> SensorModel:
    """Return the simulated sensor of a finger with other white noise than the robot file's, where it is given.

    Args:
        finger: As the robot file has it.
        force: Standard deviation [N]; the robot file's if None.
        moment: Likewise [N m].

    Raises:
        InvalidValueError: It cannot be.
    """
    model = model_of_finger(finger)
    known = noise_of(model)
    wanted = (known[0] if force is None else force, known[1] if moment is None else moment)
    return model if wanted == known else with_noise(model, *wanted)


def sensor_for(robot: Robot, config: Pressing) -> SeededSensor:
    """Return the simulated sensor of a run.

    Noise in the configuration overrides the robot file's.

    Raises:
        InvalidValueError: It cannot be, or is too coarse for the set force and this fingertip.
    """
    finger = robot.file.fingers[0]
    model = model_with_noise(finger, config.force_noise, config.moment_noise)
    _check_fine_enough(finger, model, config, config.period or robot.file.period)
    return SeededSensor(model, config.seed)


def check_age(robot: Robot, model: SensorModel, period: float) -> None:
    """Refuse a sensor whose samples are older than the supervisor lets them be.

    Args:
        robot: Whose supervisor it is.
        model: What is simulated.
        period: At which it is read [s].

    Raises:
        InvalidValueError: They are.
    """
    limit, step = robot.file.limits.sample_age, period
    rate = None if model.clock is None else model.clock.rate
    if rate is not None:
        step = 1.0 / rate
    lost = 0 if model.dropouts is None else _lost_in_a_row(model.dropouts.probability)
    oldest = model.latency + step * (lost + (rate is not None))
    if oldest > limit:
        after = f", {lost} of them lost in a row" if lost else ""
        clock = f" and samples of {1e3 * step:.4g} ms{after}" if rate is not None or lost else ""
        raise InvalidValueError(
            f"limits.sample_age_s = {limit:g}: the simulated sensor's readings are up to {oldest:.3g} s old "
            f"(latency of {1e3 * model.latency:.4g} ms{clock}), and the supervisor would stop the robot; give "
            f"at least {1.01 * oldest:.3g}, or take a quicker sensor"
        )


def _lost_in_a_row(probability: float) -> int:
    return 0 if probability == 0.0 else math.ceil(math.log(UNLIKELY) / math.log(probability))


def _check_fine_enough(finger: FingerEntry, model: SensorModel, config: Pressing, period: float) -> None:
    """Refuse a sensor that does not feel where on the fingertip it touches."""
    between = period if model.clock is None else max(period, 1.0 / model.clock.rate)
    force, moment = max(model.noise_sd[:3]), max(model.noise_sd[3:])
    reach, smallest = math.hypot(*finger.surface.center) + max(config.tip), min(config.tip)
    # of where it touches, times the set force: a wrong force goes for a wrong lever, too [N m]
    lever = math.hypot(moment, reach * force) * math.sqrt(max(between / DENSITY_TIME, 1.0))
    limit = COARSEST * smallest * config.force
    if lever > limit:
        raise InvalidValueError(
            f"{model.name}: noise of {force:.3g} N and {moment:.3g} N m, {1.0 / between:g} samples per second, is "
            f"too coarse for a fingertip of {smallest:g} m at {config.force:g} N: it moves the contact by "
            f"{lever / config.force:.2g} m, {COARSEST * smallest:.2g} m is the limit; press with "
            f"{config.force * lever / limit:.2g} N or more (--force), take a finer sensor or a larger fingertip; "
            "a filter is no help"
        )


def without_bias(model: SensorModel) -> SensorModel:
    """Return the sensor without its bias."""
    return replace(model, bias=SensorModel().bias)
