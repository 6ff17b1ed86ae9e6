"""One run of a sweep: the function that every worker calls.

A worker imports the simulator with this module, for seconds that do not count as time of a run.
"""

import platform
import time
import traceback
from dataclasses import replace

from palpate.commands.sweep.plan import RunCase
from palpate.commands.sweep.store import RunRecord, RunStatus, one_line
from palpate.experiments.kit.config_file import read_config, versions
from palpate.experiments.kit.experiment import Experiment, Result
from palpate.experiments.kit.metric import metrics_of
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.experiments.kit.recording import log_writer, tell_log, write_result
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.run_report import run_report
from palpate.experiments.kit.script import plan_for


def attempt(case: RunCase) -> RunRecord:
    """Carry out a run. An exception goes into its record; metrics depend on the configuration alone."""
    began = time.perf_counter()
    try:
        experiment = experiment_named(case.experiment)
        result = _carried_out(case, experiment)
        status = RunStatus.DONE if result.run.done else RunStatus.UNFINISHED
        message, trace, metrics = str(result.run), "", metrics_of(experiment, result)
    except Exception as error:
        status, metrics = RunStatus.FAILED, {}
        message, trace = "".join(traceback.format_exception_only(error)), traceback.format_exc()
    return RunRecord(
        run=case.run,
        digest=case.digest,
        seed=case.seed,
        status=status,
        message="" if status is RunStatus.DONE else one_line(message),
        traceback=trace,
        duration=time.perf_counter() - began,
        host=platform.node(),
        metrics=metrics,
        versions=versions(),
    )


def _carried_out(case: RunCase, experiment: Experiment) -> Result:
    """Carry out a run without its companion; write report, log and files if requested."""
    config = replace(read_config(case.config, experiment.Config), seed=case.seed)
    if case.folder is not None:
        config = replace(config, out=case.folder)
    plan = plan_for(experiment, config).prepared()
    run = RecordedRun(plan)
    sinks = () if case.folder is None else (log_writer(experiment, plan, case.folder),)
    result = experiment.evaluate(plan, run.recorded(run.run(sinks=sinks)))
    if case.folder is not None:
        write_result(experiment, result, run_report(experiment, plan, result), case.folder)
        tell_log(plan, result.run, experiment.cloud(result))
    return result
