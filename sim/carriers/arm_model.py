"""A serial arm as MuJoCo knows it, alone: its chain, its limits, and what its joints feel of its links."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from palpate.errors import FloatArray
from palpate.kinematics import Joint, JointKind, JointLimits, Pose, SerialArm
from palpate.kinematics.pose import orthonormal
from palpate.spatial import Matrix, as_vector

ASSUMED_ARMATURE = {JointKind.HINGE: 0.1, JointKind.SLIDE: 1.0}
"""ASSUMPTION where a file has none: inertia of rotor and gear as a joint feels it [kg m^2 or kg]. Makers publish
none; rotors of 1e-5 kg m^2 behind gears of 100:1 give this order."""

_SAMPLES, _GRID, _SWEEPS = 200, 13, 3
"""Postures drawn, then angles per joint and rounds of coordinate ascent, in search of the largest inertias."""

_DIGITS = 2
"""To which those are rounded up, so that they are the same on every machine."""


@dataclass(frozen=True, slots=True, eq=False)
class ArmModel:
    """A serial arm alone, ready to be put into scenes.

    Attributes:
        arm: Geometry and limits.
        joints: Names of its joints, from the robot base on.
        flange: Name of the body that carries the flange.
        pose_body_flange: Of the flange on that body.
        armature: Of each joint [kg m^2 or kg].
        link_inertia: Largest diagonal entries of the mass matrix without armature [kg m^2 or kg]: what the links
            are to each joint where the arm is heaviest for it.
        home: A posture to work from [rad or m].
        spec: The arm alone; it is copied, and never changed.
        assumptions: What of the file was left out, and what was taken for what it does not say: in sentences.
    """

    arm: SerialArm
    joints: tuple[str, ...]
    flange: str
    pose_body_flange: Pose
    armature: tuple[float, ...]
    link_inertia: tuple[float, ...]
    home: tuple[float, ...]
    spec: mujoco.MjSpec
    assumptions: tuple[str, ...] = ()

    def spec_at(self, joint_position: Sequence[float]) -> mujoco.MjSpec:
        """Return a copy of the arm whose reference state (`qpos0`) is some joint position [rad or m].

        A reset leads there, and with it what MuJoCo derives from it. Joint positions mean what they meant.
        """
        return spec_at(self.spec, self.joints, joint_position)


def spec_at(spec: mujoco.MjSpec, joints: Sequence[str], joint_position: Sequence[float]) -> mujoco.MjSpec:
    """Return a copy of a model whose reference state is some joint position, as `ArmModel.spec_at` does.

    Args:
        spec: The model.
        joints: All of its joints.
        joint_position: Of each [rad or m].
    """
    spec = spec.copy()
    model = spec.compile()
    data = mujoco.MjData(model)
    for name, position in zip(joints, joint_position, strict=True):
        data.joint(name).qpos[0] = position
    mujoco.mj_kinematics(model, data)
    for name, position in zip(joints, joint_position, strict=True):
        joint = spec.joint(name)
        body = joint.parent
        _place(body, relative_pose(model, data, body.name))
        hinge = joint.type == mujoco.mjtJoint.mjJNT_HINGE
        joint.ref = math.degrees(position) if hinge and spec.compiler.degree else position
    return spec


def relative_pose(model: mujoco.MjModel, data: mujoco.MjData, body: str) -> Pose:
    """Return where a body is in the frame of its parent, as the data have it."""
    this = model.body(body).id
    poses = [pose_of_frame(data.xpos[i], data.xmat[i]) for i in (model.body_parentid[this], this)]
    return poses[0].inverse() @ poses[1]


def chain_of(
    name: str,
    model: mujoco.MjModel,
    joints: Sequence[int],
    limits: Sequence[JointLimits],
    flange: tuple[int, Pose],
) -> SerialArm:
    """Return the chain of some joints, one behind the other.

    Args:
        name: Of the arm.
        model: Compiled.
        joints: By number.
        limits: Of each.
        flange: Body that carries it, and its pose on that.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    before, chain = Pose(), list[Joint]()
    for joint, limit in zip(joints, limits, strict=True):
        body = int(model.jnt_bodyid[joint])
        frame = pose_of_frame(data.xanchor[joint], data.xmat[body])
        frame = frame @ Pose(rotation=_with_z_along(model.jnt_axis[joint]))
        slides = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE
        # back from the position in which the model's bodies are written down to 0
        zero = -float(model.qpos0[model.jnt_qposadr[joint]])
        c, s = math.cos(zero), math.sin(zero)
        back = Pose((0.0, 0.0, zero)) if slides else Pose(rotation=((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
        kind = JointKind.SLIDE if slides else JointKind.HINGE
        chain.append(Joint(_rounded(before.inverse() @ frame @ back), limit, kind))
        before = frame
    body, pose_body_flange = flange
    pose = pose_of_frame(data.xpos[body], data.xmat[body]) @ pose_body_flange
    return SerialArm(name, tuple(chain), _rounded(before.inverse() @ pose))


def largest_inertias(model: mujoco.MjModel, bounds: FloatArray) -> tuple[float, ...]:
    """Return the largest diagonal entries of a mass matrix that are found over a model's postures, rounded up.

    Args:
        model: An arm alone, without armature.
        bounds: Rows lower, upper of its joints, shape (2, n) [rad or m].
    """
    data, n = mujoco.MjData(model), model.nv
    M = np.zeros((n, n))

    def diagonal(q: FloatArray) -> FloatArray:
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_makeM(model, data)
        mujoco.mj_fullM(model, data, M)
        return np.diag(M).copy()

    drawn = np.random.default_rng(0).uniform(bounds[0], bounds[1], (_SAMPLES, n))
    felt = np.array([diagonal(q) for q in drawn])
    result: list[float] = []
    for k in range(n):
        q, largest = drawn[int(felt[:, k].argmax())].copy(), float(felt[:, k].max())
        for _ in range(_SWEEPS):
            for other in range(k + 1, n):  # the joints before it carry it, and change nothing
                for position in np.linspace(bounds[0, other], bounds[1, other], _GRID):
                    tried = q.copy()
                    tried[other] = position
                    found = float(diagonal(tried)[k])
                    if found > largest:
                        q, largest = tried, found
        scale = 10.0 ** (math.floor(math.log10(largest)) - _DIGITS + 1)
        result.append(round(math.ceil(round(largest / scale, 6)) * scale, 12))
    return tuple(result)


def pose_of_frame(position: FloatArray, matrix: FloatArray) -> Pose:
    """Return a pose from what MuJoCo holds of a frame: a position, and nine numbers by rows."""
    return Pose(as_vector(position), _rows(matrix.reshape(3, 3)))


def quat_wxyz(rotation: Matrix) -> list[float]:
    """Return a rotation as MuJoCo's specs take it."""
    result = np.zeros(4)
    mujoco.mju_mat2Quat(result, np.array(rotation, dtype=np.float64).ravel())
    return [float(entry) for entry in result]


def _place(body: mujoco.MjsBody, pose: Pose) -> None:
    """Put a body somewhere in its parent, whatever frames and orientations it was written with."""
    body.set_frame(body.parent.add_frame())
    body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    body.pos, body.quat = pose.position, quat_wxyz(pose.rotation)


def _rounded(pose: Pose) -> Pose:
    """The same, with the rounding taken out that its rotation has gathered."""
    return Pose(pose.position, orthonormal(pose.rotation))


def _with_z_along(axis: FloatArray) -> Matrix:
    """A rotation whose third column is a unit vector; of z itself, the identity."""
    z = np.asarray(axis, dtype=np.float64)
    x = np.eye(3)[int(np.abs(z).argmin())]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return _rows(np.asarray(np.stack([x, np.cross(z, x), z], axis=1), dtype=np.float64))


def _rows(matrix: FloatArray) -> Matrix:
    a, b, c = matrix
    return as_vector(a), as_vector(b), as_vector(c)
