"""An experiment is checked when it is found, and the kit supplies what every Config has."""

from dataclasses import dataclass, make_dataclass
from pathlib import Path

import pytest

from palpate.commands.replay.settings import changed_config, unchangeable
from palpate.errors import InvalidValueError
from palpate.experiments.kit import ExperimentDefaults
from palpate.experiments.kit.experiment_checks import CONFIG_FIELDS, check_experiment
from palpate.experiments.kit.registry import experiment_named, experiment_names

SCRIPT = Path(__file__).parents[2] / "examples" / "my_texture.py"


@dataclass(frozen=True)
class Plain:
    robot: str = "stage"
    seed: int = 0
    out: Path = Path("runs/mine")


class Mine(ExperimentDefaults):
    name, summary, Config, figures = "mine", "Nothing.", Plain, ()

    def plan(self, config, robot, texts): ...

    def found(self, plan, recorded): ...


@pytest.mark.parametrize("name", [*experiment_names(), f"{SCRIPT}:Texture"])
def test_every_experiment_is_one(name):
    check_experiment(name, experiment_named(name))


def test_one_without_fault_passes():
    check_experiment("mine", Mine())


Lacking = type("Lacking", (), {"name": "mine", "summary": "", "Config": Plain, "figures": (), "plan": Mine.plan})
Thawed = dataclass(type("Thawed", (), {"__annotations__": Plain.__annotations__, **vars(Mine.Config())}))


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"name": 3}, ["name = 3", "must be a text"]),
        ({"plan": None}, ["plan = None", "must be a method"]),
        ({"figures": []}, ["figures = []", "must be a tuple of Figure"]),
        ({"figures": (3,)}, ["figures = (3,)", "must be a tuple of Figure"]),
        ({"Config": dict}, ["Config = ", "@dataclass(frozen=True)"]),
        ({"Config": Thawed}, ["Config = ", "@dataclass(frozen=True)"]),
    ],
    ids=str,
)
def test_what_is_wrong_is_named_with_the_class_and_the_remedy(changed, words):
    with pytest.raises(InvalidValueError) as refused:
        check_experiment("mine", type("Wrong", (Mine,), changed)())
    assert all(word in str(refused.value) for word in ("Wrong is no experiment", *words)), str(refused.value)


def test_every_missing_part_is_named():
    with pytest.raises(
        InvalidValueError, match="Lacking is no experiment: it lacks found, report, files, cloud: add"
    ):
        check_experiment("mine", Lacking())


@pytest.mark.parametrize("missing", CONFIG_FIELDS)
def test_a_missing_field_is_named_with_an_example(missing):
    rest = [(name, str, "") for name in CONFIG_FIELDS if name != missing]
    config = make_dataclass("Bare", rest, frozen=True)
    with pytest.raises(InvalidValueError, match=f"Bare lacks the field {missing}: add it, for example {missing}"):
        check_experiment("mine", type("Wrong", (Mine,), {"Config": config})())


@pytest.mark.parametrize(("name", "value"), [("seed", 2), ("out", "elsewhere")])
def test_what_every_config_has_a_replay_cannot_change_without_metadata(name, value):
    assert name in unchangeable(Plain)
    with pytest.raises(InvalidValueError, match=f"{name}: a replay cannot change it"):
        changed_config(Plain(), {name: value})
