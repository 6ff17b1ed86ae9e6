"""Gears' friction is made up for at once while a force rises, and ever less while it sinks."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.kinematics.gear_direction import GearDirection

SPAN = 0.1


def followed(forces, span=SPAN):
    gear, shares = GearDirection(span), []
    for force in forces:
        gear.command(force)
        shares.append(gear.driving)
    return np.array(shares)


def test_it_drives_at_once_and_goes_over_to_yielding_while_the_force_sinks():
    shares = followed([*np.linspace(2.0, 1.0, 101), 1.0, 1.05])
    assert shares[[0, 10]] == pytest.approx([1.0, 1.0 - 0.1 / (2.0 * SPAN)])
    assert (shares[21:102] == 0.0).all()  # the last force is repeated
    assert shares[102] == 1.0
    assert followed([2.0, 1.999, 1.999, 2.0, 0.0], 0.0).tolist() == [1.0, 0.0, 0.0, 1.0, 0.0]
    gear, other = GearDirection(SPAN), GearDirection(SPAN)
    gear.command(2.0)
    gear.command(1.95)
    other.set_state(gear.state())
    for each in (gear, other):
        each.command(1.9)
    assert other.driving == gear.driving < 1.0


@given(st.floats(0.5, 20.0), st.lists(st.floats(-1.0, 1.0), min_size=2, max_size=50))
def test_noise_does_not_turn_it_round(force, noise):
    assert followed([force * (1.0 + 0.04 * SPAN * each) for each in noise]).min() > 0.9


@given(st.lists(st.floats(0.0, 20.0), min_size=1, max_size=30))
def test_the_smaller_the_step_down_the_smaller_the_change(forces):
    shares = followed(forces)
    assert ((shares >= 0.0) & (shares <= 1.0)).all()
    for (before, now), (first, then) in zip(pairwise(forces), pairwise(shares), strict=True):
        if now < before:
            assert then <= first
        elif now > before:
            assert then == 1.0
        else:
            assert then == first
