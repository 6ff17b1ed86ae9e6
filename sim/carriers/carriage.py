"""Machines of slides: a body that carries something and never turns, and the servo of a joint."""

import mujoco

from palpate.spatial import Vector


def add_carriage(spec: mujoco.MjSpec, name: str, position: Vector, mass: float, carried: float) -> mujoco.MjsBody:
    """Add a body that never turns, with its weight and that of what it carries balanced.

    Args:
        spec: The scene.
        name: Of the body.
        position: Where it starts, base frame [m].
        mass: Its own [kg].
        carried: What is mounted on it [kg].
    """
    body = spec.worldbody.add_body(name=name, pos=position)
    body.explicitinertial = True
    body.mass = mass
    body.inertia = [0.01 * mass] * 3  # it never turns: any value does
    # lifts what it carries too, from outside: sensors in between still feel that weight
    body.gravcomp = (mass + carried) / mass
    return body


def add_position_servo(spec: mujoco.MjSpec, joint: str, stiffness: float, damping: float) -> None:
    """Add an actuator, called like its joint, that gives stiffness (reference - q) - damping q'.

    Args:
        spec: The scene.
        joint: Whom it drives.
        stiffness: [N/m or N m/rad].
        damping: [N s/m or N m s/rad].
    """
    spec.add_actuator(
        name=joint,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=joint,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        gainprm=[stiffness] + [0.0] * 9,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        biasprm=[0.0, -stiffness, -damping] + [0.0] * 7,
    )
