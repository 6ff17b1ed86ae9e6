"""Every example that `palpate friction --help` and `palpate grasp --help` give can be typed as it stands."""

from pathlib import Path
from typing import Any

import pytest
import tyro
from palpate.experiments.grasp.options import default_options as grasp_default

from palpate.commands.run import plan_for
from palpate.commands.typed_options import read_experiment
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.plan import plan as plan_grasp
from palpate.friction.friction_file import Finding, FrictionFile, How, friction_file_text


def examples(command: str, config: type) -> list[str]:
    """Return the lines of a help text that are commands."""
    lines = [line.strip() for line in (config.__doc__ or "").splitlines()]
    return [line for line in lines if line.startswith(f"palpate {command}")]


def asked(line: str, default: Any) -> Any:
    """Return the configuration that a line asks for, as the command line reads it."""
    words = line.split()[2:]
    options = default(words)
    return tyro.cli(type(options), args=words, default=options).settled


@pytest.fixture
def found_first(tmp_path, monkeypatch):
    """A folder with what `palpate friction` leaves behind."""
    monkeypatch.chdir(tmp_path)
    path = Path("runs/friction/friction.yaml")
    path.parent.mkdir(parents=True)

    def finding(value: float) -> Finding:
        return Finding(value=value, lower=0.99 * value, upper=1.01 * value, how=How.MEASURED)

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


@pytest.mark.parametrize("line", examples("friction", FrictionConfig))
def test_an_example_of_rubbing_can_be_planned(line):
    config, _ = read_experiment(FrictionConfig, "friction", "palpate friction", line.split()[2:], ())
    plan_for(FRICTION, config)


@pytest.mark.parametrize("line", examples("grasp", GraspConfig))
def test_an_example_of_grasping_can_be_planned(line, found_first):
    plan_grasp(asked(line, grasp_default))


def test_there_are_examples():
    assert min(len(examples("friction", FrictionConfig)), len(examples("grasp", GraspConfig))) >= 6
