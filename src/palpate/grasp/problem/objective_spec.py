"""What is wanted of grasp forces, as it was given."""

from __future__ import annotations

import copy
import sys
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.grasp.problem.limits import checked_shared_actuators

__all__ = ["Wanted"]


class Objective(Enum):
    """Objective of the optimisation."""

    MIN_EFFORT = "min_effort"
    """The least sum of f^2 + eps |u|^2: as little as holds the load."""
    MAX_MARGIN = "max_margin"
    """The largest margin to slip of the contact that is nearest to it; below zero the load cannot be held."""
    MIN_PEAK = "min_peak"
    """The least largest normal force."""
    LOAD_FACTOR = "load_factor"
    """The largest multiple of the load that can be held."""


@dataclass(frozen=True, slots=True, eq=False)
class Wanted:
    """Objective and limits beyond those of the contacts.

    Attributes:
        objective: The named one; of one's own, MIN_EFFORT stands for it where a start is needed.
        own_objective: A function of the forces; None for the named one.
        effort_weight: eps.
        subject_to: A function of the forces that returns relations; None for none.
        shared_actuators: (A, lower, upper); None for none.
    """

    objective: Objective
    own_objective: Callable[[Any], Any] | None
    effort_weight: float
    subject_to: Callable[[Any], Any] | None
    shared_actuators: tuple[FloatArray, FloatArray, FloatArray] | None

    @classmethod
    def of(cls, objective: Any, effort_weight: float, subject_to: Any, shared_actuators: Any) -> Wanted:
        """Check what was given.

        Raises:
            InvalidValueError: Naming it.
        """
        own = callable(objective) and not isinstance(objective, type)
        if subject_to is not None and not callable(subject_to):
            raise InvalidValueError(
                f"subject_to = {subject_to!r}: must be a function of the forces that returns a list of relations"
            )
        return cls(
            Objective.MIN_EFFORT if own else _named(objective),
            objective if own else None,
            positive("effort_weight", effort_weight, ""),
            subject_to,
            checked_shared_actuators(shared_actuators),
        )

    @property
    def is_coupled(self) -> bool:
        """Whether anything is wanted beyond a named objective."""
        given = (self.own_objective, self.subject_to, self.shared_actuators)
        return any(each is not None for each in given)

    def __copy__(self) -> Wanted:
        """Return itself: nothing of it changes."""
        return self

    def __deepcopy__(self, memo: Any) -> Wanted:
        """Return itself."""
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle functions by their names.

        Raises:
            InvalidValueError: One has none that another process would find.
        """
        for name, function in (("objective", self.own_objective), ("subject_to", self.subject_to)):
            if function is not None and not _found_by_name(function):
                raise InvalidValueError(
                    f"{name} = {function!r}: cannot be pickled, since no other process finds it by its name; "
                    "define it by `def` at the top of a module, not as a lambda or inside a function"
                )
        objective = self.objective if self.own_objective is None else self.own_objective
        return Wanted.of, (objective, self.effort_weight, self.subject_to, copy.copy(self.shared_actuators))


def _named(objective: Any) -> Objective:
    try:
        return Objective(objective)
    except ValueError:
        names = ", ".join(repr(each.value) for each in Objective)
        raise InvalidValueError(
            f"objective = {objective!r}: must be one of {names}, or a function of the forces"
        ) from None


def _found_by_name(function: Any) -> bool:
    found: Any = sys.modules.get(getattr(function, "__module__", None) or "")
    for part in getattr(function, "__qualname__", "?").split("."):
        found = getattr(found, part, None)
    return found is function
