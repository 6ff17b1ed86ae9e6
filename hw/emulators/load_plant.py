"""The plant behind an emulated sensor alone: a load that follows a function of time."""

from collections.abc import Callable

from palpate.hw.emulators.plant import PlantState, ServoGoal
from palpate.runtime.data import ArmSample, WrenchSample
from palpate.spatial import IDENTITY, ZERO, Vector, Wrench

STANDING: Vector = (0.0, 0.0, 9.80665)
"""Specific force of a sensor that stands upright [m/s^2]."""


class LoadPlant:
    """Nothing moves, but what the sensor feels does. A `Plant`."""

    def __init__(self, load: Callable[[float], Wrench], period: float = 0.002) -> None:
        """Take the load.

        Args:
            load: From the time since the start [s] to what the sensor is to show [N, N m].
            period: From one look at it to the next [s].
        """
        self._load = load
        self._period = period
        self._steps = 0

    @property
    def period(self) -> float:
        """See `Plant`."""
        return self._period

    def start(self) -> PlantState:
        """See `Plant`."""
        self._steps = 0
        return self._state()

    def step(
        self, velocity_base_tip: Vector, angular_velocity_base_tip: Vector, servos: tuple[ServoGoal, ...]
    ) -> PlantState:
        """See `Plant`."""
        self._steps += 1
        return self._state()

    def close(self) -> None:
        """See `Plant`."""

    def _state(self) -> PlantState:
        time = self._steps * self._period
        arm = ArmSample(time, ZERO, IDENTITY, ZERO)
        return PlantState(time, arm, (WrenchSample(time, self._load(time), STANDING),))


STEADY_PERIOD = 0.01
"""[s]: what does not change need not be reported often."""


def steady_plant(load: Wrench) -> LoadPlant:
    """Return a plant whose load [N, N m] stays as it is."""
    return LoadPlant(lambda time: load, STEADY_PERIOD)
