"""What makes the model in a file a serial arm: open, of hinges and slides with limits, and in metres."""

import math
from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from palpate.kinematics import JointLimits
from palpate.sim.carriers.arm_source import ArmSourceFile

FEWEST, MOST = 3, 9
"""Joints of an arm: to move a tip anywhere; and seven on a carriage of two."""

LARGEST = 10.0
"""[m] of an arm's link, of its shape or radius of gyration: beyond, the file is in millimetres."""

_HINGE, _SLIDE = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE


def joints_to(source: ArmSourceFile, model: mujoco.MjModel, body: int, allowed: tuple[int, int]) -> list[int]:
    """Return the joints between base and a body, by number.

    Raises:
        InvalidValueError: They are not hinges and slides, one per body, or as many as is allowed, fewest and most.
    """
    path: list[int] = []
    while body:
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        if count > 1:
            name = model.body(body).name
            raise source.refusal(name, f"body {name} has {count} joints", "must have one: nest a body per joint")
        path[:0] = range(first, first + count)
        body = int(model.body_parentid[body])
    for joint in path:
        name, kind = model.joint(joint).name, mujoco.mjtJoint(model.jnt_type[joint])
        if kind not in (_HINGE, _SLIDE):
            word = kind.name.removeprefix("mjJNT_").lower()
            raise source.refusal(name, f"joint {name} is a {word} joint", "must be a hinge or a slide")
        if not name:
            raise source.refusal("", f"joint {joint + 1}, between base and flange, has no name", "name it")
    fewest, most = allowed
    if not fewest <= len(path) <= most:
        problem = f"{len(path)} joints between base and flange"
        raise source.refusal("", problem, f"must be {fewest} to {most}: see whether flange is the right one")
    return path


def check_open(source: ArmSourceFile, model: mujoco.MjModel, joints: Sequence[int]) -> None:
    """Refuse what closes the chain: a constraint between bodies, or between one of its joints and another.

    Raises:
        InvalidValueError: There is one.
    """
    for i in range(model.neq):
        kind, name = mujoco.mjtEq(model.eq_type[i]), model.equality(i).name
        closes = kind in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD)
        couples = kind == mujoco.mjtEq.mjEQ_JOINT and {model.eq_obj1id[i], model.eq_obj2id[i]} & set(joints)
        if closes or couples:
            word = kind.name.removeprefix("mjEQ_").lower()
            problem = f"equality {name or i + 1} ({word}) makes a closed kinematic chain"
            raise source.refusal(name or f"<{word}", problem, "must be serial: take it out")


def limits_of(source: ArmSourceFile, model: mujoco.MjModel, joint: int, speed: float) -> JointLimits:
    """Return what a joint may do, its largest speed given [rad/s or m/s].

    Raises:
        InvalidValueError: It has no range or no largest torque.
    """
    name = model.joint(joint).name
    lower, upper = model.jnt_range[joint].tolist()
    if not (model.jnt_limited[joint] and lower < upper):
        remedy = "give it one: range in an MJCF, lower and upper in a URDF [rad or m]"
        raise source.refusal(name, f"joint {name} has no range", remedy)
    torque = float(np.abs(model.jnt_actfrcrange[joint]).min()) if model.jnt_actfrclimited[joint] else math.inf
    for i in range(model.nu):
        of_joint = model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT and model.actuator_trnid[i, 0] == joint
        if of_joint and model.actuator_forcelimited[i]:
            geared = np.abs(model.actuator_forcerange[i]).min() * abs(model.actuator_gear[i, 0])
            torque = min(torque, float(geared))
    if not 0.0 < torque < math.inf:
        remedy = "give it one: actuatorfrcrange, or forcerange of its actuator; effort in a URDF [N m or N]"
        raise source.refusal(name, f"joint {name} has no largest torque or force", remedy)
    if not 0.0 < speed < math.inf:
        problem = f"joint {name} has the largest speed {speed:g}"
        raise source.refusal(name, problem, "must be above 0 and finite [rad/s or m/s]")
    return JointLimits(lower, upper, speed, torque)


def check_size(source: ArmSourceFile, model: mujoco.MjModel) -> None:
    """Refuse an arm in millimetres.

    Raises:
        InvalidValueError: It is one.
    """
    for body in range(1, model.nbody):
        for what, length in _lengths(model, body):
            if length > LARGEST:
                name = model.body(body).name
                remedy = f"must be at most {LARGEST:g} m: write metres, kg and kg m^2, and scale meshes to metres"
                raise source.refusal(name, f"body {name}: {what} is {length:.4g} m", remedy)


def _lengths(model: mujoco.MjModel, body: int) -> Iterator[tuple[str, float]]:
    yield "its distance from the one that carries it", float(np.linalg.norm(model.body_pos[body]))
    mass = float(model.body_mass[body])
    if mass > 0.0:
        yield "its radius of gyration", math.sqrt(float(model.body_inertia[body].max()) / mass)
    shapes = model.geom_bodyid == body
    if shapes.any():
        yield "the radius of its shape", float(model.geom_rbound[shapes].max())
