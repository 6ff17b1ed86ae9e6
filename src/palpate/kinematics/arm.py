"""What a serial arm is: its geometry, its limits, its masses. Data only."""

import math
from dataclasses import dataclass

from palpate.errors import FloatArray, InvalidValueError, not_negative, positive, vector
from palpate.spatial import Vector


@dataclass(frozen=True, slots=True)
class DHRow:
    """One joint and link in standard (distal) Denavit-Hartenberg form.

    Frame i - 1 to frame i: Rz(q + offset) Tz(d) Tx(a) Rx(alpha); the joint turns about z of frame i - 1.

    Attributes:
        a: Link length [m].
        d: Link offset [m].
        alpha: Link twist [rad].
        offset: Of the joint angle [rad].
    """

    a: float
    d: float
    alpha: float
    offset: float = 0.0

    def __post_init__(self) -> None:
        vector("DH row (a, d, alpha, offset)", (self.a, self.d, self.alpha, self.offset), 4, "m, m, rad, rad")


@dataclass(frozen=True, slots=True)
class JointLimits:
    """What a joint may do.

    Attributes:
        lower: Least angle [rad].
        upper: Largest angle [rad].
        speed: Largest speed [rad/s].
        torque: Largest torque of its drive [N m].
    """

    lower: float
    upper: float
    speed: float
    torque: float

    def __post_init__(self) -> None:
        vector("joint range (lower, upper)", (self.lower, self.upper), 2, "rad")
        if not self.lower < self.upper:
            raise InvalidValueError(
                f"joint range: lower = {self.lower:g} rad must be below upper = {self.upper:g} rad"
            )
        positive("joint speed", self.speed, "rad/s")
        positive("joint torque", self.torque, "N m")


@dataclass(frozen=True, slots=True)
class LinkInertia:
    """Mass of a link, in its own DH frame (the one after its joint).

    Attributes:
        mass: [kg].
        center_of_mass: [m].
        inertia: About the centre of mass: xx, xy, xz, yy, yz, zz [kg m^2].
    """

    mass: float
    center_of_mass: Vector
    inertia: tuple[float, float, float, float, float, float]

    def __post_init__(self) -> None:
        not_negative("link mass", self.mass, "kg")
        vector("link center_of_mass", self.center_of_mass, 3, "m")
        vector("link inertia", self.inertia, 6, "kg m^2")


@dataclass(frozen=True, slots=True)
class SerialArm:
    """A chain of turning joints from its robot base (frame 0) to its flange (last frame).

    Attributes:
        name: For messages.
        rows: Geometry, from the robot base on.
        limits: One per joint.
        links: One per joint.
    """

    name: str
    rows: tuple[DHRow, ...]
    limits: tuple[JointLimits, ...]
    links: tuple[LinkInertia, ...]

    def __post_init__(self) -> None:
        counts = (len(self.rows), len(self.limits), len(self.links))
        if min(counts) < 1 or len(set(counts)) > 1:
            raise InvalidValueError(
                f"{self.name}: {counts[0]} rows, {counts[1]} limits, {counts[2]} links: give one of each per joint"
            )

    @property
    def joints(self) -> int:
        """How many joints it has."""
        return len(self.rows)

    def joint_position(self, name: str, value: tuple[float, ...] | FloatArray) -> tuple[float, ...]:
        """Return joint angles as floats if there is one per joint, each within its range [rad].

        Raises:
            InvalidValueError: Otherwise.
        """
        angles: list[float] = vector(name, value, self.joints, "rad").tolist()
        for i, (angle, limits) in enumerate(zip(angles, self.limits, strict=True)):
            if not limits.lower <= angle <= limits.upper:
                raise InvalidValueError(
                    f"{name}, joint {i + 1}, is {angle:.4f} rad ({math.degrees(angle):.1f} deg): its range is "
                    f"{limits.lower:.4f} to {limits.upper:.4f} rad"
                )
        return tuple(angles)
