"""Touches of plate, rod and ball that nobody made, by a tip that is larger than typed."""

from dataclasses import replace

import numpy as np

from palpate.experiments.tip_calibration import TipCalibrationConfig
from palpate.experiments.tip_calibration.known import KnownBefore
from palpate.experiments.tip_calibration.touches_csv import touches_text
from palpate.robots.robot import load_robot
from palpate.sensing.tip_calibration import TouchPlan, candidate_touches
from palpate.sensing.tip_calibration.plan import foreseen_touches
from palpate.sensing.tip_calibration.unknowns import Unknowns

ROBOT = "turning-stage-nano17"
RADIUS_ERROR = 2e-4
"""[m]"""


def known_before(**options):
    """What is known before, of a robot that turns its tip."""
    return KnownBefore.of(replace(TipCalibrationConfig(robot=ROBOT), **options), load_robot(ROBOT), turns=True)


def made_up_touches(before, count=40, seed=0):
    """As many touches, by turns of each target, with 1 or 3 N, without noise."""
    rng = np.random.default_rng(seed)
    plan = TouchPlan(most_tilt=0.6, forces=(1.0, 3.0))
    unknowns = Unknowns(before.tip, before.targets)
    values = unknowns.typed.copy()
    values[unknowns.blocks["size"]] += RADIUS_ERROR
    candidates = candidate_touches(before.tip, before.targets, plan, values)
    of = [[each for each in candidates if each.target == i] for i in range(len(before.targets))]
    chosen = [of[i % len(of)][rng.integers(len(of[i % len(of)]))] for i in range(count)]
    return foreseen_touches(chosen, before.tip, before.targets, plan, values)


def touches_file(folder):
    """Write such touches into a folder, and return the file."""
    before, path = known_before(), folder / "made_up.csv"
    path.write_text(touches_text(made_up_touches(before), before.targets))
    return path
