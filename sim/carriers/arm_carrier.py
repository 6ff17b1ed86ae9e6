"""A UR5e that carries a fingertip or a hand."""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from palpate.kinematics import Pose, nearest_joint_position
from palpate.runtime.data import ArmSample
from palpate.sim.carriers.arm_drive import ArmDrive
from palpate.sim.carriers.carriage import TURNING_SENSORS, add_turning_sensors, lift_load, read_turning
from palpate.sim.carriers.carrier import CarriedMass
from palpate.sim.carriers.ur5e import FLANGE, JOINTS, Ur5e
from palpate.spatial import Vector

ELBOW_UP = tuple(np.radians((180.0, -90.0, 90.0, -90.0, -90.0, 0.0)).tolist())
"""[rad] Upper arm raised, forearm forward (along x, away from the robot base), flange down: the solution
nearest to this is taken."""

LOOKING_DOWN = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
"""Rotation of the tip frame on the flange: upright while the flange looks down."""

OWN = TURNING_SENSORS + len(JOINTS)
"""How many readings are the carrier's own."""


BASE_X = -0.45
"""[m] Where the arm's robot base is, behind the origin: by half its reach."""

TOOL = 0.1
"""[m] From the arm's flange to the tip frame."""


def arm_above_the_origin() -> Ur5e:
    """Return a UR5e that reaches what lies about the origin of the base frame."""
    return Ur5e(Pose((BASE_X, 0.0, 0.0)), Pose((0.0, 0.0, TOOL), LOOKING_DOWN))


@dataclass(frozen=True, slots=True)
class ArmCarrier:
    """A UR5e that carries a fingertip or a hand. A `Carrier`.

    Attributes:
        arm: Where it stands, and what is on its flange.
        seed: Of the joint angles that reach the start, the nearest to these are taken [rad].
    """

    arm: Ur5e = field(default_factory=arm_above_the_origin)
    seed: tuple[float, ...] = ELBOW_UP

    def joint_start(self, start: Vector) -> tuple[float, ...]:
        """Return the joint angles that hold the tip upright, its frame's origin at `start` [m].

        Raises:
            InvalidValueError: It is out of reach.
        """
        return nearest_joint_position(self.arm.kinematics, Pose(start), self.seed)

    def mount(self, spec: mujoco.MjSpec, load: CarriedMass, start: Vector) -> mujoco.MjsBody:
        """See `Carrier`; the robot knows its load: gravity is taken off the joints, not off the sensor."""
        flange = self.arm.add_to(spec, self.joint_start(start))
        lift_load(flange, load)
        return flange

    def add_sensors(self, spec: mujoco.MjSpec) -> None:
        """Add the tip frame's axes, its turning and the joints' angles, as `ArmCarrierDrive` reads them."""
        add_turning_sensors(spec, FLANGE)
        for name in JOINTS:
            spec.add_sensor(type=mujoco.mjtSensor.mjSENS_JOINTPOS, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=name)

    def drive(self, model: mujoco.MjModel, data: mujoco.MjData, period: float) -> "ArmCarrierDrive":
        """See `Carrier`."""
        return ArmCarrierDrive(ArmDrive(self.arm, model, data, period))


class ArmCarrierDrive:
    """Moves and turns the tip. A `Drive`."""

    def __init__(self, drive: ArmDrive) -> None:
        """Take the arm's own drive."""
        self._drive = drive

    def start(self) -> None:
        """See `Drive`."""
        self._drive.start()

    def begin(self, velocity: Vector, angular_velocity: Vector) -> None:
        """See `Drive`."""
        self._drive.begin(velocity, angular_velocity)

    def advance(self) -> None:
        """See `Drive`."""
        self._drive.advance()

    def sample(self, time: float, readings: list[float]) -> ArmSample:
        """See `Drive`."""
        s = readings
        rotation, angular_velocity = read_turning(s[-OWN : -len(JOINTS)])
        joints = tuple(s[-len(JOINTS) :])
        return ArmSample(time, (s[0], s[1], s[2]), rotation, (s[3], s[4], s[5]), joints, angular_velocity)

    def snapshot(self) -> tuple[float, ...]:
        """See `Drive`."""
        return self._drive.snapshot()

    def restore(self, state: tuple[float, ...]) -> None:
        """See `Drive`."""
        self._drive.restore(state)
