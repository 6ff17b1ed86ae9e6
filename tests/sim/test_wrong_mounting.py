"""A sensor that is mounted the wrong way round is found at the first touch, and no retreat presses harder."""

import numpy as np
import pytest

from faults.mountings import LIMIT, ROTATIONS, Slide, moved, plunged
from palpate.runtime.data import Phase
from palpate.runtime.result import Ending

FOUND = [matrix for matrix in ROTATIONS if matrix[2, 2] < 0.5]
"""Those that turn the axis of touch: about that axis itself a straight push shows nothing."""

ABOUT_TOUCH = [matrix for matrix in ROTATIONS if matrix[2, 2] > 0.5]
"""The others, the right one among them: friction shows them."""


@pytest.mark.slow
@pytest.mark.parametrize("arm", [False, True], ids=["stage", "ur5e"])
def test_a_wrong_mounting_is_named_at_the_first_touch(arm):
    _, touch = plunged(np.eye(3), Phase.APPROACH, arm, stops=True)
    for rotation in FOUND:
        result, force = plunged(rotation, Phase.APPROACH, arm)
        assert result.ending is Ending.TRIPPED
        assert result.at_rest
        assert "angle between approach and first contact force of finger 1 was" in result.why
        assert force < 1.2 * touch


@pytest.mark.slow
@pytest.mark.parametrize("arm", [False, True], ids=["stage", "ur5e"])
def test_no_retreat_presses_harder_whatever_the_mounting(arm):
    """Without an approach that could have shown it. Before, the tip was driven in with 249 N."""
    for rotation in ROTATIONS:
        result, force = plunged(rotation, Phase.SCAN, arm)
        assert result.ending is Ending.TRIPPED
        assert result.at_rest
        assert force < 1.5 * LIMIT


@pytest.mark.slow
@pytest.mark.parametrize("arm", [False, True], ids=["stage", "ur5e"])
def test_a_turn_about_the_axis_of_touch_is_named_within_the_first_millimetres_of_sliding(arm):
    right, force = moved(Slide(), np.eye(3), arm)
    assert right.ending is Ending.DONE
    for rotation in ABOUT_TOUCH:
        if rotation.trace() < 2.9:
            result, wrong = moved(Slide(), rotation, arm)
            assert "angle between sliding and friction was" in result.why
            assert wrong < 1.2 * force
