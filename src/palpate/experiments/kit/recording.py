"""Output of a run: its log, its report and its files."""

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path

from palpate.errors import InvalidValueError
from palpate.experiments.kit.config_file import (
    EXPERIMENT_TEXT,
    VERSIONS_TEXT,
    config_text,
    experiment_in,
    read_config,
    versions_text,
)
from palpate.experiments.kit.experiment import Experiment, Plan, Result
from palpate.experiments.kit.options import lasting
from palpate.experiments.kit.output_folder import make_folder
from palpate.experiments.kit.registry import experiment_named, reference_to
from palpate.extras import MissingLibraryError
from palpate.reporting.figure_kind import FigureKind
from palpate.reporting.page import write_report
from palpate.reporting.report import Report
from palpate.robots.robot import ROBOT_TEXT, read_robot
from palpate.runtime import RunResult
from palpate.runtime.log import LogWriter, new_log_path
from palpate.runtime.log.standard.cloud import Cloud
from palpate.runtime.log.standard.topics import PLAIN_ROBOT, RobotNotes
from palpate.runtime.log.told_log import add_topics

REPORT = "report.html"
"""Every run writes one."""

FIGURES = "figures"
"""Folder of its pictures as files, where they are asked for."""


def log_texts(experiment: Experiment, plan: Plan) -> dict[str, str]:
    """Return all that a log keeps, by file name: from it the very same is planned again."""
    robot = {} if plan.robot is None else plan.robot.texts
    asked = config_text(reference_to(experiment), plan.config)
    return {EXPERIMENT_TEXT: asked, **robot, **plan.attachments(), VERSIONS_TEXT: versions_text()}


def log_writer(experiment: Experiment, plan: Plan, folder: Path) -> LogWriter:
    """Return the writer of a log from which the run can be replayed."""
    path = new_log_path(folder, datetime.now())  # local time: people look for it by their clock
    return LogWriter(path, log_texts(experiment, plan))


def robot_notes(plan: Plan) -> RobotNotes:
    """Return what topics that other tools read need to know of a plan's robot."""
    return RobotNotes(plan.hand_kinematics, tuple(finger.gives_wrenches for finger in plan.fingers))


def notes_in(texts: Mapping[str, str]) -> RobotNotes:
    """Return the same of the robot of a log, from the texts that it keeps; what they do not tell is not noted."""
    try:
        text = texts[EXPERIMENT_TEXT]
        experiment = experiment_named(experiment_in(text))
        robot = read_robot(texts) if ROBOT_TEXT in texts else None
        return robot_notes(experiment.plan(lasting(read_config(text, experiment.Config)), robot, texts))
    except (KeyError, InvalidValueError, MissingLibraryError):
        return PLAIN_ROBOT


def tell_log(plan: Plan, run: RunResult, cloud: Cloud | None = None) -> None:
    """Write the log of a run anew with topics that other tools read; where something of it is lost, it stays.

    Args:
        plan: Of the run.
        run: How it ended.
        cloud: What was found.

    Raises:
        OSError: The log cannot be written; it is as it was.
    """
    recording = run.recording
    if recording is not None and recording.path is not None and recording.problem is None:
        add_topics(recording.path, robot_notes(plan), cloud)


def write_result(
    experiment: Experiment, result: Result, report: Report, folder: Path, figures: FigureKind | None = None
) -> tuple[Path, ...]:
    """Write report and files of a run into a folder, which is made if need be.

    Args:
        experiment: That was carried out.
        result: What it found.
        report: On it.
        folder: Where to.
        figures: As which files the report's pictures are written, too; None: as none.

    Returns:
        The files, the report first.

    Raises:
        InvalidValueError: The folder cannot be made.
        OSError: A file cannot be written.
    """
    make_folder(folder)
    write_report(report, folder / REPORT)
    written = [folder / REPORT, *write_figures(report, folder, figures)]
    for name, write in experiment.files(result).items():
        write(folder / name)
        written.append(folder / name)
    return tuple(written)


def write_figures(report: Report, folder: Path, kind: FigureKind | None) -> tuple[Path, ...]:
    """Write the pictures of a report into `FIGURES` within a folder; none for None.

    Raises:
        OSError: A file cannot be written.
    """
    if kind is None:
        return ()
    from palpate.reporting.paper import write_figures_of  # with matplotlib, for which only those who ask wait

    make_folder(folder / FIGURES)
    return write_figures_of(report, folder / FIGURES, kind)


def written(result: RunResult, files: tuple[Path, ...]) -> tuple[Path, ...]:
    """Return all files of a run: its report and tables, and its log."""
    log = None if result.recording is None else result.recording.path
    return files if log is None else (*files, log)
