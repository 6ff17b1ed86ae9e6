"""Which pairs of a model the friction plant serves, and whether it can."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.sim.friction.bristle import packed
from palpate.sim.friction.contacts import IntArray
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.friction.texture import Texture

LARGEST_BRISTLE_STEP = 3.0
"""Of K A dt^2 + 2 C A dt, A the inverse mass at the contact; stable up to 4: `palpate.sim.friction.stability`."""

_REACH = 0.1
"""How near a contact must be to one of the step before to be the same, over the smaller geom's bounding radius:
then the corners of a box are distinguished. A contact that is its pair's only one, as before, is the same
anyway."""


@dataclass(frozen=True, slots=True)
class FrictionPair:
    """Two geoms that the plant serves, by name.

    Attributes:
        first: The finger's, if one is: contacts report what the second exerts on the first.
        second: The object's.
        law: How they rub.
        texture: Of the second geom, if friction varies over it.
    """

    first: str
    second: str
    law: FrictionLaw
    texture: Texture | None = None


@dataclass(frozen=True, slots=True, eq=False)
class ServedPairs:
    """Pairs as the inner loop takes them.

    Attributes:
        geoms: Shape (m, 2).
        laws: As packed, shape (m, 9).
        reach: How near a contact must be to be the same as before, shape (m,) [m].
    """

    geoms: IntArray
    laws: FloatArray
    reach: FloatArray


def served_pairs(model: mujoco.MjModel, pairs: Sequence[FrictionPair]) -> ServedPairs:
    """Look pairs up in a model.

    Raises:
        InvalidValueError: A geom or an explicit pair that is not in the model, or is named twice; MuJoCo's
            friction where the plant's shall be; a bristle too stiff for the time step.
    """
    geoms = [_geoms(model, pair) for pair in pairs]
    if len({frozenset(ids) for ids in geoms}) < len(geoms):
        raise InvalidValueError("pairs: two of them name the same two geoms; give one law for each")
    laws = [packed(pair.law, _damping(model, pair, ids)) for pair, ids in zip(pairs, geoms, strict=True)]
    reach = [
        _REACH * min(float(r) for r in model.geom_rbound[list(ids)] if r > 0.0) for ids in geoms
    ]  # a plane has 0
    return ServedPairs(
        np.array(geoms, np.int32).reshape(-1, 2), np.array(laws).reshape(-1, 9), np.array(reach, np.float64)
    )


def _geoms(model: mujoco.MjModel, pair: FrictionPair) -> tuple[int, int]:
    kind = mujoco.mjtObj.mjOBJ_GEOM
    first, second = (int(mujoco.mj_name2id(model, kind, name)) for name in (pair.first, pair.second))
    if min(first, second) < 0:
        missing = pair.first if first < 0 else pair.second
        there = ", ".join(sorted(filter(None, (model.geom(i).name for i in range(model.ngeom)))))
        raise InvalidValueError(f"geom {missing!r} is not in the model: there are {there}")
    for k in range(model.npair):
        if {int(model.pair_geom1[k]), int(model.pair_geom2[k])} == {first, second}:
            if model.pair_dim[k] != 1:
                raise InvalidValueError(
                    f"pair {pair.first!r}, {pair.second!r} has condim = {model.pair_dim[k]}: must be 1, as the "
                    f"friction plant rubs instead of MuJoCo"
                )
            return first, second
    raise InvalidValueError(
        f"geoms {pair.first!r} and {pair.second!r} are no explicit pair of the model: add one with condim = 1"
    )


def _damping(model: mujoco.MjModel, pair: FrictionPair, geoms: tuple[int, int]) -> float:
    """Damping of the bristle [N s/m], on the two bodies' masses as `palpate.sim.contact_law` counts them."""
    bodies = [int(model.geom_bodyid[geom]) for geom in geoms]
    A, turning = (sum(float(model.body_invweight0[body, k]) for body in bodies) for k in (0, 1))
    law, dt = pair.law, float(model.opt.timestep)
    mobility = max(A, turning * law.spin_length**2)  # the same bristle about the normal
    if mobility == 0.0:
        raise InvalidValueError(f"pair {pair.first!r}, {pair.second!r}: neither body can move, leave it out")
    damping = 2.0 * law.damping_ratio * math.sqrt(law.stiffness / mobility)
    step = math.sqrt(law.stiffness * mobility) * dt
    found = step**2 + 4.0 * law.damping_ratio * step
    if found > LARGEST_BRISTLE_STEP:
        # the positive root of step^2 + 4 damping_ratio step = limit
        largest = math.sqrt(4.0 * law.damping_ratio**2 + LARGEST_BRISTLE_STEP) - 2.0 * law.damping_ratio
        raise InvalidValueError(
            f"pair {pair.first!r}, {pair.second!r}: bristle stiffness = {law.stiffness:g} N/m with a time step of "
            f"{dt:g} s: K A dt^2 + 2 C A dt = {found:.3g}, the limit is {LARGEST_BRISTLE_STEP:g}; take a "
            f"stiffness of at most {0.99 * law.stiffness * (largest / step) ** 2:.3g} N/m, or a time step of at "
            f"most {0.99 * dt * largest / step:.2g} s"
        )
    return damping
