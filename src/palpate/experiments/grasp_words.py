"""What the report on a grasp says in words and figures."""

import math

import numpy as np

from palpate.experiments.grasp import SLIPPED, SPUN, Grasp
from palpate.experiments.grasp_config import SPREADS, GraspConfig
from palpate.friction.limit_surface import LimitSurface
from palpate.reporting.data import KeyFigure
from palpate.runtime import Ending

MILLI = 1e3


def title(grasp: Grasp) -> str:
    """Return the heading."""
    config = grasp.planned.config
    fingers = {2: "two", 3: "three"}[config.fingers]
    pulled = {
        "ramp": "pulled at ever harder",
        "step": "pulled at of a sudden",
        "shake": "shaken",
        "none": "just held",
    }[config.load]
    ignoring = ", ignoring spin" if config.ignore_spin else ""
    return f"A {config.object} in {fingers} fingers, {pulled}{ignoring}"


def outcome(grasp: Grasp) -> str:
    """Return how it ended."""
    result = grasp.run
    rest = "the hand is at rest" if result.stopped else "THE HAND DID NOT COME TO REST"
    if result.ending is Ending.DONE:
        ended = f"Set down and let go after {result.duration:.1f} s; {rest}."
    elif grasp.met_early:
        ended = (
            f"Ended after {result.duration:.1f} s on the way down, for the object met something higher up than "
            f"what it stood on, as one does that has tilted; the grip was kept, and {rest}."
        )
    elif result.ending is Ending.LOST:
        ended = (
            f"Ended after {result.duration:.1f} s, for a finger felt nothing, or nothing to be believed; the grip "
            f"was kept, and {rest}."
        )
    elif result.ending is Ending.TRIPPED:
        ended = f"Stopped by the supervisor: {result.why}; the grip was kept, and {rest}."
    else:
        ended = (
            f"Not finished ({result.ending.value}) after {result.duration:.1f} s; the grip was kept, and {rest}."
        )
    if not grasp.counted.any():
        return f"{ended} Nothing was held long enough to be pulled at."
    if grasp.dropped:
        return f"The object was dropped. {ended}"
    if grasp.slip > SLIPPED or grasp.spin > SPUN:
        return f"The object slipped by {_mm(grasp.slip)} and spun by {_degrees(grasp.spin)}. {ended}"
    return f"The object neither slipped nor spun. {ended}"


def key_figures(grasp: Grasp) -> tuple[KeyFigure, ...]:
    """Return the key figures."""
    counted = grasp.counted & np.isfinite(grasp.least)
    most = float(grasp.felt[counted].max()) if counted.any() else math.nan
    figures = [
        KeyFigure("dropped", "yes" if grasp.dropped else "no", "", ""),
        KeyFigure(
            "slip", MILLI * grasp.slip, "mm", f"largest while pulled; counts above {MILLI * SLIPPED:g} mm", 2
        ),
        KeyFigure("spin", math.degrees(grasp.spin), "degrees", f"likewise; above {math.degrees(SPUN):g}", 2),
        KeyFigure("grip over the least", grasp.grip_ratio, "", "mean over mean, while pulled", 3),
        KeyFigure("tightest", grasp.tightest, "", "smallest of that at any instant; below 1 it slips", 3),
        KeyFigure("largest grip", most, "N", "true, mean of the fingers, while pulled", 3),
        KeyFigure("alarms while pulled", float(len(grasp.pulled_alarms)), "", _who_tells(grasp.planned.config)),
        KeyFigure("slips answered", float(grasp.regrips), "", "by a firmer grip, in the whole run"),
    ]
    figures += [
        KeyFigure(
            f"alarm after slip, finger {onset.finger + 1}", MILLI * onset.latency, "ms", _late(onset.latency), 3
        )
        for onset in grasp.onsets
    ]
    return tuple(figures)


def compared(grasp: Grasp) -> tuple[tuple[str, str, str], ...]:
    """Return figures beside those of a control that ignores spin; empty without it."""
    other = grasp.beside
    if other is None:
        return ()
    return (
        ("", "with spin", "ignoring spin"),
        ("dropped", _yes(grasp.dropped), _yes(other.dropped)),
        ("slip", _mm(grasp.slip), _mm(other.slip)),
        ("spin", _degrees(grasp.spin), _degrees(other.spin)),
        ("grip over the least", f"{grasp.grip_ratio:.3g}", f"{other.grip_ratio:.3g}"),
    )


def account(grasp: Grasp) -> tuple[str, ...]:
    """Return what was seen, in words."""
    config, planned = grasp.planned.config, grasp.planned
    of_mu, of_e = SPREADS[config.known]
    told = {
        "touched": "That is what a touch told before",
        "nudged": "A nudge before the lift then told it closer",
        "untouched": "Nobody has touched it before: the grip is planned for the least that is likely",
    }[config.known]
    if planned.known:
        source = f"What was believed comes from {config.friction_file}, with its intervals."
    else:
        source = f"{told}; the truth lies within {of_mu:.0%} and {of_e:.0%} of what was believed at first."
    said = [
        f"Contacts truly bore {_bears(planned.true)}, and were believed to bear {_bears(planned.believed)}. "
        f"{source}"
    ]
    if grasp.counted.any():
        said.append(_of_grip(grasp))
    if config.load == "shake":
        said.append(
            "A load that shakes needs a grip that swings; the control keeps that of the peaks, for it "
            "lets go slowly. So the mean over the least is larger than for a load that grows."
        )
    if grasp.onsets:
        at = ", ".join(f"finger {onset.finger + 1} at {onset.time:.3f} s" for onset in grasp.onsets)
        said.append(f"By the truth it began to slip: {at}.")
    other = grasp.beside
    if other is not None:
        fate = (
            "dropped it"
            if other.dropped
            else f"let it spin by {_degrees(other.spin)} and slip by {_mm(other.slip)}"
        )
        said.append(
            f"The same with Coulomb's law alone, f_n = f_t / mu with the same margin, {fate}: a pull "
            f"{MILLI * config.offset:g} mm beside the fingers turns an object rather than drags it."
        )
    return tuple(said)


def settings(grasp: Grasp) -> tuple[tuple[str, str], ...]:
    """Return what was asked for, with units."""
    planned = grasp.planned
    config = planned.config
    size = " x ".join(f"{MILLI * length:g}" for length in config.sizes)
    kept = grasp.run.recording
    return (
        ("object", f"{config.object}, {size} mm, {config.mass:g} kg"),
        ("hand", f"{config.fingers} fingers"),
        ("friction is simulated by", "the friction plant" if config.plant else "MuJoCo"),
        ("friction is", config.known),
        ("load", _load(config)),
        ("lifted", f"{MILLI * config.lift_height:g} mm, at {MILLI * config.lift_speed:g} mm/s"),
        ("margin", f"{config.margin:.0%}"),
        ("control", "ignores spin" if config.ignore_spin else "limit surface"),
        (
            "sensors",
            f"noise {MILLI * config.force_noise:g} mN and {MILLI * config.moment_noise:g} mN m, drift "
            f"{MILLI * config.drift:g} mN/s, seed {config.seed}",
        ),
        ("control period", "1 ms"),
        *((("log", str(kept)),) if kept is not None and kept.path is not None else ()),
    )


def _of_grip(grasp: Grasp) -> str:
    over = f"{grasp.grip_ratio:.3g} times the least that theory allows ({grasp.tightest:.3g} at the tightest)"
    if grasp.dropped:
        return f"Until it was lost the grip was {over}."
    if grasp.slip > SLIPPED or grasp.spin > SPUN:
        return f"The grip was {over}: at some instants a contact bore less than its load, and gave way."
    return f"The grip was {over}, so that every load stayed within its limit surface."


def _who_tells(config: GraspConfig) -> str:
    if config.known == "touched":
        return "a load that comes up to the limit surface believed in"
    return "a load that follows the ripple on the grip"


def _late(latency: float) -> str:
    if math.isnan(latency):
        return "never told"
    return "before it slipped" if latency < 0.0 else "after the truth"


def _load(config: GraspConfig) -> str:
    if config.load == "none":
        return "its own weight"
    beside = f"{MILLI * config.offset:g} mm beside the contacts"
    if config.load == "shake":
        shake = f"{config.largest_pull:g} N at {config.shake_frequency:g} Hz, up and down and sideways"
        return f"{config.pull_before:g} N down and {shake}, {beside}, for {config.rising:g} s"
    return f"{config.pull_before:g} to {config.largest_pull:g} N down in {config.rising:g} s, {beside}"


def _bears(surface: LimitSurface) -> str:
    return f"mu = {surface.friction:.3g}, e = {MILLI * surface.spin_length:.3g} mm"


def _yes(what: bool) -> str:
    return "yes" if what else "no"


def _mm(length: float) -> str:
    return f"{MILLI * length:.2g} mm"


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.2g} degrees"
