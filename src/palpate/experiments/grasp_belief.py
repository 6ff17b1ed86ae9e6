"""What a grasp is planned with: what its contacts are taken to bear, and who listens for slip."""

from collections.abc import Mapping

import numpy as np

from palpate.controllers.grip.belief import KnownSurface, SurfaceBelief
from palpate.controllers.grip.nudge import NudgedSurface
from palpate.errors import InvalidValueError
from palpate.experiments.friction_file import Finding, FrictionFile, How, read_friction_file
from palpate.experiments.grasp_config import SPREADS, GraspConfig
from palpate.experiments.grasp_text import KNOWN_TEXT
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.belief import FrictionBelief
from palpate.friction.slip.excited_slip import ExcitedSlip
from palpate.friction.slip.fingers import FingerSlips, LearntSurface
from palpate.friction.slip.grip_dither import GripDither
from palpate.friction.slip.load_noise import LoadNoise
from palpate.friction.slip.margin_crossing import MarginCrossing, MarginParameters

RIPPLE = GripDither(amplitude=0.3, frequency=100.0)
"""What the simulated hand's servos pass on a third of: 0.11 N at the fingertips."""

CROSSING = MarginParameters(safe=0.93, slipping=0.99)
"""A grip with a margin of 12 % stands at a load ratio of 0.89."""

COVERED = (0.03, 0.05)
"""By which mu and e may be smaller than planned with: what the grip's margin is for."""

WORSE = 0.7
"""Of the least that mu and e are said to be: so bad a surface is heard to slip, too."""

EVEN = 3.0**0.5
"""Half width over standard deviation of what lies evenly between two bounds."""


def believed_surface(config: GraspConfig, texts: Mapping[str, str]) -> LimitSurface:
    """Return what the contacts are believed to bear at first.

    Args:
        config: What was asked for.
        texts: What rubbing had found, under `KNOWN_TEXT`, if that is to be planned with.

    Raises:
        InvalidValueError: That text is no friction file, or does not say enough.
    """
    if KNOWN_TEXT in texts:
        return planned_with(read_friction_file(texts[KNOWN_TEXT]))
    generator = np.random.default_rng((config.seed, 11))
    a, b = generator.uniform(-1.0, 1.0, 2).tolist()
    of_mu, of_e = SPREADS[config.known]
    # the truth lies evenly about what is believed
    mu, e = config.friction / (1.0 + a * of_mu), config.spin_length / (1.0 + b * of_e)
    return LimitSurface(config.believed_friction or mu, config.believed_spin_length or e)


def planned_with(found: FrictionFile) -> LimitSurface:
    """Return the surface to plan with: what was measured, less what its interval leaves open beyond `COVERED`.

    Raises:
        InvalidValueError: Nothing is known of spinning.
    """
    measured = found.limit_surface()  # refuses, if nothing is known of spinning
    assert found.spin_length is not None
    mu, e = (
        _cautious(each, share) for each, share in zip((found.friction, found.spin_length), COVERED, strict=True)
    )
    return LimitSurface(mu, e, measured.load_exponent, measured.norm_exponent)


def _cautious(found: Finding, covered: float) -> float:
    least = found.lower if found.how is How.MEASURED else found.lower * (1.0 - covered)
    if not least > 0.0:
        raise InvalidValueError(
            f"its interval begins at {found.lower:g}: nothing can be held by that; rub again, with more repeats"
        )
    return min(found.value, least / (1.0 - covered))


def belief_of(config: GraspConfig, believed: LimitSurface) -> SurfaceBelief:
    """Return what is planned with, and how that learns."""
    of_mu, of_e = SPREADS[config.known]
    if config.known == "touched":
        return KnownSurface(believed)
    if config.known == "nudged":
        return NudgedSurface(
            LimitSurface(
                believed.friction * (1.0 - of_mu),
                believed.spin_length * (1.0 - of_e),
                believed.load_exponent,
                believed.norm_exponent,
            )
        )
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


def slips_of(config: GraspConfig, believed: LimitSurface, radius: float, period: float) -> FingerSlips:
    """Return who listens for slip.

    Args:
        config: What was asked for.
        believed: What contacts are believed to bear.
        radius: Of the fingertip [m].
        period: Of control [s].
    """
    noise = LoadNoise.of_touch(config.force_noise, config.moment_noise, radius)
    if config.known == "touched":
        return FingerSlips(lambda: MarginCrossing(believed, period, noise, CROSSING))
    of_mu, of_e = SPREADS[config.known]
    weakest = LimitSurface(
        WORSE * believed.friction * (1.0 - of_mu),
        WORSE * believed.spin_length * (1.0 - of_e),
        believed.load_exponent,
        believed.norm_exponent,
    )
    return FingerSlips(lambda: ExcitedSlip(weakest, RIPPLE, period, noise))
