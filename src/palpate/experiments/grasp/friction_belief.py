"""Friction of a grasp: the simulated surface, the surface that the grip is planned with, and slip detection."""

from dataclasses import asdict, dataclass, replace

import numpy as np

from palpate.controllers.grip.belief import KnownSurface, SurfaceBelief
from palpate.controllers.grip.hanging_load import ForceErrors, HangingLoad, NetWrench, OpposedLoad
from palpate.controllers.grip.nudge import NudgedSurface
from palpate.controllers.grip.slip_bounded_surface import SlipBoundedSurface
from palpate.controllers.grip.slip_hearing import SlipHearing
from palpate.errors import InvalidValueError, positive
from palpate.estimation import Verdict
from palpate.experiments.grasp.config import SPREADS, THREE, GraspConfig
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

USUAL_SURFACE = LimitSurface(friction=0.5, spin_length=0.004)
"""Default surface: rubber on a smooth object."""

GRIP_RIPPLE = GripDither(amplitude=0.3, frequency=100.0)
"""Ripple on the grip. The simulated hand's servos pass a third of it on: 0.11 N at the fingertips."""

COVERED_BY_MARGIN = (0.03, 0.05)
"""Shares by which the true mu and e may be smaller than planned; the margin of the grip covers them."""

MIN_NORM_EXPONENT = 1.0
"""Least p: a diamond, with the least capacity for combined loads."""

_WEAKEST_SHARE = 0.5
"""Share of the least mu and e in the assumed range at which slip is still detected. With 0.7, a mu of 0.3 was
dropped without an alarm where 0.62 +- 30 % was assumed."""

_RIPPLE_DETECTION = ExcitedParameters(steady=0.3)
"""Half the weight of 0.1 kg changes by a good part from sample to sample, by noise. With the usual tenth, an
object that slides out of fingers that press with 1.5 N is not detected."""

NUDGE_GRIP = 2.0
"""Grip of a nudge [N]. Its torque 2 mu e f_n is less than tips a box of 0.1 kg over, with mu 0.65 and e 6 mm too:
16 of 24 mN m."""

_MAX_DEVIATIONS = 3.0
"""Largest error of an estimate in standard deviations. Beyond, e could vanish."""

_CAUTIOUS_DEVIATIONS = 2.33
"""Standard deviations of an estimate below which 1 % of the true values lie."""

_UNIFORM_HALF_WIDTH = 3.0**0.5
"""Half width of a uniform distribution in its standard deviations."""


def true_surface(config: GraspConfig, usual: LimitSurface = USUAL_SURFACE) -> LimitSurface:
    """Return the limit surface of the simulated contacts: typed numbers first, then those of `usual`.

    Raises:
        InvalidValueError: If a number is impossible.
    """
    typed = {name: getattr(config, name) for name in asdict(usual)}
    return replace(usual, **{name: value for name, value in typed.items() if value is not None})


def likely_surface(found: FrictionFile) -> LimitSurface:
    """Return the likeliest surface: measured values, and usual exponents where their intervals hold them.

    Raises:
        InvalidValueError: If nothing is known of spinning.
    """
    surface = found.limit_surface()
    gamma, p = found.load_exponent, found.norm_exponent
    grows = gamma.how is How.MEASURED and gamma.lower > USUAL_SURFACE.load_exponent
    pointed = p.how is How.MEASURED and p.upper < USUAL_SURFACE.norm_exponent
    return replace(
        surface,
        load_exponent=surface.load_exponent if grows else USUAL_SURFACE.load_exponent,
        norm_exponent=surface.norm_exponent if pointed else USUAL_SURFACE.norm_exponent,
    )


def rubbed_by_plant(config: GraspConfig) -> bool:
    """Return whether the friction plant rubs: by request, or because MuJoCo lacks the surface."""
    true = true_surface(config)
    mujoco = (USUAL_SURFACE.load_exponent, USUAL_SURFACE.norm_exponent)
    return config.plant or (true.load_exponent, true.norm_exponent) != mujoco


def believed_surface(config: GraspConfig, found: FrictionFile | None) -> LimitSurface:
    """Return the first estimate of the limit surface.

    Args:
        config: Options of the grasp.
        found: Result of rubbing to plan with; None without.

    Raises:
        InvalidValueError: If the result of rubbing lacks mu or e.
    """
    if found is not None:
        return planned_with(found)
    generator = np.random.default_rng((config.seed, 11))
    a, b = generator.uniform(-1.0, 1.0, 2).tolist()
    if config.known == "estimated":
        a, b = np.clip(generator.standard_normal(2), -_MAX_DEVIATIONS, _MAX_DEVIATIONS).tolist()
    of_mu, of_e = SPREADS[config.known]
    true = true_surface(config)
    # the truth lies about the belief, evenly or normally; the exponents are exact
    return replace(
        true,
        friction=config.believed_friction or true.friction / (1.0 + a * of_mu),
        spin_length=config.believed_spin_length or true.spin_length / (1.0 + b * of_e),
    )


def planned_with(found: FrictionFile) -> LimitSurface:
    """Return the surface to plan with: measured values, lowered where an interval reaches beyond the margin.

    p is the lower end of its interval, or of its range if p was not measured: the smaller p, the more grip any
    load needs. Planning with 1 where the truth is 2 costs 41 % of grip at most.

    Raises:
        InvalidValueError: If nothing is known of spinning, or an assumption of the measurement did not hold.
    """
    if found.broken:
        raise InvalidValueError(
            f"these numbers are not to be used: {Verdict(found.broken)}; rub again, or type what you believe "
            "(--believed-friction, --believed-spin-length)"
        )
    measured = found.limit_surface()  # refuses a file without spin length
    assert found.spin_length is not None
    mu, e = map(_cautious, (found.friction, found.spin_length), COVERED_BY_MARGIN)
    return LimitSurface(mu, e, measured.load_exponent, max(found.norm_exponent.lower, MIN_NORM_EXPONENT))


def _cautious(found: FrictionEstimate, covered: float) -> float:
    least = found.lower if found.how is How.MEASURED else found.lower * (1.0 - covered)
    if not least > 0.0:
        raise InvalidValueError(
            f"its interval begins at {found.lower:g}: nothing can be held by that; rub again, with more repeats"
        )
    return min(found.value, least / (1.0 - covered))


def worst_surface(config: GraspConfig, believed: LimitSurface) -> LimitSurface:
    """Return the weakest surface within the assumed range of friction."""
    deviations = _CAUTIOUS_DEVIATIONS if config.known == "estimated" else 1.0
    of_mu, of_e = (deviations * spread for spread in SPREADS[config.known])
    return replace(
        believed, friction=believed.friction * (1.0 - of_mu), spin_length=believed.spin_length * (1.0 - of_e)
    )


@dataclass(frozen=True, slots=True)
class NudgeFinding:
    """Friction of one contact, measured by a nudge.

    Attributes:
        friction: mu; None where nothing slid.
        spin_length: e at the grip of the nudge [m]; None where nothing spun.
    """

    friction: float | None
    spin_length: float | None


class NotedNudge(NudgedSurface):
    """Plans with the friction that a nudge measured, and keeps it. e, measured at one grip, is scaled by gamma.

    Attributes:
        found: One finding per nudged finger.
    """

    def __init__(self, cautious: LimitSurface, grip: float) -> None:
        """Take the weakest likely surface of the contacts, and the grip of the nudge [N]."""
        super().__init__(cautious)
        self._growth = positive("grip", grip, "N") ** cautious.load_exponent
        self.found: tuple[NudgeFinding, ...] = ()

    def start(self) -> None:
        """Forget all findings."""
        super().start()
        self.found = ()

    def learn(self, finger: int, friction: float | None, spin_length: float | None) -> None:
        """Keep the finding of a finger, and plan with it."""
        self.found += (NudgeFinding(friction, spin_length),)
        super().learn(finger, friction, None if spin_length is None else spin_length / self._growth)


def belief_of(config: GraspConfig, believed: LimitSurface) -> SurfaceBelief:
    """Return the friction estimate that the grip is planned with, and its updates."""
    if config.known in ("touched", "estimated"):
        return KnownSurface(believed)
    if config.known == "nudged":
        return NotedNudge(worst_surface(config, believed), NUDGE_GRIP)
    of_mu, of_e = SPREADS[config.known]
    return LearntSurface(
        lambda: FrictionBelief(
            believed.friction,
            believed.spin_length,
            friction_deviation=of_mu / _UNIFORM_HALF_WIDTH,
            spin_length_deviation=of_e / _UNIFORM_HALF_WIDTH,
            load_exponent=believed.load_exponent,
            norm_exponent=believed.norm_exponent,
        )
    )


def slips_of(config: GraspConfig, believed: LimitSurface, tip: Tip, period: float) -> FingerSlips:
    """Return the slip detection of a rippling grip.

    Args:
        config: Options of the grasp.
        believed: First estimate of the limit surface.
        tip: Fingertip of each finger: a sphere on its sensor's axis.
        period: Control period [s].
    """
    noise, worst = _noise(config, tip), worst_surface(config, believed)
    weakest = replace(
        worst, friction=_WEAKEST_SHARE * worst.friction, spin_length=_WEAKEST_SHARE * worst.spin_length
    )
    return FingerSlips(lambda: ExcitedSlip(weakest, GRIP_RIPPLE, period, noise, _RIPPLE_DETECTION))


def load_watch(
    config: GraspConfig, believed: LimitSurface, belief: SlipBoundedSurface, hand: HandModel, period: float
) -> SlipHearing | None:
    """Return the detection of slip from a falling load; None without one.

    A grip that ignores spin, for comparison, has none. Three fingers with a ripple have none either: the ripple
    shakes their net force, and detects slip itself.

    Args:
        config: Options of the grasp.
        believed: First estimate of the limit surface.
        belief: Friction estimate that detected slips correct.
        hand: Geometry of the hand.
        period: Control period [s].
    """
    if config.ignores_spin or (config.fingers == THREE and config.known == "untouched"):
        return None
    errors = ForceErrors(config.force_noise, config.drift_rate)
    load: HangingLoad
    if config.fingers == THREE:
        load = NetWrench(hand, errors, config.fingers, period)
    else:
        load = OpposedLoad(hand, errors, _noise(config, hand.tips[0]), believed.spin_length, period)
    return SlipHearing(believed, belief, period, load, 2, config.fingers)


def _noise(config: GraspConfig, tip: Tip) -> LoadNoise:
    return LoadNoise.of_touch(config.force_noise, config.moment_noise, tip_radius(tip), tip.center_of_mass[2])


def tip_radius(tip: Tip) -> float:
    """Return the radius of a spherical fingertip [m]."""
    assert isinstance(tip.surface, Sphere)
    return float(tip.surface.radius)
