"""Size of a compiled scene: counts of its bodies, geoms and sensors."""

import time
from dataclasses import dataclass

import mujoco

STEPS = 200
"""Time steps that are timed, three times; the quickest counts: other work only adds."""


@dataclass(frozen=True, slots=True)
class SceneCost:
    """What a compiled scene is made of, and how long one time step of it takes, MuJoCo's part alone.

    Attributes:
        bodies: Without the world.
        dofs: Degrees of freedom.
        geoms: Shapes, those that only show included.
        pairs: Explicit contact pairs: nothing else collides.
        step_time: [s].
    """

    bodies: int
    dofs: int
    geoms: int
    pairs: int
    step_time: float

    def __str__(self) -> str:
        """One line for a person."""
        return (
            f"{self.bodies} bodies, {self.dofs} degrees of freedom, {self.geoms} shapes, {self.pairs} contact "
            f"pair{'' if self.pairs == 1 else 's'}, {1e6 * self.step_time:.1f} µs per time step"
        )


def scene_cost(model: mujoco.MjModel) -> SceneCost:
    """Return what a model costs, from its start; takes a few milliseconds."""
    quickest = float("inf")
    for _ in range(3):
        data = mujoco.MjData(model)
        began = time.perf_counter()
        for _ in range(STEPS):
            mujoco.mj_step(model, data)
        quickest = min(quickest, (time.perf_counter() - began) / STEPS)
    return SceneCost(model.nbody - 1, model.nv, model.ngeom, model.npair, quickest)
