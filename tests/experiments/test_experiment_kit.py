"""Rules that hold for every experiment: parts, options and their ranges, examples in the help, advice."""

import dataclasses
import importlib
import math
import pkgutil
import re
import typing
from dataclasses import dataclass, make_dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import palpate
from palpate.cli import main, typed_commands
from palpate.commands.replay.run import changed_config, unchangeable
from palpate.commands.typed_options import read_experiment
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.friction.experiment import FindFriction
from palpate.experiments.grasp.experiment import GraspObject
from palpate.experiments.kit import ExperimentDefaults
from palpate.experiments.kit.checks import check_compression
from palpate.experiments.kit.options import spec_of
from palpate.experiments.kit.registry import CONFIG_FIELDS, check_experiment, experiment_named, experiment_names
from palpate.experiments.kit.run_report import ADVICE, DEVICE_ADVICE, advice_on_ending
from palpate.experiments.kit.script import perform, plan_for
from palpate.robots.robot import load_robot
from palpate.runtime import Cause, DeviceWatchdog, Ending, RobotRest, RunResult, Trip
from palpate.unit_ranges import RANGES, check_unit_range
from reporting.test_report import parsed
from support.explore_runs import plan_of
from support.found_friction import friction_file

SCRIPT = Path(__file__).parents[2] / "examples" / "my_texture.py"


@dataclass(frozen=True)
class Plain:
    robot: str = "stage"
    seed: int = 0
    out: Path = Path("runs/mine")


class Mine(ExperimentDefaults):
    name, summary, Config, metrics = "mine", "Nothing.", Plain, ()

    def plan(self, config, robot, attachments): ...

    def evaluate(self, plan, recorded): ...


@pytest.mark.parametrize("name", [*experiment_names(), f"{SCRIPT}:Texture"])
def test_every_experiment_is_one(name):
    check_experiment(name, experiment_named(name))


def test_one_without_fault_passes():
    check_experiment("mine", Mine())


Lacking = type("Lacking", (), {"name": "mine", "summary": "", "Config": Plain, "metrics": (), "plan": Mine.plan})
Thawed = dataclass(type("Thawed", (), {"__annotations__": Plain.__annotations__, **vars(Mine.Config())}))


def wrong(**changed):
    return type("Wrong", (Mine,), changed)


def bare(missing):
    """A config that lacks one of the fields that every config has."""
    rest = [(name, str, "") for name in CONFIG_FIELDS if name != missing]
    return make_dataclass("Bare", rest, frozen=True)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (wrong(name=3), "Wrong is no experiment.*name = 3.*must be a text"),
        (wrong(plan=None), "Wrong is no experiment.*plan = None.*must be a method"),
        (wrong(metrics=[]), r"Wrong is no experiment.*metrics = \[\].*must be a tuple of Metric"),
        (wrong(metrics=(3,)), r"Wrong is no experiment.*metrics = \(3,\).*must be a tuple of Metric"),
        (wrong(Config=dict), r"Wrong is no experiment.*Config = .*@dataclass\(frozen=True\)"),
        (wrong(Config=Thawed), r"Wrong is no experiment.*Config = .*@dataclass\(frozen=True\)"),
        (Lacking, "Lacking is no experiment: it lacks evaluate, report, files, cloud: add"),
        *(
            (wrong(Config=bare(name)), f"Bare lacks the field {name}: add it, for example {name}")
            for name in CONFIG_FIELDS
        ),
    ],
)
def test_a_mistake_is_named_with_the_class_and_the_remedy(kind, message):
    with pytest.raises(InvalidValueError, match=message):
        check_experiment("mine", kind())


@pytest.mark.parametrize(("name", "value"), [("seed", 2), ("out", "elsewhere")])
def test_what_every_config_has_a_replay_cannot_change_without_metadata(name, value):
    assert name in unchangeable(Plain)
    with pytest.raises(InvalidValueError, match=f"{name}: a replay cannot change it"):
        changed_config(Plain(), {name: value})


# --- Every example that `palpate friction --help` and `palpate grasp --help` give can be typed as it stands ---


EXPERIMENTS = (FindFriction(), GraspObject())


def examples(experiment):
    """The lines of a help text that are commands, each with what it is of."""
    lines = [line.strip() for line in (experiment.Config.__doc__ or "").splitlines()]
    return [(experiment, line) for line in lines if line.startswith(f"palpate {experiment.name}")]


@pytest.fixture
def found_first(tmp_path, monkeypatch):
    """A folder with what `palpate friction` leaves behind."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "runs" / "friction"
    folder.mkdir(parents=True)
    friction_file(folder)


@pytest.mark.parametrize(("experiment", "line"), [example for each in EXPERIMENTS for example in examples(each)])
def test_an_example_can_be_planned(experiment, line, found_first):
    command = f"palpate {experiment.name}"
    config, _ = read_experiment(experiment.Config, experiment.name, command, line.split()[2:], ())
    plan_for(experiment, config)


def test_there_are_examples():
    assert min(len(examples(each)) for each in EXPERIMENTS) >= 6


# --- Advice on how a run ended: by its cause, in commands that exist ---


TYPED = re.compile(r"`palpate ([a-z][a-z-]*)")
RESULT = RunResult(Ending.DONE, None, None, RobotRest.at_rest(), 1.0, 1.0, None, None)


def advised(robot, **how):
    planned: Any = SimpleNamespace(robot=load_robot(robot), config=SimpleNamespace(robot=robot))
    return advice_on_ending("explore", planned, replace(RESULT, **how))


def tripped(cause):
    return {"ending": Ending.TRIPPED, "trip": Trip(0.5, "something", "1", "0", cause)}


def test_a_run_that_was_done_and_came_to_rest_needs_no_advice():
    assert advised("ur5e-netft") == ()


@pytest.mark.parametrize("cause", Cause)
def test_each_cause_has_its_own_advice(cause):
    (found,) = advised("ur5e-netft", **tripped(cause))
    others = [advised("ur5e-netft", **tripped(other)) for other in Cause if other is not cause]
    assert (found,) not in others
    assert ("reduce force" in found) == (cause is Cause.FORCE)
    assert ("palpate recover ur5e-netft" in found) == (cause in (Cause.WIRE, Cause.DEVICE))


def test_a_simulation_has_no_devices_to_recover():
    rest = RobotRest.not_known((DeviceWatchdog("it", "stops", 0.1, "look"),))
    for cause in Cause:
        assert "recover" not in " ".join(advised("stage", rest=rest, **tripped(cause)))
    assert "palpate recover ur5e-netft" in " ".join(advised("ur5e-netft", rest=rest))


def test_every_command_that_a_message_names_exists():
    root = Path(palpate.__file__).parent  # its links are not followed by themselves
    sources = [path.read_text() for folder in (root, *root.iterdir()) for path in folder.rglob("*.py")]
    named = {
        name for text in (*sources, *ADVICE.values(), *DEVICE_ADVICE.values()) for name in TYPED.findall(text)
    }
    assert "recover" in named
    assert named - {"experiment", *typed_commands()} == set()


# --- Every number of every configuration keeps to what its unit can be ---


IMPOSSIBLE = (1e308, -1e308, 5e-324, math.nan, -math.inf, 10**400)
REQUIRED = {"sensor": "a.yaml", "loads": "a.csv", "poses": "a.csv", "live": "stage", "file": "a.yaml"}
REQUIRED |= {"preset": "wrist", "map": "a.ply", "reference": "b.stl", "robot": "stage", "experiment": "explore"}
REQUIRED |= {
    "log": "a.mcap",
    "what": "a.mcap",
    "address": "5000",
    "device": "arm",
    "fault": "none",
    "shell": "bash",
}


def configs():
    """Every dataclass that is called a Config, wherever it stands."""
    names = [each.name for each in pkgutil.walk_packages(palpate.__path__, "palpate.") if "config" in each.name]
    found = [kind for name in names for kind in vars(importlib.import_module(name)).values()]
    kinds = {kind.__name__: kind for kind in found if isinstance(kind, type) and dataclasses.is_dataclass(kind)}
    return [kinds[name] for name in sorted(kinds) if name.endswith("Config")]


def with_value(kind, value):
    """A value of a type in which a number stands wherever one can; None if none can."""
    if kind is float:
        return value
    parts = [each for each in typing.get_args(kind) if each is not Ellipsis]
    if typing.get_origin(kind) is tuple:
        filled = [with_value(each, value) for each in parts]
        if any(each is not None for each in filled):
            return tuple("force" if each is None else each for each in filled)
        return None
    return next((found for found in (with_value(each, value) for each in parts) if found is not None), None)


def cases():
    for kind in configs():
        hints = typing.get_type_hints(kind)
        for field in dataclasses.fields(kind):
            if with_value(hints[field.name], 1.0) is not None:
                yield pytest.param(kind, field, hints[field.name], id=f"{kind.__name__}.{field.name}")


@pytest.mark.parametrize(("kind", "field", "hint"), list(cases()))
def test_a_number_that_no_quantity_has_is_refused_by_name(kind, field, hint):
    for number in IMPOSSIBLE:
        wanted = [each.name for each in dataclasses.fields(kind) if each.default is dataclasses.MISSING]
        given = {name: REQUIRED[name] for name in (*wanted, *(["live"] if kind.__name__ == "TareConfig" else []))}
        own, its = given | {field.name: with_value(hint, number)}, spec_of(field)
        if its.choice:
            own[its.choice] = its.choices[0]
        with pytest.raises(InvalidValueError, match=rf"^{field.name}\b") as refused:
            kind(**own)
        assert len(str(refused.value)) < 400


def test_the_walk_sees_every_configuration():
    assert {"ExploreConfig", "RegulateConfig", "FrictionConfig", "GraspConfig", "TareConfig"} <= {
        kind.__name__ for kind in configs()
    }
    assert len(list(cases())) > 80


@pytest.mark.parametrize("unit", RANGES)
def test_a_range_takes_its_ends_and_zero_with_either_sign(unit):
    for size in (RANGES[unit].least, RANGES[unit].most):
        for number in (size, -size):
            assert check_unit_range("x", number, unit) == number
        with pytest.raises(InvalidValueError, match="another unit"):
            check_unit_range("x", size * (2.0 if size > 1.0 else 0.5), unit)
    assert check_unit_range("x", -0.0, unit) == 0.0


# --- What is said of values in another unit, of another type, or out of all proportion ---


@given(st.floats(1.0, 1e6))
def test_a_stiffness_is_doubted_where_the_tip_is_not_to_blame(stiffness):
    tip = 0.5 * 2.0 / stiffness
    check_compression((1.01 * tip,), 2.0, stiffness)
    with pytest.raises(InvalidValueError) as refused:
        check_compression((0.99 * tip,), 2.0, stiffness)
    assert ("is the stiffness in another unit" in str(refused.value)) is (stiffness < 1e3)


def test_the_time_of_an_active_exploration_bounds_what_is_foreseen_of_it():
    free, *timed = (plan_of(ExploreConfig(strategy="active", time=time)) for time in (None, 1.0, 5.0, 20.0, 1e3))
    foreseen = [(each.expected_duration, each.longest_duration) for each in timed]
    assert foreseen == sorted(foreseen)
    assert foreseen[-1] == (free.expected_duration, free.longest_duration)
    expected, longest = foreseen[1]
    assert 5.0 < expected < 12.0
    assert longest < 0.1 * free.longest_duration


@pytest.mark.parametrize("form", ["csv", "jsonl"])
def test_no_zero_of_a_contact_is_written_with_a_sign(tmp_path, form):
    """A push along the normal has no spin torque: n.m is a sum of products with both signs of zero."""
    (tmp_path / "w.csv").write_text("fx,fy,fz,mx,my,mz\n0,0,-2,0,0,0\n0,0,2,0,0,0\n-1,0,0,0,0,0\n0,-1,0,0,0,0\n")
    out = tmp_path / "c.txt"
    assert (
        main(["contact", str(tmp_path / "w.csv"), "--sphere", "0.008", "--format", form, "--out", str(out)]) == 0
    )
    cells = out.read_text().replace("]", ",").replace("[", ",").replace("}", ",").replace(" ", "").split(",")
    assert not {"-0.0", '"spin_torque_Nm":-0.0'} & set(cells)


# --- Results show themselves in a notebook, and runs how far they have got ---


@pytest.mark.slow
def test_a_notebook_shows_the_outcome_with_one_picture_and_a_bar_while_it_runs(capsys):
    experiment, seen = experiment_named("regulate"), []
    config = experiment.Config(duration=0.5)
    found = perform(experiment, config, observers=(lambda *period: seen.append(period),), progress=True)
    assert len(seen) > 500
    shown = parsed(found._repr_html_())
    assert shown.tags.count("img") == 1
    assert experiment.report(found).outcome in shown.text
    assert perform(experiment, config).run.duration == found.run.duration, "a bar changes nothing"
