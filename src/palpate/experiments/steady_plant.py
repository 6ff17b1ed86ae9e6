"""The plant behind an emulated sensor alone: a load that stays as it is."""

from palpate.hw.emulators.plant import PlantState, ServoGoal
from palpate.runtime.data import ArmSample, WrenchSample
from palpate.spatial import IDENTITY, ZERO, Vector, Wrench

UP: Vector = (0.0, 0.0, 9.80665)
"""Specific force of a sensor that stands [m/s^2]."""


class SteadyPlant:
    """Nothing moves. A `Plant`."""

    period = 0.01
    """[s]: what does not change need not be told often."""

    def __init__(self, load: Wrench) -> None:
        """Take what the sensor is to show [N, N m]."""
        self._load = load
        self._steps = 0

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
        time = self._steps * self.period
        arm = ArmSample(time, ZERO, IDENTITY, ZERO)
        return PlantState(time, arm, (WrenchSample(time, self._load, UP),))
