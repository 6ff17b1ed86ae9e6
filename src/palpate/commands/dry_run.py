"""`palpate EXPERIMENT --dry-run`: plans and checks everything; moves, connects and writes nothing."""

from typing import Any

from rich.console import Console

from palpate.commands.command_result import CommandResult, ExitCode, shown_quantities
from palpate.commands.earlier_run import earlier_run
from palpate.experiments.kit.experiment import Experiment
from palpate.experiments.kit.output_folder import check_folder
from palpate.experiments.kit.recording import REPORT
from palpate.experiments.kit.script import plan_for
from palpate.extras import MissingLibraryError
from palpate.open_kinds import name_of_kind
from palpate.reporting.data import Quantity
from palpate.reporting.terminal import quantities
from palpate.robots.robot import Robot
from palpate.robots.robot_kind import RobotKind
from palpate.runtime.progress import say

LOG = "<date>_<time>.mcap"
"""Name of the log; `latest.mcap` is a link to it."""


def dry_run_experiment(experiment: Experiment, config: Any) -> CommandResult:
    """Plan a run and print what it would do.

    Raises:
        InvalidValueError: It cannot be realised, the folder could not be written, or holds another command's run.
    """
    plan = plan_for(experiment, config)
    if plan.robot is None:
        plan.backend()  # building refuses what cannot be simulated; nothing moves before start()
    plan.controller()  # a wrong factory fails here, not in the run
    would = plan.dry_run()
    check_folder(config.out)
    warnings = (*would.notes, *earlier_run(config.out, experiment.name, would.files))
    robot = "the simulation alone" if plan.robot is None else _robot_text(config.robot, plan.robot)
    files = tuple(config.out / name for name in (REPORT, *would.files, LOG))
    outcome = "Everything is in order: nothing was moved, nothing was written."
    if plan.preparation:
        warnings = (f"Before that: {plan.preparation}.", *warnings)
    console = Console()
    metrics = (Quantity("robot", "", "", robot), *would.metrics)
    console.print(quantities(f"{would.task} (dry run)", outcome, metrics))
    for warning in warnings:
        say(console, f"Note: {warning}")
    say(console, f"Would be written: {', '.join(map(str, files))}")
    values, notes = shown_quantities(would.metrics)
    facts = {"dry_run": True, "task": would.task, "robot": robot}
    return CommandResult(ExitCode.DONE, outcome, values, notes, facts, files, warnings)


def _robot_text(name: str, robot: Robot) -> str:
    """Return the robot in words, and that no device was connected to."""
    backend = robot.file.backend
    real = "; its devices were not connected to" if backend.REAL else ""
    return f"{name} ({name_of_kind(backend)}){real}{_lacking(backend)}"


def _lacking(backend: RobotKind) -> str:
    try:
        backend.check_drivers()
    except MissingLibraryError:
        return "; not to be run on this computer, which lacks a client library of its devices"
    return ""
