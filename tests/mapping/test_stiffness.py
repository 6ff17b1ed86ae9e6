"""Stiffness along a path: what bends is not what gives way, and what was not pressed differently is not known."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mapping.felt_shapes import correlated
from palpate.mapping import SurfaceModel
from palpate.mapping.stiffness import LocalStiffness, local_stiffness, stiffness_layer

SPEED, RATE = 0.02, 500.0
NOISE = SurfaceModel()
QUIET = SurfaceModel(noise=1e-7, tilt=1e-5)


def pressed(
    stiffness, swing=0.5, seed=None, length=0.06, bump=2e-3, force=2.0, wave=6e-3, offset=0.0, force_noise=0.0
):
    """A row over waves of 30 mm, pressed with a sine of 6 mm of path: (time, position, normal, force)."""
    x = np.arange(0.0, length, SPEED / RATE)
    k = 2.0 * np.pi / 30e-3
    normal = np.column_stack([-bump * k * np.cos(k * x), np.zeros_like(x), np.ones_like(x)])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    F = force + swing * np.sin(2.0 * np.pi * x / wave)
    position = np.column_stack([x, np.zeros_like(x), bump * np.sin(k * x) + offset])
    position -= (F / stiffness(x))[:, None] * normal
    if seed is not None:
        rng = np.random.default_rng(seed)
        position = position + correlated(x, NOISE.noise_length, NOISE.noise, rng)
        normal = normal + NOISE.tilt * np.cross(correlated(x, NOISE.tilt_length, 1.0, rng), normal)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        F = F + force_noise * rng.normal(size=F.shape)
    return x / SPEED, position, normal, F


def even(value):
    return lambda x: np.full_like(x, value)


@given(st.floats(500.0, 2e4), st.floats(0.0, 3e-3), st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_waves_and_place_do_not_matter(value, bump, seed):
    rng = np.random.default_rng(seed)
    R, p = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    time, position, normal, force = pressed(even(value), bump=bump)
    found = local_stiffness(time, position @ R.T + p, normal @ R.T, force, noise=QUIET, force_noise=0.0)
    assert found.known.all()
    np.testing.assert_allclose(found.stiffness, value, rtol=0.02)


def test_claimed_deviations_are_those_of_the_errors():
    found = [local_stiffness(*pressed(even(2e3), seed=k, force_noise=0.01), noise=NOISE) for k in range(12)]
    score = np.concatenate([(each.compliance - 1.0 / 2e3) / each.compliance_sd for each in found])
    assert 0.90 <= (np.abs(score) < 1.96).mean() <= 0.995
    assert abs(score.mean()) < 0.3


def test_two_materials_are_distinguished():
    found = local_stiffness(*pressed(lambda x: np.where(x < 0.03, 1e3, 5e3), swing=1.0, seed=1), noise=NOISE)
    soft, hard = found.position[:, 0] < 0.026, found.position[:, 0] > 0.034
    assert found.known[soft].all()
    assert found.known[hard].mean() > 0.8
    # each within three of its own deviations, which are 2 to 5 % on the soft half and 8 to 24 % on the hard one
    off = (found.compliance - np.where(soft, 1.0 / 1e3, 1.0 / 5e3)) / found.compliance_sd
    assert np.abs(off[soft | hard]).max() < 3.0
    assert np.median(found.stiffness_sd[soft]) < 0.04 * 1e3
    # the median of six windows that do not overlap, 13 % each: 1.25 x 13 % / sqrt(6)
    assert np.nanmedian(found.stiffness[hard]) == pytest.approx(5e3, rel=2.0 * 0.066)
    vertices = np.column_stack([np.linspace(5e-3, 0.055, 50), np.zeros((50, 2))])
    layer = stiffness_layer(found, vertices, 3e-3)
    at = vertices[:, 0]
    for part, value in ((at < 0.018, 1e3), (at > 0.042, 5e3)):
        assert np.nanmax(np.abs(layer.mean - value)[part] / layer.sd[part]) < 3.0


def test_a_steady_force_and_a_rigid_surface_leave_the_stiffness_unknown():
    found = local_stiffness(*pressed(even(2e3), swing=0.0, seed=0, force_noise=0.01), noise=NOISE)
    assert len(found) > 10
    layer = stiffness_layer(found, found.position, 3e-3)
    assert np.isnan([found.stiffness, found.stiffness_at_least, layer.mean]).all()
    rigid = local_stiffness(*pressed(even(1e9), seed=3), noise=NOISE)
    assert not rigid.known.any()
    assert (rigid.stiffness_at_least > 2e3).all()


def test_a_landing_gives_the_stiffness_of_one_place():
    time = np.arange(0.0, 0.2, 1.0 / RATE)
    force = 10.0 * time
    rng = np.random.default_rng(0)
    normal = np.tile([0.0, 0.0, 1.0], (len(time), 1))
    position = -(force / 3e3)[:, None] * normal + 1e-6 * rng.normal(size=(len(time), 3))
    found = local_stiffness(time, position, normal, force, noise=NOISE)
    assert len(found) == 1
    # at rest what keeps along the path cancels; a third of 0.03 mm in each of 24 groups is left: 1 % of it
    assert found.stiffness_sd[0] == pytest.approx(0.01 * 3e3, rel=0.1)
    assert found.stiffness[0] == pytest.approx(3e3, rel=0.005)  # the noise here is far smaller than that


def test_the_compliance_of_the_tip_is_subtracted():
    tip, soft = 1.0 / 4e3, 1.0 / 2e3
    found = local_stiffness(*pressed(even(1.0 / (tip + soft))), noise=QUIET, force_noise=0.0, known_compliance=tip)
    np.testing.assert_allclose(found.stiffness, 2e3, rtol=0.02)


def test_windows_end_where_the_finger_lifts_off():
    time, position, normal, force = pressed(even(2e3), length=0.02)
    shifted = position + np.array([0.0, 0.0, 1e-3])  # it came back a millimetre higher: that is not compression
    twice = ((time, time + 5.0), (position, shifted), (normal, normal), (force, force))
    found = local_stiffness(*map(np.concatenate, twice), noise=QUIET, force_noise=0.0)
    np.testing.assert_allclose(found.stiffness, 2e3, rtol=0.02)


def test_windows_that_disagree_widen_the_deviation_of_a_vertex():
    place = np.array([[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0]])
    agree = LocalStiffness(place, np.array([5e-4, 5e-4]), np.full(2, 1e-5))
    differ = dataclasses.replace(agree, compliance=np.array([4e-4, 6e-4]))
    vertex = np.array([[5e-4, 0.0, 0.0]])
    one, other = stiffness_layer(agree, vertex, 2e-3), stiffness_layer(differ, vertex, 2e-3)
    np.testing.assert_allclose([one.mean[0], other.mean[0]], 2e3)
    assert other.sd[0] > 5.0 * one.sd[0]
    assert np.isnan(stiffness_layer(agree, vertex + 1.0, 2e-3).mean).all()
