"""The account of a grasp: notes before it, how it ended, and what happened."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.controllers.grip.grasp import GraspStage
from palpate.controllers.grip.preload import RISE
from palpate.experiments.grasp.config import SPREADS
from palpate.experiments.grasp.findings import first_finding
from palpate.experiments.grasp.friction_belief import MIN_NORM_EXPONENT, likely_surface, rubbed_by_plant
from palpate.experiments.grasp.metrics import MAX_GRIP, SLIP_LIMIT, SPIN_LIMIT
from palpate.experiments.grasp.scene import wander_of
from palpate.experiments.grasp.truth import STAGES
from palpate.experiments.kit.metric import Finding, sentences
from palpate.friction.friction_file import How
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime import Ending

if TYPE_CHECKING:  # plans take their notes from here
    from palpate.experiments.grasp.plan import GraspPlan
    from palpate.experiments.grasp.result import GraspResult

_MAX_RELATIVE_ROUNDING = 1e-9
"""Relative difference of two equal numbers of a surface."""

_MIN_LOAD_EXPONENT = 1e-3
"""Least gamma that is shown: below, e differs by less than half a per cent from 0.01 N to 100 N."""

_GROWTH_NOTE_FACTOR = 1.1
"""Growth factor of the grip above which a note is shown."""

_MAX_LISTED_ALARMS = 4
"""Number of alarms that are listed one by one."""


def _surface_text(surface: LimitSurface) -> str:
    """Return a limit surface in words; exponents only where they differ from an ellipse of constant size."""
    text = f"mu = {surface.friction:.3g}, e = {1e3 * surface.spin_length:.3g} mm"
    if surface.load_exponent > _MIN_LOAD_EXPONENT:
        text += f" at 1 N, gamma = {surface.load_exponent:.3g}"
    return text if surface.norm_exponent == 2.0 else f"{text}, p = {surface.norm_exponent:.3g}"


def _mm(length: float) -> str:
    return "-" if math.isnan(length) else f"{1e3 * length:.2g} mm"


def _degrees(angle: float) -> str:
    return "-" if math.isnan(angle) else f"{math.degrees(angle):.2g} degrees"


def _first(findings: Sequence[Finding], grasp: "GraspResult") -> str:
    """Return the sentence of the first finding that applies."""
    return sentences((first_finding(findings, grasp),), grasp)[0]


# --- before a grasp


def _other_options(planned: "GraspPlan") -> str:
    """Return the typed options that keep the simulated surface from being the measured one."""
    found, true = planned.found, planned.true
    assert found is not None
    given = (
        ("--friction", true.friction, found.friction),
        ("--spin-length", true.spin_length, found.spin_length),
        ("--load-exponent", true.load_exponent, found.load_exponent),
        ("--norm-exponent", true.norm_exponent, found.norm_exponent),
    )
    return " ".join(
        option
        for option, value, finding in given
        if finding is not None
        and not finding.lower - _MAX_RELATIVE_ROUNDING * value
        <= value
        <= finding.upper + _MAX_RELATIVE_ROUNDING * value
    )


def _simulated_surface(planned: "GraspPlan") -> str:
    file, others = planned.config.friction_file, _other_options(planned)
    by = "the friction plant" if rubbed_by_plant(planned.config) else "MuJoCo"
    if not others:
        return f"The simulated object has the friction of {file}: {_surface_text(planned.true)}, by {by}."
    assert planned.found is not None
    return (
        f"The simulated object does not have the friction of {file}: by {by}, {_surface_text(planned.true)}, "
        f"where {_surface_text(likely_surface(planned.found))} was found. Leave out {others}, and it has the "
        "measured friction."
    )


def _planned_surface(planned: "GraspPlan") -> str:
    assert planned.found is not None
    p = planned.found.norm_exponent
    text = (
        f"The grip is planned with {_surface_text(planned.believed)}: the measured friction, lowered where its "
        "interval exceeds the margin."
    )
    if p.how is not How.ASSUMED:
        return text
    cost = 2.0 ** (1.0 / max(p.lower, MIN_NORM_EXPONENT) - 1.0 / p.upper) - 1.0
    return (
        f"{text} p was not measured: the worst of its range is taken, which may cost up to {100.0 * cost:.0f} % "
        "of grip. palpate friction --fit-exponents measures it."
    )


def _preload_cost(planned: "GraspPlan") -> str:
    config, before, more = planned.config, planned.resting_grip, planned.preload_cost
    limit = f"; {MAX_GRIP:g} N is the most" if before + more > MAX_GRIP else ""
    return (
        f"Preload: steps up to {config.preload:g} N in {1e3 * RISE:g} ms, {1e3 * config.offset:g} mm aside: grip "
        f"x {(before + more) / before:.2g}, which is {more:.2g} N more at every finger{limit}."
    )


_PLAN_FINDINGS = (
    Finding(lambda planned: planned.found is not None and not planned.hand.real, _simulated_surface),
    Finding(lambda planned: planned.found is not None, _planned_surface),
    Finding(
        lambda planned: planned.planned_grip > planned.most_rubbed,
        lambda planned: (
            f"The grip will rise to about {planned.planned_grip:.2g} N, but the surface was rubbed with "
            f"{planned.most_rubbed:.2g} N at most: its friction beyond is a guess"
            + (", planned as if e grew no more" if planned.believed.load_exponent > _MIN_LOAD_EXPONENT else "")
            + ". Rub with such loads, too: palpate friction --loads."
        ),
    ),
    Finding(lambda planned: planned.config.preload > 0.0, _preload_cost),
    Finding(
        lambda planned: planned.hold_growth > _GROWTH_NOTE_FACTOR,
        lambda planned: (
            f"In a hold at rest the grip may grow, up to x {planned.hold_growth:.2g}: zeros wander by up to "
            f"{1e3 * wander_of(planned.config, planned.hand).force:g} mN/s. The control follows them. A wander "
            "that looks like a load that grows at all fingers is held like one."
        ),
    ),
    Finding(
        lambda planned: not planned.hand.real and planned.needed_grip > MAX_GRIP,
        lambda planned: (
            f"At its largest the load takes {planned.needed_grip:.3g} N of each finger at least, and at most "
            f"{MAX_GRIP:g} N is commanded: it will slip. Give a smaller --pull or --offset, or more friction."
        ),
    ),
)
"""Notes on a plan, before the run."""


def plan_notes(planned: "GraspPlan") -> tuple[str, ...]:
    """Return the notes on a plan, a sentence or two each."""
    subject: Any = planned
    return sentences(_PLAN_FINDINGS, subject)


# --- how it ended


def _gave_up(grasp: "GraspResult") -> bool:
    """Return whether the hand gave up lifting with the largest grip and all fingers at the object."""
    truth = grasp.truth
    lifting = STAGES[truth.stage[-1]] is GraspStage.LIFT
    return lifting and bool(truth.touching[-1].all()) and float(truth.target[-1]) >= MAX_GRIP * (1.0 - 1e-9)


def _kept(grasp: "GraspResult") -> str:
    """Return the grip in the end, and whether the robot is at rest."""
    truth, kept = grasp.truth, "the grip was kept"
    if len(truth) and STAGES[truth.stage[-1]] is GraspStage.LET_GO:
        kept = f"it was letting go, with {np.nanmax(truth.command[-1]):.2g} N in the end"
    return f"{kept}, and {grasp.run.rest}."


def _moved(grasp: "GraspResult") -> str:
    """Return how the object had moved in the hand, by the truth."""
    moved = []
    if grasp.slip_aloft > SLIP_LIMIT:
        moved.append(f"slid by {_mm(grasp.slip_aloft)}")
    if grasp.spin_aloft > SPIN_LIMIT:
        moved.append(f"tilted by {_degrees(grasp.spin_aloft)}")
    return f"for it had {' and '.join(moved)}" if moved else "though it had neither slid nor tilted"


def _after(grasp: "GraspResult") -> str:
    return f"after {grasp.run.duration:.1f} s"


_ENDINGS = (
    Finding(
        lambda grasp: grasp.run.ending is Ending.DONE and grasp.dropped,
        lambda grasp: f"The hand went on to the end, and opened {_after(grasp)}; {grasp.run.rest}.",
    ),
    Finding(
        lambda grasp: grasp.run.ending is Ending.DONE,
        lambda grasp: f"Set down and let go {_after(grasp)}; {grasp.run.rest}.",
    ),
    Finding(
        lambda grasp: grasp.met_early,
        lambda grasp: (
            f"Ended {_after(grasp)} while lowering: the object met something with the fingers still "
            f"{_mm(grasp.higher)} higher than before the lift, {_moved(grasp)}; {_kept(grasp)}"
        ),
    ),
    Finding(
        lambda grasp: grasp.run.ending is Ending.LOST and _gave_up(grasp),
        lambda grasp: (
            f"Ended {_after(grasp)} in the lift: the object took more grip than the {MAX_GRIP:g} N that fingers "
            f"may press with; {_kept(grasp)}"
        ),
    ),
    Finding(
        lambda grasp: grasp.run.ending is Ending.LOST,
        lambda grasp: (
            f"Ended {_after(grasp)}: a finger felt nothing, or only implausible readings; {_kept(grasp)}"
        ),
    ),
    Finding(
        lambda grasp: grasp.run.ending is Ending.TRIPPED,
        lambda grasp: f"Stopped by the supervisor: {grasp.run.why}; {_kept(grasp)}",
    ),
    Finding(
        lambda grasp: True,
        lambda grasp: f"Not finished ({grasp.run.ending.value}) {_after(grasp)}; {_kept(grasp)}",
    ),
)
"""Ending of the run and state of the grip; the first that applies."""


def _touching_last(grasp: "GraspResult") -> bool:
    """Return whether all fingers touched the object at the end of its time in the air."""
    return bool(grasp.truth.touching[np.flatnonzero(grasp.aloft)[-1]].all())


def _motion(grasp: "GraspResult") -> str:
    text = f"The object slipped by {_mm(grasp.slip_aloft)} and spun by {_degrees(grasp.spin_aloft)} in the air"
    if not grasp.counted.any():
        return f"{text}."
    return (
        f"{text} ({_mm(grasp.slip)} and {_degrees(grasp.spin)} while it was pulled), "
        f"{1e6 * grasp.slip_rate:.3g} µm/s and {math.degrees(grasp.spin_rate):.2g} degrees/s on average."
    )


_VERDICTS = (
    Finding(
        lambda grasp: not grasp.truth_known,
        lambda grasp: f"The object was {'lost' if grasp.dropped else 'held'}, as the fingers feel it.",
    ),
    Finding(
        lambda grasp: grasp.left_behind,
        lambda grasp: f"The object was left behind: the fingers slid up its sides by {_mm(grasp.slip_aloft)}.",
    ),
    Finding(
        lambda grasp: grasp.dropped and grasp.counted.any() and _touching_last(grasp),
        lambda grasp: f"The object slid by {_mm(grasp.slip_aloft)} in the fingers, which counts as dropped.",
    ),
    Finding(lambda grasp: grasp.dropped and grasp.counted.any(), "The object was dropped."),
    Finding(lambda grasp: grasp.gave_way, _motion),
    Finding(_touching_last, "The object neither slipped nor spun, from the lift on."),
    Finding(lambda grasp: True, "The object was lost."),
)
"""Whether a lifted object was held in its whole time in the air; the first that applies."""


def outcome(grasp: "GraspResult") -> str:
    """Return whether the object was held, and how the run ended."""
    ended = _first(_ENDINGS, grasp)
    return f"{_first(_VERDICTS, grasp)} {ended}" if grasp.aloft.any() else ended


# --- what happened


def _source(planned: "GraspPlan") -> str:
    """Return the source of the friction estimate, and how it was used."""
    config = planned.config
    if planned.found is not None:
        return f"The estimate comes from {config.friction_file}."
    origin = {
        "touched": "It was measured by an earlier touch",
        "nudged": "A nudge before the lift measured it more closely",
        "untouched": "It was never touched before: the grip is planned for the least friction that is likely",
        "estimated": f"The grip is planned to hold with {100.0 * config.probability:.3g} %, friction shared anew",
    }[config.known]
    if config.believed_friction or config.believed_spin_length:
        return "The estimate was typed." + ("" if config.known == "touched" else f" {origin}.")
    of_mu, of_e = (f"{100.0 * spread:.3g} %" for spread in SPREADS[config.known])
    if config.known == "estimated":
        return f"{origin}; standard deviations of the estimate are {of_mu} of mu and {of_e} of e."
    return f"{origin}; the truth lies within {of_mu} of the first mu and {of_e} of the first e."


def _alarms(grasp: "GraspResult") -> str:
    listed = [
        f"at {alarm.time:.3f} s at finger {alarm.finger + 1} ({alarm.signal.value})"
        for alarm in grasp.alarms_aloft[:_MAX_LISTED_ALARMS]
    ]
    more = len(grasp.alarms_aloft) - len(listed)
    beyond = f", and {more} times more" if more else ""
    return f"Slip was detected {', '.join(listed)}{beyond}; the grip was raised for it."


_GRIP_CONSEQUENCES = (
    Finding(lambda grasp: grasp.dropped, ", as long as the object was in the air."),
    Finding(
        lambda grasp: grasp.gave_way, ": at some instants a contact carried less than its load, and gave way."
    ),
    Finding(lambda grasp: grasp.tightest < 1.0, ": at some instants a bit too little, without consequence."),
    Finding(lambda grasp: True, ", so that every load stayed within its limit surface."),
)


def _grip(grasp: "GraspResult") -> str:
    if math.isnan(grasp.grip_ratio):
        return "The grip cannot be compared with the theoretical minimum: nothing was in the air during the pull."
    return (
        f"The grip was {grasp.grip_ratio:.3g} times the theoretical minimum while the object was pulled "
        f"({grasp.tightest:.3g} at the tightest, from the lift on){_first(_GRIP_CONSEQUENCES, grasp)}"
    )


def _comparison(grasp: "GraspResult") -> str:
    other = grasp.comparison
    assert other is not None
    moved = f"let it spin by {_degrees(other.spin_aloft)} and slip by {_mm(other.slip_aloft)}"
    return (
        f"The same with Coulomb's law alone, f_n = f_t / mu with the same margin, "
        f"{'dropped it' if other.dropped else moved}: a pull {1e3 * grasp.planned.config.offset:g} mm beside the "
        "fingers turns an object rather than drags it."
    )


_FRICTION_FINDINGS = (
    Finding(
        lambda grasp: grasp.truth_known,
        lambda grasp: (
            f"The true contacts had {_surface_text(grasp.planned.true)}; the first estimate was "
            f"{_surface_text(grasp.planned.believed)}. {_source(grasp.planned)}"
        ),
    ),
    Finding(
        lambda grasp: not grasp.truth_known,
        lambda grasp: (
            f"The first estimate of the contacts was {_surface_text(grasp.planned.believed)}. "
            f"{_source(grasp.planned)}"
        ),
    ),
)
"""Friction of the contacts, and its estimate."""

_EVENT_FINDINGS = (
    Finding(
        lambda grasp: not grasp.truth_known,
        "True friction, pull and creep of the object are not known on a robot.",
    ),
    Finding(lambda grasp: grasp.truth_known and grasp.alarms_aloft, _alarms),
    Finding(lambda grasp: grasp.truth_known and grasp.counted.any(), _grip),
    Finding(
        lambda grasp: grasp.planned.config.load == "shake",
        "A load that shakes needs a grip that swings. The control lets go slowly and keeps the grip of the peaks, "
        "so that the mean over the least is larger than for a load that grows.",
    ),
    Finding(
        lambda grasp: grasp.truth_known and grasp.onsets,
        lambda grasp: (
            "By the truth slip began: "
            + ", ".join(f"finger {onset.finger + 1} at {onset.time:.3f} s" for onset in grasp.onsets)
            + "."
        ),
    ),
    Finding(lambda grasp: grasp.comparison is not None, _comparison),
)
"""Alarms, grip and slip of the run."""


def account(grasp: "GraspResult") -> tuple[str, ...]:
    """Return the friction, the notes before the run, and the events of the run."""
    friction = sentences(_FRICTION_FINDINGS, grasp)
    return (*friction, *plan_notes(grasp.planned), *sentences(_EVENT_FINDINGS, grasp))
