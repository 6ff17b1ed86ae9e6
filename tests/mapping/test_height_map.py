import numpy as np

from mapping.raster import CENTER, RADIUS, cloud_of, raster, sphere_cap
from palpate.mapping import HeightMap, height_map_triangles


def cap_error(height_map, half):
    """Error of the heights [m] over the square of `half` width around the center."""
    x, y = np.meshgrid(height_map.x - CENTER[0], height_map.y - CENTER[1])
    inside = np.maximum(np.abs(x), np.abs(y)) <= half
    return (height_map.z - CENTER[2] - np.sqrt(RADIUS**2 - x**2 - y**2))[inside]


def test_a_sphere_felt_in_rows_comes_out_within_two_hundredths_of_a_millimetre():
    height_map = HeightMap.from_cloud(sphere_cap(half=0.012, row=2e-3, step=2e-5), 5e-4)
    error = cap_error(height_map, 0.012)
    assert np.isfinite(error).all()
    assert np.sqrt((error**2).mean()) < 2e-6  # the promise is 20e-6


def test_noise_is_averaged():
    rng = np.random.default_rng(0)
    cap = sphere_cap(half=0.008, step=2e-5)
    noisy = cloud_of(cap.position + 3e-5 * rng.normal(size=(len(cap), 1)) * cap.normal, cap.normal)
    error = cap_error(HeightMap.from_cloud(noisy, 5e-4), 0.008)
    assert np.sqrt((error**2).mean()) < 5e-6


def test_a_plane_is_exact_even_from_one_row():
    slope = np.array([0.3, -0.2])
    normal = np.append(-slope, 1.0) / np.hypot(1.0, np.linalg.norm(slope))
    for xy in (raster(), raster()[:201], raster()[:1]):
        cloud = cloud_of(np.column_stack([xy, 0.1 + xy @ slope]), np.tile(normal, (len(xy), 1)))
        height_map = HeightMap.from_cloud(cloud, 5e-4)
        x, y = np.meshgrid(height_map.x, height_map.y)
        wanted = 0.1 + slope[0] * x + slope[1] * y
        seen = height_map.observed
        assert seen.any()
        np.testing.assert_allclose(height_map.z[seen], wanted[seen], atol=1e-10)


def test_what_nobody_felt_is_not_invented():
    cap = sphere_cap()
    hole = np.linalg.norm(cap.position[:, :2] - CENTER[:2], axis=1) < 0.005
    height_map = HeightMap.from_cloud(cap.select(~hole), 5e-4)
    x, y = np.meshgrid(height_map.x - CENTER[0], height_map.y - CENTER[1])
    assert np.isnan(height_map.z[np.hypot(x, y) < 0.005 - height_map.reach]).all()
    np.testing.assert_array_equal(height_map.observed, height_map.distance <= height_map.reach * (1 + 1e-9))
    assert not height_map.observed.all()


def test_the_map_moves_with_the_surface():
    step = np.array([3 * 5e-4, -7 * 5e-4, 0.01])
    here, there = (HeightMap.from_cloud(sphere_cap(center=c), 5e-4) for c in (CENTER, CENTER + step))
    np.testing.assert_allclose(there.x, here.x + step[0], atol=1e-12)
    np.testing.assert_allclose(there.z, here.z + step[2], atol=1e-9)


def test_triangles_cover_the_observed_cells_and_face_up():
    cap = sphere_cap()
    hole = np.linalg.norm(cap.position[:, :2] - CENTER[:2], axis=1) < 0.005
    height_map = HeightMap.from_cloud(cap.select(~hole), 5e-4)
    vertices, triangles = height_map_triangles(height_map)
    assert len(vertices) == height_map.observed.sum()
    assert np.isfinite(vertices).all()
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    up = np.cross(b - a, c - a)[:, 2]
    np.testing.assert_allclose(up, 5e-4**2, rtol=1e-6)  # each is half a cell seen from above
    seen = height_map.observed
    corners = seen[:-1, :-1].astype(int) + seen[:-1, 1:] + seen[1:, 1:] + seen[1:, :-1]
    assert len(triangles) == 2 * (corners == 4).sum() + (corners == 3).sum()
