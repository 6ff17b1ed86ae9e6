"""Clouds of contacts: thinned along their path, made into height maps, and written into files."""

import csv

import numpy as np
import pytest
import trimesh

from mapping.raster import CENTER, RADIUS, cloud_of, raster, sphere_cap
from palpate.atomic_file import replacing
from palpate.mapping import (
    HeightMap,
    files,
    height_map_triangles,
    write_cloud_csv,
    write_cloud_ply,
    write_height_map_csv,
)

CAP = sphere_cap()
HOLE = np.linalg.norm(CAP.position[:, :2] - CENTER[:2], axis=1) < 0.005


def test_thinning_takes_off_the_chord_bias():
    """An arc of one bin: every contact is nearer than the spacing to the first."""
    spacing, radius = 4e-3, 0.02
    angle = np.linspace(0.0, 0.999 * spacing / radius, 41)
    normal = np.column_stack([np.sin(angle), np.zeros(41), np.cos(angle)])
    arc = cloud_of(radius * normal, normal)
    inside = radius - np.linalg.norm(arc.position.mean(axis=0))
    assert inside == pytest.approx(spacing**2 / (24 * radius), rel=0.1)  # the error of a plain mean
    thin = arc.thinned(spacing)
    assert len(thin) == 1
    assert abs(np.linalg.norm(thin.position[0]) - radius) < 0.01 * inside


def test_thinned_points_stay_on_a_sphere_and_turn_with_the_frame():
    for offset in (np.zeros(3), CENTER, np.array([30.0, -20.0, 5.0])):
        thin = sphere_cap(center=offset).thinned(1e-3)
        np.testing.assert_allclose(np.linalg.norm(thin.position - offset, axis=1), RADIUS, atol=1e-8)
        np.testing.assert_allclose(np.linalg.norm(thin.normal, axis=1), 1.0, atol=1e-12)
    rotation = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turned = cloud_of(CAP.position @ rotation.T, CAP.normal @ rotation.T).thinned(1e-3)
    np.testing.assert_allclose(turned.position, CAP.thinned(1e-3).position @ rotation.T, atol=1e-12)


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
    thin = CAP.thinned(2.0)  # one stretch, but for the turn of the normals
    assert thin.normal_force == pytest.approx(2.0)
    assert CAP.time[0] <= thin.time[0] <= thin.time[-1] <= CAP.time[-1]


def test_arrays_cannot_be_changed_from_outside():
    position = np.zeros((3, 3))
    cloud = cloud_of(position, np.tile([0.0, 0.0, 1.0], (3, 1)))
    position[0, 0] = 1.0
    assert cloud.position[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        cloud.position[0, 0] = 1.0


# --- height maps ---


@pytest.mark.parametrize(
    ("half", "row", "noise", "rms"),
    [(0.012, 2e-3, 0.0, 2e-6), (0.008, 2e-3, 3e-5, 5e-6)],  # the promise is 20e-6
    ids=["rows alone", "noise is averaged"],
)
def test_a_sphere_felt_in_rows_comes_out_within_two_hundredths_of_a_millimetre(half, row, noise, rms):
    cap = sphere_cap(half=half, row=row, step=2e-5)
    off = noise * np.random.default_rng(0).normal(size=(len(cap), 1))
    made = HeightMap.from_cloud(cloud_of(cap.position + off * cap.normal, cap.normal), 5e-4)
    x, y = np.meshgrid(made.x - CENTER[0], made.y - CENTER[1])
    error = made.z - CENTER[2] - np.sqrt(RADIUS**2 - x**2 - y**2)
    assert np.sqrt((error[np.maximum(np.abs(x), np.abs(y)) <= half] ** 2).mean()) < rms


@pytest.mark.parametrize("count", [None, 201, 1])
def test_a_plane_is_exact_even_from_one_row(count):
    slope, xy = np.array([0.3, -0.2]), raster()[:count]
    normal = np.append(-slope, 1.0) / np.hypot(1.0, np.linalg.norm(slope))
    cloud = cloud_of(np.column_stack([xy, 0.1 + xy @ slope]), np.tile(normal, (len(xy), 1)))
    made = HeightMap.from_cloud(cloud, 5e-4)
    x, y = np.meshgrid(made.x, made.y)
    assert made.observed.any()
    wanted = 0.1 + slope[0] * x + slope[1] * y
    np.testing.assert_allclose(made.z[made.observed], wanted[made.observed], atol=1e-10)


def test_the_map_moves_with_the_surface():
    step = np.array([3 * 5e-4, -7 * 5e-4, 0.01])
    here, there = (HeightMap.from_cloud(sphere_cap(center=c), 5e-4) for c in (CENTER, CENTER + step))
    np.testing.assert_allclose(there.x, here.x + step[0], atol=1e-12)
    np.testing.assert_allclose(there.z, here.z + step[2], atol=1e-9)


def test_a_hole_stays_open_and_triangles_cover_the_observed_cells_and_face_up():
    made = HeightMap.from_cloud(CAP.select(~HOLE), 5e-4)
    x, y = np.meshgrid(made.x - CENTER[0], made.y - CENTER[1])
    assert np.isnan(made.z[np.hypot(x, y) < 0.005 - made.reach]).all()
    np.testing.assert_array_equal(made.observed, made.distance <= made.reach * (1 + 1e-9))
    vertices, triangles = height_map_triangles(made)
    assert len(vertices) == made.observed.sum() < made.observed.size
    assert np.isfinite(vertices).all()
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    np.testing.assert_allclose(np.cross(b - a, c - a)[:, 2], 5e-4**2, rtol=1e-6)  # half a cell seen from above
    seen = made.observed
    corners = seen[:-1, :-1].astype(int) + seen[:-1, 1:] + seen[1:, 1:] + seen[1:, :-1]
    assert len(triangles) == 2 * (corners == 4).sum() + (corners == 3).sum()


# --- files ---

CLOUD = sphere_cap(half=0.004)


def read_csv(path):
    header, *rows = csv.reader(path.read_text().splitlines())
    return header, np.array(rows, dtype=float)


def test_files_of_a_cloud_give_the_same_numbers_back(tmp_path):
    write_cloud_ply(CLOUD, tmp_path / "cloud.ply")
    write_cloud_csv(CLOUD, tmp_path / "cloud.csv")
    vertex = trimesh.load(tmp_path / "cloud.ply", process=False).metadata["_ply_raw"]["vertex"]["data"]
    header, rows = read_csv(tmp_path / "cloud.csv")
    assert header[:8] == ["x_m", "y_m", "z_m", "nx", "ny", "nz", "time_s", "normal_force_N"]
    columns = [
        *CLOUD.position.T, *CLOUD.normal.T, CLOUD.time, CLOUD.normal_force, *CLOUD.tangential_force.T,
        CLOUD.spin_torque,
    ]  # fmt: skip
    np.testing.assert_array_equal(rows, np.column_stack(columns))
    names = ("x", "y", "z", "nx", "ny", "nz", "time", "normal_force", "fx", "fy", "fz", "spin_torque")
    np.testing.assert_array_equal([np.ravel(vertex[name]) for name in names], columns)
    # readable by the same users as any other file
    (tmp_path / "plain").write_text("")
    assert (tmp_path / "cloud.csv").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_the_csv_of_a_height_map_has_no_heights_where_there_were_no_contacts(tmp_path):
    made = HeightMap.from_cloud(CLOUD.select(np.abs(CLOUD.position[:, 0] - 0.4) > 2.2e-3), 5e-4)
    write_height_map_csv(made, tmp_path / "map.csv")
    header, rows = read_csv(tmp_path / "map.csv")
    assert header == ["x_m", "y_m", "z_m", "distance_to_contact_m"]
    np.testing.assert_array_equal(rows[:, 2], made.z.ravel())
    assert np.isnan(rows[:, 2]).any()


def test_empty_cloud_is_a_valid_file(tmp_path):
    write_cloud_ply(CLOUD.select(np.zeros(len(CLOUD), dtype=bool)), tmp_path / "empty.ply")
    assert "element vertex 0\n" in (tmp_path / "empty.ply").read_bytes().decode("ascii")


@pytest.mark.parametrize("write", [write_cloud_ply, write_cloud_csv])
def test_a_failed_write_leaves_the_former_file_and_nothing_else(tmp_path, monkeypatch, write):
    target = tmp_path / "cloud"
    write(CLOUD, target)
    before = target.read_bytes()
    monkeypatch.setattr(files, "_table", lambda cloud: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write(CLOUD, target)
    assert target.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["cloud"]


def test_a_write_that_breaks_off_halfway_leaves_nothing(tmp_path):
    with pytest.raises(KeyboardInterrupt), replacing(tmp_path / "half") as file:  # noqa: PT012
        file.write(b"half")
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []
