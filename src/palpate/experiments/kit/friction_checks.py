"""What friction any experiment may be asked for."""

from palpate.errors import InvalidValueError, positive
from palpate.experiments.kit.config_checks import check_length

LARGEST_FRICTION = 10.0
"""Of what is simulated: as far as friction files and libraries reach."""

LARGEST_SPIN_LENGTH = 0.1
"""Likewise [m]."""


def check_friction(friction: float, name: str = "friction") -> None:
    """Refuse a friction coefficient that no surface has, or that is in per cent.

    Raises:
        InvalidValueError: It is such a coefficient.
    """
    if positive(name, friction, "") > LARGEST_FRICTION:
        hint = f"; for {friction:g} % give {friction / 100.0:g}" if friction <= 100.0 * LARGEST_FRICTION else ""
        raise InvalidValueError(f"{name} = {friction:g}: must be at most {LARGEST_FRICTION:g}{hint}")


def check_spin_length(spin_length: float, name: str = "spin_length") -> None:
    """Refuse a spin length [m] that no contact has, or that is in millimetres.

    Raises:
        InvalidValueError: It is such a length.
    """
    check_length(name, spin_length, LARGEST_SPIN_LENGTH)
