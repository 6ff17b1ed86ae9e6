"""Limit surfaces, as `fit_limit_surface` finds them from loads in full slip.

Thirty planned slips at 0.7 and 5 N on a surface that each seed draws (mu 0.15 to 1, e 1 to 8 mm at 1 N, gamma 0 to
1/3, p 1.15 to 1.9), whose loads scatter by 3 %; pushing loads are sixty of 8 to 12 N on one of mu 0.35, e 20 mm,
p 1.7 that scatter by 10 %, as of an object that is pushed over a table.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from trust.study import Case, Run, Study, first_finding

from palpate.friction.rubbing.slip_load import SlipLoad
from palpate.friction.rubbing.stroke_plan import planned_slips
from palpate.friction.rubbing.surface_fit import fit_limit_surface
from palpate.sim.friction.law import FrictionLaw

FORCES, SLIPS, SCATTER = (0.7, 5.0), 30, 0.03
SIGMAS = 1.96

Rng = np.random.Generator
Change = Callable[[Rng, SlipLoad], SlipLoad]


def law_of(mu: float, c: float, gamma: float, p: float) -> FrictionLaw:
    """Return a law of one mu at every speed."""
    return FrictionLaw(mu, mu, spin_length=c, load_exponent=gamma, norm_exponent=p)


def scattered(rng: Rng, load: SlipLoad, share: float) -> SlipLoad:
    """Return a load whose parts differ from stroke to stroke."""
    a, b = 1.0 + share * rng.normal(size=2)
    return replace(load, tangential_force=a * load.tangential_force, spin_torque=b * load.spin_torque)


def judged(loads: Sequence[SlipLoad], law: FrictionLaw) -> Run:
    """Fit, and compare with the law."""
    found = fit_limit_surface(loads)
    surface = found.surface
    values = surface.friction, surface.spin_length, surface.load_exponent, surface.norm_exponent
    true = law.kinetic_friction, law.spin_length, law.load_exponent, law.norm_exponent
    # at one force gamma is not asked
    names = ["mu", "e", "gamma", "p"] if len({load.normal_force for load in loads}) == len(FORCES) else ["mu", "p"]
    z = dict(
        zip(["mu", "e", "gamma", "p"], np.abs(np.subtract(values, true)) / found.standard_deviations, strict=True)
    )
    return Run(
        found.verdict.ok,
        float(max(z[name] for name in names)),
        {name: float(z[name] <= SIGMAS) for name in names},
        first_finding(found.verdict),
    )


def planned(seed: int, change: Change) -> Run:
    """Rub a surface in the slips that are planned for it."""
    rng = np.random.default_rng((seed, 3))
    law = law_of(
        rng.uniform(0.15, 1.0), rng.uniform(1e-3, 8e-3), rng.uniform(0.0, 1.0 / 3.0), rng.uniform(1.15, 1.9)
    )
    e = law.spin_length_at(FORCES[0]), law.spin_length_at(FORCES[1])
    loads = []
    for k, slip in enumerate(planned_slips(FORCES, e, SLIPS)):
        force, torque = law.slipping_load(slip.normal_force, slip.speed, slip.spin)
        load = SlipLoad(slip.normal_force, force, torque, slip.speed, slip.spin, k * math.pi / 3.0)
        loads.append(change(rng, scattered(rng, load, SCATTER)))
    return judged(loads, law)


def pushing_loads(seed: int, inside: float, noise: float) -> tuple[list[SlipLoad], FrictionLaw]:
    """Return loads of an object that is pushed over a table, of which a share does not slip, and their law."""
    rng, law, loads = np.random.default_rng(seed), law_of(0.35, 0.02, 0.0, 1.7), []
    for _ in range(60):
        force, angle = rng.uniform(8.0, 12.0), rng.uniform(0.0, 0.5 * math.pi)
        speed, spin = 0.02 * math.cos(angle), math.sin(angle)
        f, t = law.slipping_load(force, speed, spin)
        share = rng.uniform(0.0, 1.0) if rng.random() < inside else 1.0
        load = scattered(rng, SlipLoad(force, share * f, share * t, speed, spin), 0.1)
        noisy = load.tangential_force + noise * rng.normal(), load.spin_torque + 0.02 * noise * rng.normal()
        loads.append(replace(load, tangential_force=noisy[0], spin_torque=noisy[1]))
    return loads, law


def by_heading(share: float, rng: Rng, load: SlipLoad) -> SlipLoad:
    """Return friction that is more along one axis than across it."""
    part = math.hypot((1.0 + share) * math.cos(load.heading), (1.0 - share) * math.sin(load.heading))
    return replace(load, tangential_force=part * load.tangential_force)


def some(part: float, factor: float, rng: Rng, load: SlipLoad) -> SlipLoad:
    """Return a share of loads that are larger or smaller than all others."""
    wrong = factor if rng.random() < part else 1.0
    return replace(load, tangential_force=wrong * load.tangential_force, spin_torque=wrong * load.spin_torque)


def case(name: str, change: Change, *, holds: bool = False) -> Case:
    """Return planned slips with a change."""
    return Case(name, lambda seed: planned(seed, change), holds)


STUDY = Study(
    "limit surface",
    (
        case("as assumed", lambda rng, load: load, holds=True),
        case("scatter of 10 %", lambda rng, load: scattered(rng, load, 0.1), holds=True),
        case("5 % of loads 1.5 times as large", partial(some, 0.05, 1.5)),
        case("20 % of loads inside", partial(some, 0.2, 0.5)),
        case("anisotropy 10 %", partial(by_heading, 0.05)),
        case("anisotropy 30 %", partial(by_heading, 0.15)),
        case("torque in mN m", lambda rng, load: replace(load, spin_torque=1e3 * load.spin_torque)),
        Case("pushing loads", lambda seed: judged(*pushing_loads(seed, 0.0, 0.5))),
        Case("pushing loads, half do not slip", lambda seed: judged(*pushing_loads(seed, 0.5, 0.0))),
        Case("pushing loads, 80 % do not slip", lambda seed: judged(*pushing_loads(seed, 0.8, 0.5))),
    ),
)
