"""The fingertip's sensor and the arm's own measurement of the force must agree but for what both may err."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.runtime.supervision.force_comparison import (
    ACCURACY,
    FIRST,
    GAIN_ERROR,
    LARGEST_IMPULSE,
    MEMORY_SIZE,
    force_fault,
    force_finding,
)
from palpate.runtime.supervision.observed_row import row_of
from runtime.puppets import sample, touch

PERIOD, LIMIT = 2e-3, 20.0
SENSE = touch().sense
CALM = round(FIRST / PERIOD) + 1
UPRIGHT = np.eye(3)


class Comparison:
    """Takes observations one by one."""

    def __init__(self):
        self.memory = np.zeros(MEMORY_SIZE)

    def broken(self, now, before):
        row = row_of(now, before)
        fault = force_fault(row.values, before is not None, row.layout.finger(0), LIMIT, self.memory)
        reported = now.arm.tip_force_base is not None
        return force_finding(fault, reported, self.memory, LIMIT) if fault else None


def found(own, felt, rotation=UPRIGHT):
    """Return the first finding over rows of both forces [N], tip frame, and its index; None if there is none."""
    check, before = Comparison(), None
    matrix = tuple(map(tuple, rotation.tolist()))
    for i, (ours, feels) in enumerate(zip(own, felt, strict=True)):
        given_ = sample(i * PERIOD, (*feels, 0.0, 0.0, 0.0), rotation=matrix)
        arm = replace(given_.arm, tip_force_base=tuple((rotation @ ours).tolist()))
        now = SENSE(replace(given_, arm=arm))
        # weight is not the matter here
        finger = replace(now.fingers[0], wrench=(*feels.tolist(), 0.0, 0.0, 0.0))
        now = replace(now, fingers=(finger,))
        finding, before = check.broken(now, before), now
        if finding is not None:
            return i, finding
    return None


def pressed(rate, count=400, offset=(0.0, 0.0, 0.0)):
    """Return the true force that rises with a rate [N/s] after the first calm, and what a shifted arm reports."""
    time = np.maximum(0.0, np.arange(count) - CALM) * PERIOD
    true = np.stack([0.0 * time, 0.0 * time, np.minimum(rate * time, LIMIT)], axis=1)
    return true, true + offset


@given(st.integers(0, 2**32 - 1), st.floats(10.0, 5e3))
@settings(max_examples=20)
def test_honest_sensors_with_noise_and_an_offset_pass_at_any_orientation(seed, rate):
    rng = np.random.default_rng(seed)
    true, own = pressed(rate, offset=rng.uniform(-5.0, 5.0, 3))
    rotation = Rotation.random(random_state=rng).as_matrix()
    noise = rng.normal(0.0, 1.0, own.shape)
    assert found(own + noise, true * rng.uniform(1.0 - GAIN_ERROR / 2, 1.0), rotation) is None


@pytest.mark.parametrize("gain", [0.0, 0.1, 0.5])
@pytest.mark.parametrize("rate", [20.0, 100.0, 500.0])
def test_a_dead_or_weak_sensor_is_found_within_the_stated_impulse(gain, rate):
    true, own = pressed(rate)
    noticed = found(own, gain * true)
    assert noticed is not None
    at, finding = noticed
    excess = np.maximum(0.0, (1.0 - gain - GAIN_ERROR) * true[:, 2] - ACCURACY)
    assert at <= np.flatnonzero(np.cumsum(excess) * PERIOD > LARGEST_IMPULSE)[0] + 1
    assert "arm itself measures" in finding.measure


def test_the_arm_alone_is_enough_for_the_limit():
    """A blow that nobody else feels, too short for the comparison."""
    true, own = pressed(0.0)
    own[CALM + 50] = (0.0, 0.0, LIMIT + ACCURACY + 1.0)
    assert found(own, true)[0] == CALM + 50


def test_what_the_arm_reports_may_not_come_or_go():
    check, now = Comparison(), SENSE(sample())
    feeling = replace(now, arm=replace(now.arm, tip_force_base=(0.0, 0.0, 0.0)))
    assert check.broken(now, now) is None
    assert check.broken(feeling, now).value == "new"
    assert check.broken(now, feeling).value == "missing"
