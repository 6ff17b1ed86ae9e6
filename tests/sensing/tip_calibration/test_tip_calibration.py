"""Fingertips found by touch: equations against geometry solved otherwise, intervals, plans, what must be told."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import binomtest

from palpate import ContactStatus, contact_from_wrench
from palpate.errors import InvalidValueError
from palpate.estimation import Assumption
from palpate.sensing.tip_calibration import (
    Target,
    TargetKind,
    TipFit,
    Touches,
    Unknowns,
    candidate_touches,
    fit_tip,
    planned_touches,
    tip_shape,
)
from palpate.sensing.tip_calibration.equations import TouchEquations
from palpate.surfaces import Capsule, Cylinder, Ellipsoid, Superellipsoid
from support.touched_targets import NANO17, TARGETS, WRIST, Instrumented, TrueTip, robot, touches, typed_tip, wrong

ELLIPSOID = (0.008, 0.006, 0.01)
SPHERE = (0.008,)


def _planned(axes, kind: Instrumented, count: int, tilt: float = 0.5, targets=TARGETS, share: float = 1.0):
    tip, plan = typed_tip(axes, share=share), robot(kind, tilt)
    candidates = candidate_touches(tip, targets, plan)
    return tip, planned_touches(candidates, count, tip, targets, plan, kind.instrument)[0]


def _round(true: TrueTip, tip) -> TrueTip:
    return replace(true, semi_axes=(true.semi_axes[0],) * 3) if len(tip.shape.sizes) == 1 else true


def _fitted(axes, kind: Instrumented, seed: int, planned=None, tip=None) -> tuple[TrueTip, TipFit]:
    if planned is None:
        tip, planned = _planned(axes, kind, 40)
    rng = np.random.default_rng(seed)
    true = _round(wrong(tip, rng), tip)
    return true, fit_tip(touches(true, planned, kind, rng), TARGETS, tip, kind.instrument)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1), st.sampled_from([ELLIPSOID, SPHERE]))
def test_equations_hold_for_what_is_true(seed: int, axes) -> None:
    tip, planned = _planned(axes, NANO17, 9)
    rng = np.random.default_rng(seed)
    exact = Instrumented(replace(NANO17.instrument, position_sd=1e-30), (1e-30,) * 6, 0.0)
    true = _round(wrong(tip, rng), tip)
    felt = touches(true, planned, exact, rng)
    unknowns = Unknowns(tip, true.targets)
    values = unknowns.typed.copy()
    values[unknowns.blocks["size"]] = true.semi_axes[: len(tip.shape.sizes)]
    values[unknowns.blocks["center"]] = true.center
    turn = Rotation.from_matrix(tip.rotation.T @ true.rotation).as_rotvec()
    values[unknowns.blocks["rotation"]] = turn if len(axes) == 3 else []
    values[unknowns.blocks["stiffness"]] = np.log(true.stiffness)
    solved = TouchEquations(unknowns, felt, exact.instrument).solved(values)
    assert np.abs(solved.residuals).max() < 1e-11


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
        step = 1e-6
        slopes = [
            (shape.support(sizes, u + step * e)[0] - shape.support(sizes, u - step * e)[0]) for e in np.eye(3)
        ]
        if not isinstance(surface, Capsule):  # off the unit sphere its rounded kink is another
            np.testing.assert_allclose(np.column_stack(slopes) / (2.0 * step), x, atol=1e-7)


@pytest.mark.parametrize("kind", [NANO17, WRIST], ids=["nano17", "wrist"])
@pytest.mark.parametrize("axes", [SPHERE, ELLIPSOID], ids=["sphere", "ellipsoid"])
def test_a_wrong_drawing_is_put_right(kind: Instrumented, axes) -> None:
    true, fit = _fitted(axes, kind, 1)
    assert fit.verdict.ok, str(fit.verdict)
    within = 2e-5 if kind is NANO17 else 1e-4
    np.testing.assert_allclose(fit.sizes, true.semi_axes[: len(axes)], atol=2.0 * within)
    np.testing.assert_allclose(fit.center, true.center, atol=within)


def test_a_wrench_means_the_touched_place_on_the_found_tip() -> None:
    kind = replace(NANO17, instrument=replace(NANO17.instrument, accuracy=0.0), accuracy=0.0)
    _, fit = _fitted(ELLIPSOID, kind, 1)
    for wrench, centroid in zip(fit.touches.wrench, fit.solved.centroid, strict=True):
        contact = contact_from_wrench(fit.surface(), wrench)
        assert contact.status is ContactStatus.OK
        assert np.linalg.norm(contact.centroid - centroid) < 5e-5


@pytest.mark.slow
@pytest.mark.parametrize("axes", [SPHERE, ELLIPSOID], ids=["sphere", "ellipsoid"])
@pytest.mark.parametrize("kind", [NANO17, WRIST], ids=["nano17", "wrist"])
def test_intervals_cover(kind: Instrumented, axes) -> None:
    tip, planned = _planned(axes, kind, 40)
    hits = []
    for seed in range(40):
        true, fit = _fitted(axes, kind, seed, planned, tip)
        block = fit.unknowns.blocks
        off = np.concatenate([fit.sizes - true.semi_axes[: len(axes)], fit.center - true.center])
        half = fit.half_widths()
        hits += (np.abs(off) < np.concatenate([half[block["size"]], half[block["center"]]])).tolist()
    # parameters of one fit are correlated: as if a third of them were independent
    assert binomtest(sum(hits) // 3, len(hits) // 3, 0.95).pvalue > 1e-4, sum(hits) / len(hits)


def test_plans_beat_random_touches() -> None:
    tip, plan = typed_tip(ELLIPSOID), robot(NANO17, 0.5)
    candidates = candidate_touches(tip, TARGETS, plan)
    unknowns = Unknowns(tip, TARGETS)
    wanted = np.r_[0:6]
    _, planned_sd = planned_touches(candidates, 30, tip, TARGETS, plan, NANO17.instrument)
    rng = np.random.default_rng(3)
    variances = []
    for _ in range(5):
        some = [candidates[i] for i in rng.choice(len(candidates), 30, replace=False)]
        variances.append(planned_touches(some, 30, tip, TARGETS, plan, NANO17.instrument)[1][wanted] ** 2)
    assert len(unknowns.each) > 6
    assert np.mean(np.mean(variances, axis=0) / planned_sd[wanted] ** 2) > 2.0


def test_the_base_frame_does_not_matter() -> None:
    tip, planned = _planned(SPHERE, NANO17, 20)
    rng = np.random.default_rng(5)
    felt = touches(_round(wrong(tip, rng), tip), planned, NANO17, rng)
    turn, shift = Rotation.from_rotvec([0.3, -1.1, 2.0]).as_matrix(), np.array([0.4, -2.0, 0.7])
    moved = replace(felt, rotation=turn @ felt.rotation, position=felt.position @ turn.T + shift)
    elsewhere = tuple(
        replace(t, place=tuple(turn @ t.place + shift), direction=tuple(turn @ t.direction)) for t in TARGETS
    )
    first = fit_tip(felt, TARGETS, tip, NANO17.instrument)
    second = fit_tip(moved, elsewhere, tip, NANO17.instrument)
    np.testing.assert_allclose(second.center, first.center, atol=1e-8)
    np.testing.assert_allclose(second.sizes, first.sizes, atol=1e-8)


def test_a_spheres_orientation_is_no_unknown() -> None:
    assert not any(each.name.startswith("turn") for each in Unknowns(typed_tip(SPHERE), TARGETS).each)


def _with(felt: Touches, rows, **changes) -> Touches:
    changed = {name: getattr(felt, name).copy() for name in changes}
    for name, change in changes.items():
        changed[name][rows] += change
    return replace(felt, **changed)


def _broken(axes, change, seed: int = 2, kind: Instrumented = NANO17, **more) -> TipFit:
    """Fit touches that something went wrong with."""
    tip, planned = _planned(axes, kind, 40, **more)
    rng = np.random.default_rng(seed)
    felt = change(_round(wrong(tip, rng), tip), planned, rng)
    return fit_tip(felt, TARGETS, tip, kind.instrument)


def test_a_tip_that_moved_is_told_with_when() -> None:
    def moved(true, planned, rng):
        felt = touches(true, planned, NANO17, rng)
        after = replace(true, center=true.center + np.array([1e-4, 0.0, 0.0]))
        rest = touches(after, planned[25:], NANO17, np.random.default_rng(9))
        return replace(
            felt,
            wrench=np.concatenate([felt.wrench[:25], rest.wrench]),
            position=np.concatenate([felt.position[:25], rest.position]),
        )

    verdict = _broken(SPHERE, moved).verdict
    assert verdict.breaks(Assumption.WHITE_IN_TIME)
    told = next(each for each in verdict.broken if each.assumption is Assumption.WHITE_IN_TIME)
    assert abs(int(told.finding.split()[2]) - 25) <= 3


def test_a_soft_plate_is_told() -> None:
    def soft(true, planned, rng):
        felt = touches(true, planned, NANO17, rng)
        rows = felt.target == 0
        if not rows.any():
            rows = felt.target == 1
        force = np.linalg.norm(felt.wrench[rows, :3], axis=1)
        target = true.targets[int(felt.target[rows][0])]
        assert target.name
        # it gives way by as much again, along the direction of the force
        deeper = -(felt.rotation[rows] @ (felt.wrench[rows, :3] / force[:, None])[:, :, None])[:, :, 0]
        return _with(felt, rows, position=(force / true.stiffness)[:, None] * deeper)

    assert _broken(SPHERE, soft).verdict.breaks(Assumption.CONSISTENT)


def test_touches_of_one_side_or_too_few_are_told() -> None:
    tip, plan = typed_tip(SPHERE), replace(robot(NANO17, 0.0), widest=0.05)
    plate = (TARGETS[0],)
    candidates = candidate_touches(tip, plate, plan) * 10
    rng = np.random.default_rng(0)
    felt = touches(_round(wrong(tip, rng, plate), tip), candidates, NANO17, rng)
    fit = fit_tip(felt, plate, tip, NANO17.instrument)
    assert fit.verdict.breaks(Assumption.CONDITIONED)
    assert "same side" in str(fit.verdict)
    few = fit_tip(felt.selected([0, 1]), plate, tip, NANO17.instrument)
    assert few.verdict.breaks(Assumption.ENOUGH_DATA)


def test_another_shape_and_a_bad_touch_are_told() -> None:
    tip, planned = _planned(SPHERE, NANO17, 40)
    rng = np.random.default_rng(4)
    egg = replace(_round(wrong(tip, rng), tip), semi_axes=(0.008, 0.0081, 0.0082))
    fit = fit_tip(touches(egg, planned, NANO17, rng), TARGETS, tip, NANO17.instrument)
    assert fit.verdict.breaks(Assumption.WHITE_IN_DIRECTION)
    with_field = fit_tip(fit.touches, TARGETS, replace(tip, deviation_degree=2), NANO17.instrument)
    assert not with_field.verdict.breaks(Assumption.WHITE_IN_DIRECTION)
    slipped = _broken(SPHERE, lambda t, p, r: _with(touches(t, p, NANO17, r), 7, position=2e-4))
    assert slipped.verdict.breaks(Assumption.NO_OUTLIERS)
    assert "touch 7" in str(slipped.verdict)


def test_a_wrong_mount_is_found_when_it_is_doubted() -> None:
    kind = replace(NANO17, instrument=replace(NANO17.instrument, accuracy=0.0), accuracy=0.0)
    tip, planned = _planned(SPHERE, kind, 50)
    tip = replace(tip, mount_turn_sd=0.05)
    rng = np.random.default_rng(6)
    felt = touches(_round(wrong(tip, rng), tip), planned, kind, rng)
    off = Rotation.from_rotvec([0.02, -0.01, 0.015]).as_matrix()
    fit = fit_tip(replace(felt, rotation=felt.rotation @ off.T), TARGETS, tip, kind.instrument)
    assert fit.verdict.ok, str(fit.verdict)
    np.testing.assert_allclose(fit.unknowns.of("mount_turn", fit.values), [0.02, -0.01, 0.015], atol=2e-3)


def test_what_cannot_be_is_refused_by_name() -> None:
    tip, planned = _planned(SPHERE, NANO17, 6)
    rng = np.random.default_rng(0)
    felt = touches(_round(wrong(tip, rng), tip), planned, NANO17, rng)
    with pytest.raises(InvalidValueError, match="its force pulls"):
        fit_tip(replace(felt, wrench=-felt.wrench), TARGETS, tip)
    with pytest.raises(InvalidValueError, match="no touches"):
        fit_tip(felt.selected(np.zeros(6, dtype=bool)), TARGETS, tip)
    with pytest.raises(InvalidValueError, match="outward normal"):
        Target("plate", TargetKind.PLANE, (0.0, 0.0, 0.0))
    with pytest.raises(InvalidValueError, match="is a Cylinder"):
        tip_shape(Cylinder(0.01))
    with pytest.raises(InvalidValueError, match="no rotation"):
        replace(felt, rotation=2.0 * felt.rotation)


def test_deviations_that_were_found_are_a_surface() -> None:
    tip, planned = _planned(SPHERE, NANO17, 50)
    tip = replace(tip, deviation_degree=2)
    rng = np.random.default_rng(8)
    egg = replace(_round(wrong(tip, rng), tip), semi_axes=(0.008, 0.00805, 0.0081), rotation=np.eye(3))
    fit = fit_tip(touches(egg, planned, NANO17, rng), TARGETS, tip, NANO17.instrument)
    assert fit.verdict.ok, str(fit.verdict)
    true = Ellipsoid(egg.semi_axes, center=egg.center)
    found = fit.rigid_surface()
    for up in ([0.0, 0.0, 1.0], [0.3, 0.2, 1.0], [-0.5, 0.4, 0.8]):
        force = 2.0 * np.array(up) / np.linalg.norm(up)
        wrench = np.concatenate([force, np.cross(egg.center, force)])
        off = contact_from_wrench(found, wrench).centroid - contact_from_wrench(true, wrench).centroid
        assert np.linalg.norm(off) < 5e-5
    with pytest.raises(InvalidValueError, match="only spheres have them"):
        typed_tip(ELLIPSOID, deviation_degree=2)
