"""Whether one contact explains the wrench on a held object, or it takes several.

Any wrench that pushes has a centroid on a surface, so one sample rarely tells. A window does, while the hand
changes the force. One contact stays where it is, m_i - c x f_i - q_i n = 0 with one c for all i, and loads its
friction and its spin within bounds. The centroid of two lies between them, and wanders as their shares change. The
centroid of each sample takes up c and q exactly; so the test is whether all centroids are one place, by a sum of
squares with their full covariance: noise by itself at each sample, errors of zeros, poses and weight the same for
all. The window is cut into blocks: shares change slowly, noise does not.

Two contacts whose loads keep their proportion are one to any force sensor. Hence a place that stands still says
"one" only if it would have moved: if two contacts, whose shares change as the direction of the force does, would
have shown at `ContactBounds.separation`. Two equal contacts whose loads vary on their own, each by s of itself,
change the force by s / sqrt(2) and their shares by s / sqrt(8): half as much. If they would not have shown, the
answer is that it cannot be told, and what to do.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.special import chdtrc, chdtri, chndtrinc, ndtri

from palpate.errors import FloatArray, check_not_negative, check_positive
from palpate.estimation import Assumption, BrokenAssumption, Verdict
from palpate.sensing.contact import Contacts, ContactStatus
from palpate.sensing.held.external_wrench import ExternalWrenches
from palpate.sensing.held.place_statistics import Places, blocks
from palpate.sensing.solver import Surface, contacts_from_wrenches
from palpate.sensing.uncertainty import ContactUncertainties, UncertaintyStatus, contacts_uncertainties

LEVEL = 1e-3
"""Probability with which one contact is taken for several, over all tests together."""

POWER = 0.95
"""Probability with which two contacts that are far enough apart are told."""

FEWEST = 8
"""Samples with a place, for an answer."""

BLOCKS = 12
"""That a window is cut into: six periods of a change of force have two each."""

WITHOUT_PLACE = 0.1
"""Share of samples that push and have no place on the surface, from which one contact is excluded."""

PUSHES = 5.0
"""Standard deviations of the force that are more than noise."""

TESTS = 3
"""Place, friction, spin: each has a third of `LEVEL`."""


class ContactCount(StrEnum):
    """How many contacts it takes to explain the wrench."""

    ONE = "one"
    """One, at one place; two that are `separation` apart would have shown."""
    SEVERAL = "several"
    """More than one, or one that moves on the object."""
    UNTOLD = "untold"
    """The window does not tell; the verdict says why."""


@dataclass(frozen=True, slots=True)
class ContactBounds:
    """What one contact can be, and how far apart two are that are to be told.

    Attributes:
        friction: Largest coefficient of friction that is possible.
        spin_length: Largest spin torque over mu f_n [m]: of a small contact about its radius.
        separation: Distance of two contacts that is to be told [m].
        wander: By how much, standard deviation, one contact may wander on the object as the force changes, rolling
            on a rounded edge or yielding [m].

    Raises:
        InvalidValueError: One of them is negative, or friction or separation is 0.
    """

    friction: float = 1.5
    spin_length: float = 2e-3
    separation: float = 0.01
    wander: float = 2e-5

    def __post_init__(self) -> None:
        check_positive(self, friction="", separation="m")
        check_not_negative(self, spin_length="m", wander="m")


@dataclass(frozen=True, slots=True, eq=False)
class CountedContacts:
    """What a window of wrenches says.

    Attributes:
        count: One, several, or untold.
        verdict: OK for one; else why not one, or why it is untold, and what to do.
        place: Of the contact, or the mean centroid of several, on the object, shape (3,) [m]; NaN without any.
        covariance: Of that place if the contact is one, shape (3, 3) [m^2].
        wanders: Root mean square by which blocks wander about it beyond noise, along its largest direction,
            shape (3,) [m].
        noticed: Least distance of two contacts that the window would have told [m], infinite if the force kept its
            direction.
        probability: With which one contact's places would look so scattered, or more.
        on_line: With which places between two contacts would look so far from a straight line, or more: if it is
            small, not even two that stay where they are explain them, on a surface that is straight there.
    """

    count: ContactCount
    verdict: Verdict
    place: FloatArray
    covariance: FloatArray
    wanders: FloatArray
    noticed: float
    probability: float
    on_line: float


def count_contacts(surface: Surface, wrenches: ExternalWrenches, bounds: ContactBounds) -> CountedContacts:
    """Return whether one contact at one place of the object explains all wrenches of a window.

    The object stands still or moves, but does not roll on what it touches by more than `bounds.wander`.

    Args:
        surface: Of the object, in the frame of the wrenches; for a held tool see `ExternalWrenches.seen_from`.
        wrenches: In the order in which they were taken; noise independent from sample to sample: of filtered
            readings, take one in each time constant or means over several.
        bounds: What one contact can be.
    """
    contacts = contacts_from_wrenches(surface, wrenches.wrench)
    known = contacts_uncertainties(surface, contacts, wrenches.covariance)
    without = _without_place(contacts, wrenches)
    used = (contacts.status == ContactStatus.OK) & (known.status <= UncertaintyStatus.NONLINEAR)
    nowhere, unknown = np.full(3, np.nan), np.full((3, 3), np.nan)
    if used.sum() < FEWEST:
        count = ContactCount.SEVERAL if without else ContactCount.UNTOLD
        few = () if without else (_too_few(int(used.sum()), len(used)),)
        return CountedContacts(count, Verdict((*without, *few)), nowhere, unknown, nowhere, np.inf, np.nan, np.nan)

    places = Places.of(contacts, known.jacobians, wrenches, used, BLOCKS, bounds.wander)
    place, covariance, squares = places.common()
    probability = float(chdtrc(places.freedom, squares))
    limit = float(chdtri(places.freedom, LEVEL / TESTS))
    noticed = _noticed(places, limit)
    wanders = places.wander()
    several = [*without]
    if squares > limit:
        several.append(
            BrokenAssumption(
                Assumption.CONSISTENT,
                f"the place wanders by {1e3 * float(np.linalg.norm(wanders)):.2g} mm, which one contact does with "
                f"probability {probability:.1g}, at least {LEVEL / TESTS:.1g}",
                "take it for several contacts, or for one that rolls or slides: hold the object's direction and "
                "look again",
            )
        )
    several += _beyond_friction(contacts, known, wrenches, used, bounds)
    untold = [] if noticed <= bounds.separation else [_unmoved(noticed, bounds, places)]
    if several:
        count, verdict = ContactCount.SEVERAL, Verdict(tuple(several))
    else:
        count, verdict = (ContactCount.UNTOLD if untold else ContactCount.ONE), Verdict(tuple(untold))
    on_line = float(chdtrc(len(places.place) - 2, places.about_line()))
    return CountedContacts(count, verdict, place, covariance, wanders, noticed, probability, on_line)


def _without_place(contacts: Contacts, wrenches: ExternalWrenches) -> tuple[BrokenAssumption, ...]:
    """Return that no place explains what pushes, if it is so too often for noise."""
    variance = np.trace(wrenches.covariance[:, :3, :3], axis1=1, axis2=2)
    pushes = np.linalg.norm(wrenches.wrench[:, :3], axis=1) > PUSHES * np.sqrt(variance)
    missing = pushes & np.isin(contacts.status, (ContactStatus.NO_CONTACT, ContactStatus.OUTSIDE))
    share = missing.sum() / max(int(pushes.sum()), 1)
    if pushes.sum() < FEWEST or share <= WITHOUT_PLACE:
        return ()
    finding = (
        f"no place of the surface explains {100 * share:.0f} % of the wrenches, at most {100 * WITHOUT_PLACE:g} %"
    )
    return (
        BrokenAssumption(
            Assumption.CONSISTENT, finding, "take it for several contacts, if surface, zero and weight are right"
        ),
    )


def _too_few(used: int, of: int) -> BrokenAssumption:
    return BrokenAssumption(
        Assumption.ENOUGH_DATA,
        f"{used} of {of} samples have a place that noise leaves certain, at least {FEWEST}",
        "press harder, or longer",
    )


def _unmoved(noticed: float, bounds: ContactBounds, places: Places) -> BrokenAssumption:
    turned = f"the force's direction changes by {np.degrees(places.turned):.2g} degrees"
    found = (
        f"two contacts would show from {1e3 * noticed:.2g} mm on" if np.isfinite(noticed) else "two would not show"
    )
    return BrokenAssumption(
        Assumption.UNIQUE,
        f"{turned}, so that {found}, which must be at most {1e3 * bounds.separation:.3g} mm",
        "push sideways, there and back, or press harder while the window is taken",
    )


def _noticed(places: Places, limit: float) -> float:
    """Return the separation from which two contacts would have been told with probability `POWER` [m]."""
    needed = float(chndtrinc(limit, places.freedom, 1.0 - POWER))
    per_square_metre = places.shown_by_shares()
    return float(np.sqrt(needed / per_square_metre)) if per_square_metre > 0.0 else np.inf


def _beyond_friction(
    contacts: Contacts,
    known: ContactUncertainties,
    wrenches: ExternalWrenches,
    used: np.ndarray,
    bounds: ContactBounds,
) -> Iterator[BrokenAssumption]:
    """Yield what is more than one contact bears in the mean of a block: bounds are convex, so that keeps them."""
    J, normal, spin = known.jacobians, contacts.normal_force[used], contacts.spin_torque[used]
    size = np.linalg.norm(contacts.tangential_force[used], axis=1)
    along = contacts.tangential_force[used] / np.where(size > 0.0, size, 1.0)[:, None]
    lever = bounds.friction * bounds.spin_length
    by_friction = np.einsum("ia,iak->ik", along, J.tangential_force[used])
    by_spin = np.sign(spin)[:, None] * J.spin_torque[used]
    parts = blocks(len(normal), BLOCKS)
    quantile = float(ndtri(1.0 - LEVEL / TESTS / len(parts)))
    for name, unit, excess, slope in (
        ("friction", "N", size - bounds.friction * normal, by_friction - bounds.friction * J.normal_force[used]),
        ("spin torque", "N m", np.abs(spin) - lever * normal, by_spin - lever * J.normal_force[used]),
    ):
        own = np.einsum("ik,ikl,il->i", slope, wrenches.noise[used], slope)
        common = np.einsum("ik,ikq->iq", slope, wrenches.common[used])
        mean = np.array([excess[part].mean() for part in parts])
        sd = np.sqrt([own[p].sum() / len(p) ** 2 + np.sum(common[p].mean(axis=0) ** 2) for p in parts])
        worst = int(np.argmax(mean - quantile * sd))
        if mean[worst] > quantile * sd[worst]:
            yield BrokenAssumption(
                Assumption.PLAUSIBLE,
                f"{name} is {mean[worst]:.2g} {unit} more than one contact bears, with a standard deviation of "
                f"{sd[worst]:.1g} {unit}",
                "take it for several contacts, if friction and spin length are bounded rightly",
            )
