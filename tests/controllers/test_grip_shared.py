"""A shared grip: forces that together hold the whole load, least in sum, whichever way the hand or frame lies."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate import contact_from_wrench
from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.grasp_solver import MinimumGrip, RobustGrip
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.shared_grip import SHARED, SharedGrip
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.wrench_ahead import ODD_FORCE, WrenchAhead
from palpate.experiments.grasp.minimum_grip import least_forces
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.grasp import GraspContacts, GraspForceOptimizer
from palpate.grasp.problem.from_touch import ContactPlace, wrench_on_finger
from palpate.kinematics.pose import Pose
from palpate.runtime.data import ArmSample, FingerObservation, HandSample, Observation
from palpate.spatial import IDENTITY, ZERO
from palpate.surfaces import Sphere

PERIOD = 1e-3

KNOWN = LimitSurface(0.5, 0.004)

ARM = ArmSample(0.0, ZERO, IDENTITY, ZERO)

TIP = Sphere(0.008, center=np.array([0.0, 0.0, 0.012]))

RADIUS = 0.03


class Around:
    """Fingers evenly around the hand's z axis, each with its sensor's x towards it: `HandKinematics`."""

    def __init__(self, fingers):
        self.poses, far = [], RADIUS + 0.008
        for i in range(fingers):
            c, s = math.cos(2.0 * math.pi * i / fingers), math.sin(2.0 * math.pi * i / fingers)
            self.poses.append(Pose((far * c, far * s, 0.012), ((-c, -s, 0.0), (-s, c, 0.0), (0.0, 0.0, -1.0))))

    def sensor_poses(self, joint_position):
        return tuple(self.poses)


def felt(fingers, load, blind=()):
    """Observation of fingers that hold a load with forces that balance it, well inside their limits; the grasp."""
    poses, observations = Around(fingers).poses, []
    up, normals = np.array([0.0, 0.0, 1.0]), [np.array(pose.rotation)[:, 0] for pose in poses]
    frames = [np.column_stack([n, up, np.cross(n, up)]) for n in normals]
    grasp = GraspContacts([-RADIUS * n for n in normals], frames, 0.8, 0.01, force_min=1.0)
    forces = GraspForceOptimizer(grasp).solve(np.array(load)).forces
    for i, pose in enumerate(poses):
        place = ContactPlace(tuple((-RADIUS * normals[i]).tolist()), tuple(map(tuple, frames[i].tolist())))
        wrench = wrench_on_finger(forces[i], place.seen_from(pose.inverse()))
        contact = contact_from_wrench(TIP, np.array(wrench))
        observations.append(FingerObservation(0.0, wrench, contact, i not in blind))
    return Observation(0.0, ARM, tuple(observations), HandSample(0.0, (0.0,) * fingers)), grasp


def loads_of(now):
    return tuple(ContactLoad.of(each.contact) if each.believed else None for each in now.fingers)


def shared(fingers, surface=KNOWN, **more):
    return SharedGrip(fingers, KnownSurface(surface), PERIOD, Around(fingers), **more)


def wanted_forces(plan, now, margin=0.0, periods=1):
    """The plan's normal forces after some periods: cones follow the plan from period to period."""
    for _ in range(periods):
        wanted = plan.wanted(now, loads_of(now), margin)
    return np.array(wanted)


def limited(grasp, surface, **more):
    """The grasp with the limits of a surface."""
    exponents = {"load_exponent": surface.load_exponent, "norm_exponent": surface.norm_exponent}
    options = exponents | more
    return GraspContacts(grasp.positions, grasp.frames, surface.friction, surface.spin_length, **options)


def load_factor(grasp, surface, forces, load):
    """How many times the load the normal forces hold on a surface."""
    held = limited(grasp, surface, force_min=forces - 1e-6, force_max=forces + 1e-6)
    return GraspForceOptimizer(held, "load_factor").solve(np.array(load)).load_factor


loads = st.tuples(
    st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-6.0, -1.0), *[st.floats(-0.01, 0.01)] * 2, st.just(0.0)
)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.integers(2, 5), loads, st.floats(0.0, 0.5))
def test_the_wanted_forces_hold_all_of_the_load_and_are_the_least(fingers, load, margin):
    """The least of squares is not the least sum, but near it; a margin is one of friction."""
    now, grasp = felt(fingers, load)
    wanted = wanted_forces(shared(fingers), now)
    assert load_factor(grasp, KNOWN, wanted, load) > 1.0 - 1e-5
    points, normals = (list(map(tuple, each.tolist())) for each in (grasp.positions, grasp.frames[:, :, 0]))
    least = least_forces(KNOWN, load, points, normals) if fingers > 2 else wanted
    assert np.mean(least) * (1.0 - 2e-3) <= wanted.mean() <= 1.06 * np.mean(least)
    weaker = LimitSurface(KNOWN.friction / (1.0 + margin), KNOWN.spin_length)
    forces = GraspForceOptimizer(limited(grasp, weaker)).solve(np.array(load)).forces
    assert wanted_forces(shared(fingers), now, margin) == pytest.approx(forces[:, 0], rel=1e-4, abs=1e-4)


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(loads, st.tuples(*[st.floats(0.0, 12.0)] * 3))
def test_forces_that_are_more_than_wanted_are_completed_to_such_that_hold(load, raised):
    (now, grasp), plan = felt(3, load), shared(3)
    least = np.maximum(wanted_forces(plan, now), raised)
    completed = np.array(plan.completed(tuple(least.tolist())))
    assert (completed >= least - 1e-9).all()
    assert load_factor(grasp, KNOWN, completed, load) > 1.0 - 1e-5


@pytest.mark.slow
@pytest.mark.parametrize(("gamma", "p"), [(1.0 / 3.0, 2.0), (0.0, 1.0), (0.2, 1.4)])
def test_within_limits_that_are_no_cones_the_wanted_forces_come_near_the_least(gamma, p):
    surface, load = LimitSurface(0.5, 0.003, gamma, p), (0.3, -0.2, -4.0, 0.012, 0.006, 0.0)
    (now, grasp), plan = felt(3, load), shared(3, surface)
    wanted, limits = wanted_forces(plan, now, periods=40), limited(grasp, surface)
    best = GraspForceOptimizer(limits).solve(np.array(load)).forces
    assert limits.margins(plan._planned).min() > -1e-3 * wanted.max()
    assert wanted.mean() == pytest.approx(best[:, 0].mean(), rel=0.02)


@pytest.mark.slow
def test_e_is_not_trusted_beyond_the_measured_forces():
    now, _ = felt(3, (0.0, 0.0, -6.0, 0.02, 0.01, 0.0))
    low, high, unbounded = (
        wanted_forces(shared(3, LimitSurface(0.5, 0.003, 1.0 / 3.0), **more), now, periods=40).mean()
        for more in ({"trusted": 0.5}, {"trusted": 2.0}, {})
    )
    assert low > high > unbounded


def test_a_finger_that_feels_nothing_leaves_what_was_wanted():
    """The solver answers with the least: 3 N among three fingers, with mu = 0.5."""
    load, plan = (0.0, 0.0, -3.0, 0.0, 0.0, 0.0), shared(3)
    now, grasp = felt(3, load)
    wanted = plan.wanted(now, loads_of(now), 0.1)
    blind, _ = felt(3, (0.0, 0.0, -5.0, 0.0, 0.0, 0.0), blind=(1,))
    assert plan.wanted(blind, loads_of(blind), 0.1) == wanted
    assert plan.completed((9.0, 1.0, 1.0)) == (9.0, 1.0, 1.0)
    assert MinimumGrip(3).forces(grasp, np.array(load))[:, 0] == pytest.approx([2.0 / 1.6] * 3)


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(loads)
def test_a_likely_grip_holds_with_friction_that_is_worse_in_99_of_100_cases(load):
    now, grasp = felt(3, load)
    wanted = wanted_forces(shared(3, solver=RobustGrip(3, 0.15, 0.25, 0.99)), now)
    assert wanted.sum() > 1.2 * wanted_forces(shared(3), now).sum()
    failed, cases = 0, 300
    for a, b in np.random.default_rng(5).standard_normal((cases, 2)):
        true = LimitSurface(max(0.5 * (1.0 + 0.15 * a), 1e-3), max(0.004 * (1.0 + 0.25 * b), 1e-5))
        failed += not load_factor(grasp, true, wanted, load) >= 1.0 - 1e-6
    assert failed <= 0.01 * cases + 3.0 * math.sqrt(0.01 * cases)


@pytest.mark.slow
def test_a_grip_that_shares_presses_each_finger_with_its_part():
    load = (0.0, 0.0, -4.0, 0.0, 0.02, 0.0)
    plan = shared(3, parameters=SHARED)
    grip = SlipSafeGrip(3, KnownSurface(KNOWN), PERIOD, SHARED, plan=plan)
    now, _ = felt(3, load)
    for _ in range(2000):
        commands = grip.step(now)
    assert max(commands) > 1.1 * min(commands)
    parts = [(1.0 + SHARED.margin) * each + SHARED.reserve for each in plan.needed]
    assert grip.targets == pytest.approx(parts, rel=0.02)
    assert grip.needed == pytest.approx(np.mean(plan.needed))
    lacking = min(each.contact.normal_force / need for each, need in zip(now.fingers, plan.needed, strict=True))
    assert grip.pressed(now) == pytest.approx(lacking * grip.needed)


@pytest.mark.slow
def test_a_need_that_falls_a_bit_leaves_the_grip_and_one_that_falls_far_lowers_it():
    played = GripParameters(play=0.2, margin=0.0, reserve=0.0, correction_share=0.0, correction_down=0.0)
    grip = SlipSafeGrip(3, KnownSurface(KNOWN), PERIOD, played, plan=shared(3, parameters=played))

    def held(load, periods):
        now, _ = felt(3, (0.0, 0.0, load, 0.0, 0.0, 0.0))
        return [grip.step(now) for _ in range(periods)][-1]

    most = held(-4.0, 1000)
    assert held(-3.9, 2000) == most
    assert max(held(-2.0, 3000)) == pytest.approx(2.0 / 1.5 + 0.2, rel=0.02)


def test_a_load_is_followed_without_lag_and_one_odd_sample_is_not():
    ahead, rate = WrenchAhead(0.004, PERIOD), np.array([10.0, 0.0, -5.0, 0.1, 0.0, 0.0])
    for k in range(200):
        ahead.step(rate * k * PERIOD)
    assert ahead.ahead(0.015) == pytest.approx(rate * (199 * PERIOD + 0.015), rel=1e-3)
    ahead.step(rate * 200 * PERIOD + 2.0 * ODD_FORCE)
    assert ahead.ahead(0.0) == pytest.approx(rate * 200 * PERIOD, abs=1e-3)
