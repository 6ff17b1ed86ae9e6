"""One contact or several: calibrated, told apart where that can be, and not told where it cannot."""

import numpy as np
import pytest
from grip.held_pin import PIN, pressed
from scipy.spatial.transform import Rotation

from palpate.estimation import Assumption
from palpate.kinematics.pose import Pose
from palpate.sensing.held import ContactBounds, ContactCount, count_contacts
from palpate.surfaces import Ellipsoid

BOUNDS = ContactBounds(friction=1.0, spin_length=2e-3, separation=0.01)


def counted(seeds, heights, bounds=BOUNDS, **window):
    return [
        count_contacts(PIN, pressed(np.random.default_rng(seed), heights, **window), bounds)
        for seed in range(seeds)
    ]


@pytest.mark.slow
def test_one_place_is_covered_and_its_probability_uniform():
    found = counted(250, (-0.02,), ContactBounds(wander=0.0))
    probability = np.array([each.probability for each in found])
    assert 0.02 < np.mean(probability < 0.05) < 0.1
    assert 0.42 < np.mean(probability < 0.5) < 0.58
    off = np.array([(each.place[2] + 0.02) / np.sqrt(each.covariance[2, 2]) for each in found])
    assert 0.91 < np.mean(np.abs(off) < 1.96) < 0.985


def test_one_and_two_contacts_are_distinguished():
    one, two = counted(50, (-0.02,)), counted(50, (-0.02, -0.01))
    assert np.mean([each.count is ContactCount.ONE for each in one]) >= 0.98
    assert np.mean([each.count is ContactCount.SEVERAL for each in two]) >= 0.98
    assert all(each.verdict.breaks(Assumption.CONSISTENT) for each in two if each.count is ContactCount.SEVERAL)
    along = [abs(each.wanders[2]) / np.linalg.norm(each.wanders) for each in two]
    assert np.median(along) > 0.95  # between the two
    assert np.mean([each.on_line > 1e-3 for each in two]) > 0.95


def test_an_undecided_number_of_contacts_is_reported_with_its_reason():
    still = counted(20, (-0.02, -0.01), angle=0.0, swing=0.0)  # in proportion: one to any sensor
    light = counted(5, (-0.02,), force=0.01)
    assert all(each.count is ContactCount.UNTOLD for each in still + light)
    assert all(each.verdict.breaks(Assumption.UNIQUE) for each in still)
    assert min(each.noticed for each in still) > BOUNDS.separation
    assert "push sideways" in str(still[0].verdict)
    assert all(each.verdict.breaks(Assumption.ENOUGH_DATA) for each in light)


def test_a_load_beyond_one_contact_takes_several():
    """Two that push against each other; friction and spin beyond their bounds."""
    between = counted(10, (-0.02, -0.06), sides=(1.0, -1.0), swing=0.3)
    slippery = counted(10, (-0.02,), ContactBounds(friction=0.05))
    pointed = counted(10, (-0.02,), ContactBounds(spin_length=5e-4), spin=3e-3)
    assert all(each.count is ContactCount.SEVERAL for each in between)
    for found, what in ((slippery, "friction"), (pointed, "spin torque")):
        assert all(each.count is ContactCount.SEVERAL and what in str(each.verdict) for each in found)


def test_the_frame_does_not_matter():
    rng = np.random.default_rng(3)
    egg, window = Ellipsoid((0.02, 0.02, 0.1)), pressed(rng, (-0.02, -0.015), force=3.0)
    turn, shift = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    frame = Pose(tuple(shift.tolist()), tuple(map(tuple, turn.tolist())))
    moved = Ellipsoid((0.02, 0.02, 0.1), center=-turn.T @ shift, rotation=turn.T)
    here, there = count_contacts(egg, window, BOUNDS), count_contacts(moved, window.seen_from(frame), BOUNDS)
    assert here.count is there.count
    np.testing.assert_allclose(here.place, turn @ there.place + shift, atol=1e-9)
    assert here.noticed == pytest.approx(there.noticed, rel=1e-4)
    assert here.probability == pytest.approx(there.probability, rel=1e-3)
