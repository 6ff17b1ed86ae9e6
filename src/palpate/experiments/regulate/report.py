"""The report on a regulation of force, put together."""

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.kit.repeat_words import repeat_commands
from palpate.experiments.kit.report_advice import advice_on_regulation
from palpate.experiments.regulate.figures import key_figures, margins
from palpate.experiments.regulate.report_data import BodeCurve, RegulationReport, StepCurves
from palpate.experiments.regulate.response import SETTLED
from palpate.experiments.regulate.run import Regulation
from palpate.experiments.regulate.words import limits, outcome, settings, title
from palpate.reporting.data import TimeSeries


def regulation_report(regulation: Regulation) -> RegulationReport:
    """Return the report on a regulation."""
    record = regulation.record
    sensed, true = regulation.sensed_force, regulation.true_force
    known = regulation.truth.known
    curves, tones = _steps(regulation) if known else None, regulation.tones(regulation.judged_force)
    felt = regulation.tones(_filled(sensed))
    return RegulationReport(
        title=title(regulation),
        outcome=outcome(regulation),
        summary=key_figures(regulation),
        margins=margins(regulation.planned),
        settings=settings(regulation),
        series=TimeSeries(
            time=record.time,
            phase=[str(phase) for phase in record.phase],
            measured_force=sensed,
            set_force=regulation.set_force,
            spin_torque=np.where(record.touching, record.spin_torque, np.nan),
            speed=np.linalg.norm(record.velocity, axis=1),
            true_force=np.where(regulation.truth.touching, true, np.nan) if known else None,
        ),
        timing=regulation.run.timing,
        steps=curves,
        tones=tuple(
            BodeCurve(name, answer.frequency, answer.gain, answer.phase_deg)
            for name, answer in (("true", tones if known else None), ("felt", felt))
            if answer is not None
        ),
        bandwidth=None if tones is None else tones.bandwidth,
        limits=limits(regulation.planned),
        asked=_asked(regulation),
        advice=advice_on_regulation(regulation),
        repeat=repeat_commands("regulate", regulation.planned.config, regulation.run),
    )


def _asked(regulation: Regulation) -> str:
    config = regulation.planned.config
    return (
        f"a {config.profile} force of {config.force:g} N on a {config.object} (surface: {config.surface}), while "
        f"the tip's motion is: {config.motion}; carried by {config.robot}"
    )


def _steps(regulation: Regulation) -> StepCurves | None:
    true = regulation.steps(regulation.true_force)
    if true is None:
        return None
    sensed = regulation.steps(_filled(regulation.sensed_force))
    return StepCurves(true.time, None if sensed is None else sensed.mean, true.mean, true.each, true.rise, SETTLED)


def _filled(force: FloatArray) -> FloatArray:
    """A force that is not felt is none."""
    return np.nan_to_num(force, nan=0.0)
