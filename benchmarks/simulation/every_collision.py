"""A scene as it is often built: every shape may hit every other."""

import mujoco


def let_everything_collide(model: mujoco.MjModel) -> None:
    """Switch collisions of all shapes on, besides the explicit pairs, which stay as they are.

    MuJoCo leaves out what is fixed to one another, parents and children, and pairs that are explicit already.
    """
    model.geom_contype[:], model.geom_conaffinity[:] = 1, 1
    # what the broad phase goes by is kept per body
    model.body_contype[:], model.body_conaffinity[:] = 1, 1
