"""mu, e and exponents from a finger that really rubs, in MuJoCo; many more of these in benchmarks/friction.py."""

import math

import pytest

from palpate.friction.rubbing.sliding import FrictionBound, FrictionMeasured, measure_friction
from palpate.friction.rubbing.twisting import SpinMeasured, measure_spin
from palpate.sim.friction.law import FrictionLaw
from support.rubbing_runs import Motion, Place, Rubber


def test_tilted_by_2_degrees_with_an_origin_half_a_millimetre_off_mu_and_e_are_found():
    tilt = math.radians(2.0)
    finger = Rubber(Place(0.6, 0.0025, 2.0, (0.6 * tilt, -0.8 * tilt), (3e-4, -4e-4, 0.0), seed=4242))
    found = measure_friction([finger.two_way(Motion(speed=0.02))])
    assert isinstance(found, FrictionMeasured)
    assert found.friction.value == pytest.approx(0.6, rel=0.01)
    # the true normal, not the one that the finger was told: they are 35 mrad apart
    assert found.normal[2] == pytest.approx(-1.0, abs=3e-5)
    turned = measure_spin([finger.two_way(Motion(spin=2.0))], found)
    assert isinstance(turned, SpinMeasured)
    assert turned.slide > 0.05  # it did slide as it turned, and that was made up for
    assert turned.spin_length.value == pytest.approx(0.0025, rel=0.02)
    low, high = turned.spin_length.interval()
    assert low <= 0.0025 <= high


def test_a_skin_that_only_yields_is_a_bound():
    law = FrictionLaw(0.8, 0.8, stiffness=50.0)  # 1.6 N after 32 mm
    finger = Rubber(Place(0.8, 0.004, 2.0, seed=7, law=law))
    found = measure_friction([finger.two_way(Motion(speed=0.02))])
    assert isinstance(found, FrictionBound)
    assert 0.02 < found.least_friction < 0.3


def test_stick_slip_on_the_plant_is_flagged_between_its_two_coefficients():
    """Stribeck friction on a slow finger with a soft skin: mu_s 0.6, mu_k 0.4."""
    law = FrictionLaw(0.6, 0.4, stribeck_speed=0.02, stiffness=1500.0, damping_ratio=0.05)
    finger = Rubber(Place(0.6, 0.004, 2.0, seed=8, law=law))
    found = measure_friction([finger.two_way(Motion(speed=0.005, duration=1.0))])
    assert isinstance(found, FrictionMeasured)
    assert found.stick_slip
    assert 0.4 < found.friction.value < 0.6
    assert found.static_friction == pytest.approx(0.6, rel=0.15)
