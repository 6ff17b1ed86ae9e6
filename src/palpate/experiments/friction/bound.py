"""What friction any experiment may be asked for."""

from palpate.errors import InvalidValueError, positive

LARGEST_FRICTION = 10.0
"""Of what is simulated: as far as friction files and libraries reach."""


def check_friction(friction: float, name: str = "friction") -> None:
    """Refuse a friction coefficient that no surface has, or that is in per cent.

    Raises:
        InvalidValueError: It is such a coefficient.
    """
    if positive(name, friction, "") > LARGEST_FRICTION:
        hint = f"; for {friction:g} % give {friction / 100.0:g}" if friction <= 100.0 * LARGEST_FRICTION else ""
        raise InvalidValueError(f"{name} = {friction:g}: must be at most {LARGEST_FRICTION:g}{hint}")
