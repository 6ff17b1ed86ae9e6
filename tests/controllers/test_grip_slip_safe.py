"""The least grip: optimal in theory, kept with its margin, quick up, slow down, and never open."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.load_ahead import LoadAhead
from palpate.controllers.grip.need import NeedWithoutSpin, NeedWithSpin, least_grip_of_two
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.errors import InvalidValueError
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.fingers import FingerSlips
from palpate.runtime.data import ArmSample, Observation
from palpate.sensing.ft.health import HEALTHY, HealthCheck, SampleHealth
from palpate.spatial import IDENTITY, ZERO
from support.felt_finger import finger
from support.ratio_detector import RatioDetector

PERIOD = 1e-3
SURFACE = LimitSurface(0.5, 0.004)
PLAIN = GripParameters(margin=0.1, reserve=0.05)
ARM = ArmSample(0.0, ZERO, IDENTITY, ZERO)
BROKEN = SampleHealth(HealthCheck.FROZEN)

surfaces = st.builds(
    LimitSurface, st.floats(0.1, 1.2), st.floats(1e-3, 8e-3), st.floats(0.0, 1.0 / 3.0), st.floats(1.0, 2.0)
)
forces = st.tuples(*[st.floats(-5.0, 5.0)] * 3)
moments = st.tuples(*[st.floats(-0.02, 0.02)] * 3)


def observed(time, *fingers):
    return Observation(time, ARM, fingers)


def grip_of(parameters=PLAIN, **more):
    return SlipSafeGrip(2, KnownSurface(SURFACE), PERIOD, parameters, **more)


def follow(grip, load, periods, first=0, normal=None):
    """Feed a load (tangential force, spin torque) as a function of time; the fingers feel what is wanted."""
    commands = []
    for i in range(first, first + periods):
        t = i * PERIOD
        felt = grip.target if normal is None else normal(t)
        grip.live.step(t)  # as the loop does
        commands.append(grip.step(observed(t, finger(*load(t), felt), finger(*load(t), felt))))
    return commands


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


# --- what is needed


@given(surfaces, forces, moments, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_no_distribution_needs_less_than_equal_shares(surface, force, moment, of_force, of_moment):
    """Whatever share of force and torque the first finger takes, the one that needs more needs at least this."""
    contacts = ((0.03, 0.0, 0.0), (-0.03, 0.0, 0.0))
    least = least_grip_of_two(surface, (*force, *moment), *contacts)
    across, about = math.hypot(force[1], force[2]), abs(moment[0])
    shares = (of_force * across, of_moment * about), ((1 - of_force) * across, (1 - of_moment) * about)
    assert max(surface.least_normal_force(*share) for share in shares) >= least * (1.0 - 1e-9)


@given(surfaces, forces, moments, st.integers(0, 2**32 - 1))
def test_the_least_grip_does_not_depend_on_the_frame(surface, force, moment, seed):
    generator = np.random.default_rng(seed)
    rotation, _ = np.linalg.qr(generator.standard_normal((3, 3)))
    rotation *= np.sign(np.linalg.det(rotation))
    moved = generator.uniform(-0.1, 0.1, 3)
    contacts = np.array([[0.03, 0.01, 0.0], [-0.02, 0.0, 0.01]])
    there = [tuple((rotation @ each + moved).tolist()) for each in contacts]
    f = rotation @ force
    m = rotation @ moment + np.cross(moved, f)
    here = least_grip_of_two(surface, (*force, *moment), *map(tuple, contacts.tolist()))
    assert least_grip_of_two(surface, (*f.tolist(), *m.tolist()), *there) == pytest.approx(
        here, rel=1e-6, abs=1e-7
    )


@given(surfaces, st.floats(0.0, 5.0), st.floats(-0.02, 0.02))
def test_ignoring_spin_never_asks_for_more(surface, force, torque):
    with_spin, without = (
        NeedWithSpin().least(surface, force, torque),
        NeedWithoutSpin().least(surface, force, torque),
    )
    assert without <= with_spin * (1.0 + 1e-12)
    assert surface.load_ratio(with_spin, force, torque) <= 1.0 + 1e-9


# --- the load, now and a little later


@given(st.floats(-50.0, 50.0), st.floats(-0.5, 0.5), st.floats(2e-3, 20e-3), st.floats(0.0, 0.05))
def test_a_ramp_is_followed_without_lag_and_looked_ahead_along(rate, torque_rate, smoothing, lead):
    ahead = LoadAhead(smoothing, PERIOD)
    count = round(30 * smoothing / PERIOD)
    for i in range(count + 1):
        ahead.step(ContactLoad(3.0, (0.0, 1.0 + rate * i * PERIOD, 0.0), torque_rate * i * PERIOD))
    force, torque = ahead.ahead(lead)
    end = count * PERIOD + lead
    assert force == pytest.approx(abs(1.0 + rate * end), abs=1e-6 * (1.0 + abs(rate)))
    assert torque == pytest.approx(torque_rate * end, abs=1e-6)


def test_noise_comes_through_as_stated():
    smoothing, generator = 10e-3, np.random.default_rng(1)
    ahead = LoadAhead(smoothing, PERIOD)
    values, rates = [], []
    for noise in generator.standard_normal(60000):
        ahead.step(ContactLoad(3.0, ZERO, float(noise)))
        now, later = ahead.ahead(0.0)[1], ahead.ahead(1.0)[1]
        values.append(now)
        rates.append(later - now)
    assert np.std(values) == pytest.approx(math.sqrt(1.25 * PERIOD / smoothing), rel=0.1)
    assert np.std(rates) == pytest.approx(math.sqrt(PERIOD / (4.0 * smoothing**3)), rel=0.1)


# --- the grip


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(st.floats(0.3, 3.0), st.floats(-0.01, 0.01))
def test_a_steady_load_is_gripped_with_what_it_needs_and_the_margin(force, torque):
    grip = grip_of()
    follow(grip, lambda t: (force, torque), 3000)
    need = SURFACE.least_normal_force(force, torque)
    assert grip.needed == pytest.approx(need, rel=1e-9)
    assert grip.target == pytest.approx(max(1.1 * need + 0.05, PLAIN.least_grip), rel=1e-3)


def test_the_finger_that_needs_most_decides_for_all():
    grip = grip_of()
    for i in range(2000):
        commands = grip.step(observed(i * PERIOD, finger(0.5, 0.0, grip.target), finger(1.5, 0.003, grip.target)))
    assert grip.needed == pytest.approx(SURFACE.least_normal_force(1.5, 0.003))
    assert commands[0] == commands[1]


def test_a_growing_load_is_met_before_it_is_there():
    """With the lead the grip is by then what the load of a lead later needs; without it, what it needed now."""
    rate, leads = 5.0, {}
    for lead in (0.0, 0.02):
        grip = grip_of(GripParameters(margin=0.0, reserve=0.0, lead=lead))
        follow(grip, lambda t: (0.5 + rate * t, 0.0), 500)
        leads[lead] = grip.target - (0.5 + rate * 0.499) / SURFACE.friction
    assert leads[0.0] == pytest.approx(0.0, abs=1e-3)
    assert leads[0.02] == pytest.approx(0.02 * rate / SURFACE.friction, rel=1e-3)


def test_it_rises_no_faster_than_the_actuator_and_falls_slowly():
    grip = grip_of()
    follow(grip, lambda t: (0.5, 0.0), 500)
    targets = []
    for i in range(500, 2500):
        load = 2.5 if i < 1500 else 0.5
        grip.step(observed(i * PERIOD, finger(load, 0.0, grip.target), finger(load, 0.0, grip.target)))
        targets.append(grip.target)
    rates = np.diff(targets) / PERIOD
    assert rates.max() == pytest.approx(PLAIN.grip_rate, rel=1e-6)
    assert rates.min() == pytest.approx(-PLAIN.release_rate, rel=1e-6)
    assert targets[-1] == pytest.approx(1.1 / 0.5 * 0.5 + 0.05, rel=1e-2)


def test_a_shaken_load_is_held_at_every_instant():
    """+-1 N at 8 Hz about 1 N: the need is never above the grip, after the first time."""
    grip, short = grip_of(), []
    for i in range(3000):
        t = i * PERIOD
        load = 1.0 + math.sin(2.0 * math.pi * 8.0 * t)
        grip.step(observed(t, finger(load, 0.0, grip.target), finger(load, 0.0, grip.target)))
        short.append(SURFACE.least_normal_force(load, 0.0) - grip.target)
    assert max(short[200:]) < 0.0


def test_noise_hardly_raises_the_grip():
    """10 mN and 0.1 mNm of noise cost 3 % of a grip of 4 N at most."""
    generator, grip, targets = np.random.default_rng(3), grip_of(), []
    for i in range(4000):
        noise = generator.standard_normal(6) * ([1e-2, 1e-4, 1e-2] * 2)
        sides = [finger(1.5 + noise[k], 0.004 + noise[k + 1], grip.target + noise[k + 2]) for k in (0, 3)]
        grip.step(observed(i * PERIOD, *sides))
        targets.append(grip.target)
    wanted = 1.1 * SURFACE.least_normal_force(1.5, 0.004) + 0.05
    assert wanted <= np.mean(targets[1000:]) < 1.03 * wanted


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
def test_a_fault_raises_the_grip_by_a_bounded_share_and_never_opens_it(fault):
    grip = grip_of()
    follow(grip, lambda t: (1.5, 0.0), 1000)
    before = grip.target
    commands = []
    for i in range(1000, 4000):
        commands += grip.step(observed(i * PERIOD, finger(0.0, 0.0, 0.0, **fault), finger(1.5, 0.0, 3.0)))
        assert grip.faulty
    assert min(commands[400:]) >= before * (1.0 + PLAIN.fault_raise) * 0.999
    assert max(commands) <= before * (1.0 + PLAIN.fault_raise) * 1.02
    follow(grip, lambda t: (1.5, 0.0), 2000, 4000)
    assert not grip.faulty
    assert grip.target == pytest.approx(before, rel=1e-2)


def test_a_glitch_before_a_sensor_is_lost_raises_the_grip_by_no_more_than_its_share():
    """What a finger felt last, and how fast that grew, is not what it bears."""
    grip = grip_of()
    follow(grip, lambda t: (1.5, 0.0), 1000)
    grip.step(observed(1.0, finger(40.0, 0.0, 3.0), finger(1.5, 0.0, 3.0)))
    before, commands = grip.target, []
    for i in range(1001, 3000):
        commands += grip.step(observed(i * PERIOD, finger(health=BROKEN), finger(1.5, 0.0, 3.0)))
    assert max(commands) <= before * (1.0 + PLAIN.fault_raise) * 1.1


def test_under_a_fault_the_other_finger_still_raises_the_grip():
    grip = grip_of()
    follow(grip, lambda t: (1.0, 0.0), 1000)
    for i in range(1000, 1500):
        grip.step(observed(i * PERIOD, finger(touching=False), finger(4.0, 0.0, grip.target)))
    assert grip.target >= 1.1 * SURFACE.least_normal_force(4.0, 0.0)


def test_a_slip_raises_the_grip_at_once_and_let_down_later():
    grip = grip_of(watch=Rings(1.0))
    follow(grip, lambda t: (1.5, 0.0), 999)
    before = grip.target
    follow(grip, lambda t: (1.5, 0.0), 20, 999)
    assert grip.regrips == 1
    assert grip.target == pytest.approx(before * (1.0 + PLAIN.regrip), rel=1e-3)
    follow(grip, lambda t: (1.5, 0.0), 400, 1019)
    assert grip.target == pytest.approx(before * (1.0 + PLAIN.regrip), rel=1e-3)
    follow(grip, lambda t: (1.5, 0.0), 2000, 1419)
    assert grip.target == pytest.approx(before, rel=1e-2)


def test_a_slip_that_goes_on_raises_the_grip_again_but_not_in_every_period():
    grip = grip_of(watch=Rings(1.0, 0.12))
    follow(grip, lambda t: (1.5, 0.0), 1000)
    before = grip.target
    follow(grip, lambda t: (1.5, 0.0), 150, 1000)
    assert grip.regrips == 3
    assert grip.target == pytest.approx(before * (1.0 + PLAIN.regrip) ** 3, rel=1e-3)
    for_ever = grip_of(watch=Rings(0.1, 60.0))
    commands = follow(for_ever, lambda t: (1.5, 0.0), 3000)
    assert max(max(each) for each in commands) == PLAIN.largest_grip


def test_a_slip_that_a_detector_sees_go_on_raises_the_grip_again_until_it_is_over_and_not_under_a_fault():
    """A detector tells its beginning once only. Friction of 0.3 where 0.5 is believed takes 1.3 twice."""
    watch = FingerSlips(lambda: RatioDetector(LimitSurface(0.3, 0.004)))
    grip = grip_of(watch=watch)
    follow(grip, lambda t: (1.5, 0.0), 400)
    assert 2 <= grip.regrips <= 6
    assert not watch.slipping
    assert 1.5 / 0.3 < grip.target < 1.5 * 1.5 / 0.3
    lost = grip_of(watch=FingerSlips(lambda: RatioDetector(LimitSurface(0.3, 0.004))))
    follow(lost, lambda t: (1.5, 0.0), 20)
    before, answered = lost.target, lost.regrips
    for i in range(20, 1000):
        lost.step(observed(i * PERIOD, finger(touching=False), finger(1.5, 0.0, before)))
    assert lost.regrips == answered
    assert lost.target <= before * (1.0 + PLAIN.regrip) * (1.0 + PLAIN.fault_raise)


def test_a_contact_that_comes_and_goes_does_not_raise_the_grip_again_and_again():
    grip = grip_of()
    follow(grip, lambda t: (1.5, 0.0), 1000)
    before = grip.target
    for i in range(1000, 3000):
        lost = finger(touching=False) if i // 5 % 2 else finger(1.5, 0.0, grip.target)
        grip.step(observed(i * PERIOD, lost, finger(1.5, 0.0, grip.target)))
        assert before * 0.999 <= grip.target <= before * (1.0 + PLAIN.fault_raise) * 1.001


@given(st.floats(0.0, 1e3), st.floats(-1.0, 1.0), st.booleans(), st.booleans())
@settings(max_examples=50, deadline=None)
def test_whatever_is_felt_the_grip_stays_within_its_bounds(force, torque, touching, healthy):
    grip = grip_of()
    health = HEALTHY if healthy else BROKEN
    for i in range(100):
        one = finger(force, torque, 1.0, touching=touching, health=health)
        command = grip.step(observed(i * PERIOD, one, finger(0.1, 0.0, 1.0)))
        assert all(0.5 * PLAIN.least_grip <= each <= PLAIN.largest_grip for each in command)


def test_the_same_observations_give_the_same_commands_again():
    generator = np.random.default_rng(5)
    felt = [
        observed(i * PERIOD, *(finger(*generator.uniform(0, [2, 0.01, 5]).tolist()) for _ in "ab"))
        for i in range(500)
    ]
    grip = grip_of(watch=Rings(0.2))
    first = [grip.step(each) for each in felt]
    grip.start(PLAIN.least_grip)
    assert [grip.step(each) for each in felt] == first


class Learns(KnownSurface):
    """Counts how often it begins."""

    starts = 0

    def start(self):
        Learns.starts += 1


def test_a_grip_that_starts_anew_knows_nothing():
    grip = SlipSafeGrip(2, Learns(SURFACE), PERIOD, PLAIN, watch=Rings(0.2))
    follow(grip, lambda t: (1.5, 0.0), 1000)
    starts = Learns.starts
    grip.live.request("margin", 0.5)
    grip.start(1.0)
    assert Learns.starts == starts + 1
    assert (grip.regrips, grip.target) == (0, 1.0)
    assert grip.live.value("margin") == pytest.approx(PLAIN.margin)


def test_margin_and_least_grip_may_be_changed_while_it_holds():
    grip = grip_of()
    follow(grip, lambda t: (1.5, 0.0), 1000)
    grip.live.request("margin", 0.5)
    follow(grip, lambda t: (1.5, 0.0), 1500, 1000)
    assert grip.target == pytest.approx(1.5 * 3.0 + 0.05, rel=1e-2)
    grip.live.request("least_grip", 6.0)
    follow(grip, lambda t: (1.5, 0.0), 2000, 2500)
    assert grip.target == pytest.approx(6.0)


def test_what_cannot_be_is_refused():
    with pytest.raises(InvalidValueError, match="fingers = 1"):
        SlipSafeGrip(1, KnownSurface(SURFACE), PERIOD)
    with pytest.raises(InvalidValueError, match="margin"):
        GripParameters(margin=-0.1)
    with pytest.raises(InvalidValueError, match="least_grip"):
        GripParameters(least_grip=30.0)
    with pytest.raises(InvalidValueError, match=r"first_grip = 25 N: must be at most largest_grip = 20 N"):
        LiftController(grip_of(), PERIOD, LiftParameters(first_grip=25.0))
    with pytest.raises(InvalidValueError, match="fingers"):
        grip_of().step(observed(0.0, finger()))
