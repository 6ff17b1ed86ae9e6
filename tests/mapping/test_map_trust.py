"""A map says when its model does not hold, and does not depend on units, origin, or single bad contacts."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.felt_shapes import correlated
from mapping.raster import CENTER, RADIUS, cloud_of, raster, sphere_cap
from palpate.estimation import Assumption
from palpate.mapping import MapSettings, SurfaceMap, SurfaceModel
from palpate.mapping.surface_map.learn import Parameter, at_bounds, evidence_gradient
from palpate.mapping.surface_map.model import BENDS
from palpate.mapping.surface_map.patch import PatchData
from palpate.mapping.surface_map.spikes import LONGEST_RUN, NEIGHBOURS

NOISE, TILT, KEPT = 3e-5, np.radians(0.5), 1e-3
LENGTHS = ("length", "noise", "noise_length", "tilt_length", "plane")
SPANS = ("bias", "stretch", "reach", "patch_spacing", "patch_reach", "patch_data")


def noisy(cloud, seed):
    """A cloud with noise as maps assume it."""
    rng = np.random.default_rng(seed)
    arc = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(cloud.position, axis=0), axis=1)))
    normal = cloud.normal + np.cross(correlated(arc, KEPT, TILT, rng), cloud.normal)
    return dataclasses.replace(
        cloud,
        position=cloud.position + correlated(arc, KEPT, NOISE, rng),
        normal=normal / np.linalg.norm(normal, axis=1, keepdims=True),
    )


def wave(x, y):
    """Heights and normals of a gentle wave: 1 mm high, radii of 0.4 m and more."""
    zx = 1e-3 / 20e-3 * np.cos(x / 20e-3) * np.cos(y / 30e-3)
    zy = -1e-3 / 30e-3 * np.sin(x / 20e-3) * np.sin(y / 30e-3)
    normal = np.column_stack([-zx, -zy, np.ones_like(x)])
    z = 1e-3 * np.sin(x / 20e-3) * np.cos(y / 30e-3)
    return np.column_stack([x, y, z]), normal / np.linalg.norm(normal, axis=1, keepdims=True)


def spoiled(cloud, share, seed, size=1e-3):
    """A cloud in which some contacts are off by `size` along the normal; and which."""
    rng = np.random.default_rng(seed)
    bad = rng.choice(len(cloud), round(share * len(cloud)), replace=False)
    position = cloud.position.copy()
    position[bad] += size * rng.choice([-1.0, 1.0], len(bad))[:, None] * cloud.normal[bad]
    return dataclasses.replace(cloud, position=position), bad


def rms(made, seed=5):
    xy = np.random.default_rng(seed).uniform(-0.006, 0.006, (400, 2))
    normal = np.column_stack([xy, np.sqrt(RADIUS**2 - (xy**2).sum(axis=1))]) / RADIUS
    return float(np.sqrt(np.mean(np.square(made.query(CENTER + RADIUS * normal).distance))))


@given(st.integers(0, 2**32 - 1), st.sampled_from(BENDS))
@settings(max_examples=10, deadline=None)
def test_the_gradient_of_the_evidence_is_that_of_differences(seed, bend):
    rng = np.random.default_rng(seed)
    made = SurfaceMap()
    made.add(noisy(sphere_cap(half=0.006), seed))
    middle = int(np.argmin([np.linalg.norm(each.frame.center - CENTER) for each in made.patches]))
    data = PatchData.over(made.patches[middle].frame, made.stretches)
    model = SurfaceModel(*(np.exp(SurfaceModel().logarithms + rng.normal(0.0, 0.7, 6)).tolist()))
    step = 1e-4

    def evidence(number, change):
        values = model.logarithms
        values[number] += change
        return evidence_gradient(data, SurfaceModel(*np.exp(values).tolist()), bend)[0]

    found = evidence_gradient(data, model, bend)[1]
    differences = [(evidence(i, step) - evidence(i, -step)) / (2.0 * step) for i in range(len(Parameter))]
    np.testing.assert_allclose(found, differences, rtol=1e-4, atol=1e-3 * np.abs(found).max())


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_gentle_wave_has_a_length_that_is_no_limit_of_the_search(seed):
    """The evidence once rose without end towards short lengths, since the vague plane shrank with them."""
    made = SurfaceMap.learned(noisy(cloud_of(*wave(*raster(0.012, 1e-3, 4e-5).T)), seed))
    assert made.verdict.ok
    assert 1e-3 < made.model.length < 0.2
    points = wave(*np.random.default_rng(seed).uniform(-0.011, 0.011, (2, 800)))[0]
    found = made.query(points)
    assert (np.abs(found.distance) <= found.band())[found.observed].mean() > 0.88


def test_a_number_at_the_limit_of_the_search_is_named():
    start = SurfaceModel()
    assert not at_bounds(start, start)
    (broken,) = at_bounds(dataclasses.replace(start, length=1e3 * start.length), start)
    assert broken.assumption is Assumption.WITHIN_BOUNDS
    assert "length" in broken.finding


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.sampled_from([1.0, 1e3]))
@settings(max_examples=4, deadline=None)
def test_the_map_depends_on_neither_unit_nor_origin(seed, unit):
    cloud = noisy(sphere_cap(half=0.008, row=1.3e-3, step=0.7e-4), seed)
    shift = np.array([1.0, 0.0, 0.0])
    other = dataclasses.replace(cloud, position=unit * (cloud.position + shift))
    base = MapSettings()
    model = base.model
    scaled = {name: unit * getattr(model, name) for name in LENGTHS} | {"curvature": model.curvature / unit}
    spans = {name: unit * getattr(base, name) for name in SPANS}
    here = SurfaceMap.learned(cloud, base)
    there = SurfaceMap.learned(
        other, dataclasses.replace(base, model=SurfaceModel(**scaled, tilt=model.tilt), **spans)
    )
    points = cloud.position[::40] + 1e-4 * cloud.normal[::40]
    a, b = here.query(points), there.query(unit * (points + shift))
    np.testing.assert_allclose(unit * a.distance, b.distance, rtol=0.0, atol=unit * 1e-6 * NOISE)
    np.testing.assert_allclose(unit * a.band(), b.band(), rtol=1e-6)
    np.testing.assert_array_equal(a.knowledge, b.knowledge)


@pytest.mark.parametrize("seed", [0, 1])
def test_one_in_a_hundred_contacts_a_millimetre_off_costs_nothing_and_is_named(seed):
    clean = noisy(sphere_cap(half=0.008, row=1e-3), seed)
    torn, bad = spoiled(clean, 0.01, seed)
    one, other = SurfaceMap.learned(clean), SurfaceMap.learned(torn)
    assert rms(other) < 1.1 * rms(one)
    assert one.verdict.ok
    assert other.verdict.breaks(Assumption.NO_OUTLIERS)
    np.testing.assert_array_equal(other.outliers, torn.position[np.sort(bad)])
    assert f"{len(bad)} of {len(torn)}" in other.verdict.lines()[0]


def test_outliers_are_the_same_however_contacts_come():
    torn, bad = spoiled(noisy(sphere_cap(half=0.006), 3), 0.02, 3)
    whole, parts = SurfaceMap(), SurfaceMap()
    whole.add(torn)
    index = np.arange(len(torn))
    for i in range(0, len(torn), 50):
        # at the end of a batch the last stretch is still open, and its contacts are judged again
        parts.add(torn.select((index >= i) & (index < i + 50)))
    np.testing.assert_array_equal(parts.outliers, whole.outliers)
    assert len(whole.outliers) == len(bad)
    assert len(parts) == len(whole)


@given(st.integers(0, 2**32 - 1), st.integers(2, LONGEST_RUN), st.sampled_from([-1e-3, 2e-4, 1e-3]))
@settings(max_examples=30, deadline=None)
def test_contacts_that_are_off_together_are_outliers_too(seed, count, size):
    clean = noisy(sphere_cap(half=0.006, step=0.4e-4), seed % 7)
    first = int(np.random.default_rng(seed).integers(20, 250))  # in the first row
    bad = np.arange(first, first + count)
    position = clean.position.copy()
    position[bad] += size * clean.normal[bad]
    made = SurfaceMap()
    made.add(dataclasses.replace(clean, position=position))
    np.testing.assert_array_equal(made.outliers, position[bad])
    assert made.verdict.breaks(Assumption.NO_OUTLIERS)


def test_an_edge_a_step_and_taps_are_no_outliers():
    xy = raster(0.004, 1e-3)
    corner = np.column_stack([xy, -np.abs(xy[:, 0])])
    slant = np.column_stack([np.sign(xy[:, 0] + 1e-9), np.zeros(len(xy)), np.ones(len(xy))]) / np.sqrt(2.0)
    step = np.column_stack([xy, 1e-3 * (xy[:, 0] > 0.0)])
    flat = np.tile([0.0, 0.0, 1.0], (len(xy), 1))
    taps = np.random.default_rng(0).normal(0.0, 2e-3, (60, 3))
    for position, normal in ((corner, slant), (step, flat), (taps, flat[:60])):
        made = SurfaceMap()
        made.add(cloud_of(position, normal))
        assert not len(made.outliers)
    assert len(NEIGHBOURS) == 4
