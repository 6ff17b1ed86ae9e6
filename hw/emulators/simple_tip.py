"""A tip that follows velocities with a lag, and an elastic plane that it may touch."""

import math
from dataclasses import dataclass, field

from palpate.errors import InvalidValueError, not_negative, positive
from palpate.kinematics.pose import Pose, checked_pose, orthonormal, rotation_from_rotvec, times
from palpate.runtime.data import ArmSample, WrenchSample
from palpate.spatial import ZERO, Vector, add, add_scaled, rotate_back, scale

GRAVITY = 9.81
"""[m/s^2]: what an accelerometer at rest feels upwards."""


@dataclass(frozen=True, slots=True)
class ElasticPlane:
    """A horizontal plane without friction that pushes the tip's origin upwards.

    Attributes:
        height: At which it begins [m], base frame.
        stiffness: [N/m].
        damping: [N s/m]; it never pulls.
    """

    height: float
    stiffness: float = 2000.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.height):
            raise InvalidValueError(f"height = {self.height!r} m: must be finite; for no plane give none")
        positive("stiffness", self.stiffness, "N/m")
        not_negative("damping", self.damping, "N s/m")

    def force(self, height: float, speed: float) -> float:
        """Return how hard it pushes [N] a point at a height [m] that rises with a speed [m/s]."""
        depth = self.height - height
        if depth <= 0.0:
            return 0.0
        return max(0.0, self.stiffness * depth - self.damping * speed)


def _hanging() -> Pose:
    """Over the work place of a UR5e, z down: where it is with joints -90, -90, 90, -90, -90, 0 deg and no tool."""
    return Pose((-0.1333, 0.4919, 0.4879), ((0.0, -1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))


@dataclass(slots=True, eq=False)
class SimpleTip:
    """What moves; the sensor sits in the tip frame and weighs nothing.

    Attributes:
        pose_base_tip: Where it is; before the first step, where it starts.
        plane: What it may touch; None for nothing.
        lag: Time constant with which velocities follow [s]; that of a UR e-Series is about 10 ms [A].
    """

    pose_base_tip: Pose = field(default_factory=_hanging)
    plane: ElasticPlane | None = None
    lag: float = 0.01
    _velocity: Vector = field(default=ZERO, init=False)
    _turning: Vector = field(default=ZERO, init=False)

    def __post_init__(self) -> None:
        checked_pose("pose_base_tip", self.pose_base_tip)
        not_negative("lag", self.lag, "s")

    def step(self, velocity: Vector, angular_velocity: Vector, period: float) -> None:
        """Go on by a period [s] with what the arm is asked for [m/s, rad/s]."""
        # exact for a first-order lag whose input is held
        share = 1.0 if self.lag == 0.0 else -math.expm1(-period / self.lag)
        before, turning = self._velocity, self._turning
        self._velocity = _towards(before, velocity, share)
        self._turning = _towards(turning, angular_velocity, share)
        pose = self.pose_base_tip
        step = scale(0.5 * period, add(before, self._velocity))
        turn = scale(0.5 * period, add(turning, self._turning))
        rotation = orthonormal(times(rotation_from_rotvec(turn), pose.rotation))
        self.pose_base_tip = Pose(add(pose.position, step), rotation)

    def measured(self, time: float) -> tuple[ArmSample, WrenchSample]:
        """Return what arm and sensor say at a time [s]."""
        pose = self.pose_base_tip
        arm = ArmSample(
            time, pose.position, pose.rotation, self._velocity, angular_velocity_base_tip=self._turning
        )
        push = 0.0
        if self.plane is not None:
            push = self.plane.force(pose.position[2], self._velocity[2])
        force = rotate_back(pose.rotation, (0.0, 0.0, push))
        up = rotate_back(pose.rotation, (0.0, 0.0, GRAVITY))
        return arm, WrenchSample(time, (*force, 0.0, 0.0, 0.0), up)


def _towards(a: Vector, b: Vector, share: float) -> Vector:
    """Interpolate linearly between a and b."""
    return add_scaled(scale(1.0 - share, a), share, b)
