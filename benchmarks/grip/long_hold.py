"""Long holds, undisturbed, shaken, under drift of zeros or steps of the load, judged by the simulation's truth."""

import argparse
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from harness.campaign import Listing

from grip.changed_friction import DROPPED, Run, drawn
from grip.league import drops_of, of_cases, over_seeds
from palpate.experiments.grasp.config import GraspConfig, Knowledge
from palpate.experiments.grasp.minimum_grip import least_grip
from palpate.experiments.grasp.plan import plan
from palpate.experiments.grasp.result import creep_rate
from palpate.experiments.grasp.scene import wander_of
from palpate.experiments.grasp.truth import GraspTruth
from palpate.friction.limit_surface import LimitSurface
from palpate.robots.hand_description import simulated_hand
from palpate.sim.fidelity import GRAVITY

TIGHT = 0.08
"""Margin that leaves, with the reserve for noise, a load ratio of 0.9 at the estimated friction."""

PHASES, AT_FIRST = 24, 1.0
"""Instants of the last cycle at which the minimum grip is computed; initial time without a rate [s]."""


@dataclass(frozen=True, slots=True)
class LongHold:
    """Result of a long hold.

    Attributes:
        dropped: Whether the object was lost.
        slip: Largest slip of any finger [m].
        creep: Rate of slip of the finger that creeps most [m/s].
        turning: Rate of spin of the finger that spins most [rad/s].
        grip: Mean over time and fingers [N].
        peak: Peak of the minimum grip in the last cycle, mean over the fingers [N].
        ratio: Mean load ratio of the contact nearest to its limit.
        alarms: Number of alarms of all fingers.
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
    """Hold with the true friction as the estimate, at a load ratio of 0.9 if friction is touched."""
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
    """Shake with 1 N vertically and sideways."""
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
    """Minimum grip for the load at an instant, mean over the fingers [N]."""
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


NOISES, SHAKES = (1.0, 3.0), (2.0, 3.5, 5.0, 7.0, 10.0)
"""Factors of the sensors' noise, and frequencies [Hz]."""

MINUTE, SHAKING = 60.0, 30.0
"""Duration of an undisturbed and of a shaken hold [s]."""


def _all_quiet(seed: int, known: Knowledge, fingers: int, *, plant: bool) -> list[LongHold]:
    return [undisturbed(seed, known, fingers, seconds=MINUTE, noisier=by, plant=plant) for by in NOISES]


def _all_shaken(seed: int, known: Knowledge, fingers: int, *, plant: bool) -> list[LongHold]:
    return [shaken(seed, known, fingers, hertz, seconds=SHAKING, plant=plant) for hertz in SHAKES]


def _quiet_cells(fingers: int, runs: Sequence[Any]) -> tuple[str, ...]:
    alarms, tens = sum(each.alarms for each in runs), len(runs) * fingers * MINUTE / 600.0
    return (
        drops_of(sum(each.dropped for each in runs), len(runs)),
        f"{alarms / tens:.2g} ({alarms} in {tens:.0f})",
        f"{1e3 * max(each.slip for each in runs):.2g}",
        f"{np.mean([each.grip for each in runs]):.2f}",
        f"{np.mean([each.ratio for each in runs]):.2f}",
    )


def _shaken_cells(_: int, runs: Sequence[Any]) -> tuple[str, ...]:
    creeps, ratios = [1e6 * each.creep for each in runs], [each.grip / each.peak for each in runs]
    return (
        drops_of(sum(each.dropped for each in runs), len(runs)),
        f"{np.median(creeps):.2g} / {max(creeps):.2g}",
        f"{math.degrees(max(each.turning for each in runs)):.2g}",
        f"{np.median(ratios):.2f} / {max(ratios):.2f}",
        f"{sum(each.alarms for each in runs)}",
    )


def alarms(options: argparse.Namespace) -> Iterator[Listing]:
    """Count alarms of undisturbed holds."""
    heads = ("drops", "alarms per finger in 10 min", "slip mm, worst", "grip N", "load ratio")
    names = [f"noise x {by:g}" for by in NOISES]
    yield of_cases(f"undisturbed for {MINUTE:g} s", options, names, _all_quiet, heads, _quiet_cells)


def shakes(options: argparse.Namespace) -> Iterator[Listing]:
    """Measure creep and grip of shaken holds."""
    heads = ("drops", "creep um/s, median / worst", "deg/s, worst", "grip over least of the peak", "alarms")
    names = [f"{hertz:g} Hz" for hertz in SHAKES]
    yield of_cases(f"shaken for {SHAKING:g} s", options, names, _all_shaken, heads, _shaken_cells)


@dataclass(frozen=True, slots=True)
class Kept:
    """Grip over time.

    Attributes:
        dropped: Whether the object was lost.
        slip: Largest slip [m].
        spin: Largest spin [rad].
        first: Mean grip of the first half second [N].
        last: Mean grip of the last half second [N].
        most: Largest grip [N].
        unseen: Time in which the zeros were not tracked [s].
    """

    dropped: bool
    slip: float
    spin: float
    first: float
    last: float
    most: float
    unseen: float


def keep(
    config: GraspConfig, since: float | None, seconds: float, *, every: int = 1, steady: bool = False
) -> Kept:
    """Hold; judge from `since` before the load grows (None: from the lift) to `seconds` later or the end.

    With `steady`, the controller assumes zeros that do not drift.
    """
    planned = plan(config, None, {})
    begin = planned.times.begin if since is None else planned.times.grows - since
    end = begin + seconds if since is None else planned.times.end
    controller = replace(planned, config=replace(config, drift=0.0)).controller() if steady else None
    run = Run(planned, controller, every)
    run.until(end)
    truth = run.truth
    at = int(np.searchsorted(truth.time, begin))
    slip = float(np.abs(truth.slid[at:] - truth.slid[at]).max())
    grip = truth.loads[at:, :, 0].mean(axis=1)
    half = round(0.5 / planned.period / every)
    return Kept(
        int(truth.touching[-1].sum()) < 2 or slip > DROPPED,
        slip,
        float(np.abs(truth.turned[at:] - truth.turned[at]).max()),
        float(grip[:half].mean()),
        float(grip[-half:].mean()),
        float(grip.max()),
        getattr(run.controller.zeros, "unseen", 0.0),
    )


STEP = {"load": "step", "rise": 0.005, "pull_before": 0.5, "pull": 3.0}
STEPS: dict[str, dict[str, float]] = {
    "unannounced": {},
    "15 ms before": {"announced": 0.015},
    "preload": {"preload": 2.5},
}
KEPT_HEADS = (
    *("", "runs", "dropped", "slip mm, median / worst", "spin deg, median / worst", "grip first N"),
    *("last / first, median", "least", "most", "most N", "zeros not tracked s"),
)


def _summary(name: str, runs: Sequence[Kept]) -> tuple[object, ...]:
    slips, spins = [1e3 * each.slip for each in runs], [math.degrees(each.spin) for each in runs]
    growth = [each.last / each.first for each in runs]
    return (
        name,
        len(runs),
        sum(each.dropped for each in runs),
        f"{np.median(slips):.4f} / {max(slips):.4f}",
        f"{np.median(spins):.3f} / {max(spins):.3f}",
        f"{np.mean([each.first for each in runs]):.3f}",
        *(f"{each:.2f}" for each in (np.median(growth), min(growth), max(growth))),
        f"{max(each.most for each in runs):.1f}",
        f"{max(each.unseen for each in runs):.1f}",
    )


def _scene(options: argparse.Namespace) -> dict[str, Any]:
    """Return what is held and how, of one kind: the first of those that were chosen."""
    known, fingers = (options.known or ["touched"])[0], (options.fingers or [2])[0]
    return {"known": known, "fingers": fingers, "object": "box", "plant": options.plant}


def _stepped(seed: int, scene: dict[str, Any]) -> Kept:
    return keep(GraspConfig(seed=seed, **STEP, **scene), 0.1, 0.0)  # type: ignore[arg-type]


def _drifted(seed: int, scene: dict[str, Any], seconds: float, drift: float, *, steady: bool) -> Kept:
    config = GraspConfig(seed=seed, load="none", rise=seconds, drift=60.0 * drift, **scene)
    # slip of the friction plant is a sum over periods: every one counts
    return keep(config, None, seconds, every=1 if scene["plant"] else 10, steady=steady)


def steps(options: argparse.Namespace) -> Iterator[Listing]:
    """Step the load by 2.5 N within 5 ms."""
    rows = []
    for name, more in STEPS.items():
        one = partial(_stepped, scene=_scene(options) | more)
        rows.append(_summary(name, over_seeds(one, options, first=0)))
    yield Listing("step of 2.5 N within 5 ms", KEPT_HEADS, rows)


def drifts(seconds: float | None, drift: float, options: argparse.Namespace) -> Iterator[Listing]:
    """Hold while zeros drift at this rate [N/s]; `--seconds` if the duration is None."""
    seconds, scene = seconds or options.seconds, _scene(options)
    one = partial(_drifted, scene=scene, seconds=seconds, drift=drift, steady=options.steady)
    row = _summary("", over_seeds(one, options, first=0))
    config = GraspConfig(load="none", rise=seconds, drift=60.0 * drift, **scene)
    wander = wander_of(config, simulated_hand(scene["fingers"]))
    yield Listing(f"{wander.force:g} N/s and {wander.moment:g} N m/s for {seconds:g} s", KEPT_HEADS, [row])


PARTS = {
    "alarms": alarms,
    "shaken": shakes,
    "long": partial(drifts, None, 1e-3),
    "fast": partial(drifts, 10.0, 0.1),
    "steps": steps,
}
