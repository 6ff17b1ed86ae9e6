"""Inverse velocity of arms: its cost beside MuJoCo's kinematics, and its error."""

from functools import partial

import mujoco
import numpy as np
from harness.study import Effort, Study
from harness.tables import grid, quantity
from harness.timing import Timed, rounds

from palpate.kinematics import ArmKinematics, InverseVelocity, Pose, TipReference
from palpate.sim import ArmFile, ArmModel
from palpate.sim.carriers.arm_file import ARMS
from palpate.spatial import ZERO

PERIOD, SPEED = 1e-3, 0.05


def calls(model: ArmModel) -> dict[str, Timed]:
    """Return pose, inverse velocity, a step of the reference, and MuJoCo's kinematics and Jacobian."""
    kinematics = ArmKinematics(model.arm, pose_flange_tip=Pose((0.0, 0.0, 0.1)))
    inverse = InverseVelocity(kinematics, home=model.home)
    q = tuple(np.add(model.home, 0.05).tolist())
    reference = TipReference(inverse, PERIOD)
    reference.start(q)
    compiled = model.spec.compile()
    data, J, site = mujoco.MjData(compiled), np.zeros((2, 3, compiled.nv)), compiled.site("flange").id

    def in_mujoco() -> None:
        data.qpos[:] = q
        mujoco.mj_kinematics(compiled, data)
        mujoco.mj_comPos(compiled, data)
        mujoco.mj_jacSite(compiled, data, J[0], J[1], site)

    return {
        "MuJoCo": Timed(in_mujoco),
        "pose": Timed(partial(kinematics.pose, q)),
        "inverse velocity": Timed(partial(inverse.solve, q, (0.01, 0.02, 0.0), (0.0, 0.0, 0.1))),
        "step of the reference": Timed(partial(reference.step, q, (1e-9, 0.0, 0.0), ZERO)),
    }


def errors(model: ArmModel, postures: int) -> tuple[str, str, str]:
    """Return results beyond a limit, share away from singularities, and the largest error there.

    A quarter of the random postures has a joint at the end of its range, a quarter has a joint straight. The error
    is that of MuJoCo's forward kinematics after one period of 1 ms at 50 mm/s; away from singularities means a
    smallest singular value of at least the threshold.
    """
    inverse = InverseVelocity(ArmKinematics(model.arm), home=model.home)
    compiled, rng = model.spec.compile(), np.random.default_rng(0)
    data, site = mujoco.MjData(compiled), compiled.site("flange").id
    lower, upper, speed = np.array([(each.lower, each.upper, each.speed) for each in model.arm.limits]).T

    def tip(q: np.ndarray) -> np.ndarray:
        data.qpos[:] = q
        mujoco.mj_kinematics(compiled, data)
        return data.site_xpos[site].copy()

    beyond, away, worst = 0, 0, 0.0
    for i in range(postures):
        q, k = rng.uniform(lower, upper), rng.integers(len(lower))
        if i % 4 == 1:
            q[k] = rng.choice([lower[k], upper[k]])
        if i % 4 == 2:
            q[k] = np.clip(0.0, lower[k], upper[k])
        v = rng.normal(size=3)
        v *= SPEED / np.linalg.norm(v)
        motion = inverse.solve(q.tolist(), tuple(v.tolist()), ZERO)
        there = q + PERIOD * np.array(motion.joint_velocity)
        within = np.all(np.abs(motion.joint_velocity) <= speed) and np.all((lower <= there) & (there <= upper))
        beyond += not within
        if motion.smallest_singular_value >= inverse.threshold:
            away += 1
            worst = max(worst, float(np.linalg.norm(tip(there) - tip(q) - PERIOD * motion.scale * v)))
    return f"{beyond} of {postures}", f"{away / postures:.0%}", quantity(worst, "m")


def arms(effort: Effort) -> Study:
    """Measure every arm that comes with palpate."""
    heads = ("joints", "MuJoCo", "pose", "inverse velocity", "step of the reference")
    cost = grid("Cost of a call, least of the rounds", "arm", *heads)
    exact = grid("Random postures", "arm", "beyond a limit", "away from singularities", "largest error there")
    for path in sorted(ARMS.glob("*.xml")):
        model = ArmFile(path, "flange").read()
        effort.tell(f"arms: {model.arm.name}")
        found = rounds(calls(model), effort.of(50, 5))
        cost.add_row(
            model.arm.name, str(len(model.joints)), *(quantity(each.least, "s") for each in found.values())
        )
        exact.add_row(model.arm.name, *errors(model, effort.of(10_000, 500)))
    return Study("Arms", tables=(cost, exact))


COSTS = {"arms": arms}
