"""What goes over the wire of the arm: a line of text each, numbers in SI.

    v COUNT VX VY VZ WX WY WZ                                  to the arm: move so
    e COUNT                                                    to the arm: echo this, nothing else
    s CYCLE ECHO STOPPED X Y Z RX RY RZ VX VY VZ WX WY WZ      from the arm, every cycle

COUNT numbers what is sent to the arm, ECHO is the last one that it has taken; CYCLE numbers its cycles.
"""

from dataclasses import dataclass

from palpate.kinematics.pose import Pose, rotation_from_rotvec, rotvec_from_rotation
from palpate.spatial import Vector

CYCLE = 0.002
"""[s] from state to state."""

PORT = 40_000


@dataclass(frozen=True, slots=True)
class ArmState:
    """One state line.

    Attributes:
        cycle: Its number.
        echo: Of the last line that the arm has taken.
        stopped: Whether its own watchdog has stopped it.
        pose: Of the tip in the arm's base frame.
        velocity: Of the tip [m/s].
        angular_velocity: Likewise [rad/s].
    """

    cycle: int
    echo: int
    stopped: bool
    pose: Pose
    velocity: Vector
    angular_velocity: Vector

    def line(self) -> bytes:
        """As it is sent."""
        numbers = (
            *self.pose.position,
            *rotvec_from_rotation(self.pose.rotation),
            *self.velocity,
            *self.angular_velocity,
        )
        words = (f"{self.cycle} {self.echo} {self.stopped:d}", *(f"{x:.12g}" for x in numbers))
        return f"s {' '.join(words)}\n".encode()


def read_state(line: bytes) -> ArmState:
    """Return the state of a line.

    Raises:
        ValueError: It is none.
    """
    mark, cycle, echo, stopped, *numbers = line.split()
    x, y, z, rx, ry, rz, vx, vy, vz, wx, wy, wz = map(float, numbers)
    if mark != b"s":
        raise ValueError(f"{line[:40]!r} is no state")
    pose = Pose((x, y, z), rotation_from_rotvec((rx, ry, rz)))
    return ArmState(int(cycle), int(echo), bool(int(stopped)), pose, (vx, vy, vz), (wx, wy, wz))
