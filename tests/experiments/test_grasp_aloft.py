"""What a grasp says of slip is true of the whole time in the air, not only of when something pulled."""

import math
import signal
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.controllers.grip.grasp import GraspStage
from palpate.experiments.grasp.clearance import clearance
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.key_figures import compared, key_figures
from palpate.experiments.grasp.result import SLIPPED, grasp_of
from palpate.experiments.grasp.truth import STAGES
from palpate.experiments.grasp.words import account, outcome
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.runtime import Ending, result_until
from support.grasp_runs import plan_of, run_grasp

pytestmark = pytest.mark.slow  # they look at runs that take seconds

HELD = {"load": "none", "rise": 0.1, "lift_height": 0.02}


@pytest.fixture(scope="module")
def slid():
    """Friction is taken for twice what it is: with the least grip for that the box slides before the pull."""
    return run_grasp(friction=0.3, believed_friction=0.62, believed_spin_length=0.006, known="untouched", **HELD)


@pytest.fixture(scope="module")
def heavy():
    """13 times the usual mass: its weight takes 12.7 N of each finger, which close with 3 N."""
    return run_grasp(mass=1.3, **HELD)


def figure(grasp, name):
    return next(each for each in key_figures(grasp) if each.name == name)


# --- where it is


@given(st.floats(-math.pi, math.pi), st.floats(0.0, 0.1))
def test_the_lowest_point_of_a_turned_box_is_its_edge(angle, height):
    config, half = GraspConfig(), 0.5 * angle
    about_x = clearance(config, height, np.array([math.cos(half), math.sin(half), 0.0, 0.0]))
    below = 0.025 * abs(math.sin(angle)) + 0.03 * abs(math.cos(angle))
    assert about_x == pytest.approx(height + 0.03 - below, abs=1e-12)


@given(st.floats(-math.pi, math.pi))
def test_a_sphere_stands_where_it_stood_however_it_turns(angle):
    turn = np.array([math.cos(angle), 0.0, math.sin(angle), 0.0])
    assert clearance(GraspConfig(object="sphere"), 0.0, turn) == pytest.approx(0.0, abs=1e-12)


# --- what is told


def test_what_slides_in_the_lift_is_said_to_slip(slid):
    assert slid.slip_aloft > 3.0 * SLIPPED
    told = outcome(slid)
    assert "neither" not in told
    assert "slipped" in told or "slid" in told
    assert figure(slid, "dropped").value != "no"
    assert figure(slid, "slip in the whole time in the air").value == pytest.approx(
        1e3 * slid.slip_aloft, abs=1e-5
    )
    assert slid.slip < SLIPPED
    assert slid.onsets
    assert slid.tightest < 1.0
    assert "nan" not in " ".join([told, *account(slid)])


def test_the_heaviest_object_is_taken_up_without_a_slip(heavy):
    assert heavy.run.ending is Ending.DONE
    assert not heavy.dropped
    assert heavy.slip_aloft < SLIPPED
    assert heavy.tightest > 0.95  # where lowering slows down, with 3 % more load, for some milliseconds
    assert "neither slipped nor spun" in outcome(heavy)
    assert heavy.truth.height.max() > 0.019
    assert not heavy.alarms_at()
    assert heavy.regrips == sum(heavy.raised_at().values()) == 0


def test_the_pull_begins_when_it_is_held(heavy):
    held = heavy.truth.time[heavy.truth.stage == STAGES.index(GraspStage.HOLD)][0]
    assert held < heavy.planned.times.begin < held + 0.6


def test_what_met_the_table_early_is_explained_by_the_truth(slid):
    """The same truth, told as slid and as tilted."""
    met = replace(slid, met_early=True, run=replace(slid.run, ending=Ending.LOST))
    assert "for it had slid by" in outcome(met)
    truth = replace(met.truth, slid=0.0 * met.truth.slid, turned=met.truth.turned + 0.2)
    tilted = outcome(replace(met, truth=truth))
    assert "for it had tilted by 11 degrees" in tilted
    assert "slid" not in tilted.split("for it had")[1]


def test_a_control_beside_it_is_compared_by_its_tightest_too(slid, heavy):
    told = {figure.name: figure for figure in compared(replace(heavy, comparison=slid))}
    assert {"tightest, ignoring spin", "slip in the air, ignoring spin", "spin in the air, ignoring spin"} <= set(
        told
    )
    assert told["tightest, ignoring spin"].note == f"with spin {heavy.tightest:.3g}"


def test_letting_go_that_is_interrupted_does_not_keep_the_grip():
    plan, ticks = plan_of(**HELD), []
    run = RecordedRun(plan)

    def stop(sample, now, command):
        ticks.append(run.controller.stage is GraspStage.LET_GO)
        if sum(ticks) == 400:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt) as stopped:
        run.run((stop,))
    result = result_until(stopped.value)
    assert result is not None
    told = outcome(grasp_of(plan, run.recorded(result)))
    assert "the grip was kept" not in told
    assert "letting go, with 0.01 N" in told


def test_least_is_known_wherever_fingers_alone_bear_it(heavy):
    assert np.isfinite(heavy.least[heavy.carried]).all()
    assert not heavy.carried[heavy.truth.clearance <= 0.0].any()
