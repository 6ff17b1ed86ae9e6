"""Serial arms from MJCF and URDF files."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from palpate.bounded_file import PathLike
from palpate.errors import InvalidValueError, vector
from palpate.kinematics import JointKind, JointLimits, Pose
from palpate.nearest_name import nearest
from palpate.sim.carriers.arm_checks import FEWEST, MOST, check_open, check_size, joints_to, limits_of, turns_on
from palpate.sim.carriers.arm_mending import mend
from palpate.sim.carriers.arm_model import ASSUMED_ARMATURE, ArmModel, chain_of, largest_inertias, pose_of_frame
from palpate.sim.carriers.arm_source import ArmSourceFile

_SHOWN = 4
"""Names in a sentence; a humanoid has forty joints beside an arm."""


def assumptions(
    model: mujoco.MjModel, joints: Sequence[int], mended: Mapping[str, Sequence[str]]
) -> tuple[str, ...]:
    """Return in sentences what of an arm's file is left out, and what is assumed where the file says nothing.

    Args:
        model: All that is in the file.
        joints: Of the arm, by number.
        mended: What was done before, with whom.
    """
    light = [model.joint(i).name for i in joints if not model.dof_armature[model.jnt_dofadr[i]]]
    armature = f"{ASSUMED_ARMATURE[JointKind.HINGE]:g} kg m^2 or {ASSUMED_ARMATURE[JointKind.SLIDE]:g} kg"
    found = {
        "no joints of the arm, left where the file has them": [
            model.joint(i).name for i in range(model.njnt) if i not in joints
        ],
        "without end in the file, taken to turn by 360 deg to either side": [
            model.joint(i).name for i in joints if turns_on(model, i)
        ],
        f"without armature in the file, {armature} assumed": light,
        **mended,
    }
    return tuple(f"{words}: {_listed(names)}" for words, names in found.items() if names)


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(names[:_SHOWN]) + more


ARMS = Path(__file__).resolve().parent.parent / "arms"
"""Where the files of arms lie that palpate has."""

HOME, JOINT_SPEED = "home", "joint_speed"
"""Names in an MJCF file: of the keyframe that is the home posture, and of the custom numbers that are the joints'
largest speeds [rad/s or m/s], for which MuJoCo has no word."""

_SPEED_REMEDY = (
    f'give joint_speed, or write <custom><numeric name="{JOINT_SPEED}" data="..."/></custom> into an MJCF'
)


@dataclass(frozen=True, slots=True)
class ArmFile:
    """An arm in a file.

    Attributes:
        path: MJCF or URDF.
        flange: Name of a site, body or link: what is mounted sits there.
        home: A posture to work from [rad or m]; without: the keyframe `home`, or as the file is written.
        joint_speed: Largest speed of each joint [rad/s or m/s], instead of the file's.
        text: What stood in it, if it may not be there any more.
        count: Fewest and most joints that it may have.
        joint_torque: As `joint_speed`, largest torque or force [N m or N].
        root: Name of the body or link on which the arm stands; joints below it stay where the file has them.
            Without: the world.
    """

    path: PathLike
    flange: str
    home: tuple[float, ...] = ()
    joint_speed: tuple[float, ...] = ()
    text: str | None = None
    count: tuple[int, int] = (FEWEST, MOST)
    joint_torque: tuple[float, ...] = ()
    root: str = ""

    def read(self) -> ArmModel:
        """Return the arm.

        Raises:
            InvalidValueError: It cannot be read, or is no serial arm; the message names file, line where it is
                known, value and remedy.
        """
        source = ArmSourceFile.of(Path(self.path), self.text)
        spec = source.spec()
        mended = mend(spec, source)
        whole = source.compiled(spec)
        body, pose_body_flange = self._flange(source, whole)
        carrying = whole.body(body).name
        joints = joints_to(source, whole, body, self._root(source, whole), self.count)
        check_open(source, whole, joints)
        names = tuple(whole.joint(joint).name for joint in joints)
        speeds, torques = self._speeds(source, whole, names), self._torques(len(names))
        limits = [limits_of(source, whole, *each) for each in zip(joints, speeds, torques, strict=True)]
        armature = tuple(_armature(whole, joint) for joint in joints)

        keep_joints(spec, names)
        without_armature = source.compiled(spec)
        check_size(source, without_armature)
        bounds = np.array([(each.lower, each.upper) for each in limits]).T
        link_inertia = largest_inertias(without_armature, np.clip(bounds, -math.pi, math.pi))
        for name, inertia, limit in zip(names, armature, limits, strict=True):
            leave_to_a_servo(spec, spec.joint(name), inertia, limit)
        alone = source.compiled(spec)
        ids = [int(alone.joint(name).id) for name in names]
        title = str(spec.modelname) or source.path.stem
        arm = chain_of(title, alone, ids, limits, (int(alone.body(carrying).id), pose_body_flange))
        home = arm.joint_position("home", self.home or _home(whole, joints, limits))
        assumed = assumptions(whole, joints, mended)
        return ArmModel(arm, names, carrying, pose_body_flange, armature, link_inertia, home, spec, assumed)

    def _root(self, source: ArmSourceFile, model: mujoco.MjModel) -> int:
        bodies = [model.body(i).name for i in range(1, model.nbody)]
        if not self.root:
            return 0
        if self.root not in bodies:
            raise _unknown(source, "root", self.root, "body or link", bodies)
        return int(model.body(self.root).id)

    def _flange(self, source: ArmSourceFile, model: mujoco.MjModel) -> tuple[int, Pose]:
        """The body that carries the flange, and where on it."""
        sites = [model.site(i).name for i in range(model.nsite)]
        bodies = [model.body(i).name for i in range(1, model.nbody)]
        if self.flange in sites:
            site, rotation = model.site(self.flange), np.zeros(9)
            mujoco.mju_quat2Mat(rotation, site.quat)
            return int(site.bodyid[0]), pose_of_frame(site.pos, rotation)
        if self.flange in bodies:
            return int(model.body(self.flange).id), Pose()
        raise _unknown(
            source, "flange", self.flange, "site, body or link", [name for name in sites + bodies if name]
        )

    def _torques(self, joints: int) -> list[float] | list[None]:
        if not self.joint_torque:
            return [None] * joints
        given: list[float] = vector("joint_torque", self.joint_torque, joints, "N m or N").tolist()
        return given

    def _speeds(self, source: ArmSourceFile, model: mujoco.MjModel, joints: Sequence[str]) -> list[float]:
        if self.joint_speed:
            given: list[float] = vector("joint_speed", self.joint_speed, len(joints), "rad/s or m/s").tolist()
            return given
        if found := speeds_in(source, model, len(joints), "joint"):
            return found
        in_urdf = source.urdf.speeds
        for name in joints:
            if not in_urdf.get(name):
                raise source.refusal(name, f"joint {name} has no largest speed", _SPEED_REMEDY)
        return [in_urdf[name] for name in joints]


def speeds_in(source: ArmSourceFile, model: mujoco.MjModel, count: int, each: str) -> list[float]:
    """Return the largest speeds in a file's `JOINT_SPEED` [rad/s or m/s]; empty: it has none.

    Args:
        source: Of the model.
        model: As the file has it.
        count: How many there must be.
        each: Of what there must be one, for the message.

    Raises:
        InvalidValueError: There are more or fewer.
    """
    numbers = {model.numeric(i).name: model.numeric(i).data.tolist() for i in range(model.nnumeric)}
    if JOINT_SPEED not in numbers:
        return []
    found: list[float] = numbers[JOINT_SPEED]
    if len(found) != count:
        problem = f"{JOINT_SPEED} has {len(found)} numbers"
        raise source.refusal(JOINT_SPEED, problem, f"must have {count}, one per {each}")
    return found


def _unknown(source: ArmSourceFile, key: str, given: str, kinds: str, known: Sequence[str]) -> InvalidValueError:
    near = nearest(given, known)
    remedy = f"did you mean {near}? " if near else ""
    return source.refusal(
        "", f"{key} = {given!r}: no {kinds} is called so", f"{remedy}there are {', '.join(known)}"
    )


def _armature(model: mujoco.MjModel, joint: int) -> float:
    given = float(model.dof_armature[model.jnt_dofadr[joint]])
    slides = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE
    return given or ASSUMED_ARMATURE[JointKind.SLIDE if slides else JointKind.HINGE]


def keep_joints(spec: mujoco.MjSpec, joints: Sequence[str]) -> None:
    """Take out all but bodies, shapes and the arm's joints; what is left touches nothing and is lifted.

    Joints that do not move the flange, as those of a gripper, stay where the file has them.
    """
    others = (spec.keys, spec.actuators, spec.sensors, spec.tendons, spec.equalities, spec.pairs, spec.excludes)
    for each in (*(each for kind in others for each in kind), *spec.lights, *spec.cameras, *spec.numerics):
        spec.delete(each)
    for joint in list(spec.joints):
        if joint.name in joints:
            joint.armature = 0.0  # the links alone, first
        else:
            spec.delete(joint)
    for body in spec.bodies:
        if body != spec.worldbody:
            body.gravcomp = 1.0


def leave_to_a_servo(spec: mujoco.MjSpec, joint: mujoco.MjsJoint, armature: float, limits: JointLimits) -> None:
    """Let its motor carry gravity and end at its torque, both together; its controller makes up for friction."""
    joint.armature = armature
    in_degrees = spec.compiler.degree and joint.type == mujoco.mjtJoint.mjJNT_HINGE
    joint.range = np.degrees((limits.lower, limits.upper)) if in_degrees else (limits.lower, limits.upper)
    joint.damping, joint.stiffness, joint.frictionloss = np.zeros(3), np.zeros(3), 0.0
    joint.actgravcomp = True
    joint.actfrcrange = [-limits.torque, limits.torque]
    joint.limited = joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_TRUE


def _home(model: mujoco.MjModel, joints: Sequence[int], limits: Sequence[JointLimits]) -> list[float]:
    """The posture of the keyframe `home`, or the file's own, each within its joint's range."""
    keys = [model.key(i) for i in range(model.nkey)]
    q = next((key.qpos for key in keys if key.name == HOME), model.qpos0)
    own = [float(q[model.jnt_qposadr[joint]]) for joint in joints]
    return [min(max(each, limit.lower), limit.upper) for each, limit in zip(own, limits, strict=True)]
