"""A stand: a carrier that never moves."""

from dataclasses import dataclass

import mujoco

from palpate.errors import InvalidValueError
from palpate.runtime.data import ArmSample
from palpate.sim.carriers.carrier import CarriedMass, refuse_to_turn
from palpate.spatial import IDENTITY, ZERO, Vector


@dataclass(frozen=True, slots=True)
class Fixed:
    """Fixed in the base frame. A `Carrier`."""

    def mount(self, spec: mujoco.MjSpec, load: CarriedMass, start: Vector) -> mujoco.MjsBody:
        """See `Carrier`."""
        return spec.worldbody.add_body(name="stand", pos=start)

    def add_sensors(self, spec: mujoco.MjSpec) -> None:
        """It needs none."""

    def drive(self, model: mujoco.MjModel, data: mujoco.MjData, period: float) -> "FixedDrive":
        """See `Carrier`."""
        return FixedDrive()


class FixedDrive:
    """Refuses to move. A `Drive`."""

    def start(self) -> None:
        """See `Drive`."""

    def begin(self, velocity: Vector, angular_velocity: Vector) -> None:
        """See `Drive`."""
        if velocity is not ZERO and any(velocity):
            raise InvalidValueError(
                f"velocity_base_tip = {velocity} m/s: a fixed carrier moves along nothing; leave it out, or "
                "take a robot that can"
            )
        refuse_to_turn(angular_velocity, "fixed carrier")

    def advance(self) -> None:
        """See `Drive`."""

    def sample(self, time: float, readings: list[float], force: Vector | None = None) -> ArmSample:
        """See `Drive`."""
        s = readings
        return ArmSample(time, (s[0], s[1], s[2]), IDENTITY, (s[3], s[4], s[5]), (), ZERO, force)

    def snapshot(self) -> tuple[float, ...]:
        """See `Drive`."""
        return ()

    def restore(self, state: tuple[float, ...]) -> None:
        """See `Drive`."""
