"""Result of rubbing a surface: its friction with intervals, and its recognition in a library."""

from dataclasses import dataclass

from palpate.controllers.rub_program import Survey
from palpate.experiments.friction.estimate import (
    Friction,
    FrictionFound,
    found_by,
    listed,
    sensor_errors,
    slipped,
    spun,
)
from palpate.experiments.friction.plan import FrictionPlan
from palpate.experiments.friction.recognition import Recognised, recognised
from palpate.experiments.friction.strokes import FreeAir, RubbedPair, free_air, rubbed_pairs
from palpate.experiments.friction.summary import friction_file
from palpate.experiments.kit.recorded_run import Recorded
from palpate.experiments.kit.registry import ShownResult
from palpate.friction.friction_file import FrictionFile
from palpate.friction.rubbing.sliding import SETTLING, FrictionMeasured
from palpate.friction.rubbing.stroke_plan import MIN_LOAD_SPAN
from palpate.friction.rubbing.twisting import SpinBound, SpinUncertainty
from palpate.runtime import Record, RunResult


@dataclass(frozen=True, slots=True, eq=False)
class FrictionResult(ShownResult):
    """Result of rubbing a surface.

    Attributes:
        plan: Plan of the run.
        run: Ending and timing of the run.
        record: Record of every period.
        pairs: Rubs that were completed there and back.
        air: Zero of the sensor in free air; None if it was not measured.
        found: Estimates from the rubs.
        file: Friction file; None if nothing was rubbed.
        shortfalls: Parts of the survey that failed, a sentence each.
        lost: Number of contact losses.
        recognised: Recognition in a library; None without one.
    """

    experiment = "friction"

    plan: FrictionPlan
    run: RunResult
    record: Record
    pairs: tuple[RubbedPair, ...]
    air: FreeAir | None
    found: FrictionFound
    file: FrictionFile | None
    shortfalls: tuple[str, ...]
    lost: int
    recognised: Recognised | None = None

    @property
    def no_friction_reason(self) -> str:
        """Reason why strokes gave only a bound of mu; of several reasons the one closest to slip."""
        return max((bound_reason(each.friction) for each in self.found.loads), default="", key=len)

    @property
    def no_static_friction_reason(self) -> str:
        """Reason why static friction is only a bound."""
        measured = slipped(self.found.speeds)
        if any(each.turns is not None for each in measured):
            return "it stuck and let go a few times only"
        slowest = min(each.speed for each in measured)
        return f"mu still rose at the slowest speed, {1e3 * slowest:.3g} mm/s"

    @property
    def no_spin_length_reason(self) -> str:
        """Reason why e is unknown, or only bounded; "" if it was measured."""
        if spun(self.found.loads):
            return ""
        if self.plan.wanted.most_spin == 0.0:
            return "the robot does not turn its tip"
        doubts = [each.spin.doubt for each in self.found.loads if isinstance(each.spin, SpinBound)]
        if not doubts:
            return "no twist was done to its end"
        if SpinUncertainty.FRICTION_UNKNOWN in doubts:
            return "it slipped about the normal, but mu is unknown, and twists measure mu e only"
        if SpinUncertainty.SLID in doubts:
            return "the finger slid more than it spun"
        still = "it did not slip about the normal up to the largest twist"
        if self.file is not None and self.file.spin_length is None:
            return f"{still}, and mu has no upper bound"
        return still


def bound_reason(friction: Friction) -> str:
    """Return the reason why strokes gave only a bound; "" if they measured mu."""
    if isinstance(friction, FrictionMeasured):
        return ""
    return "it slipped too briefly, or in one direction only" if friction.partly else "it never slipped"


def friction_result(plan: FrictionPlan, recorded: Recorded) -> FrictionResult:
    """Return the result of a run, whatever ended it.

    Raises:
        InvalidValueError: If no friction can be estimated from the rubs.
    """
    config, wanted, controller = plan.config, plan.wanted, recorded.controller
    rows = recorded.observer.rows()
    air = free_air(rows, controller.air)
    pairs = rubbed_pairs(rows, controller.spans, air)
    errors = sensor_errors(air, plan.calibration)
    # touch assumes one tip size, that at the middle of all loads; the tip takes half of the compression
    tip_error = 0.25 * (wanted.loads[-1] - wanted.loads[0]) / config.stiffness
    settling = SETTLING + plan.ready.finger.pipeline().delay
    found = found_by(pairs, wanted.speed, errors, settling, tip_error)
    known, source = None, _provenance(plan, recorded.run)
    if plan.library is not None:
        recorded.progress("recognising the material")
        known = recognised(plan.library, found, config, wanted.most_spin)
    if known is not None:
        source += f"; by the library {config.library}: {known.material}"
    return FrictionResult(
        plan,
        recorded.run,
        recorded.record(),
        pairs,
        air,
        found,
        friction_file(found, wanted.speed, source, errors),
        _shortfalls(controller.program),
        controller.lost,
        known,
    )


def _shortfalls(survey: Survey) -> tuple[str, ...]:
    sentences = [
        f"At {listed([f'{load:g}' for load in loads])} N it did not slip {direction} long enough to be seen, "
        "within the range of the finger."
        for loads, direction in (
            (survey.stuck_sliding, "along the surface"),
            (survey.stuck_turning, "about the normal"),
        )
        if loads
    ]
    if not survey.exponents_measured:
        sentences.append(
            "Exponents were not measured: that takes slips of both kinds at two loads, the larger at least "
            f"{MIN_LOAD_SPAN:g} times the smaller."
        )
    return tuple(sentences)


def _provenance(plan: FrictionPlan, result: RunResult) -> str:
    config = plan.config
    by = "the friction plant" if config.on_plant else "MuJoCo's friction"
    what = f"simulated {config.object} ({by})" if plan.truth_known else config.object
    loads = ", ".join(f"{load:g}" for load in config.rubbed_loads)
    kept = result.recording
    log = "" if kept is None or kept.path is None else f"; log {kept.path.name}"
    return f"palpate friction, {what}, robot {config.robot}, loads {loads} N, seed {config.seed}{log}"
