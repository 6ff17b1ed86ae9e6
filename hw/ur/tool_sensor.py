"""The force/torque sensor in the arm's flange, as a sensor of its own over the connection of the arm."""

import math

from palpate.hw.devices import SensorReading
from palpate.hw.ur.arm import UrArm
from palpate.kinematics.pose import rotation_from_rotvec
from palpate.spatial import rotate_back


class UrToolSensor:
    """Load on the tool about the TCP, tip frame, without the payload's weight (actual_TCP_force).

    The controller gives it with the axes of its base; here it is turned into those of the tip frame. A
    `SensorDevice`.
    """

    def __init__(self, arm: UrArm) -> None:
        """Take the arm, which is started and closed by its owner."""
        self._arm = arm

    @property
    def name(self) -> str:
        """Name for messages."""
        return f"tool sensor of the {self._arm.name}"

    def start(self) -> None:
        """Check that the arm sends states.

        Raises:
            DeviceError: If it is not started, or see `UrArm.state`.
        """
        self._arm.state()

    def read(self) -> SensorReading:
        """Return the newest load.

        Raises:
            DeviceError: See `UrArm.state`.
        """
        s = self._arm.state()
        fx, fy, fz, mx, my, mz = s.tool_wrench
        rx, ry, rz = s.tool_pose[3:]
        rotation_base_tip = rotation_from_rotvec((rx, ry, rz))
        force, moment = rotate_back(rotation_base_tip, (fx, fy, fz)), rotate_back(rotation_base_tip, (mx, my, mz))
        return SensorReading(s.time, force + moment, healthy=all(map(math.isfinite, s.tool_wrench)), lost=s.lost)

    def tare(self) -> None:
        """Let the controller take the present load for zero; the arm comes to rest before.

        Raises:
            DeviceError: If it refused.
        """
        self._arm.tare()

    def close(self) -> None:
        """Do nothing: the arm's owner closes it."""
