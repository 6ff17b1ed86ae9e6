"""Every example that `palpate friction --help` and `palpate grasp --help` give can be typed as it stands."""

from pathlib import Path

import pytest

from palpate.commands.typed_options import read_experiment
from palpate.experiments.friction.experiment import FindFriction
from palpate.experiments.grasp.experiment import GraspObject
from palpate.experiments.kit.script import plan_for
from palpate.friction.friction_file import FrictionEstimate, FrictionFile, How, friction_file_text

EXPERIMENTS = (FindFriction(), GraspObject())


def examples(experiment):
    """The lines of a help text that are commands, each with what it is of."""
    lines = [line.strip() for line in (experiment.Config.__doc__ or "").splitlines()]
    return [(experiment, line) for line in lines if line.startswith(f"palpate {experiment.name}")]


@pytest.fixture
def found_first(tmp_path, monkeypatch):
    """A folder with what `palpate friction` leaves behind."""
    monkeypatch.chdir(tmp_path)
    path = Path("runs/friction/friction.yaml")
    path.parent.mkdir(parents=True)

    def finding(value: float) -> FrictionEstimate:
        return FrictionEstimate(value=value, lower=0.99 * value, upper=1.01 * value, how=How.MEASURED)

    file = FrictionFile(
        palpate_friction=1,
        provenance="a test",
        friction=finding(0.5),
        speed=0.01,
        spin_length=finding(0.003),
        load_exponent=finding(0.2),
        norm_exponent=finding(1.5),
    )
    path.write_text(friction_file_text(file), encoding="utf-8")


@pytest.mark.parametrize(("experiment", "line"), [example for each in EXPERIMENTS for example in examples(each)])
def test_an_example_can_be_planned(experiment, line, found_first):
    command = f"palpate {experiment.name}"
    config, _ = read_experiment(experiment.Config, experiment.name, command, line.split()[2:], ())
    plan_for(experiment, config)


def test_there_are_examples():
    assert min(len(examples(each)) for each in EXPERIMENTS) >= 6
