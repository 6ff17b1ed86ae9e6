import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.errors import InvalidValueError
from palpate.mapping.compare import TouchedMap, compare
from palpate.mapping.compare_alignment import align
from palpate.mapping.compare_files import read_map, read_reference
from palpate.mapping.compare_surface import TriangleSurface

seeds = st.integers(0, 2**32 - 1)


def distances(points, corners):
    """From each point to each triangle, one pair at a time, shape (n, t)."""
    pairs = np.tile(corners, (len(points), 1, 1)), np.repeat(points, len(corners), axis=0)
    return np.linalg.norm(trimesh.triangles.closest_point(*pairs) - pairs[1], axis=1).reshape(len(points), -1)


def surface_of(mesh):
    return TriangleSurface(mesh.vertices, mesh.faces)


def ball(subdivisions=2, radius=0.02):
    return surface_of(trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius))


@pytest.mark.slow
@settings(max_examples=80, deadline=None)
@given(seed=seeds, count=st.integers(1, 60), squeeze=st.floats(-6.0, 0.0), spread=st.floats(-2.0, 1.0))
def test_the_nearest_of_any_triangles_is_found(seed, count, squeeze, spread):
    """Triangles of all sizes, slivers down to a millionth; points near and far: the tree misses none."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-3.0, 0.5, (count, 1, 1))
    shape = rng.normal(size=(count, 3, 3)) * [1.0, 10.0**squeeze, 1.0]
    corners = rng.normal(size=(count, 1, 3)) + size * shape
    surface = TriangleSurface(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    points = 10.0**spread * rng.normal(size=(20, 3))
    near = surface.nearest(points)
    np.testing.assert_allclose(np.abs(near.distance), distances(points, corners).min(axis=1), rtol=1e-6, atol=1e-9)
    # the point is as far as it is said to be, and on a triangle
    away = np.linalg.norm(points - near.point, axis=1)
    np.testing.assert_allclose(away, np.abs(near.distance), rtol=1e-6, atol=1e-9)
    assert distances(near.point, corners).min(axis=1).max() < 1e-7 * (1.0 + 10.0**spread)


@settings(max_examples=20, deadline=None)
@given(seed=seeds)
def test_the_sign_of_the_distance_gives_the_side_of_a_closed_surface(seed):
    """At sharp edges and corners of a slanted wedge too."""
    rng = np.random.default_rng(seed)
    hull = trimesh.convex.convex_hull(rng.normal(size=(6, 3)) * [3.0, 1.0, 0.3])
    surface = surface_of(hull)
    assert surface.is_watertight
    points = rng.normal(size=(200, 3)) * [3.0, 1.0, 0.3]
    height = ((points[:, None] - hull.triangles[:, 0]) * hull.face_normals).sum(axis=2).max(axis=1)
    clear = np.abs(height) > 1e-9
    assert (np.sign(surface.nearest(points).distance) == np.sign(height))[clear].all()


def test_an_open_surface_gives_no_sign():
    closed = trimesh.creation.icosphere(subdivisions=2, radius=0.02)
    open_one = TriangleSurface(closed.vertices, closed.faces[1:])
    assert not open_one.is_watertight
    assert (open_one.nearest(0.5 * closed.vertices).distance > 0.0).all()


@settings(max_examples=15, deadline=None)
@given(seed=seeds)
def test_distances_move_and_scale_with_both(seed):
    rng = np.random.default_rng(seed)
    turn, shift, scale = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3), 10.0 ** rng.uniform(-2, 2)
    one, points = trimesh.creation.icosphere(subdivisions=2), rng.normal(size=(50, 3))
    still = surface_of(one).nearest(points).distance
    moved = TriangleSurface(scale * (one.vertices @ turn.T + shift), one.faces)
    there = moved.nearest(scale * (points @ turn.T + shift)).distance
    np.testing.assert_allclose(there, scale * still, atol=1e-9 * scale)


def test_samples_are_even_on_the_surface():
    surface = surface_of(trimesh.creation.box((3.0, 2.0, 1.0)))
    points, normals = surface.samples(20_000)
    assert np.abs(surface.nearest(points).distance).max() < 1e-12
    upper = normals[:, 2] > 0.5
    assert upper.mean() == pytest.approx(6.0 / 22.0, abs=1e-3)
    quarter = upper & (points[:, 0] > 0.0) & (points[:, 1] > 0.0)
    assert quarter.sum() == pytest.approx(upper.sum() / 4.0, rel=0.02)


def test_figures_of_a_ball_known_to_be_too_large():
    reference, larger = ball(5), TouchedMap.of_mesh(ball(5, 0.0202))
    found = compare(larger, reference, within=0.0003)
    metrics = (found.bias, found.map_to_reference.mean, found.map_to_reference.rms, found.hausdorff)
    np.testing.assert_allclose(metrics, 0.0002, atol=5e-6)
    assert (found.coverage, compare(larger, reference, within=0.0001).coverage) == (1.0, 0.0)
    assert np.degrees(found.normal_error).max() < 2.5


def test_coverage_is_the_share_of_the_reachable_area():
    """The upper half of a ball felt: half of it covered, and all of what can be reached."""
    reference = ball(5)
    points = reference.samples(20_000)[0]
    felt = TouchedMap(points[points[:, 2] > 0.0])
    assert compare(felt, reference).coverage == pytest.approx(0.525, abs=0.005)  # and 1 mm more
    upper = compare(felt, reference, region=((-1.0, -1.0, 0.0), (1.0, 1.0, 1.0)))
    assert upper.coverage == 1.0
    assert upper.reference_to_map.largest < 1e-3


def test_alignment_takes_a_known_motion_off_and_leaves_an_unobservable_one():
    reference = surface_of(trimesh.creation.box((0.06, 0.04, 0.03)))
    points = reference.samples(500)[0]
    turn = trimesh.transformations.rotation_matrix(0.05, [1.0, 2.0, 3.0])[:3, :3]
    moved = points @ turn.T + [0.001, -0.002, 0.0005]
    found = align(moved, reference)
    assert found.converged
    assert found.angle == pytest.approx(0.05, abs=1e-6)
    np.testing.assert_allclose(moved @ found.rotation.T + found.shift, points, atol=1e-8)
    assert compare(TouchedMap(moved), reference).map_to_reference.rms > 1e-4, "only where asked for"
    turned = align(ball(4).samples(500)[0] + [1e-3, 0.0, 0.0], ball(4)).angle
    assert turned < 1e-2  # its facets say a little


def test_files_of_explore_and_meshes_are_read(tmp_path):
    large = trimesh.creation.icosphere(subdivisions=2, radius=20.0)
    large.export(tmp_path / "ball.stl")
    reference = read_reference(tmp_path / "ball.stl", 1e-3)
    assert reference.is_watertight
    assert reference.area == pytest.approx(1e-6 * large.area)
    assert len(read_map(tmp_path / "ball.stl", 1e-3, 500).points) == 500
    (tmp_path / "map.csv").write_text("x_m,y_m,z_m,distance_to_contact_m\n0,0,0.02,0\n0,0.02,nan,1\n")
    assert read_map(tmp_path / "map.csv").points.tolist() == [[0.0, 0.0, 0.02]]
    (tmp_path / "bad.csv").write_text("a,b\n1,2\n")
    for name, said in (("bad.csv", "no column x_m"), ("none.stl", "cannot be read")):
        with pytest.raises(InvalidValueError, match=said):
            read_map(tmp_path / name)
