"""Ours and its rivals in the same scenarios: the same hand, servo, sensors, objects and beliefs."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from grip.changed_friction import FrictionChange, Held, Run, drawn
from grip.rivals import ConstantGrip, RatioGrip, SlipTriggeredGrip
from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.grasp import GraspController, SetDownParameters
from palpate.controllers.grip.grip_plan import CommonGrip
from palpate.controllers.grip.lift import LiftController
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.plan import GraspPlan, plan

TOO_HIGH = 0.3
"""Share by which friction is less than believed."""

LONG = 0.38
"""[s] From the change to the end; what shakes or steps goes on for `rise`."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """What happens.

    Attributes:
        name: As the table has it.
        change: Of friction; None: none.
        too_high: Whether more friction is believed than there is.
        config: What else is not as usual.
    """

    name: str
    change: FrictionChange | None = None
    too_high: bool = False
    config: tuple[tuple[str, object], ...] = ()

    def grasp(self, seed: int, *, plant: bool) -> GraspConfig:
        """Return it, drawn."""
        config = drawn(seed, "touched", 2, plant=plant, **dict(self.config))
        if not self.too_high:
            return config
        assert config.friction is not None
        more = dict(self.config) | {"believed_friction": config.friction / (1.0 - TOO_HIGH)}
        return drawn(seed, "touched", 2, plant=plant, **more)


SCENARIOS = (
    Scenario("nothing changes"),
    Scenario("mu -30 % in 20 ms", FrictionChange(0.7)),
    Scenario("mu -50 % in 20 ms", FrictionChange(0.5)),
    Scenario("one finger, mu -30 %", FrictionChange(0.7, fingers=(0,))),
    Scenario("one finger, mu -50 %", FrictionChange(0.5, fingers=(0,))),
    Scenario("believed 30 % too high", too_high=True),
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


def of_seed(scheme: str, seed: int, *, plant: bool) -> list[Held]:
    """Return what comes of every scenario; where only friction changes, one grip and lift serve all."""

    def begun(scenario: Scenario) -> Run:
        planned = plan(scenario.grasp(seed, plant=plant), None, {})
        return Run(planned, SCHEMES[scheme](planned))

    alike = [each for each in SCENARIOS if not each.too_high and not each.config]
    found = dict(zip(alike, begun(alike[0]).each_held([each.change for each in alike], LONG), strict=True))
    return [found[each] if each in found else begun(each).held(each.change, LONG) for each in SCENARIOS]


@dataclass(frozen=True, slots=True)
class Row:
    """What came of all runs of a scheme in a scenario.

    Attributes:
        runs: How many.
        drops: Of them.
        interval: Of the share of drops, 95 % (Wilson 1927).
        slip: Median and largest [m].
        spin: Largest [rad].
        latency: Median and largest of those that slipped and were held [s].
        grip: Mean before anything changes [N].
    """

    runs: int
    drops: int
    interval: tuple[float, float]
    slip: tuple[float, float]
    spin: float
    latency: tuple[float, float]
    grip: float

    @classmethod
    def of(cls, runs: list[Held]) -> "Row":
        """Return the row of some runs."""
        drops = sum(each.dropped for each in runs)
        slips = np.array([each.slip for each in runs])
        late = [each.latency for each in runs if not math.isnan(each.latency)]
        latency = (float(np.median(late)), max(late)) if late else (math.nan, math.nan)
        return cls(
            len(runs),
            drops,
            wilson(drops, len(runs)),
            (float(np.median(slips)), float(slips.max())),
            max(each.spin for each in runs),
            latency,
            float(np.mean([each.grip for each in runs])),
        )

    @property
    def cells(self) -> tuple[str, ...]:
        """Drops, slip, spin, latency and grip, as the table has them."""
        low, high = self.interval
        median, most = self.slip
        soon, late = (_milliseconds(each) for each in self.latency)
        return (
            f"{self.drops}/{self.runs} ({100.0 * low:.0f} to {100.0 * high:.0f} %)",
            f"{1e3 * median:.2g} / {1e3 * most:.2g}",
            f"{math.degrees(self.spin):.2g}",
            f"{soon} / {late}",
            f"{self.grip:.2f}",
        )


def _milliseconds(latency: float) -> str:
    if math.isnan(latency):
        return "-"
    return f"{1e3 * latency:.0f}" if math.isfinite(latency) else "never"


HEADS = ("drops", "slip mm, median / worst", "spin deg, worst", "alarm ms, median / worst", "grip before N")


def wilson(good: int, of: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson 1927)."""
    z = 1.959964
    share, scale = good / of, 1.0 + z * z / of
    middle = share + 0.5 * z * z / of
    half = z * math.sqrt(share * (1.0 - share) / of + 0.25 * (z / of) ** 2)
    return max((middle - half) / scale, 0.0), min((middle + half) / scale, 1.0)
