"""The time step of a simulation: what a control period costs, and how true the force on a moving surface is."""

import re

import numpy as np

from palpate.experiments.kit.recorded_run import carry_out
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.plan import plan_regulation
from palpate.experiments.regulate.result import regulation_in
from palpate.robots.robot import ROBOT_TEXT, Robot, load_robot, read_robot
from studies.study import Row, Study, Tell

STEPS = (1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5)
"""[s]; the last one stands for the truth."""

STIFFNESS = 4e3
"""Of the contact [N/m]: what the largest of these time steps can still simulate."""

ABOUT = (
    "2 N on a plate that goes up and down with 20 mm/s while the tip goes round on it, control at 1 kHz, "
    "contact of 4 kN/m. The cost is that of one control period with all of sensing and control. The error is "
    "how far the true force, period by period, is from that of the same run simulated in steps of 1/16 ms; "
    "root mean square and largest. Other choices, the hand, and what collisions cost: python "
    "benchmarks/simulation."
)


def stage_with_step(step: float) -> Robot:
    """Return the stage that comes with palpate, simulated in steps of `step` [s]."""
    texts = dict(load_robot("stage").texts)
    texts[ROBOT_TEXT] = re.sub(r"time_step_s: \S+", f"time_step_s: {step!r}", texts[ROBOT_TEXT])
    return read_robot(texts)


def measure(quick: bool, seed: int, tell: Tell) -> Study:
    """Measure time steps."""
    config = RegulateConfig(
        surface="sine", motion="circle", duration=2.0 if quick else 6.0, stiffness=STIFFNESS, seed=seed
    )
    costs: dict[float, list[float]] = {step: [] for step in STEPS}
    forces = {}
    for turn in range(2 if quick else 5):
        for step in STEPS:
            tell(f"simulation: {1e3 * step:g} ms, turn {turn + 1}")
            planned = plan_regulation(config, stage_with_step(step), {})
            found = regulation_in(planned, carry_out(planned))
            costs[step].append(planned.period / found.run.real_time_factor)
            held = np.where(found.counted, found.true_force, np.nan)
            since = found.since
            forces[step] = (since[np.isfinite(held)], held[np.isfinite(held)])
    time, true = forces[STEPS[-1]]
    rows = []
    for step in STEPS:
        # landings are not of the same period: what is compared is what happens at the same time of the profile
        error = np.interp(time, *forces[step]) - true
        rms, worst = float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())
        last = step == STEPS[-1]
        note = "stands for the truth" if last else ""
        typical, largest = (np.nan, np.nan) if last else (rms, worst)
        rows.append(Row("time step", f"{1e3 * step:g} ms", float(np.median(costs[step])), typical, largest, note))
    return Study(
        "The time step of a simulation",
        ABOUT,
        "time per control period",
        "s",
        "of the true force",
        "N",
        tuple(rows),
    )
