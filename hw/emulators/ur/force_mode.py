"""Force mode and freedrive: axes that are compliant, on top of whatever else the arm does."""

from dataclasses import dataclass

from palpate.hw.emulators.ur.arm import Twist, turned, turned_back
from palpate.kinematics.pose import Pose
from palpate.spatial import Vector, rotate_back

YIELDING = 0.002
"""[m/s per N]: pressing on 2 kN/m settles in 1 / (0.002 x 2000) = 0.25 s, and 50 kN/m is still stable with the
10 ms lag of the arm. The real controller's is not published."""

TURNING = 0.5
"""[rad/s per N m]: the same at a lever of 6 cm."""

FREE_SPEED = (0.25, 0.25, 0.25, 1.0, 1.0, 1.0)
"""[m/s, rad/s] at which freedrive lets itself be pushed at most; 250 mm/s is the limit of manual mode."""


@dataclass(frozen=True, slots=True)
class Compliance:
    """Which axes are compliant, and to what.

    Attributes:
        frame: pose_foot_task; its axes are those below.
        selected: Which axes are compliant.
        wrench: Wanted of the robot on what it touches [N, N m].
        limits: Largest speed along and about each axis [m/s, rad/s].
        scaling: Of the gain, 0 to 2.
    """

    frame: Pose
    selected: tuple[bool, ...]
    wrench: tuple[float, ...]
    limits: tuple[float, ...]
    scaling: float = 1.0

    def overlaid(self, twist: Twist, force: Vector, torque: Vector) -> Twist:
        """Return a twist with the axes replaced that are compliant.

        Args:
            twist: Of the TCP, axes of the robot base.
            force: On the tool [N], axes of the robot base, weight taken off.
            torque: The same about the TCP [N m].
        """
        linear, angular = turned_back(twist, self.frame)
        felt = rotate_back(self.frame.rotation, force) + rotate_back(self.frame.rotation, torque)
        given = list(linear + angular)
        for axis, gives_way in enumerate(self.selected):
            if gives_way:
                gain = self.scaling * (YIELDING if axis < 3 else TURNING)
                speed, limit = gain * (self.wrench[axis] + felt[axis]), abs(self.limits[axis])
                given[axis] = max(-limit, min(limit, speed))
        vx, vy, vz, wx, wy, wz = given
        return turned(((vx, vy, vz), (wx, wy, wz)), self.frame)
