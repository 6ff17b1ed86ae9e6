"""A force/torque sensor at work in a simulation: loads in, samples out."""

import math
from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from palpate.compiling import machine_code
from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.runtime.data import WrenchSample
from palpate.sim.sensor import kernel
from palpate.sim.sensor.draws import DrawState, SensorDraws
from palpate.sim.sensor.model import SensorModel
from palpate.sim.sensor.stages import FirstOrderLag, SecondOrderLag
from palpate.sim.sensor.temperature import TemperatureProfile, WarmUp
from palpate.spatial import Vector, Wrench

_NOT_STARTED = math.nan
"""Time of a sensor that was never read."""

_SPARE = 4
"""Places in the queue beyond what latency and clock need: for the present load, and for rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class SensorState:
    """All that a simulated sensor remembers, opaque; to be kept together with the state of its scene.

    Attributes:
        model: Of the sensor.
        memory: See `palpate.sim.sensor.kernel`.
        draws: Of its generators.
    """

    model: SensorModel
    memory: FloatArray
    draws: DrawState | None


def simulated_sensor(model: SensorModel, period: float, seed: int = 0) -> "WrenchSensor":
    """Return a sensor that is ready to run; everything slow happens here.

    Args:
        model: What it is made of.
        period: At which it will be given loads [s]: the control period, or a time step for more detail.
        seed: Of its random numbers.

    Raises:
        InvalidValueError: The period is not above 0, or the seed is negative.
    """
    return PerfectSensor(model) if model.is_perfect else ImperfectSensor(model, period, seed)


class PerfectSensor:
    """Shows every load as it is."""

    def __init__(self, model: SensorModel | None = None) -> None:
        """Take its name, for `state`."""
        self._model = model or SensorModel()

    def restart(self, seed: int) -> None:
        """It remembers nothing."""

    def step(self, time: float, wrench: Wrench, acceleration: Vector) -> WrenchSample:
        """Take the load at a time, and return what the device says then."""
        return WrenchSample(time, wrench, acceleration)

    def state(self) -> SensorState:
        """Return a copy of all that it remembers."""
        return SensorState(self._model, np.empty(0), None)

    def set_state(self, state: SensorState) -> None:
        """Go on from a state, bit for bit as from there before."""
        _check_model(self._model, state)


class ImperfectSensor:
    """A sensor as its `SensorModel` describes it.

    The load at its first step is taken for what was there for ever. Its first sample may be stamped before that,
    by the latency and up to a period of its clock, and is never lost.
    """

    def __init__(self, model: SensorModel, period: float, seed: int = 0) -> None:
        """See `simulated_sensor`."""
        self.model = model
        self.period = positive("period", period, "s")
        waits = model.latency + (0.0 if model.clock is None else 1.0 / model.clock.rate)
        room = math.ceil(waits / period) + _SPARE
        self._draws = SensorDraws(model, seed)
        self._fixed = _constants(model, self._draws.needed)
        self._memory = np.zeros(kernel.QUEUE + kernel.QUEUE_WIDTH * room)
        # a view that lives as long as the memory
        self._reading = self._memory[kernel.READING : kernel.READING + kernel.READING_WIDTH]
        self._end = np.empty(kernel.CHANNELS)
        self._advance = machine_code(
            kernel.advance,
            *(0.0,) * (1 + kernel.CHANNELS),
            self._fixed,
            self._memory,
            self._draws.block,
            self._end,
        )
        self.restart(seed)

    def restart(self, seed: int) -> None:
        """Forget everything; the same seed gives the same samples."""
        self._draws.restart(seed)
        self._memory[:] = 0.0
        self._memory[kernel.LAST_TIME] = _NOT_STARTED
        self._sample = self._shown()

    def step(self, time: float, wrench: Wrench, acceleration: Vector) -> WrenchSample:
        """Take the load at a time, and return the device's sample; without a fresh one, the same object as before.

        Args:
            time: Later than at the step before [s].
            wrench: Load on the sensor's tip side, in its frame [N, N m].
            acceleration: Specific force at its origin [m/s^2].

        Raises:
            InvalidValueError: The time is not later than before, or steps come so much closer together than the
                period that the load of the latency cannot be kept.
        """
        found = self._advance(
            time, *wrench, *acceleration, self._fixed, self._memory, self._draws.block, self._end
        )
        if found == kernel.FRESH:
            self._sample = self._shown()
        elif found != kernel.REPEATED:
            if found != kernel.OUT_OF_DRAWS:
                self._refuse(found, time)
            self._draws.draw()
            self._memory[kernel.NEXT_DRAW] = 0.0
            return self.step(time, wrench, acceleration)
        return self._sample

    def state(self) -> SensorState:
        """Return a copy of all that it remembers."""
        return SensorState(self.model, self._memory.copy(), self._draws.state())

    def set_state(self, state: SensorState) -> None:
        """Go on from a state, bit for bit as from there before."""
        _check_model(self.model, state)
        if state.memory.shape != self._memory.shape or state.draws is None:
            raise InvalidValueError(
                f"the state holds {state.memory.size} numbers, this sensor {self._memory.size}: must come from a "
                "sensor with the same period"
            )
        self._draws.set_state(state.draws)
        self._memory[:] = state.memory
        self._sample = self._shown()

    def _shown(self) -> WrenchSample:
        stamp, a, b, c, d, e, f, x, y, z = self._reading.tolist()
        return WrenchSample(stamp, (a, b, c, d, e, f), (x, y, z))

    def _refuse(self, found: int, time: float) -> NoReturn:
        last = float(self._memory[kernel.LAST_TIME])
        if found == kernel.NOT_LATER:
            raise InvalidValueError(f"time = {time!r} s: must be later than at the step before, {last!r} s")
        raise InvalidValueError(
            f"time = {time:g} s, {time - last:g} s after the step before: steps come closer together than the "
            f"period of {self.period:g} s that this sensor was made for; make it for the shortest one"
        )


WrenchSensor = PerfectSensor | ImperfectSensor
"""A simulated sensor."""


def _check_model(model: SensorModel, state: SensorState) -> None:
    if state.model != model:
        raise InvalidValueError(
            f"the state is of another sensor, {state.model.name}: must be of {model.name} with the same "
            "imperfections"
        )


def _constants(model: SensorModel, random: bool) -> FloatArray:
    """Pack a model as the kernel reads it."""
    profile: tuple[float, ...] = ()
    fixed = np.zeros(kernel.PROFILE + 1)
    match model.bandwidth:
        case FirstOrderLag(cutoff):
            fixed[kernel.LAG], fixed[kernel.RATE] = 1.0, 2.0 * math.pi * cutoff
        case SecondOrderLag(frequency, damping):
            fixed[kernel.LAG], fixed[kernel.RATE] = 2.0, 2.0 * math.pi * frequency
            fixed[kernel.DAMPING] = damping
    fixed[kernel.LATENCY] = model.latency
    if model.clock is not None:
        fixed[kernel.CLOCK_RATE], fixed[kernel.CLOCK_OFFSET] = model.clock.rate, model.clock.offset
    if model.dropouts is not None and model.dropouts.probability > 0.0:
        fixed[kernel.LOG_LOSS] = math.log(model.dropouts.probability)
    fixed[kernel.RANDOM] = float(random)
    fixed[kernel.BIAS : kernel.BIAS + 6] = model.bias
    if model.thermal_drift is not None:
        fixed[kernel.PER_KELVIN : kernel.PER_KELVIN + 6] = model.thermal_drift.per_kelvin
        match model.thermal_drift.temperature:
            case WarmUp(rise, time_constant):
                fixed[kernel.TEMPERATURE] = 1.0
                fixed[kernel.WARM_RISE], fixed[kernel.WARM_TIME] = rise, time_constant
            case TemperatureProfile(times, rises):
                fixed[kernel.TEMPERATURE] = 2.0
                fixed[kernel.PROFILE] = len(times)
                profile = (*times, *rises)
    if model.noise is not None:
        fixed[kernel.SD : kernel.SD + 6] = model.noise.sd
    if model.random_walk is not None:
        fixed[kernel.WALK_RATE : kernel.WALK_RATE + 6] = model.random_walk.rate
    if model.quantisation is not None:
        fixed[kernel.QUANTISED] = 1.0
        fixed[kernel.STEP : kernel.STEP + 6] = model.quantisation.step
    fixed[kernel.LIMIT : kernel.LIMIT + 6] = math.inf if model.saturation is None else model.saturation.limit
    if model.cross_talk is not None:
        fixed[kernel.MIXED] = 1.0
        fixed[kernel.MATRIX : kernel.MATRIX + 36] = np.array(model.cross_talk.matrix).ravel()
    return np.append(fixed, profile)
