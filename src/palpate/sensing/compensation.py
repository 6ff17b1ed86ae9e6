"""Taking weight and inertia of the fingertip off a force/torque measurement."""

from dataclasses import dataclass

from palpate.errors import not_negative
from palpate.spatial import Vector, Wrench, cross, scale


@dataclass(frozen=True, slots=True)
class SensorPayload:
    """What is mounted on the tip side of a sensor.

    Attributes:
        mass: Its mass [kg].
        center_of_mass: In the sensor frame [m].
    """

    mass: float = 0.0
    center_of_mass: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        not_negative("mass", self.mass, "kg")


def contact_wrench(load: Wrench, acceleration: Vector, payload: SensorPayload) -> Wrench:
    """Return what the object exerts on the finger, from the load on the sensor's tip side.

    Newton for the payload, which does not turn: load = contact - m a, where a is the specific force that an
    accelerometer at the sensor shows (gravity included).

    Args:
        load: Measured wrench, sensor frame [N, N m].
        acceleration: Specific force at the sensor, sensor frame [m/s^2].
        payload: What hangs on the sensor.
    """
    return take_off(load, acceleration, payload.mass, payload.center_of_mass)


def take_off(load: Wrench, acceleration: Vector, mass: float, center_of_mass: Vector) -> Wrench:
    """Do the same for a mass [kg] and its centre [m], compiled too (`palpate.sensing.ft.compiled`)."""
    x, y, z = scale(mass, acceleration)
    u, v, w = cross(center_of_mass, (x, y, z))
    f0, f1, f2, m0, m1, m2 = load
    return (f0 + x, f1 + y, f2 + z, m0 + u, m1 + v, m2 + w)
