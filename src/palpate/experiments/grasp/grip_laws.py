"""The grip laws that `palpate grasp --controller` takes by name; imports nothing heavy.

A new one is a `GripNeed` in a file of its own, and an entry here.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from palpate.errors import InvalidValueError

if TYPE_CHECKING:
    from palpate.controllers.grip.need import GripNeed

LIMIT_SURFACE, COULOMB = "limit-surface", "coulomb"


def _limit_surface(most_rubbed: float) -> "GripNeed":
    from palpate.controllers.grip.rubbed_need import NeedWithinRubbed

    return NeedWithinRubbed(most_rubbed)


def _coulomb(most_rubbed: float) -> "GripNeed":
    from palpate.controllers.grip.need import NeedWithoutSpin

    return NeedWithoutSpin()


GRIP_LAWS: "Mapping[str, Callable[[float], GripNeed]]" = {LIMIT_SURFACE: _limit_surface, COULOMB: _coulomb}
"""From the largest normal force at which e was measured [N] to the law."""


def check_grip_law(name: str, law: str) -> None:
    """Refuse a name that no law has.

    Raises:
        InvalidValueError: None has it.
    """
    if law not in GRIP_LAWS:
        raise InvalidValueError(f"{name} = {law}: no such grip law; take one of {', '.join(GRIP_LAWS)}")
