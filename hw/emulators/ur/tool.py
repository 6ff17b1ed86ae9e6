"""What the controller makes of its force/torque sensor: the load's weight taken off, zeroed, about the TCP."""

from palpate.hw.emulators.ur.arm import NO_WRENCH, Arm
from palpate.spatial import Vector, Wrench, cross, rotate, rotate_back, scale, subtract

GRAVITY = 9.82
"""[m/s^2]: what a UR controller takes for it, upwards, until set otherwise [A]."""


class Tool:
    """The load on the flange and the sensor's zero.

    Attributes:
        mass: Of the load, as a client says [kg].
        center: Its centre of mass, flange frame [m].
        inertia: Its inertia, as a client sets it [kg m^2]; only reported back.
        gravity: Acceleration that holds the robot base up, axes of the robot base [m/s^2].
    """

    def __init__(self) -> None:
        """Carry nothing."""
        self.mass = 0.0
        self.center: Vector = (0.0, 0.0, 0.0)
        self.inertia: tuple[float, ...] = (0.0,) * 6
        self.gravity: Vector = (0.0, 0.0, GRAVITY)
        self._zero = NO_WRENCH

    def zero(self, arm: Arm) -> None:
        """Take the present load for none; in the sensor's frame, so that it turns along."""
        self._zero = self._compensated(arm)

    def felt(self, arm: Arm) -> tuple[Vector, Vector]:
        """Return force on the tool [N] and torque about the TCP [N m], axes of the robot base."""
        fx, fy, fz, mx, my, mz = (a - b for a, b in zip(self._compensated(arm), self._zero, strict=True))
        tip = arm.flange @ arm.mounting.pose_flange_tip
        force, torque = rotate(tip.rotation, (fx, fy, fz)), rotate(tip.rotation, (mx, my, mz))
        return force, subtract(torque, cross(subtract(arm.tcp.position, tip.position), force))

    def _compensated(self, arm: Arm) -> Wrench:
        """What is left of the sensor's wrench without the weight of the load, its own frame."""
        fx, fy, fz, mx, my, mz = arm.sensed
        if self.mass == 0.0:
            return fx, fy, fz, mx, my, mz
        tip = arm.flange @ arm.mounting.pose_flange_tip
        weight = rotate_back(tip.rotation, scale(-self.mass, self.gravity))
        on_flange = rotate(arm.flange.rotation, self.center)
        lever = rotate_back(tip.rotation, subtract(on_flange, subtract(tip.position, arm.flange.position)))
        moment = cross(lever, weight)
        return (
            fx - weight[0],
            fy - weight[1],
            fz - weight[2],
            mx - moment[0],
            my - moment[1],
            mz - moment[2],
        )
