"""Largest disturbances of limits that are no cones, and of actuators: what a pair holds is known by hand."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.grasp.certificates.disturbance import largest_disturbance, worst_disturbance
from palpate.grasp.certificates.sensitivity import grip_sensitivity
from palpate.grasp.robust.least_effort import RobustLeastEffort
from palpate.grasp.robust.uncertainty import GraspUncertainty
from support.grasp_families import check_forces, opposite

MU, E, MOST = 0.6, 0.004, 8.0
SPIN = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
DOWN = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])


def pair(**more):
    return opposite(MU, E, **{"force_max": MOST, **more})


def test_spin_grows_with_the_force_as_e_does():
    """2 mu c F^(1 + gamma), and no cones around hold more."""
    found = largest_disturbance(pair(load_exponent=1 / 3), SPIN)
    assert found.factor == pytest.approx(2 * MU * E * MOST ** (4 / 3), rel=2e-4)
    assert found.factor <= found.bound <= found.factor * (1.0 + 1e-3)


@pytest.mark.parametrize("p", [1.0, 1.4, 1.8])
def test_force_and_torque_share_as_the_p_norm_says(p):
    """Weight w takes its share of each limit: (w / 2 mu F)^p + (tau / 2 mu e F)^p = 1."""
    weight = 5.0
    found = largest_disturbance(pair(norm_exponent=p), SPIN, weight * DOWN)
    share = (1.0 - (weight / (2 * MU * MOST)) ** p) ** (1.0 / p)
    assert found.factor == pytest.approx(2 * MU * E * MOST * share, rel=1e-3)
    assert found.factor <= found.bound * (1.0 + 1e-9)


def test_what_is_found_is_held_within_the_true_limits():
    grasp = pair(load_exponent=0.2, norm_exponent=1.5)
    load, direction = np.array([0.5, 0.2, -1.0, 0.001, 0.0, 0.002]), np.array([0.2, 1.0, 0.3, 0.01, 0.0, 0.0])
    found = largest_disturbance(grasp, direction, load)
    assert found.factor > 0.0
    check_forces(grasp, load + found.factor * direction, found.forces, 1e-6)
    assert found.forces[:, 0].max() <= MOST * (1.0 + 1e-9)


@pytest.mark.slow
def test_actuators_end_it_before_the_largest_force_does():
    """Each finger's motor bears 5 N of normal force."""
    maps = np.zeros((2, 1, 4))
    maps[:, 0, 0] = 1.0
    found = largest_disturbance(pair(actuator_map=maps, actuator_limit=np.full((2, 1), 5.0)), DOWN)
    assert found.factor == pytest.approx(2 * MU * 5.0, rel=2e-4)
    assert found.bound == pytest.approx(2 * MU * MOST, rel=1e-6)


def test_a_load_that_is_not_held_leaves_nothing():
    found = largest_disturbance(pair(load_exponent=0.3), SPIN, 100.0 * DOWN)
    assert found.factor == 0.0


def test_without_a_largest_force_nothing_is_proven_and_anything_is_held():
    found = largest_disturbance(pair(load_exponent=0.3, force_max=np.inf), DOWN)
    assert found.factor == np.inf
    assert found.bound == np.inf
    with pytest.raises(InvalidValueError, match="direction is zero"):
        largest_disturbance(pair(load_exponent=0.3), np.zeros(6))


def test_what_is_known_for_cones_alone_refuses_the_rest_by_name():
    sure, maps = GraspUncertainty([0.05, 0.05], [0.0, 0.0]), np.zeros((2, 1, 4))
    grown, mixed = pair(load_exponent=0.3), pair(norm_exponent=1.5)
    driven = pair(actuator_map=maps, actuator_limit=np.ones((2, 1)))
    for grasp, named in ((grown, "load_exponent"), (mixed, "norm_exponent"), (driven, "actuator_map")):
        for asked in (
            lambda grasp=grasp: worst_disturbance(grasp, 0.03),
            lambda grasp=grasp: grip_sensitivity(grasp, DOWN),
            lambda grasp=grasp: RobustLeastEffort(grasp, sure),
        ):
            with pytest.raises(InvalidValueError, match=f"{named}.*known for cones alone"):
                asked()


def test_the_remedy_that_is_named_keeps_the_true_limit():
    """For p below 2 a friction smaller by 2^(1/2 - 1/p), with p = 2: the p-norm is at most so much larger."""
    rng = np.random.default_rng(0)
    for p in (1.0, 1.3, 1.7):
        true = pair(norm_exponent=p)
        less = replace(pair(), friction=2.0 ** (0.5 - 1.0 / p) * true.friction)
        u = rng.standard_normal((200, 2, 3))
        u *= (less.friction / np.linalg.norm(u, axis=2))[..., None]
        for each in u:
            forces = np.column_stack([np.ones(2), each * [1.0, 1.0, E]])
            assert (true.margins(forces) >= -1e-12).all()
