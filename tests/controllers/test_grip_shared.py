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
from palpate.experiments.grasp.least import least_forces
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
        self.fingers = fingers

    def sensor_poses(self, joint_position):
        poses = []
        for i in range(self.fingers):
            a = 2.0 * math.pi * i / self.fingers
            c, s = math.cos(a), math.sin(a)
            rotation = ((-c, -s, 0.0), (-s, c, 0.0), (0.0, 0.0, -1.0))
            far = RADIUS + 0.008
            poses.append(Pose((far * c, far * s, 0.012), rotation))
        return tuple(poses)


def felt(fingers, load, time=0.0, blind=()):
    """Observation of fingers that hold a load with forces that balance it, well inside their limits."""
    hand, at, frames, observations = Around(fingers), [], [], []
    for pose in hand.sensor_poses(()):
        n, t = -np.array([*pose.position[:2], 0.0]) / (RADIUS + 0.008), np.array([0.0, 0.0, 1.0])
        at.append(-RADIUS * n)
        frames.append(np.column_stack([n, t, np.cross(n, t)]))
    grasp = GraspContacts(at, frames, 0.8, 0.01, force_min=1.0)
    forces = GraspForceOptimizer(grasp).solve(np.array(load)).forces
    for i, pose in enumerate(hand.sensor_poses(())):
        place = ContactPlace(tuple(at[i].tolist()), tuple(tuple(row) for row in frames[i].tolist()))
        wrench = wrench_on_finger(forces[i], place.seen_from(pose.inverse()))
        contact = contact_from_wrench(TIP, np.array(wrench))
        observations.append(FingerObservation(time, wrench, contact, i not in blind))
    return Observation(time, ARM, tuple(observations), HandSample(time, (0.0,) * fingers)), grasp


def loads_of(now):
    return tuple(ContactLoad.of(each.contact) if each.believed else None for each in now.fingers)


def shared(fingers, surface=KNOWN, **more):
    return SharedGrip(fingers, KnownSurface(surface), PERIOD, Around(fingers), **more)


loads = st.tuples(
    st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-6.0, -1.0), *[st.floats(-0.01, 0.01)] * 2, st.just(0.0)
)


def true_grasp(grasp, surface, **more):
    return GraspContacts(grasp.positions, grasp.frames, surface.friction, surface.spin_length, **more)


def load_factor(grasp, surface, forces, load):
    """How many times the load the normal forces hold on a surface."""
    held = true_grasp(grasp, surface, force_min=forces - 1e-6, force_max=forces + 1e-6)
    return GraspForceOptimizer(held, "load_factor").solve(np.array(load)).load_factor


def wanted_forces(plan, now, margin=0.0, periods=1):
    """The plan's normal forces after some periods: cones follow the plan from period to period."""
    for _ in range(periods):
        wanted = plan.wanted(now, loads_of(now), margin)
    return np.array(wanted)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.integers(2, 5), loads, st.floats(0.0, 0.5))
def test_what_is_wanted_holds_all_of_the_load_and_is_the_least(fingers, load, margin):
    """The least of squares is not the least sum, but near it; a margin is one of friction."""
    now, grasp = felt(fingers, load)
    wanted = wanted_forces(shared(fingers), now)
    assert load_factor(grasp, KNOWN, wanted, load) > 1.0 - 1e-5
    points, normals = (list(map(tuple, each.tolist())) for each in (grasp.positions, grasp.frames[:, :, 0]))
    least = least_forces(KNOWN, load, points, normals) if fingers > 2 else wanted
    assert np.mean(least) * (1.0 - 2e-3) <= wanted.mean() <= 1.06 * np.mean(least)
    weaker = LimitSurface(KNOWN.friction / (1.0 + margin), KNOWN.spin_length)
    forces = GraspForceOptimizer(true_grasp(grasp, weaker)).solve(np.array(load)).forces
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
def test_where_limits_are_no_cones_what_is_wanted_lies_within_them_and_comes_near_the_least(gamma, p):
    surface, load = LimitSurface(0.5, 0.003, gamma, p), (0.3, -0.2, -4.0, 0.012, 0.006, 0.0)
    (now, grasp), plan = felt(3, load), shared(3, surface)
    wanted = wanted_forces(plan, now, periods=40)
    limits = GraspContacts(grasp.positions, grasp.frames, 0.5, 0.003, load_exponent=gamma, norm_exponent=p)
    best = GraspForceOptimizer(limits).solve(np.array(load)).forces
    assert limits.margins(plan._planned).min() > -1e-3 * wanted.max()
    assert wanted.mean() == pytest.approx(best[:, 0].mean(), rel=0.02)


@pytest.mark.slow
def test_e_is_not_trusted_beyond_what_it_was_measured_with():
    now, _ = felt(3, (0.0, 0.0, -6.0, 0.02, 0.01, 0.0))
    plans = [
        shared(3, LimitSurface(0.5, 0.003, 1.0 / 3.0), **more) for more in ({"trusted": 0.5}, {"trusted": 2.0}, {})
    ]
    low, high, unbounded = (wanted_forces(plan, now, periods=40).mean() for plan in plans)
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
def test_a_grip_that_falls_a_bit_is_left_and_one_that_falls_far_is_followed():
    played = GripParameters(play=0.2, margin=0.0, reserve=0.0, correction_share=0.0, correction_down=0.0)
    grip = SlipSafeGrip(3, KnownSurface(KNOWN), PERIOD, played, plan=shared(3, parameters=played))
    heavy, _ = felt(3, (0.0, 0.0, -4.0, 0.0, 0.0, 0.0))
    bit_lighter, _ = felt(3, (0.0, 0.0, -3.9, 0.0, 0.0, 0.0))
    light, _ = felt(3, (0.0, 0.0, -2.0, 0.0, 0.0, 0.0))
    for _ in range(1000):
        most = grip.step(heavy)
    for _ in range(2000):
        left = grip.step(bit_lighter)
    assert left == most
    for _ in range(3000):
        followed = grip.step(light)
    assert max(followed) == pytest.approx(2.0 / 1.5 + 0.2, rel=0.02)


def test_a_load_is_followed_without_lag_and_one_odd_sample_is_not():
    ahead, rate = WrenchAhead(0.004, PERIOD), np.array([10.0, 0.0, -5.0, 0.1, 0.0, 0.0])
    for k in range(200):
        ahead.step(rate * k * PERIOD)
    assert ahead.ahead(0.015) == pytest.approx(rate * (199 * PERIOD + 0.015), rel=1e-3)
    ahead.step(rate * 200 * PERIOD + 2.0 * ODD_FORCE)
    assert ahead.ahead(0.0) == pytest.approx(rate * 200 * PERIOD, abs=1e-3)
