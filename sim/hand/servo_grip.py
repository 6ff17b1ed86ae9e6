"""Servos of a hand in a simulated scene that take goals from outside, as a bus brings them, not grip forces."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco

from palpate.sim.hand.grip import Grip
from palpate.sim.hand.hand import Hand


@dataclass(frozen=True, slots=True)
class ShaftGoal:
    """What a servo's registers ask of it.

    Attributes:
        torque_on: Whether it drives; if not, it turns against its gear's friction alone.
        position: Of the shaft [rad], 0 where the finger's joint is 0.
        current: Largest [A].
        speed: Of the profile [rad/s]; 0: as fast as it can.
    """

    torque_on: bool
    position: float
    current: float
    speed: float


@dataclass(frozen=True, slots=True)
class ShaftState:
    """What a servo measures of itself.

    Attributes:
        position: Of the shaft [rad], 0 where the finger's joint is 0.
        velocity: [rad/s].
        current: [A], positive in the direction in which the finger closes.
    """

    position: float
    velocity: float
    current: float


class ServoGrip(Grip):
    """A `Grip` whose bus is somebody else's: it exchanges nothing by itself, and refuses grip forces."""

    def __init__(self, hand: Hand, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Take a hand in a scene; see `Grip`."""
        self._goals: tuple[ShaftGoal, ...] = ()
        super().__init__(hand, model, data)

    def start(self) -> None:
        """Stand still, open, torque off."""
        super().start()
        self._goals = ()
        for servo in self._servos:
            servo.write_goals(0.0, 0.0, 0.0)

    def take(self, goals: Sequence[ShaftGoal]) -> None:
        """Take goals, one per servo, until the next ones; those of a servo that has none stay as they are."""
        if tuple(goals) == self._goals:
            return
        self._goals = tuple(goals)
        for servo, goal in zip(self._servos, goals, strict=False):
            speed = goal.speed if goal.speed > 0.0 else servo.model.velocity_limit
            servo.write_goals(goal.position, goal.current if goal.torque_on else 0.0, speed)

    def states(self) -> tuple[ShaftState, ...]:
        """Return what the servos measure now."""
        ratio = self._ratio
        shafts = zip(self._servos, self._position.tolist(), self._velocity.tolist(), strict=True)
        return tuple(ShaftState(q / ratio, v / ratio, servo.current) for servo, q, v in shafts)

    def _write(self, positions: tuple[float, ...]) -> None:
        """Nothing: goals come from outside."""
