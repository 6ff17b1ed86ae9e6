"""Grasps for sweeps: see `palpate.commands.sweep.swept.Carrier`."""

import numpy as np

from palpate.commands.sweep.carried import found_in, sinks_of
from palpate.commands.sweep.swept import Found
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.plan import plan
from palpate.experiments.grasp.run import Grasp, GraspAttempt, without_spin, write_grasp
from palpate.experiments.kit.figure import Figure, FigureValue, number

FIGURES = (
    Figure("dropped", "share that dropped it"),
    Figure("gave_way", "share that slipped or spun"),
    Figure("slip_m", "slip while pulled", "m"),
    Figure("spin_rad", "spin while pulled", "rad"),
    Figure("slip_aloft_m", "slip in the air", "m"),
    Figure("spin_aloft_rad", "spin in the air", "rad"),
    Figure("grip_ratio", "grip over the least, while pulled"),
    Figure("tightest", "smallest grip over the least"),
    Figure("grip_max_n", "largest true grip while pulled", "N"),
    Figure("alarms_pulled", "alarms while pulled"),
    Figure("alarms_other", "other alarms"),
    Figure("regrips", "times the grip was raised"),
    Figure("simulated_s", "simulated time", "s"),
)
MERITS = ("grip_ratio", "slip_aloft_m", "dropped")
SECONDS = 0.18


def duration_of(config: GraspConfig) -> float:
    """Plan a run and return about how long it is, simulated [s]."""
    return plan(config).expected_duration


def carry_out(config: GraspConfig, keep: bool) -> Found:
    """Grasp. An object that is dropped is what came out, no failure of the run."""
    planned = plan(config)
    attempt = GraspAttempt(planned)
    result = attempt.run((), sinks_of(planned, keep))
    # only a report shows what ignoring spin does; a table does by --vary ignore_spin=false,true
    grasp = attempt.found(result, without_spin(planned) if keep else None)
    if keep:
        write_grasp(grasp, config.out)
    return found_in(result, figures_of(grasp))


def figures_of(grasp: Grasp) -> dict[str, FigureValue]:
    """Return the figures of a grasp; what was never measured has none."""
    pulled, aloft = bool(grasp.counted.any()), bool(grasp.aloft.any())
    counted = grasp.counted & np.isfinite(grasp.least)
    during = len(grasp.pulled_alarms)
    return {
        "dropped": grasp.dropped,
        "gave_way": bool(grasp.gave_way),
        "slip_m": number(grasp.slip) if pulled else None,
        "spin_rad": number(grasp.spin) if pulled else None,
        "slip_aloft_m": number(grasp.slip_aloft) if aloft else None,
        "spin_aloft_rad": number(grasp.spin_aloft) if aloft else None,
        "grip_ratio": number(grasp.grip_ratio),
        "tightest": number(grasp.tightest),
        "grip_max_n": number(float(grasp.felt[counted].max())) if counted.any() else None,
        "alarms_pulled": during,
        "alarms_other": len(grasp.alarms) - during,
        "regrips": grasp.regrips,
        "simulated_s": number(grasp.run.duration),
    }
