"""An experiment from a script: one call plans, prepares, runs and evaluates it."""

from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from rich.console import Console

from palpate.errors import InvalidValueError, shown
from palpate.experiments.kit.experiment import Experiment, Plan
from palpate.experiments.kit.recorded_run import carry_out
from palpate.experiments.kit.recording import log_writer, tell_log, write_result
from palpate.experiments.kit.run_report import run_report
from palpate.robots.values import load_named_robot
from palpate.runtime import Observer
from palpate.runtime.progress import run_progress, say


def plan_for(experiment: Experiment, config: Any) -> Plan:
    """Return the plan of a new run.

    Raises:
        InvalidValueError: If the run cannot be carried out.
    """
    robot = None if config.robot is None else load_named_robot(config.robot)
    return experiment.plan(config, robot, {})


def _check_config(experiment: Experiment, config: object) -> None:
    """Refuse anything but the experiment's configuration, and say how to make one."""
    kind = experiment.Config
    if isinstance(config, kind):
        return
    name = f"pp.{kind.__name__}" if kind.__module__.startswith("palpate.") else kind.__name__
    with_object = isinstance(config, str) and any(each.name == "object" for each in fields(kind))
    example = f'{name}(object="{config}")' if with_object else f"{name}()"
    raise InvalidValueError(f"config = {shown(config)}: must be of the class {name}; for example {example}")


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
        experiment: Experiment to carry out.
        config: Configuration, an instance of its `Config`.
        out: Folder for log, report and files; None to write nothing.
        observers: Observers that are called every period with sample, observation and command.
        progress: Whether to show a progress bar, on a terminal or in a notebook.

    Raises:
        InvalidValueError: If `config` is of another class, or if the run cannot be carried out or evaluated.
        KeyboardInterrupt: On Ctrl-C, once the robot is stopped; the log remains.
        OSError: If a file cannot be written.
    """
    _check_config(experiment, config)
    plan = plan_for(experiment, config).prepared()
    sinks = () if out is None else (log_writer(experiment, plan, Path(out)),)
    if progress:
        console = Console()
        with run_progress(console, plan.expected_duration) as observe:
            recorded = carry_out(plan, (*observers, observe), sinks)
        result = experiment.evaluate(plan, replace(recorded, progress=lambda step: say(console, step)))
    else:
        result = experiment.evaluate(plan, carry_out(plan, observers, sinks))
    if out is not None:
        write_result(experiment, result, run_report(experiment, plan, result), Path(out))
        tell_log(plan, result.run, experiment.cloud(result))
    return result
