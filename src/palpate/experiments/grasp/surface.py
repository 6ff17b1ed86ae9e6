"""True friction of a simulated grasp: as typed, else as measured by rubbing, else the default."""

from dataclasses import replace

from palpate.experiments.grasp.config import GraspConfig
from palpate.friction.friction_file import FrictionFile, How
from palpate.friction.limit_surface import LimitSurface

USUAL = LimitSurface(friction=0.5, spin_length=0.004)
"""Default: rubber on a smooth surface."""


def with_surface(config: GraspConfig, found: FrictionFile | None) -> GraspConfig:
    """Return a configuration with all four numbers of the simulated surface.

    Args:
        config: What was asked for; what it leaves out was found by rubbing, else it is as in `USUAL`.
        found: What rubbing has found, if something was.

    Raises:
        InvalidValueError: mu or e is missing, or a number is impossible.
    """
    surface = USUAL if found is None else likely(found)
    surface = LimitSurface(
        _given(config.friction, surface.friction),
        _given(config.spin_length, surface.spin_length),
        _given(config.load_exponent, surface.load_exponent),
        _given(config.norm_exponent, surface.norm_exponent),
    )
    return replace(
        config,
        friction=surface.friction,
        spin_length=surface.spin_length,
        load_exponent=surface.load_exponent,
        norm_exponent=surface.norm_exponent,
    )


def true_surface(config: GraspConfig) -> LimitSurface:
    """Return what contacts really bear; what is left out as `USUAL`.

    Raises:
        InvalidValueError: A number cannot be.
    """
    return LimitSurface(
        _given(config.friction, USUAL.friction),
        _given(config.spin_length, USUAL.spin_length),
        _given(config.load_exponent, USUAL.load_exponent),
        _given(config.norm_exponent, USUAL.norm_exponent),
    )


def rubbed_by_plant(config: GraspConfig) -> bool:
    """Return whether the friction plant rubs: where it was asked for, or the surface is none that MuJoCo has."""
    true = true_surface(config)
    return config.plant or (true.load_exponent, true.norm_exponent) != (USUAL.load_exponent, USUAL.norm_exponent)


def likely(found: FrictionFile) -> LimitSurface:
    """Return the likeliest surface: values that were measured, and usual exponents where these can be.

    Raises:
        InvalidValueError: Nothing is known of spinning.
    """
    surface = found.limit_surface()
    gamma, p = found.load_exponent, found.norm_exponent
    grows = gamma.how is How.MEASURED and gamma.lower > USUAL.load_exponent
    pointed = p.how is How.MEASURED and p.upper < USUAL.norm_exponent
    return replace(
        surface,
        load_exponent=surface.load_exponent if grows else USUAL.load_exponent,
        norm_exponent=surface.norm_exponent if pointed else USUAL.norm_exponent,
    )


def _given(value: float | None, usual: float) -> float:
    return usual if value is None else value
