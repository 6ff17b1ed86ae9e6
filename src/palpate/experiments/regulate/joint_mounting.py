"""How a part of a scene yields that hangs on one joint, as force control is designed for it."""

import mujoco
import numpy as np

from palpate.controllers.damped_contact import SpringMounting
from palpate.sim import Mount, Scene
from palpate.sim.scene import OBJECT_GEOM

LEAST_LEVER = 1e-4
"""[m] of a hinge, or the part of a slide that points up: with less, pressing does not move the joint."""

LEAST_DAMPING = 1e-6
"""[N s/m] In the place of none."""


def joint_mounting(scene: Scene) -> SpringMounting | None:
    """Return what one joint with a spring makes of a mass under vertical pressing, at its start.

    A joint of stiffness k, damping d and inertia m whose motion raises the pressed point by J per unit is a mount
    of k / J^2, d / J^2, m / J^2.

    Args:
        scene: The point is where the object's surface is over the origin.

    Returns:
        None for what stands still, or moves by several joints or one without a spring: then the gain is made for
        the contact alone, which is the stiffer and so the safer.
    """
    if scene.target.mount is not Mount.JOINTED:
        return None
    model, data = scene.model, mujoco.MjData(scene.model)
    mujoco.mj_forward(model, data)
    height = float(scene.target.shape.height(np.zeros(()), np.zeros(())))
    moved = np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, moved, None, np.array([0.0, 0.0, height]), int(model.geom(OBJECT_GEOM).bodyid[0]))
    dofs = np.flatnonzero(np.abs(moved[2]) > LEAST_LEVER)
    if len(dofs) != 1:
        return None
    dof, squared = int(dofs[0]), float(moved[2, dofs[0]]) ** 2
    stiffness = float(np.ravel(model.jnt_stiffness[int(model.dof_jntid[dof])])[0])
    if stiffness <= 0.0:
        return None
    damping = max(float(np.ravel(model.dof_damping[dof])[0]) / squared, LEAST_DAMPING)
    return SpringMounting(stiffness / squared, damping, float(model.dof_M0[dof]) / squared)
