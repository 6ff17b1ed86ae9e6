"""Regulation of force from configuration to report: metrics, hostile cases, logs, refusals."""

import math
import os
import signal
from dataclasses import replace
from operator import attrgetter
from typing import Any

import numpy as np
import pytest

from palpate.cli import main
from palpate.controllers.guarded_approach import Loss
from palpate.controllers.tangent_motion import PathTable, VelocityTable
from palpate.errors import InvalidValueError
from palpate.experiments.kit.config_file import config_text, read_config
from palpate.experiments.kit.metric import metrics_of
from palpate.experiments.kit.one_finger import Identified
from palpate.experiments.kit.options import foreign_options, specs_of
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.experiments.regulate.config import LIVE, RegulateConfig
from palpate.experiments.regulate.motion import motion_text, read_motion
from palpate.experiments.regulate.report import CONTACT_SENTENCES, limits, margins, series_of
from palpate.reporting.page import report_page
from palpate.reporting.run_figures import force_overview
from palpate.runtime import Command, Ending, Phase
from palpate.sim import Box, DrivenJoint, JointKind, MovingTarget
from support.refusals import check_refusals
from support.regulate_runs import REGULATE, carried_out, planned, regulated, touching
from support.run_bounds import below, check_bounds

NANO17 = {"force_noise": 1.0 / 320.0, "moment_noise": 1e-3 / 64.0}
PLATE = Box((0.2, 0.2, 0.04))
SURFACES = {name: spec for name, spec in specs_of(RegulateConfig).items() if spec.choice == "surface"}


# --- metrics ---


def test_what_is_along_the_surface_is_moved_by_the_one_who_moves_it():
    """The force is held meanwhile, and the tip goes round the circle that was asked for."""
    found = regulated(motion="circle", duration=2.5, friction=0.3, **NANO17)
    held = found.holding
    x, y = found.record.position[held, 0], found.record.position[held, 1]
    x, y = x - 0.5 * (x.max() + x.min()), y - 0.5 * (y.max() + y.min())
    assert np.hypot(x, y)[1000:] == pytest.approx(0.005, abs=0.5e-3)
    assert found.true_rms < 0.02


@pytest.mark.slow
def test_identified_the_answer_is_quicker_and_does_not_overshoot():
    assumed, found = (
        regulated(profile="step", duration=3.0, identify=identify, assumed_stiffness=10e3)
        for identify in (False, True)
    )
    (before, after) = (one.judged_steps for one in (assumed, found))
    assert found.planned.identified.contact_stiffness == pytest.approx(20e3, rel=0.02)
    assert after.rise_time < 0.7 * before.rise_time
    assert after.largest_overshoot <= 0.1


def test_a_surface_on_a_mount_yields_and_is_pressed_as_wanted():
    found = regulated(surface="yielding", profile="step", duration=2.0)
    steps = found.judged_steps
    assert steps.overshoot <= 0.1
    assert found.bounces == 0
    held = found.counted
    depth = np.ptp(found.record.position[held, 2])
    # from 2 to 3 N on contact and mount in series
    assert depth == pytest.approx(1.0 / 20e3 + 1.0 / 2e3, rel=0.1)
    assert "mount of 2 kN/m" in dict(REGULATE.report(found).settings)["object"]


def test_a_recorded_path_is_played(tmp_path):
    table, times = tmp_path / "path.csv", np.linspace(10.0, 11.5, 16)
    xs = 0.1 + 0.004 * (1.0 - np.cos(math.pi * (times - 10.0) / 1.5))
    lines = "".join(f"{t!r},{x!r},0.3,0.9\n" for t, x in zip(times.tolist(), xs.tolist(), strict=True))
    table.write_text("time,x,y,z\n" + lines)
    found = regulated(motion="path", motion_file=table, duration=2.0)
    x = found.record.position[found.holding, 0]
    assert x[-1] - x[0] == pytest.approx(0.008, abs=2e-4)
    assert found.true_rms < 0.02


def test_the_force_may_be_changed_while_it_runs():
    found = regulated(duration=2.0, change=((1.7, "force", 3.0),))
    assert found.set_force[found.holding][-1] == pytest.approx(3.0)
    assert found.true_force[found.holding][-1] == pytest.approx(3.0, abs=0.01)
    assert found.true_rms < 0.05


def test_the_margin_is_that_of_the_damped_contact_and_the_limits_are_told():
    plan = planned(surface="soft", robot="ur5e-sim")
    contact, gain = plan.contact, plan.parameters.gain
    assert contact.damping_time > 0.1
    assert contact.margins(gain).gain_margin == pytest.approx(math.pi, rel=1e-3)
    told = {metric.name: metric.value for metric in margins(plan)}
    assert told["gain margin"] == pytest.approx(math.pi, rel=1e-3)
    assert "10 Hz" in " ".join(limits(plan))


def test_what_the_stiffness_may_be_off_by_is_told_once_and_with_half_the_gain_by_three():
    """The gain margin is of feedback alone, and larger; the help says a factor of 3."""
    told = {metric.name: metric for metric in margins(planned())}
    softest, stiffest = (float(word) for word in str(told["stable for a stiffness"].value).split(" ")[:3:2])
    assert softest < 0.5
    assert 1.8 < stiffest < float(told["gain margin"].value)
    assert float(str(told["once the gain is halved"].value).split(" ")[2]) > 3.0
    assert not any("1.57" in metric.note for metric in told.values())


def test_a_change_that_is_never_reached_or_comes_before_the_holding_is_in_the_account():
    early = regulated(duration=0.6, change=((0.1, "force", 3.0), (500.0, "force", 4.0)))
    report = REGULATE.report(early)
    told = report.outcome
    assert "Changed before anything was held: force to 3 N" in told
    assert "NOT changed: force to 4 N after 500 s" in told
    assert "force to 4 N after 500 s: not reached" in dict(report.settings).values()
    assert early.set_force[early.holding] == pytest.approx(3.0)


def test_figures_report_and_files_are_of_the_same_run(tmp_path):
    """Of steps there is no bandwidth; on the page is every section, and it needs nothing from outside."""
    found = regulated(profile="step", hold=0.3, duration=0.9, **NANO17)
    metrics = metrics_of(REGULATE, found)
    steps = found.judged_steps
    assert metrics["rise_time_s"] == steps.rise_time > 0.0
    assert metrics["bandwidth_hz"] is None
    assert metrics["contact"] == "never lost"
    page = report_page(REGULATE.report(found))
    headings = ("Over time", "Step response", "What limits it", "Margins", "gain margin", "Computing")
    assert all(heading in page for heading in headings)
    assert "http://" not in page.replace("http://www.w3.org", "")
    ((name, write),) = REGULATE.files(found).items()
    write(tmp_path / name)
    table = np.genfromtxt(tmp_path / name, delimiter=",", names=True)
    assert table["true_force_N"] == pytest.approx(found.true_force, abs=1e-8)
    assert found.planned.dry_run().files == (name,)


# --- hostile ---


@pytest.mark.parametrize("speed", [0.02, 0.1])
def test_a_surface_that_leaves_is_sought_once_and_not_far(speed):
    found = regulated(surface="leaving", leave_time=2.0, surface_speed=speed)
    check_bounds(found, below(peak=4.0), run__ending=Ending.LOST, loss=Loss.GONE)
    seeking = found.record.phase == Phase.SEEK.value
    assert seeking.any()
    assert np.ptp(found.record.position[seeking, 2]) < 0.006
    assert np.abs(found.record.velocity[seeking, 2])[100:].max() < 0.006
    first, last = np.flatnonzero(seeking)[[0, -1]]
    assert seeking[first : last + 1].all()  # once
    assert "lost" in REGULATE.report(found).outcome


class Drops:
    """A motion: down by 2 mm each time, too fast to be followed."""

    def __init__(self, *times):
        self.times = times

    def at(self, time):
        gone = [min(max(time - begin, 0.0) * 0.4, 0.002) for begin in self.times]
        return -sum(gone), -0.4 * sum(0.0 < way < 0.002 for way in gone), 0.0


@pytest.mark.slow
@pytest.mark.parametrize(("times", "loss"), [((2.0,), Loss.FOUND), ((2.0, 5.0), Loss.GONE)])
def test_what_is_lost_once_is_found_again_and_what_is_lost_twice_is_given_up(times, loss):
    joint = DrivenJoint(JointKind.SLIDE, (0.0, 0.0, 1.0), Drops(*times))
    found = carried_out(touching(planned(duration=6.0), MovingTarget(PLATE, [joint])))
    ending = Ending.DONE if loss is Loss.FOUND else Ending.LOST
    check_bounds(found, below(peak=4.0), loss=loss, run__ending=ending)
    begins = np.diff((found.record.phase == Phase.SEEK.value).astype(int)) > 0
    assert begins.sum() == 1


def test_what_was_never_touched_was_never_lost_and_is_not_said_to_be():
    """The run is stopped above the surface, and in another run after it has touched."""

    def stopped(after):
        def observe(sample, now, command):
            if now.time > after:
                raise KeyboardInterrupt

        run = RecordedRun(planned())
        with pytest.raises(KeyboardInterrupt):
            run.run((observe,))
        return run.controller.contact.loss

    assert stopped(0.05) is Loss.UNMADE
    assert stopped(3.0) is Loss.NEVER
    assert Loss.UNMADE.value == "never made"
    assert set(CONTACT_SENTENCES) == set(Loss)


def test_nothing_there_is_said_so():
    found = regulated(surface="missing")
    check_bounds(found, {}, run__ending=Ending.LOST, loss=Loss.MISSING, peak=0.0)
    assert "nothing was found" in REGULATE.report(found).outcome
    assert force_overview(series_of(found)) is None
    report = REGULATE.report(found)
    texts = {metric.name: metric.text for metric in report.metrics}
    assert texts["felt force, RMS error"] == "-"
    assert "true force, RMS error" not in texts
    assert "nan" not in texts.values()
    assert not report.reached


@pytest.mark.slow
def test_a_drifting_sensor_is_told_and_how_much():
    found = regulated(robot="stage-nano17", drift=1.2, duration=5.0)
    check_bounds(found, below(sensed_rms=0.02), run__ending=Ending.DONE)
    at_end = 1.2 / 60.0 * (found.run.duration - 1.0)
    assert found.sensor_error == pytest.approx(at_end, abs=0.02)
    assert "was not there" in REGULATE.report(found).outcome
    steady = regulated(robot="stage-nano17", duration=1.5)
    assert "was not there" not in REGULATE.report(steady).outcome


@pytest.mark.slow
@pytest.mark.parametrize("ends_at", [0.2, 1.5])
def test_a_run_that_an_exception_ends_is_told_all_the_same(ends_at, tmp_path):
    """While it comes down, and while it holds: the period of the exception was recorded, but not observed."""
    plan = planned(duration=0.6)
    run = RecordedRun(plan)
    step = run.controller.step

    def fails(now):
        if now.time > ends_at:
            raise RuntimeError("a bug")
        return step(now)

    run.controller.step = fails
    result = run.run()
    assert "a bug" in str(result.error)
    found = REGULATE.evaluate(plan, run.recorded(result))
    assert len(found.truth) == len(found.record)
    assert math.isfinite(found.peak)
    assert (found.true_force >= 0.0).all()
    assert "a bug" in report_page(REGULATE.report(found))
    ((name, write),) = REGULATE.files(found).items()
    write(tmp_path / name)
    assert (tmp_path / name).stat().st_size > 0


# --- texts, logs ---


def test_a_plan_comes_back_from_its_texts_and_does_the_very_same(tmp_path):
    table = tmp_path / "moved.csv"
    table.write_text("t,vx,vy,vz\n0,0,0,0\n0.3,0.01,0,0.002\n0.9,-0.01,0,0\n")
    plan = planned(motion="table", motion_file=table, duration=1.0, identify=True, **NANO17)
    assert plan.preparation
    plan = plan.with_identified(Identified(19e3, 30.0, 0.03, 13.9e3, 2e-3, 0.006, 0.0, 5.0, 60.0))
    assert plan.prepared() is plan
    table.unlink()
    again = REGULATE.plan(plan.config, plan.robot, plan.attachments())
    same = attrgetter("config", "parameters", "follow", "motion", "identified")
    assert same(again) == same(plan)
    first, second = carried_out(plan), carried_out(again)
    assert first.run.ending is Ending.DONE
    assert np.array_equal(first.record.command, second.record.command)


def test_texts_read_back_the_same():
    sines = {"profile": "sine", "frequencies": (0.1, 7.3), "swing": 0.7}
    config = RegulateConfig(**sines, axis=(0.0, 0.6, -0.8), tip=(0.01,), drift=0.2)
    assert read_config(config_text("regulate", config), RegulateConfig) == config
    found = Identified(1.0 / 3.0, 0.1, 0.1 / 3.0, 2.0 / 3.0, 1e-3 / 3.0, 1e-3, 0.0, 7.0 / 3.0, 61.0)
    assert Identified.read(found.text) == found
    for kind in (PathTable, VelocityTable):
        motion = read_motion(kind, "0,0.1,0,0\n1,0.30000000000000004,1e-17,-0.1\n", "a")
        assert type(motion) is kind
        assert read_motion(kind, motion_text(motion), "b") == motion


# --- refusals ---


@pytest.mark.parametrize("surface", ["still", "sine", "soft", "yielding", "leaving", "missing"])
def test_a_surface_takes_its_own_options_and_no_others(surface):
    values = {name: 2.0 * getattr(RegulateConfig(), name) for name in SURFACES}
    own = [name for name, spec in SURFACES.items() if surface in spec.choices]
    RegulateConfig(surface=surface, **{name: values[name] for name in own})
    for name in set(values) - set(own):
        with pytest.raises(InvalidValueError, match=rf"^{name} = .*: is for --surface .*; {surface} takes "):
            RegulateConfig(surface=surface, **{name: values[name]})


def test_a_replay_with_another_profile_leaves_out_what_the_recorded_one_took():
    chosen = {"object": "plate", "surface": "still", "profile": "sine", "motion": "still"}
    left_out = foreign_options(RegulateConfig, chosen) - set(SURFACES)
    assert left_out == {"file", "touch", "rate", "hold", "duration", "motion_size", "motion_speed", "motion_file"}


def zigzag(path, step):
    """A path file of 40 mm/s that turns every 0.2 s within two steps [s]."""
    time = np.arange(0.0, 1.0, step)
    x = 0.04 * np.abs((time + 0.1) % 0.4 - 0.2)
    np.savetxt(path, np.column_stack([time, x, 0.0 * time, 0.0 * time]), delimiter=",")
    return path


def test_a_motion_that_turns_too_abruptly_for_the_limits_is_refused_when_it_is_planned(tmp_path):
    sharp, blunt = zigzag(tmp_path / "sharp.csv", 0.002), zigzag(tmp_path / "blunt.csv", 0.02)
    table = tmp_path / "table.csv"
    table.write_text("0,0,0,0\n0.1,0.02,0,0\n0.1005,-0.02,0,0\n")
    limit = (
        r"m/s\^2: must be at most the robot's limit, 25 m/s\^2 "
        r"\(limits.acceleration_m_per_s2 in the robot file\); "
    )
    check_refusals(
        (
            rf"sharp.csv: its largest acceleration = 65 {limit}turn",
            lambda: planned(motion="path", motion_file=sharp),
        ),
        (rf"table.csv: its largest acceleration = 40 {limit}", lambda: planned(motion="table", motion_file=table)),
        (
            rf"motion_speed, motion_size: the acceleration = 40 {limit}move more slowly",
            lambda: planned(motion="circle", motion_speed=0.02, motion_size=1e-5),
        ),
    )
    plan = planned(motion="path", motion_file=blunt)
    (note,) = plan.dry_run().notes
    assert "accelerations of up to 7.85 m/s^2" in note
    assert "at most 0.5 m/s^2" in note
    (speed,) = [each for each in plan.dry_run().metrics if each.name == "speed"]
    motion: Any = plan.motion
    assert speed.value == pytest.approx(1e3 * motion.fastest)
    assert not planned(motion="sine").dry_run().notes


def test_changes_and_identifications_that_cannot_be_are_refused_and_every_live_parameter_is_known():
    check_refusals(
        ("change after 1 s: force = 20 N: must lie between", lambda: planned(change=((1.0, "force", 20.0),))),
        (
            "no live parameter is called 'forse'; did you mean",
            lambda: RegulateConfig(change=((5.0, "forse", 4.0),)),
        ),
        ("identify: nothing was identified", lambda: regulated(surface="missing", identify=True)),
    )
    assert tuple(planned().controller().live.parameters) == LIVE


# --- `palpate regulate` as people type it ---


def test_the_command_leaves_its_files_and_says_where(tmp_path, capsys):
    out = tmp_path / "new"
    words = ["regulate", "--profile", "step", "--hold", "0.3", "--duration", "0.9", "--out", str(out)]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "overshoot" in said
    assert "report.html" in said
    names = {path.name for path in out.iterdir() if path.suffix != ".mcap"}
    assert names == {"report.html", "forces.csv"}
    assert "Step response" in (out / "report.html").read_text()
    assert main(["replay", str(out)]) == 0
    assert "identical, bit for bit; all that was felt is the same" in capsys.readouterr().out
    assert main(["replay", str(out), "--set", "force=3"]) == 0
    assert "commanded velocity apart" in capsys.readouterr().out
    assert main(["replay", str(out), "--set", "stiffness=3"]) == 2
    assert "assumed_stiffness is what the gain is made for" in capsys.readouterr().err
    assert main(["regulate", "--surface", "missing", "--out", str(out)]) == 1


def test_a_regulation_that_is_interrupted_is_written_all_the_same(tmp_path, monkeypatch):
    def interrupt(*_):
        os.kill(os.getpid(), signal.SIGINT)
        return Command()

    monkeypatch.setattr("palpate.controllers.RegulateController.step", interrupt)
    assert main(["regulate", "--out", str(tmp_path)]) == 130
    assert (tmp_path / "report.html").exists()
    assert (tmp_path / "forces.csv").exists()


@pytest.mark.parametrize("surface", ["sine", "yielding"])
def test_what_there_is_to_see_is_the_scene_and_what_moves_as_told_moves(surface):
    scene = planned(surface=surface).view()
    assert {"tip", "object"} <= {part.body for part in scene.parts}
    start = scene.placement.start
    heights = [
        scene.placement.poses(replace(start, time=time))["object"].position[2] for time in (0.0, math.pi / 2.0)
    ]
    assert heights[0] == pytest.approx(0.0, abs=1e-9)
    # half a period of a sine of 10 mm and 20 mm/s
    assert heights[1] == pytest.approx(-0.02 if surface == "sine" else 0.0, abs=1e-6)
