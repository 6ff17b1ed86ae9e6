"""The report on one grasp, put together."""

import numpy as np

from palpate.experiments.grasp import Grasp
from palpate.experiments.grasp_figures import compared, key_figures
from palpate.experiments.grasp_heaviest import heaviest_load
from palpate.experiments.grasp_truth import STAGES
from palpate.experiments.grasp_words import account, outcome, settings, title
from palpate.reporting.grasp_data import GraspReport, GraspSeries


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
