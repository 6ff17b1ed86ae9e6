"""The readers of outside input, each with valid examples of what it reads."""

import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import trimesh

from palpate.bounded_file import read_text
from palpate.commands.calibrate.measurements import read_measurements, wrenches
from palpate.commands.contact.tool import wrench_blocks
from palpate.commands.log.export import episodes
from palpate.commands.log.info import LogTimes, log_summary
from palpate.commands.sweep.store import read_record
from palpate.controllers.tangent_motion import PathTable
from palpate.csv_table import BOUNDS
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.heights_file import load_heights
from palpate.experiments.kit.config_file import config_text, load_overlay, read_config
from palpate.experiments.regulate.motion import read_motion
from palpate.exporting.csv_tables import CsvExporter
from palpate.friction.friction_file import load_friction_file
from palpate.friction.materials.library import load_materials
from palpate.mapping.compare_files import read_map, read_reference
from palpate.robots.robot import load_robot, shipped_robots
from palpate.runtime.log import LogReader, LogWriter, Recorder, read_log
from palpate.sensing.ft.sensor_reader import load_sensor_file
from palpate.sim.objects.mesh_file import read_triangles
from palpate.surfaces.mesh import load_mesh
from runtime.log.log_examples import SMALL, a_run, feed

Kind = Literal["text", "binary", "log"]


@dataclass(frozen=True, slots=True)
class InputReader:
    """A reader with what it reads.

    Attributes:
        kind: How its input is damaged.
        examples: Valid inputs.
        read: Reads one; raises PalpateError, or returns.
    """

    kind: Kind
    examples: Sequence[bytes]
    read: Callable[[bytes], object]


def _of_file(name: str, kind: Kind, examples: Sequence[bytes], read: Callable[[Path], object]) -> "Made":
    def made(folder: Path) -> InputReader:
        path = folder / name

        def whole(data: bytes) -> object:
            path.write_bytes(data)
            return read(path)

        return InputReader(kind, examples, whole)

    return made


Made = Callable[[Path], InputReader]


def _meshes(kind: str) -> list[bytes]:
    ball, box = trimesh.creation.icosphere(2, 0.02), trimesh.creation.box((0.03, 0.02, 0.01))
    out = []
    for mesh in (ball, box):
        written = mesh.export(file_type=kind)
        out.append(written if isinstance(written, bytes) else written.encode())
    if kind == "stl":
        out.append(box.export(file_type="stl_ascii").encode())
    if kind == "ply":
        out.append(trimesh.exchange.ply.export_ply(box, encoding="ascii"))
    return out


def _arrays() -> list[bytes]:
    out = []
    for array in (np.zeros((5, 6)), np.ones((4, 4), np.float32, order="F"), np.arange(24).reshape(4, 6) % 3):
        file = io.BytesIO()
        np.save(file, array * 1e-3)
        out.append(file.getvalue())
    return out


def _csv(header: str, rows: int, columns: int) -> bytes:
    numbers = np.random.default_rng(0).normal(size=(rows, columns)).round(5)
    return "\n".join([header, *(",".join(map(repr, row)) for row in numbers.tolist()), ""]).encode()


def _logs(folder: Path) -> InputReader:
    path = folder / "a.mcap"
    examples = []
    for seed in range(2):
        made = folder / f"{seed}.mcap"
        recorder = Recorder(LogWriter(made, {"experiment.yaml": "force: 3\n", "versions.yaml": "palpate: 0\n"}))
        periods = a_run(60, SMALL, seed=seed)
        recorder.start(periods[0][0], periods[0][1], 1e-3)
        feed(recorder, periods)
        recorder.close()
        examples.append(made.read_bytes())

    def read(data: bytes) -> None:
        path.write_bytes(data)
        read_log(path)
        with LogReader(path) as log:
            times = LogTimes(log.codec)
            for piece in log.pieces():
                times.take(piece)
        log_summary(log, times, len(data))
        CsvExporter().write(episodes([path], lambda _: None, lambda _: None), folder)

    return InputReader("log", examples, read)


def _stream(folder: Path) -> InputReader:
    def read(data: bytes) -> None:
        for _ in wrench_blocks(io.BytesIO(data), "input", "mark"):
            pass

    return InputReader("text", WRENCHES, read)


def _records(folder: Path) -> InputReader:
    return InputReader(
        "text", [b'{"run": 1, "digest": "a", "seed": 0, "status": "done", "metrics": {"x": 1.5}}'], read_record
    )


ROBOTS = shipped_robots()
SENSORS = [file.read_bytes() for file in sorted((ROBOTS["stage"].parent / "sensors").glob("*.yaml"))]
WRENCHES = [_csv("fx_N,fy_N,fz_N,mx_mNm,my_Nm,mz_Nm", 20, 6), _csv("t,fx,fy,fz,mx,my,mz", 5, 7)]
MATERIALS = [(ROBOTS["stage"].parents[1] / "materials" / "simulated.yaml").read_bytes()]
FRICTIONS = [Path(__file__).with_name("friction.yaml").read_bytes()]
CLOUD = _csv("x_m,y_m,z_m,nx,ny,nz", 20, 6)
GRID = ("x_m,y_m,z_m\n" + "\n".join(f"{x / 100},{y / 100},0.001" for x in range(5) for y in range(5))).encode()
PLAIN_GRID = b"# width_m=0.06 depth_m=0.04\n" + b"\n".join([b"0.001,0.002,0.001,0,0"] * 5)
MOTION = "\n".join(["time_s,x_m,y_m,z_m", *(f"{t / 100},0.{t},{t}e-4,0" for t in range(20)), ""]).encode()
CONFIG = config_text("explore", ExploreConfig()).encode()


def _experiment(path: Path) -> object:
    load_overlay(path, "explore", ExploreConfig)
    return read_config(read_text(path, BOUNDS, "an experiment file is YAML text"), ExploreConfig)


READERS: Mapping[str, Made] = {
    "robot": _of_file(
        "robot.yaml",
        "text",
        [file.read_bytes() for file in ROBOTS.values() if b"sensor:" not in file.read_bytes()],
        lambda path: load_robot(str(path)),
    ),
    "sensor": _of_file("sensor.yaml", "text", SENSORS, load_sensor_file),
    "experiment": _of_file("experiment.yaml", "text", [CONFIG, b"force: 3\ntip: [0.008]\n"], _experiment),
    "materials": _of_file("materials.yaml", "text", MATERIALS, load_materials),
    "friction": _of_file("friction.yaml", "text", FRICTIONS, load_friction_file),
    "heights-csv": _of_file("h.csv", "text", [GRID, PLAIN_GRID], lambda path: load_heights(path, 1.0, ())),
    "heights-npy": _of_file("h.npy", "binary", _arrays(), lambda path: load_heights(path, 1.0, (0.05, 0.04))),
    "motion": _of_file(
        "m.csv",
        "text",
        [MOTION],
        lambda path: read_motion(PathTable, read_text(path, BOUNDS, "a motion"), "m.csv"),
    ),
    "map-csv": _of_file("map.csv", "text", [CLOUD, GRID], read_map),
    "calibration": _of_file(
        "c.csv", "text", WRENCHES, lambda path: wrenches(read_measurements(path), (500.0,) * 6)
    ),
    "wrenches": _stream,
    "record": _records,
    **{
        f"object-{kind}": _of_file(f"o.{kind}", "binary", _meshes(kind), read_triangles)
        for kind in ("stl", "obj", "ply", "off")
    },
    **{f"tip-{kind}": _of_file(f"t.{kind}", "binary", _meshes(kind), load_mesh) for kind in ("stl", "obj")},
    "map-ply": _of_file("m.ply", "binary", _meshes("ply"), lambda path: read_map(path, samples=200)),
    "reference": _of_file("r.stl", "binary", _meshes("stl"), read_reference),
    "log": _logs,
}
"""By name."""
