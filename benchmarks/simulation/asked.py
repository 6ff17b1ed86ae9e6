"""What was asked of the presets, and what they give."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from simulation.choices import ARM_BASE, GRASP_BASE, STAGE_BASE
from simulation.collisions import Comparison
from simulation.exploring import ELLIPSOID, SPHERE, Exploration, Explored, explore
from simulation.grasping import Hold, hold
from simulation.limit import limit_surface
from simulation.measured import SCAN, Effort, Findings, preset_beaten_by
from simulation.sensed import FACTS, STIFFNESS_ROWS, Row
from simulation.timing import Timed, measure, ratio

LIFT_FRICTIONS, LIFT_FORCES, LIFT_SPEEDS = (0.05, 0.3, 1.0), (0.5, 2.0, 5.0), (0.02, 0.05, 0.1)
"""[-, N, m/s]: over all of which a tip shall stay on a surface."""


@dataclass(frozen=True, slots=True)
class Answer:
    """One thing that was asked.

    Attributes:
        what: In words.
        asked: With its limit.
        got: What was measured.
        kept: Whether that is as asked.
    """

    what: str
    asked: str
    got: str
    kept: bool


def speed_answers(rounds: int) -> list[Answer]:
    """Time the presets against each other, in turns."""
    explorations = {
        "stage": Exploration(STAGE_BASE, SPHERE, 2.0, 0.02),
        "arm": Exploration(ARM_BASE, SPHERE, 2.0, 0.02),
    }
    runs = {kind: Timed(run) for kind, run in explorations.items()}
    for timed in runs.values():
        timed.settle(SCAN)
    runs["hand"] = Timed(Hold(GRASP_BASE))
    costs = measure(runs, rounds)
    physics, _, stage = costs["stage"].real_time_factors
    arm, hand = costs["arm"].real_time_factors[2], costs["hand"].real_time_factors[1]
    dearer = ratio(costs["arm"].whole, costs["stage"].whole)
    said = "real-time factor, 1 kHz"
    return [
        Answer(f"stage, {said}: with sensing and control", "> 25", f"{stage:.0f}", stage > 25.0),
        Answer(f"stage, {said}: physics and servo alone", "> 40", f"{physics:.0f}", physics > 40.0),
        Answer(f"arm, {said}: with sensing and control", "> 12", f"{arm:.0f}", arm > 12.0),
        Answer(f"hand holding an object, {said}: with sensing", "> 8", f"{hand:.0f}", hand > 8.0),
        Answer("cost of an arm's period over a stage's", "< 3", f"{dearer.median:.2f}", dearer.high < 3.0),
    ]


def accuracy_answers(rows: list[Row], effort: Effort, done: Callable[[], None] = lambda: None) -> list[Answer]:
    """Measure what the presets do to contacts."""
    answers = []
    for row in rows:
        if row.name in STIFFNESS_ROWS:
            known, found = FACTS[row.name], row.found
            asked = _sensed((known.to_contact, *known.on_surface, *known.spin_torque))
            errors = (found.to_contact[0], *found.on_surface, *found.spin_torque)
            got = _sensed(tuple(1e3 * error for error in errors))
            what = f"sensed at {row.name}: to contact, on surface, spin torque"
            answers.append(Answer(what, f"at most {asked}", got, row.beaten))
    limit = limit_surface()
    done()
    held = hold(GRASP_BASE)
    done()
    for kind, error in (("explore", limit.error), ("grasp", held.limit)):
        what = f"limit surface in full slip, all angles, {kind}"
        answers.append(Answer(what, "within 0.5 %", percent(error), error < 5e-3))
    got = f"{1e3 * held.creep:.2g} mm/s"
    answers.append(Answer("creep of a held object", "< 0.001 mm/s", got, abs(held.creep) < 1e-6))
    off = lift_off(effort)
    done()
    got = "never off" if not off else f"off or lost in {len(off)}: {off[0]}"
    answers.append(Answer("lift-off, explore, to 100 mm/s, mu 0.05 to 1, 0.5 to 5 N", "none", got, not off))
    return answers


def lift_off(effort: Effort) -> list[str]:
    """Return the explorations on a stage that lost the surface for a moment, or for good."""
    lost = []
    for target in (SPHERE, ELLIPSOID):
        for friction in LIFT_FRICTIONS:
            choice = replace(STAGE_BASE, law=replace(STAGE_BASE.law, friction=friction))
            for force in LIFT_FORCES:
                for speed in LIFT_SPEEDS if effort.objects > 1 else LIFT_SPEEDS[-1:]:
                    run: Explored = explore(choice, target, force, speed)
                    if not run.done or run.touching < 1.0:
                        name = type(target).__name__
                        lost.append(f"{name}, mu {friction:g}, {force:g} N, {1e3 * speed:g} mm/s")
    return lost


def collision_answers(compared: list[Comparison]) -> list[Answer]:
    """Say what every collision on does to a scene."""
    answers = []
    for each in compared:
        time = each.time
        does = "slower" if each.slower else "FASTER" if each.faster else "no difference in time that shows"
        errors = "MORE ACCURATE" if each.more_accurate else "no more accurate"
        got = f"{time.median:.3f} ({time.low:.3f} to {time.high:.3f}) of its time: {does}; {errors}"
        answers.append(
            Answer(f"{each.kind}, every collision on", "never faster nor more accurate", got, each.kept)
        )
    return answers


def front_answers(found: Findings) -> list[Answer]:
    """Say whether the presets lie on the front."""
    answers = []
    for kind, findings in (("explore", found.stage), ("arm", found.arm), ("grasp", found.grasp)):
        beaten = preset_beaten_by(findings)
        got = "on it" if not beaten else f"beaten by {', '.join(beaten)}"
        answers.append(Answer(f"preset {kind}", "on the front of speed and error", got, not beaten))
    return answers


def percent(share: float) -> str:
    """Return a share in per cent, and no more digits than mean anything."""
    return f"{100.0 * share:.1g} %" if share > 1e-8 else "< 1e-6 %"


def _sensed(errors: tuple[float, ...]) -> str:
    """Return errors of a sensed contact, given in mm and mNm, in um and uNm."""
    point, low, high, torque, most = (1e3 * error for error in errors)
    return f"{point:.3g}, {low:.3g}/{high:.3g} um, {torque:.3g}/{most:.3g} uNm"
