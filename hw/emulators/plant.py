"""What emulated devices move and measure: the seam between a wire and whatever is simulated behind it.

The built-in plant is simple; an experiment hands in a MuJoCo scene. Neither knows of the other.
"""

from dataclasses import dataclass
from typing import Protocol

from palpate.runtime.data import ArmSample, WrenchSample
from palpate.spatial import Vector


@dataclass(frozen=True, slots=True)
class ServoGoal:
    """What the control table of a servo asks of its motor (current-based position control).

    Attributes:
        torque_on: Whether it drives at all; if not, it turns freely but for its gear's friction.
        position: Goal of the shaft [rad], 0 in the middle of its turn.
        current: Largest, whatever its sign [A].
        speed: Of the profile towards the goal [rad/s]; 0: as fast as it can.
    """

    torque_on: bool
    position: float
    current: float
    speed: float


@dataclass(frozen=True, slots=True)
class ServoState:
    """What a servo measures of itself.

    Attributes:
        position: Of the shaft [rad], 0 in the middle of its turn.
        velocity: [rad/s].
        current: [A], with its sign.
    """

    position: float
    velocity: float
    current: float


@dataclass(frozen=True, slots=True)
class PlantState:
    """All that devices can measure at one instant.

    Attributes:
        time: Of the plant's clock [s].
        arm: Of the tool frame.
        wrenches: Of each force/torque sensor, as `WrenchSample` has them: in its own frame, load on its tip side.
        servos: Of each servo of the hand.
    """

    time: float
    arm: ArmSample
    wrenches: tuple[WrenchSample, ...] = ()
    servos: tuple[ServoState, ...] = ()


class Plant(Protocol):
    """Anything that can be moved and touched."""

    @property
    def period(self) -> float:
        """From one step to the next [s]."""
        ...

    def start(self) -> PlantState:
        """Begin, standing still."""
        ...

    def step(
        self, velocity_base_tip: Vector, angular_velocity_base_tip: Vector, servos: tuple[ServoGoal, ...]
    ) -> PlantState:
        """Go on by one period.

        Args:
            velocity_base_tip: Of the tool frame's origin, base frame [m/s].
            angular_velocity_base_tip: Of the tool frame, base frame [rad/s].
            servos: Goals of the hand's servos; empty without a hand.
        """
        ...

    def close(self) -> None:
        """Let go of what it holds."""
        ...
