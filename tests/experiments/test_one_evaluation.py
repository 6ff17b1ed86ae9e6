"""A run and its log are evaluated alike: every metric is the same, whatever ended the run."""

import pytest

from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.metric import metrics_of
from palpate.experiments.kit.recorded_run import carry_out
from palpate.experiments.kit.recording import log_writer
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.script import plan_for
from palpate.robots.values import load_named_robot
from palpate.runtime import Ending
from palpate.runtime.log import log_in, read_log

SMALL = {"width": 0.02, "depth": 0.004}


@pytest.mark.parametrize(
    ("name", "options", "force_limit", "ending"),
    [
        ("explore", SMALL, 20.0, Ending.DONE),
        ("explore", {**SMALL, "force": 2.65, "force_noise": 0.25}, 3.6, Ending.TRIPPED),
        ("regulate", {"landing_speed": 0.015, "force": 2.2, "stiffness": 100e3}, 3.0, Ending.TRIPPED),
    ],
    ids=["done", "stopped while it scans", "stopped by a knock on landing"],
)
def test_a_log_gives_the_metrics_of_its_run_also_after_a_trip(name, options, force_limit, ending, tmp_path):
    text = load_named_robot("stage").texts["robot.yaml"]
    robot = tmp_path / "low.yaml"
    robot.write_text(
        text.replace(" force_N: 20 ", f" force_N: {force_limit} ").replace(
            "impact_force_N: 40", "impact_force_N: 150"
        )
    )
    experiment = experiment_named(name)
    plan = plan_for(experiment, experiment.Config(robot=str(robot), out=tmp_path, **options))
    result = experiment.evaluate(plan, carry_out(plan, sinks=(log_writer(experiment, plan, tmp_path),)))
    log = read_log(log_in(tmp_path))
    assert result.run.ending is ending
    assert metrics_of(experiment, LoggedRun.of(log).evaluate()) == metrics_of(experiment, result)
