"""Two kinds of finger, the simplest that real Dynamixel hands are made of.

- `SlideFinger`: rack and pinion. Force is torque over the pinion's radius wherever it stands, and the tip never
  turns: for two fingers, whose tips shall stay opposite each other.
- `HingeFinger`: straight, on the servo's own horn. Nothing between servo and tip but one length: for three fingers
  around an object, where a rack each would not fit; force changes with the angle, and tips turn.
"""

import math
from dataclasses import dataclass, field

import mujoco

from palpate.errors import InvalidValueError, check_positive
from palpate.kinematics.servo_model import XL330_M288, XM430_W210, ServoModel
from palpate.spatial import Vector


@dataclass(frozen=True, slots=True)
class SlideFinger:
    """A finger on a rack, square to the hand's axis.

    Attributes:
        servo: What drives the pinion.
        pinion: Its radius [m].
        mass: Of rack and finger without tip [kg].
    """

    servo: ServoModel = XL330_M288
    pinion: float = 0.02
    mass: float = 0.03

    def __post_init__(self) -> None:
        check_positive(self, pinion="m", mass="kg")

    joint = mujoco.mjtJoint.mjJNT_SLIDE
    axis: Vector = field(default=(1.0, 0.0, 0.0), init=False)
    pivot: Vector = field(default=(0.0, 0.0, 0.0), init=False)

    @property
    def ratio(self) -> float:
        """Of the joint's motion to that of the servo's shaft [m/rad, or 1]: the pinion's radius."""
        return self.pinion

    def sensor_motion(self, q: float) -> tuple[float, float, float]:
        """Return how far sensor moved inwards and away from the palm [m], and turned [rad], at a coordinate."""
        return (q, 0.0, 0.0)

    def lever(self, q: float, tip_along: float) -> float:
        """Return the servo's torque per normal force [m] where the force is square to the hand's axis."""
        return self.pinion

    def closed(self, distance: float, tip_along: float) -> float:
        """Return the coordinate at which the tip's centre is this far [m] further in than at 0."""
        return distance


@dataclass(frozen=True, slots=True)
class HingeFinger:
    """A straight finger on the horn of its servo, parallel to the hand's axis at 0.

    Attributes:
        servo: What turns it.
        length: From the servo's axis to the sensor [m].
        mass: Of the finger without tip [kg].
    """

    servo: ServoModel = XM430_W210
    length: float = 0.07
    mass: float = 0.03

    def __post_init__(self) -> None:
        check_positive(self, length="m", mass="kg")

    joint = mujoco.mjtJoint.mjJNT_HINGE
    axis: Vector = field(default=(0.0, 1.0, 0.0), init=False)
    ratio: float = field(default=1.0, init=False)

    @property
    def pivot(self) -> Vector:
        """A point on that axis, in sensor coordinates [m]."""
        return (0.0, 0.0, -self.length)

    def sensor_motion(self, q: float) -> tuple[float, float, float]:
        """Return how far sensor moved inwards and away from the palm [m], and turned [rad], at a coordinate."""
        return (self.length * math.sin(q), -self.length * (1.0 - math.cos(q)), q)

    def lever(self, q: float, tip_along: float) -> float:
        """Return the servo's torque per normal force [m] where the force is square to the hand's axis."""
        return (self.length + tip_along) * math.cos(q)

    def closed(self, distance: float, tip_along: float) -> float:
        """Return the coordinate at which the tip's centre is this far [m] further in than at 0."""
        reach = self.length + tip_along
        if not distance < reach:
            raise InvalidValueError(
                f"length = {self.length:g} m: the finger cannot close by {distance:g} m; take a longer one"
            )
        return math.asin(distance / reach)


FingerJoint = SlideFinger | HingeFinger
"""Joint of a finger, in a plane through the hand's axis; its coordinate grows as the finger closes."""
