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


class Rings:
    """A `SlipWatch` that tells of a slip of the first finger from a time on."""

    def __init__(self, when, duration=PERIOD):
        self._when, self._end = when - 0.5 * PERIOD, when + duration - 0.5 * PERIOD
        self.slipping = False

    def start(self):
        """Nothing to do."""

    def step(self, time, loads):
        began, self.slipping = not self.slipping, self._when < time < self._end
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
    """Beyond the largest rubbed force the true e lies between that there and the one that goes on growing."""
    with_spin = NeedWithSpin().least(surface, force, torque)
    need = NeedWithinRubbed(most).least(surface, force, torque)
    assert NeedWithoutSpin().least(surface, force, torque) <= with_spin * (1.0 + 1e-12)
    assert surface.load_ratio(with_spin, force, torque) <= 1.0 + 1e-9
    assert NeedWithinRubbed(math.inf).least(surface, force, torque) == with_spin
    assert need >= with_spin * (1.0 - 1e-12)
    if with_spin <= most:
        assert need == with_spin
    else:
        stays = LimitSurface(surface.friction, surface.spin_length_at(most), 0.0, surface.norm_exponent)
        assert stays.load_ratio(need, force, torque) == pytest.approx(1.0)


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
def test_a_steady_load_is_gripped_with_what_it_needs_and_the_margin(force, torque):
    grip = grip_of()
    grip_load(grip, lambda t: (force, torque), 3000)
    need = SURFACE.least_normal_force(force, torque)
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
    grip = grip_of()
    _, targets = grip_load(grip, lambda t: (2.5 if 0.5 <= t < 1.5 else 0.5, 0.0), 2500)
    rates = np.diff(targets[500:]) / PERIOD
    assert rates.max() == pytest.approx(PLAIN.grip_rate, rel=1e-6)
    assert rates.min() == pytest.approx(-PLAIN.release_rate, rel=1e-6)
    assert targets[-1] == pytest.approx(1.1 / 0.5 * 0.5 + 0.05, rel=1e-2)


def test_a_shaken_load_is_held_at_every_instant():
    """+-1 N at 8 Hz about 1 N: the need is never above the grip, after the first time."""

    def shaken(t):
        return 1.0 + math.sin(2.0 * math.pi * 8.0 * t), 0.0

    _, targets = grip_load(grip_of(), shaken, 3000)
    needs = [SURFACE.least_normal_force(*shaken(i * PERIOD)) for i in range(3000)]
    assert (targets > needs)[200:].all()


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


@pytest.fixture
def settled():
    """A grip that has held 1.5 N for a second, and its target."""
    grip = grip_of()
    grip_load(grip, lambda t: STEADY, 1000)
    return grip, grip.target


STEADY = (1.5, 0.0)


@pytest.mark.parametrize("fault", [{"touching": False}, {"health": BROKEN}], ids=["contact lost", "sensor broken"])
@pytest.mark.parametrize("glitch", [0.0, 40.0])
def test_a_fault_raises_the_grip_by_a_bounded_share_and_never_opens_it(settled, fault, glitch):
    """Also after a glitch: the last load before a fault, and its growth, do not count."""
    (grip, before), commands = settled, []
    if glitch:
        grip.step(observed(1.0, finger(glitch, 0.0, 3.0), finger(1.5, 0.0, 3.0)))
        before = max(before, grip.target)
    for i in range(1001, 4000):
        commands += grip.step(observed(i * PERIOD, finger(0.0, 0.0, 0.0, **fault), finger(1.5, 0.0, 3.0)))
        assert grip.faulty
    assert min(commands[400:]) >= before * (1.0 + PLAIN.fault_raise) * 0.999
    assert max(commands) <= before * (1.0 + PLAIN.fault_raise) * (1.1 if glitch else 1.02)
    grip_load(grip, lambda t: STEADY, 2000, 4000)
    assert not grip.faulty
    assert grip.target == pytest.approx(before, rel=1e-2)


@pytest.mark.parametrize(("duration", "regrips"), [(PERIOD, 1), (0.12, 3)])
def test_a_slip_raises_the_grip_at_once_and_let_down_later(duration, regrips):
    """A slip that goes on raises it again, but not in every period, up to the largest grip."""
    grip = grip_of(watch=Rings(1.0, duration))
    _, targets = grip_load(grip, lambda t: STEADY, 3700)
    raised = targets[998] * (1.0 + PLAIN.regrip) ** regrips
    last = 1018 if regrips == 1 else 1149
    assert grip.regrips == regrips
    assert (targets[last], targets[1418]) == pytest.approx((raised, raised), rel=1e-3)
    assert targets[-1] == pytest.approx(targets[998], rel=1e-2)
    commands, _ = grip_load(grip_of(watch=Rings(0.1, 60.0)), lambda t: STEADY, 3000)
    assert np.max(commands) == PLAIN.largest_grip


def test_a_slip_that_a_detector_sees_go_on_raises_the_grip_again_until_it_is_over_and_not_under_a_fault():
    """A detector shows a beginning once only. Friction of 0.3 where 0.5 is assumed takes 1.3 twice."""
    watch = FingerSlips(lambda: RatioDetector(LimitSurface(0.3, 0.004)))
    grip = grip_of(watch=watch)
    grip_load(grip, lambda t: STEADY, 400)
    assert 2 <= grip.regrips <= 6
    assert not watch.slipping
    assert 1.5 / 0.3 < grip.target < 1.5 * 1.5 / 0.3
    lost = grip_of(watch=FingerSlips(lambda: RatioDetector(LimitSurface(0.3, 0.004))))
    grip_load(lost, lambda t: STEADY, 20)
    before, answered = lost.target, lost.regrips
    for i in range(20, 1000):
        lost.step(observed(i * PERIOD, finger(touching=False), finger(1.5, 0.0, before)))
    assert lost.regrips == answered
    assert lost.target <= before * (1.0 + PLAIN.regrip) * (1.0 + PLAIN.fault_raise)


def test_a_contact_that_comes_and_goes_does_not_raise_the_grip_again_and_again(settled):
    """Under a fault the other finger still raises the grip."""
    grip, before = settled
    for i in range(1000, 3000):
        lost = finger(touching=False) if i // 5 % 2 else finger(1.5, 0.0, grip.target)
        grip.step(observed(i * PERIOD, lost, finger(1.5, 0.0, grip.target)))
        assert before * 0.999 <= grip.target <= before * (1.0 + PLAIN.fault_raise) * 1.001
    for i in range(3000, 3500):
        grip.step(observed(i * PERIOD, finger(touching=False), finger(4.0, 0.0, grip.target)))
    assert grip.target >= 1.1 * SURFACE.least_normal_force(4.0, 0.0)


@given(st.floats(0.0, 1e3), st.floats(-1.0, 1.0), st.booleans(), st.booleans())
@settings(max_examples=50, deadline=None)
def test_whatever_is_felt_the_grip_stays_within_its_bounds(force, torque, touching, healthy):
    grip = grip_of()
    one = finger(force, torque, 1.0, touching=touching, health=HEALTHY if healthy else BROKEN)
    for i in range(100):
        command = grip.step(observed(i * PERIOD, one, finger(0.1, 0.0, 1.0)))
        assert all(0.5 * PLAIN.least_grip <= each <= PLAIN.largest_grip for each in command)


def test_a_grip_that_starts_anew_keeps_nothing(monkeypatch):
    """The same observations give the same commands again; the surface starts again too."""
    starts = []
    monkeypatch.setattr(KnownSurface, "start", lambda _: starts.append(1))
    grip = grip_of(watch=Rings(0.2))
    grip.start(PLAIN.least_grip)
    first, _ = grip_load(grip, lambda t: (1.5 + math.sin(40.0 * t), 0.004 * t), 500)
    count = len(starts)
    grip.live.request("margin", 0.5)
    grip.start(PLAIN.least_grip)
    assert len(starts) == count + 1
    assert (grip.regrips, grip.target) == (0, PLAIN.least_grip)
    assert grip.live.value("margin") == pytest.approx(PLAIN.margin)
    assert grip_load(grip, lambda t: (1.5 + math.sin(40.0 * t), 0.004 * t), 500)[0] == first


def test_margin_and_least_grip_may_be_changed_while_it_holds(settled):
    grip, _ = settled
    grip.live.request("margin", 0.5)
    grip_load(grip, lambda t: STEADY, 1500, 1000)
    assert grip.target == pytest.approx(1.5 * 3.0 + 0.05, rel=1e-2)
    grip.live.request("least_grip", 6.0)
    grip_load(grip, lambda t: STEADY, 2000, 2500)
    assert grip.target == pytest.approx(6.0)


HANGS, SPINS = 0.5, 1e-3


def targets(grip, seconds, first=0.0):
    """Targets of a grip while each finger carries `HANGS` and `SPINS`."""
    return grip_load(grip, lambda t: (HANGS, SPINS), round(seconds / PERIOD), round(first / PERIOD))[1]


@pytest.mark.slow
@given(st.floats(0.1, 8.0), st.floats(0.0, 0.02), st.floats(0.0, 0.5))
@settings(max_examples=8, deadline=None)
def test_what_is_expected_is_held_when_it_begins_and_no_longer_when_it_is_over(force, moment, earlier):
    grip, hand = grip_of(), grip_of()
    grip.expect(ExpectedLoad(1.0, 1.2, force, moment))
    wanted = targets(grip, 1.0 - PLAIN.lead + 2.0 * PERIOD)
    both = SURFACE.least_normal_force(HANGS + 0.5 * force, SPINS + 0.5 * moment)
    assert wanted[-1] >= min((1.0 + PLAIN.margin) * both, PLAIN.largest_grip) * (1.0 - 1e-6)
    quiet = targets(grip_of(), 0.5)[-1]
    way = (wanted[-1] - quiet) / PLAIN.grip_rate + PLAIN.lead
    before = round((1.0 - way) / PERIOD) - 3 - round(0.1 * earlier / PERIOD)
    assert wanted[before] <= quiet * 1.001
    assert targets(grip, 4.0, first=1.0 - PLAIN.lead + 2.0 * PERIOD)[-1] == pytest.approx(quiet, rel=1e-3)
    # a hand that accelerates pulls at the object
    hand.expect(ExpectedLoad(0.5, 1.0, acceleration=0.5 * STANDARD_GRAVITY))
    assert targets(hand, 0.5)[-1] >= 1.1 * 1.5 * SURFACE.least_normal_force(HANGS, SPINS)


def test_an_announcement_counts_once_and_from_when_it_is_made():
    load = ExpectedLoad(1.0, 1.2, 2.0)
    told, known = grip_of(announcer=LoadAnnouncedBefore(load, 0.015)), grip_of()
    known.expect(load)
    late, early = targets(told, 1.2), targets(known, 1.2)
    assert max(late) == pytest.approx(max(early), rel=1e-9)
    assert late[980] < early[990]
    assert late[980] == pytest.approx(targets(grip_of(), 1.0)[980])


@given(st.floats(0.0, 5.0), st.floats(0.0, 0.02))
@settings(max_examples=8, deadline=None)
def test_a_preload_bears_its_step_and_costs_what_is_told(force, moment):
    preload, quiet = Preload(force, moment), targets(grip_of(), 0.5)[-1]
    with_it = targets(grip_of(preload=preload), 0.5)[-1]
    price = preload.grip(SURFACE, 2, PLAIN.margin, PLAIN.lead, PLAIN.grip_rate)
    both = SURFACE.least_normal_force(HANGS + 0.5 * force, SPINS + 0.5 * moment)
    assert with_it == pytest.approx(quiet + price, rel=1e-3)
    assert with_it >= both
    quicker = preload.grip(SURFACE, 2, PLAIN.margin, 0.0, PLAIN.grip_rate)
    assert quicker <= price


@settings(max_examples=100)
@given(surfaces, tangential_forces, torques, largest)
def test_no_step_where_rubbing_ended(surface, force, torque, most):
    """A grip that jumps would be a blow: just above the border it is what it is just below."""
    need = NeedWithinRubbed(most)
    at = NeedWithSpin().least(surface, force, torque)
    if at < 1e-3:
        return
    scale = most / at  # about which the need comes up to the border
    below, above = (need.least(surface, share * scale * force, share * scale * torque) for share in (0.999, 1.001))
    assert 0.0 <= above - below <= 0.01 * above
