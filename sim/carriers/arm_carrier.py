"""An arm that carries a fingertip or a hand."""

from dataclasses import dataclass, field

import mujoco

from palpate.errors import InvalidValueError
from palpate.kinematics import InverseVelocity, Pose, nearest_joint_position
from palpate.kinematics.followed_path import LEAST_ROOM
from palpate.runtime.data import ArmSample
from palpate.sim.carriers.arm_drive import ArmDrive
from palpate.sim.carriers.carriage import TURNING_SENSORS, add_turning_sensors, lift_load, read_turning
from palpate.sim.carriers.carrier import CarriedMass
from palpate.sim.carriers.servoed_arm import FLANGE, ServoedArm
from palpate.sim.carriers.ur5e import ur5e
from palpate.spatial import ZERO, Vector, rotate

LOOKING_DOWN = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
"""Rotation of the tip frame on the flange: upright while the flange looks down."""

BASE_X = -0.45
"""[m] Where the arm's robot base is, behind the origin: by half its reach."""

TOOL = 0.1
"""[m] From the arm's flange to the tip frame."""


def arm_above_the_origin() -> ServoedArm:
    """Return a UR5e that reaches what lies about the origin of the base frame."""
    return ur5e(Pose((BASE_X, 0.0, 0.0)), Pose((0.0, 0.0, TOOL), LOOKING_DOWN))


@dataclass(frozen=True, slots=True)
class ArmCarrier:
    """An arm that carries a fingertip or a hand. A `Carrier`.

    Attributes:
        arm: Where it stands, and what is on its flange; a UR5e if not given.
    """

    arm: ServoedArm = field(default_factory=arm_above_the_origin)

    def joint_start(self, start: Vector) -> tuple[float, ...]:
        """Return joint positions near its home that hold the tip upright, its frame's origin at `start` [m].

        Raises:
            InvalidValueError: It is out of reach, or the arm could not move from there as it is asked to.
        """
        kinematics = self.arm.kinematics
        found = nearest_joint_position(kinematics, Pose(start), self.arm.model.home)
        inverse = InverseVelocity(kinematics)
        smallest = inverse.solve(found, ZERO, ZERO).smallest_singular_value
        if smallest < inverse.threshold:
            raise InvalidValueError(
                f"{kinematics.arm.name} would start at a singularity: the smallest singular value of its Jacobian "
                f"is {smallest:.3g}, must be at least {inverse.threshold:g}; place arm or object elsewhere, or "
                "give another home posture"
            )
        for i, (position, limits) in enumerate(zip(found, kinematics.arm.limits, strict=True)):
            room = min(position - limits.lower, limits.upper - position)
            if room < LEAST_ROOM:
                raise InvalidValueError(
                    f"{kinematics.arm.name} would start with joint {i + 1} at {position:.4g}, {room:.2g} from the "
                    f"end of its range (rad or m): must be at least {LEAST_ROOM:g} away; place arm or object "
                    "elsewhere, or give another home posture"
                )
        return found

    def mount(self, spec: mujoco.MjSpec, load: CarriedMass, start: Vector) -> mujoco.MjsBody:
        """See `Carrier`; the robot knows its load: gravity is taken off the joints, not off the sensor."""
        flange = self.arm.add_to(spec, self.joint_start(start))
        lift_load(flange, load)
        return flange

    def add_sensors(self, spec: mujoco.MjSpec) -> None:
        """Add the tip frame's axes, its turning and the joints' positions, as `ArmCarrierDrive` reads them."""
        add_turning_sensors(spec, FLANGE)
        for name in self.arm.joints:
            spec.add_sensor(type=mujoco.mjtSensor.mjSENS_JOINTPOS, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=name)

    def drive(self, model: mujoco.MjModel, data: mujoco.MjData, period: float) -> "ArmCarrierDrive":
        """See `Carrier`."""
        return ArmCarrierDrive(ArmDrive(self.arm, model, data, period))


class ArmCarrierDrive:
    """Moves and turns the tip. A `Drive`."""

    def __init__(self, drive: ArmDrive) -> None:
        """Take the arm's own drive."""
        self._drive, self._joints = drive, len(drive.reference.joint_reference)

    def start(self) -> None:
        """See `Drive`."""
        self._drive.start()

    def begin(self, velocity: Vector, angular_velocity: Vector) -> None:
        """See `Drive`."""
        self._drive.begin(velocity, angular_velocity)

    def advance(self) -> None:
        """See `Drive`."""
        self._drive.advance()

    def sample(self, time: float, readings: list[float], force: Vector | None = None) -> ArmSample:
        """See `Drive`."""
        s, n = readings, self._joints
        rotation, angular_velocity = read_turning(s[-TURNING_SENSORS - n : -n])
        joints = tuple(s[-n:])
        force = None if force is None else rotate(rotation, force)
        return ArmSample(time, (s[0], s[1], s[2]), rotation, (s[3], s[4], s[5]), joints, angular_velocity, force)

    def snapshot(self) -> tuple[float, ...]:
        """See `Drive`."""
        return self._drive.snapshot()

    def restore(self, state: tuple[float, ...]) -> None:
        """See `Drive`."""
        self._drive.restore(state)
