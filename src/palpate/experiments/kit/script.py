"""An experiment from a script: one call plans, prepares, runs and evaluates it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console

from palpate.experiments.kit.experiment import Experiment, Plan
from palpate.experiments.kit.recorded_run import carry_out
from palpate.experiments.kit.recording import log_writer, tell_log, write_result
from palpate.experiments.kit.run_report import run_report
from palpate.robots.values import load_named_robot
from palpate.runtime import Command, Observation, Observer, Sample
from palpate.runtime.progress_bar import run_bar


def plan_for(experiment: Experiment, config: Any) -> Plan:
    """Return the plan of a new run.

    Raises:
        InvalidValueError: It cannot be carried out.
    """
    robot = None if config.robot is None else load_named_robot(config.robot)
    return experiment.plan(config, robot, {})


def perform(
    experiment: Experiment,
    config: Any,
    out: str | Path | None = None,
    observers: Sequence[Observer] = (),
    *,
    progress: bool = False,
) -> Any:
    """Carry an experiment out and return its result.

    Args:
        experiment: What to do.
        config: How, an instance of its `Config`.
        out: Folder for log, report and files, made if need be; nothing is written if not given.
        observers: Called every period with sample, observation and command.
        progress: Whether a bar shows how far it has got, on a terminal or in a notebook.

    Raises:
        InvalidValueError: It cannot be carried out, or what was felt tells nothing.
        KeyboardInterrupt: The robot was stopped; its log remains, if it was recorded.
        OSError: A file cannot be written.
    """
    plan = plan_for(experiment, config).prepared()
    sinks = () if out is None else (log_writer(experiment, plan, Path(out)),)
    if progress:
        expected = plan.expected_duration
        with run_bar(Console(), expected) as bar:

            def observe(sample: Sample, now: Observation, command: Command) -> None:
                bar.show(min(now.time, expected), words=command.phase.value)

            recorded = carry_out(plan, (*observers, observe), sinks)
            result = experiment.evaluate(
                plan, replace(recorded, progress=lambda name: bar.show(expected, words=name))
            )
    else:
        result = experiment.evaluate(plan, carry_out(plan, observers, sinks))
    if out is not None:
        write_result(experiment, result, run_report(experiment, plan, result), Path(out))
        tell_log(plan, result.run, experiment.cloud(result))
    return result
