"""The report on a run: an experiment's own, with what follows from how the run ended."""

from dataclasses import replace
from typing import TYPE_CHECKING

from palpate.experiments.kit.advice import advice_on_ending
from palpate.experiments.kit.experiment import Experiment, Plan, Result
from palpate.experiments.kit.registry import reference_to
from palpate.experiments.kit.repeat_words import repeat_commands

if TYPE_CHECKING:
    from palpate.reporting.report import Report


def run_report(experiment: Experiment, plan: Plan, result: Result) -> "Report":
    """Return an experiment's report on a run, with advice on its ending first, and the commands that repeat it.

    Where records were lost its outcome says so, and its goal is not reached.
    """
    report, name, lost = experiment.report(result), reference_to(experiment), result.run.lost_records
    if lost:
        report = replace(report, outcome=f"{report.outcome} {lost}.", reached=False)
    return replace(
        report,
        advice=(*advice_on_ending(name, plan, result.run), *report.advice),
        repeat=repeat_commands(name, plan.config, result.run),
    )
