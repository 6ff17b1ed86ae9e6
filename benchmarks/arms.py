"""What inverse velocity of arms costs, how exact it is, and how arms explore beside the UR5e.

    python benchmarks/arms.py                  # cost and error, a minute
    python benchmarks/arms.py --explore        # and explorations with every arm, a quarter of an hour

Costs are those of the fastest of some runs of calls: the others count what else the machine does. "MuJoCo" is what
its own kinematics and Jacobian cost from Python (mj_kinematics, mj_comPos, mj_jacSite), without the inverse.

Errors are those of MuJoCo's forward kinematics after one period of 1 ms at 50 mm/s, over random postures, a
quarter of them with a joint at the end of its range and a quarter with a joint straight; away from singularities
means a smallest singular value of at least the threshold.
"""

import argparse
import time
from collections.abc import Callable

import mujoco
import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.exploration import found_by
from palpate.experiments.explore.plan import plan
from palpate.experiments.kit.recorded_run import carry_out
from palpate.kinematics import ArmKinematics, InverseVelocity, Pose, TipReference
from palpate.robots.robot import load_robot
from palpate.sim import ArmFile, ArmModel
from palpate.sim.carriers.arm_file import ARMS
from palpate.spatial import ZERO

PERIOD, SPEED, POSTURES = 1e-3, 0.05, 10_000
CALLS, RUNS = 200, 100
ROBOTS = ("ur5e-sim", "panda-sim", "xarm6-sim")
OBJECTS, SPEEDS = ("sphere", "ellipsoid", "bumps"), (0.02, 0.05)
PATCH = 0.02
"""[m] Width and depth of what is explored."""


def cost(call: Callable[[], object]) -> float:
    """Return what a call costs, of the fastest of several runs [us]."""
    call()
    found = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        for _ in range(CALLS):
            call()
        found.append((time.perf_counter() - begin) / CALLS * 1e6)
    return min(found)


def costs(model: ArmModel) -> list[str]:
    """Return a row of the table of costs."""
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

    calls: tuple[Callable[[], object], ...] = (
        lambda: kinematics.pose(q),
        lambda: inverse.solve(q, (0.01, 0.02, 0.0), (0.0, 0.0, 0.1)),
        lambda: reference.step(q, (1e-9, 0.0, 0.0), ZERO),
        in_mujoco,
    )
    return [f"{cost(call):.1f}" for call in calls]


def errors(model: ArmModel) -> list[str]:
    """Return a row of the table of errors."""
    kinematics = ArmKinematics(model.arm)
    inverse = InverseVelocity(kinematics, home=model.home)
    compiled, rng = model.spec.compile(), np.random.default_rng(0)
    data, site = mujoco.MjData(compiled), compiled.site("flange").id
    lower, upper, speed = np.array([(each.lower, each.upper, each.speed) for each in model.arm.limits]).T

    def tip(q: np.ndarray) -> np.ndarray:
        data.qpos[:] = q
        mujoco.mj_kinematics(compiled, data)
        return data.site_xpos[site].copy()

    beyond, away, worst = 0, 0, 0.0
    for i in range(POSTURES):
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
    return [f"{beyond} of {POSTURES}", f"{away / POSTURES:.0%}", f"{worst:.2g}"]


def explorations(console: Console) -> None:
    """Print force and point errors of every arm, and their ratios to the first one's."""
    table = Table("object", "speed (mm/s)", "arm", "force RMS (N)", "ratio", "points RMS (um)", "ratio", box=None)
    cases = [(name, speed, robot) for name in OBJECTS for speed in SPEEDS for robot in ROBOTS]
    first = (1.0, 1.0)
    for name, speed, robot in track(cases, console=console):
        config = ExploreConfig(object=name, speed=speed, robot=robot, width=PATCH, depth=PATCH, seed=1)
        planned = plan(config, load_robot(robot), {})
        found = found_by(planned, carry_out(planned))
        force, points = found.force_rms, found.point_rms * 1e6
        first = (force, points) if robot == ROBOTS[0] else first
        ratios = force / first[0], points / first[1]
        shown = (f"{force:.4f}", f"{ratios[0]:.2f}", f"{points:.2f}", f"{ratios[1]:.2f}")
        table.add_row(name, f"{1e3 * speed:g}", robot, *shown)
    console.print(table)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--explore", action="store_true", help="explorations with every arm, too")
    asked, console = parser.parse_args(), Console()
    table = Table("arm", "joints", "pose", "inverse velocity", "step of the reference", "MuJoCo", box=None)
    exact = Table("arm", "beyond a limit", "away from singularities", "largest error there (m)", box=None)
    for path in sorted(ARMS.glob("*.xml")):
        model = ArmFile(path, "flange").read()
        table.add_row(model.arm.name, str(len(model.joints)), *costs(model))
        exact.add_row(model.arm.name, *errors(model))
    console.print("Cost of a call (us)", table, "Inverse velocity over random postures", exact, sep="\n")
    if asked.explore:
        explorations(console)


if __name__ == "__main__":
    main()
