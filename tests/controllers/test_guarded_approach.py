"""Guarded approach: bounces and searches are bounded, whatever the contact does."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from palpate.controllers.guarded_approach import ContactEvent, GuardedApproach, Loss
from palpate.runtime.data import Phase
from palpate.spatial import ZERO

PERIOD, SETTLE, MOST_BOUNCES = 0.001, 0.005, 3


def driven(touches):
    """Feed one touch flag per period; the controller enters SCAN on SETTLED."""
    contact = GuardedApproach(SETTLE, 0.1, 0.002, Phase.SCAN, MOST_BOUNCES)
    contact.start(0.0, ZERO)
    events, phases = [], []
    for i, touching in enumerate(touches):
        contact.sense(PERIOD * i, (0.0, 0.0, -1e-5 * i), touching)
        events.append(contact.step())
        phases.append(contact.phase)
        if events[-1] is ContactEvent.SETTLED:
            contact.enter(Phase.SCAN)
        if contact.loss.is_final:
            break
    return contact, events, phases


@given(st.lists(st.tuples(st.booleans(), st.integers(1, 12)), max_size=30))
def test_bounces_and_searches_are_bounded_for_any_contact(spans):
    contact, events, phases = driven([touching for touching, n in spans for _ in range(n)])
    assert events.count(ContactEvent.BOUNCED) == contact.bounces <= MOST_BOUNCES + 1
    assert (contact.loss is Loss.BOUNCING) == (contact.bounces > MOST_BOUNCES)
    assert sum(b is Phase.SEEK and a is not b for a, b in pairwise(phases)) <= 1
    assert events.count(ContactEvent.LOST) <= 2
    if ContactEvent.SETTLED in events:
        assert ContactEvent.BOUNCED not in events[events.index(ContactEvent.SETTLED) :]


def test_lost_contact_that_is_found_again_is_gone_after_the_second_loss():
    contact, events, _ = driven([True] * 10 + [False] * 20 + [True] * 10 + [False])
    assert contact.loss is Loss.GONE
    told = ["TOUCHED", "SETTLED", "LOST", "TOUCHED", "SETTLED", "LOST"]
    assert [event.name for event in events if event is not None] == told


def test_nothing_within_the_approach_distance_is_missing_and_nothing_within_the_search_distance_gone():
    assert driven([False] * 10_002)[0].loss is Loss.MISSING
    assert driven([True] * 10 + [False] * 150)[0].loss is Loss.FOUND
    assert driven([True] * 10 + [False] * 250)[0].loss is Loss.GONE
