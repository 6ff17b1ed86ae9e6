"""A squeeze tells what slides from what holds; a bound of friction falls at once and rises slowly."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.hanging_load import MeasuredLoad
from palpate.controllers.grip.slip_bounded_surface import LEAST_LEFT, REGAINS, SlipBoundedSurface
from palpate.controllers.grip.squeeze_test import LASTS, SQUEEZE, Answer, SqueezeTest
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface

PERIOD, NOISE = 1e-3, 0.014
SURFACE = LimitSurface(0.6, 0.004)


def answer(load_of, seed, fingers=2):
    """Squeeze after 0.2 s; `load_of` tells what is borne at a grip over the first."""
    generator, test, grip, k = np.random.default_rng(seed), SqueezeTest(fingers, PERIOD), 4.0, 0
    while True:
        if k == 200:
            assert test.steady
            test.begin(k * PERIOD)
        wanted = 4.0 * (1.0 + SQUEEZE) if test.active else 4.0
        grip += 0.08 * (wanted - grip)
        load = MeasuredLoad(load_of(grip / 4.0) + NOISE * generator.standard_normal(), NOISE)
        found = test.step(k * PERIOD, (load,), grip)
        if found is not None:
            assert PERIOD * (k - 200) <= LASTS + PERIOD
            return found
        k += 1


@given(st.integers(0, 10**6), st.floats(1.0, 3.0))
@settings(max_examples=20, deadline=None)
def test_friction_follows_the_grip_and_a_load_does_not(seed, load):
    assert answer(lambda grip: load * grip, seed) is Answer.SLIDES
    assert answer(lambda grip: load, seed) is not Answer.SLIDES


def test_a_load_that_is_about_to_grow_is_not_tested():
    test = SqueezeTest(2, PERIOD)
    for k in range(100):
        test.step(k * PERIOD, (MeasuredLoad(1.0 + 0.002 * k, NOISE),), 4.0)
    assert not test.steady


# --- bounds


def bounded():
    surface = SlipBoundedSurface(KnownSurface(SURFACE))
    surface.watch(0.0, (None, None), (False, False))
    return surface


@given(st.floats(0.05, 0.59), st.floats(0.0, 0.59))
def test_what_slips_shows_its_friction_and_the_others_may_have_lost_the_same_share(shown, borne):
    surface = bounded()
    surface.show((shown, math.inf), (shown, borne))
    first = max(shown, LEAST_LEFT * SURFACE.friction)
    assert surface.surface(0).friction == pytest.approx(first)
    assert surface.surface(1).friction == pytest.approx(min(max(first, borne), SURFACE.friction))


def test_a_bound_rises_at_once_to_what_is_borne_and_beyond_slowly_and_ever_slower():
    surface, time, gained = bounded(), 0.0, []
    for _ in range(3):
        surface.keep()
        surface.show((0.4, 0.4), (0.4, 0.4))
        at = surface.surface(0).friction
        load = ContactLoad(2.0, (0.5 * at * 2.0, 0.0, 0.0), 0.0)
        for _ in range(1000):
            time += PERIOD
            surface.watch(time, (load, load), (False, False))
        gained.append(surface.surface(0).friction / at - 1.0)
    assert gained == pytest.approx([1.0 / REGAINS, 0.5 / REGAINS, 0.25 / REGAINS], rel=0.05)
    load = ContactLoad(2.0, (0.5 * 2.0, 0.0, 0.0), 0.0)
    for _ in range(1000):
        time += PERIOD
        surface.watch(time, (load, load), (False, False))
    assert surface.surface(0).friction == pytest.approx(0.5, rel=0.01)


def test_what_was_no_slip_is_taken_back():
    surface = bounded()
    surface.keep()
    surface.show((0.3, math.inf), (0.3, 0.1))
    surface.take_back()
    assert surface.surface(0) == surface.surface(1) == SURFACE
