"""Slip told from the signals: what each detector must and must not see, whatever frame and side."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.excited_slip import ExcitedSlip
from palpate.friction.slip.grip_dither import GripDither
from palpate.friction.slip.kinds import SlipKind, kind_of_slip
from palpate.friction.slip.load_noise import LoadNoise
from palpate.friction.slip.page_test import PageTest
from support.loads_on_surface import on_surface

PERIOD = 1e-3
SURFACE = LimitSurface(0.5, 0.004, 0.2, 1.7)
NOISE = LoadNoise()
DITHER = GripDither()
directions = st.floats(0.0, 2.0 * math.pi)


def noisy(load, rng, noise=NOISE):
    f, (x, y, z), q = load.normal_force, load.tangential_force, load.spin_torque
    a, b, c, d = rng.standard_normal(4)
    return ContactLoad(f + noise.force * a, (x + noise.force * b, y + noise.force * c, z), q + noise.torque * d)


def times_told(detector, loads):
    return [k for k, load in enumerate(loads) if detector.step(load) is not None]


# --- Page's test ---


@given(st.lists(st.floats(-5.0, 5.0), max_size=60))
def test_the_sum_of_pages_test_is_that_since_its_lowest_point(steps):
    test = PageTest(1e9, math.inf)
    total, lowest = 0.0, 0.0
    for step in steps:
        test.add(step)
        total += step
        lowest = min(lowest, total)
        assert test.sum == pytest.approx(total - lowest, abs=1e-9)


def test_false_alarms_of_pages_test_are_as_rare_as_lorden_says():
    rng = np.random.default_rng(1)
    threshold, shift, count, n = 6.0, 1.0, 0, 200_000
    test = PageTest(threshold, math.inf)
    for x in rng.standard_normal(n).tolist():
        if test.add(shift * x - 0.5 * shift**2):
            count += 1
            test.restart()
    assert count <= n / math.exp(threshold)


def test_an_alarm_is_over_when_as_much_speaks_against_it():
    test = PageTest(10.0, 4.0)
    assert [test.add(9.0) for _ in range(3)] == [False, False, True]
    assert [test.add(math.nan) for _ in range(3)] == [True] * 3
    assert [test.add(-9.0) for _ in range(3)] == [True, True, False]


# --- slide or spin ---


@given(st.floats(0.01, 1.56), directions, st.floats(1.05, 2.0))
def test_the_kind_of_slip_is_the_larger_part_of_the_slip_twist(share, across, p):
    surface = LimitSurface(0.5, 0.004, 0.2, p)
    load = on_surface(surface, 3.0, share, across=across)
    slip, e = surface.slip_direction(load), surface.spin_length_at(3.0)
    turning, speed = e * abs(slip.spin), math.hypot(*slip.velocity)
    if abs(turning - speed) > 1e-9:
        assert (kind_of_slip(surface, load) is SlipKind.SPIN) == (turning > speed)


# --- excited ---


def rippling(k, grip=4.0, phase=0.4):
    t = k * PERIOD
    return grip + DITHER.amplitude_at(grip) * math.sin(2.0 * math.pi * DITHER.frequency * t + phase)


@given(st.floats(0.0, 3.1), directions, st.floats(0.0, 6.3))
@settings(max_examples=15, deadline=None)
def test_a_load_that_follows_the_ripple_slips_and_one_that_does_not_sticks(share, across, phase):
    rng = np.random.default_rng(5)
    weak = LimitSurface(0.35, 0.003, 0.0, 1.7)
    true = LimitSurface(0.5, 0.004, 0.0, 1.7)
    stuck = on_surface(true, 4.0, share, 0.9, across)
    sticking, slipping = ExcitedSlip(weak, DITHER, PERIOD), ExcitedSlip(weak, DITHER, PERIOD)
    held = []
    for k in range(1000):
        load = ContactLoad(rippling(k, phase=phase), stuck.tangential_force, stuck.spin_torque)
        held.append(noisy(load, rng))
    moving = [noisy(on_surface(true, rippling(k, phase=phase), share, across=across), rng) for k in range(100)]
    assert times_told(sticking, held) == []
    told = times_told(slipping, moving)
    assert told
    assert told[0] <= 22  # in the worst phase half of the samples are without ripple


def test_within_the_weakest_surface_nothing_slips_however_it_ripples():
    weak = LimitSurface(0.6, 0.004)
    detector = ExcitedSlip(weak, DITHER, PERIOD)
    loads = [on_surface(weak, rippling(k), 0.3, 0.9) for k in range(500)]
    assert times_told(detector, loads) == []


def test_a_steady_grip_says_nothing_about_slip():
    rng = np.random.default_rng(6)
    weak = LimitSurface(0.35, 0.003)
    detector = ExcitedSlip(weak, DITHER, PERIOD)
    assert times_told(detector, [noisy(on_surface(weak, 4.0, 0.3, 1.5), rng) for _ in range(3000)]) == []


def test_a_gap_begins_the_row_of_samples_anew():
    weak = LimitSurface(0.35, 0.003)
    detector = ExcitedSlip(weak, DITHER, PERIOD)
    for k in range(50):
        detector.step(on_surface(weak, rippling(k), 0.3, 1.2))
    assert detector.evidence == 1.0
    assert detector.step(ContactLoad(math.nan, (math.nan,) * 3, math.nan)) is None
    assert detector.evidence == 0.0
