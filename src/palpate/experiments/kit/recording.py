"""Output of a run: its log, its report and its files."""

from datetime import datetime
from pathlib import Path

from palpate.experiments.kit.config_file import EXPERIMENT_TEXT, config_text
from palpate.experiments.kit.experiment import Experiment, Plan, Result
from palpate.experiments.kit.output_folder import make_folder
from palpate.experiments.kit.registry import reference_to
from palpate.experiments.kit.versions import VERSIONS_TEXT, versions_text
from palpate.reporting.report import Report
from palpate.runtime import RunResult
from palpate.runtime.log import LogWriter, new_log_path
from palpate.runtime.log.added_cloud import add_cloud
from palpate.runtime.log.standard.topics import RobotNotes

REPORT = "report.html"
"""Every run writes one."""


def log_texts(experiment: Experiment, plan: Plan) -> dict[str, str]:
    """Return all that a log keeps, by file name: from it the very same is planned again."""
    robot = {} if plan.robot is None else plan.robot.texts
    asked = config_text(reference_to(experiment), plan.config)
    return {EXPERIMENT_TEXT: asked, **robot, **plan.texts(), VERSIONS_TEXT: versions_text()}


def log_writer(experiment: Experiment, plan: Plan, folder: Path) -> LogWriter:
    """Return the writer of a log from which the run can be replayed."""
    path = new_log_path(folder, datetime.now())  # local time: people look for it by their clock
    return LogWriter(path, log_texts(experiment, plan), robot_notes(plan))


def robot_notes(plan: Plan) -> RobotNotes:
    """Return what topics that other tools read need to know of a plan's robot."""
    return RobotNotes(plan.hand_kinematics, tuple(finger.gives_wrenches for finger in plan.fingers))


def _add_found(experiment: Experiment, found: Result) -> None:
    """Add the points that were found to the run's log, if it has one that is whole.

    Raises:
        OSError: The log cannot be written; what it had before is still there.
    """
    recording = found.run.recording
    cloud = experiment.cloud(found)
    if cloud is not None and recording is not None and recording.path is not None and recording.problem is None:
        add_cloud(recording.path, cloud)


def write_result(experiment: Experiment, result: Result, report: Report, folder: Path) -> tuple[Path, ...]:
    """Write report and files of a run into a folder, which is made if need be, and points into its log.

    Returns:
        The files, the report first.

    Raises:
        InvalidValueError: The folder cannot be made.
        OSError: A file cannot be written.
    """
    from palpate.reporting.page import write_report  # with matplotlib

    make_folder(folder)
    write_report(report, folder / REPORT)
    written = [folder / REPORT]
    for name, write in experiment.files(result).items():
        write(folder / name)
        written.append(folder / name)
    _add_found(experiment, result)
    return tuple(written)


def written(result: RunResult, files: tuple[Path, ...]) -> tuple[Path, ...]:
    """Return all files of a run: its report and tables, and its log."""
    log = None if result.recording is None else result.recording.path
    return files if log is None else (*files, log)
