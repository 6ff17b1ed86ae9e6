"""Notes before a grasp: its friction and where that comes from, and loads that will not be held."""

from typing import TYPE_CHECKING

from palpate.experiments.grasp.belief import LEAST_EXPONENT
from palpate.experiments.grasp.price import prices
from palpate.experiments.grasp.strength import LARGEST_GRIP, grip_for, largest_load
from palpate.experiments.grasp.surface import likely, rubbed_by_plant
from palpate.experiments.grasp.unit_text import SMALL, bears, in_percent
from palpate.friction.friction_file import FrictionEstimate, FrictionFile, How

if TYPE_CHECKING:  # plans take their notes from here
    from palpate.experiments.grasp.plan import GraspPlan

SAME = 1e-9
"""By which share two numbers of a surface may differ and still be the same."""


def notes_on(planned: "GraspPlan") -> tuple[str, ...]:
    """Return the notes on a plan, a sentence or two each."""
    notes, found, config = [], planned.found, planned.config
    if found is not None:
        notes = [] if planned.hand.real else [_of_surface(planned, found)]
        notes += [_of_plan(planned, found), *_of_loads(planned)]
    notes += prices(planned)
    if planned.hand.real:
        return tuple(notes)
    needed = grip_for(config, planned.true, largest_load(config))
    if needed > LARGEST_GRIP:
        notes.append(
            f"At its largest the load takes {needed:.3g} N of each finger at least, of which at most "
            f"{LARGEST_GRIP:g} N is asked: it will slip. Give a smaller --pull or --offset, or more friction."
        )
    return tuple(notes)


def _of_surface(planned: "GraspPlan", found: FrictionFile) -> str:
    """How the simulated surface and that of the file differ, and what makes them the same."""
    file, true, measured = planned.config.friction_file, planned.true, likely(found)
    given = (
        ("--friction", true.friction, found.friction),
        ("--spin-length", true.spin_length, found.spin_length),
        ("--load-exponent", true.load_exponent, found.load_exponent),
        ("--norm-exponent", true.norm_exponent, found.norm_exponent),
    )
    others = [option for option, value, finding in given if finding is not None and not _within(value, finding)]
    by = "the friction plant" if rubbed_by_plant(planned.config) else "MuJoCo"
    if not others:
        return f"The simulated object has the friction of {file}: {bears(true)}, by {by}."
    return (
        f"The simulated object does not have the friction of {file}: by {by}, {bears(true)}, where "
        f"{bears(measured)} was found. Leave out {' '.join(others)}, and it has the measured friction."
    )


def _of_plan(planned: "GraspPlan", found: FrictionFile) -> str:
    text = (
        f"The grip is planned with {bears(planned.believed)}: what was found, less what its intervals leave open."
    )
    if found.norm_exponent.how is How.ASSUMED:
        text += (
            f" p was not measured, so the worst of its range is taken, which may cost up to "
            f"{in_percent(round(_cost(found), 2))} of grip; palpate friction --fit-exponents measures it."
        )
    return text


def _of_loads(planned: "GraspPlan") -> list[str]:
    """A warning where the grip will be beyond what was rubbed with."""
    config = planned.config
    grip = (1.0 + config.margin) * grip_for(config, planned.believed, largest_load(config))
    if grip <= planned.most_rubbed:
        return []
    text = (
        f"The grip will rise to about {grip:.2g} N, but the surface was rubbed with {planned.most_rubbed:.2g} N "
        "at most: what it bears beyond is a guess"
    )
    if planned.believed.load_exponent > SMALL:
        text += ", and e is planned with as if it grew no more"
    return [f"{text}. Rub with such loads, too: palpate friction --loads."]


def _cost(found: FrictionFile) -> float:
    """By which share the least p of its range takes more grip than the largest, at most."""
    p = found.norm_exponent
    return float(2.0 ** (1.0 / max(p.lower, LEAST_EXPONENT) - 1.0 / p.upper)) - 1.0


def _within(value: float, finding: FrictionEstimate) -> bool:
    """Whether a number lies in the interval that was found."""
    return finding.lower - SAME * value <= value <= finding.upper + SAME * value
