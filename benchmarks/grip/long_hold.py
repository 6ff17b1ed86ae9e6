"""Objects held for long, undisturbed or shaken: false alarms, creep, and what grip it takes, by the truth."""

import math
from dataclasses import dataclass

import numpy as np

from grip.changed_friction import DROPPED, Run, drawn
from palpate.experiments.grasp.config import GraspConfig, Knowledge
from palpate.experiments.grasp.creep import creep_rate
from palpate.experiments.grasp.least import least_grip
from palpate.experiments.grasp.plan import plan
from palpate.experiments.grasp.truth import GraspTruth
from palpate.friction.limit_surface import LimitSurface
from palpate.sim.fidelity import GRAVITY

TIGHT = 0.08
"""Margin that leaves, with the reserve for noise, a load ratio of 0.9 where friction is as believed."""

PHASES, AT_FIRST = 24, 1.0
"""Instants of the last cycle at which the least grip is worked out, and [s] of which no rate is taken."""


@dataclass(frozen=True, slots=True)
class LongHold:
    """What came of it.

    Attributes:
        dropped: Whether the object was lost.
        slip: Largest of all fingers, while it was held or shaken [m].
        creep: Rate of slip of the finger that creeps most, [m/s],
        turning: and of spin [rad/s].
        grip: Mean over time and fingers [N].
        peak: Largest least grip of the last cycle, mean over the fingers [N].
        ratio: Mean load ratio of the contact that is nearest to its limit.
        alarms: While it was held or shaken, of all fingers.
    """

    dropped: bool
    slip: float
    creep: float
    turning: float
    grip: float
    peak: float
    ratio: float
    alarms: int


def undisturbed(
    seed: int, known: Knowledge, fingers: int, *, seconds: float, noisier: float = 1.0, plant: bool = False
) -> LongHold:
    """Hold what is as believed, with a load ratio of 0.9 where friction is touched."""
    true = drawn(seed, known, fingers)
    more: dict[str, object] = {"load": "none", "pull": None, "rise": seconds, "plant": plant}
    if known == "touched":
        as_it_is = {"believed_friction": true.friction, "believed_spin_length": true.spin_length}
        more |= {"margin": TIGHT, **as_it_is}
    noise = {"force_noise": noisier * true.force_noise, "moment_noise": noisier * true.moment_noise}
    return _kept(drawn(seed, known, fingers, **more, **noise), seconds, 1.0, every=1 if plant else 10)


def shaken(
    seed: int, known: Knowledge, fingers: int, frequency: float, *, seconds: float, plant: bool = False
) -> LongHold:
    """Shake with 1 N up and down and sideways."""
    shake = {"load": "shake", "pull": 1.0, "shake_frequency": frequency, "rise": seconds, "plant": plant}
    return _kept(drawn(seed, known, fingers, **shake), seconds, 1.0 / frequency, every=1 if plant else 4)


def _kept(config: GraspConfig, seconds: float, cycle: float, *, every: int) -> LongHold:
    planned = plan(config, None, {})
    begin = planned.times.grows
    run = Run(planned, every=every)
    run.until(begin + seconds)
    truth = run.truth
    at = int(np.searchsorted(truth.time, begin))
    later = int(np.searchsorted(truth.time, begin + AT_FIRST))
    slip = float(np.abs(truth.slid[at:] - truth.slid[at]).max())
    last = np.flatnonzero(truth.time >= truth.time[-1] - cycle)
    chosen = last[:: max(len(last) // PHASES, 1)]
    return LongHold(
        int(truth.touching[-1].sum()) < 2 or slip > DROPPED,
        slip,
        creep_rate(truth.time[later:], truth.slid[later:]),
        creep_rate(truth.time[later:], truth.turned[later:]),
        float(truth.loads[later:, :, 0].mean()),
        max(_least(truth, int(i), planned.true, config.mass) for i in chosen),
        float(_ratios(truth, later, planned.true).mean(axis=0).max()),
        sum(begin <= each.time for each in run.controller.grip.alarms),
    )


def _least(truth: GraspTruth, i: int, surface: LimitSurface, mass: float) -> float:
    """Least grip of the load at an instant, mean over the fingers [N]."""
    weight = np.array([0.0, 0.0, -mass * GRAVITY, 0.0, 0.0, 0.0])
    a, b, c, d, e, f = (truth.pull[i] + weight).tolist()
    contacts = [(x, y, z) for x, y, z in truth.contact[i].tolist()]
    normals = [(x, y, z) for x, y, z in truth.normal[i].tolist()]
    return least_grip(surface, (a, b, c, d, e, f), contacts, normals)


def _ratios(truth: GraspTruth, since: int, surface: LimitSurface) -> np.ndarray:
    loads = truth.loads[since::10]
    return np.array(
        [[surface.load_ratio(f, aside, spin) if f > 0.0 else math.inf for f, aside, spin in row] for row in loads]
    )
