"""The golden runs give the metrics and commands that `golden.json` keeps, on every machine."""

import json
import math

import pytest

from golden.runs import FILE, GOLDEN_RUNS, carried_out
from palpate.controllers import gains
from palpate.experiments.explore.config import StrategyName
from palpate.experiments.kit.registry import experiment_names

KEPT = json.loads(FILE.read_text())

METRIC_TOLERANCE = 1e-6
"""Relative difference of a metric that linear algebra and libm of another processor may make."""

MAP_TOLERANCE = 1e-3
"""Relative difference of a metric of a map: the likelihood is flat about its length scale, and the search for it
ends elsewhere with another library of linear algebra (measured 2e-4 with the kernels of older processors)."""

ENDING_TOLERANCE = 1.5e-3
"""Difference of the duration [s]: a threshold is passed one period earlier or later."""

COMMAND_TOLERANCE = 1e-9
"""Difference of a command between processors [m/s, rad/s, N]."""


def differences(found, kept):
    """Return what differs between two entries of `golden.json`, by key or by period."""
    different = {
        key: (found[key], kept[key])
        for key in ("experiment", "options", "ending", "periods")
        if found[key] != kept[key]
    }
    metrics, expected = found["metrics"], kept["metrics"]
    different |= {
        key: (metrics.get(key), expected.get(key))
        for key in set(metrics) | set(expected)
        if not _alike(key, metrics.get(key), expected.get(key))
    }
    for row, command in zip(found["commands"], kept["commands"], strict=True):
        if row[:2] != command[:2] or row[2:] != pytest.approx(command[2:], rel=0.0, abs=COMMAND_TOLERANCE):
            different[f"period {row[0]}"] = (row, command)
    return different


def _alike(key, value, expected):
    if not (isinstance(value, float) and isinstance(expected, float)):
        return value == expected
    relative = MAP_TOLERANCE if key.startswith("map_") else METRIC_TOLERANCE
    absolute = ENDING_TOLERANCE if key == "simulated_s" else 1e-12
    return math.isclose(value, expected, rel_tol=relative, abs_tol=absolute)


@pytest.mark.parametrize(
    "run", [pytest.param(run, id=run.name, marks=[pytest.mark.slow] * run.slow) for run in GOLDEN_RUNS]
)
def test_a_run_gives_the_metrics_and_commands_that_are_kept(run):
    found, _ = carried_out(run)
    same = "equal" if found["digest"] == KEPT[run.name]["digest"] else "different: another processor, or a change"
    assert differences(found, KEPT[run.name]) == {}, f"digest of all commands: {same}"


def test_a_gain_of_explorations_that_is_one_percent_off_turns_them_red_and_no_other_run(monkeypatch):
    monkeypatch.setattr(gains.force_gain, "__defaults__", (1.01 * gains.LOOP_GAIN,))
    expected = {"explore: level contour": True, "regulate: step": False, "grasp: two fingers, ramp, spin": False}
    for start, red in expected.items():
        run = next(run for run in GOLDEN_RUNS if run.name.startswith(start))
        different = differences(carried_out(run)[0], KEPT[run.name])
        assert any(key.startswith("period") for key in different) is red, run.name


def test_the_runs_cover_every_strategy_experiment_and_kind_of_robot():
    options = [run.options for run in GOLDEN_RUNS]
    strategies = {each.get("strategy", "raster") for run, each in zip(GOLDEN_RUNS, options, strict=True)
                  if run.experiment == "explore"}  # fmt: skip
    assert strategies == set(StrategyName.__args__)
    assert {run.experiment for run in GOLDEN_RUNS} == set(experiment_names())
    robots = {"turning-stage", "ur5e-sim", "xarm6-sim", "stage-nano17", "stage-pin", "pinch-and-index"}
    assert robots <= {each.get("robot", "stage") for each in options}
    assert len({run.name for run in GOLDEN_RUNS}) == len(KEPT) == len(GOLDEN_RUNS)
