"""What is typed for every command so that it succeeds, and so that it fails, with what the refusal has to name."""

import io
import json
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.cli import CommandGroup, main, typed_commands
from palpate.robots.robot import shipped_robots

WRENCHES = "fx,fy,fz,mx,my,mz\n0.3,0.1,-2,0.004,0.008,0.001\n"

SMALL = "--width 0.01 --depth 0.004 --speed 0.05"


@dataclass(frozen=True, slots=True)
class Sample:
    """What is typed for a command; it works in a folder that `prepared` has filled.

    Attributes:
        mistake: What is refused.
        named: Words of the refusal: value, limit, remedy.
        success: What succeeds; empty for what goes on until Ctrl-C or needs devices, which `test_cli_devices` has,
            and for what takes minutes.
    """

    mistake: str
    named: tuple[str, ...]
    success: str = ""


SAMPLES = {
    "explore": Sample("--speed 20", ("speed = 20 m/s", "0.1 m/s", "for 20 mm/s give 0.02"), SMALL),
    "regulate": Sample(
        "--motion circle --motion-size 5",
        ("motion_size = 5 m", "at most 0.05 m", "leave the object"),
        "--duration 0.5 --out held",
    ),
    "friction": Sample(
        "--travel 1", ("travel = 1 m", "at most", "--most-travel"), "--quick --loads 2 --robot stage --out rubbed"
    ),
    "grasp": Sample(
        "--margin 12",
        ("margin = 12", "at most 3", "0.12 stands for 12 %"),
        "--load none --rise 0.1 --lift-height 0.01 --out held",
    ),
    "sweep": Sample(
        "explore --vary speed=20",
        ("speed = 20 m/s", "0.1 m/s", "for 20 mm/s give 0.02"),
        "explore --set width=0.01 depth=0.004 --vary speed=0.05 --dry-run",
    ),
    "contact": Sample(
        "wrenches.csv", ("none given", "--sphere R", "[m]"), "wrenches.csv --sphere 0.01 --out contacts.csv"
    ),
    "compare": Sample(
        "run/contacts.csv nowhere.stl",
        ("reference = nowhere.stl", "no such file"),
        "run/contacts.csv run/map.stl --samples 200",
    ),
    "calibrate tip": Sample(
        "--touch-count 3", ("touch_count = 3", "from 20 to 200"), "--robot stage --touch-count 20 --out tipped"
    ),
    "calibrate new": Sample("sensor.yaml --preset nano71", ("nano71", "nano17"), "another.yaml --preset nano17"),
    "calibrate matrix": Sample(
        "--loads loads.csv --sensor sensor.yaml --raw-unit V",
        ("raw_range", "give --raw-range LOW HIGH"),
        "--loads loads.csv --sensor sensor.yaml --raw-unit V --raw-range -10 10 --out calibrated.yaml",
    ),
    "calibrate payload": Sample(
        "--poses poses.csv --sensor sensor.yaml --averaged 0",
        ("averaged = 0", "from 1 to 1000000"),
        "--poses poses.csv --sensor sensor.yaml --out loaded.yaml",
    ),
    "calibrate mounting": Sample(
        "--poses poses.csv --sensor sensor.yaml --averaged 0", ("averaged = 0", "from 1 to 1000000")
    ),
    "calibrate tare": Sample(
        "--sensor sensor.yaml --readings rest.csv --duration 1000",
        ("duration = 1000 s", "at most 600 s"),
        "--sensor sensor.yaml --readings rest.csv --learn-noise --out tared.yaml",
    ),
    "log info": Sample("nowhere", ("nowhere",), "run"),
    "log ros2": Sample("nowhere", ("nowhere",), "run --out bag"),
    "log export": Sample("run --to xls", ("xls", "csv", "parquet"), "run --out tables"),
    "replay": Sample("run --set fore=3", ("fore", "force"), "run"),
    "view": Sample("run --port 70000", ("port = 70000", "from 0 to 65535", "0 for one that is free")),
    "robot list": Sample("--robot stage", ("--robot",), " "),
    "robot show": Sample("stge", ("robot = 'stge'", "did you mean stage?", "stage-nano17"), "stage"),
    "robot check": Sample("bad.yaml", ("bad.yaml: backend.mas_kg", "did you mean mass_kg?"), "stage-nano17"),
    "doctor": Sample("stage", ("robot = stage", "no devices to connect to", "give a robot file of kind rig")),
    "recover": Sample("stage", ("robot = stage", "no devices to connect to", "give a robot file of kind rig")),
    "emulate ur": Sample("--time-scale 100", ("time_scale = 100", "from 0.01 to 10")),
    "emulate dynamixel": Sample("--servos 100", ("servos = 100", "from 1 to 16")),
    "emulate robot": Sample("stage", ("backend.kind = stage has no devices to emulate", "kind rig")),
    "emulate netft": Sample("--address here", ("address = 'here'", "IPv4 address, such as 127.0.0.2")),
    "emulate fault": Sample("70000 ur drop_rst", ("port = 70000", "from 1 to 65535")),
    "warm-up": Sample("everything", ("everything",)),
    "completion": Sample("csh", ("csh", "bash", "zsh", "fish"), "bash"),
}
"""By command as typed."""


def leaves() -> Iterator[str]:
    """Yield every command as typed, without the program's name."""
    for name, what in typed_commands().items():
        yield from (f"{name} {word}" for word in what.commands) if isinstance(what, CommandGroup) else (name,)


def prepared(folder: Path) -> dict[str, Any]:
    """Put everything there that the samples name: the files and log of a run, wrenches, a sensor, readings.

    Returns:
        What the run said.
    """
    said = io.StringIO()
    with redirect_stdout(said):
        assert main(["explore", *SMALL.split(), "--out", str(folder / "run"), "--json"]) == 0
    assert main(["calibrate", "new", str(folder / "sensor.yaml"), "--preset", "nano17"]) == 0
    (folder / "wrenches.csv").write_text(WRENCHES)
    good = shipped_robots()["stage"].read_text()
    (folder / "bad.yaml").write_text(good.replace("mass_kg: 5", "mas_kg: 5"))
    write_loads(folder / "loads.csv")
    write_poses(folder / "poses.csv")
    write_rest(folder / "rest.csv")
    found: dict[str, Any] = json.loads(said.getvalue())
    return found


def write_rest(path: Path) -> None:
    """Readings at rest: noise about a bias."""
    noise = np.random.default_rng(1).normal(size=(400, 6)) * ((0.003,) * 3 + (1.5e-5,) * 3)
    bias = np.array((0.1, -0.2, 0.3, 1e-3, 0.0, 2e-3))
    table(path, "fx,fy,fz,mx,my,mz", noise + bias)


def write_loads(path: Path) -> None:
    """Known loads on a sensor with six channels that mix the axes a little."""
    rng = np.random.default_rng(2)
    loads = rng.uniform(-1.0, 1.0, (30, 6)) * ((8.0,) * 3 + (0.08,) * 3)
    mixed = np.eye(6) + 0.05 * rng.normal(size=(6, 6))
    raw = (loads / ((12.0,) * 3 + (0.12,) * 3)) @ mixed.T * 5.0 + 1e-4 * rng.normal(size=(30, 6))
    header = "raw_0,raw_1,raw_2,raw_3,raw_4,raw_5,fx,fy,fz,mx,my,mz"
    table(path, header, np.hstack([raw, loads]))


def write_poses(path: Path) -> None:
    """A mass of 50 g held in many poses, each with the direction in which gravity points."""
    rng = np.random.default_rng(3)
    down = rng.normal(size=(24, 3))
    down /= np.linalg.norm(down, axis=1, keepdims=True)
    force = 0.05 * 9.80665 * down
    moment = np.cross((0.0, 0.001, 0.02), force)
    noise = rng.normal(size=(24, 6)) * ((0.003,) * 3 + (1.5e-5,) * 3)
    table(path, "gx,gy,gz,fx,fy,fz,mx,my,mz", np.hstack([down, np.hstack([force, moment]) + noise]))


def table(path: Path, header: str, rows: np.ndarray) -> None:
    """Write a CSV file."""
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.12g")
