"""What the report on a grasp says in words and figures."""

from palpate.experiments.grasp import SLIPPED, SPUN, Grasp
from palpate.experiments.grasp_config import SPREADS, GraspConfig
from palpate.experiments.grasp_foretold import foretold
from palpate.experiments.grasp_surface import rubbed_by_plant
from palpate.experiments.grasp_unit_text import MILLI, bears, in_degrees, in_mm, in_percent
from palpate.runtime import Ending


def title(grasp: Grasp) -> str:
    """Return the heading."""
    config = grasp.planned.config
    fingers = {2: "two", 3: "three"}[config.fingers]
    pulled = {
        "ramp": "pulled at ever harder",
        "step": "suddenly pulled at",
        "shake": "shaken",
        "none": "just held",
    }[config.load]
    ignoring = ", ignoring spin" if config.ignore_spin else ""
    return f"A {config.object} in {fingers} fingers, {pulled}{ignoring}"


def outcome(grasp: Grasp) -> str:
    """Return how it ended."""
    result = grasp.run
    rest = "the hand is at rest" if result.stopped else "THE HAND DID NOT COME TO REST"
    if result.ending is Ending.DONE and grasp.dropped:
        ended = f"The hand went on to the end, and opened after {result.duration:.1f} s; {rest}."
    elif result.ending is Ending.DONE:
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
        return f"The object was {'left behind' if grasp.left_behind else 'dropped'}. {ended}"
    if grasp.slip > SLIPPED or grasp.spin > SPUN:
        return f"The object slipped by {in_mm(grasp.slip)} and spun by {in_degrees(grasp.spin)}. {ended}"
    return f"The object neither slipped nor spun. {ended}"


def account(grasp: Grasp) -> tuple[str, ...]:
    """Return what was seen, in words."""
    config, planned = grasp.planned.config, grasp.planned
    said = [
        f"Contacts truly bore {bears(planned.true)}, and were believed to bear {bears(planned.believed)} at "
        f"first. {_source(grasp)}",
        *foretold(planned),
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
            else f"let it spin by {in_degrees(other.spin)} and slip by {in_mm(other.slip)}"
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
        ("friction is simulated by", "the friction plant" if rubbed_by_plant(config) else "MuJoCo"),
        ("friction is", _known(config)),
        ("load", _load(config)),
        ("lifted", f"{MILLI * config.lift_height:g} mm, at {MILLI * config.lift_speed:g} mm/s"),
        ("margin", in_percent(config.margin)),
        ("control", "ignores spin" if config.ignore_spin else "limit surface"),
        (
            "sensors",
            f"noise {MILLI * config.force_noise:g} mN and {MILLI * config.moment_noise:g} mN m, drift "
            f"{MILLI * config.drift:g} mN/s, seed {config.seed}",
        ),
        ("control period", "1 ms"),
        *((("log", str(kept)),) if kept is not None and kept.path is not None else ()),
    )


def _source(grasp: Grasp) -> str:
    """Where what was believed at first comes from, and what became of that."""
    planned = grasp.planned
    config = planned.config
    if planned.known:
        return f"What was believed comes from {config.friction_file}."
    told = {
        "touched": "That is what a touch told before",
        "nudged": "A nudge before the lift then told it closer",
        "untouched": "Nobody has touched it before: the grip is planned for the least that is likely",
    }[config.known]
    if config.believed_friction or config.believed_spin_length:
        return f"{told}; what was believed was typed."
    of_mu, of_e = SPREADS[config.known]
    return f"{told}; the truth lies within {in_percent(of_mu)} and {in_percent(of_e)} of what was believed."


def _known(config: GraspConfig) -> str:
    return config.known if config.friction_file is None else f"told by {config.friction_file}"


def _of_grip(grasp: Grasp) -> str:
    over = f"{grasp.grip_ratio:.3g} times the least that theory allows ({grasp.tightest:.3g} at the tightest)"
    if grasp.dropped:
        return f"Until it was lost the grip was {over}."
    if grasp.slip > SLIPPED or grasp.spin > SPUN:
        return f"The grip was {over}: at some instants a contact bore less than its load, and gave way."
    return f"The grip was {over}, so that every load stayed within its limit surface."


def _load(config: GraspConfig) -> str:
    if config.load == "none":
        return "its own weight"
    beside = f"{MILLI * config.offset:g} mm beside the contacts"
    if config.load == "shake":
        shake = f"{config.largest_pull:g} N at {config.shake_frequency:g} Hz, up and down and sideways"
        return f"{config.pull_before:g} N down and {shake}, {beside}, for {config.rising:g} s"
    return f"{config.pull_before:g} to {config.largest_pull:g} N down in {config.rising:g} s, {beside}"
