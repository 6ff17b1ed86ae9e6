"""Gears' friction is made up for at once while a force rises, and ever less while it sinks."""

from itertools import pairwise

import pytest

from palpate.kinematics.gear_direction import EASE, GearDirection


def test_it_drives_at_once_and_eases_over_to_yielding():
    gear = GearDirection()
    gear.command(2.0)
    gear.advance(0.002)
    assert gear.share == 1.0
    gear.command(1.0)
    shares = []
    for _ in range(round(2.0 * EASE / 0.002)):
        gear.command(1.0)  # said again: nothing new
        gear.advance(0.002)
        shares.append(gear.share)
    assert max(b - a for a, b in pairwise(shares)) <= 0.0
    assert shares[0] == pytest.approx(1.0 - 0.002 / EASE)
    assert shares[len(shares) // 4] == pytest.approx(0.5, abs=0.02)
    assert shares[-1] == 0.0
    gear.command(1.1)
    gear.advance(0.002)
    assert gear.share == 1.0


def test_its_state_comes_back():
    gear, other = GearDirection(), GearDirection()
    gear.command(2.0)
    gear.command(1.0)
    gear.advance(0.05)
    other.set_state(gear.state())
    gear.advance(0.01)
    other.advance(0.01)
    assert other.share == gear.share < 1.0
