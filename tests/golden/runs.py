"""Golden runs: short simulated experiments that cover every controller and every simulated back end.

Each run is one experiment with its options. Its metrics and its commands are kept in `golden.json`: a change of
any number that a robot would be commanded is seen, and has to be explained in the commit that makes it.
"""

import hashlib
import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.experiments.kit.metric import metrics_of
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.script import perform

FILE = Path(__file__).with_name("golden.json")

THINNED_ROWS = 16
"""Commands that are kept of each run, evenly over its periods."""

Row = list[Any]
"""Period, phase, then the numbers of the command: velocity and angular velocity of the tip [m/s, rad/s], grip
forces [N], velocities of the fingers [m/s]."""


@dataclass(frozen=True, slots=True)
class GoldenRun:
    """An experiment with the options of one short run.

    Attributes:
        name: Name of the run in `golden.json`.
        experiment: Name of the experiment, as in the registry.
        options: Fields of its configuration that differ from the defaults.
        slow: Whether only `make test-all` carries it out.
    """

    name: str
    experiment: str
    options: Mapping[str, Any]
    slow: bool = False


def _explore(name: str, **options: Any) -> GoldenRun:
    noise = {"force_noise": 0.005, "moment_noise": 5e-5} if options.get("robot", "stage") == "stage" else {}
    return GoldenRun(f"explore: {name}", "explore", {"force": 1.5, "speed": 0.04, **noise, **options})


def _regulate(name: str, **options: Any) -> GoldenRun:
    return GoldenRun(f"regulate: {name}", "regulate", options)


def _grasp(name: str, slow: bool = False, **options: Any) -> GoldenRun:
    return GoldenRun(f"grasp: {name}", "grasp", {"lift_height": 0.01, **options}, slow)


SMALL = {"width": 0.01, "depth": 0.004}
"""Sides of a small scanned rectangle [m]."""

GOLDEN_RUNS: Sequence[GoldenRun] = (
    _explore("raster on the stage, force and speed changed while it runs", **SMALL,
             change=((0.6, "force", 2.0), (0.9, "speed", 0.02))),
    _explore("raster with a swinging force on the turning stage with a Nano17", **SMALL,
             robot="turning-stage-nano17", object="ellipsoid", force_swing=0.4),
    _explore("spiral on the UR5e, gain identified", robot="ur5e-sim", strategy="spiral", radius=0.006,
             identify=True),
    _explore("contour of a box's edge on the stage", strategy="contour", object="box", size=(0.02, 0.02, 0.02),
             curve="edge", speed=0.02),
    _explore("level contour on the turning stage", robot="turning-stage", strategy="contour", size=(0.012,),
             below=0.002, speed=0.05),
    _explore("taps on the UR5e with a Nano17", robot="ur5e-nano17", strategy="taps", width=0.006, depth=0.006,
             spacing=0.006),
    _explore("active on bumps on the stage", strategy="active", object="bumps", size=(0.001, 0.02, 0.06),
             width=0.02, depth=0.02, accuracy=1e-4, speed=0.05),
    _explore("raster beyond a cylinder on an arm from a file", **SMALL, robot="xarm6-sim", object="cylinder",
             size=(0.01, 0.05), beyond=True),
    _explore("raster by a pin that fingers hold on the stage", **SMALL, robot="stage-pin", force=1.0, speed=0.02),
    _explore("raster by a third finger on a held object", width=0.006, depth=0.003, robot="pinch-and-index",
             force=1.0),
    _regulate("step of the set force on a still plate", profile="step", duration=1.5, hold=0.4, force_noise=0.003),
    _regulate("circle on a plate that moves as a sine, UR5e, gain identified", robot="ur5e-sim", surface="sine",
              motion="circle", duration=1.5, identify=True),
    _regulate("sine of the set force on a mounted mass", surface="soft", profile="sine", frequencies=(2.0, 5.0),
              force_noise=0.003),
    GoldenRun("friction: strokes and twists on the turning stage", "friction",
              {"quick": True, "loads": (1.0, 2.0), "speeds": (0.005, 0.02), "force_noise": 0.003}),
    _grasp("two fingers, ramp, friction touched", load="ramp", rise=0.5),
    _grasp("two fingers, step, friction untouched", load="step", known="untouched"),
    _grasp("two fingers on bristles, shaken, friction nudged", load="shake", rise=0.5, known="nudged", plant=True),
    _grasp("three fingers on a sphere, shaken", slow=True, fingers=3, object="sphere", load="shake", rise=0.5),
    _grasp("three fingers on a cylinder, step, friction estimated", fingers=3, object="cylinder", load="step",
           known="estimated"),
    _grasp("two fingers, ramp, spin ignored", load="ramp", rise=0.5, controller="coulomb"),
    GoldenRun("calibrate.tip: unknown tip on the stage with a Nano17", "calibrate.tip",
              {"robot": "stage-nano17", "unknown_tip": 3, "touch_count": 20, "forces": (2.0,), "place_sd": 4e-4}),
    GoldenRun("calibrate.tip: unknown tip on the turning stage with a Nano17", "calibrate.tip",
              {"unknown_tip": 3, "touch_count": 20}, slow=True),
)  # fmt: skip
"""The runs. `test_golden.py` checks that they cover every strategy, controller and simulated robot."""


class CommandRecorder:
    """Observer of a run that keeps every command as plain numbers."""

    def __init__(self) -> None:
        self.rows: list[Row] = []

    def observe(self, _sample: Any, _observation: Any, command: Any) -> None:
        """Keep the command of one period."""
        finger_velocity = [v for each in command.finger_velocity or () if each is not None for v in each]
        numbers = (
            *command.velocity_base_tip, *command.angular_velocity_base_tip, *(command.grip_force or ()),
            *finger_velocity,
        )  # fmt: skip
        self.rows.append([len(self.rows), str(command.phase), *map(float, numbers)])

    def digest(self) -> str:
        """Return a digest of all commands, every bit of them."""
        whole = hashlib.sha256()
        for _, phase, *numbers in self.rows:
            whole.update(phase.encode() + struct.pack(f"<{len(numbers)}d", *numbers))
        return whole.hexdigest()[:16]

    def thinned(self) -> list[Row]:
        """Return `THINNED_ROWS` commands, evenly over the run, the last one among them."""
        last = len(self.rows) - 1
        return [self.rows[last * k // (THINNED_ROWS - 1)] for k in range(THINNED_ROWS)]


def carried_out(run: GoldenRun) -> tuple[dict[str, Any], CommandRecorder]:
    """Carry a run out and return what `golden.json` keeps of it, and its commands."""
    experiment, recorder = experiment_named(run.experiment), CommandRecorder()
    result = perform(experiment, experiment.Config(**run.options), observers=(recorder.observe,))
    return {
        "experiment": run.experiment,
        "options": json.loads(json.dumps(run.options)),
        "ending": str(result.run.ending.value),
        "periods": len(recorder.rows),
        "digest": recorder.digest(),
        "metrics": {key: _rounded(value, 10) for key, value in metrics_of(experiment, result).items()},
        "commands": [[_rounded(value, 12) for value in row] for row in recorder.thinned()],
    }, recorder


def _rounded(value: Any, digits: int) -> Any:
    """Return a number with so many significant digits: last bits differ between processors."""
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value


def written(runs: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the text of `golden.json`: a line per metric and per command."""
    return json.dumps(runs, indent=1, default=str, cls=_RowPerLine) + "\n"


class _RowPerLine(json.JSONEncoder):
    """Indented JSON whose innermost lists stand on one line."""

    def encode(self, o: Any) -> str:
        return "".join(self._lines(o, 0))

    def _lines(self, value: Any, depth: int) -> Any:
        if isinstance(value, Mapping):
            yield from self._block("{", "}", [(f"{json.dumps(k)}: ", v) for k, v in value.items()], depth)
        elif isinstance(value, list) and any(isinstance(each, list) for each in value):
            yield from self._block("[", "]", [("", each) for each in value], depth)
        else:
            yield json.dumps(value)

    def _block(self, opening: str, closing: str, entries: list[tuple[str, Any]], depth: int) -> Any:
        indent = "\n" + " " * (depth + 1)
        yield opening
        for number, (head, value) in enumerate(entries):
            yield ("," if number else "") + indent + head
            yield from self._lines(value, depth + 1)
        yield "\n" + " " * depth + closing
