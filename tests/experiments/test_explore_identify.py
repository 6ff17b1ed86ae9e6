"""Pressing first: what it finds, what the force then is, and that its log gives the same run again."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from palpate.cli import main
from palpate.commands.replay.run import replay_log
from palpate.controllers import Admittance, DirectForce
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.one_finger import IDENTIFIED_TEXT, Identified
from palpate.runtime import Ending
from palpate.runtime.log import read_log
from support.explore_runs import carried_out, plan_of, planned_again
from support.run_bounds import above, below, check_bounds

SMALL = {"width": 0.012, "depth": 0.004, "spacing": 0.004}
NOISE = {"force_noise": 3.1e-3, "moment_noise": 1.6e-5}
FOUND = Identified(20e3, 30.0, 1e-3, 14e3, 0.00123456789012345, 0.0115, 4.1, 8.3, 61.0)


@pytest.fixture(scope="module", params=["stage", "ur5e-sim"])
def both(request):
    """The same exploration with the gain as assumed, and as pressing has found it."""
    config = ExploreConfig(robot=request.param, identify=True, **SMALL, **NOISE)
    planned = plan_of(config)
    return carried_out(planned), carried_out(planned.prepared())


@pytest.mark.slow
def test_pressing_finds_the_contact_and_a_law_that_holds_the_force_better(both):
    assumed, found = both
    told = found.plan.identified
    assert assumed.plan.identified is None
    margins = above(gain_margin=2.0, phase_margin_deg=45.0)
    check_bounds(told, {"contact_stiffness": (0.98 * 20e3, 1.02 * 20e3)} | margins)
    assert told.series_stiffness < told.contact_stiffness
    check_bounds(found, below(force_rms=min(0.035, 0.7 * assumed.force_rms)), run__ending=Ending.DONE)
    assert np.nanmax(found.true_normal_force) < 3.5
    assert found.plan.parameters.gain.gain == pytest.approx(1.0 / told.damping)


@pytest.mark.slow
def test_a_run_that_was_identified_replays_bit_for_bit(tmp_path):
    words = ["--robot", "ur5e-sim", "--identify", "--width", "0.006", "--depth", "0.002", "--force-noise", "0.003"]
    assert main(["explore", *words, "--out", str(tmp_path)]) == 0
    log = read_log(tmp_path / "latest.mcap")
    again: Any = LoggedRun.of(log).plan()
    assert again.identified == Identified.read(log.attachments[IDENTIFIED_TEXT])
    found = replay_log(log)
    assert found.should_be_identical
    assert found.commands.identical == found.commands.count
    other = replay_log(log, {"speed": 0.03})
    assert 0 < other.commands.identical < other.commands.count  # landing is as it was: the law is the same
    with pytest.raises(InvalidValueError, match="identify: a replay cannot change it: the log keeps"):
        replay_log(log, {"identify": False})


def test_what_was_identified_is_read_back_as_it_was_written():
    assert Identified.read(FOUND.text) == FOUND
    assert isinstance(FOUND.law(1e-3), Admittance)
    assert isinstance(replace(FOUND, mass=0.0).law(1e-3), DirectForce)
    with pytest.raises(InvalidValueError, match=r"identified\.yaml: .*force_gain"):
        Identified.read(FOUND.text.replace("force_gain: 0.0115", "force_gain: 0"))


def test_pressing_is_announced_until_it_is_done_and_a_log_keeps_what_it_found():
    assert not plan_of(ExploreConfig(**SMALL)).preparation
    planned = plan_of(ExploreConfig(identify=True, **SMALL))
    assert planned.preparation.startswith("pressing")
    done = planned.with_identified(FOUND)
    assert not done.preparation
    assert done.prepared() is done
    assert planned_again(done).identified == FOUND


def test_changes_of_the_gain_are_checked_against_what_was_identified():
    planned = plan_of(ExploreConfig(robot="stage", identify=True, change=((1.0, "force_gain", 1.6e-3),), **SMALL))
    with pytest.raises(InvalidValueError, match=r"change after 1 s: force_gain = 0\.0016 m/s/N: must lie between"):
        planned.with_identified(replace(FOUND, mass=0.0, force_gain=1.0 / 1400.0, delay=0.05))


@pytest.mark.parametrize("force", [0.3, 2.0, 15.0])
def test_it_presses_about_the_set_force_within_touch_and_limit(force):
    planned = plan_of(ExploreConfig(robot="stage", force=force, identify=True, **SMALL))
    pressing = planned.pressing()
    assert planned.ready.touch_force < pressing.low < force < pressing.high < planned.limits.force
    assert 2.0 * pressing.swing <= pressing.high - pressing.low
