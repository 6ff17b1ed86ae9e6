"""The report on a regulation of force, put together."""

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.regulate import Regulation
from palpate.experiments.regulate_figures import key_figures, margins
from palpate.experiments.regulate_response import SETTLED
from palpate.experiments.regulate_words import limits, outcome, settings, title
from palpate.reporting import TimeSeries
from palpate.reporting.regulation_data import BodeCurve, RegulationReport, StepCurves


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
            for name, answer in (("true", tones if known else None), ("sensed", felt))
            if answer is not None
        ),
        bandwidth=None if tones is None else tones.bandwidth,
        limits=limits(regulation.planned),
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
