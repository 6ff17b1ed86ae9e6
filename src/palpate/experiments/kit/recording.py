"""Output of a run: its log, its report and its files."""

from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from palpate.errors import InvalidValueError
from palpate.experiments.kit.checks import make_folder
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
from palpate.experiments.kit.registry import experiment_named, reference_to
from palpate.extras import MissingLibraryError
from palpate.reporting.data import FigureKind
from palpate.reporting.page import WrittenReport, write_report
from palpate.reporting.report import Report
from palpate.robots.robot import ROBOT_TEXT, read_robot
from palpate.runtime import RunResult
from palpate.runtime.log import LogWriter, new_log_path
from palpate.runtime.log.standard.cloud import Cloud
from palpate.runtime.log.standard.topics import PLAIN_ROBOT, RobotNotes
from palpate.runtime.log.told_log import add_topics

REPORT_FILE = "report.html"
"""File name of the report."""


def log_texts(experiment: Experiment, plan: Plan) -> dict[str, str]:
    """Return the attachments of a log, by file name, from which the same run can be planned again."""
    robot = {} if plan.robot is None else plan.robot.texts
    asked = config_text(reference_to(experiment), plan.config)
    return {EXPERIMENT_TEXT: asked, **robot, **plan.attachments(), VERSIONS_TEXT: versions_text()}


def log_writer(experiment: Experiment, plan: Plan, folder: Path) -> LogWriter:
    """Return the writer of a log from which the run can be replayed."""
    path = new_log_path(folder, datetime.now())  # local time, by which users look for it
    return LogWriter(path, log_texts(experiment, plan))


def robot_notes(plan: Plan) -> RobotNotes:
    """Return the notes on a plan's robot that topics for other tools need."""
    return RobotNotes(plan.hand_kinematics, tuple(finger.gives_wrenches for finger in plan.fingers))


def notes_in(texts: Mapping[str, str]) -> RobotNotes:
    """Return the notes on the robot of a log, as far as its attachments have them."""
    try:
        text = texts[EXPERIMENT_TEXT]
        experiment = experiment_named(experiment_in(text))
        robot = read_robot(texts) if ROBOT_TEXT in texts else None
        return robot_notes(experiment.plan(lasting(read_config(text, experiment.Config)), robot, texts))
    except (KeyError, InvalidValueError, MissingLibraryError):
        return PLAIN_ROBOT


def tell_log(plan: Plan, run: RunResult, cloud: Cloud | None = None) -> None:
    """Rewrite the log of a run with topics for other tools; a log with lost records stays unchanged.

    Args:
        plan: Plan of the run.
        run: Ending of the run.
        cloud: Points of the map; None for none.

    Raises:
        OSError: If the log cannot be written; it stays unchanged.
    """
    recording = run.recording
    if recording is not None and recording.path is not None and recording.problem is None:
        add_topics(recording.path, robot_notes(plan), cloud)


def write_result(
    experiment: Experiment, result: Result, report: Report, folder: Path, figures: FigureKind | None = None
) -> WrittenReport:
    """Write report and files of a run into a folder, which is made if need be.

    Args:
        experiment: Experiment of the run.
        result: Result of the run.
        report: Report of the result.
        folder: Output folder.
        figures: Kind of files in which the figures are written, too; None for none.

    Returns:
        The files, the report first, and the figures that could not be drawn.

    Raises:
        InvalidValueError: If the folder cannot be made.
        OSError: If a file cannot be written.
    """
    make_folder(folder)
    written = write_report(report, folder / REPORT_FILE, figures)
    tables = experiment.files(result)
    for name, write in tables.items():
        write(folder / name)
    return replace(written, files=(*written.files, *(folder / name for name in tables)))


def written(result: RunResult, files: tuple[Path, ...]) -> tuple[Path, ...]:
    """Return all files of a run: its report and tables, and its log."""
    log = None if result.recording is None else result.recording.path
    return files if log is None else (*files, log)
