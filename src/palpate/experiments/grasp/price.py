"""What foresight and wandering zeros cost a grasp in grip, reckoned beforehand."""

from typing import TYPE_CHECKING

from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.preload import RISE
from palpate.experiments.grasp.foreseen import preload_of
from palpate.experiments.grasp.strength import LARGEST_GRIP, grip_for, weight_of
from palpate.experiments.grasp.unit_text import MILLI
from palpate.experiments.grasp.wandering import wander_of

if TYPE_CHECKING:  # plans take their notes from here
    from palpate.experiments.grasp.plan import GraspPlan

TOLD = 1.1
"""Times the grip, from which on its growth is told."""


def held_before(planned: "GraspPlan") -> float:
    """Return the grip before anything grows, margin and reserve included [N]."""
    config = planned.config
    a, b, c, d, e, f = weight_of(config)
    load = (a, b, c - config.pull_before, d - config.offset * config.pull_before, e, f)
    if config.load == "none":
        load = (a, b, c, d, e, f)
    return (1.0 + config.margin) * grip_for(config, planned.believed, load) + GripParameters().reserve


def price_of_preload(planned: "GraspPlan") -> float:
    """Return by how much more every finger presses for steps that nobody announces [N]."""
    config, p = planned.config, GripParameters()
    return preload_of(config).grip(planned.believed, config.fingers, config.margin, p.lead, p.grip_rate)


def growth_in_hold(planned: "GraspPlan") -> float:
    """Return the factor by which the grip may grow while it rests: as if each zero's wander were load."""
    config, times = planned.config, planned.times
    wandered = wander_of(config, planned.hand).force * (times.end - times.begin)
    load = -weight_of(config)[2] + (0.0 if config.load == "none" else config.pull_before)
    return 1.0 + wandered * config.fingers / load


def prices(planned: "GraspPlan") -> tuple[str, ...]:
    """Return what is worth telling of both, a sentence each."""
    config, before, told = planned.config, held_before(planned), []
    if config.preload > 0.0:
        more = price_of_preload(planned)
        told.append(
            f"Preload: steps up to {config.preload:g} N in {MILLI * RISE:g} ms, {MILLI * config.offset:g} mm "
            f"aside: grip x {(before + more) / before:.2g}, which is {more:.2g} N more at every finger"
            + (f"; {LARGEST_GRIP:g} N is the most." if before + more > LARGEST_GRIP else ".")
        )
    if growth_in_hold(planned) > TOLD:
        rate = wander_of(config, planned.hand).force
        told.append(
            f"While it is held at rest the grip may grow, up to x {growth_in_hold(planned):.2g}: zeros wander by "
            f"up to {MILLI * rate:g} mN/s. They are followed; but where that looks as if the load grew at all "
            "fingers, it is held as if it had."
        )
    return tuple(told)
