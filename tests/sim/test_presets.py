"""What the presets are for: friction on its limit surface, no creep, no lift-off, no error without need."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))

from simulation.choices import ARM_BASE, GRASP_BASE, STAGE_BASE, reaches
from simulation.exploring import ELLIPSOID, SPHERE, explore
from simulation.grasping import Hold, has_room, hold
from simulation.turntable import (
    FRICTION,
    LAW,
    OWN_FINDER,
    SOFT,
    accuracy,
    limit_surface,
    ride,
)

from palpate.sim import Cone, Fidelity, Integrator
from palpate.sim.presets import ARM, EXPLORE, GRASP


def test_presets_touch_and_grasp_on_the_limit_surface_at_all_angles():
    found, held = limit_surface(), hold(GRASP_BASE)
    for each, error in ((found, found.error), (held, held.limit)):
        assert error < 5e-3
        assert each.turned < 1.0  # slip is normal to it
    assert found.touching == 1.0


@settings(max_examples=6)
@given(angle=st.floats(0.0, 90.0), friction=st.floats(0.05, 1.0), spin_length=st.floats(0.002, 0.01))
def test_full_slip_lies_on_the_limit_surface_whatever_the_friction(angle, friction, spin_length):
    law = replace(LAW, friction=friction, spin_length=spin_length)
    assert limit_surface(law=law, angles=(angle,)).error < 5e-3


def test_a_pyramid_has_no_such_limit_surface():
    assert limit_surface(replace(EXPLORE.fidelity, cone=Cone.PYRAMIDAL)).error > 0.1


def test_a_held_object_creeps_less_than_a_micrometre_a_second():
    held = Hold(GRASP_BASE)
    assert 0.0 < held.creep() < 1e-6
    weak = Hold(replace(GRASP_BASE, impratio=GRASP_BASE.impratio / 1e3))
    assert weak.creep() / held.creep() == pytest.approx(1e3, rel=0.05)  # it is what impratio leaves


def test_a_light_stiff_object_stands_still_under_the_preset_and_jumps_with_the_impedance_of_a_scan():
    assert has_room(GRASP_BASE)
    assert not has_room(replace(GRASP_BASE, impedance=EXPLORE.law.impedance))


CORNERS = [
    *(
        (target, friction, force, 0.1)
        for target in (SPHERE, ELLIPSOID)
        for friction in (0.05, 1.0)
        for force in (0.5, 5.0)
    ),
    *((target, friction, 5.0, 0.02) for target in (SPHERE, ELLIPSOID) for friction in (0.05, 1.0)),
]
DRAWN = [
    (ELLIPSOID, 0.2, 1.0, 0.05),
    (SPHERE, 0.7, 2.0, 0.1),
    (ELLIPSOID, 0.3, 5.0, 0.05),
    (SPHERE, 0.1, 0.5, 0.05),
]


@pytest.mark.slow
@pytest.mark.parametrize(("target", "friction", "force", "speed"), [*CORNERS, *DRAWN])
def test_the_tip_never_lifts_off_anywhere_in_the_range(target, friction, force, speed):
    """At the corners of the range of friction, force [N] and speed [m/s], and at some drawn points."""
    choice = replace(STAGE_BASE, law=replace(EXPLORE.law, friction=friction))
    found = explore(choice, target, force, speed)
    assert (found.done, found.touching) == (True, 1.0)


def test_the_contact_is_sensed_where_it_is():
    """Within a tenth of what the first measurements were off by, once MuJoCo's contact finder is out of it."""
    ridden = ride()
    found = accuracy(ridden, SOFT)
    assert found.to_contact[1] < 0.1 * 0.115e-3
    assert found.on_surface[1] < 0.1 * 0.050e-3
    assert found.spin_torque[1] < 0.1 * 0.014e-3
    assert found.of_torque > 4e-3  # there is something to measure
    # half a penetration, tilted by friction: what a tip that is not shrunk is off by
    depth = 5.3 / SOFT
    unshrunk = accuracy(ridden, SOFT, shrunk=False)
    assert unshrunk.to_contact[0] == pytest.approx(0.5 * depth * math.hypot(1.0, FRICTION), rel=0.03)
    # and with the wrench axis through it all the spin torque is lost to its position
    assert accuracy(ridden, SOFT, hard=True).to_contact[0] > 20.0 * found.to_contact[0]


def test_mujocos_own_tolerance_of_the_contact_finder_is_what_is_seen_of_an_ellipsoid():
    fine, coarse = (accuracy(ride(finder=finder), SOFT) for finder in (None, OWN_FINDER))
    assert coarse.on_surface[1] > 4.0 * fine.on_surface[1]


@pytest.mark.slow
@pytest.mark.parametrize("base", [STAGE_BASE, ARM_BASE], ids=["stage", "arm"])
@pytest.mark.parametrize("speed", [0.02, 0.1])
def test_the_step_and_the_integrator_hold_the_force_as_well_as_any(base, speed):
    """Neither a fifth of the step, nor what MuJoCo offers besides, is better by a twentieth."""
    preset = explore(base, SPHERE, 2.0, speed)
    for fidelity in (Fidelity(0.1e-3, Integrator.EULER), Fidelity(0.5e-3, Integrator.IMPLICITFAST)):
        other = explore(replace(base, fidelity=fidelity), SPHERE, 2.0, speed)
        assert preset.force_rms < 1.05 * other.force_rms
        assert preset.point_rms < 1.05 * other.point_rms


def test_a_higher_impedance_spoils_the_points():
    preset = explore(STAGE_BASE, SPHERE, 2.0, 0.05)
    stiff = explore(replace(STAGE_BASE, law=replace(EXPLORE.law, impedance=0.2)), SPHERE, 2.0, 0.05)
    assert stiff.point_rms > 3.0 * preset.point_rms


def test_presets_reach_stiff_contacts_slippery_objects_and_light_stages():
    assert not reaches(STAGE_BASE)
    assert not reaches(ARM_BASE)
    assert reaches(replace(STAGE_BASE, fidelity=replace(EXPLORE.fidelity, time_step=1e-3)))
    assert reaches(replace(STAGE_BASE, law=replace(EXPLORE.law, impedance=0.01)))


def test_the_kinds_differ_in_what_they_must():
    assert ARM.fidelity == EXPLORE.fidelity
    assert ARM.law == EXPLORE.law
    assert type(ARM.carrier) is not type(EXPLORE.carrier)
    assert GRASP.fidelity.time_step == 2.0 * EXPLORE.fidelity.time_step
