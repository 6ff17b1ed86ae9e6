"""Whether a time step is short enough for the bristles that hang on a body, levers and all.

Friction enters MuJoCo as a load computed at the beginning of a time step. For a mass on a spring K with damping C,
semi-implicit Euler then is stable while K A dt^2 + 2 C A dt < 4, A the inverse mass (Jury's criterion). Of a body
with several contacts it is the largest eigenvalue that counts: a rod held at its end is far lighter there than it
weighs.
"""

from collections.abc import Sequence

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.sim.friction import contacts as column
from palpate.sim.friction.bristle import DAMPING, SPIN_LENGTH, STIFFNESS
from palpate.sim.friction.pairs import LARGEST_BRISTLE_STEP, FrictionPair, ServedPairs


def check_bristles(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    pairs: Sequence[FrictionPair],
    served: ServedPairs,
    contacts: FloatArray,
) -> None:
    """Refuse bristles that the time step cannot follow.

    Args:
        model: Of the scene.
        data: With positions and mass matrix of the present state.
        pairs: Whom the plant serves.
        served: The same as looked up.
        contacts: Rows of `palpate.sim.friction.contacts`, all of the scene.

    Raises:
        InvalidValueError: With a stiffness and a time step that would do.
    """
    rows = contacts[contacts[:, column.PAIR] >= 0.0]
    indices = rows[:, column.PAIR].astype(int)
    bodies = model.geom_bodyid[served.geoms[indices]]
    steps = {
        body: _largest_step(model, data, body, rows[(bodies == body).any(axis=1)], served)
        for body in set(bodies.ravel().tolist()) - {0}
    }
    dt = float(model.opt.timestep)
    for k, (first, second) in zip(indices.tolist(), bodies.tolist(), strict=True):
        # relative motion: the eigenvalue is at most the sum of both bodies'
        found = steps.get(first, 0.0) + steps.get(second, 0.0)
        if found > LARGEST_BRISTLE_STEP:
            less, pair = LARGEST_BRISTLE_STEP / found, pairs[k]
            # damping grows with the root of the stiffness: with less squared both parts are small enough
            raise InvalidValueError(
                f"pair {pair.first!r}, {pair.second!r}: bristle stiffness = {pair.law.stiffness:g} N/m with a "
                f"time step of {dt:g} s: K A dt^2 + 2 C A dt = {found:.3g} at these contacts, the limit is "
                f"{LARGEST_BRISTLE_STEP:g}; take a stiffness of at most {0.99 * pair.law.stiffness * less**2:.3g} "
                f"N/m, or a time step of at most {0.99 * dt * less:.2g} s"
            )


def _largest_step(
    model: mujoco.MjModel, data: mujoco.MjData, body: int, rows: FloatArray, served: ServedPairs
) -> float:
    """Largest eigenvalue of K A dt^2 + 2 C A dt for all contacts of one body, the other bodies held."""
    dt, center = float(model.opt.timestep), data.xipos[body]
    pull = np.zeros((6, 6))
    for row in rows:
        k = int(row[column.PAIR])
        law = served.laws[k]
        share = 1.0 / np.count_nonzero(rows[:, column.PAIR] == k)
        weight = share * (law[STIFFNESS] * dt**2 + 2.0 * law[DAMPING] * dt)
        normal = row[column.NORMAL : column.NORMAL + 3]
        along = np.eye(3) - np.outer(normal, normal)  # its rows span the tangent plane
        slide = np.hstack([along, np.cross(row[column.POSITION : column.POSITION + 3] - center, along)])
        spin = np.concatenate([np.zeros(3), law[SPIN_LENGTH] * normal])
        pull += weight * (slide.T @ slide + np.outer(spin, spin))
    jacobian, yielding = np.zeros((6, model.nv)), np.zeros((6, model.nv))
    mujoco.mj_jacBodyCom(model, data, jacobian[:3], jacobian[3:], body)
    mujoco.mj_solveM(model, data, yielding, jacobian)
    return float(np.abs(np.linalg.eigvals(jacobian @ yielding.T @ pull)).max())
