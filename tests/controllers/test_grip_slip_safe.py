"""Minimum grip: optimal, kept with its margin, quick up, slow down, ahead of announced loads, never open."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.controllers.grip.announced_loads import LoadAnnouncedBefore
from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.expected_load import ExpectedLoad
from palpate.controllers.grip.load_ahead import LoadAhead
from palpate.controllers.grip.need import NeedWithoutSpin, NeedWithSpin, least_grip_of_two
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.preload import Preload
from palpate.controllers.grip.rubbed_need import NeedWithinRubbed
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.fingers import FingerSlips
from palpate.sensing.ft.health import HEALTHY
from palpate.sensing.ft.poses import STANDARD_GRAVITY
from palpate.spatial import ZERO
from support.felt_finger import BROKEN, finger, grip_load, observed
from support.ratio_detector import RatioDetector

PERIOD = 1e-3

SURFACE = LimitSurface(0.5, 0.004)

PLAIN = GripParameters(margin=0.1, reserve=0.05)

surfaces = st.builds(
    LimitSurface, st.floats(0.1, 1.2), st.floats(1e-3, 8e-3), st.floats(0.0, 1.0 / 3.0), st.floats(1.0, 2.0)
)

forces = st.tuples(*[st.floats(-5.0, 5.0)] * 3)

tangential_forces, torques, largest = st.floats(0.0, 8.0), st.floats(0.0, 0.05), st.floats(0.2, 20.0)

moments = st.tuples(*[st.floats(-0.02, 0.02)] * 3)


def grip_of(parameters=PLAIN, **more):
    return SlipSafeGrip(2, KnownSurface(SURFACE), PERIOD, parameters, **more)


STEADY, QUIET = (1.5, 0.0), (0.5, 1e-3)
"""Loads of a finger: (tangential force [N], spin torque [N m])."""


def hold(grip, load, seconds, first=0.0):
    """Targets of a grip under a constant load of both fingers."""
    return grip_load(grip, lambda t: load, round(seconds / PERIOD), round(first / PERIOD))[1]


def feel(grip, seconds, first, *fingers):
    """Step a grip while its fingers feel what `fingers` say; returns its commands."""
    periods = range(round(first / PERIOD), round((first + seconds) / PERIOD))
    return [grip.step(observed(i * PERIOD, *fingers)) for i in periods]


class Rings:
    """A `SlipWatch` that reports a slip of the first finger from a time on."""

    def __init__(self, when, duration=PERIOD):
        self.when, self.end, self.slipping = when - 0.5 * PERIOD, when + duration - 0.5 * PERIOD, False

    def start(self):
        """Nothing to do."""

    def step(self, time, loads):
        began, self.slipping = not self.slipping, self.when < time < self.end
        return (self.slipping and began, False)


@given(surfaces, forces, moments, st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.integers(0, 2**32 - 1))
def test_no_distribution_needs_less_than_equal_shares(surface, force, moment, of_force, of_moment, seed):
    """Whatever share of force and torque the first finger takes, the one that needs more needs at least this.

    The least grip does not depend on the frame.
    """
    contacts = ((0.03, 0.0, 0.0), (-0.03, 0.0, 0.0))
    least = least_grip_of_two(surface, (*force, *moment), *contacts)
    across, about = math.hypot(force[1], force[2]), abs(moment[0])
    shares = (of_force * across, of_moment * about), ((1 - of_force) * across, (1 - of_moment) * about)
    assert max(surface.least_normal_force(*share) for share in shares) >= least * (1.0 - 1e-9)
    generator, oblique = np.random.default_rng(seed), [(0.03, 0.01, 0.0), (-0.02, 0.0, 0.01)]
    rotation, moved = Rotation.random(random_state=generator).as_matrix(), generator.uniform(-0.1, 0.1, 3)
    f = rotation @ force
    there = [tuple((rotation @ each + moved).tolist()) for each in oblique]
    turned = (*f.tolist(), *(rotation @ moment + np.cross(moved, f)).tolist())
    here = least_grip_of_two(surface, (*force, *moment), *oblique)
    assert least_grip_of_two(surface, turned, *there) == pytest.approx(here, rel=1e-6, abs=1e-7)


@given(surfaces, tangential_forces, torques, largest)
@settings(max_examples=150)
def test_ignoring_spin_never_asks_for_more_and_an_unrubbed_range_never_for_less(surface, force, torque, most):
    """Beyond the largest rubbed force the true e lies between its value there and the one that goes on growing.

    The need has no step at the border: a grip that jumps would be a blow.
    """
    with_spin, need = NeedWithSpin().least(surface, force, torque), NeedWithinRubbed(most)
    found = need.least(surface, force, torque)
    assert NeedWithoutSpin().least(surface, force, torque) <= with_spin * (1.0 + 1e-12)
    assert surface.load_ratio(with_spin, force, torque) <= 1.0 + 1e-9
    assert NeedWithinRubbed(math.inf).least(surface, force, torque) == with_spin
    assert found >= with_spin * (1.0 - 1e-12)
    if with_spin <= most:
        assert found == with_spin
    else:
        stays = LimitSurface(surface.friction, surface.spin_length_at(most), 0.0, surface.norm_exponent)
        assert stays.load_ratio(found, force, torque) == pytest.approx(1.0)
    if with_spin >= 1e-3:
        scale = most / with_spin  # about which the need reaches the border
        below, above = (need.least(surface, k * scale * force, k * scale * torque) for k in (0.999, 1.001))
        assert 0.0 <= above - below <= 0.01 * above


@given(st.floats(-50.0, 50.0), st.floats(-0.5, 0.5), st.floats(2e-3, 20e-3), st.floats(0.0, 0.05))
def test_a_ramp_is_followed_without_lag_and_looked_ahead_along(rate, torque_rate, smoothing, lead):
    ahead, count = LoadAhead(smoothing, PERIOD), round(30 * smoothing / PERIOD)
    for i in range(count + 1):
        ahead.step(ContactLoad(3.0, (0.0, 1.0 + rate * i * PERIOD, 0.0), torque_rate * i * PERIOD))
    force, torque = ahead.ahead(lead)
    end = count * PERIOD + lead
    assert force == pytest.approx(abs(1.0 + rate * end), abs=1e-6 * (1.0 + abs(rate)))
    assert torque == pytest.approx(torque_rate * end, abs=1e-6)


def test_noise_comes_through_as_stated():
    ahead, smoothing = LoadAhead(10e-3, PERIOD), 10e-3
    values = []
    for noise in np.random.default_rng(1).standard_normal(60000):
        ahead.step(ContactLoad(3.0, ZERO, float(noise)))
        values.append((ahead.ahead(0.0)[1], ahead.ahead(1.0)[1]))
    now, later = np.array(values).T
    assert np.std(now) == pytest.approx(math.sqrt(1.25 * PERIOD / smoothing), rel=0.1)
    assert np.std(later - now) == pytest.approx(math.sqrt(PERIOD / (4.0 * smoothing**3)), rel=0.1)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(st.floats(0.3, 3.0), st.floats(-0.01, 0.01))
def test_a_steady_load_is_gripped_with_its_need_and_the_margin(force, torque):
    grip, need = grip_of(), SURFACE.least_normal_force(force, torque)
    hold(grip, (force, torque), 3.0)
    assert grip.needed == pytest.approx(need, rel=1e-9)
    assert grip.target == pytest.approx(max(1.1 * need + 0.05, PLAIN.least_grip), rel=1e-3)


def test_a_growing_load_is_met_before_it_is_there():
    """With the lead the grip is by then what the load of a lead later needs; without it, what it needed now."""
    rate = 5.0
    for lead in (0.0, 0.02):
        grip = grip_of(GripParameters(margin=0.0, reserve=0.0, lead=lead))
        grip_load(grip, lambda t: (0.5 + rate * t, 0.0), 500)
        ahead = grip.target - (0.5 + rate * 0.499) / SURFACE.friction
        assert ahead == pytest.approx(lead * rate / SURFACE.friction, rel=1e-3, abs=1e-3 if lead == 0.0 else 0.0)


def test_it_rises_no_faster_than_the_actuator_and_falls_slowly():
    """A load of 1 +- 1 N at 8 Hz is held at every instant, after its first swing."""
    _, targets = grip_load(grip_of(), lambda t: (2.5 if 0.5 <= t < 1.5 else 0.5, 0.0), 2500)
    rates = np.diff(targets[500:]) / PERIOD
    assert rates.max() == pytest.approx(PLAIN.grip_rate, rel=1e-6)
    assert rates.min() == pytest.approx(-PLAIN.release_rate, rel=1e-6)
    assert targets[-1] == pytest.approx(1.1 / 0.5 * 0.5 + 0.05, rel=1e-2)

    def shaken(t):
        return 1.0 + math.sin(2.0 * math.pi * 8.0 * t), 0.0

    _, targets = grip_load(grip_of(), shaken, 3000)
    assert all(targets[i] > SURFACE.least_normal_force(*shaken(i * PERIOD)) for i in range(201, 3000))


def test_noise_hardly_raises_the_grip():
    """10 mN and 0.1 mNm of noise cost 3 % of a grip of 4 N at most; the finger that needs most decides for all."""
    generator, grip, targets = np.random.default_rng(3), grip_of(), []
    for i in range(4000):
        noise = generator.standard_normal(3) * [1e-2, 1e-4, 1e-2]
        noisy = finger(1.5 + noise[0], 0.004 + noise[1], grip.target + noise[2])
        commands = grip.step(observed(i * PERIOD, finger(0.5, 0.0, grip.target), noisy))
        targets.append(grip.target)
    wanted = 1.1 * SURFACE.least_normal_force(1.5, 0.004) + 0.05
    assert wanted <= np.mean(targets[1000:]) < 1.03 * wanted
    assert commands[0] == pytest.approx(commands[1], abs=0.05)


def test_what_the_fingers_feel_corrects_the_command_within_bounds():
    """Gears that eat a tenth of the grip are made up for; one that never gives more is not chased for ever."""
    for share, reached in ((0.9, True), (0.5, False)):
        grip = grip_of()
        command = (grip.target, grip.target)
        for i in range(3000):
            felt = share * command[0]
            command = grip.step(observed(i * PERIOD, finger(1.5, 0.0, felt), finger(1.5, 0.0, felt)))
        assert (share * command[0] == pytest.approx(grip.target, rel=1e-2)) == reached
        assert command[0] <= (1.0 + PLAIN.correction_share) * grip.target + 1e-9


@pytest.mark.parametrize("fault", [{"touching": False}, {"health": BROKEN}], ids=["contact lost", "sensor broken"])
@pytest.mark.parametrize("glitch", [0.0, 40.0])
def test_a_fault_raises_the_grip_by_a_bounded_share_and_never_opens_it(fault, glitch):
    """Also after a glitch: the last load before a fault, and its growth, do not count."""
    grip = grip_of()
    before = hold(grip, STEADY, 1.0)[-1]
    if glitch:
        feel(grip, PERIOD, 1.0, finger(glitch, 0.0, 3.0), finger(*STEADY, 3.0))
        before = max(before, grip.target)
    commands = np.array(feel(grip, 3.0, 1.001, finger(0.0, 0.0, 0.0, **fault), finger(*STEADY, 3.0)))
    assert grip.faulty
    assert commands[200:].min() >= before * (1.0 + PLAIN.fault_raise) * 0.999
    assert commands.max() <= before * (1.0 + PLAIN.fault_raise) * (1.1 if glitch else 1.02)
    hold(grip, STEADY, 2.0, 4.001)
    assert not grip.faulty
    assert grip.target == pytest.approx(before, rel=1e-2)
    # a contact that comes and goes does not raise the grip again and again
    before = grip.target
    for i in range(200):
        lost = finger(**({"touching": False} if i % 2 else {"normal": before}), tangential=STEADY[0])
        feel(grip, 5 * PERIOD, 6.001 + 5 * i * PERIOD, lost, finger(*STEADY, before))
        assert before * 0.999 <= grip.target <= before * (1.0 + PLAIN.fault_raise) * 1.001
    # under a fault the other finger still raises the grip
    feel(grip, 0.5, 8.001, finger(touching=False), finger(4.0, 0.0, grip.target))
    assert grip.target >= 1.1 * SURFACE.least_normal_force(4.0, 0.0)


@pytest.mark.parametrize(("duration", "regrips", "last"), [(PERIOD, 1, 1018), (0.12, 3, 1149)])
def test_a_slip_raises_the_grip_at_once_and_lets_it_down_later(duration, regrips, last):
    """A slip that goes on raises it again, but not in every period, up to the largest grip."""
    grip = grip_of(watch=Rings(1.0, duration))
    targets = hold(grip, STEADY, 3.7)
    raised = targets[998] * (1.0 + PLAIN.regrip) ** regrips
    assert grip.regrips == regrips
    assert (targets[last], targets[1418]) == pytest.approx((raised, raised), rel=1e-3)
    assert targets[-1] == pytest.approx(targets[998], rel=1e-2)
    assert hold(grip_of(watch=Rings(0.1, 60.0)), STEADY, 3.0).max() == PLAIN.largest_grip


def test_a_detected_slip_raises_the_grip_until_it_is_over_and_not_under_a_fault():
    """A detector shows a beginning once only. Friction of 0.3 where 0.5 is assumed takes 1.3 twice."""
    watches = [FingerSlips(lambda: RatioDetector(LimitSurface(0.3, 0.004))) for _ in range(2)]
    grip, lost = (grip_of(watch=watch) for watch in watches)
    hold(grip, STEADY, 0.4)
    assert 2 <= grip.regrips <= 6
    assert not watches[0].slipping
    assert 1.5 / 0.3 < grip.target < 1.5 * 1.5 / 0.3
    before, answered = hold(lost, STEADY, 0.02)[-1], lost.regrips
    feel(lost, 0.98, 0.02, finger(touching=False), finger(*STEADY, before))
    assert lost.regrips == answered
    assert lost.target <= before * (1.0 + PLAIN.regrip) * (1.0 + PLAIN.fault_raise)


@given(st.floats(0.0, 1e3), st.floats(-1.0, 1.0), st.booleans(), st.booleans())
@settings(max_examples=50, deadline=None)
def test_whatever_is_felt_the_grip_stays_within_its_bounds(force, torque, touching, healthy):
    one = finger(force, torque, 1.0, touching=touching, health=HEALTHY if healthy else BROKEN)
    commands = np.array(feel(grip_of(), 0.1, 0.0, one, finger(0.1, 0.0, 1.0)))
    assert 0.5 * PLAIN.least_grip <= commands.min() <= commands.max() <= PLAIN.largest_grip


def test_a_grip_that_starts_anew_keeps_nothing(monkeypatch):
    """Margin and least grip may be changed while it holds; a start takes them back and starts the surface too."""
    starts, grip = [], grip_of(watch=Rings(0.2))
    monkeypatch.setattr(KnownSurface, "start", lambda _: starts.append(1))

    def commands():
        starts.clear()
        grip.start(PLAIN.least_grip)
        assert (grip.regrips, grip.target, starts) == (0, PLAIN.least_grip, [1])
        assert grip.live.value("margin") == pytest.approx(PLAIN.margin)
        return grip_load(grip, lambda t: (1.5 + math.sin(40.0 * t), 0.004 * t), 500)[0]

    first = commands()
    grip.live.request("margin", 0.5)
    assert hold(grip, STEADY, 4.0, 0.5)[-1] == pytest.approx(1.5 * 3.0 + 0.05, rel=1e-2)
    grip.live.request("least_grip", 6.0)
    assert hold(grip, STEADY, 2.0, 4.5)[-1] == pytest.approx(6.0)
    assert commands() == first


@pytest.mark.slow
@given(st.floats(0.1, 8.0), st.floats(0.0, 0.02), st.floats(0.0, 0.5))
@settings(max_examples=8, deadline=None)
def test_an_expected_load_is_held_when_it_begins_and_no_longer_when_it_is_over(force, moment, earlier):
    grip, hand, meets = grip_of(), grip_of(), 1.0 - PLAIN.lead + 2.0 * PERIOD
    grip.expect(ExpectedLoad(1.0, 1.2, force, moment))
    wanted, quiet = hold(grip, QUIET, meets), hold(grip_of(), QUIET, 0.5)[-1]
    both = SURFACE.least_normal_force(QUIET[0] + 0.5 * force, QUIET[1] + 0.5 * moment)
    assert wanted[-1] >= min((1.0 + PLAIN.margin) * both, PLAIN.largest_grip) * (1.0 - 1e-6)
    rise = (wanted[-1] - quiet) / PLAIN.grip_rate + PLAIN.lead
    assert wanted[round((1.0 - rise) / PERIOD) - 3 - round(0.1 * earlier / PERIOD)] <= quiet * 1.001
    assert hold(grip, QUIET, 4.0, meets)[-1] == pytest.approx(quiet, rel=1e-3)
    # a hand that accelerates pulls at the object
    hand.expect(ExpectedLoad(0.5, 1.0, acceleration=0.5 * STANDARD_GRAVITY))
    assert hold(hand, QUIET, 0.5)[-1] >= 1.1 * 1.5 * SURFACE.least_normal_force(*QUIET)


def test_an_announcement_counts_once_and_from_when_it_is_made():
    load = ExpectedLoad(1.0, 1.2, 2.0)
    announced, known = grip_of(announcer=LoadAnnouncedBefore(load, 0.015)), grip_of()
    known.expect(load)
    late, early = hold(announced, QUIET, 1.2), hold(known, QUIET, 1.2)
    assert max(late) == pytest.approx(max(early), rel=1e-9)
    assert late[980] < early[990]
    assert late[980] == pytest.approx(hold(grip_of(), QUIET, 1.0)[980])


@given(st.floats(0.0, 5.0), st.floats(0.0, 0.02))
@settings(max_examples=8, deadline=None)
def test_a_preload_carries_its_step_at_the_stated_cost(force, moment):
    preload, quiet = Preload(force, moment), hold(grip_of(), QUIET, 0.5)[-1]
    held = hold(grip_of(preload=preload), QUIET, 0.5)[-1]
    cost = preload.grip(SURFACE, 2, PLAIN.margin, PLAIN.lead, PLAIN.grip_rate)
    assert held == pytest.approx(quiet + cost, rel=1e-3)
    assert held >= SURFACE.least_normal_force(QUIET[0] + 0.5 * force, QUIET[1] + 0.5 * moment)
    assert preload.grip(SURFACE, 2, PLAIN.margin, 0.0, PLAIN.grip_rate) <= cost
