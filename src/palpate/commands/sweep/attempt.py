"""One run of a sweep: the one function that every worker calls, whoever runs it."""

import platform
import time
import traceback
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.commands.sweep.record import RunRecord, RunStatus
from palpate.experiments.kit.config_file import read_config
from palpate.experiments.kit.figure import figures_of
from palpate.experiments.kit.recording import log_writer, write_result
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.repeat_words import repeat_commands
from palpate.experiments.kit.versions import versions
from palpate.runtime import Ending

if TYPE_CHECKING:
    from palpate.experiments.kit.experiment import Experiment, Result


@dataclass(frozen=True, slots=True, eq=False)
class RunCase:
    """What a worker is given: texts, so that it needs nothing that only the process has where it was typed.

    Attributes:
        run: Number of the run.
        digest: Of what is asked.
        experiment: What finds it, wherever the worker stands.
        config: Its configuration, as `palpate.experiments.kit.config_file` writes it,
        seed: but for the seed.
        folder: For report, log and files of the run; None if they are not kept.
    """

    run: int
    digest: str
    experiment: str
    config: str
    seed: int
    folder: Path | None = None


def attempt(case: RunCase) -> RunRecord:
    """Do a run. What it raises is told in its record; figures depend on the configuration alone."""
    began = time.perf_counter()
    try:
        import palpate.robots.values  # noqa: F401  # the first run of a process imports for seconds: not its own

        experiment = experiment_named(case.experiment)
        began = time.perf_counter()
        result = _carried_out(case, experiment)
        figures = figures_of(experiment, result)
    except Exception as error:
        return RunRecord(
            run=case.run,
            digest=case.digest,
            seed=case.seed,
            status=RunStatus.FAILED,
            message=one_line("".join(traceback.format_exception_only(error))),
            traceback=traceback.format_exc(),
            duration=time.perf_counter() - began,
            host=platform.node(),
            versions=versions(),
        )
    done = result.run.ending is Ending.DONE
    return RunRecord(
        run=case.run,
        digest=case.digest,
        seed=case.seed,
        status=RunStatus.DONE if done else RunStatus.UNFINISHED,
        message="" if done else one_line(str(result.run)),
        duration=time.perf_counter() - began,
        host=platform.node(),
        figures=figures,
        versions=versions(),
    )


def _carried_out(case: RunCase, experiment: "Experiment") -> "Result":
    from palpate.experiments.kit.recorded_run import RecordedRun
    from palpate.robots.values import load_named_robot

    config = replace(read_config(case.config, experiment.Config), seed=case.seed)
    if case.folder is not None:
        config = replace(config, out=case.folder)
    robot = None if config.robot is None else load_named_robot(config.robot)
    plan = experiment.plan(config, robot, {}).prepared()
    run = RecordedRun(plan)
    if case.folder is None:
        return experiment.found(plan, run.recorded(run.run()))
    went = run.run(sinks=(log_writer(experiment, plan, case.folder),))
    result = experiment.found(plan, run.recorded(went))
    repeat = repeat_commands(case.experiment, config, went)
    write_result(experiment, result, replace(experiment.report(result), repeat=repeat), case.folder)
    return result


def without_result(case: RunCase, status: RunStatus, error: str, trace: str = "") -> RunRecord:
    """Return the record of a run that could not write its own."""
    return RunRecord(
        run=case.run,
        digest=case.digest,
        seed=case.seed,
        status=status,
        message=one_line(error),
        traceback=trace,
    )


def one_line(text: str) -> str:
    """Return a text without line breaks."""
    return " ".join(text.split())
