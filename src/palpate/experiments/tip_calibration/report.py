"""The report on a tip calibration."""

import math
from collections.abc import Iterator

from palpate.experiments.tip_calibration.figures import calibration_figures
from palpate.experiments.tip_calibration.files import NEXT_FILE, ROBOT_FILE, TIP_FILE
from palpate.experiments.tip_calibration.found_tip import surface_entry, surface_sd_entry
from palpate.experiments.tip_calibration.result import TipCalibrationResult
from palpate.experiments.tip_calibration.words import (
    felt_words,
    meaning,
    outcome,
    place_rows,
    settings,
    tip_metrics,
)
from palpate.reporting.data import Quantity
from palpate.reporting.report import Figures, Paragraph, Report, Section, TextTable
from palpate.reporting.run_figures import computing
from palpate.runtime import Ending
from palpate.yaml_text import yaml_text

MILLI = 1e3


def calibration_report(result: TipCalibrationResult) -> Report:
    """Return the report."""
    fit = result.fit
    return Report(
        title="Calibration of a fingertip by touches",
        outcome=" ".join(filter(None, (outcome(result), felt_words(result)))),
        metrics=tuple(_figures(result)),
        sections=(
            Section("Figures", (Figures(lambda: calibration_figures(result)),)),
            Section("What was touched", (TextTable(place_rows(result)),)),
            Section("For the robot file", _entry(result)),
            *((computing(result.run.timing),) if result.config.moves else ()),
        ),
        asked=f"to find the fingertip of {result.config.robot} by touches",
        advice=tuple(_advice(result)),
        settings=settings(result),
        footer=(
            "Lengths in the sensor frame; wrenches that the object exerts on the finger. Standard deviations "
            "count noise, scatter of the arm and errors of the sensor's matrix."
        ),
        reached=fit is None or (result.usable and result.run.ending is Ending.DONE),
    )


def _figures(result: TipCalibrationResult) -> Iterator[Quantity]:
    fit, true = result.fit, result.judged
    if fit is None:
        yield Quantity("touches planned", len(result.next_touches))
        return
    yield from tip_metrics(fit)
    if true is not None:
        yield Quantity("true error of the size", MILLI * true.size_error(fit), "mm", "the worst length")
        yield Quantity("true error of the centre", MILLI * true.center_error(fit), "mm")
        turn = true.turn_error(fit)
        if turn is not None:
            yield Quantity("true error of the orientation", math.degrees(turn), "deg")
        yield Quantity("true error of the stiffness", 100.0 * true.stiffness_error(fit), "%")
    yield Quantity("scatter of the arm", MILLI * fit.scatter, "mm", "and of what no model has")
    yield Quantity("touches", len(fit.touches), "", "each force one")
    yield Quantity("duration", result.run.duration, "s", "of the touches that tell most")


def _entry(result: TipCalibrationResult) -> tuple[Paragraph | TextTable, ...]:
    fit = result.fit
    if fit is None:
        return ()
    text = yaml_text({"surface": surface_entry(fit, result.robot), "surface_sd": surface_sd_entry(fit)})
    where = f"{ROBOT_FILE} is the robot file with it." if result.usable else "It is not to be used yet."
    rows = [(line,) for line in text.splitlines()]
    return (Paragraph(f"Of the finger, as in {TIP_FILE}. {where} {meaning(result)}"), TextTable(rows, ("name",)))


def _advice(result: TipCalibrationResult) -> Iterator[str]:
    fit = result.fit
    if fit is None:
        yield f"Make the touches of {NEXT_FILE}, and evaluate them: palpate calibrate tip --touches touches.csv."
        return
    for broken in fit.verdict.broken:
        yield f"{broken.remedy[0].upper()}{broken.remedy[1:]}."
    if result.usable:
        yield f"Put {ROBOT_FILE} in the place of the robot file, or its surface and surface_sd into it."
    else:
        yield f"More touches: those that would tell most next are in {NEXT_FILE}."
