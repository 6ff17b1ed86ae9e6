"""The report on one grasp, put together."""

import numpy as np

from palpate.experiments.grasp.figures import compared, key_figures
from palpate.experiments.grasp.heaviest import heaviest_load
from palpate.experiments.grasp.report_data import GraspReport, GraspSeries
from palpate.experiments.grasp.run import Grasp
from palpate.experiments.grasp.truth import STAGES
from palpate.experiments.grasp.words import account, outcome, settings, title
from palpate.experiments.kit.repeat_words import repeat_commands
from palpate.experiments.kit.report_advice import advice_on_grasp


def grasp_report(grasp: Grasp) -> GraspReport:
    """Return the report on a grasp."""
    beside = grasp.beside
    return GraspReport(
        title=title(grasp),
        outcome=outcome(grasp),
        summary=key_figures(grasp),
        compared=compared(grasp),
        account=account(grasp),
        settings=settings(grasp),
        surface=grasp.planned.true,
        series=series_of(grasp),
        beside=None if beside is None else series_of(beside),
        timing=grasp.run.timing,
        heaviest=heaviest_load(grasp),
        truth_known=grasp.truth_known,
        asked=_asked(grasp),
        advice=advice_on_grasp(grasp),
        repeat=repeat_commands("grasp", grasp.planned.config, grasp.run),
    )


def _asked(grasp: Grasp) -> str:
    config = grasp.planned.config
    return (
        f"to hold a {config.object} of {config.mass:g} kg with {config.fingers} fingers and a margin of "
        f"{100.0 * config.margin:g} %, friction {config.known}, load {config.load}"
    )


def series_of(grasp: Grasp) -> GraspSeries:
    """Return what happened in it over time."""
    truth = grasp.truth
    return GraspSeries(
        time=truth.time,
        stage=tuple(str(STAGES[i]) for i in truth.stage),
        wanted=truth.target,
        felt=np.asarray(grasp.felt),
        least=grasp.least,
        slip=truth.slid,
        spin=truth.turned,
        loads=truth.loads,
        slipping=grasp.slipping,
        counted=grasp.counted,
        aloft=grasp.aloft,
        alarms=tuple(alarm.time for alarm in grasp.alarms_aloft),
    )
