"""Report on a run: metrics and findings of the experiment, and advice on the ending."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.experiments.kit.experiment import Experiment, ExperimentDefaults, Plan, Result
from palpate.experiments.kit.metric import metric_rows, remedies, sentences
from palpate.experiments.kit.registry import reference_to, typed_words
from palpate.runtime import Cause, Ending, RestState, RunResult

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from palpate.reporting.report import Report, Section


DEVICE_ADVICE: Mapping[Cause, str] = {
    Cause.WIRE: (
        "Check cable, network and power of the device that is named. `palpate recover {robot}` then connects to "
        "every device and reports its state; `palpate doctor {robot} --duration 30` finds rare gaps."
    ),
    Cause.DEVICE: (
        "`palpate recover {robot}` reports the state of every device, and asks before it unlocks or restarts one; "
        "`palpate doctor {robot}` measures them."
    ),
    Cause.COMPUTER: (
        "This computer was late: `palpate doctor {robot}` measures by how much, and says what to change."
    ),
}
"""Advice by cause of a trip, on a robot with devices."""

ADVICE: Mapping[Cause, str] = {
    Cause.FORCE: (
        "The force exceeded the limit above: reduce force and speed (`palpate {experiment} --help` lists the "
        "options), or raise the limit in the robot file if finger and object withstand it."
    ),
    Cause.GRIP: (
        "The tool may have moved in the hand, and measured contacts are off by as much. Put it back in its place, "
        "and hold it harder or press less (grip_N in the robot file; "
        "`palpate {experiment} --help` lists the options)."
    ),
    Cause.MOTION: (
        "The tip left its workspace, or moved too fast: `palpate {experiment} --dry-run` shows where the tip "
        "goes, and the robot file has the limits."
    ),
    Cause.CONTROLLER: (
        "The fault is in the controller's own code: correct it, and try it on the log without a robot "
        "(`palpate replay`)."
    ),
}
"""Advice by cause of a trip, on any robot."""


def advice_on_ending(experiment: str, plan: Plan, result: RunResult) -> tuple[str, ...]:
    """Return advice after a run that did not reach its end; nothing after one that did.

    Args:
        experiment: Command of the experiment.
        plan: Plan of the run.
        result: Ending of the run.
    """
    real = plan.robot is not None and plan.robot.file.backend.REAL
    robot = shlex.quote(str(plan.config.robot))
    advice = []
    if real and result.rest.state is RestState.NOT_KNOWN:
        advice.append(
            f"Look at the robot before you go near: {result.rest}. `palpate recover {robot}` connects and reports "
            "its state."
        )
    elif result.rest.state is RestState.MOVING:
        advice.append("Press its emergency stop: it was still moving when it was last measured.")
    if result.trip is not None:
        known = {**ADVICE, **DEVICE_ADVICE} if real else ADVICE
        words = known.get(result.trip.cause, "Remove the reason above, and repeat the run.")
        advice.append(words.format(robot=robot, experiment=experiment))
    elif result.ending is not Ending.DONE:
        advice.append("The run did not finish: the results cover the time until then; repeat it.")
    return tuple(advice)


def report_of(
    experiment: ExperimentDefaults,
    result: Result,
    *,
    title: str,
    outcome: str,
    sections: "tuple[Section, ...]" = (),
    asked: str = "",
    settings: tuple[tuple[str, str], ...] = (),
    footer: str = "",
    reached: bool = True,
) -> "Report":
    """Return the report of an experiment: its metrics and findings, these sections, and the timing of the run.

    Args:
        experiment: Experiment that defines metrics and findings.
        result: Result of the run.
        title: Heading.
        outcome: How the run ended, in a sentence or two; the findings' sentences follow.
        sections: Sections between the metrics and the timing.
        asked: Request in a sentence without its full stop; "" for none.
        settings: Name and value with unit of each setting.
        footer: Frame and sign of the numbers.
        reached: Whether the run reached its goal.
    """
    from palpate.reporting.report import Report
    from palpate.reporting.run_figures import computing

    return Report(
        title=title,
        outcome=" ".join((outcome, *sentences(experiment.findings, result))),
        metrics=metric_rows(experiment.metrics, result),
        sections=(*sections, computing(result.run.timing)),
        asked=asked,
        advice=remedies(experiment.findings, result),
        settings=settings,
        footer=footer,
        reached=reached,
    )


def run_report(experiment: Experiment, plan: Plan, result: Result) -> "Report":
    """Return the report on a run with advice on its ending, and with the commands that repeat it.

    If records were lost, the outcome says so, and the goal counts as missed.
    """
    report, name, lost = experiment.report(result), reference_to(experiment), result.run.lost_records
    if lost:
        report = replace(report, outcome=f"{report.outcome} {lost}.", reached=False)
    return replace(
        report,
        advice=(*advice_on_ending(name, plan, result.run), *report.advice),
        repeat=repeat_commands(name, plan.config, result.run),
    )


def repeat_commands(name: str, config: "DataclassInstance", result: RunResult) -> tuple[tuple[str, str], ...]:
    """Return descriptions and commands that repeat, show or compare a run.

    Args:
        name: Name of the experiment.
        config: Configuration of the run.
        result: Result of the run; without a log only the run itself can be repeated.
    """
    commands = [("The same again:", command_line(name, config))]
    kept = result.recording
    if kept is not None and kept.path is not None:
        log = shlex.quote(str(kept.path))
        commands += [
            ("Every command of it computed again from its log, bit for bit:", f"palpate replay {log}"),
            ("To watch it in the browser:", f"palpate view {log}"),
            ("Beside another run of the kind:", f"palpate compare {log} ANOTHER_RUN"),
        ]
    return tuple(commands)


def log_row(result: RunResult) -> tuple[tuple[str, str], ...]:
    """Return the log as a setting of a report; empty if there is none."""
    kept = result.recording
    return () if kept is None or kept.path is None else (("log", str(kept)),)


def command_line(name: str, config: "DataclassInstance") -> str:
    """Return the command of a configuration, with all options that differ from their defaults."""
    usual = type(config)()
    words = ["palpate", *typed_words(name)]
    for field in fields(config):
        value = getattr(config, field.name)
        if value == getattr(usual, field.name):
            continue
        option = field.name.replace("_", "-")
        if isinstance(value, bool):
            words.append(f"--{option}" if value else f"--no-{option}")
        elif value is not None:
            words += [f"--{option}", *_typed(value)]
    return shlex.join(words)


def _typed(value: object) -> list[str]:
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [word for each in value for word in _typed(each)]
    if isinstance(value, Enum):
        return [str(value.value)]
    return [str(value) if isinstance(value, str | Path) else repr(value)]
