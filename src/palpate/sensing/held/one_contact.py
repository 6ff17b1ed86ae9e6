"""Whether one contact explains the wrench on a held object, or it takes several."""

from dataclasses import dataclass
from enum import StrEnum

from palpate.errors import FloatArray
from palpate.estimation import Verdict
from palpate.sensing.held.external_wrench import ExternalWrenches
from palpate.sensing.solver import Surface


class ContactCount(StrEnum):
    """How many contacts it takes to explain the wrench."""

    ONE = "one"
    SEVERAL = "several"
    UNTOLD = "untold"


@dataclass(frozen=True, slots=True)
class ContactBounds:
    """What one contact can bear, and how far apart two are that must be told."""

    friction: float
    spin_length: float
    separation: float = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class CountedContacts:
    """What a window of wrenches says."""

    count: ContactCount
    verdict: Verdict
    place: FloatArray
    place_covariance: FloatArray


def count_contacts(surface: Surface, wrenches: ExternalWrenches, bounds: ContactBounds) -> CountedContacts:
    """Return whether one contact at one place of the object explains all wrenches of a window."""
    raise NotImplementedError
