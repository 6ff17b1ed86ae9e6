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
from palpate.errors import InvalidValueError
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
    """What fingers feel that hold a load with forces that balance it, well inside their limits."""
    hand, at, frames = Around(fingers), [], []
    for pose in hand.sensor_poses(()):
        c, s = pose.position[0] / (RADIUS + 0.008), pose.position[1] / (RADIUS + 0.008)
        n = np.array([-c, -s, 0.0])
        t = np.array([0.0, 0.0, 1.0])
        at.append(-RADIUS * n)
        frames.append(np.column_stack([n, t, np.cross(n, t)]))
    grasp = GraspContacts(at, frames, 0.8, 0.01, force_min=1.0)
    forces = GraspForceOptimizer(grasp).solve(np.array(load)).forces
    observations = []
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


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.integers(2, 5), loads)
def test_what_is_wanted_holds_all_of_the_load_and_is_the_least(fingers, load):
    now, grasp = felt(fingers, load)
    plan = shared(fingers)
    wanted = np.array(plan.wanted(now, loads_of(now), 0.0))
    held = true_grasp(grasp, KNOWN, force_min=wanted - 1e-6, force_max=wanted + 1e-6)
    factor = GraspForceOptimizer(held, "load_factor").solve(np.array(load)).load_factor
    assert factor > 1.0 - 1e-5
    points = [tuple(each) for each in grasp.positions.tolist()]
    normals = [tuple(each) for each in grasp.frames[:, :, 0].tolist()]
    least = least_forces(KNOWN, load, points, normals) if fingers > 2 else wanted
    # the least of squares is not the least sum, but near it
    assert np.mean(least) * (1.0 - 2e-3) <= wanted.mean() <= 1.06 * np.mean(least)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(loads, st.floats(0.0, 0.5))
def test_a_margin_is_one_of_friction(load, margin):
    now, grasp = felt(3, load)
    wanted = np.array(shared(3).wanted(now, loads_of(now), margin))
    weaker = LimitSurface(KNOWN.friction / (1.0 + margin), KNOWN.spin_length)
    answer = GraspForceOptimizer(true_grasp(grasp, weaker)).solve(np.array(load))
    assert wanted == pytest.approx(answer.forces[:, 0], rel=1e-4, abs=1e-4)


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(loads, st.tuples(*[st.floats(0.0, 12.0)] * 3))
def test_forces_that_are_more_than_wanted_are_completed_to_such_that_hold(load, raised):
    now, grasp = felt(3, load)
    plan = shared(3)
    wanted = plan.wanted(now, loads_of(now), 0.0)
    least = tuple(max(a, b) for a, b in zip(wanted, raised, strict=True))
    completed = np.array(plan.completed(least))
    assert (completed >= np.array(least) - 1e-9).all()
    held = true_grasp(grasp, KNOWN, force_min=completed - 1e-6, force_max=completed + 1e-6)
    assert GraspForceOptimizer(held, "load_factor").solve(np.array(load)).load_factor > 1.0 - 1e-5


@pytest.mark.slow
@pytest.mark.parametrize(("gamma", "p"), [(1.0 / 3.0, 2.0), (0.0, 1.0), (0.2, 1.4)])
def test_where_limits_are_no_cones_what_is_wanted_lies_within_them_and_comes_near_the_least(gamma, p):
    surface = LimitSurface(0.5, 0.003, gamma, p)
    load = (0.3, -0.2, -4.0, 0.012, 0.006, 0.0)
    now, grasp = felt(3, load)
    plan = shared(3, surface)
    for _ in range(40):  # cones follow the plan from period to period
        wanted = np.array(plan.wanted(now, loads_of(now), 0.0))
    limits = GraspContacts(grasp.positions, grasp.frames, 0.5, 0.003, load_exponent=gamma, norm_exponent=p)
    best = GraspForceOptimizer(limits).solve(np.array(load)).forces
    assert limits.margins(plan._planned).min() > -1e-3 * wanted.max()
    assert wanted.mean() == pytest.approx(best[:, 0].mean(), rel=0.02)


@pytest.mark.slow
def test_e_is_not_trusted_beyond_what_it_was_measured_with():
    surface = LimitSurface(0.5, 0.003, 1.0 / 3.0)
    now, _ = felt(3, (0.0, 0.0, -6.0, 0.02, 0.01, 0.0))

    def settled(**more):
        plan = shared(3, surface, **more)
        for _ in range(40):
            wanted = plan.wanted(now, loads_of(now), 0.0)
        return np.mean(wanted)

    assert settled(trusted=0.5) > settled(trusted=2.0) > settled()


def test_a_finger_that_feels_nothing_leaves_what_was_wanted():
    now, _ = felt(3, (0.0, 0.0, -3.0, 0.0, 0.0, 0.0))
    plan = shared(3)
    wanted = plan.wanted(now, loads_of(now), 0.1)
    blind, _ = felt(3, (0.0, 0.0, -5.0, 0.0, 0.0, 0.0), blind=(1,))
    assert plan.wanted(blind, loads_of(blind), 0.1) == wanted
    assert plan.completed((9.0, 1.0, 1.0)) == (9.0, 1.0, 1.0)


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(loads)
def test_a_likely_grip_holds_with_friction_that_is_worse_in_99_of_100_cases(load):
    now, grasp = felt(3, load)
    likely = shared(3, solver=RobustGrip(3, 0.15, 0.25, 0.99))
    least = np.array(shared(3).wanted(now, loads_of(now), 0.0))
    wanted = np.array(likely.wanted(now, loads_of(now), 0.0))
    assert wanted.sum() > 1.2 * least.sum()
    draw = np.random.default_rng(5)
    failed, cases = 0, 300
    for a, b in draw.standard_normal((cases, 2)):
        true = LimitSurface(max(0.5 * (1.0 + 0.15 * a), 1e-3), max(0.004 * (1.0 + 0.25 * b), 1e-5))
        held = true_grasp(grasp, true, force_min=wanted - 1e-6, force_max=wanted + 1e-6)
        answer = GraspForceOptimizer(held, "load_factor").solve(np.array(load))
        failed += not answer.load_factor >= 1.0 - 1e-6
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
    ahead = WrenchAhead(0.004, PERIOD)
    rate = np.array([10.0, 0.0, -5.0, 0.1, 0.0, 0.0])
    for k in range(200):
        ahead.step(rate * k * PERIOD)
    assert ahead.ahead(0.015) == pytest.approx(rate * (199 * PERIOD + 0.015), rel=1e-3)
    odd = rate * 200 * PERIOD + 2.0 * ODD_FORCE
    ahead.step(odd)
    assert ahead.ahead(0.0) == pytest.approx(rate * 200 * PERIOD, abs=1e-3)


@pytest.mark.parametrize("bad", [-0.1, math.nan])
def test_errors_that_cannot_be_are_refused(bad):
    with pytest.raises(InvalidValueError, match="friction"):
        RobustGrip(3, bad, 0.25)
    with pytest.raises(InvalidValueError, match="trusted"):
        shared(3, trusted=bad)


def test_solvers_have_compiled_before_the_first_period():
    solver = MinimumGrip(3)
    now, grasp = felt(3, (0.0, 0.0, -3.0, 0.0, 0.0, 0.0))
    assert solver.forces(grasp, np.array([0.0, 0.0, -3.0, 0.0, 0.0, 0.0]))[:, 0] == pytest.approx([2.0 / 1.6] * 3)
    assert now.fingers
