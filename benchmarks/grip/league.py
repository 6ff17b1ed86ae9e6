"""League of grips, ours and published ones, on the same hand, servos, sensors, objects and estimates."""

import argparse
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from harness.campaign import Listing

from grip.changed_friction import FrictionChange, Held, Run, drawn
from grip.rivals import ConstantGrip, RatioGrip, SlipTriggeredGrip
from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.grasp import GraspController, SetDownParameters
from palpate.controllers.grip.grip_plan import CommonGrip
from palpate.controllers.grip.lift import LiftController
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.experiments.grasp.config import GraspConfig, Knowledge
from palpate.experiments.grasp.plan import GraspPlan, plan

TOO_HIGH = 0.3
"""Share by which the estimate of friction exceeds its true value."""

HOLD = 0.38
"""Time from the change to the end [s]; a shaking or stepped load lasts `rise`."""

PROCESSES = 2
FIRST_SEED = 2000
"""First of the seeds on which nothing was tuned."""

PAGE = Path(__file__).resolve().parents[2] / "docs" / "slip-safe-grasps.md"


@dataclass(frozen=True, slots=True)
class Scenario:
    """Disturbance of a grasp.

    Attributes:
        name: Name in the table.
        change: Change of friction; None: none.
        too_high: Whether the estimate of friction is too high.
        config: Settings that differ from the usual grasp.
    """

    name: str
    change: FrictionChange | None = None
    too_high: bool = False
    config: tuple[tuple[str, object], ...] = ()

    def grasp(self, seed: int, known: Knowledge = "touched", fingers: int = 2, *, plant: bool) -> GraspConfig:
        """Return a grasp drawn with this seed."""
        config = drawn(seed, known, fingers, plant=plant, **dict(self.config))
        if not self.too_high:
            return config
        assert config.friction is not None
        more = dict(self.config) | {"believed_friction": config.friction / (1.0 - TOO_HIGH)}
        return drawn(seed, known, fingers, plant=plant, **more)


CHANGES = (
    Scenario("nothing changes", FrictionChange()),
    Scenario("mu -30 %, all", FrictionChange(0.7)),
    Scenario("mu -50 %, all", FrictionChange(0.5)),
    Scenario("mu -30 %, one finger", FrictionChange(0.7, fingers=(0,))),
    Scenario("mu -50 %, one finger", FrictionChange(0.5, fingers=(0,))),
)
"""Changes of friction long after the lift; also the first one counts from then on."""

ESTIMATE_TOO_HIGH = Scenario("believed 30 % too high", too_high=True)

SCENARIOS = (
    Scenario("nothing changes"),
    Scenario("mu -30 % in 20 ms", FrictionChange(0.7)),
    Scenario("mu -50 % in 20 ms", FrictionChange(0.5)),
    Scenario("one finger, mu -30 %", FrictionChange(0.7, fingers=(0,))),
    Scenario("one finger, mu -50 %", FrictionChange(0.5, fingers=(0,))),
    ESTIMATE_TOO_HIGH,
    Scenario("step of 2.5 N in 5 ms", config=(("load", "step"), ("pull", 2.5), ("rise", 0.005))),
    Scenario("shaken at 5 Hz", config=(("load", "shake"), ("pull", 1.0), ("shake_frequency", 5.0), ("rise", 3.0))),
)


def _ours(planned: GraspPlan) -> GraspController:
    return planned.controller()


def _rival(kind: type[SlipSafeGrip]) -> Callable[[GraspPlan], GraspController]:
    def controller(planned: GraspPlan) -> GraspController:
        config, period, belief = planned.config, planned.period, KnownSurface(planned.believed)
        parameters = GripParameters(margin=config.margin)
        grip = kind(2, belief, period, parameters, plan=CommonGrip(2, belief, period, parameters))
        lift = LiftController(grip, period, planned.lift)
        return GraspController(lift, grip, period, SetDownParameters(height=config.lift_height))

    return controller


SCHEMES: Mapping[str, Callable[[GraspPlan], GraspController]] = {
    "ours": _ours,
    "constant grip, 50 % margin": _rival(ConstantGrip),
    "ratio of load to grip, PD": _rival(RatioGrip),
    "slip-triggered, x 1.08": _rival(SlipTriggeredGrip),
}


def cells_of(runs: Sequence[Held]) -> tuple[str, ...]:
    """Return drops, slip, spin, latency of the alarm after a slip, and grip before the change, for the table."""
    slips = [1e3 * each.slip for each in runs]
    late = [each.latency for each in runs if not math.isnan(each.latency)]
    latency = " / ".join(map(_milliseconds, (float(np.median(late)), max(late)))) if late else "- / -"
    return (
        drops_of(sum(each.dropped for each in runs), len(runs)),
        f"{np.median(slips):.2g} / {max(slips):.2g}",
        f"{math.degrees(max(each.spin for each in runs)):.2g}",
        latency,
        f"{np.mean([each.grip for each in runs]):.2f}",
    )


def _milliseconds(latency: float) -> str:
    return f"{1e3 * latency:.0f}" if math.isfinite(latency) else "never"


HEADS = ("drops", "slip mm, median / worst", "spin deg, worst", "alarm ms, median / worst", "grip before N")


def wilson(good: int, of: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson 1927)."""
    z = 1.959964
    share, scale = good / of, 1.0 + z * z / of
    middle = share + 0.5 * z * z / of
    half = z * math.sqrt(share * (1.0 - share) / of + 0.25 * (z / of) ** 2)
    return max((middle - half) / scale, 0.0), min((middle + half) / scale, 1.0)


def drops_of(drops: int, runs: int) -> str:
    """Return the number of drops and its interval in per cent."""
    low, high = wilson(drops, runs)
    return f"{drops}/{runs} ({100.0 * low:.0f} to {100.0 * high:.0f} %)"


def of_seed(
    seed: int,
    scheme: str = "ours",
    scenarios: Sequence[Scenario] = SCENARIOS,
    known: Knowledge = "touched",
    fingers: int = 2,
    *,
    plant: bool,
) -> list[Held]:
    """Return the result of each scenario; those in which only friction changes share one grip and lift."""

    def begun(scenario: Scenario) -> Run:
        planned = plan(scenario.grasp(seed, known, fingers, plant=plant), None, {})
        return Run(planned, SCHEMES[scheme](planned))

    alike = [each for each in scenarios if not each.too_high and not each.config]
    found = {}
    if alike:
        results = begun(alike[0]).each_held([each.change for each in alike], HOLD)
        found = dict(zip(alike, results, strict=True))
    return [found[each] if each in found else begun(each).held(each.change, HOLD) for each in scenarios]


def over_seeds(
    of_one: Callable[[int], Any], options: argparse.Namespace, first: int = FIRST_SEED, count: int = 40
) -> list[Any]:
    """Return results of consecutive seeds, from several processes."""
    with ProcessPoolExecutor(PROCESSES) as pool:
        return list(pool.map(of_one, range(first, first + (options.seeds or count))))


def league(options: argparse.Namespace) -> Iterator[Listing]:
    """Compare all schemes in all scenarios, two fingers, friction touched."""
    by_scheme = [over_seeds(partial(of_seed, scheme=each, plant=options.plant), options) for each in SCHEMES]
    rows = [
        (scenario.name, scheme, *cells_of([seed[i] for seed in runs]))
        for i, scenario in enumerate(SCENARIOS)
        for scheme, runs in zip(SCHEMES, by_scheme, strict=True)
    ]
    yield Listing(
        f"grip_league{' bristles' if options.plant else ''}", ("scenario", "grip", *HEADS), rows, page=PAGE
    )


def of_cases(
    title: str,
    options: argparse.Namespace,
    names: Sequence[str],
    runs: Callable[..., Sequence[object]],
    heads: Sequence[str],
    cells: Callable[[int, Sequence[object]], Iterable[str]],
) -> Listing:
    """Return rows of names x knowledge x fingers; `runs(seed, known=, fingers=, plant=)` has a result per name."""
    rows = []
    for known, fingers in itertools.product(options.known or KNOWN, options.fingers or FINGERS):
        one = partial(runs, known=known, fingers=fingers, plant=options.plant)
        for name, found in zip(names, zip(*over_seeds(one, options), strict=True), strict=True):
            rows.append((name, known, fingers, *cells(fingers, found)))
    return Listing(title, ("", "friction", "fingers", *heads), rows)


def changed(scenarios: Sequence[Scenario], title: str, options: argparse.Namespace) -> Iterator[Listing]:
    """Hold with our grip in these scenarios, for all knowledge of friction and numbers of fingers."""

    def cells(_: int, found: Sequence[object]) -> Iterable[str]:
        held = [each for each in found if isinstance(each, Held)]
        return (*cells_of(held), f"{sum(each.early for each in held)}")

    runs = partial(of_seed, scenarios=scenarios)
    yield of_cases(title, options, [each.name for each in scenarios], runs, (*HEADS, "alarms before"), cells)


KNOWN, FINGERS = ("touched", "estimated", "untouched"), (2, 3)

PARTS = {
    "league": league,
    "changes": partial(changed, CHANGES, "friction changes in 20 ms"),
    "too-high": partial(changed, (ESTIMATE_TOO_HIGH,), "friction below its estimate, from the lift on"),
}
