"""Bounds on contact forces: reliably felt, and safe for robot and fingertip.

Imports nothing heavy.
"""

from collections.abc import Sequence

from palpate.errors import InvalidValueError, not_negative

LEAST_TOUCH_FORCE = 0.2
"""Least force that counts as a touch [N]; noise may ask for more."""

TOUCH_DEVIATIONS = 7.0
"""A touch is at least this many standard deviations of the force noise of one axis: the length of the noise's
three components passes that once in 1e10 samples."""

LEAST_FORCE = 1.5
"""Bounds the set force from below: at least this many times the force that counts as a touch."""

MOST_FORCE = 15.0
"""Bounds the set force from above [N]: beyond it, landing could reach the supervisor's limit of 20 N."""

SOFT = 1e3
"""[N/m] Contacts softer than this were not meant: as soft as `palpate regulate --surface soft`."""


def check_force_noise(name: str, noise: float) -> None:
    """Refuse a noise of the force [N] in which no touch can be detected, or that is in another unit.

    Raises:
        InvalidValueError: It is such a noise.
    """
    if LEAST_FORCE * TOUCH_DEVIATIONS * not_negative(name, noise, "N") > MOST_FORCE:
        raise InvalidValueError(
            f"{name} = {noise:g} N: too large to detect a touch within {MOST_FORCE:g} N; for {noise:g} mN "
            f"give {noise / 1e3:g}"
        )


def check_compression(tip: Sequence[float], force: float, stiffness: float) -> None:
    """Refuse a fingertip that is compressed by more than its radius; it takes half of the contact's compression.

    Args:
        tip: Its radius or semi-axes [m].
        force: That it is pressed with [N].
        stiffness: Of the contact [N/m].

    Raises:
        InvalidValueError: It is.
    """
    compression = 0.5 * force / stiffness
    if min(tip) <= compression:
        hint = f"; is the stiffness in another unit? For {stiffness:g} kN/m give --stiffness {1e3 * stiffness:g}"
        raise InvalidValueError(
            f"tip = {min(tip):g} m: must be larger than its compression at {force:g} N and {stiffness:g} N/m, "
            f"{compression:.2g} m{hint if stiffness < SOFT else ''}"
        )
