import csv

import numpy as np
import pytest

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


def read_ply(path):
    """An independent reader of what the header declares: {element: structured array}."""
    data = path.read_bytes()
    header, body = data.split(b"end_header\n", 1)
    lines = header.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    elements, types = {}, {"double": "<f8"}
    for word, *rest in (line.split() for line in lines[2:]):
        if word == "element":
            name, count = rest
            elements[name] = (int(count), [])
        elif word == "property":
            elements[name][1].append((rest[1], types[rest[0]]))
    read = {}
    for name, (count, fields) in elements.items():
        dtype = np.dtype(fields)
        read[name] = np.frombuffer(body, dtype, count)
        body = body[count * dtype.itemsize :]
    assert body == b""
    return read


def read_csv(path):
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    return header, np.array(rows, dtype=float)


def test_cloud_ply_gives_the_same_numbers_back(tmp_path):
    write_cloud_ply(CLOUD, tmp_path / "cloud.ply")
    vertex = read_ply(tmp_path / "cloud.ply")["vertex"]
    assert len(vertex) == len(CLOUD)
    for names, wanted in ((("x", "y", "z"), CLOUD.position), (("nx", "ny", "nz"), CLOUD.normal)):
        np.testing.assert_array_equal(np.column_stack([vertex[n] for n in names]), wanted)
    np.testing.assert_array_equal(vertex["normal_force"], CLOUD.normal_force)
    np.testing.assert_array_equal(vertex["spin_torque"], CLOUD.spin_torque)
    np.testing.assert_array_equal(vertex["fx"], CLOUD.tangential_force[:, 0])
    np.testing.assert_array_equal(vertex["time"], CLOUD.time)


def test_cloud_csv_gives_the_same_numbers_back(tmp_path):
    write_cloud_csv(CLOUD, tmp_path / "cloud.csv")
    header, rows = read_csv(tmp_path / "cloud.csv")
    assert header[:8] == ["x_m", "y_m", "z_m", "nx", "ny", "nz", "time_s", "normal_force_N"]
    assert len(header) == rows.shape[1] == 12
    np.testing.assert_array_equal(rows[:, :3], CLOUD.position)
    np.testing.assert_array_equal(rows[:, 8:11], CLOUD.tangential_force)
    np.testing.assert_array_equal(rows[:, 11], CLOUD.spin_torque)


def test_map_csv_says_what_was_not_felt(tmp_path):
    write_height_map_csv(MAP, tmp_path / "map.csv")
    header, rows = read_csv(tmp_path / "map.csv")
    assert header == ["x_m", "y_m", "z_m", "distance_to_contact_m"]
    assert len(rows) == MAP.z.size
    np.testing.assert_array_equal(rows[:, 2], MAP.z.ravel())
    assert np.isnan(rows[:, 2]).any()


def test_empty_cloud_is_a_valid_file(tmp_path):
    write_cloud_ply(CLOUD.select(np.zeros(len(CLOUD), dtype=bool)), tmp_path / "empty.ply")
    assert len(read_ply(tmp_path / "empty.ply")["vertex"]) == 0


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
