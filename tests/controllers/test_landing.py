"""Landing: the peak force is kept, bounces and searches are bounded, the transfer is bumpless."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import BumplessTransfer, LandingModel, series_stiffness
from palpate.controllers.grip.controller_sequence import ControllerSequence
from palpate.controllers.guarded_approach import ContactEvent, GuardedApproach, Loss
from palpate.controllers.landing import meeting_speed
from palpate.runtime.data import ArmSample, Command, Observation, Phase
from palpate.spatial import IDENTITY, ZERO


def knock(speed, servo, contact, mass, damping_ratio, delay):
    """Peak of the contact force: a mass on a servo that goes on for a delay, then stops, meets a spring."""
    dt = min(2e-5, 0.02 * math.sqrt(mass / (contact + servo)))
    servo_damping, damping = 2.0 * math.sqrt(servo * mass), 2.0 * damping_ratio * math.sqrt(contact * mass)
    # a steady ramp: the servo trails so far that its spring balances its damping
    position, reference, velocity, peak = 0.0, speed * servo_damping / servo, speed, 0.0
    for i in range(math.ceil(0.2 / dt)):
        force = max(contact * position + damping * velocity, 0.0)
        peak = max(peak, force)
        velocity += dt / mass * (servo * (reference - position) - servo_damping * velocity - force)
        position += dt * velocity
        reference += dt * speed if i * dt < delay else 0.0
    return peak


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    st.floats(2e3, 5e5),
    st.floats(0.5, 10.0),
    st.floats(60.0, 200.0),
    st.sampled_from([0.0, 0.3, 1.0]),
    st.floats(0.5, 5.0),
    st.floats(0.001, 0.05),
)
def test_the_speed_of_landing_keeps_the_peak(contact, mass, bandwidth, damping_ratio, force, fastest):
    """The servo goes on for one and a half periods, and then for its own lag."""
    servo, delay = mass * bandwidth**2, 1.5e-3
    model = LandingModel(series_stiffness(contact, servo), delay + 2.0 / bandwidth, contact, mass)
    speed = model.speed(force)
    assert knock(speed, servo, contact, mass, damping_ratio, delay) <= (force + 1.0) * (1.0 + 1e-9)
    assert model.peak(speed) == pytest.approx(force + 1.0)
    assert LandingModel(1.1 * contact, 0.02, 1.1 * contact, 5.0).speed(2.0) < LandingModel(
        contact, 0.02, contact, 5.0
    ).speed(2.0)
    landing = LandingModel(14e3, 0.0215, 20e3, 5.0)
    on_motion = landing.speed_on_motion(4.0 * force + 2.0, fastest)
    assert landing.peak(meeting_speed(on_motion, fastest)) == pytest.approx(4.0 * force + 2.0, rel=1e-6)


def test_the_bumpless_transfer_begins_with_what_is_felt_and_ends_with_what_is_wanted():
    transfer = BumplessTransfer(0.2)
    assert transfer.force(5.0, 0.7, 2.0) == pytest.approx(0.7)
    forces = [transfer.force(5.0 + 1e-3 * i, 9.9, 2.0) for i in range(200)]
    assert np.all(np.diff(forces) >= 0.0)
    assert np.diff(forces).max() < 0.014
    assert forces[100:] == pytest.approx([2.0] * 100)
    transfer.reset()
    assert transfer.force(6.0, 3.5, 2.0) == 2.0  # a knock is not held


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.floats(0.0001, 0.005), st.floats(0.002, 0.05), st.floats(0.002, 0.03), st.floats(0.0, 1.0))
def test_what_goes_up_and_down_is_met_no_faster_than_stated(landing, fastest, amplitude, phase):
    """A tip that comes down steadily on a sine, wherever that begins."""
    rate = fastest / amplitude
    time = np.linspace(0.0, 2.0 * math.pi / rate * 3.0 + 2.2 * amplitude / landing, 400_001)
    surface = amplitude * np.sin(rate * time + 2.0 * math.pi * phase)
    tip = 1.05 * amplitude - landing * time
    first = int(np.argmax(tip <= surface))
    upward = amplitude * rate * math.cos(rate * time[first] + 2.0 * math.pi * phase)
    assert landing + upward <= meeting_speed(landing, fastest) * 1.001


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


def test_nothing_within_the_approach_distance_is_missing_and_nothing_within_the_search_distance_gone():
    """Contact that is found again is gone after the second loss."""
    assert driven([False] * 10_002)[0].loss is Loss.MISSING
    assert driven([True] * 10 + [False] * 150)[0].loss is Loss.FOUND
    assert driven([True] * 10 + [False] * 250)[0].loss is Loss.GONE
    contact, events, _ = driven([True] * 10 + [False] * 20 + [True] * 10 + [False])
    assert contact.loss is Loss.GONE
    expected = ["TOUCHED", "SETTLED", "LOST", "TOUCHED", "SETTLED", "LOST"]
    assert [event.name for event in events if event is not None] == expected


class Says:
    """Ends with a phase after some steps."""

    def __init__(self, phase, after):
        self.phase, self.after, self.started = phase, after, 0

    def start(self, first):
        self.started, self.count = self.started + 1, 0

    def step(self, now):
        self.count += 1
        return Command(phase=self.phase if self.count >= self.after else Phase.HOLD)


def test_each_begins_where_the_one_before_was_done_and_a_loss_ends_all():
    first, second, third = Says(Phase.DONE, 2), Says(Phase.LOST, 2), Says(Phase.DONE, 1)
    sequence, observed = (
        ControllerSequence(first, second, third),
        Observation(0.0, ArmSample(0.0, ZERO, IDENTITY, ZERO), ()),
    )
    sequence.start(observed)
    assert [sequence.step(observed).phase for _ in range(4)] == [Phase.HOLD, Phase.HOLD, Phase.LOST, Phase.LOST]
    assert (first.started, second.started, third.started) == (1, 1, 0)
