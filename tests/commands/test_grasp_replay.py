"""Replays of grasps: every finger's command comes out bit for bit, or as what is changed has it."""

import numpy as np
import pytest

from palpate.commands.replay.report import quantities
from palpate.commands.replay.run import replay_log
from palpate.errors import InvalidValueError
from palpate.experiments.grasp.experiment import GraspObject
from palpate.experiments.grasp.plan import GraspPlan
from palpate.experiments.kit.recorded_run import carry_out
from palpate.experiments.kit.recording import log_writer
from palpate.friction.friction_file import FrictionEstimate, FrictionFile, How, friction_file_text
from palpate.runtime import Ending
from palpate.runtime.log import log_in, read_log
from support.grasp_runs import plan_of

pytestmark = pytest.mark.slow  # they look at runs that take seconds

SHORT = {"load": "none", "rise": 0.1, "lift_height": 0.01}


def known(value, lower, upper, how=How.MEASURED):
    return FrictionEstimate(value=value, lower=lower, upper=upper, how=how)


@pytest.fixture(scope="module")
def grasped(tmp_path_factory):
    """Logs of two fingers that were told by a file that is gone, and of three that guess and listen."""
    folder = tmp_path_factory.mktemp("grasps")
    file = folder / "friction.yaml"
    found = FrictionFile(
        palpate_friction=1,
        provenance="a test",
        friction=known(0.45, 0.44, 0.46),
        speed=0.01,
        spin_length=known(0.004, 0.0039, 0.0041),
        load_exponent=known(0.0, 0.0, 0.0, How.ASSUMED),
        norm_exponent=known(2.0, 1.0, 2.0, How.ASSUMED),
    )
    file.write_text(friction_file_text(found))
    logs = {}
    for name, values in {
        "two": {"friction_file": file, "against_ignoring_spin": True},
        "three": {"fingers": 3, "object": "cylinder", "known": "untouched"},
    }.items():
        planned = plan_of(**SHORT, **values)
        log = log_writer(GraspObject(), planned, folder / name)
        assert carry_out(planned, sinks=(log,)).run.ending is Ending.DONE
        logs[name] = log_in(folder / name)
    file.unlink()
    return logs


@pytest.mark.parametrize("name", ["two", "three"])
def test_every_command_comes_out_again_and_all_that_each_finger_sensed(grasped, name):
    found = replay_log(grasped[name])
    assert found.identical, str(found.commands.first)
    assert found.sensing.first is None
    assert found.commands.count > 2000
    log = read_log(grasped[name])
    assert len(log.layout.channels) == {"two": 2, "three": 3}[name]


def test_a_larger_margin_grips_harder_and_lifts_no_other_way(grasped):
    """With the load as it was, the grip beyond the reserve goes with 1 + margin: the file is no longer needed."""
    found = replay_log(grasped["two"], {"margin": 1.0})
    recorded, replayed = found.records()
    assert (recorded.command == replayed.command).all()
    holding = recorded.phase == "hold"
    grips = [
        rows[: found.common, codec.columns["command.grip_force"]][holding, 0]
        for codec, rows in ((found.log.codec, found.log.rows), (found.replay.codec, found.replay.rows))
    ]
    assert (grips[1][-50:] > grips[0][-50:]).all()
    metrics = {metric.name: metric for metric in quantities(found)}
    everywhere = np.abs(
        found.replay.rows[: found.common, found.replay.codec.columns["command.grip_force"]]
        - found.log.rows[: found.common, found.log.codec.columns["command.grip_force"]]
    )
    assert metrics["commanded grip apart, largest"].value == pytest.approx(np.nanmax(everywhere))


def test_a_controller_of_ones_own_is_given_the_plan_of_the_hand(grasped):
    found = replay_log(grasped["three"], controller=lambda planned: planned.controller())
    assert found.identical
    assert isinstance(found.planned, GraspPlan)
    assert found.planned.config.fingers == 3


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"pull": 3.0}, "what pulled then"),
        ({"margim": 0.3}, "did you mean margin"),
        ({"margin": -1.0}, "margin"),
        ({"believed_friction": 0.4}, "leave one out"),
        ({"friction_file": "gone.yaml"}, "gone.yaml"),
    ],
)
def test_what_cannot_be_changed_is_refused_with_its_reason(grasped, settings, told):
    with pytest.raises(InvalidValueError, match=told):
        replay_log(grasped["two"], settings)
