"""A tool that slips in the hand is told, and one that is held is not."""

import numpy as np
import pytest

from palpate.runtime.data import ArmSample, FingerObservation, Observation
from palpate.runtime.supervision.finding import Cause
from palpate.runtime.supervision.tool_slip import ToolGrip, ToolHeld
from palpate.sensing.solver import contact_from_wrench
from palpate.spatial import IDENTITY
from palpate.surfaces import Plane, Sphere

PERIOD = 1e-3
GRIP = ToolGrip(0.8, 0.6, 7.0, 0.25, 1e-4, ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
TOOL, PAD = Sphere(0.003), Plane(0.004)


def observed(i, force=(0.0, 0.0, 1.0), squeeze=7.0, velocity=(0.0, 0.0, 0.0)):
    """Two fingers squeeze along x, what they hold presses on something below it."""
    fingers = [(TOOL, (*force, 0.0, 0.0, 0.0))] + [(PAD, (0.0, 0.0, -squeeze, 0.0, 0.0, 0.0))] * 2
    felt = [
        FingerObservation(i * PERIOD, wrench, contact_from_wrench(surface, np.array(wrench)), True)
        for surface, wrench in fingers
    ]
    return Observation(i * PERIOD, ArmSample(i * PERIOD, (0.0, 0.0, 0.0), IDENTITY, velocity), tuple(felt))


def told(*observations):
    """What is told of some periods, one after the other, and when."""
    held = ToolHeld(GRIP, PERIOD)
    for i, now in enumerate(observations):
        finding = held.broken(now, None)
        assert held.broken(now, None) == finding  # asked again, it says the same
        if finding is not None:
            return i, finding
    return None, None


@pytest.mark.slow
def test_a_tool_that_is_held_slides_and_swings_and_nothing_is_told():
    rng = np.random.default_rng(0)
    loads = 1.0 + 0.3 * np.sin(0.05 * np.arange(2000)) + 0.005 * rng.standard_normal(2000)
    speeds = np.gradient(loads * 1e-4, PERIOD)  # into the surface, as it yields
    path = [
        observed(i, (0.1, 0.0, load), velocity=(0.02, 0.0, -v))
        for i, (load, v) in enumerate(zip(loads.tolist(), speeds.tolist(), strict=True))
    ]
    assert told(*path) == (None, None)


@pytest.mark.parametrize("speed", [0.005, 0.02, 0.2])
def test_a_surface_that_seems_to_give_way_by_a_millimetre_is_told_within_a_fifth_of_a_second(speed):
    still = [observed(i) for i in range(300)]
    slips = [
        observed(300 + i, velocity=(0.0, 0.0, -speed if i * PERIOD * speed < 1e-3 else 0.0)) for i in range(400)
    ]
    when, finding = told(*still, *slips)
    assert when is not None
    assert finding is not None
    assert finding.cause is Cause.GRIP
    assert finding.measure == "slip of the tool in the hand"
    assert 300 <= when < 300 + 200 + 1e-3 / speed / PERIOD


def test_a_load_that_friction_may_not_hold_is_told_at_once():
    when, finding = told(observed(0), observed(1, (0.0, 6.0, 4.0)))
    assert finding is not None
    assert (when, finding.measure) == (1, "load across the grip of the tool")
    assert "60 % of what a squeeze of 14 N holds" in finding.limit


def test_a_load_along_the_squeeze_is_borne_without_friction():
    assert told(observed(0), observed(1, (9.0, 0.0, 1.0))) == (None, None)


def test_a_squeeze_that_has_faded_is_told():
    _, finding = told(observed(0), observed(1, squeeze=3.0))
    assert finding is not None
    assert finding.measure == "squeeze of the tool, all fingers together"
