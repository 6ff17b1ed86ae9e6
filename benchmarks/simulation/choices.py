"""The choices that are compared, by kind of scene."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from palpate.errors import InvalidValueError
from palpate.sim import Cone, Fidelity, Integrator, Stage
from palpate.sim.contact_law import pair_parameters
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.presets import ARM, EXPLORE, GRASP
from simulation.exploring import TIP, Touching
from simulation.grasping import Holding

PRESET = "preset"


@dataclass(frozen=True, slots=True)
class Choice:
    """One way to simulate a scene.

    Attributes:
        name: Name in tables.
        way: The way: `Touching` or `Holding`.
        series: Choices of one series are joined in the picture.
        comparable: Whether it is the same scene, computed in another way: these compete for the front.
    """

    name: str
    way: Touching | Holding
    series: str
    comparable: bool = True


STEPS, HAND_STEPS = (0.1e-3, 0.25e-3, 0.5e-3, 1e-3), (0.25e-3, 0.5e-3, 1e-3)  # [s]
STIFFNESSES = ((2e3, 2e-3), (20e3, 1e-3), (100e3, 0.5e-3), (500e3, 0.25e-3))
"""[N/m], and about the longest time step that the law allows on a stage [s]."""

REACH_STIFFNESS = 100e3
"""[N/m] A stiff fingertip, which a scene for touching must allow without another time step."""

REACH_FRICTIONS, REACH_FORCE, REACH_MASS = (0.05, 1.0), 0.5, 2.0
"""Friction from wet to rubber, from half a newton on, on a stage of 2 kg, which it must allow as well [-, N,
kg]."""


def common_choices(base: Touching | Holding, steps: Sequence[float], impedances: Sequence[float]) -> list[Choice]:
    """Return the preset, and choices that touching and holding share."""
    found = [Choice(PRESET, base, PRESET)]
    for integrator in Integrator:
        for step in steps:
            computed = Fidelity(step, integrator)
            if computed != base.fidelity:
                name = f"{integrator.value}, {1e3 * step:g} ms"
                found.append(Choice(name, replace(base, fidelity=computed), integrator.value))
    pyramid = replace(base.fidelity, cone=Cone.PYRAMIDAL)
    found.append(Choice("pyramidal cone", replace(base, fidelity=pyramid), "pyramidal cone"))
    for impedance in impedances:
        if isinstance(base, Touching):
            other = replace(base, law=replace(base.law, impedance=impedance))
        else:
            other = replace(base, impedance=impedance)
        found.append(Choice(f"impedance {impedance:g}", other, "impedance"))
    found.append(Choice(COLLIDING, replace(base, every_collision=True), COLLIDING))
    return found


COLLIDING = "every collision on"


def touch_choices(base: Touching) -> list[Choice]:
    """Return all choices around a preset for touching, the preset first."""
    law, found = base.law, common_choices(base, STEPS, (0.005, 0.01, 0.05, 0.2, 0.5))
    plant = FrictionLaw(law.friction, law.friction, spin_length=law.spin_length)
    found.append(Choice("friction plant", replace(base, plant=plant), "friction plant"))
    for stiffness, step in STIFFNESSES:
        fidelity = replace(base.fidelity, time_step=step)
        stiff, period = replace(law, stiffness=stiffness), max(step, base.period)
        other = replace(base, law=stiff, fidelity=fidelity, period=period)
        found.append(Choice(f"{1e-3 * stiffness:g} kN/m, {1e3 * step:g} ms", other, "stiffness", comparable=False))
    return found


def hold_choices() -> list[Choice]:
    """Return all choices around the preset for a grasp, the preset first."""
    base = Holding()
    found = common_choices(base, HAND_STEPS, (0.05, 0.2, 0.9))
    ratios = (1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7)
    found += [
        Choice(f"impratio {ratio:g}", replace(base, impratio=ratio), "impratio")
        for ratio in ratios
        if ratio != base.impratio
    ]
    for stiffness in (2e3, 40e3):
        other = replace(base, law=replace(base.law, stiffness=stiffness))
        found.append(Choice(f"{1e-3 * stiffness:g} kN/m", other, "stiffness", comparable=False))
    return found


def reaches(touching: Touching) -> str:
    """Return what a scene could not be built for, of what it must allow without another time step."""
    law, step = touching.law, touching.fidelity.time_step
    stage = 1.0 / (EXPLORE.carrier.mass + TIP.mass) if isinstance(EXPLORE.carrier, Stage) else 0.2
    light = 1.0 / (REACH_MASS + TIP.mass)
    try:
        pair_parameters(replace(law, stiffness=REACH_STIFFNESS), stage, step)
    except InvalidValueError:
        return f"no {1e-3 * REACH_STIFFNESS:g} kN/m"
    for friction in REACH_FRICTIONS:
        try:
            pair_parameters(replace(law, friction=friction, smallest_force=REACH_FORCE), light, step)
        except InvalidValueError:
            return f"no mu {friction:g} on {REACH_MASS:g} kg"
    return ""


STAGE_BASE, GRASP_BASE = Touching(), Holding(GRASP.fidelity)
ARM_BASE = Touching(ARM.fidelity, ARM.law, ARM.carrier)
