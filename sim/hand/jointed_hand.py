"""A hand of any fingers with one to four joints each, torque-controlled: what an MJCF file describes."""

from dataclasses import dataclass, field, replace

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.kinematics import ArmKinematics, Pose, SerialArm
from palpate.sim.carriers.arm_model import quat_wxyz, spec_at
from palpate.sim.hand.hand import finger_name
from palpate.sim.hand.jointed_drive import JointedDrive
from palpate.sim.tip import Tip
from palpate.spatial import Vector

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

    A finger presses with its grip force in the direction that x of its sensor frame has at the start, and moves its
    tip as commanded in the other directions, or in all of them while its grip force is 0: see
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
        for name, unit in (("bandwidth", "rad/s"), ("closing_speed", "m/s"), ("following_error", "m")):
            positive(name, getattr(self, name), unit)
        positive("bus_period", self.bus_period, "s")
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
        poses = zip(self.sensor_poses(self.start), self.tips, strict=True)
        x, y, z = np.mean([(pose @ Pose(tip.center_of_mass)).position for pose, tip in poses], axis=0).tolist()
        return (x, y, z)

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
        spec = mujoco.MjSpec()
        self.add_to(spec, spec.worldbody.add_body(name="palm"))
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        x, y, z = data.subtree_com[0].tolist()
        return float(model.body_subtreemass[0]), (x, y, z)
