"""Findings of a grasp: the end of its outcome, and advice; imports nothing heavy."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.metrics import MAX_GRIP
from palpate.experiments.kit.metric import Finding, remedies

if TYPE_CHECKING:
    from palpate.experiments.grasp.plan import GraspPlan
    from palpate.experiments.grasp.result import GraspResult

_LARGE_GRIP_RATIO = 1.5
"""Ratio of grip and minimum above which a smaller margin is advised."""


def first_finding(findings: Sequence[Finding], subject: Any) -> Finding:
    """Return the first finding that applies to a grasp or its plan."""
    return next(each for each in findings if each.when(subject))


def _measure_friction(config: GraspConfig) -> str:
    """Return how friction is found better than it was known."""
    if config.friction_file is not None:
        return f"rub it again (palpate friction), for {config.friction_file} is not of this surface"
    rub = "rub it first (palpate friction, and its file by --friction-file)"
    return (
        rub if config.known == "nudged" else f"{rub}, or let a nudge measure it before the lift (--known nudged)"
    )


def _too_high(name: str, estimated: float, true: float, unit: str, config: GraspConfig) -> str:
    return (
        f"It gave way because the estimate of {name} was {estimated:.3g}{unit}, and the true {name} is "
        f"{true:.3g}{unit}: {_measure_friction(config)}."
    )


_SLIP_CAUSES = (
    Finding(
        lambda planned: planned.config.ignores_spin,
        remedy="Spin was ignored: with --controller limit-surface the grip carries the torque, too.",
    ),
    Finding(
        lambda planned: planned.hand.real,
        remedy=lambda planned: (
            f"It was lost: hold it with more than the present --margin {planned.config.margin:g}, or measure its "
            f"friction: {_measure_friction(planned.config)}."
        ),
    ),
    Finding(
        lambda planned: planned.needed_grip > MAX_GRIP,
        remedy=f"No grip of at most {MAX_GRIP:g} N holds that load: give a smaller --pull, --offset or --mass.",
    ),
    Finding(
        lambda planned: planned.believed.friction > (1.0 + planned.config.margin) * planned.true.friction,
        remedy=lambda planned: _too_high(
            "mu", planned.believed.friction, planned.true.friction, "", planned.config
        ),
    ),
    Finding(
        lambda planned: planned.believed.spin_length > (1.0 + planned.config.margin) * planned.true.spin_length,
        remedy=lambda planned: _too_high(
            "e", 1e3 * planned.believed.spin_length, 1e3 * planned.true.spin_length, " mm", planned.config
        ),
    ),
    Finding(
        lambda planned: True,
        remedy=lambda planned: (
            f"It gave way: hold it with more than the present --margin {planned.config.margin:g}."
        ),
    ),
)
"""Causes of slip by the plan, with the remedy; the first that applies."""


def against_slip(planned: "GraspPlan") -> str:
    """Return the remedy of an object that gave way."""
    subject: Any = planned
    return remedies((first_finding(_SLIP_CAUSES, planned),), subject)[0]


def _gave_way(grasp: "GraspResult") -> bool:
    return grasp.dropped or (grasp.truth_known and bool(grasp.gave_way))


def _held_hard(grasp: "GraspResult") -> bool:
    return grasp.truth_known and not _gave_way(grasp) and grasp.grip_ratio > _LARGE_GRIP_RATIO


FINDINGS = (
    Finding(lambda grasp: not grasp.aloft.any(), "Nothing was lifted."),
    Finding(
        lambda grasp: grasp.aloft.any() and not grasp.counted.any(),
        "Nothing was held long enough to be pulled at.",
    ),
    Finding(_gave_way, remedy=lambda grasp: against_slip(grasp.planned)),
    Finding(
        lambda grasp: _held_hard(grasp) and grasp.planned.config.known == "untouched",
        remedy=lambda grasp: (
            f"It was held with {grasp.grip_ratio:.2g} times the least grip: less would do if friction were known: "
            f"{_measure_friction(grasp.planned.config)}."
        ),
    ),
    Finding(
        # a load that shakes takes more grip in any case, as the report says
        lambda grasp: (
            _held_hard(grasp)
            and grasp.planned.config.known != "untouched"
            and grasp.planned.config.load != "shake"
        ),
        remedy=lambda grasp: (
            f"It was held with {grasp.grip_ratio:.2g} times the least grip: a smaller --margin would do with less."
        ),
    ),
)
"""Findings that end the outcome of a report, and its advice."""
