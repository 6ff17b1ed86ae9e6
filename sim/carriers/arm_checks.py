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

TURNS_ON = 2.0 * math.pi
"""[rad] to either side that a hinge without a range is given: what cables of most arms bear (UR: +-360 deg)."""

_HINGE, _SLIDE = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
_ON_JOINTS = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
_FIXED, _UNBIASED = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_NONE


def joints_to(
    source: ArmSourceFile, model: mujoco.MjModel, body: int, root: int, allowed: tuple[int, int]
) -> list[int]:
    """Return the joints between a root and a body, by number.

    Raises:
        InvalidValueError: They are not hinges and slides, one per body, as many as is allowed, fewest and most; or
            root does not
            carry the body.
    """
    path: list[int] = []
    while body != root:
        if not body:
            name = model.body(root).name
            raise source.refusal(
                name, f"root = {name!r} does not carry the flange", "must be between it and world"
            )
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
            remedy = "must be a hinge or a slide; if the arm begins behind it, give the link it stands on as root"
            raise source.refusal(name, f"joint {name} is a {word} joint", remedy)
    fewest, most = allowed
    if not fewest <= len(path) <= most:
        problem = f"{len(path)} joints between base and flange"
        raise source.refusal(
            "", problem, f"must be {fewest} to {most}: see whether flange and root are the right ones"
        )
    return path


def check_open(source: ArmSourceFile, model: mujoco.MjModel, joints: Sequence[int]) -> None:
    """Refuse what closes the chain: a constraint between parts of it, or between one of its joints and another.

    What is behind the flange, or drags it by a mocap body, does not.

    Raises:
        InvalidValueError: There is one.
    """
    carrying = _joints_that_carry(model, joints)
    for i in range(model.neq):
        kind, name = mujoco.mjtEq(model.eq_type[i]), model.equality(i).name
        ends = model.eq_obj1id[i], model.eq_obj2id[i]
        couples = kind == mujoco.mjtEq.mjEQ_JOINT and set(ends) & set(joints)
        closes = False
        if kind in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
            on_sites = model.eq_objtype[i] == mujoco.mjtObj.mjOBJ_SITE
            bodies = [model.site_bodyid[end] for end in ends] if on_sites else ends
            dragged = any(model.body_mocapid[body] >= 0 for body in bodies)
            closes = not dragged and carrying[bodies[0]] != carrying[bodies[1]]
        if closes or couples:
            word = kind.name.removeprefix("mjEQ_").lower()
            problem = f"equality {name or i + 1} ({word}) makes a closed kinematic chain"
            raise source.refusal(name or f"<{word}", problem, "must be serial: take it out")


def _joints_that_carry(model: mujoco.MjModel, joints: Sequence[int]) -> list[int]:
    """Of each body, how many joints of a chain carry it."""
    found = [0] * model.nbody
    for body in range(1, model.nbody):
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        found[body] = found[model.body_parentid[body]] + sum(first <= joint < first + count for joint in joints)
    return found


def limits_of(
    source: ArmSourceFile, model: mujoco.MjModel, joint: int, speed: float, torque: float | None
) -> JointLimits:
    """Return what a joint may do, its largest speed given [rad/s or m/s], its torque perhaps [N m or N].

    Raises:
        InvalidValueError: It is a slide without range, or has no largest torque.
    """
    name = model.joint(joint).name
    lower, upper = model.jnt_range[joint].tolist()
    if lower > upper:  # MuJoCo takes such a range for none
        problem = f"the range of joint {name} is empty, {lower:.4g} to {upper:.4g}"
        raise source.refusal(name, problem, "give it one, lower end first [rad or m]")
    if turns_on(model, joint):
        lower, upper = -TURNS_ON, TURNS_ON
    elif not (model.jnt_limited[joint] and lower < upper):
        remedy = "give it one: range in an MJCF, lower and upper in a URDF [rad or m]"
        raise source.refusal(name, f"joint {name} has no range", remedy)
    largest = _largest_torque(model, joint) if torque is None else torque
    if not 0.0 < largest < math.inf:
        remedy = (
            "give it one: joint_torque; or in the file actuatorfrcrange, forcerange of its actuator, ctrlrange of "
            "its motor, effort in a URDF [N m or N]"
        )
        raise source.refusal(name, f"joint {name} has no largest torque or force", remedy)
    if not 0.0 < speed < math.inf:
        problem = f"joint {name} has the largest speed {speed:g}"
        raise source.refusal(name, problem, "must be above 0 and finite [rad/s or m/s]")
    return JointLimits(lower, upper, speed, largest)


def turns_on(model: mujoco.MjModel, joint: int) -> bool:
    """Return whether a joint is a hinge without end."""
    return model.jnt_type[joint] == _HINGE and not model.jnt_limited[joint]


def _largest_torque(model: mujoco.MjModel, joint: int) -> float:
    """Of a joint's own limit and those of its actuators [N m or N]; inf: there is none."""
    found = [math.inf]
    if model.jnt_actfrclimited[joint]:
        found.append(float(np.abs(model.jnt_actfrcrange[joint]).min()))
    for i in range(model.nu):
        if mujoco.mjtTrn(model.actuator_trntype[i]) not in _ON_JOINTS or model.actuator_trnid[i, 0] != joint:
            continue
        gear = abs(float(model.actuator_gear[i, 0]))
        if model.actuator_forcelimited[i]:
            found.append(gear * float(np.abs(model.actuator_forcerange[i]).min()))
        is_motor = model.actuator_gaintype[i] == _FIXED and model.actuator_biastype[i] == _UNBIASED
        if is_motor and model.actuator_ctrllimited[i]:
            gain = abs(float(model.actuator_gainprm[i, 0]))
            found.append(gear * gain * float(np.abs(model.actuator_ctrlrange[i]).min()))
    return min(found)


def check_size(source: ArmSourceFile, model: mujoco.MjModel) -> None:
    """Refuse an arm in millimetres.

    Raises:
        InvalidValueError: It is one.
    """
    for body in np.flatnonzero(model.body_weldid).tolist():  # the others do not move
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
