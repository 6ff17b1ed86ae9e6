import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mapping.felt_shapes import correlated
from mapping.raster import CENTER, RADIUS, cap_normals, cloud_of, mapped, plane_cloud, raster, sphere_cap
from palpate.mapping import Knowledge, MapSettings, SurfaceMap, SurfaceModel, TouchCloud, standard_deviations
from palpate.mapping.surface_map import Parameter

QUIET = MapSettings(model=SurfaceModel(noise=1e-6, tilt=1e-4))


def cap(noise=0.0, seed=0, **kwargs):
    rng = np.random.default_rng(seed)
    felt = sphere_cap(**({"half": 0.008, "row": 1.5e-3} | kwargs))
    # one offset per row and millimetre: keeps along the path
    block = np.unique(np.round(felt.position * [1e3, 1e4, 0]), axis=0, return_inverse=True)[1].ravel()
    offset = noise * rng.normal(size=block.max() + 1)[block]
    return dataclasses.replace(felt, position=felt.position + offset[:, None] * felt.normal)


def inner_points(count=60, half=0.006, seed=1, lift=0.0):
    normal = cap_normals(np.random.default_rng(seed).uniform(-half, half, (count, 2)))
    return CENTER + (RADIUS + lift) * normal, normal


def joined(*clouds):
    """One after the other, with a pause of a second."""
    names = [field.name for field in dataclasses.fields(TouchCloud) if field.name not in ("time", "noise", "tilt")]
    parts = {name: np.concatenate([getattr(cloud, name) for cloud in clouds]) for name in names}
    ends = np.cumsum([0.0, *(cloud.time[-1] + 1.0 for cloud in clouds)])
    time = np.concatenate([cloud.time + end for cloud, end in zip(clouds, ends, strict=False)])
    return TouchCloud(time=time, **parts)


def assert_same(one, other, atol=1e-12):
    for name in ("distance", "sd", "surprise", "contact_distance"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-6, atol=atol)
    np.testing.assert_allclose(one.normal, other.normal, atol=1e-9)
    np.testing.assert_array_equal(one.knowledge, other.knowledge)


def test_a_sphere_felt_without_noise_is_known_to_a_micrometre():
    x, normal = inner_points(lift=0.4e-3)
    answer = mapped(cap(), QUIET).query(x)
    np.testing.assert_allclose(answer.distance, 0.4e-3, atol=1e-6)
    np.testing.assert_allclose(answer.normal, normal, atol=2e-4)
    np.testing.assert_allclose(answer.nearest, x - 0.4e-3 * normal, atol=2e-6)
    assert answer.observed.all()


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=5, deadline=None)
def test_adding_in_parts_is_adding_at_once_and_the_map_moves_with_the_object(seed):
    rng, cloud, x = np.random.default_rng(seed), cap(noise=2e-5), inner_points(lift=1e-4)[0]
    here, part, index = mapped(cloud).query(x), SurfaceMap(), np.arange(len(cloud))
    for i, j in itertools.pairwise([0, *np.sort(rng.integers(0, len(cloud), 4)), len(cloud)]):
        part.add(cloud.select((index >= i) & (index < j)))
    assert_same(part.query(x), here, atol=1e-10)
    R, p = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    moved = dataclasses.replace(cloud, position=cloud.position @ R.T + p, normal=cloud.normal @ R.T)
    there = mapped(moved).query(x @ R.T + p)
    assert_same(here, dataclasses.replace(there, normal=there.normal @ R), atol=1e-10)


def test_far_from_the_origin_only_rounding_is_lost():
    far, cloud, x = np.array([1e3, -2e3, 500.0]), cap(noise=2e-5), inner_points()[0]
    there = mapped(dataclasses.replace(cloud, position=cloud.position + far)).query(x + far)
    np.testing.assert_allclose(mapped(cloud).query(x).distance, there.distance, atol=1e-8)


def test_the_order_of_strokes_changes_less_than_the_uncertainty():
    cloud, x = cap(noise=2e-5), inner_points()[0]
    turned = dataclasses.replace(cloud, position=cloud.position[::-1], normal=cloud.normal[::-1])
    here, there = mapped(cloud).query(x), mapped(turned).query(x)
    np.testing.assert_allclose(here.distance, there.distance, atol=0.5 * here.sd.min())
    np.testing.assert_allclose(here.sd, there.sd, rtol=0.2)


def test_patches_blend_without_steps():
    made = mapped(cap(noise=3e-5))
    angle = np.linspace(-0.14, 0.14, 4001)
    x = CENTER + RADIUS * np.column_stack([np.sin(angle), np.full_like(angle, 0.02), np.cos(angle)])
    blend = made.blend_at(x, with_sd=True)
    assert len(made.patches) > 10
    step = RADIUS * (angle[1] - angle[0])
    # slopes of a twentieth, curvatures of 1 / (10 mm)
    for values, slope in ((blend.distance, 0.05), (blend.sd, 0.05), (blend.normal, 100.0)):
        assert np.abs(np.diff(values, axis=0)).max() < slope * step


def test_either_side_of_the_surface_is_as_uncertain():
    made = mapped(cap(noise=2e-5))
    above, below = (made.query(inner_points(lift=h)[0]) for h in (2e-4, -2e-4))
    np.testing.assert_allclose(above.sd, below.sd, rtol=1e-3)
    assert (above.distance > 0.0).all()
    assert (below.distance < 0.0).all()


def test_repeated_contacts_add_no_information():
    x, row = np.zeros((1, 3)), np.column_stack([np.arange(-5e-3, 5e-3, 4e-5), np.zeros(250)])
    once, resting, one = (
        mapped(plane_cloud(xy)).query(x).sd[0] for xy in (row, np.zeros((500, 2)), np.zeros((1, 2)))
    )
    assert once < one == pytest.approx(resting)


def test_more_noise_stated_for_some_contacts_makes_the_map_trust_the_others():
    low, high = plane_cloud(raster(0.004)), plane_cloud(raster(0.004), z=1e-4)
    trusted = dataclasses.replace(low, noise=np.full(len(low), 1e-5), tilt=np.full(len(low), 1e-2))
    doubted = dataclasses.replace(high, noise=np.full(len(high), 1e-4), tilt=np.full(len(high), 1e-2))
    made = mapped(trusted)
    made.add(dataclasses.replace(doubted, time=doubted.time + 10.0))
    # the mean of two independent measurements, weighted by 1 / variance
    assert made.query(np.zeros((1, 3))).distance[0] == pytest.approx(-1e-4 * 1e-10 / (1e-10 + 1e-8), abs=2e-6)


def test_standard_deviations_are_those_across_the_surface():
    n = np.array([[0.0, 0.0, 1.0]])
    found = standard_deviations(n, np.diag([9.0, 9.0, 4.0])[None], np.diag([0.01, 0.03, 5.0])[None])
    np.testing.assert_allclose(np.hstack(found), [2.0, np.sqrt(0.02)])
    cloud = dataclasses.replace(plane_cloud(np.zeros((3, 2))), noise=np.array([1.0, 2.0, 3.0]))
    np.testing.assert_array_equal(cloud.select(np.array([True, False, True])).noise, [1.0, 3.0])


@pytest.mark.slow
def test_a_hidden_bump_in_a_hole_is_never_claimed():
    xy = raster(0.012, 1e-3, 4e-5)
    made = mapped(plane_cloud(xy[np.hypot(*xy.T) > 4e-3]), MapSettings.for_rows(1e-3))
    made.relearn()
    grid = np.stack(np.meshgrid(*[np.linspace(-0.011, 0.011, 100)] * 2), axis=-1).reshape(-1, 2)
    r = np.hypot(*grid.T)
    bump = 1e-3 * (1.0 - np.minimum(r / 4e-3, 1.0) ** 2) ** 2
    answer = made.query(np.column_stack([grid, bump]))
    assert (np.abs(answer.distance) > answer.band() + 1e-6).any()  # the map contradicts the bump
    flat = made.query(np.column_stack([grid, np.zeros_like(r)]))
    assert (flat.knowledge[r < 2.4e-3] == Knowledge.UNOBSERVED).all()
    assert (flat.knowledge[r < 3.6e-3] != Knowledge.OBSERVED).all()
    assert flat.observed[r > 4.8e-3].all()
    # the rim of the hole is claimed for a fifth of a millimetre, where the bump is 0.011 mm high
    assert bump[flat.observed].max() < 0.02e-3


def test_one_contact_is_a_tangent_plane_that_is_not_claimed():
    made = mapped(plane_cloud(np.zeros((1, 2))))
    near = made.query([[0.5e-3, 0.0, 1e-4], [0.0, 3e-3, 0.0]])
    assert near.distance[0] == pytest.approx(1e-4, abs=1e-9)
    assert near.knowledge.tolist() == [Knowledge.EXTRAPOLATED, Knowledge.UNOBSERVED]
    assert near.sd[0] > SurfaceModel().noise * 0.99
    assert near.sd[1] > 3.0 * near.sd[0] > 0.0


def test_nothing_is_known_of_nothing():
    answer = SurfaceMap().query(np.zeros((2, 3)))
    assert np.isnan(answer.distance).all()
    assert (answer.knowledge == Knowledge.UNOBSERVED).all()
    assert len(SurfaceMap().query(np.zeros((0, 3)))) == 0
    far = mapped(cap()).query(np.full((1, 3), 5.0))
    assert far.knowledge[0] == Knowledge.UNOBSERVED


def test_along_one_row_only_the_row_is_observed():
    row = plane_cloud(np.column_stack([np.arange(-5e-3, 5e-3, 4e-5), np.zeros(250)]))
    aside = np.array([0.0, 1e-3, 1.4e-3, 1.7e-3])
    answer = mapped(row).query(np.column_stack([np.zeros(4), aside, np.zeros(4)]))
    assert answer.knowledge.tolist() == [0, 1, 1, 2]
    assert (np.diff(answer.sd) > 0.0).all()
    np.testing.assert_allclose(answer.distance, 0.0, atol=1e-9)


def test_two_sheets_two_millimetres_apart_stay_apart():
    top, bottom = plane_cloud(raster(0.005), 0.0), plane_cloud(raster(0.005), -2e-3, up=-1.0)
    made = mapped(joined(top, bottom))
    z = np.array([0.3e-3, -0.4e-3, -1.6e-3, -2.3e-3])
    answer = made.query(np.column_stack([np.zeros((4, 2)), z]))
    np.testing.assert_allclose(answer.distance, [0.3e-3, -0.4e-3, -0.4e-3, 0.3e-3], atol=1e-8)
    np.testing.assert_allclose(answer.normal[:, 2], [1.0, 1.0, -1.0, -1.0], atol=1e-6)


def test_contacts_that_contradict_each_other_widen_the_band():
    xy, x = raster(0.005, 1e-3), np.zeros((1, 3))
    flat = plane_cloud(xy)
    sign = np.where(np.arange(len(xy)) // 100 % 2, 1.0, -1.0)
    normal = np.column_stack([0.3 * sign, np.zeros(len(xy)), np.full(len(xy), np.sqrt(1.0 - 0.09))])
    for torn in (joined(flat, plane_cloud(xy, z=5e-4)), dataclasses.replace(flat, normal=normal)):
        confused = mapped(torn).query(x)
        assert confused.surprise[0] > 4.0
        assert confused.sd[0] > 2.0 * mapped(flat).query(x).sd[0]


def test_a_sharp_edge_keeps_its_faces():
    xy = raster(0.004)
    xy = xy[xy[:, 0] < 0.0]
    side = np.column_stack([np.zeros(len(xy)), xy[:, 1], xy[:, 0]])
    made = mapped(joined(plane_cloud(xy), cloud_of(side, np.tile([1.0, 0.0, 0.0], (len(xy), 1)))))
    inside = made.query(
        [[-0.5e-3, 0.0, -0.2e-3], [-0.2e-3, 0.0, -0.5e-3], [-1e-3, 0.0, 0.3e-3], [0.3e-3, 0.0, -1e-3]]
    )
    np.testing.assert_allclose(inside.distance, [-0.2e-3, -0.2e-3, 0.3e-3, 0.3e-3], atol=1e-7)


@pytest.mark.slow
def test_learning_finds_noise_and_length_from_a_guess_twice_off():
    """Ornstein-Uhlenbeck noise along rows of a plane; both guesses end within a fifth of the truth."""
    rng, xy = np.random.default_rng(0), raster(0.015, 1e-3, 4e-5)
    rows = np.split(np.arange(len(xy)), np.unique(xy[:, 1]).size)
    way = 4e-5 * np.arange(len(rows[0]))
    noise = np.concatenate([correlated(way, 1e-3, 1.0, rng) for _ in rows]) * [8e-3, 8e-3, 3e-5]
    normal = np.column_stack([noise[:, :2], np.ones(len(xy))])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    felt = cloud_of(np.column_stack([xy, noise[:, 2]]), normal)
    for guess in (0.5e-3, 2e-3):
        made = SurfaceMap.learned(felt, MapSettings(model=SurfaceModel(noise_length=guess)))
        assert made.model.noise == pytest.approx(3e-5, rel=0.2)
        assert made.model.noise_length == pytest.approx(1e-3, rel=0.35)
        answer = made.query(np.column_stack([rng.uniform(-0.014, 0.014, (500, 2)), np.zeros(500)]))
        assert (np.abs(answer.distance) <= answer.band()).mean() >= 0.9


@pytest.mark.slow
def test_held_parameters_stay():
    made = mapped(cap(noise=2e-5))
    made.relearn(held=tuple(Parameter))
    assert made.model == SurfaceModel()
    made.relearn(held=(Parameter.NOISE_LENGTH,))
    assert made.model.noise_length == SurfaceModel().noise_length
    assert made.model.noise != SurfaceModel().noise


def test_settings_for_wide_rows_observe_between_them():
    felt = plane_cloud(raster(0.015, 5e-3))
    between = np.array([[0.0, 2.5e-3, 0.0]])
    assert mapped(felt).query(between).knowledge[0] == Knowledge.UNOBSERVED
    assert mapped(felt, MapSettings.for_rows(5e-3)).query(between).observed[0]
