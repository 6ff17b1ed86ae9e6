"""What carries a fingertip or a hand in a scene: a stage, an arm, a lift, or a stand that never moves."""

from typing import Protocol

import mujoco

from palpate.errors import InvalidValueError
from palpate.runtime.data import ArmSample
from palpate.spatial import ZERO, Vector


class CarriedMass(Protocol):
    """Payload of a carrier, in the two quantities that a robot's controller asks for."""

    @property
    def mass(self) -> float:
        """Of all of it [kg]."""
        ...

    @property
    def center_of_mass(self) -> Vector:
        """In its own frame, by which it is carried; that of a hand with all joints at 0 [m]."""
        ...


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
            InvalidValueError: It cannot move so.
        """
        ...

    def advance(self) -> None:
        """Move the servos' references by one time step; the simulation's step comes next."""
        ...

    def sample(self, time: float, readings: list[float], force: Vector | None = None) -> ArmSample:
        """Return where the carrier was when the sensors were read.

        Args:
            time: Of the readings [s].
            readings: All sensors of the scene; those of the carried frame come first: position, velocity; its own
                come last, as many as `Carrier.add_sensors` has added.
            force: That the machine measures on the frame, in its coordinates [N]; None: it measures none.
        """
        ...

    def snapshot(self) -> tuple[float, ...]:
        """Return all that it remembers beside the simulation's own state."""
        ...

    def restore(self, state: tuple[float, ...]) -> None:
        """Go on from what `snapshot` returned."""
        ...


class Carrier(Protocol):
    """A machine that can be put into a scene. It carries one frame, `tip` for short: a fingertip's or a hand's."""

    def mount(self, spec: mujoco.MjSpec, load: CarriedMass, start: Vector) -> mujoco.MjsBody:
        """Add itself to a scene; comes before anything else that moves.

        Args:
            spec: The scene.
            load: What it is to carry: it lifts that weight, too.
            start: Where the load's frame starts, upright, base frame [m].

        Returns:
            The body whose frame is the load's, for the load to be put on.
        """
        ...

    def add_sensors(self, spec: mujoco.MjSpec) -> None:
        """Add the sensors that its drive reads; comes last of all sensors."""
        ...

    def drive(self, model: mujoco.MjModel, data: mujoco.MjData, period: float) -> Drive:
        """Return what moves it, for a control period [s]."""
        ...


def refuse_to_turn(angular_velocity: Vector, carrier: str) -> None:
    """Refuse any angular velocity [rad/s] but zero, in the name of a carrier that cannot turn.

    Raises:
        InvalidValueError: It is another.
    """
    if angular_velocity is not ZERO and any(angular_velocity):
        raise InvalidValueError(
            f"angular_velocity_base_tip = {angular_velocity} rad/s: this {carrier} cannot turn its tip; leave it "
            "out, or take a robot that can"
        )
