"""The result of rubbing a surface: its friction with intervals, and its recognition in a library."""

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.controllers.rub_program import Survey
from palpate.experiments.friction.found import FrictionFound, found_by, sensor_errors
from palpate.experiments.friction.library import Recognised, recognised
from palpate.experiments.friction.plan import FrictionPlan
from palpate.experiments.friction.strokes import FreeAir, RubbedPair, free_air, rubbed_pairs
from palpate.experiments.friction.summary import friction_file
from palpate.experiments.kit.recorded_run import Recorded
from palpate.experiments.kit.registry import ShownResult
from palpate.friction.friction_file import FrictionFile
from palpate.friction.rubbing.sliding import SETTLING
from palpate.friction.rubbing.stroke_plan import MIN_LOAD_SPAN
from palpate.robots.known_truth import cost_of
from palpate.runtime import Record, RunResult
from palpate.sim.scene_cost import SceneCost


@dataclass(frozen=True, slots=True, eq=False)
class FrictionResult(ShownResult):
    """How a surface was rubbed, and its friction.

    Attributes:
        plan: What was to be done.
        run: How the run ended, and its timing.
        record: Every period.
        pairs: The rubs that were done there and back.
        air: The sensor's zero.
        found: What they measured.
        file: What is kept of that; None if nothing was rubbed.
        shortfalls: What could not be done, a sentence each.
        lost: How often contact was lost that was to be kept.
        cost: Of the simulated scene; None on a robot.
        recognised: Its recognition in a library; None without one.
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
    cost: SceneCost | None
    recognised: Recognised | None = None


def found(plan: FrictionPlan, recorded: Recorded) -> FrictionResult:
    """Return the result of a run, however it ended.

    Raises:
        InvalidValueError: No friction can be estimated from the rubs.
    """
    config, wanted, controller = plan.config, plan.wanted, recorded.controller
    rows = recorded.observer.rows()
    air = free_air(rows, controller.air)
    pairs = rubbed_pairs(rows, controller.spans, air)
    errors = sensor_errors(air, plan.calibration)
    # touch takes one size for the tip, that at the middle of all loads, half of whose compression is the tip's
    tip_error = 0.25 * (wanted.loads[-1] - wanted.loads[0]) / config.stiffness
    settling = SETTLING + plan.ready.finger.pipeline().delay
    model = found_by(pairs, wanted.speed, errors, settling, tip_error)
    library, known = plan.library, None
    if library is not None:
        recorded.progress("recognising the material")
        known = recognised(library, model, config, wanted.most_spin)
    source = provenance(plan, recorded.run)
    if known is not None:
        source += f"; by the library {config.library}: {known.material}"
    return FrictionResult(
        plan,
        recorded.run,
        recorded.record(),
        pairs,
        air,
        model,
        friction_file(model, wanted.speed, source, errors),
        shortfall_words(controller.program),
        controller.lost,
        cost_of(plan.ready.backend),
        known,
    )


def shortfall_words(survey: Survey) -> tuple[str, ...]:
    """Return what a survey could not do, a sentence each."""
    sentences = []
    for loads, how in ((survey.stuck_sliding, "along the surface"), (survey.stuck_turning, "about the normal")):
        if loads:
            forces = listed([f"{load:g}" for load in loads])
            sentences.append(
                f"At {forces} N it did not slip {how} long enough to be seen, as far as the finger may go."
            )
    if not survey.exponents_measured:
        sentences.append(
            "Exponents were not measured: that takes slips of both kinds at two loads, the larger at least "
            f"{MIN_LOAD_SPAN:g} times the smaller."
        )
    return tuple(sentences)


def listed(words: Sequence[str]) -> str:
    """Return words as a list in a sentence: "1, 2 and 4"."""
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def provenance(plan: FrictionPlan, result: RunResult) -> str:
    """Return where the metrics come from, in words."""
    config = plan.config
    by = "the friction plant" if config.on_plant else "MuJoCo's friction"
    what = f"simulated {config.object} ({by})" if plan.truth_known else config.object
    loads = ", ".join(f"{load:g}" for load in config.rubbed_loads)
    kept = result.recording
    log = "" if kept is None or kept.path is None else f"; log {kept.path.name}"
    return f"palpate friction, {what}, robot {config.robot}, loads {loads} N, seed {config.seed}{log}"
