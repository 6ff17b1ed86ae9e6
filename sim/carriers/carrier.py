"""What carries a fingertip in a scene: a stage, an arm."""

from typing import Protocol

import mujoco

from palpate.runtime.data import ArmSample
from palpate.sim.tip import Tip
from palpate.spatial import Vector


class Drive(Protocol):
    """Moves a carrier in a compiled scene; made by the carrier, one per run."""

    def start(self) -> None:
        """Hold it where it is."""
        ...

    def begin(self, velocity: Vector, angular_velocity: Vector) -> None:
        """Begin a control period.

        Args:
            velocity: With which the tip frame's origin is to move, base frame [m/s].
            angular_velocity: With which the tip frame is to turn, base frame [rad/s].

        Raises:
            InvalidValueError: It cannot turn.
        """
        ...

    def advance(self) -> None:
        """Move the servos' references by one time step; the simulation's step comes next."""
        ...

    def sample(self, time: float, readings: list[float]) -> ArmSample:
        """Return where the carrier was when the sensors were read.

        Args:
            time: Of the readings [s].
            readings: All sensors of the scene; those of the carrier's tip come first: position, velocity; its own
                come last, as many as `Carrier.add_sensors` has added.
        """
        ...

    def snapshot(self) -> tuple[float, ...]:
        """Return all that it remembers beside the simulation's own state."""
        ...

    def restore(self, state: tuple[float, ...]) -> None:
        """Go on from what `snapshot` returned."""
        ...


class Carrier(Protocol):
    """A machine that can be put into a scene."""

    def mount(self, spec: mujoco.MjSpec, tip: Tip, start: Vector) -> None:
        """Add itself, and the tip on it, to a scene: the tip frame upright, its origin at `start` [m]."""
        ...

    def add_sensors(self, spec: mujoco.MjSpec) -> None:
        """Add the sensors that its drive reads."""
        ...

    def inverse_mass(self, spec: mujoco.MjSpec, tip: Tip) -> float:
        """Return the tip body's translational `body_invweight0` at the start [1/kg]."""
        ...

    def drive(self, model: mujoco.MjModel, data: mujoco.MjData, period: float) -> Drive:
        """Return what moves it, for a control period [s]."""
        ...
