"""Regulation runs and the bounds that they keep: moving, soft, stiff and rough surfaces."""

import math

import numpy as np
import pytest

from palpate.controllers.guarded_approach import Loss
from palpate.experiments.kit import recorded_periods, recorded_run
from palpate.experiments.kit.metric import metrics_of
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.experiments.regulate.report import series_of
from palpate.experiments.regulate.result import write_forces
from palpate.experiments.regulate.words import outcome
from palpate.runtime import Ending, Phase
from palpate.runtime.live import LONGEST_ELAPSED, ScheduledChanges, live_parameters_of
from palpate.runtime.log import Change, LogWriter, log_writer
from palpate.sim import Box, DrivenJoint, JointKind, MovingTarget, Sine
from support.regulate_runs import REGULATE, carried_out, planned, regulated, touching
from support.run_bounds import INF, below, check_bounds

NANO17 = {"force_noise": 1.0 / 320.0, "moment_noise": 1e-3 / 64.0}
STEPS = {"profile": "step", "duration": 2.0}
MOVING = {"surface": "sine", "duration": 5.0, **NANO17}
MOVING_BOUNDS = below(true_rms=0.1, landing_peak=8.0) | {"planned.parameters.gain.gain_margin": (3.0, INF)}
IDENTIFIED = {"profile": "step", "identify": True, "hold": 2.0, "duration": 8.0}
IDENTIFIED_BOUNDS = below(judged_steps__overshoot=0.1, judged_steps__settling_time=1.0)
SINES = {"profile": "sine", "identify": True, **NANO17}
SINE_BOUNDS = {"judged_tones.bandwidth": (6.0, INF)} | below(judged_tones__peak=1.1, guard_trips=0)
TONES = {"profile": "sine", "frequencies": (5.0, 8.0, 16.0), "swing": 0.5}
TONE_BOUNDS = {"judged_tones.bandwidth": (8.0, INF)}
STIFF = {"stiffness": 100e3, "assumed_stiffness": 10e3, "duration": 2.0, **NANO17}
ROUGH = {"object": "sphere", "friction": 0.9, "motion": "sine", "duration": 2.5, **NANO17}

FAST = {
    "still, Nano17": ({"robot": "stage-nano17", "duration": 3.0}, below(true_rms=0.02, landing_peak=3.0)),
    "ten times as stiff as assumed": (STIFF, below(peak=20.0)),
    "ten times as stiff as assumed, arm": ({**STIFF, "robot": "ur5e-sim", "profile": "step"}, below(peak=20.0)),
    "three times the friction": (ROUGH, below(true_rms=0.02)),
}
SLOW = {
    "moving at 20 mm/s": (MOVING, MOVING_BOUNDS),
    "moving at 20 mm/s, arm": ({**MOVING, "robot": "ur5e-sim"}, MOVING_BOUNDS),
    "identified, hard": (IDENTIFIED, IDENTIFIED_BOUNDS),
    "identified, soft, arm": ({**IDENTIFIED, "robot": "ur5e-sim", "surface": "soft"}, IDENTIFIED_BOUNDS),
    "identified, soft, Nano17": ({**IDENTIFIED, "robot": "stage-nano17", "surface": "soft"}, IDENTIFIED_BOUNDS),
    "sines": (SINES, SINE_BOUNDS),
    "sines, arm": ({**SINES, "robot": "ur5e-sim"}, SINE_BOUNDS),
    "sines as assumed": (TONES, TONE_BOUNDS),
    "sines as assumed, arm": ({**TONES, "robot": "ur5e-sim"}, TONE_BOUNDS),
    # the damping of this contact makes the model's gain too high: the guard takes it back
    "soft, not identified": (
        {"robot": "ur5e-sim", "surface": "soft", "profile": "step", "duration": 6.0},
        below(peak=5.0),
    ),
}
ROWS = [
    *(pytest.param(*row, id=name) for name, row in FAST.items()),
    *(pytest.param(*row, id=name, marks=pytest.mark.slow) for name, row in SLOW.items()),
]


@pytest.mark.parametrize(("fields", "bounds"), ROWS)
def test_a_regulation_ends_in_contact_and_keeps_its_bounds(fields, bounds):
    found = regulated(**fields)
    assert found.run.ending is Ending.DONE
    assert found.loss is Loss.NEVER
    assert (found.record.phase[found.counted] == Phase.HOLD.value).all()
    assert found.peak < found.planned.limits.force
    check_bounds(found, bounds)
    if fields.get("profile") == "sine":
        # a quarter of the bandwidth and below
        slow = found.judged_tones.gain[: 3 if "identify" in fields else 1]
        assert slow == pytest.approx(1.0, abs=0.05 if "identify" in fields else 0.1)


OFF_BY_THREE = [
    ("stage", 2e3, 3.0),
    ("stage", 20e3, 1.0 / 3.0),
    ("stage", 20e3, 1.0),
    pytest.param("stage", 100e3, 3.0, marks=pytest.mark.slow),
    pytest.param("ur5e-sim", 2e3, 1.0, marks=pytest.mark.slow),
    pytest.param("ur5e-sim", 20e3, 3.0, marks=pytest.mark.slow),
    pytest.param("ur5e-sim", 100e3, 1.0 / 3.0, marks=pytest.mark.slow),
]
"""Robot, stiffness [N/m], factor of the assumed stiffness: every pair of values."""


@pytest.mark.parametrize(("robot", "stiffness", "factor"), OFF_BY_THREE)
def test_steps_do_not_overshoot_with_a_stiffness_off_by_three(robot, stiffness, factor):
    found = regulated(robot=robot, stiffness=stiffness, assumed_stiffness=factor * stiffness, **STEPS)
    check_bounds(found, below(judged_steps__largest_overshoot=0.1, guard_trips=0))
    if factor == 1.0:
        assert found.judged_steps.rise_time < 0.2


def test_the_force_reaches_each_step_without_overshoot():
    steps = regulated(profile="step", duration=4.0, **NANO17).judged_steps
    assert len(steps.each) == 3
    check_bounds(steps, below(largest_overshoot=0.1, rise_time=0.15))
    assert steps.mean[-100:] == pytest.approx(1.0, abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("phase", np.arange(3) * 2.0 * math.pi / 3.0)
def test_landing_on_a_moving_surface_is_bounded_at_every_phase(phase):
    course = Sine(0.01, 0.02 / (2.0 * math.pi * 0.01), phase)
    joint = DrivenJoint(JointKind.SLIDE, (0.0, 0.0, 1.0), course)
    plan = planned(surface="sine", duration=1.0)
    target = MovingTarget(Box((0.2, 0.2, 0.04)), [joint], (0.0, 0.0, -0.01))
    found = carried_out(touching(plan, target))
    assert found.run.ending is Ending.DONE
    assert found.peak < 8.0


# --- A run longer than what is kept in memory: its metrics are of all periods, read from its log in pieces ---


PROFILES = {
    "step": {"profile": "step", "duration": 3.0},
    "sine": {"profile": "sine", "frequencies": (2.0, 5.0)},
    "live": {"duration": 2.0},
}


def regulated_with(log, **config):
    plan = planned(force_noise=0.01, seed=3, **config)
    run = RecordedRun(plan)
    live = ScheduledChanges(live_parameters_of(run.controller), [Change(1.5, "force", 2.5)])
    result = run.run(sinks=() if log is None else (LogWriter(log),), live=live)
    return REGULATE.evaluate(plan, run.recorded(result))


@pytest.fixture
def short_of_memory(monkeypatch):
    monkeypatch.setattr(recorded_run, "BESIDE_A_LOG", 300)
    monkeypatch.setattr(recorded_periods, "MOST_PERIODS", 500)
    monkeypatch.setattr(recorded_periods, "_AT_ONCE", 700)
    monkeypatch.setattr(log_writer, "LARGEST_CHUNK", 2**17)


@pytest.mark.parametrize("name", PROFILES)
def test_piece_by_piece_it_comes_to_the_same(name, tmp_path, short_of_memory):
    found = regulated_with(tmp_path / "a.mcap", **PROFILES[name])
    assert len(found.record) <= 500
    assert sum(1 for _ in found.pieces()) > 3
    with pytest.MonkeyPatch.context() as roomy:
        roomy.setattr(recorded_run, "BESIDE_A_LOG", 2**16)
        whole = regulated_with(tmp_path / "b.mcap", **PROFILES[name])
    assert len(list(whole.pieces())) == 1
    ours, theirs = metrics_of(REGULATE, found), metrics_of(REGULATE, whole)
    assert ours.keys() == theirs.keys()
    for metric, value in theirs.items():
        if isinstance(value, float):
            np.testing.assert_allclose(ours[metric], value, rtol=1e-9, atol=1e-12, err_msg=metric)
        else:
            assert ours[metric] == value
    assert outcome(found) == outcome(whole)
    write_forces(found, tmp_path / "a.csv")
    write_forces(whole, tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_text().split() == (tmp_path / "b.csv").read_text().split()
    shown = np.isin(whole.record.time, found.record.time)
    ramped = LONGEST_ELAPSED * live_parameters_of(found.planned.controller()).parameters["force"].rate
    np.testing.assert_allclose(series_of(found).set_force, whole.set_force[shown], atol=1.001 * ramped)


def test_without_a_log_it_says_what_its_figures_are_of(monkeypatch, short_of_memory):
    monkeypatch.setattr(recorded_run, "MemoryLog", lambda: recorded_periods.MemoryLog(500))
    found = regulated_with(None, **PROFILES["step"])
    assert found.judged_steps is None
    assert f"every {found.every}th period" in outcome(found)
