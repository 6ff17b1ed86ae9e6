"""Rows that predict one another tell how large the errors of a map are, whatever it believes of the noise."""

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.mapping import MapSettings, SurfaceMap, SurfaceModel
from palpate.mapping.surface_map import Agreement
from palpate.mapping.surface_map.agreement import LARGEST, PRIOR_ROWS, SMALLEST, row_starts

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))

from surface_shapes import SHAPES, Noise, Shape, felt, torus

MODEL = SurfaceModel(curvature=20.0, length=20e-3)


def bumps(seed, errors=None):
    """A ninth of the waves of the benchmark: what was felt, and points of it with their distance 0."""
    rng = np.random.default_rng(seed)
    shape = next(each for each in SHAPES if each.name == "bumps")
    part = dataclasses.replace(shape, u=(0.0, 0.02), v=(0.0, 0.02))
    cloud = felt(*part.surface(*part.rows(1e-3)), errors or Noise(), rng)
    return cloud, part.surface(rng.uniform(0.001, 0.019, 500), rng.uniform(0.001, 0.019, 500))[0]


def mapped(cloud, **changes):
    made = SurfaceMap(MapSettings(model=dataclasses.replace(MODEL, **changes)))
    made.add(cloud)
    return made


@pytest.mark.slow
@pytest.mark.parametrize("length", [0.5e-3, 2e-3])
def test_a_length_that_is_twice_off_leaves_the_band_honest(length):
    inside, claimed = [], []
    for seed in range(3):
        cloud, points = bumps(seed)
        made = mapped(cloud, noise_length=length)
        answer = made.query(points)
        inside.append((np.abs(answer.distance) <= answer.band()).mean())
        claimed.append(made.agreement.factor)
    # three quarters of a millimetre of doubt either way, seen as such
    assert (min(claimed) > 1.05) if length < 1e-3 else (max(claimed) < 0.95)
    assert 0.90 <= np.mean(inside) <= 0.99


def test_noise_believed_twice_too_large_is_found_out():
    cloud, points = bumps(0)
    right, doubtful = mapped(cloud), mapped(cloud, noise=6e-5, tilt=2.0 * SurfaceModel().tilt)
    assert doubtful.agreement.factor == pytest.approx(0.5 * right.agreement.factor, rel=0.15)
    # wrong beliefs weigh what was felt otherwise, but claim about the same
    ratio = np.median(doubtful.query(points).sd) / np.median(right.query(points).sd)
    assert ratio == pytest.approx(1.0, rel=0.25)


def test_it_is_found_out_while_exploring_too():
    cloud, _ = bumps(1)
    half = np.arange(len(cloud)) < len(cloud) // 2
    made = mapped(cloud.select(half), noise_length=0.5e-3)
    first = made.agreement
    made.add(cloud.select(~half))
    assert len(made.agreement.near) > len(first.near) > 10
    whole = mapped(cloud, noise_length=0.5e-3).agreement
    assert len(made.agreement.near) == len(whole.near)
    assert sum(made.agreement.near) == pytest.approx(sum(whole.near), rel=1e-6)


def test_one_row_agrees_with_nobody():
    cloud, _ = bumps(0)
    made = mapped(cloud.select(np.arange(len(cloud)) < 300))
    assert made.agreement == Agreement()
    assert made.agreement.factor == 1.0


def coarse(errors, seed=0, rows=6e-3, **changes):
    """A gently curved torus in rows far apart, with its noise believed as it is: the map, and truth to ask it."""
    rng = np.random.default_rng(seed)
    shape = Shape("torus", torus(0.06, 0.025), (0.0, 1.2), (-1.0, 1.0))
    cloud = felt(*shape.surface(*shape.rows(rows)), errors, rng)
    model = SurfaceModel(length=0.1, curvature=20.0, noise=errors.noise, tilt=errors.tilt)
    made = SurfaceMap(MapSettings.for_rows(rows, model=dataclasses.replace(model, **changes)))
    made.add(cloud)
    return made, shape.samples(400, rng)[0]


@pytest.mark.slow
def test_rows_too_far_apart_to_tell_of_their_noise_do_not_narrow_the_band():
    """A calm surface is bridged better than its prior fears, which says nothing of how far rows are off."""
    inside = []
    for seed in range(3):
        made, points = coarse(Noise(noise=3e-6, tilt=2e-3), seed)
        assert not made.agreement.near
        assert len(made.agreement.far) > 10
        assert made.agreement.factor >= 1.0
        answer = made.query(points)
        inside.append((np.abs(answer.distance) <= answer.band())[answer.observed].mean())
    assert np.mean(inside) >= 0.90


@pytest.mark.slow
def test_a_surface_rougher_than_believed_between_far_rows_widens_the_band():
    made, _ = coarse(Noise(noise=3e-6, tilt=2e-3), curvature=0.3)
    assert np.mean(made.agreement.far) > 2.0
    assert made.agreement.factor > 1.3


@given(st.lists(st.tuples(st.integers(1, 500), st.floats(0.0, 9.0)), min_size=1, max_size=6))
def test_pooling_lies_between_its_parts_and_one(parts):
    pooled = Agreement.pooled([Agreement(near=(mean,) * rows) for rows, mean in parts])
    means = [1.0, *(mean for _, mean in parts)]
    lowest, highest = (min(max(each**0.5, SMALLEST), LARGEST) for each in (min(means), max(means)))
    assert lowest - 1e-12 <= pooled.factor <= highest + 1e-12
    # beside them, small misses over wide gaps change nothing but the weight of what the model says
    bridged = Agreement.pooled([pooled, Agreement(far=(0.2,) * 50)])
    assert abs(bridged.factor - 1.0) <= abs(pooled.factor - 1.0) + 1e-12


def test_a_few_edges_hardly_widen_the_band_and_a_model_that_is_wrong_everywhere_does():
    rng = np.random.default_rng(0)
    fits = np.square(rng.normal(size=200))
    edges = Agreement(near=(*fits[20:], *[1e4] * 20))
    assert edges.factor < 1.5  # a tenth of them, each counted for three deviations: (0.9 + 0.1 x 9)^0.5
    assert Agreement(near=tuple(25.0 * fits)).factor == pytest.approx(5.0, rel=0.12)
    torn = Agreement(near=(*(25.0 * fits[20:]), *[1e6] * 20))
    assert torn.factor == pytest.approx(5.0 * 1.8**0.5, rel=0.15) or torn.factor == LARGEST


def test_rows_begin_where_the_path_has_gaps():
    path = np.concatenate([np.arange(5) * 1e-3, 0.05 + np.arange(4) * 1e-3, 0.1 + np.arange(3) * 1e-3])
    assert row_starts(path) == [5, 9]
    assert row_starts(path[:5]) == []
    assert row_starts(path[:0]) == []
    assert PRIOR_ROWS > 0.0
