"""A tool as what a hand holds: its fingertip's shape, mass and balance, as a body of its own."""

import mujoco
import numpy as np

from palpate.errors import FloatArray
from palpate.sim.tip import Tip

_FAR = 10.0
"""[m] Beyond which no distance is looked for."""

_SPECK = 1e-6
"""[m] Radius of a sphere that stands for a point."""


class ToolShape:
    """A tool in the frame in which a hand holds it; for `HeldObject`."""

    def __init__(self, tip: Tip) -> None:
        """Take what it is: surface, mass and balance."""
        self.tip = tip

    def add_assets(self, spec: mujoco.MjSpec, name: str) -> None:
        """See `Solid`."""
        self.tip.add_assets(spec)

    def add_geom(self, body: mujoco.MjsBody, name: str) -> None:
        """See `Solid`: with the body's mass."""
        self.tip.fill(body, name)

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """See `Solid`: as MuJoCo has it."""
        spec = mujoco.MjSpec()
        self.add_assets(spec, "tool")
        self.add_geom(spec.worldbody.add_body(name="tool"), "tool")
        speck = spec.worldbody.add_body(mocap=True)
        speck.add_geom(name="speck", size=[_SPECK, 0.0, 0.0])
        model = spec.compile()
        data, found = mujoco.MjData(model), []
        for point in points:
            data.mocap_pos[0] = point
            mujoco.mj_kinematics(model, data)
            pair = int(model.geom("tool").id), int(model.geom("speck").id)
            found.append(mujoco.mj_geomDistance(model, data, *pair, _FAR, None) + _SPECK)
        return np.array(found)
