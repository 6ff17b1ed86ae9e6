"""Calibration of a tip by touches: geometry, evaluation, files; whole runs are slow."""

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.cli import main
from palpate.controllers.touch_sequence import HeldSpan
from palpate.errors import InvalidValueError
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.tip_calibration import TipCalibrationConfig, calibrate_tip
from palpate.experiments.tip_calibration.found_tip import TipErrors, true_tip
from palpate.experiments.tip_calibration.known import believed_targets, simulated_bench, true_targets, typed_tip
from palpate.experiments.tip_calibration.places import Approach, first_touches
from palpate.experiments.tip_calibration.touches import BLOCK_COUNT, felt_touches
from palpate.experiments.tip_calibration.touches_csv import read_touches, touches_text
from palpate.robots.robot import load_robot
from palpate.robots.surface_entries import CapsuleEntry, EllipsoidEntry, SphereEntry
from palpate.runtime.log import read_log
from palpate.sensing.tip_calibration import TargetKind, TipFit, TouchTarget
from support.made_up_touches import RADIUS_ERROR, known_before, made_up_touches, touches_file

NANO17 = load_robot("turning-stage-nano17")
CONFIG = TipCalibrationConfig()
CALIBRATE = "palpate.experiments.tip_calibration.experiment:CalibrateTip"


# --- where the tip goes ---


@settings(deadline=None, max_examples=20, derandomize=True)
@given(st.floats(0.0, 0.9), st.tuples(*[st.floats(-2e-3, 2e-3)] * 3))
def test_touches_end_at_their_targets_and_begin_clear_of_them(turn, center):
    tip = replace(typed_tip(CONFIG, NANO17), center=np.array(center))
    targets = believed_targets(CONFIG)
    approach = Approach(tip, targets, 0.004, (1.0,))
    planned = first_touches(tip, targets, 1.0, turn)
    assert {each.target for each in planned} == {0, 1, 2}
    bench = simulated_bench(replace(CONFIG, scene_error=0))
    for touch, step in zip(planned, approach.steps(planned), strict=True):
        target, inward = targets[touch.target], np.array(step.direction)
        np.testing.assert_allclose(inward, touch.rotation @ touch.normal, atol=1e-12)
        middle = np.array(step.standoff) + touch.rotation @ tip.center  # of the sphere
        at = middle + (approach.clearance + tip.shape.sizes[0] + target.radius) * inward
        off = target.free_directions @ (at - np.array(target.place))
        np.testing.assert_allclose(off, 0.0, atol=1e-12)
        # the simulated things are off by up to 1.5 mm along each axis
        assert bench.signed_distance(middle[None])[0] > tip.shape.sizes[0]
        assert step.height > target.place[2] + tip.shape.sizes[0]


def test_simulated_things_are_off_as_the_seed_says():
    one, again, other = (true_targets(replace(CONFIG, scene_error=seed)) for seed in (1, 1, 2))
    assert one == again
    for believed, target in zip(believed_targets(CONFIG), one, strict=True):
        assert 0.0 < np.abs(np.subtract(target.place, believed.place)).max() <= 1.5e-3
        if target.kind is not TargetKind.POINT:
            assert 0.0 < math.acos(min(1.0, believed.unit @ target.unit)) <= math.radians(2.0)
    assert one != other


def test_a_tip_is_another_one_as_it_is_asked_for():
    errors = TipErrors(0.05, (1e-3, 0.0, 0.0), (0.0, 0.05, 0.0), 2.0)
    for typed in (
        SphereEntry(radius=0.01),
        EllipsoidEntry(semi_axes=(0.01, 0.01, 0.02), center=(0.0, 0.0, 0.001)),
        CapsuleEntry(radius=0.01, length=0.02),
    ):
        true = true_tip(typed, errors)
        np.testing.assert_allclose(np.array(true.center) - typed.center, errors.center)
        np.testing.assert_allclose(true.rotation, Rotation.from_rotvec(errors.turn).as_matrix(), atol=1e-12)
        np.testing.assert_allclose(true.half_extents, 1.05 * np.array(typed.half_extents), rtol=0.2)
    drawn = [TipErrors.of(TipCalibrationConfig(unknown_tip=seed)) for seed in range(50)]
    assert all(abs(each.size) <= 0.05 and 0.5 <= each.stiffness <= 2.0 for each in drawn)
    assert all(math.hypot(*each.turn) == pytest.approx(math.radians(3.0)) for each in drawn)


# --- from a record to touches ---


class MadeUp:
    """A record of some seconds at 1 kHz with loads between given times."""

    def __init__(self, loads, noise, correlation=0.0, seconds=6.0, seed=0, creep=0.0):
        n = round(1e3 * seconds)
        rng = np.random.default_rng(seed)
        white = rng.normal(size=(n, 6)) * noise
        self.time = self.wrench_time = np.arange(n) * 1e-3
        self.wrench = np.tile((0.1, 0.0, 0.0, 0.0, 0.0, 1e-3), (n, 1))  # a bias
        previous = np.zeros(6)
        for i in range(n):
            previous = correlation * previous + math.sqrt(1.0 - correlation**2) * white[i]
            self.wrench[i] += previous
        for (begin, end), load in loads:
            self.wrench[(self.time >= begin) & (self.time < end)] += load
        self.position = np.column_stack([creep * self.time, 0 * self.time, 0 * self.time])
        self.rotation = np.tile(np.eye(3), (n, 1, 1))

    def __len__(self):
        return len(self.time)

    def part(self, rows):
        other = object.__new__(MadeUp)
        for name, value in vars(self).items():
            setattr(other, name, value[rows])
        return other


LOAD = np.array([0.2, -0.1, 2.0, 1e-3, 2e-3, 0.0])
SPANS = [HeldSpan(i, 2.0, (i + 0.1, i + 0.4), (i + 0.5, i + 0.9)) for i in range(5)]
LOADS = [((i + 0.45, i + 0.95), LOAD) for i in range(5)]
NOISE = np.array([0.01] * 3 + [1e-4] * 3)


def test_a_touch_is_the_load_without_bias_however_the_record_is_cut():
    record = MadeUp(LOADS, NOISE)
    whole = felt_touches([record], SPANS, [0, 1, 2, 0, 1])
    cut = felt_touches([record.part(slice(0, 713)), record.part(slice(713, None))], SPANS, [0, 1, 2, 0, 1])
    np.testing.assert_array_equal(whole.touches.wrench, cut.touches.wrench)
    assert whole.touches.target.tolist() == [0, 1, 2, 0, 1]
    assert (np.abs(whole.touches.wrench - LOAD) < 5.0 * whole.touches.wrench_sd).all()


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_the_deviation_of_a_mean_counts_correlation(correlation):
    found = [
        felt_touches([MadeUp(LOADS, NOISE, correlation, seed=seed)], SPANS, [0] * 5).touches for seed in range(12)
    ]
    off = np.concatenate([(each.wrench - LOAD) / each.wrench_sd for each in found])
    assert 0.75 < off.std() < 1.3


def test_a_tip_that_creeps_is_left_out_and_one_that_rests_nowhere_refused():
    with pytest.raises(InvalidValueError, match="nothing was felt at rest"):
        felt_touches([MadeUp(LOADS, NOISE, creep=1e-3)], SPANS, [0] * 5)
    short = [replace(SPANS[0], held=(0.5, 0.5 + (2 * BLOCK_COUNT - 2) * 1e-3))]
    with pytest.raises(InvalidValueError, match="nothing was felt at rest"):
        felt_touches([MadeUp(LOADS, NOISE)], short, [0])


# --- files ---


def test_touches_are_read_as_they_were_written():
    before = known_before()
    touches = made_up_touches(before)
    text = touches_text(touches, before.targets)
    found = read_touches(text, "t.csv", ())
    again = found.of(before.targets)
    for name in ("target", "wrench", "wrench_sd", "position", "time"):
        np.testing.assert_array_equal(getattr(again, name), getattr(touches, name))
    np.testing.assert_allclose(again.rotation, touches.rotation, atol=1e-14)
    assert {each.name: each.radius for each in found.targets} == {"plate": 0.0, "rod": 0.002, "ball": 0.002}


def test_units_in_the_names_of_columns_count():
    header = "target,kind,radius_mm,x_mm,y_mm,z_mm,qw,qx,qy,qz,fx_mN,fy_mN,fz_mN,mx_mNm,my_mNm,mz_mNm"
    text = f"{header},place_x_mm,place_y_mm,place_z_mm\npin,point,1.5,1,2,3,1,0,0,0,1,2,3000,4,5,6,1,2,0\n"
    found = read_touches(text, "t.csv", ())
    assert found.targets == (TouchTarget("pin", TargetKind.POINT, (1e-3, 2e-3, 0.0), radius=1.5e-3),)
    np.testing.assert_allclose(found.touches.position, [[1e-3, 2e-3, 3e-3]])
    np.testing.assert_allclose(found.touches.wrench, [[1e-3, 2e-3, 3.0, 4e-3, 5e-3, 6e-3]])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("point", "pint", r"t.csv, line 2: kind = 'pint': must be one of point, line, plane"),
        (",1,0,0,0,", ",1,0.1,0,0,", r"line 2: qw,qx,qy,qz has length 1.005: must be 1"),
        ("0.3,0.0,2.0", "0.3,nan,2.0", r"line 2: fx_N, .* must be finite"),
        ("fx_N", "fx_lb", r"column 'fx_lb': known units are"),
        ("mz_Nm", "mq_Nm", r"no column mz_Nm"),
        ("place_x_m", "plaice", r"line 2: 'pin': where is it, about"),
    ],
)
def test_mistakes_in_a_file_are_named(old, new, message):
    text = (
        "target,kind,x_m,y_m,z_m,qw,qx,qy,qz,fx_N,fy_N,fz_N,mx_Nm,my_Nm,mz_Nm,place_x_m,place_y_m,place_z_m\n"
        "pin,point,0,0,0.01,1,0,0,0,0.3,0.0,2.0,0,0,0,0,0,0\n"
    )
    assert old in text
    with pytest.raises(InvalidValueError, match=message):
        read_touches(text.replace(old, new, 1), "t.csv", ())


def test_touches_of_a_file_become_a_tip_a_robot_file_and_the_next_touches(tmp_path, capsys):
    assert main([CALIBRATE, "--touches", str(touches_file(tmp_path)), "--out", str(tmp_path / "c"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["metrics"]["usable"] is True
    found = load_robot(str(tmp_path / "c" / "robot.yaml"))
    entry, typed = found.file.fingers[0], NANO17.file.fingers[0].surface
    grown = entry.surface.half_extents[0] - typed.half_extents[0]
    assert grown == pytest.approx(RADIUS_ERROR, abs=5e-6)
    assert 0.0 < entry.surface_sd.uncertainty.size_sd < 1e-4
    assert len((tmp_path / "c" / "next_touches.csv").read_text().splitlines()) > 10


def test_touches_that_do_not_tell_enough_are_not_to_be_used(tmp_path, capsys):
    """All with the same side of the tip, on the plate."""
    before = known_before()
    touches = made_up_touches(before, 400)
    one_side = (touches.target == 0) & (touches.rotation[:, 2, 2] > 0.999)
    text = touches_text(touches.selected(np.resize(np.flatnonzero(one_side), 20)), before.targets)
    (tmp_path / "t.csv").write_text(text)
    assert main([CALIBRATE, "--touches", str(tmp_path / "t.csv"), "--out", str(tmp_path / "c")]) == 1
    assert "do not tell" in " ".join(capsys.readouterr().out.split())
    assert not (tmp_path / "c" / "robot.yaml").exists()


# --- whole runs ---


def calibrated(tmp_path, robot, **options) -> TipFit:
    result = calibrate_tip(TipCalibrationConfig(robot=robot, unknown_tip=1, **options), tmp_path)
    assert result.fit is not None
    assert result.errors is not None
    assert result.usable, str(result.fit.verdict)
    errors = np.abs(result.fit.values - result.fit.unknowns.typed)
    assert errors[0] > 1e-4, "the tip was another one"
    assert result.errors.size < 5.0 * result.fit.sd[0] + 1e-6
    assert result.errors.center < 5.0 * result.largest_sd + 1e-6
    assert result.errors.stiffness < 0.05
    return result.fit


@pytest.mark.slow
def test_a_nano17_finds_its_tip_to_a_fiftieth_of_a_millimetre_and_replays_it(tmp_path):
    fit = calibrated(tmp_path, "turning-stage-nano17", touch_count=30)
    assert fit.sd[:4].max() < 1e-5
    again: Any = LoggedRun.of(read_log(tmp_path / "latest.mcap")).evaluate()
    np.testing.assert_array_equal(again.fit.values, fit.values)


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["stage", "ur5e-nano17"])
def test_other_robots_find_theirs(tmp_path, robot):
    calibrated(tmp_path, robot, touch_count=24)


def test_a_plan_of_touches_moves_nothing(tmp_path):
    assert main([CALIBRATE, "--plan", "--touch-count", "20", "--out", str(tmp_path)]) == 0
    assert len((tmp_path / "next_touches.csv").read_text().splitlines()) == 21
