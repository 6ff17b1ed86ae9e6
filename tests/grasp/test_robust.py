"""A robust grip holds as often as it promises, and presses little harder than it must.

Whether a grip holds is decided by static friction: normal forces are as commanded, everything else is drawn, and
some friction within the true limits has to balance the true load.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import beta as beta_distribution
from scipy.stats import multivariate_normal

from palpate.errors import InvalidValueError
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.robust.fixed_forces import probability_within_limits
from palpate.grasp.robust.joint_probability import failing, joint_deviations, owen
from palpate.grasp.robust.least_effort import RobustLeastEffort
from palpate.grasp.robust.sampled_holding import SampledHolding, sample_holding
from palpate.grasp.robust.uncertainty import GraspUncertainty
from palpate.grasp.solvers.least_effort import Outcome
from support.drawn_grasps import Draws
from support.grasp_families import opposite, solved
from support.refusals import check_refusals

SURE = 0.999
"""Of the intervals of Clopper and Pearson."""


def random_grasp(rng, n, radius=0.03):
    """n contacts on a sphere, on all sides of it."""
    if n == 3:
        turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        out = np.array([[np.cos(a), np.sin(a), 0.0] for a in 2.0 * np.pi / 3.0 * np.arange(3)]) @ turn
    else:
        out = rng.standard_normal((n, 3))
        out = (out - out.mean(axis=0)) / np.linalg.norm(out - out.mean(axis=0), axis=1)[:, None]
    t1 = np.cross(-out, rng.standard_normal((n, 3)))
    t1 /= np.linalg.norm(t1, axis=1)[:, None]
    frames = np.stack([-out, t1, np.cross(-out, t1)], axis=2)
    return GraspContacts(radius * out, frames, rng.uniform(0.4, 1.0, n), rng.uniform(0.003, 0.008, n))


def random_load(rng):
    return np.concatenate([2.0 * rng.standard_normal(3), 0.01 * rng.standard_normal(3)])


def uncertainty_of(kind, grasp):
    """mu 15 %, e 25 %, load 0.2 N and 1 mN m, places 1 mm, normals 0.03 rad; one at a time or all."""
    n = len(grasp)
    mu, e = 0.15 * grasp.friction, 0.25 * grasp.spin_length
    if kind in ("common", "all common"):  # all contacts err alike: the same object, the same rubber
        mu, e = np.outer(mu, mu), np.outer(e, e)
    share = 0.25 if kind.startswith("all") else 1.0  # of the variance
    return GraspUncertainty(
        mu if kind in ("mu", "mu and e", "common") or kind.startswith("all") else np.zeros(n),
        e if kind in ("mu and e", "common") or kind.startswith("all") else np.zeros(n),
        np.tile(share * 1e-6 * np.eye(3), (n, 1, 1)) if kind == "places" or kind.startswith("all") else None,
        np.tile(share * 9e-4 * np.eye(2), (n, 1, 1)) if kind == "normals" or kind.startswith("all") else None,
        share * np.diag([0.04] * 3 + [1e-6] * 3) if kind == "load" or kind.startswith("all") else None,
    )


def surely_more(failed, count):
    """The lower end of Clopper and Pearson's interval of a share."""
    return beta_distribution.ppf(1.0 - SURE, failed, count - failed + 1) if failed else 0.0


KINDS = ("mu", "mu and e", "common", "load", "places", "normals", "all", "all common")


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("grasps", "draws"), [(3, 800), (24, 2000)])
def test_holds_as_often_as_promised(kind, grasps, draws):
    """Together, and each; nearly nine in ten grasps of each kind have an answer."""
    rng = np.random.default_rng(100 + KINDS.index(kind))
    failed, answered = 0, 0
    for _ in range(grasps):
        grasp, wrench = random_grasp(rng, int(rng.integers(3, 7))), random_load(rng)
        uncertainty = uncertainty_of(kind, grasp)
        found = RobustLeastEffort(grasp, uncertainty, 0.99).solve(wrench)
        if found.outcome != Outcome.SOLVED:
            continue
        answered += 1
        assert np.abs(grasp.grasp_map @ found.forces.ravel() + wrench).max() < 1e-8
        here = Draws(grasp, uncertainty, wrench, rng, draws).failures(found.forces[:, 0])
        assert surely_more(here, draws) <= 0.01
        failed += here
    assert answered >= max(1, 7 * (grasps // 8))
    assert surely_more(failed, answered * draws) <= 0.01


def test_two_fingers_hold_as_often_as_promised():
    """Opposite fingers, a weight across: friction of each must bear its half, so that either can fail.

    Without torque what holds is known: both mu f above half the weight, jointly 99 %: mu (1 - 2.57 x 0.15) f = W /
    2.
    """
    grasp = opposite(0.6, 0.005)
    uncertainty = GraspUncertainty(0.15 * grasp.friction, 0.25 * grasp.spin_length)
    found = RobustLeastEffort(grasp, uncertainty, 0.99).solve(np.array([0.0, 0.0, -4.0, 0.0, 0.0, 0.0]))
    assert found.outcome == Outcome.SOLVED
    assert found.forces[:, 0] == pytest.approx(2.0 / (0.6 * (1.0 - 2.5749 * 0.15)), rel=2e-3)


def test_spin_alone_takes_the_tail_of_the_product_of_mu_and_e():
    """A pair that bears torque about its line, mu and e of both in common: mu e f > tau / 2 in 99 % of draws."""
    grasp = opposite(0.6, 0.005)
    uncertainty = uncertainty_of("common", grasp)
    found = RobustLeastEffort(grasp, uncertainty, 0.99).solve(np.array([0.0, 0.0, 0.0, 0.02, 0.0, 0.0]))
    assert found.outcome == Outcome.SOLVED
    drawn = np.random.default_rng(1).standard_normal((400_000, 2))
    quantile = np.quantile((0.6 + 0.09 * drawn[:, 0]) * (0.005 + 0.00125 * drawn[:, 1]), 0.01)
    needed = 0.01 / quantile
    assert needed <= found.forces[:, 0].mean() * 1.01
    assert found.forces[:, 0].mean() <= 1.05 * needed


@pytest.mark.slow
def test_grip_is_little_more_than_needed():
    """Against the normal forces of known mu and e, all pressed harder by one factor until 99 % hold."""
    rng = np.random.default_rng(7)
    dearer = []
    while len(dearer) < 4:
        grasp, wrench = random_grasp(rng, 3), random_load(rng)
        uncertainty = uncertainty_of("common", grasp)
        found = RobustLeastEffort(grasp, uncertainty, 0.99).solve(wrench)
        known, _, forces, _ = solved(grasp, wrench)
        draws = Draws(grasp, uncertainty, wrench, rng, 600)
        if found.outcome != Outcome.SOLVED or known != Outcome.SOLVED or draws.failures(3.0 * forces[:, 0]) > 6:
            continue  # one factor does not do
        low, high = 1.0, 3.0
        for _ in range(8):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if draws.failures(middle * forces[:, 0]) <= 6 else (middle, high)
        dearer.append(found.forces[:, 0].sum() / (high * forces[:, 0].sum()))
    assert np.median(dearer) <= 1.15


def test_nothing_is_kept_back_of_what_is_known():
    rng = np.random.default_rng(3)
    grasp, wrench = random_grasp(rng, 4), random_load(rng)
    known = GraspUncertainty(np.zeros(4), np.zeros(4))
    found = RobustLeastEffort(grasp, known, 0.99).solve(wrench)
    assert found.forces == pytest.approx(solved(grasp, wrench)[2], abs=1e-7)
    assert np.abs(found.reserve).max() < 1e-6


def test_forces_scale_with_the_load_and_its_uncertainty():
    rng = np.random.default_rng(5)
    grasp, wrench = random_grasp(rng, 4), random_load(rng)
    one = uncertainty_of("all", grasp)
    ten = replace(one, load=100.0 * one.load)
    small = RobustLeastEffort(grasp, one, 0.95).solve(wrench)
    large = RobustLeastEffort(grasp, ten, 0.95).solve(10.0 * wrench)
    assert small.outcome == large.outcome == Outcome.SOLVED
    assert large.forces == pytest.approx(10.0 * small.forces, rel=1e-6, abs=1e-6)


def test_reserve_is_kept_and_more_probability_costs_more_grip():
    rng = np.random.default_rng(9)
    grasp, wrench = random_grasp(rng, 4), random_load(rng)
    uncertainty = uncertainty_of("mu and e", grasp)
    grips = []
    for probability in (0.8, 0.95, 0.99):
        found = RobustLeastEffort(grasp, uncertainty, probability).solve(wrench)
        assert found.outcome == Outcome.SOLVED
        tolerance = 3e-3 * found.forces[:, 0].max()
        assert (grasp.margins(found.forces) >= found.reserve - tolerance).all()
        surer = RobustLeastEffort(grasp, uncertainty_of("mu", grasp), probability).solve(wrench)
        grips.append((surer.forces[:, 0] ** 2).sum())
    assert grips[0] < grips[1] < grips[2]


@pytest.mark.parametrize("correlation", [-0.6, 0.0, 0.5, 0.95])
def test_two_margins_fail_together_as_a_bivariate_normal_says(correlation):
    covariance = np.array([[1.0, correlation], [correlation, 1.0]])
    ratio = np.sqrt((1.0 - correlation) / (1.0 + correlation))
    exact = 1.0 - multivariate_normal(cov=covariance).cdf([1.7, 1.7])
    assert failing(1.7, np.array([ratio])) == pytest.approx(exact, abs=1e-6)
    beta = joint_deviations(covariance, 0.01)
    assert multivariate_normal(cov=covariance).cdf([beta, beta]) == pytest.approx(0.99, abs=1e-5)


def test_joint_bound_is_never_too_low():
    """Hunter's bound against counting: five margins with random correlations."""
    rng = np.random.default_rng(2)
    for _ in range(5):
        root = rng.standard_normal((5, 3))
        covariance = root @ root.T + 0.1 * np.eye(5)
        beta = joint_deviations(covariance, 0.02)
        drawn = rng.multivariate_normal(np.zeros(5), covariance, 100_000) / np.sqrt(np.diag(covariance))
        share = (drawn.max(axis=1) > beta).mean()
        assert 0.012 <= share <= 0.0212
    assert owen(1.0, 1.0) == pytest.approx(0.06674188, abs=1e-8)  # Phi(1) Phi(-1) / 2


@pytest.mark.parametrize("kind", ["mu", "mu and e", "common", "all common"])
def test_fixed_forces_are_within_limits_at_least_as_often_as_told(kind):
    """Against drawn mu and e; the sum over contacts is never told more than once too often."""
    rng = np.random.default_rng(20 + KINDS.index(kind))
    for probability in (0.5, 0.8, 0.95, 0.99):
        grasp, wrench = random_grasp(rng, int(rng.integers(3, 7))), random_load(rng)
        uncertainty = uncertainty_of(kind, grasp)
        found = RobustLeastEffort(grasp, uncertainty, probability).solve(wrench)
        drawn = Draws(grasp, uncertainty, wrench, rng, 40_000)
        spin = np.abs(found.forces[:, 3]) / np.maximum(drawn.spin_length, 1e-12)
        size = np.sqrt((found.forces[:, 1:3] ** 2).sum(axis=1) + spin**2)
        slips = size > drawn.friction * found.forces[:, 0] + 1e-9 * found.forces.max()
        each, told = slips.mean(axis=0), 1.0 - found.probability_fixed
        error = 4.0 * np.sqrt(0.25 / 40_000)
        assert slips.any(axis=1).mean() - error <= told <= min(each.sum(), 1.0) + error
        assert told >= each.max() - error


def test_one_contact_fails_as_often_as_its_integral_says():
    """Known in closed form: mu f above t, and e above tau / mu f; both together by drawing."""
    known, forces = np.zeros((1, 1)), np.array([[1.0, 0.3, 0.4, 0.0], [1.0, 0.0, 0.0, 0.003]])
    friction, length = np.array([0.6]), np.array([0.006])
    of_mu, of_e = np.array([[0.01]]), np.array([[1e-6]])
    slides = probability_within_limits(forces[:1], friction, length, of_mu, of_e)
    spins = probability_within_limits(forces[1:], friction, length, known, of_e)
    assert slides == pytest.approx(ndtr(1.0), abs=1e-5)
    assert spins == pytest.approx(ndtr(1.0), abs=1e-5)
    drawn = np.random.default_rng(0).standard_normal((2, 400_000))
    share = np.mean((0.6 + 0.1 * drawn[0]) * np.maximum(0.006 + 1e-3 * drawn[1], 0.0) > 0.003)
    assert probability_within_limits(forces[1:], friction, length, of_mu, of_e) == pytest.approx(share, abs=3e-3)


@pytest.mark.slow
def test_sampled_holding_is_what_another_solver_counts():
    """Forces of known friction hold half of the time: shares of clarabel's, whose draws are others'."""
    rng = np.random.default_rng(31)
    for kind in ("mu and e", "all", "all common"):
        grasp, wrench = random_grasp(rng, 4), random_load(rng)
        uncertainty, forces = uncertainty_of(kind, grasp), solved(grasp, wrench)[2]
        sampled = sample_holding(grasp, uncertainty, wrench, forces, 3000)
        draws = Draws(grasp, uncertainty, wrench, rng, 400)
        pressing = (draws.friction > 0).all(axis=1) & (draws.spin_length > 0).all(axis=1)
        held = np.mean([pressing[k] and draws.held(k, forces[:, 0]) for k in range(400)])
        assert sampled.undecided <= 3
        assert abs(held - sampled.redistributing) <= 4.0 * np.hypot(sampled.redistributing_error, 0.025)
        if kind == "mu and e":  # forces that hold as they are hold redistributed
            assert sampled.fixed <= sampled.redistributing
        assert sampled == sample_holding(grasp, uncertainty, wrench, forces, 3000)


def test_forces_that_do_not_balance_hold_never():
    rng = np.random.default_rng(32)
    grasp, wrench = random_grasp(rng, 3), random_load(rng)
    uncertainty, forces = uncertainty_of("mu", grasp), solved(grasp, wrench)[2]
    assert sample_holding(grasp, uncertainty, wrench, np.zeros((3, 4)), 10) == SampledHolding(0.0, 0.0, 10, 0)
    assert sample_holding(grasp, uncertainty, wrench, 2.0 * forces, 10).fixed == 0.0
    with pytest.raises(InvalidValueError, match=r"forces have shape \(4, 4\)"):
        sample_holding(grasp, uncertainty, wrench, np.zeros((4, 4)))


def test_what_makes_no_sense_is_refused():
    rng = np.random.default_rng(1)
    grasp = random_grasp(rng, 3)
    sure = GraspUncertainty(0.1 * grasp.friction, 0.1 * grasp.spin_length)
    check_refusals(
        (r"probability = 1.0: must lie between 0.5 and 1", lambda: RobustLeastEffort(grasp, sure, 1.0)),
        (
            "uncertainty is of 2 contacts, the grasp has 3",
            lambda: RobustLeastEffort(grasp, GraspUncertainty(np.zeros(2), np.zeros(2))),
        ),
        (
            r"friction of contact 0: mu = .* may be 0",
            lambda: RobustLeastEffort(grasp, GraspUncertainty(np.array([0.9, 0.0, 0.0]), np.zeros(3))),
        ),
        (
            r"load_exponent = .*cones alone",
            lambda: RobustLeastEffort(replace(grasp, load_exponent=np.full(3, 0.2)), sure),
        ),
        (r"friction = .*standard deviations", lambda: GraspUncertainty(np.array([-0.1, 0.1]), np.zeros(2))),
        ("load has a negative eigenvalue", lambda: GraspUncertainty(np.zeros(2), np.zeros(2), load=-np.eye(6))),
        (
            r"position of contact 1 is not symmetric",
            lambda: GraspUncertainty(np.zeros(2), np.zeros(2), position=[np.eye(3), np.triu(np.ones((3, 3)))]),
        ),
        (
            r"normal has shape \(2, 3, 3\): must be \(2, 2, 2\)",
            lambda: GraspUncertainty(np.zeros(2), np.zeros(2), normal=np.zeros((2, 3, 3))),
        ),
    )
