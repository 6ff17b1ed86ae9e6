"""Fingertips found by touch: equations against geometry solved otherwise, intervals, plans, what must be told."""

import functools
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import binomtest

from palpate import ContactStatus, contact_from_wrench
from palpate.estimation import Assumption
from palpate.sensing.tip_calibration import (
    TipFit,
    Unknowns,
    candidate_touches,
    fit_tip,
    planned_touches,
    tip_shape,
)
from palpate.sensing.tip_calibration.equations import TouchEquations
from palpate.surfaces import Capsule, Ellipsoid, Superellipsoid
from support.touched_targets import NANO17, TARGETS, WRIST, Instrumented, TrueTip, robot, touches, typed_tip, wrong

ELLIPSOID = (0.008, 0.006, 0.01)
SPHERE = (0.008,)
EXACT_MATRIX = replace(NANO17, instrument=replace(NANO17.instrument, accuracy=0.0), accuracy=0.0)


@functools.cache
def _planned(axes, kind: Instrumented, count: int):
    """A typed tip and the touches that tell most about it."""
    tip, plan = typed_tip(axes), robot(kind, 0.5)
    candidates = candidate_touches(tip, TARGETS, plan)
    return tip, planned_touches(candidates, count, tip, TARGETS, plan, kind.instrument)[0]


def _true(tip, rng: np.random.Generator, targets=TARGETS) -> TrueTip:
    """A tip that the typed one is wrong about: round where that is."""
    true = wrong(tip, rng, targets)
    return replace(true, semi_axes=(true.semi_axes[0],) * 3) if len(tip.shape.sizes) == 1 else true


def _fitted(
    axes, kind: Instrumented, seed: int, count: int = 40, change=touches, **options
) -> tuple[TrueTip, TipFit]:
    """Touches of a true tip, as they are or as `change` makes them, and the tip that is found."""
    tip, planned = _planned(axes, kind, count)
    tip, rng = replace(tip, **options), np.random.default_rng(seed)
    true = _true(tip, rng)
    return true, fit_tip(change(true, planned, kind, rng), TARGETS, tip, kind.instrument)


@settings(deadline=None, max_examples=6)
@given(st.integers(0, 2**32 - 1), st.sampled_from([ELLIPSOID, SPHERE]))
def test_equations_hold_for_the_true_tip(seed: int, axes) -> None:
    tip, planned = _planned(axes, NANO17, 9)
    rng = np.random.default_rng(seed)
    exact = Instrumented(replace(NANO17.instrument, position_sd=1e-30), (1e-30,) * 6, 0.0)
    true = _true(tip, rng)
    unknowns = Unknowns(tip, true.targets)
    turn = Rotation.from_matrix(tip.rotation.T @ true.rotation).as_rotvec()
    values = unknowns.typed.copy()
    for name, value in (
        ("size", true.semi_axes[: len(tip.shape.sizes)]),
        ("center", true.center),
        ("rotation", turn if len(axes) == 3 else []),
        ("stiffness", np.log(true.stiffness)),
    ):
        values[unknowns.blocks[name]] = value
    solved = TouchEquations(unknowns, touches(true, planned, exact, rng), exact.instrument).solved(values)
    assert np.abs(solved.residuals).max() < 1e-11
    assert len(axes) == 3 or not any(each.name.startswith("turn") for each in unknowns.each)


def test_a_capsule_and_a_superellipsoid_are_where_their_supports_say() -> None:
    rng = np.random.default_rng(0)
    u = rng.normal(size=(200, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    for surface in (Capsule(0.004, 0.02), Superellipsoid((0.008, 0.006, 0.01), 3.0), Ellipsoid(ELLIPSOID)):
        shape = tip_shape(surface)
        sizes = np.tile(shape.sizes, (len(u), 1))
        h, x = shape.support(sizes, u)
        np.testing.assert_allclose(np.einsum("ni,ni->n", u, x), h, atol=1e-12)
        # no other of its points is further out: it is convex, and h is its support
        assert (u @ x.T - h[:, None]).max() < 3e-6 * (1.0 if isinstance(surface, Capsule) else 1e-6)
        if not isinstance(surface, Capsule):  # off the unit sphere its rounded kink is another
            ahead, behind = ([shape.support(sizes, u + s * e)[0] for e in np.eye(3)] for s in (1e-6, -1e-6))
            np.testing.assert_allclose(np.subtract(ahead, behind).T / 2e-6, x, atol=1e-7)


def test_a_wrench_means_the_touched_place_on_the_found_tip() -> None:
    _, fit = _fitted(ELLIPSOID, EXACT_MATRIX, 1)
    for wrench, centroid in zip(fit.touches.wrench, fit.solved.centroid, strict=True):
        contact = contact_from_wrench(fit.surface(), wrench)
        assert contact.status is ContactStatus.OK
        assert np.linalg.norm(contact.centroid - centroid) < 5e-5


@pytest.mark.slow
@pytest.mark.parametrize("axes", [SPHERE, ELLIPSOID], ids=["sphere", "ellipsoid"])
@pytest.mark.parametrize("kind", [NANO17, WRIST], ids=["nano17", "wrist"])
def test_a_wrong_drawing_is_put_right_and_intervals_cover(kind: Instrumented, axes) -> None:
    hits, within = [], np.repeat([2.0, 1.0], [len(axes), 3]) * (2e-5 if kind is NANO17 else 1e-4)
    for seed in range(20):
        true, fit = _fitted(axes, kind, seed)
        off = np.concatenate([fit.sizes - true.semi_axes[: len(axes)], fit.center - true.center])
        half = [fit.half_widths()[fit.unknowns.blocks[name]] for name in ("size", "center")]
        hits += (np.abs(off) < np.concatenate(half)).tolist()
        if seed == 1:
            assert fit.verdict.ok, str(fit.verdict)
            assert (np.abs(off) <= within).all()
    # parameters of one fit are correlated: as if a third of them were independent
    assert binomtest(sum(hits) // 3, len(hits) // 3, 0.95).pvalue > 1e-4, sum(hits) / len(hits)


def test_plans_beat_random_touches() -> None:
    tip, plan = typed_tip(ELLIPSOID), robot(NANO17, 0.5)
    candidates, rng = candidate_touches(tip, TARGETS, plan), np.random.default_rng(3)
    drawn = [[candidates[i] for i in rng.choice(len(candidates), 30, replace=False)] for _ in range(3)]
    planned, *random = (
        planned_touches(some, 30, tip, TARGETS, plan, NANO17.instrument)[1][:6] ** 2
        for some in (candidates, *drawn)
    )
    assert np.mean(np.mean(random, axis=0) / planned) > 2.0


def test_the_base_frame_does_not_matter() -> None:
    turn, shift = Rotation.from_rotvec([0.3, -1.1, 2.0]).as_matrix(), np.array([0.4, -2.0, 0.7])
    _, first = _fitted(SPHERE, NANO17, 5, 20)
    felt = first.touches
    moved = replace(felt, rotation=turn @ felt.rotation, position=felt.position @ turn.T + shift)
    elsewhere = tuple(
        replace(t, place=tuple(turn @ t.place + shift), direction=tuple(turn @ t.direction)) for t in TARGETS
    )
    second = fit_tip(moved, elsewhere, typed_tip(SPHERE), NANO17.instrument)
    np.testing.assert_allclose(second.center, first.center, atol=1e-8)
    np.testing.assert_allclose(second.sizes, first.sizes, atol=1e-8)


def moved_midway(true, planned, kind, rng):
    """The tip shifts on its mount before touch 25."""
    after = replace(true, center=true.center + np.array([1e-4, 0.0, 0.0]))
    felt, rest = touches(true, planned, kind, rng), touches(after, planned[25:], kind, np.random.default_rng(9))
    return replace(
        felt,
        wrench=np.concatenate([felt.wrench[:25], rest.wrench]),
        position=np.concatenate([felt.position[:25], rest.position]),
    )


def soft_plate(true, planned, kind, rng):
    """One target gives way by as much as the tip, along the direction of the force."""
    felt = touches(true, planned, kind, rng)
    rows = felt.target == felt.target.min()
    deeper = -np.einsum("nij,nj->ni", felt.rotation, felt.wrench[:, :3]) / true.stiffness
    return replace(felt, position=felt.position + rows[:, None] * deeper)


def slipped(true, planned, kind, rng):
    """One touch is off by 0.2 mm."""
    felt = touches(true, planned, kind, rng)
    return replace(felt, position=felt.position + 2e-4 * (np.arange(len(planned)) == 7)[:, None])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "assumption", "words"),
    [
        (moved_midway, Assumption.WHITE_IN_TIME, r"\b2[2-8]\b"),
        (soft_plate, Assumption.CONSISTENT, ""),
        (slipped, Assumption.NO_OUTLIERS, "touch 7"),
    ],
)
def test_faults_of_the_touches_are_reported(change, assumption, words) -> None:
    verdict = _fitted(SPHERE, NANO17, 2, change=change)[1].verdict
    (told,) = (each for each in verdict.broken if each.assumption is assumption)
    assert re.search(words, str(told)), told


def test_touches_of_one_side_or_too_few_are_reported() -> None:
    tip, plan, plate = typed_tip(SPHERE), replace(robot(NANO17, 0.0), widest=0.05), (TARGETS[0],)
    rng = np.random.default_rng(0)
    felt = touches(_true(tip, rng, plate), candidate_touches(tip, plate, plan) * 10, NANO17, rng)
    fit, few = (fit_tip(each, plate, tip, NANO17.instrument) for each in (felt, felt.selected([0, 1])))
    assert fit.verdict.breaks(Assumption.CONDITIONED)
    assert "same side" in str(fit.verdict)
    assert few.verdict.breaks(Assumption.ENOUGH_DATA)


def egg(semi_axes):
    """Touches of an ellipsoid that is taken for a sphere."""
    return lambda true, planned, kind, rng: touches(
        replace(true, semi_axes=semi_axes, rotation=np.eye(3)), planned, kind, rng
    )


@pytest.mark.slow
def test_another_shape_is_reported_and_its_deviations_are_a_surface() -> None:
    axes = (0.008, 0.00805, 0.0081)
    round_one = _fitted(SPHERE, NANO17, 4, 50, egg((0.008, 0.0081, 0.0082)))[1]
    assert round_one.verdict.breaks(Assumption.WHITE_IN_DIRECTION)
    drawn, fit = _fitted(SPHERE, NANO17, 8, 50, egg(axes), deviation_degree=2)
    assert fit.verdict.ok, str(fit.verdict)
    true, found = Ellipsoid(axes, center=drawn.center), fit.rigid_surface()
    for up in ([0.0, 0.0, 1.0], [0.3, 0.2, 1.0], [-0.5, 0.4, 0.8]):
        force = 2.0 * np.array(up) / np.linalg.norm(up)
        wrench = np.concatenate([force, np.cross(drawn.center, force)])
        off = contact_from_wrench(found, wrench).centroid - contact_from_wrench(true, wrench).centroid
        assert np.linalg.norm(off) < 5e-5


def test_a_wrong_mount_is_found_when_it_is_doubted() -> None:
    off = [0.02, -0.01, 0.015]

    def turned(*given):
        felt = touches(*given)
        return replace(felt, rotation=felt.rotation @ Rotation.from_rotvec(off).as_matrix().T)

    fit = _fitted(SPHERE, EXACT_MATRIX, 6, 50, turned, mount_turn_sd=0.05)[1]
    assert fit.verdict.ok, str(fit.verdict)
    np.testing.assert_allclose(fit.unknowns.of("mount_turn", fit.values), off, atol=2e-3)
