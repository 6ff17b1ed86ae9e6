"""The friction that a grasp is planned with, and its slip detection."""

import numpy as np

from palpate.controllers.grip.belief import KnownSurface, SurfaceBelief
from palpate.controllers.grip.hanging_load import ForceErrors, HangingLoad, NetWrench, OpposedLoad
from palpate.controllers.grip.slip_bounded_surface import SlipBoundedSurface
from palpate.controllers.grip.slip_hearing import SlipHearing
from palpate.errors import InvalidValueError
from palpate.estimation import Verdict
from palpate.experiments.grasp.config import SPREADS, THREE, GraspConfig
from palpate.experiments.grasp.grip_laws import LIMIT_SURFACE
from palpate.experiments.grasp.nudged import NotedNudge
from palpate.experiments.grasp.strength import at_worst
from palpate.experiments.grasp.surface import true_surface
from palpate.friction.friction_file import FrictionEstimate, FrictionFile, How
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.belief import FrictionBelief
from palpate.friction.slip.excited_slip import ExcitedParameters, ExcitedSlip
from palpate.friction.slip.fingers import FingerSlips, LearntSurface
from palpate.friction.slip.grip_dither import GripDither
from palpate.friction.slip.load_noise import LoadNoise
from palpate.sim.hand.hand_model import HandModel
from palpate.sim.tip import Tip
from palpate.surfaces import Sphere

RIPPLE = GripDither(amplitude=0.3, frequency=100.0)
"""What the simulated hand's servos pass on a third of: 0.11 N at the fingertips."""

COVERED = (0.03, 0.05)
"""By which mu and e may be smaller than planned with: what the grip's margin is for."""

LEAST_EXPONENT = 1.0
"""Of p: a diamond, the least capacity for combined loads."""

WORST_SHARE = 0.5
"""Of the least mu and e in the assumed range: slip on so bad a surface is detected, too, and on no worse one. With
0.7, a mu of 0.3 where 0.62 +- 30 % was assumed was dropped without an alarm."""

EXCITED = ExcitedParameters(steady=0.3)
"""A load as light as half the weight of 0.1 kg changes by a good part from sample to sample, by noise: with the
usual tenth, an object that slides out of fingers that press with 1.5 N is not detected."""

NUDGING_GRIP = 2.0
"""[N] 2 mu e f_n is then less than tips over a box of 0.1 kg, with mu 0.65 and e 6 mm too: 16 of 24 mNm."""

MAX_DEVIATIONS = 3.0
"""Standard deviations by which an estimate may be off: beyond, e could be nothing."""

EVEN = 3.0**0.5
"""Half width over standard deviation of what lies evenly between two bounds."""


def believed_surface(config: GraspConfig, found: FrictionFile | None) -> LimitSurface:
    """Return the limit surface that is believed at first.

    Args:
        config: What was asked for.
        found: What rubbing has found, if that is to be planned with.

    Raises:
        InvalidValueError: It lacks mu or e.
    """
    if found is not None:
        return planned_with(found)
    generator = np.random.default_rng((config.seed, 11))
    a, b = generator.uniform(-1.0, 1.0, 2).tolist()
    if config.known == "estimated":
        a, b = np.clip(generator.standard_normal(2), -MAX_DEVIATIONS, MAX_DEVIATIONS).tolist()
    of_mu, of_e = SPREADS[config.known]
    true = true_surface(config)
    # the truth lies about what is believed, evenly or normally; exponents are taken as they are
    mu, e = true.friction / (1.0 + a * of_mu), true.spin_length / (1.0 + b * of_e)
    return LimitSurface(
        config.believed_friction or mu,
        config.believed_spin_length or e,
        true.load_exponent,
        true.norm_exponent,
    )


def planned_with(found: FrictionFile) -> LimitSurface:
    """Return the surface to plan with: what was measured, less what its interval leaves open beyond `COVERED`.

    Of p it is the lower end of its interval, or of its range if nobody has measured it: the smaller p, the more
    grip any load needs. What 1 costs where the truth is 2 is 41 % at most.

    Raises:
        InvalidValueError: Nothing is known of spinning, or an assumption did not hold by which it was found.
    """
    if found.broken:
        raise InvalidValueError(
            f"these numbers are not to be used: {Verdict(found.broken)}; rub again, or type what you believe "
            "(--believed-friction, --believed-spin-length)"
        )
    measured = found.limit_surface()  # refuses, if nothing is known of spinning
    assert found.spin_length is not None
    mu, e = (
        _cautious(each, share) for each, share in zip((found.friction, found.spin_length), COVERED, strict=True)
    )
    return LimitSurface(mu, e, measured.load_exponent, max(found.norm_exponent.lower, LEAST_EXPONENT))


def _cautious(found: FrictionEstimate, covered: float) -> float:
    least = found.lower if found.how is How.MEASURED else found.lower * (1.0 - covered)
    if not least > 0.0:
        raise InvalidValueError(
            f"its interval begins at {found.lower:g}: nothing can be held by that; rub again, with more repeats"
        )
    return min(found.value, least / (1.0 - covered))


def belief_of(config: GraspConfig, believed: LimitSurface) -> SurfaceBelief:
    """Return the belief that the grip is planned with, and its updates."""
    of_mu, of_e = SPREADS[config.known]
    if config.known in ("touched", "estimated"):
        return KnownSurface(believed)
    if config.known == "nudged":
        return NotedNudge(at_worst(believed, config.known), NUDGING_GRIP)
    return LearntSurface(
        lambda: FrictionBelief(
            believed.friction,
            believed.spin_length,
            friction_deviation=of_mu / EVEN,
            spin_length_deviation=of_e / EVEN,
            load_exponent=believed.load_exponent,
            norm_exponent=believed.norm_exponent,
        )
    )


def shares(config: GraspConfig) -> bool:
    """Return whether each finger presses with its own part of the least grip.

    Two opposed fingers whose friction is known share alike, which is the least already: with one grip for both,
    each by what it feels, they need no plan of the whole. Three do, and two where mu and e are estimated.
    """
    if config.controller != LIMIT_SURFACE or config.known not in ("touched", "estimated"):
        return False
    return config.fingers == THREE or config.known == "estimated"


def slips_of(config: GraspConfig, believed: LimitSurface, tip: Tip, period: float) -> FingerSlips:
    """Return the slip detection of a grip that ripples.

    Args:
        config: What was asked for.
        believed: What contacts are believed to bear.
        tip: Of each finger: a sphere on its sensor's axis.
        period: Of control [s].
    """
    noise = _noise(config, tip)
    of_mu, of_e = SPREADS[config.known]
    weakest = LimitSurface(
        WORST_SHARE * believed.friction * (1.0 - of_mu),
        WORST_SHARE * believed.spin_length * (1.0 - of_e),
        believed.load_exponent,
        believed.norm_exponent,
    )
    return FingerSlips(lambda: ExcitedSlip(weakest, RIPPLE, period, noise, EXCITED))


def hearing_of(
    config: GraspConfig, believed: LimitSurface, belief: SlipBoundedSurface, hand: HandModel, period: float
) -> SlipHearing | None:
    """Return what hears slip by the fall of the load; None where nobody does.

    That is a grip that ignores spin, for comparison, and one of three fingers with a ripple: it shakes their net
    force, and the ripple itself tells slip there.

    Args:
        config: What was asked for.
        believed: What contacts are believed to bear.
        belief: Which is taught what they show.
        hand: That holds.
        period: Of control [s].
    """
    if config.ignores_spin or (config.fingers == THREE and config.known == "untouched"):
        return None
    errors = ForceErrors(config.force_noise, config.drift)
    load: HangingLoad
    if config.fingers == THREE:
        load = NetWrench(hand, errors, config.fingers, period)
    else:
        load = OpposedLoad(hand, errors, _noise(config, hand.tips[0]), believed.spin_length, period)
    return SlipHearing(believed, belief, period, load, 2, config.fingers)


def _noise(config: GraspConfig, tip: Tip) -> LoadNoise:
    return LoadNoise.of_touch(config.force_noise, config.moment_noise, tip_radius(tip), tip.center_of_mass[2])


def tip_radius(tip: Tip) -> float:
    """Return the radius of a fingertip [m], which is a sphere."""
    assert isinstance(tip.surface, Sphere)
    return float(tip.surface.radius)
