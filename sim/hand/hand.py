"""A hand of fingers driven by Dynamixels, each with a force/torque sensor behind its tip.

The hand frame lies in the palm, z along the hand's axis, away from the fingers: up, when the hand reaches down.
Fingers stand around the axis, the first at +x, and close towards it. Each sensor frame has z along its finger,
away from the palm, and x in the closing direction.
"""

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from palpate.errors import InvalidValueError, check_positive, not_negative
from palpate.kinematics.pose import Pose
from palpate.sim.hand.finger import FingerJoint, HingeFinger, SlideFinger
from palpate.sim.hand.sideways import FixedSideways, SidewaysDrive
from palpate.sim.tip import Tip
from palpate.spatial import Matrix, Vector
from palpate.surfaces import Sphere

if TYPE_CHECKING:
    from palpate.sim.hand.grip import Grip

SHAKEN_LESS = 0.02
"""`direction_span` of three fingers that share a load (benchmarks/sharing.py): switched, they let it slip by up to
6 mm, with 0.01 to 0.1 by 0.014 mm."""

MOST_FINGERS = 16
"""More would not find room on a bus, or around an object."""

FINGER_RADIUS = 0.004
"""Of fingers in pictures [m]; they touch nothing."""


def default_tip() -> Tip:
    """Return a sphere of 8 mm, 12 mm in front of its sensor; 15 g in all."""
    return Tip(Sphere(0.008, center=np.array([0.0, 0.0, 0.012])), mass=0.015)


def finger_name(i: int) -> str:
    """Return the name of finger i's body, joint and actuator; its tip's are `finger0_tip` and so on."""
    return f"finger{i}"


@dataclass(frozen=True, slots=True)
class Hand:
    """Alike fingers, evenly around the hand's axis.

    Attributes:
        fingers: How many, 2 or more.
        finger: What each of them is.
        tip: What each carries; its centre lies on the sensor's z axis.
        opening: From the hand's axis to the tips' centres with all joints at 0 [m].
        depth: From the palm to the sensors with all joints at 0 [m].
        closing_speed: With which tips move in free space [m/s]. Fingers hit with it, and the inertia
            of a geared motor is large: by v sqrt(K m), 0.9 N for 5 mm/s, 1.5 kg and 20 kN/m.
        housing_mass: Of the palm without the servos, which sit in it [kg].
        direction_span: Share of a force over which currents change sides of the gears' friction when it sinks
            (`GearDirection`).
        bus_period: At which the bus exchanges goals and positions with all servos [s]. At 1 Mbit/s a sync read of
            two or three servos takes 0.6 to 0.8 ms, a write a fifth of that, the adapter 1 ms.
    """

    fingers: int = 2
    finger: FingerJoint = field(default_factory=SlideFinger)
    tip: Tip = field(default_factory=default_tip)
    opening: float = 0.04
    depth: float = 0.08
    closing_speed: float = 0.005
    housing_mass: float = 0.05
    bus_period: float = 2e-3
    direction_span: float = 0.0

    def __post_init__(self) -> None:
        if not 2 <= self.fingers <= MOST_FINGERS:
            raise InvalidValueError(f"fingers = {self.fingers!r}: must be 2 to {MOST_FINGERS}")
        check_positive(self, opening="m", depth="m", closing_speed="m/s", housing_mass="kg", bus_period="s")
        not_negative("direction_span", self.direction_span, "")
        x, y, _ = self.tip.center_of_mass
        if x or y:
            raise InvalidValueError(
                f"tip centre at x = {x:g} m, y = {y:g} m in its sensor frame: must lie on the z axis"
            )
        self.finger.closed(self.opening, self.tip_along)  # refuses a finger too short to close

    @property
    def tips(self) -> tuple[Tip, ...]:
        """See `HandModel`: alike."""
        return (self.tip,) * self.fingers

    @property
    def start(self) -> tuple[float, ...]:
        """See `HandModel`: open."""
        return (0.0,) * self.fingers

    @property
    def center(self) -> Vector:
        """See `HandModel`."""
        return (0.0, 0.0, -(self.depth + self.tip_along))

    @property
    def tip_along(self) -> float:
        """From the sensor to the tip's centre, along the finger [m]."""
        return self.tip.center_of_mass[2]

    @property
    def palm_mass(self) -> float:
        """Of housing and servos [kg], at the origin of the hand frame."""
        return self.housing_mass + self.fingers * self.finger.servo.mass

    @property
    def mass(self) -> float:
        """Of all of it [kg]."""
        return self.palm_mass + self.fingers * (self.finger.mass + self.tip.mass)

    @property
    def center_of_mass(self) -> Vector:
        """In the hand frame, joints at 0 [m]: on its axis, as fingers are alike."""
        sensor, finger = self.pose_hand_sensor(0, 0.0), self.finger
        middle = (sensor @ Pose((0.0, 0.0, -0.5 * self._finger_length))).position[2]
        tip = (sensor @ Pose(self.tip.center_of_mass)).position[2]
        return (0.0, 0.0, self.fingers * (finger.mass * middle + self.tip.mass * tip) / self.mass)

    @property
    def largest_grip(self) -> float:
        """What the servos' current limit and supply leave of force, joints at 0 [N] per finger."""
        servo = self.finger.servo
        return servo.driving_torque(servo.largest_current) / self.finger.lever(0.0, self.tip_along)

    def grip_resolution(self, q: float = 0.0) -> float:
        """Return the force of one step of goal current [N], with the joint at q."""
        servo = self.finger.servo
        step = (1.0 - servo.load_friction) * servo.torque_constant * servo.current_unit
        return step / self.finger.lever(q, self.tip_along)

    def grip_band(self, force: float, q: float = 0.0) -> float:
        """Return how much more than `force` [N] it takes to push back a finger that has pressed up to it.

        As long as nothing moves, friction in the gear holds any force between: after a blow, or when the object is
        pushed, the grip may be this much more than what was commanded.
        """
        servo, lever = self.finger.servo, self.finger.lever(q, self.tip_along)
        return servo.holding_torque(servo.driving_current(force * lever)) / lever - force

    @property
    def apparent_mass(self) -> float:
        """Of a fingertip in its closing direction, joint at 0 [kg]: mostly the rotor behind its gear."""
        finger = self.finger
        return finger.servo.inertia / finger.lever(0.0, self.tip_along) ** 2 + finger.mass + self.tip.mass

    def grip_accuracy(self, rate: float, stiffness: float, q: float = 0.0) -> float:
        """Return by how much the force may differ from a commanded one [N] that changed at a steady rate.

        Half a step of goal current, and half a swing of the finger's mass on the contact's stiffness: rate
        sqrt(m / K), which friction then keeps. It holds for rising and for sinking forces while the finger
        touches, the object does not move, and friction is what the servo's model says. After a blow or a push it
        is `grip_band` instead. A weight that hangs on `HingeFinger`s adds a share: its lever over theirs.

        Args:
            rate: Of the command [N/s].
            stiffness: Of the contact [N/m].
            q: Of the joint [rad or m].
        """
        return 0.5 * self.grip_resolution(q) + rate * math.sqrt(self.apparent_mass / stiffness)

    def pose_hand_sensor(self, i: int, q: float) -> Pose:
        """Return where finger i's sensor frame is in the hand frame, with its joint at q [rad or m]."""
        azimuth = 2.0 * math.pi * i / self.fingers
        c, s = math.cos(azimuth), math.sin(azimuth)
        inwards, along, angle = self.finger.sensor_motion(q)
        radius = self.opening - inwards
        cq, sq = math.cos(angle), math.sin(angle)
        rotation: Matrix = ((-c * cq, -s, -c * sq), (-s * cq, c, -s * sq), (sq, 0.0, -cq))
        return Pose((radius * c, radius * s, -self.depth - along), rotation)

    def sensor_poses(self, joint_position: tuple[float, ...]) -> tuple[Pose, ...]:
        """See `palpate.kinematics.hand.HandKinematics`.

        Raises:
            InvalidValueError: Fewer positions than fingers.
        """
        if len(joint_position) < self.fingers:
            raise InvalidValueError(f"joint_position = {joint_position}: must have {self.fingers} entries or more")
        return tuple(self.pose_hand_sensor(i, joint_position[i]) for i in range(self.fingers))

    def sideways_drive(self, model: mujoco.MjModel, data: mujoco.MjData) -> SidewaysDrive:
        """Return what moves the fingers sideways in a compiled scene: nothing does, they only close."""
        return FixedSideways()

    @property
    def _finger_length(self) -> float:
        """From where a finger begins to its sensor [m]: its servo's horn, or the palm."""
        return -self.finger.pivot[2] or self.depth

    def add_to(self, spec: mujoco.MjSpec, palm: mujoco.MjsBody) -> None:
        """See `HandModel`."""
        self.add_palm(palm)
        for i in range(self.fingers):
            self.add_finger(spec, palm, i)

    def add_palm(self, palm: mujoco.MjsBody) -> None:
        """Give a body mass and inertia of the palm: a disc as wide as the fingers stand."""
        palm.explicitinertial = True
        palm.mass = self.palm_mass
        across = self.palm_mass * self.opening**2 / 4.0
        palm.inertia = [across, across, 2.0 * across]

    def drive(self, model: mujoco.MjModel, data: mujoco.MjData) -> "Grip":
        """See `HandModel`."""
        from palpate.sim.hand.grip import Grip  # which takes a Hand

        return Grip(self, model, data)

    def add_finger(self, spec: mujoco.MjSpec, parent: mujoco.MjsBody, i: int) -> None:
        """Add a finger and its motor to a body whose frame is the hand frame while all joints are at 0."""
        finger, name, pose = self.finger, finger_name(i), self.pose_hand_sensor(i, 0.0)
        quat_wxyz = np.zeros(4)
        mujoco.mju_mat2Quat(quat_wxyz, np.array(pose.rotation).ravel())
        body = parent.add_body(name=name, pos=pose.position, quat=quat_wxyz)
        length = self._finger_length
        body.explicitinertial = True
        body.mass = finger.mass
        body.ipos = [0.0, 0.0, -0.5 * length]
        rod = finger.mass * length**2 / 12.0
        # a rod, with some thickness: an inertia of 0 is none
        body.inertia = [rod, rod, 0.1 * rod]
        body.add_joint(
            name=name,
            type=finger.joint,
            axis=finger.axis,
            pos=finger.pivot,
            # the rotor turns 1 / ratio times as fast as the joint
            armature=finger.servo.inertia / finger.ratio**2,
        )
        add_motor(spec, name, finger.ratio)
        body.add_geom(
            name=f"{name}_shape",
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[0.0, 0.0, -length, 0.0, 0.0, 0.0],
            size=[FINGER_RADIUS, 0.0, 0.0],
            contype=0,
            conaffinity=0,
            group=2,
        )
        carried = mujoco.MjSpec()
        self.tip.add_assets(carried)
        tip = self.tip.add_to(carried.worldbody)
        body.add_frame().attach_body(tip, f"{name}_", "")


def add_motor(spec: mujoco.MjSpec, joint: str, ratio: float) -> None:
    """Add an actuator of a joint's name whose control is the torque at its servo's shaft [N m].

    Args:
        spec: The scene.
        joint: Which.
        ratio: Of its motion to that of the shaft [m/rad, or 1].
    """
    spec.add_actuator(
        name=joint,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=joint,
        gear=[1.0 / ratio] + [0.0] * 5,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        gainprm=[1.0] + [0.0] * 9,
        biastype=mujoco.mjtBias.mjBIAS_NONE,
    )


def two_finger_hand() -> Hand:
    """Return a parallel gripper: two XL330-M288, each with a rack on a 20 mm pinion."""
    return Hand()


def three_finger_hand() -> Hand:
    """Return a centric hand: three XM430-W210, each with a straight finger on its horn."""
    return Hand(fingers=3, finger=HingeFinger(), direction_span=SHAKEN_LESS)
