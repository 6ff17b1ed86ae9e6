"""Findings of a tip calibration: its verdict and advice, and the files that these name; imports nothing heavy."""

from typing import TYPE_CHECKING

from palpate.experiments.kit.metric import Finding

if TYPE_CHECKING:
    from palpate.experiments.tip_calibration.result import TipCalibrationResult

TOUCHES_FILE, NEXT_FILE, TIP_FILE, ROBOT_FILE = "touches.csv", "next_touches.csv", "tip.yaml", "robot.yaml"
FILE_NAMES = (TOUCHES_FILE, NEXT_FILE, TIP_FILE, ROBOT_FILE)


def _unusable(result: "TipCalibrationResult") -> bool:
    return result.fit is not None and not result.usable


def _broken(result: "TipCalibrationResult") -> str:
    assert result.fit is not None
    return f"NOT to be used: {'; '.join(map(str, result.fit.verdict.broken))}."


def _broken_remedies(result: "TipCalibrationResult") -> str:
    assert result.fit is not None
    return " ".join(f"{each.remedy[0].upper()}{each.remedy[1:]}." for each in result.fit.verdict.broken)


def _outcomes(result: "TipCalibrationResult") -> str:
    counts = ", ".join(f"{count} {what.value}" for what, count in sorted(result.outcomes.items()))
    return f"Touches: {counts}."


FINDINGS = (
    Finding(
        lambda result: result.fit is None,
        remedy=f"Make the touches of {NEXT_FILE}, and evaluate them: palpate calibrate tip --touches touches.csv.",
    ),
    Finding(_unusable, _broken, _broken_remedies),
    Finding(_unusable, remedy=f"More touches: the most informative next ones are in {NEXT_FILE}."),
    Finding(
        lambda result: result.usable,
        "The tip is to be used: all assumptions were tested on the touches, and held.",
        f"Put {ROBOT_FILE} in the place of the robot file, or its surface and surface_sd into it.",
    ),
    Finding(lambda result: result.outcomes, _outcomes),
    Finding(
        lambda result: result.unrested,
        lambda result: f"{result.unrested} touches were left out, for the tip crept while it should rest.",
    ),
)
"""Verdict, outcomes of the touches, and advice."""
