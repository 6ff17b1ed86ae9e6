"""A contact in physical units, and the MuJoCo solver parameters that realise it.

MuJoCo regularises every contact with an impedance d in (0, 1): with A the sum of the two bodies' inverse masses
(`body_invweight0`), a contact row has the compliance R = (1 - d)/d A, so D = 1/R. With constant impedance
(solimp = d, d) and the direct format solref = (-(1-d) A K, -(1-d) A C) the normal force at rest is
K depth + C rate, whatever the masses. Friction rows have the same D times impratio and the damping rate b_f of
solreffriction = (-1, -d b_f): below `creep_speed` friction is viscous, above `lift_speed` the friction rows push
the bodies apart. For MuJoCo couples them through the elliptic cone: sliding adds mu D (b_f v + |a_t|) to the
normal force, and acceleration along the normal takes D a_n from it, as if the contact carried the mass D. A low
impedance keeps that mass small. Creep and lift-off speed are realised by construction; that b_f and the contact's
own frequency suit the time step is checked when a scene is built.
"""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, check_positive, positive

LARGEST_FRICTION_STEP = 0.2
"""Of b_f dt: 0.2 was found stable, 1 fails violently (measured with MuJoCo 4.0)."""

LARGEST_CONTACT_STEP = 0.08
"""Of sqrt(K A) dt, the contact's own angle per time step: 0.063 was found sound, 0.1 chatters (MuJoCo 4.0)."""


@dataclass(frozen=True, slots=True)
class ContactLaw:
    """How tip and object press and rub.

    Attributes:
        stiffness: Normal force per depth of penetration [N/m].
        friction: Coulomb coefficient mu.
        spin_length: e [m]: the largest spin torque is mu e f_n, and full slip lies on
            (f_t / mu f_n)^2 + (torque / mu e f_n)^2 = 1.
        damping_ratio: Of the normal motion of the bodies' own mass on the contact's stiffness.
        impedance: MuJoCo's constraint impedance d. Low for sliding over curved surfaces: 0.9 chatters there, and
            against 0.2, 0.05 leaves a third of the force error of a raster at 20 mm/s and of the points' error.
        smallest_force: Least normal force [N] at which `lift_speed` shall still hold.
        lift_speed: Sliding speed [m/s] up to which the tip stays on the surface.
        creep_speed: Sliding speed [m/s] above which friction is Coulomb's.
    """

    stiffness: float = 20e3
    friction: float = 0.3
    spin_length: float = 0.004
    damping_ratio: float = 1.0
    impedance: float = 0.05
    smallest_force: float = 0.5
    lift_speed: float = 1.0
    creep_speed: float = 1e-4

    def __post_init__(self) -> None:
        check_positive(
            self,
            stiffness="N/m",
            friction="",
            spin_length="m",
            damping_ratio="",
            smallest_force="N",
            lift_speed="m/s",
            creep_speed="m/s",
        )
        if not 0.0 < self.impedance < 1.0:
            raise InvalidValueError(f"impedance = {self.impedance}: must lie between 0 and 1")


@dataclass(frozen=True, slots=True)
class PairParameters:
    """A `ContactLaw` in MuJoCo's terms, for one pair of geoms.

    Attributes:
        solref: Normal reference, direct format.
        solimp: Constant impedance.
        solreffriction: Friction reference, direct format.
        friction: Sliding (two), torsional [m], rolling (two).
        impratio: Of friction to normal impedance; an option of the whole model.
        friction_damping: b_f [1/s].
        creep_speed: As realised, at `smallest_force` [m/s].
        lift_speed: As realised, at `smallest_force` [m/s].
        condim: MuJoCo's dimension of the contact: 4 with sliding and torsional friction, 1 with none.
    """

    solref: tuple[float, float]
    solimp: tuple[float, float, float, float, float]
    solreffriction: tuple[float, float]
    friction: tuple[float, float, float, float, float]
    impratio: float
    friction_damping: float
    creep_speed: float
    lift_speed: float
    condim: int = 4


def frictionless_parameters(law: ContactLaw, inverse_mass: float, time_step: float) -> PairParameters:
    """Return MuJoCo's parameters for what a contact law says of pressing, where a friction plant sees to rubbing.

    Args:
        law: The wanted behaviour; what it says of friction is left out.
        inverse_mass: A: sum of the two bodies' translational `body_invweight0` [1/kg].
        time_step: Of the simulation [s].

    Raises:
        InvalidValueError: The contact's own frequency does not suit the time step.
    """
    _check_contact_step(law, positive("inverse_mass", inverse_mass, "1/kg"), time_step)
    return PairParameters(
        solref=solref(law.stiffness, law.damping_ratio, law.impedance, inverse_mass),
        solimp=solimp(law.impedance),
        solreffriction=(0.0, 0.0),
        friction=(1.0, 1.0, 0.0, 0.0, 0.0),
        impratio=1.0,
        friction_damping=0.0,
        creep_speed=0.0,
        lift_speed=math.inf,
        condim=1,
    )


def pair_parameters(law: ContactLaw, inverse_mass: float, time_step: float) -> PairParameters:
    """Return MuJoCo's parameters for a contact law, or refuse if its model would not keep to it.

    Args:
        law: The wanted behaviour.
        inverse_mass: A: sum of the two bodies' translational `body_invweight0` [1/kg].
        time_step: Of the simulation [s].

    Raises:
        InvalidValueError: A bound on stability, creep or lift-off is broken; the message says what to change.
    """
    A, d, mu = positive("inverse_mass", inverse_mass, "1/kg"), law.impedance, law.friction
    _check_contact_step(law, A, time_step)
    Dn = d / ((1.0 - d) * A)
    # b_f from the wanted lift speed (its mu^2/impratio term is below 1e-3), impratio from the wanted creep speed
    friction_damping = law.smallest_force / (Dn * mu * law.lift_speed)
    impratio = mu * law.smallest_force / (Dn * friction_damping * law.creep_speed)
    if friction_damping * time_step > LARGEST_FRICTION_STEP:
        raise InvalidValueError(
            f"friction damping b_f dt = {friction_damping * time_step:.3f}, the limit is "
            f"{LARGEST_FRICTION_STEP}; take a friction of at least "
            f"{mu * friction_damping * time_step / LARGEST_FRICTION_STEP:.2g}, or a smaller time step than "
            f"{time_step:g} s"
        )
    if impratio < 1.0:
        raise InvalidValueError(
            f"friction = {mu:g}: Coulomb's from {law.creep_speed:g} m/s on asks for impratio = {impratio:.2g}, "
            f"the least is 1; take a friction of at least {math.sqrt(law.creep_speed / law.lift_speed):.2g}, or a "
            f"creep_speed of at most {law.creep_speed * impratio:.2g} m/s"
        )
    return PairParameters(
        solref=solref(law.stiffness, law.damping_ratio, d, A),
        solimp=solimp(d),
        # MuJoCo divides a direct-format damping by the impedance
        solreffriction=(-1.0, -d * friction_damping),
        friction=(mu, mu, mu * law.spin_length, 1e-6, 1e-6),
        impratio=impratio,
        friction_damping=friction_damping,
        creep_speed=mu * law.smallest_force / (Dn * impratio * friction_damping),
        lift_speed=law.smallest_force * (1.0 + mu**2 / impratio) / (Dn * mu * friction_damping),
    )


def solref(stiffness: float, damping_ratio: float, impedance: float, inverse_mass: float) -> tuple[float, float]:
    """Return the direct format for a stiffness [N/m] and a damping ratio, whatever the masses.

    Args:
        stiffness: Normal force per depth of penetration [N/m].
        damping_ratio: Of the normal motion of the bodies' own mass on that stiffness.
        impedance: d.
        inverse_mass: A: sum of the two bodies' translational `body_invweight0` [1/kg].
    """
    A, d = inverse_mass, impedance
    damping = 2.0 * damping_ratio * math.sqrt(stiffness / A)
    return (-(1.0 - d) * A * stiffness, -(1.0 - d) * A * damping)


def solimp(impedance: float) -> tuple[float, float, float, float, float]:
    """Return a constant impedance: width, midpoint and power then have no effect."""
    return (impedance, impedance, 1e-3, 0.5, 2.0)


def largest_inverse_mass(law: ContactLaw, time_step: float) -> float:
    """Return the largest A that keeps to a law with a time step [s], for a message of its own [1/kg]."""
    return (LARGEST_CONTACT_STEP / time_step) ** 2 / law.stiffness


def _check_contact_step(law: ContactLaw, inverse_mass: float, time_step: float) -> None:
    contact_step = math.sqrt(law.stiffness * inverse_mass) * time_step
    if contact_step > LARGEST_CONTACT_STEP:
        raise InvalidValueError(
            f"contact stiffness = {law.stiffness:g} N/m with a time step of {time_step:g} s: sqrt(K A) dt = "
            f"{contact_step:.3f}, the limit is {LARGEST_CONTACT_STEP}; take a stiffness of at most "
            f"{_rounded_down(law.stiffness * (LARGEST_CONTACT_STEP / contact_step) ** 2):g} N/m, or a time step "
            f"of at most {time_step * LARGEST_CONTACT_STEP / contact_step:.2g} s"
        )


def _rounded_down(value: float) -> float:
    """Two significant digits, never more than the value: what an error recommends must be accepted."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.floor(value / unit) * unit
