"""How far a map may be off: its evidence, outliers, rows that predict one another, facets between rows.

Rows that predict one another measure the errors of a map, whatever noise it assumes.
"""

import dataclasses
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from surface_shapes import SHAPES, STEP, Noise, Shape, along_path, felt, torus

from mapping.felt_shapes import correlated
from mapping.raster import CENTER, RADIUS, cap_normals, cloud_of, mapped, raster, share_in_band, sphere_cap
from palpate.estimation import Assumption
from palpate.mapping import MapSettings, SurfaceMap, SurfaceModel
from palpate.mapping.surface_map import Agreement
from palpate.mapping.surface_map.agreement import LARGEST, SMALLEST, row_starts
from palpate.mapping.surface_map.learn import Parameter, at_bounds, evidence_gradient
from palpate.mapping.surface_map.model import BENDS
from palpate.mapping.surface_map.patch import PatchData
from palpate.mapping.surface_map.spikes import LONGEST_RUN, NEIGHBOURS

seeds = st.integers(0, 2**32 - 1)
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


def spoiled(cloud, bad, size):
    """A cloud in which some contacts are off by `size` along the normal."""
    position = cloud.position.copy()
    position[bad] += size * cloud.normal[bad]
    return dataclasses.replace(cloud, position=position)


def scattered(cloud, share, seed):
    """A cloud in which a share of the contacts is a millimetre off to either side, and their indices."""
    rng = np.random.default_rng(seed)
    bad = rng.choice(len(cloud), round(share * len(cloud)), replace=False)
    return spoiled(cloud, bad, 1e-3 * rng.choice([-1.0, 1.0], len(bad))[:, None]), np.sort(bad)


# --- evidence ---


@given(seeds, st.sampled_from(BENDS))
@settings(max_examples=10, deadline=None)
def test_the_gradient_of_the_evidence_is_that_of_differences(seed, bend):
    made = mapped(noisy(sphere_cap(half=0.006), seed))
    middle = int(np.argmin([np.linalg.norm(each.frame.center - CENTER) for each in made.patches]))
    data = PatchData.over(made.patches[middle].frame, made.stretches)
    at = SurfaceModel().logarithms + np.random.default_rng(seed).normal(0.0, 0.7, 6)

    def evidence(logarithms):
        return evidence_gradient(data, SurfaceModel(*np.exp(logarithms).tolist()), bend)

    found = evidence(at)[1]
    steps = 1e-4 * np.eye(6)[: len(Parameter)]
    differences = [(evidence(at + step)[0] - evidence(at - step)[0]) / 2e-4 for step in steps]
    np.testing.assert_allclose(found, differences, rtol=1e-4, atol=1e-3 * np.abs(found).max())


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_gentle_wave_has_a_length_that_is_no_limit_of_the_search(seed):
    """The evidence once rose without end towards short lengths, since the vague plane shrank with them."""
    made = SurfaceMap.learned(noisy(cloud_of(*wave(*raster(0.012, 1e-3, 4e-5).T)), seed))
    assert made.verdict.ok
    assert 1e-3 < made.model.length < 0.2
    points = wave(*np.random.default_rng(seed).uniform(-0.011, 0.011, (2, 800)))[0]
    assert share_in_band(made.query(points)) > 0.88


def test_a_number_at_the_limit_of_the_search_is_named():
    start = SurfaceModel()
    assert not at_bounds(start, start)
    (broken,) = at_bounds(dataclasses.replace(start, length=1e3 * start.length), start)
    assert broken.assumption is Assumption.WITHIN_BOUNDS
    assert "length" in broken.finding


@pytest.mark.slow
@given(seeds, st.sampled_from([1.0, 1e3]))
@settings(max_examples=4, deadline=None)
def test_the_map_depends_on_neither_unit_nor_origin(seed, unit):
    cloud, base = noisy(sphere_cap(half=0.008, row=1.3e-3, step=0.7e-4), seed), MapSettings()
    shift, model = np.array([1.0, 0.0, 0.0]), base.model
    scaled = {name: unit * getattr(model, name) for name in LENGTHS} | {"curvature": model.curvature / unit}
    spans = {name: unit * getattr(base, name) for name in SPANS}
    other = dataclasses.replace(base, model=SurfaceModel(**scaled, tilt=model.tilt), **spans)
    here = SurfaceMap.learned(cloud, base)
    there = SurfaceMap.learned(dataclasses.replace(cloud, position=unit * (cloud.position + shift)), other)
    points = cloud.position[::40] + 1e-4 * cloud.normal[::40]
    a, b = here.query(points), there.query(unit * (points + shift))
    np.testing.assert_allclose(unit * a.distance, b.distance, rtol=0.0, atol=unit * 1e-6 * NOISE)
    np.testing.assert_allclose(unit * a.band(), b.band(), rtol=1e-6)
    np.testing.assert_array_equal(a.knowledge, b.knowledge)


# --- outliers ---


@pytest.mark.parametrize("seed", [0, 1])
def test_one_in_a_hundred_contacts_a_millimetre_off_costs_nothing_and_is_named(seed):
    clean = noisy(sphere_cap(half=0.008, row=1e-3), seed)
    torn, bad = scattered(clean, 0.01, seed)
    one, other = SurfaceMap.learned(clean), SurfaceMap.learned(torn)
    points = CENTER + RADIUS * cap_normals(np.random.default_rng(5).uniform(-0.006, 0.006, (400, 2)))
    errors = [np.linalg.norm(made.query(points).distance) for made in (one, other)]
    assert errors[1] < 1.1 * errors[0]
    assert one.verdict.ok
    assert other.verdict.breaks(Assumption.NO_OUTLIERS)
    np.testing.assert_array_equal(other.outliers, torn.position[bad])
    assert f"{len(bad)} of {len(torn)}" in other.verdict.lines()[0]


def test_outliers_are_the_same_however_contacts_come():
    torn, bad = scattered(noisy(sphere_cap(half=0.006), 3), 0.02, 3)
    whole, parts, batch = mapped(torn), SurfaceMap(), np.arange(len(torn)) // 50
    for i in range(batch[-1] + 1):
        # at the end of a batch the last stretch is still open, and its contacts are judged again
        parts.add(torn.select(batch == i))
    np.testing.assert_array_equal(parts.outliers, whole.outliers)
    assert len(whole.outliers) == len(bad)
    assert len(parts) == len(whole)


@given(seeds, st.integers(2, LONGEST_RUN), st.sampled_from([-1e-3, 2e-4, 1e-3]))
@settings(max_examples=30, deadline=None)
def test_contacts_that_are_off_together_are_outliers_too(seed, count, size):
    first = int(np.random.default_rng(seed).integers(20, 250))  # in the first row
    bad = np.arange(first, first + count)
    torn = spoiled(noisy(sphere_cap(half=0.006, step=0.4e-4), seed % 7), bad, size)
    made = mapped(torn)
    np.testing.assert_array_equal(made.outliers, torn.position[bad])
    assert made.verdict.breaks(Assumption.NO_OUTLIERS)


def test_an_edge_a_step_and_taps_are_no_outliers():
    xy = raster(0.004, 1e-3)
    corner = np.column_stack([xy, -np.abs(xy[:, 0])])
    slant = np.column_stack([np.sign(xy[:, 0] + 1e-9), np.zeros(len(xy)), np.ones(len(xy))]) / np.sqrt(2.0)
    step = np.column_stack([xy, 1e-3 * (xy[:, 0] > 0.0)])
    flat = np.tile([0.0, 0.0, 1.0], (len(xy), 1))
    taps = np.random.default_rng(0).normal(0.0, 2e-3, (60, 3))
    for position, normal in ((corner, slant), (step, flat), (taps, flat[:60])):
        assert not len(mapped(cloud_of(position, normal)).outliers)
    assert len(NEIGHBOURS) == 4


# --- rows that predict one another ---

BUMPS = dataclasses.replace(
    next(each for each in SHAPES if each.name == "bumps"), u=(0.0, 0.02), v=(0.0, 0.02)
)  # a ninth of the waves of the benchmark


def assuming(cloud, **changes):
    """A map with a changed model of the noise."""
    model = SurfaceModel(curvature=20.0, length=20e-3)
    return mapped(cloud, MapSettings(model=dataclasses.replace(model, **changes)))


def bumps(seed):
    """Contacts with noise, and points of the surface, whose distance is 0."""
    rng = np.random.default_rng(seed)
    cloud = felt(*BUMPS.surface(*BUMPS.rows(1e-3)), Noise(), rng)
    return cloud, BUMPS.surface(rng.uniform(0.001, 0.019, 500), rng.uniform(0.001, 0.019, 500))[0]


@pytest.mark.slow
@pytest.mark.parametrize("length", [0.5e-3, 2e-3])
def test_a_length_that_is_twice_off_leaves_the_band_honest(length):
    inside, claimed = [], []
    for seed in range(3):
        cloud, points = bumps(seed)
        made = assuming(cloud, noise_length=length)
        answer = made.query(points)
        inside.append((np.abs(answer.distance) <= answer.band()).mean())
        claimed.append(made.agreement.factor)
    # three quarters of a millimetre of doubt either way, seen as such
    assert (min(claimed) > 1.05) if length < 1e-3 else (max(claimed) < 0.95)
    assert 0.90 <= np.mean(inside) <= 0.99


def test_noise_assumed_twice_too_large_is_found_out():
    cloud, points = bumps(0)
    right, doubtful = assuming(cloud), assuming(cloud, noise=6e-5, tilt=2.0 * SurfaceModel().tilt)
    assert doubtful.agreement.factor == pytest.approx(0.5 * right.agreement.factor, rel=0.15)
    # a wrong model weighs contacts otherwise, but claims about the same
    ratio = np.median(doubtful.query(points).sd) / np.median(right.query(points).sd)
    assert ratio == pytest.approx(1.0, rel=0.25)


def test_agreement_grows_while_exploring_and_a_single_row_has_none():
    cloud, _ = bumps(1)
    index = np.arange(len(cloud))
    assert assuming(cloud.select(index < 300)).agreement == Agreement()
    assert Agreement().factor == 1.0
    made = assuming(cloud.select(index < len(cloud) // 2), noise_length=0.5e-3)
    first = made.agreement
    made.add(cloud.select(index >= len(cloud) // 2))
    assert len(made.agreement.near) > len(first.near) > 10
    whole = assuming(cloud, noise_length=0.5e-3).agreement
    assert len(made.agreement.near) == len(whole.near)
    assert sum(made.agreement.near) == pytest.approx(sum(whole.near), rel=1e-6)


def coarse(seed=0, rows=6e-3, **changes):
    """A map of a gently curved torus in rows far apart, with its true noise, and points of the torus."""
    errors, rng = Noise(noise=3e-6, tilt=2e-3), np.random.default_rng(seed)
    shape = Shape("torus", torus(0.06, 0.025), (0.0, 1.2), (-1.0, 1.0))
    cloud = felt(*shape.surface(*shape.rows(rows)), errors, rng)
    model = SurfaceModel(length=0.1, curvature=20.0, noise=errors.noise, tilt=errors.tilt)
    made = mapped(cloud, MapSettings.for_rows(rows, model=dataclasses.replace(model, **changes)))
    return made, shape.samples(400, rng)[0]


@pytest.mark.slow
def test_rows_too_far_apart_to_measure_their_noise_do_not_narrow_the_band():
    """A calm surface is bridged better than its prior allows, which does not measure the errors of rows."""
    inside = []
    for seed in range(3):
        made, points = coarse(seed)
        assert not made.agreement.near
        assert len(made.agreement.far) > 10
        assert made.agreement.factor >= 1.0
        inside.append(share_in_band(made.query(points)))
    assert np.mean(inside) >= 0.90
    rough = coarse(curvature=0.3)[0].agreement  # rougher than the model assumes
    assert np.mean(rough.far) > 2.0
    assert rough.factor > 1.3


@given(st.lists(st.tuples(st.integers(1, 500), st.floats(0.0, 9.0)), min_size=1, max_size=6))
def test_pooling_lies_between_its_parts_and_one(parts):
    pooled = Agreement.pooled([Agreement(near=(mean,) * rows) for rows, mean in parts])
    means = [1.0, *(mean for _, mean in parts)]
    lowest, highest = (min(max(each**0.5, SMALLEST), LARGEST) for each in (min(means), max(means)))
    assert lowest - 1e-12 <= pooled.factor <= highest + 1e-12
    # beside them, small misses over wide gaps change nothing but the weight of the model
    bridged = Agreement.pooled([pooled, Agreement(far=(0.2,) * 50)])
    assert abs(bridged.factor - 1.0) <= abs(pooled.factor - 1.0) + 1e-12


def test_a_few_edges_hardly_widen_the_band_and_a_model_that_is_wrong_everywhere_does():
    fits = np.square(np.random.default_rng(0).normal(size=200))
    # a tenth of them, each counted for three deviations: (0.9 + 0.1 x 9)^0.5
    assert Agreement(near=(*fits[20:], *[1e4] * 20)).factor < 1.5
    assert Agreement(near=tuple(25.0 * fits)).factor == pytest.approx(5.0, rel=0.12)
    torn = Agreement(near=(*(25.0 * fits[20:]), *[1e6] * 20))
    assert torn.factor == pytest.approx(5.0 * 1.8**0.5, rel=0.15) or torn.factor == LARGEST


def test_rows_begin_where_the_path_has_gaps():
    path = np.concatenate([np.arange(5) * 1e-3, 0.05 + np.arange(4) * 1e-3, 0.1 + np.arange(3) * 1e-3])
    assert [row_starts(path[:n]) for n in (12, 5, 0)] == [[5, 9], [], []]


# --- facets, as of a mesh file: a ball slides over the long sides of a polygonal prism ---

CORNER, TIP = 0.025, 0.008  # radii of the polygon's corners and of the ball [m]
HALF_LENGTH, HALF_DEPTH = 0.010, 0.0075  # along the rows, across them [m]
ROWS = 2e-3


def touched(y, sides, turned):
    """Points and normals (y, z), both (n, 2), where a ball whose centre is at y (n,) touches the prism."""
    step = 2.0 * math.pi / sides
    corner = turned + step * np.arange(-sides // 4, sides // 4 + 1)
    face = corner[:-1] + 0.5 * step
    at = CORNER * np.column_stack([np.sin(corner), np.cos(corner)])
    # over a face the centre stays between its ends, moved out; beyond them the ball rolls over a corner
    begins, ends = (at[i : len(at) - 1 + i, 0] + TIP * np.sin(face) for i in (0, 1))
    i = np.searchsorted(begins, y) - 1
    over = y <= ends[i]
    angle = np.where(over, face[i], np.arcsin(np.clip((y - at[i + 1, 0]) / TIP, -1.0, 1.0)))
    share = (y - begins[i]) / (ends[i] - begins[i])
    point = np.where(over[:, None], at[i] + share[:, None] * (at[i + 1] - at[i]), at[i + 1])
    return point, np.column_stack([np.sin(angle), np.cos(angle)])


def prism(sides, turned, seed):
    """Contacts along rows of the prism, with the noise of a simulated sensor and 0.1 degrees of tilt."""
    x = np.arange(-HALF_LENGTH, HALF_LENGTH, STEP)
    points, normals = [], []
    for row, y in enumerate(np.arange(-HALF_DEPTH, HALF_DEPTH + 0.5 * ROWS, ROWS)):
        point, normal = touched(np.full_like(x, y), sides, turned)
        points.append(np.column_stack([x[:: (-1) ** row], point]))
        normals.append(np.column_stack([np.zeros_like(x), normal]))
    errors = Noise(noise=1e-6, tilt=2e-3)
    return felt(np.concatenate(points), np.concatenate(normals), errors, np.random.default_rng(seed))


@pytest.mark.slow
@pytest.mark.parametrize(("sides", "turned", "seed"), [(64, 0.0, 0), (64, 0.4, 1), (96, 0.4, 0)])
def test_between_rows_over_facets_the_band_holds_the_facets(sides, turned, seed):
    step, half = 2.0 * math.pi / sides, HALF_DEPTH * CORNER / (CORNER + TIP)
    turned *= step
    made = SurfaceMap.learned(prism(sides, turned, seed), MapSettings.for_rows(ROWS, bias=2e-6))
    x, y = np.random.default_rng(1).uniform(-1.0, 1.0, (2, 600)) * [[HALF_LENGTH], [half]]
    face = turned + step * (np.arange(-sides // 4, sides // 4) + 0.5)
    z = ((CORNER * math.cos(0.5 * step) - y[:, None] * np.sin(face)) / np.cos(face)).min(axis=1)
    answer = made.query(np.column_stack([x, y, z]))
    assert answer.observed.mean() > 0.85
    assert share_in_band(answer) >= 0.90
    # normals that a smooth surface cannot have are not attributed to a noisy finger that heights follow
    assert made.facet_height > 1e-6


def test_facets_are_as_deep_as_rows_are_apart_and_normals_off():
    wide, narrow = (
        SurfaceMap(MapSettings.for_rows(rows, model=SurfaceModel(tilt_length=1.0))).facet_height
        for rows in (2e-3, 1.4e-3)
    )
    assert wide == pytest.approx(narrow * 2.0 / 1.4, rel=1e-6)
    # ridges of a curve with slopes from -a to a: RMS of its depth by quadrature
    a, x = SurfaceModel().tilt * 3.0**0.5, np.linspace(-1.0, 1.0, 2001)
    depth = 2e-3 * a / 4.0 * (1.0 - x**2)
    # half as much more: that of a sine of three rows
    assert wide == pytest.approx(1.5 * np.sqrt(np.mean(depth**2)), rel=0.03)
    # noise that does not keep along rows is no facet
    assert SurfaceMap(MapSettings(model=SurfaceModel())).facet_height < 0.01 * SurfaceModel().noise


# --- the benchmark that measures all this ---


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.name)
def test_shapes_of_the_benchmark_have_normals_across_and_contacts_a_step_apart(shape):
    points, normals = shape.surface(*shape.rows(4e-3))
    cloud = felt(points, normals, Noise(noise=0.0, tilt=0.0), np.random.default_rng(0))
    np.testing.assert_allclose(cloud.position, points)
    np.testing.assert_allclose(cloud.normal, normals, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    steps = np.diff(points, axis=0)
    length = np.linalg.norm(steps, axis=1)
    along = length < 1.5 * STEP
    assert along.mean() > 0.99
    assert np.median(length) == pytest.approx(STEP, rel=0.01)
    assert np.abs((steps * normals[:-1]).sum(axis=1)[along]).max() < 0.02 * STEP


def test_noise_of_the_benchmark_keeps_along_the_path():
    noise = along_path(np.full(200_000, STEP), 1e-3, np.random.default_rng(0))
    lag = round(1e-3 / STEP)
    assert noise.std() == pytest.approx(1.0, rel=0.03)
    assert (noise[lag:] * noise[:-lag]).mean() == pytest.approx(np.exp(-1.0), abs=0.04)


@pytest.mark.slow
def test_the_quick_benchmark_runs_to_its_end(tmp_path):
    program, picture = Path(__file__).resolve().parents[2] / "benchmarks/surface_maps.py", tmp_path / "map.png"
    command = [sys.executable, str(program), "cost", "--quick", "--picture", str(picture)]
    said = subprocess.run(command, check=True, capture_output=True, text=True, timeout=600).stdout
    assert "100 more ms" in said
    assert picture.read_bytes().startswith(b"\x89PNG")
