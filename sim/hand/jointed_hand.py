"""A hand of any fingers with one to four joints each, torque-controlled: what an MJCF file describes."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import chain

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError, check_positive
from palpate.kinematics import ArmKinematics, Pose, SerialArm, nearest_joint_position
from palpate.kinematics.kernel import tip_jacobian
from palpate.sim.carriers.arm_model import quat_wxyz, spec_at
from palpate.sim.hand.hand import finger_name
from palpate.sim.hand.jointed_drive import JointedDrive
from palpate.sim.tip import Tip
from palpate.spatial import Vector, as_vector

PREFIX = "hand/"
"""Of all names that come from the hand's own file."""


@dataclass(frozen=True, slots=True, eq=False)
class JointedFinger:
    """A finger: a chain of joints from the palm to a force/torque sensor.

    Attributes:
        arm: The chain, from the hand frame to the sensor frame, with its limits.
        joints: Names of its joints in the hand's file.
        body: Name of the body that carries the sensor.
        pose_body_sensor: Of the sensor on that.
    """

    arm: SerialArm
    joints: tuple[str, ...]
    body: str
    pose_body_sensor: Pose


@dataclass(frozen=True, slots=True, eq=False)
class JointedHand:
    """A hand of fingers with torque-controlled joints. A `HandModel`.

    A finger presses with its grip force in the direction that x of its sensor frame has at the start, and moves
    its tip as commanded in the other directions, or in all of them while its grip force is 0: see
    `palpate.sim.hand.operational_space`. With a grip force of 0 and no velocity it returns to where it started.

    Attributes:
        spec: The hand alone, its own joints and nothing that acts on them; copied, never changed.
        each: Its fingers.
        tips: What they carry.
        start: See `HandModel`: finger by finger, from the palm on.
        bandwidth: Natural frequency of the tips in every direction [rad/s].
        closing_speed: With which tips close and open in free space [m/s].
        following_error: How far a tip's reference may run ahead of it [m]: bounds the force on an obstacle.
        bus_period: See `HandModel`.
    """

    spec: mujoco.MjSpec
    each: tuple[JointedFinger, ...]
    tips: tuple[Tip, ...]
    start: tuple[float, ...]
    bandwidth: float = 200.0
    closing_speed: float = 0.02
    following_error: float = 0.002
    bus_period: float = 1e-3
    mass: float = field(init=False)
    center_of_mass: Vector = field(init=False)
    _kinematics: tuple[ArmKinematics, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_positive(self, bandwidth="rad/s", closing_speed="m/s", following_error="m", bus_period="s")
        if len(self.tips) != len(self.each):
            raise InvalidValueError(
                f"tips: {len(self.tips)} for {len(self.each)} fingers: each finger needs one of its own"
            )
        object.__setattr__(self, "_kinematics", tuple(ArmKinematics(finger.arm) for finger in self.each))
        mass, center = self._balance()
        object.__setattr__(self, "mass", mass)
        object.__setattr__(self, "center_of_mass", center)

    @property
    def fingers(self) -> int:
        """See `HandModel`."""
        return len(self.each)

    @property
    def center(self) -> Vector:
        """See `HandModel`."""
        return self.center_of(range(self.fingers))

    def middle_of(self, i: int) -> Vector:
        """Return where the middle of finger i's tip is at the start, hand frame [m]."""
        return (self.sensor_poses(self.start)[i] @ Pose(self.tips[i].center_of_mass)).position

    def center_of(self, fingers: Iterable[int]) -> Vector:
        """Return the middle of some fingertips at the start, hand frame [m]."""
        return as_vector(np.mean([self.middle_of(i) for i in fingers], axis=0))

    def reaching(self, i: int, position: Vector) -> "JointedHand":
        """Return the hand with another start: the origin of finger i's sensor frame there, hand frame [m].

        Raises:
            InvalidValueError: It is out of that finger's reach.
        """
        parts = list(self.split(self.start))
        parts[i] = nearest_joint_position(self._kinematics[i], Pose(position), parts[i])
        return replace(self, start=tuple(chain.from_iterable(parts)))

    def stiffness(self, i: int, direction: Vector) -> float:
        """Return the stiffness with which finger i holds its tip at the start [N/m].

        Apparent mass along a direction, 1 / (d' J M^-1 J' d), times the square of the bandwidth.

        Args:
            i: Which finger.
            direction: A unit vector, hand frame.
        """
        model, data = self._alone()
        mujoco.mj_makeM(model, data)
        M = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, M)
        dof = [int(model.joint(name).dofadr[0]) for name in self.joint_names(i)]
        along = np.array(direction) @ tip_jacobian(self.chain(i), np.array(self.split(self.start)[i]))[:3]
        return float(self.bandwidth**2 / (along @ np.linalg.solve(M[np.ix_(dof, dof)], along)))

    def split(self, joint_position: tuple[float, ...]) -> tuple[tuple[float, ...], ...]:
        """Return the joint positions of each finger [rad or m].

        Raises:
            InvalidValueError: Not one position per joint.
        """
        counts = [len(finger.joints) for finger in self.each]
        if len(joint_position) != sum(counts):
            raise InvalidValueError(
                f"joint_position = {joint_position}: must have {sum(counts)} entries, finger by finger {counts}"
            )
        at, found = 0, list[tuple[float, ...]]()
        for count in counts:
            found.append(joint_position[at : at + count])
            at += count
        return tuple(found)

    def sensor_poses(self, joint_position: tuple[float, ...]) -> tuple[Pose, ...]:
        """See `palpate.kinematics.hand.HandKinematics`.

        Raises:
            InvalidValueError: Not one position per joint.
        """
        pairs = zip(self._kinematics, self.split(joint_position), strict=True)
        return tuple(kinematics.pose(q) for kinematics, q in pairs)

    def chain(self, i: int) -> FloatArray:
        """Return the chain from the hand frame to the centre of finger i's tip, packed."""
        tip = self._kinematics[i]
        return replace(tip, pose_flange_tip=Pose(self.tips[i].center_of_mass)).chain

    def closing_axes(self, i: int) -> FloatArray:
        """Return the direction in which finger i closes, and two square to it: rows, hand frame, shape (3, 3)."""
        return np.array(self.sensor_poses(self.start)[i].rotation).T.copy()

    def joint_names(self, i: int) -> tuple[str, ...]:
        """Return the names of finger i's joints, and of their motors, in a scene."""
        return tuple(PREFIX + name for name in self.each[i].joints)

    def add_to(self, spec: mujoco.MjSpec, palm: mujoco.MjsBody) -> None:
        """See `HandModel`."""
        names = [name for finger in self.each for name in finger.joints]
        spec.attach(spec_at(self.spec, names, self.start), prefix=PREFIX, frame=palm.add_frame())
        for i, (finger, tip) in enumerate(zip(self.each, self.tips, strict=True)):
            for name in self.joint_names(i):
                spec.add_actuator(
                    name=name,
                    trntype=mujoco.mjtTrn.mjTRN_JOINT,
                    target=name,
                    gaintype=mujoco.mjtGain.mjGAIN_FIXED,
                    gainprm=[1.0] + [0.0] * 9,
                    biastype=mujoco.mjtBias.mjBIAS_NONE,
                )
            carried = mujoco.MjSpec()
            tip.add_assets(carried)
            body = tip.add_to(carried.worldbody)
            at = finger.pose_body_sensor
            frame = spec.body(PREFIX + finger.body).add_frame(pos=at.position, quat=quat_wxyz(at.rotation))
            frame.attach_body(body, f"{finger_name(i)}_", "")

    def drive(self, model: mujoco.MjModel, data: mujoco.MjData) -> JointedDrive:
        """See `HandModel`."""
        return JointedDrive(self, model, data)

    def _balance(self) -> tuple[float, Vector]:
        """Mass and centre of mass of all of it, at the start."""
        model, data = self._alone()
        return float(model.body_subtreemass[0]), as_vector(data.subtree_com[0])

    def _alone(self) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """The hand at its start, and nothing else."""
        spec = mujoco.MjSpec()
        self.add_to(spec, spec.worldbody.add_body(name="palm"))
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        return model, data
