import numpy as np
import pytest

from mapping.raster import CENTER, RADIUS, cloud_of, sphere_cap


def circle_arc(bin_length, radius, points=41):
    """An arc of one bin: every contact nearer than `bin_length` to the first."""
    angle = np.linspace(0.0, 0.999 * bin_length / radius, points)
    normal = np.column_stack([np.sin(angle), np.zeros(points), np.cos(angle)])
    return cloud_of(radius * normal, normal)


def test_thinning_takes_off_the_chord_bias():
    spacing, radius = 4e-3, 0.02
    arc = circle_arc(spacing, radius)
    inside = radius - np.linalg.norm(arc.position.mean(axis=0))
    assert inside == pytest.approx(spacing**2 / (24 * radius), rel=0.1)  # what a plain mean would do
    thin = arc.thinned(spacing)
    assert len(thin) == 1
    assert abs(np.linalg.norm(thin.position[0]) - radius) < 0.01 * inside


def test_thinned_points_stay_on_a_sphere_wherever_it_is():
    for offset in (np.zeros(3), CENTER, np.array([30.0, -20.0, 5.0])):
        thin = sphere_cap(center=offset).thinned(1e-3)
        np.testing.assert_allclose(np.linalg.norm(thin.position - offset, axis=1), RADIUS, atol=1e-8)
        np.testing.assert_allclose(np.linalg.norm(thin.normal, axis=1), 1.0, atol=1e-12)


def test_thinning_turns_with_the_frame():
    cap = sphere_cap()
    rotation = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turned = cloud_of(cap.position @ rotation.T, cap.normal @ rotation.T).thinned(1e-3)
    np.testing.assert_allclose(turned.position, cap.thinned(1e-3).position @ rotation.T, atol=1e-12)


def test_thinning_bridges_neither_jumps_nor_pauses_nor_edges():
    up, side = [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]
    x = np.arange(10) * 1e-5
    line = np.column_stack([x, 0 * x, 0 * x])
    jump = cloud_of(np.concatenate([line, line + np.array([0.0, 0.05, 0.0])]), np.tile(up, (20, 1)))
    time = np.concatenate([x * 100, x * 100 + 1.0])
    pause = cloud_of(np.concatenate([line, line[::-1]]), np.tile(up, (20, 1)), time=time)
    edge = cloud_of(np.concatenate([line, line]), np.repeat([up, side], 10, axis=0))
    rests = cloud_of(1e-5 * np.random.default_rng(0).normal(size=(5000, 3)), np.tile(up, (5000, 1)))
    none = cloud_of(np.zeros((0, 3)), np.zeros((0, 3)))
    assert [len(each.thinned(1e-3)) for each in (jump, pause, edge, rests, none)] == [2, 2, 2, 1, 0]
    np.testing.assert_array_equal(edge.thinned(1e-3).normal, [up, side])


def test_means_of_steady_force_and_time_stay_in_range():
    cap = sphere_cap()
    thin = cap.thinned(2.0)  # one stretch, but for the turn of the normals
    assert thin.normal_force == pytest.approx(2.0)
    assert thin.time[0] >= cap.time[0]
    assert thin.time[-1] <= cap.time[-1]


def test_select():
    cap = sphere_cap()
    assert 0 < len(cap.select(cap.position[:, 0] > CENTER[0])) < len(cap)


def test_arrays_cannot_be_changed_from_outside():
    position = np.zeros((3, 3))
    cloud = cloud_of(position, np.tile([0.0, 0.0, 1.0], (3, 1)))
    position[0, 0] = 1.0
    assert cloud.position[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        cloud.position[0, 0] = 1.0
