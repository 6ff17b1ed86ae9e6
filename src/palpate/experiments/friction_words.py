"""What the report on friction says in words: outcome and settings."""

from palpate.experiments.friction_file import How
from palpate.experiments.friction_run import RubbingRun
from palpate.friction.rubbing.sliding import FrictionMeasured
from palpate.friction.rubbing.twisting import SpinBound, SpinDoubt, SpinMeasured
from palpate.runtime import Ending


def outcome(rubbing: RubbingRun) -> str:
    """Return how it ended, and what could not be told."""
    result = rubbing.run
    rest = "the robot is at rest" if result.stopped else "THE ROBOT DID NOT COME TO REST"
    count = len(rubbing.pairs)
    if result.ending is Ending.DONE:
        said = [f"Finished after {result.duration:.1f} s: {count} rubs there and back; {rest}."]
    elif result.ending is Ending.TRIPPED:
        said = [f"Stopped by the supervisor after {count} rubs: {result.why}; {rest}."]
    elif result.ending is Ending.LOST and not count:
        said = [f"Not finished: nothing was found where the surface was looked for; {rest}."]
    else:
        said = [f"Not finished ({result.ending.value}) after {result.duration:.1f} s and {count} rubs; {rest}."]
    if rubbing.lost:
        times = "once" if rubbing.lost == 1 else f"{rubbing.lost} times"
        said.append(f"Contact was lost {times}.")
    said += _bounds(rubbing)
    said += rubbing.shortfalls
    if rubbing.planned.left_out:
        speeds = ", ".join(f"{1e3 * speed:g}" for speed in rubbing.planned.left_out)
        said.append(f"Strokes at {speeds} mm/s were left out: they would go too far on this object.")
    if any(
        each.friction.stick_slip for each in rubbing.found.loads if isinstance(each.friction, FrictionMeasured)
    ):
        said.append("It stuck and slipped by turns: mu is the kinetic one.")
    return " ".join(said)


def bound_words(value: float) -> str:
    """Return a lower bound in words."""
    return f"at least {value:.3g}"


def _bounds(rubbing: RubbingRun) -> list[str]:
    file = rubbing.file
    if file is None:
        return ["Nothing is known of its friction."]
    said = []
    if file.friction.how is How.BOUND:
        said.append(
            f"It never slipped along the surface: mu is at least {file.friction.value:.3g}, and nobody knows how "
            "much more."
        )
    spins = [each.spin for each in rubbing.found.loads]
    if any(isinstance(spin, SpinBound) for spin in spins) and not any(
        isinstance(spin, SpinMeasured) for spin in spins
    ):
        slid = any(isinstance(spin, SpinBound) and spin.doubt is SpinDoubt.SLID for spin in spins)
        why = "The finger slid more than it spun" if slid else "It never slipped about the normal"
        said.append(f"{why}: what is told of e is a lower bound.")
    elif file.spin_length is None and file.friction.how is How.MEASURED:
        said.append("The robot does not turn its tip: nothing is known of e.")
    return said


def settings(rubbing: RubbingRun) -> tuple[tuple[str, str], ...]:
    """Return what was asked for, with units."""
    planned = rubbing.planned
    config, wanted = planned.config, planned.wanted
    kept = rubbing.run.recording
    size = " x ".join(f"{1e3 * length:g}" for length in config.sizes)
    rubs = "the friction plant" if config.on_plant else "MuJoCo's friction"
    speeds = ", ".join(f"{1e3 * speed:g}" for speed in sorted({wanted.speed, *wanted.speeds}))
    air = rubbing.air
    zero = "not felt" if air is None else f"taken off; it moved by {1e3 * float(abs(air.moved[:3]).max()):.2g} mN"
    return (
        ("object", f"{config.object}, {size} mm"),
        ("rubs by", f"{rubs}: mu {config.friction:g}, e at 1 N {1e3 * config.spin_length:g} mm"),
        ("loads", f"{', '.join(f'{load:g}' for load in wanted.loads)} N"),
        ("slip speeds", f"{speeds} mm/s"),
        ("strokes", f"{1e3 * wanted.travel:g} to {1e3 * wanted.most_travel:.3g} mm"),
        ("turns", f"up to {wanted.most_spin:g} rad/s" if wanted.most_spin else "none: this robot cannot"),
        ("contact stiffness", f"{config.stiffness / 1e3:g} kN/m"),
        ("sensor's zero", zero),
        ("landing speed", f"{1e3 * planned.parameters.landing_speed:.3g} mm/s"),
        ("robot", config.robot),
        ("seed", str(config.seed)),
        ("simulated scene", str(rubbing.cost)),
        ("control period", f"{1e3 * planned.period:g} ms"),
        *((("log", str(kept)),) if kept is not None and kept.path is not None else ()),
    )
