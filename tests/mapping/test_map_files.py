import csv

import numpy as np
import pytest
import trimesh

from mapping.raster import sphere_cap
from palpate.atomic_file import replacing
from palpate.mapping import (
    HeightMap,
    files,
    write_cloud_csv,
    write_cloud_ply,
    write_height_map_csv,
)

CLOUD = sphere_cap(half=0.004)
MAP = HeightMap.from_cloud(CLOUD.select(np.abs(CLOUD.position[:, 0] - 0.4) > 2.2e-3), 5e-4)


def vertices(path):
    """The table of vertices of a PLY file, by another reader."""
    return trimesh.load(path, process=False).metadata["_ply_raw"]["vertex"]["data"]


def read_csv(path):
    header, *rows = csv.reader(path.read_text().splitlines())
    return header, np.array(rows, dtype=float)


def test_files_of_a_cloud_give_the_same_numbers_back(tmp_path):
    write_cloud_ply(CLOUD, tmp_path / "cloud.ply")
    write_cloud_csv(CLOUD, tmp_path / "cloud.csv")
    vertex, (header, rows) = vertices(tmp_path / "cloud.ply"), read_csv(tmp_path / "cloud.csv")
    assert header[:8] == ["x_m", "y_m", "z_m", "nx", "ny", "nz", "time_s", "normal_force_N"]
    columns = [
        *CLOUD.position.T,
        *CLOUD.normal.T,
        CLOUD.time,
        CLOUD.normal_force,
        *CLOUD.tangential_force.T,
        CLOUD.spin_torque,
    ]
    np.testing.assert_array_equal(rows, np.column_stack(columns))
    names = ("x", "y", "z", "nx", "ny", "nz", "time", "normal_force", "fx", "fy", "fz", "spin_torque")
    for name, column in zip(names, columns, strict=True):
        np.testing.assert_array_equal(np.ravel(vertex[name]), column)


def test_map_csv_says_what_was_not_felt(tmp_path):
    write_height_map_csv(MAP, tmp_path / "map.csv")
    header, rows = read_csv(tmp_path / "map.csv")
    assert header == ["x_m", "y_m", "z_m", "distance_to_contact_m"]
    np.testing.assert_array_equal(rows[:, 2], MAP.z.ravel())
    assert np.isnan(rows[:, 2]).any()


def test_empty_cloud_is_a_valid_file(tmp_path):
    write_cloud_ply(CLOUD.select(np.zeros(len(CLOUD), dtype=bool)), tmp_path / "empty.ply")
    assert "element vertex 0\n" in (tmp_path / "empty.ply").read_bytes().decode("ascii")


@pytest.mark.parametrize("write", [write_cloud_ply, write_cloud_csv])
def test_a_failed_write_leaves_the_former_file_and_nothing_else(tmp_path, monkeypatch, write):
    target = tmp_path / "cloud"
    write(CLOUD, target)
    before = target.read_bytes()

    def broken(cloud):
        raise MemoryError

    monkeypatch.setattr(files, "_table", broken)
    with pytest.raises(MemoryError):
        write(CLOUD, target)
    assert target.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["cloud"]


def test_a_write_that_breaks_off_halfway_leaves_nothing(tmp_path):
    def write_half():
        with replacing(tmp_path / "half") as file:
            file.write(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_half()
    assert list(tmp_path.iterdir()) == []


def test_files_are_as_readable_as_others(tmp_path):
    (tmp_path / "plain").write_text("")
    write_cloud_csv(CLOUD, tmp_path / "cloud.csv")
    assert (tmp_path / "cloud.csv").stat().st_mode == (tmp_path / "plain").stat().st_mode
