"""The contact between fingertips and what they hold: stiff, and without creep.

A held object hangs on friction for minutes, so that what counts is creep; sliding is short, so that lift-off does
not. Hence other numbers than `palpate.sim.contact_law.ContactLaw` derives for exploring: impedance, friction
damping are fixed: elliptic cones, d0 0.5, b_f 200, no noslip at 1 ms; and impratio is 1e6 unless a law says
otherwise. A load f_t then creeps by f_t / (Dn impratio b_f) with Dn = d0 / ((1 - d0) A): an object of mass m in n
fingers by g / (n impratio b_f), 0.025 um/s in two, whatever its mass.
"""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, check_positive, positive
from palpate.sim.contact_law import LARGEST_FRICTION_STEP, PairParameters, solimp, solref

IMPEDANCE = 0.5
"""MuJoCo's d0 for held objects."""

FRICTION_STEP = LARGEST_FRICTION_STEP
"""b_f dt: 200 1/s at a time step of 1 ms."""

IMPRATIO = 1e6
"""Of friction to normal impedance: ten times less creeps ten times faster and costs the same
(benchmarks/simulation)."""

LARGEST_CONTACT_STEP = 0.5
"""Of sqrt(K A) dt, the contact's own angle per time step; see tests/sim/test_holding.py."""


@dataclass(frozen=True, slots=True)
class GraspContact:
    """How fingertips and object press and rub.

    Attributes:
        stiffness: Normal force per depth of penetration [N/m].
        friction: Coulomb coefficient mu.
        spin_length: e [m]: full slip lies on (f_t / mu f_n)^2 + (torque / mu e f_n)^2 = 1.
        damping_ratio: Of the normal motion of the bodies' own mass on the contact's stiffness.
        impratio: Of friction to normal impedance: creep goes with its inverse.
    """

    stiffness: float = 20e3
    friction: float = 0.5
    spin_length: float = 0.004
    damping_ratio: float = 1.0
    impratio: float = IMPRATIO

    def __post_init__(self) -> None:
        check_positive(self, stiffness="N/m", friction="", spin_length="m", damping_ratio="", impratio="")


def frictionless_grasp_parameters(law: GraspContact, inverse_mass: float, time_step: float) -> PairParameters:
    """Return MuJoCo's parameters for what a contact law says of pressing, where a friction plant sees to rubbing.

    Args:
        law: The wanted behaviour; what it says of friction is left out.
        inverse_mass: A: sum of the two bodies' translational `body_invweight0` [1/kg].
        time_step: Of the simulation [s].

    Raises:
        InvalidValueError: The contact is too stiff for mass and time step; the message says what would do.
    """
    A, d = positive("inverse_mass", inverse_mass, "1/kg"), IMPEDANCE
    _check_contact_step(law, A, time_step)
    return PairParameters(
        solref=solref(law.stiffness, law.damping_ratio, d, A),
        solimp=solimp(d),
        solreffriction=(0.0, 0.0),
        friction=(1.0, 1.0, 0.0, 0.0, 0.0),
        impratio=law.impratio,
        friction_damping=0.0,
        creep_speed=0.0,
        lift_speed=math.inf,
        condim=1,
    )


def grasp_pair_parameters(
    law: GraspContact, inverse_mass: float, time_step: float, force: float = 1.0, sliding: float = 0.0
) -> PairParameters:
    """Return MuJoCo's parameters for a contact in a grasp, or refuse if its model would not keep to it.

    Args:
        law: The wanted behaviour.
        inverse_mass: A: sum of the two bodies' translational `body_invweight0` [1/kg].
        time_step: Of the simulation [s].
        force: Normal force [N] at which creep and lift-off speed are stated; both grow with it.
        sliding: Least lift-off speed there [m/s]: what slides fast on purpose has softer friction damping.

    Raises:
        InvalidValueError: The contact is too stiff for mass and time step; the message says what would do.
    """
    A, d, mu = positive("inverse_mass", inverse_mass, "1/kg"), IMPEDANCE, law.friction
    _check_contact_step(law, A, time_step)
    Dn, damping_rate = d / ((1.0 - d) * A), FRICTION_STEP / time_step
    if sliding > 0.0:
        damping_rate = min(damping_rate, force / (Dn * mu * sliding))
    return PairParameters(
        solref=solref(law.stiffness, law.damping_ratio, d, A),
        solimp=solimp(d),
        # MuJoCo divides a direct-format damping by the impedance
        solreffriction=(-1.0, -d * damping_rate),
        friction=(mu, mu, mu * law.spin_length, 1e-6, 1e-6),
        impratio=law.impratio,
        friction_damping=damping_rate,
        creep_speed=mu * force / (Dn * law.impratio * damping_rate),
        lift_speed=force * (1.0 + mu**2 / law.impratio) / (Dn * mu * damping_rate),
    )


def _check_contact_step(law: GraspContact, A: float, time_step: float) -> None:
    contact_step = math.sqrt(law.stiffness * A) * time_step
    if contact_step > LARGEST_CONTACT_STEP:
        shorter = 0.99 * time_step * LARGEST_CONTACT_STEP / contact_step
        stiffness = 0.99 * law.stiffness * (LARGEST_CONTACT_STEP / contact_step) ** 2
        raise InvalidValueError(
            f"contact stiffness = {law.stiffness:g} N/m with a time step of {time_step:g} s: sqrt(K A) dt = "
            f"{contact_step:.3f}, the limit is {LARGEST_CONTACT_STEP}; take a stiffness of at most "
            f"{stiffness:.3g} N/m, a time step of at most {shorter:.2g} s, or a heavier object"
        )
