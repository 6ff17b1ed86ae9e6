"""The plant behind emulated devices unless an experiment hands in another: a tip, a plane, some servos."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from palpate.errors import InvalidValueError
from palpate.hw.emulators.plant import PlantState, ServoGoal
from palpate.hw.emulators.simple_servo import SimpleServo
from palpate.hw.emulators.simple_tip import SimpleTip
from palpate.spatial import Vector, Wrench

SILENT: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Noise of a sensor that has none."""


class SimplePlant:
    """A tip that may touch an elastic plane, and servos that know nothing of it."""

    def __init__(
        self,
        tip: SimpleTip | None = None,
        servos: tuple[SimpleServo, ...] = (),
        period: float = 0.002,
        noise: Sequence[Wrench] = (SILENT,),
    ) -> None:
        """Stand still at the start.

        Args:
            tip: What the arm carries; None: one with nothing in its reach.
            servos: Of the hand.
            period: Of a step [s]; 0.002 is the cycle of an e-Series controller.
            noise: Of each force/torque sensor behind the tip: standard deviation of a reading [N, N m].

        Raises:
            InvalidValueError: The period is not above zero.
        """
        if not 0.0 < period < 1.0:
            raise InvalidValueError(f"period = {period!r} s: must be between 0 and 1 s")
        self._period = period
        self._tip = SimpleTip() if tip is None else tip
        self._servos = servos
        self._steps = 0
        self._noise, self._random = np.array(noise), np.random.default_rng(0)

    @property
    def period(self) -> float:
        """Of a step [s]."""
        return self._period

    def start(self) -> PlantState:
        """Return what is there before the first step."""
        return self._state()

    def step(
        self, velocity_base_tip: Vector, angular_velocity_base_tip: Vector, servos: tuple[ServoGoal, ...]
    ) -> PlantState:
        """Go on by one period; servos without a goal stay as they are.

        Raises:
            InvalidValueError: There are more goals than servos.
        """
        if len(servos) > len(self._servos):
            raise InvalidValueError(
                f"{len(servos)} servo goals for a plant with {len(self._servos)} servos: give it more servos"
            )
        self._steps += 1
        self._tip.step(velocity_base_tip, angular_velocity_base_tip, self._period)
        for servo, goal in zip(self._servos, servos, strict=False):
            servo.step(goal, self._period)
        return self._state()

    def close(self) -> None:
        """Nothing to let go of."""

    def _state(self) -> PlantState:
        time = self._steps * self._period
        arm, felt = self._tip.measured(time)
        drawn = self._noise * self._random.standard_normal(self._noise.shape)
        wrenches = tuple(replace(felt, wrench=tuple(row)) for row in (drawn + felt.wrench).tolist())
        return PlantState(time, arm, wrenches, tuple(servo.state for servo in self._servos))
