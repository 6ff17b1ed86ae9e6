"""Find out about the friction of a simulated surface: configuration in, result, files and report out."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from palpate.commands.output_folder import make_folder
from palpate.controllers.rub_program import Survey
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.friction.found import FrictionFound, found_by, sensor_errors
from palpate.experiments.friction.library import Recognised, library_of, recognised
from palpate.experiments.friction.plan import FrictionPlan, plan, plan_from_texts
from palpate.experiments.friction.strokes import (
    FreeAir,
    RubbedPair,
    RubRecorder,
    free_air,
    rubbed_pairs,
)
from palpate.experiments.friction.summary import friction_file
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.experiments.kit.truth_recorder import TruthRecord
from palpate.friction.friction_file import FrictionFile, friction_file_text
from palpate.friction.rubbing.sliding import SETTLING
from palpate.friction.rubbing.stroke_plan import LEAST_LOAD_SPAN
from palpate.robots.known_truth import cost_of
from palpate.runtime import Observer, Record, RunResult, Supervisor, Touch
from palpate.runtime.log import Log, Sink
from palpate.runtime.replay import replay
from palpate.sim.scene_cost import SceneCost

FILE_NAME = "friction.yaml"
"""Of what was found, in the output folder."""


@dataclass(frozen=True, slots=True, eq=False)
class RubbingRun:
    """How a surface was rubbed, and what came of it.

    Attributes:
        planned: What was to be done.
        run: How the run ended, and its timing.
        record: Every period.
        truth: What really happened, every period.
        pairs: The rubs that were done both ways.
        air: The sensor's zero.
        found: What they told.
        file: What is kept of that; None if nothing was rubbed.
        shortfalls: What could not be done, a sentence each.
        lost: How often contact was lost that was to be kept.
        cost: Of the simulated scene; None on a robot.
        recognised: What the library says of it; None without one.
    """

    planned: FrictionPlan
    run: RunResult
    record: Record
    truth: TruthRecord
    pairs: tuple[RubbedPair, ...]
    air: FreeAir | None
    found: FrictionFound
    file: FrictionFile | None
    shortfalls: tuple[str, ...]
    lost: int
    cost: SceneCost | None
    recognised: Recognised | None = None


def find_friction(config: FrictionConfig, observers: tuple[Observer, ...] = ()) -> RubbingRun:
    """Plan a rubbing run and carry it out."""
    return carry_out(plan(config), observers)


def carry_out(
    planned: FrictionPlan, observers: tuple[Observer, ...] = (), sinks: tuple[Sink, ...] = ()
) -> RubbingRun:
    """Run it.

    Args:
        planned: What to do.
        observers: Called every period, for example to show progress.
        sinks: Where to record it, beside memory.

    Raises:
        KeyboardInterrupt: The robot was stopped. An `Attempt` still knows what was found until then.
    """
    attempt = Attempt(planned)
    return attempt.found(attempt.run(observers, sinks))


class Attempt:
    """One try: it is run once, and what came of it is told, however the run ended.

    Attributes:
        controller: What moves the robot.
    """

    def __init__(self, planned: FrictionPlan) -> None:
        """Take what to do.

        Raises:
            InvalidValueError: The library cannot be read.
        """
        self._planned, self._library = planned, library_of(planned.config)
        self.controller = planned.controller()
        self._recorded = RecordedRun(planned, self.controller)
        self._rubs = RubRecorder()

    def run(self, observers: tuple[Observer, ...] = (), sinks: tuple[Sink, ...] = ()) -> RunResult:
        """Move the robot; see `carry_out`."""
        # what does not slip is rubbed again, up to eight times as far
        longest = 8.0 * self._planned.expected_duration + 20.0
        return self._recorded.run(longest, (self._rubs, *observers), sinks)

    def found(self, result: RunResult) -> RubbingRun:
        """Return what came of a run that went like `result`."""
        planned, controller = self._planned, self.controller
        rows = self._rubs.rows()
        air = free_air(rows, controller.air)
        pairs = rubbed_pairs(rows, controller.spans, air)
        found = _found(planned, pairs, air)
        program = controller.program
        config, most_spin = planned.config, planned.wanted.most_spin
        known = None if self._library is None else recognised(self._library, found, config, most_spin)
        said = provenance(planned, result)
        if known is not None:
            said += f"; by the library {config.library}: {known.material}"
        shortfalls = shortfall_words(program) if isinstance(program, Survey) else ()
        return RubbingRun(
            planned,
            result,
            self._recorded.record(),
            self._recorded.truth(),
            pairs,
            air,
            found,
            friction_file(found, planned.wanted.speed, said, sensor_errors(air, config.calibration)),
            shortfalls,
            controller.lost,
            cost_of(planned.backend),
            known,
        )


def shortfall_words(survey: Survey) -> tuple[str, ...]:
    """Return what a survey could not do, a sentence each."""
    said = []
    for loads, how in ((survey.stuck_sliding, "along the surface"), (survey.stuck_turning, "about the normal")):
        if loads:
            told = listed([f"{load:g}" for load in loads])
            said.append(f"At {told} N it did not slip {how} long enough to be seen, as far as the finger may go.")
    if not survey.exponents_told:
        said.append(
            "Exponents were not measured: that takes slips of both kinds at two loads, the larger at least "
            f"{LEAST_LOAD_SPAN:g} times the smaller."
        )
    return tuple(said)


def listed(words: Sequence[str]) -> str:
    """Return words as a list in a sentence: "1, 2 and 4"."""
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def evaluate_log(log: Log) -> FrictionFound:
    """Return what the log of a rubbing run tells, from its samples alone.

    Raises:
        InvalidValueError: It is a log of something else.
    """
    planned = plan_from_texts(log.attachments)
    controller, recorder = planned.controller(), RubRecorder()
    samples = log.samples()
    touch, supervisor = Touch(planned.finger), Supervisor(planned.limits)
    replay(samples, log.heading.period, touch, controller, supervisor, log.changes, (recorder,))
    rows = recorder.rows()
    air = free_air(rows, controller.air)
    return _found(planned, rubbed_pairs(rows, controller.spans, air), air)


def provenance(planned: FrictionPlan, result: RunResult) -> str:
    """Return where the figures come from, in words."""
    config = planned.config
    by = "the friction plant" if config.on_plant else "MuJoCo's friction"
    what = f"simulated {config.object} ({by})" if planned.truth_known else config.object
    loads = ", ".join(f"{load:g}" for load in config.rubbed_loads)
    kept = result.recording
    log = "" if kept is None or kept.path is None else f"; log {kept.path.name}"
    return f"palpate friction, {what}, robot {config.robot}, loads {loads} N, seed {config.seed}{log}"


def write_rubbing(rubbing: RubbingRun, folder: str | Path) -> tuple[Path, ...]:
    """Write the report and what was found into a folder, which is made if need be.

    Returns:
        The files, the report first; no friction.yaml if nothing was rubbed.

    Raises:
        InvalidValueError: The folder cannot be made.
        OSError: A file cannot be written.
    """
    from palpate.experiments.friction.report import friction_report
    from palpate.experiments.friction.report_page import write_friction_report

    folder = Path(folder)
    make_folder(folder)
    report, file = folder / "report.html", folder / FILE_NAME
    write_friction_report(friction_report(rubbing), report)
    if rubbing.file is None:
        return (report,)
    file.write_text(friction_file_text(rubbing.file), encoding="utf-8")
    return report, file


def _found(planned: FrictionPlan, pairs: tuple[RubbedPair, ...], air: FreeAir | None) -> FrictionFound:
    settling = SETTLING + planned.finger.pipeline().delay
    errors = sensor_errors(air, planned.config.calibration)
    loads = planned.wanted.loads
    # touch takes one size for the tip, that at the middle of all loads, half of whose compression is the tip's
    tip_error = 0.25 * (loads[-1] - loads[0]) / planned.config.stiffness
    return found_by(pairs, planned.wanted.speed, errors, settling, tip_error)
