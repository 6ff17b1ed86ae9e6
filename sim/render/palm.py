"""The palm of a hand, for pictures: a disc above its fingers. In the simulation it is a frame and a mass alone."""

from dataclasses import dataclass

import mujoco
import numpy as np

from palpate.sim.render.parts import palm_of

THICKNESS = 0.012
"""Of the disc [m]."""


@dataclass(frozen=True, slots=True)
class PalmDisc:
    """A flat cylinder about the hand's axis, in the hand frame.

    Attributes:
        radius: As wide as the fingers stand [m].
        lowest: z of its lower side: where the fingers begin [m].
    """

    radius: float
    lowest: float

    @property
    def middle(self) -> float:
        """Z of its centre [m]."""
        return self.lowest + 0.5 * THICKNESS


def palm_disc(model: mujoco.MjModel) -> PalmDisc | None:
    """Return the palm of a scene's hand; None if there is no hand, or its palm has a shape of its own."""
    palm = palm_of(model)
    if palm is None or model.body_geomnum[palm]:
        return None
    turn, ends = np.empty(9), []
    for finger in (i for i in range(model.nbody) if model.body_parentid[i] == palm):
        if model.body_geomnum[finger] and not model.body_jntnum[finger]:
            return None  # a palm within the palm's frame
        mujoco.mju_quat2Mat(turn, model.body_quat[finger])
        for geom in range(model.ngeom):
            if model.geom_bodyid[geom] == finger:
                along, radius = np.empty(9), float(model.geom_size[geom, 0])
                mujoco.mju_quat2Mat(along, model.geom_quat[geom])
                half = model.geom_size[geom, 1] * along.reshape(3, 3)[:, 2]
                for end in (model.geom_pos[geom] + half, model.geom_pos[geom] - half):
                    x, y, z = (model.body_pos[finger] + turn.reshape(3, 3) @ end).tolist()
                    ends.append((z, float(np.hypot(x, y)) + 2.0 * radius))
    if not ends:
        return None
    lowest, radius = max(ends)
    return PalmDisc(radius, lowest)
