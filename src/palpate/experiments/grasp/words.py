"""Texts of the report on a grasp."""

import math

import numpy as np

from palpate.controllers.grip.grasp import GraspStage
from palpate.experiments.grasp.config import SPREADS, GraspConfig
from palpate.experiments.grasp.notes import notes_on
from palpate.experiments.grasp.plan import GraspPlan
from palpate.experiments.grasp.result import SLIPPED, SPUN, GraspResult
from palpate.experiments.grasp.strength import LARGEST_GRIP, grip_for, largest_load
from palpate.experiments.grasp.surface import rubbed_by_plant
from palpate.experiments.grasp.truth import STAGES
from palpate.experiments.grasp.unit_text import MILLI, bears, in_degrees, in_mm, in_percent
from palpate.experiments.kit.run_report import log_row
from palpate.robots.known_truth import NOT_KNOWN
from palpate.runtime import Ending

MUCH_GRIP = 1.5
"""Times the least grip, from which on a smaller margin would do."""


def title(grasp: GraspResult) -> str:
    """Return the heading."""
    config = grasp.planned.config
    fingers = {2: "two", 3: "three"}[config.fingers]
    pulled = {
        "ramp": "pulled at ever harder",
        "step": "suddenly pulled at",
        "shake": "shaken",
        "none": "just held",
    }[config.load]
    ignoring = ", ignoring spin" if config.ignores_spin else ""
    return f"A {config.object} in {fingers} fingers, {pulled}{ignoring}"


def outcome(grasp: GraspResult) -> str:
    """Return how it ended."""
    ended = _ended(grasp)
    if not grasp.aloft.any():
        return f"{ended} Nothing was lifted."
    if not grasp.counted.any():
        return f"{_verdict(grasp)} {ended} Nothing was held long enough to be pulled at."
    return f"{_verdict(grasp)} {ended}"


MOST_TOLD = 4
"""Alarms that are told one by one."""


def _ended(grasp: GraspResult) -> str:
    """What ended it, and what became of the grip."""
    result = grasp.run
    kept = f"{_kept(grasp)}, and {result.rest}"
    after = f"after {result.duration:.1f} s"
    if result.ending is Ending.DONE and grasp.dropped:
        return f"The hand went on to the end, and opened {after}; {result.rest}."
    if result.ending is Ending.DONE:
        return f"Set down and let go {after}; {result.rest}."
    if grasp.met_early:
        return (
            f"Ended {after} while lowering, for the object met something with the fingers still "
            f"{in_mm(grasp.higher)} higher than before the lift, {_moved(grasp)}; {kept}."
        )
    if result.ending is Ending.LOST and _too_much(grasp):
        return (
            f"Ended {after} in the lift, for the object took more grip than the {LARGEST_GRIP:g} N that fingers "
            f"may press with; {kept}."
        )
    if result.ending is Ending.LOST:
        return f"Ended {after}, for a finger felt nothing, or only implausible readings; {kept}."
    if result.ending is Ending.TRIPPED:
        return f"Stopped by the supervisor: {result.why}; {kept}."
    return f"Not finished ({result.ending.value}) {after}; {kept}."


def _kept(grasp: GraspResult) -> str:
    """What became of the grip."""
    truth = grasp.truth
    if len(truth) and STAGES[truth.stage[-1]] is GraspStage.LET_GO:
        return f"it was letting go, with {np.nanmax(truth.command[-1]):.2g} N in the end"
    return "the grip was kept"


def _moved(grasp: GraspResult) -> str:
    """Why it met it there, by the truth."""
    did = []
    if grasp.slip_aloft > SLIPPED:
        did.append(f"slid by {in_mm(grasp.slip_aloft)}")
    if grasp.spin_aloft > SPUN:
        did.append(f"tilted by {in_degrees(grasp.spin_aloft)}")
    return f"for it had {' and '.join(did)}" if did else "though it had neither slid nor tilted"


def _too_much(grasp: GraspResult) -> bool:
    """Whether the hand gave up lifting with the largest grip and all fingers at the object."""
    truth = grasp.truth
    lifting = STAGES[truth.stage[-1]] is GraspStage.LIFT
    return lifting and bool(truth.touching[-1].all()) and float(truth.target[-1]) >= LARGEST_GRIP * (1.0 - 1e-9)


def _verdict(grasp: GraspResult) -> str:
    """Whether it was held, true of the whole time in the air."""
    if not grasp.truth_known:
        return f"The object was {'lost' if grasp.dropped else 'held'}, as fingers feel it."
    slip = in_mm(grasp.slip_aloft)
    if grasp.left_behind:
        return f"The object was left behind: the fingers slid up its sides by {slip}."
    held = bool(grasp.truth.touching[np.flatnonzero(grasp.aloft)[-1]].all())
    if grasp.dropped and grasp.counted.any():
        return f"The object {f'slid by {slip} in the fingers, as good as dropped' if held else 'was dropped'}."
    if not grasp.gave_way:
        return "The object neither slipped nor spun, from the lift on." if held else "The object was lost."
    pulled = f" ({in_mm(grasp.slip)} and {in_degrees(grasp.spin)} while it was pulled)"
    rate = f", {1e6 * grasp.slip_rate:.3g} um/s and {math.degrees(grasp.spin_rate):.2g} degrees/s on the mean"
    return (
        f"The object slipped by {slip} and spun by {in_degrees(grasp.spin_aloft)} in the air"
        f"{pulled + rate if grasp.counted.any() else ''}."
    )


def account(grasp: GraspResult) -> tuple[str, ...]:
    """Return what was seen, in words."""
    config, planned = grasp.planned.config, grasp.planned
    if not grasp.truth_known:
        return (
            f"Contacts were believed to bear {bears(planned.believed)} at first. {_source(grasp)}",
            *notes_on(planned),
            "What they really bear, what pulled, and whether the object crept, is unknown on a robot.",
        )
    sentences = [
        f"Contacts truly bore {bears(planned.true)}, and were believed to bear {bears(planned.believed)} at "
        f"first. {_source(grasp)}",
        *notes_on(planned),
    ]
    if grasp.alarms_aloft:
        sentences.append(_heard(grasp))
    if grasp.counted.any():
        sentences.append(_of_grip(grasp))
    if config.load == "shake":
        sentences.append(
            "A load that shakes needs a grip that swings; the control keeps that of the peaks, for it "
            "lets go slowly. So the mean over the least is larger than for a load that grows."
        )
    if grasp.onsets:
        at = ", ".join(f"finger {onset.finger + 1} at {onset.time:.3f} s" for onset in grasp.onsets)
        sentences.append(f"By the truth it began to slip: {at}.")
    other = grasp.comparison
    if other is not None:
        fate = (
            "dropped it"
            if other.dropped
            else f"let it spin by {in_degrees(other.spin_aloft)} and slip by {in_mm(other.slip_aloft)}"
        )
        sentences.append(
            f"The same with Coulomb's law alone, f_n = f_t / mu with the same margin, {fate}: a pull "
            f"{MILLI * config.offset:g} mm beside the fingers turns an object rather than drags it."
        )
    return tuple(sentences)


def asked(grasp: GraspResult) -> str:
    """Return what was asked for."""
    config = grasp.planned.config
    return (
        f"to hold a {config.object} of {config.mass:g} kg with {config.fingers} fingers and a margin of "
        f"{100.0 * config.margin:g} %, friction {config.known}, load {config.load}"
    )


def advice(grasp: GraspResult) -> tuple[str, ...]:
    """Return what to do now."""
    planned, known = grasp.planned, grasp.truth_known
    if grasp.dropped or (known and grasp.gave_way):
        return (against_slip(planned, known),)
    if known and math.isfinite(grasp.grip_ratio) and grasp.grip_ratio > MUCH_GRIP:
        much = f"It was held with {grasp.grip_ratio:.2g} times the least grip:"
        if planned.config.known == "untouched":
            return (f"{much} less would do if friction were known: {_remedy(planned.config)}.",)
        if planned.config.load != "shake":  # which takes more whatever is known: the account says so
            return (f"{much} a smaller --margin would do with less.",)
    return ()


def against_slip(planned: GraspPlan, known: bool) -> str:
    """Return what keeps it from giving way again, by why it did.

    Args:
        planned: What was done.
        known: Whether the truth is.
    """
    config = planned.config
    if config.ignores_spin:
        return "Spin was ignored: with --controller limit-surface the grip bears the torque, too."
    more = f"more than the present --margin {config.margin:g}"
    if not known:
        return f"It was lost: hold it with {more}, or find its friction out: {_remedy(config)}."
    if grip_for(config, planned.true, largest_load(config)) > LARGEST_GRIP:
        return f"No grip of at most {LARGEST_GRIP:g} N holds that load: give a smaller --pull, --offset or --mass."
    believed, true = planned.believed, planned.true
    for symbol, was, is_ in (
        ("mu", believed.friction, true.friction),
        ("e", MILLI * believed.spin_length, MILLI * true.spin_length),
    ):
        if was > (1.0 + config.margin) * is_:
            unit = "" if symbol == "mu" else " mm"
            return (
                f"It gave way because {symbol} was believed to be {was:.3g}{unit}, and is {is_:.3g}{unit}: "
                f"{_remedy(config)}."
            )
    return f"It gave way: hold it with {more}."


def _remedy(config: GraspConfig) -> str:
    """What finds friction out better than it was known."""
    if config.friction_file is not None:
        return f"rub it again (palpate friction), for {config.friction_file} is not of this surface"
    rub = "rub it first (palpate friction, and its file by --friction-file)"
    nudge = ", or let a nudge measure it before the lift (--known nudged)"
    return rub if config.known == "nudged" else rub + nudge


def settings(grasp: GraspResult) -> tuple[tuple[str, str], ...]:
    """Return what was asked for, with units."""
    planned = grasp.planned
    config = planned.config
    size = " x ".join(f"{MILLI * length:g}" for length in config.sizes)
    known = grasp.truth_known
    rubbing = "the friction plant" if rubbed_by_plant(config) else "MuJoCo"
    noise = f"noise {MILLI * config.force_noise:g} mN and {MILLI * config.moment_noise:g} mN m"
    drift = f", drift {MILLI * config.drift:g} mN/s, seed {config.seed}"
    return (
        ("object", f"{config.object}, {size} mm, {config.mass:g} kg"),
        ("hand", f"{config.fingers} fingers"),
        ("robot", "simulated hand" if planned.robot is None else planned.robot.file.name),
        ("friction is simulated by", rubbing) if known else ("friction is in truth", NOT_KNOWN),
        ("friction is", _known(config)),
        ("load", _load(config) if known else "its own weight, and whoever pulled at it"),
        ("lifted", f"{MILLI * config.lift_height:g} mm, at {MILLI * config.lift_speed:g} mm/s"),
        ("margin", in_percent(config.margin)),
        ("control", config.controller),
        ("sensors", f"{noise}{drift}" if known else noise),
        ("control period", f"{MILLI * planned.period:g} ms"),
        *log_row(grasp.run),
    )


def _source(grasp: GraspResult) -> str:
    """Where what was believed at first comes from, and what became of that."""
    planned = grasp.planned
    config = planned.config
    if planned.found is not None:
        return f"What was believed comes from {config.friction_file}."
    typed = bool(config.believed_friction or config.believed_spin_length)
    origin = {
        "touched": "" if typed else "It was measured by an earlier touch",
        "nudged": "A nudge before the lift then measured it more closely",
        "untouched": "It was never touched before: the grip is planned for the least that is likely",
        "estimated": f"It was estimated; the grip is planned to hold with {in_percent(config.probability)}, "
        "friction shared anew",
    }[config.known]
    if typed:
        return f"What was believed was typed. {origin}{'.' if origin else ''}".rstrip()
    of_mu, of_e = SPREADS[config.known]
    if config.known == "estimated":
        return f"{origin}; of what was believed, mu errs by {in_percent(of_mu)} and e by {in_percent(of_e)} (sd)."
    return f"{origin}; the truth lies within {in_percent(of_mu)} and {in_percent(of_e)} of what was believed."


def _heard(grasp: GraspResult) -> str:
    """When slip was heard, where and by what."""
    told = [
        f"at {alarm.time:.3f} s at finger {alarm.finger + 1} ({alarm.signal.value})"
        for alarm in grasp.alarms_aloft[:MOST_TOLD]
    ]
    more = len(grasp.alarms_aloft) - len(told)
    beyond = f", and {more} times more" if more else ""
    return f"Slip was heard {', '.join(told)}{beyond}; the grip was raised for it."


def _known(config: GraspConfig) -> str:
    return config.known if config.friction_file is None else f"from {config.friction_file}"


def _of_grip(grasp: GraspResult) -> str:
    over = (
        f"{grasp.grip_ratio:.3g} times the least that theory allows while it was pulled "
        f"({grasp.tightest:.3g} at the tightest, from the lift on)"
    )
    if math.isnan(grasp.grip_ratio):
        return "How the grip compares with the least that theory allows is not known: nothing was in the air then."
    if grasp.dropped:
        return f"As long as it was in the air the grip was {over}."
    if grasp.gave_way:
        return f"The grip was {over}: at some instants a contact bore less than its load, and gave way."
    if grasp.tightest < 1.0:
        return f"The grip was {over}: at some instants a bit too little, of which nothing came."
    return f"The grip was {over}, so that every load stayed within its limit surface."


def _load(config: GraspConfig) -> str:
    if config.load == "none":
        return "its own weight"
    beside = f"{MILLI * config.offset:g} mm beside the contacts"
    if config.load == "shake":
        shake = f"{config.largest_pull:g} N at {config.shake_frequency:g} Hz, up and down and sideways"
        return f"{config.pull_before:g} N down and {shake}, {beside}, for {config.rising:g} s"
    return f"{config.pull_before:g} to {config.largest_pull:g} N down in {config.rising:g} s, {beside}"
