"""A hand that turns what it holds: its fingers close, and move sideways about the hand's axis."""

from dataclasses import dataclass, field, replace

import mujoco

from palpate.errors import InvalidValueError
from palpate.kinematics.pose import Pose
from palpate.sim.hand.hand import Hand, add_motor, finger_name
from palpate.sim.hand.sideways import RackDrive, SidewaysDrive, SidewaysRack
from palpate.spatial import add_scaled


def sideways_name(i: int) -> str:
    """Return the name of the joint and actuator that move finger i sideways, and of the carriage between."""
    return f"{finger_name(i)}_sideways"


@dataclass(frozen=True, slots=True)
class TurningHand(Hand):
    """A hand whose fingers also move sideways, each on a rack in the palm that carries the finger and its servo.

    In `HandSample.joint_position` the fingers' coordinates come first, then how far each has moved sideways [m].

    Attributes:
        rack: What moves each finger sideways.
    """

    rack: SidewaysRack = field(default_factory=SidewaysRack)

    @property
    def carriage_mass(self) -> float:
        """Of what a rack carries besides the finger [kg]."""
        return self.rack.mass + self.finger.servo.mass

    @property
    def palm_mass(self) -> float:
        """See `Hand`: the servos that close ride on the racks."""
        return self.housing_mass + self.fingers * self.rack.servo.mass

    @property
    def mass(self) -> float:
        """See `Hand`."""
        return self.palm_mass + self.fingers * (self.carriage_mass + self.finger.mass + self.tip.mass)

    @property
    def start(self) -> tuple[float, ...]:
        """See `HandModel`."""
        return (0.0,) * (2 * self.fingers)

    def sensor_poses(self, joint_position: tuple[float, ...]) -> tuple[Pose, ...]:
        """See `palpate.kinematics.hand.HandKinematics`.

        Raises:
            InvalidValueError: Fewer positions than joints.
        """
        n = self.fingers
        if len(joint_position) < 2 * n:
            raise InvalidValueError(
                f"joint_position = {joint_position}: must have {2 * n} entries, how far each finger has closed "
                "and then how far each has moved sideways"
            )
        poses = []
        for i in range(n):
            pose = self.pose_hand_sensor(i, joint_position[i])
            (_, x, _), (_, y, _), (_, z, _) = pose.rotation
            moved = add_scaled(pose.position, joint_position[n + i], (x, y, z))
            poses.append(replace(pose, position=moved))
        return tuple(poses)

    def sideways_drive(self, model: mujoco.MjModel, data: mujoco.MjData) -> SidewaysDrive:
        """See `Hand`."""
        return RackDrive(self.rack, tuple(sideways_name(i) for i in range(self.fingers)), model, data)

    def add_to(self, spec: mujoco.MjSpec, palm: mujoco.MjsBody) -> None:
        """See `Hand`."""
        self.add_palm(palm)
        rack = self.rack
        for i in range(self.fingers):
            name = sideways_name(i)
            (_, x, _), (_, y, _), (_, z, _) = self.pose_hand_sensor(i, 0.0).rotation
            carriage = palm.add_body(name=name)
            carriage.explicitinertial = True
            carriage.mass = self.carriage_mass
            # a rod as long as the travel; it never turns
            rod = self.carriage_mass * (2.0 * rack.travel) ** 2 / 12.0
            carriage.inertia = [rod, rod, rod]
            carriage.add_joint(
                name=name,
                type=mujoco.mjtJoint.mjJNT_SLIDE,
                axis=(x, y, z),
                armature=rack.servo.inertia / rack.pinion**2,
            )
            self.add_finger(spec, carriage, i)
        for i in range(self.fingers):  # behind those that close, which stand in a row
            add_motor(spec, sideways_name(i), rack.pinion)


def turning_hand() -> TurningHand:
    """Return three XL330-M288 that close with racks on 20 mm pinions, on three that move them sideways.

    Six servos on the bus take half as long again as three.
    """
    return TurningHand(fingers=3, opening=0.045, bus_period=3e-3)
