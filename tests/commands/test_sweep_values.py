"""What is typed for a sweep becomes the runs that it says, each with its place and its seed, or is refused."""

import math
from fractions import Fraction
from itertools import permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate.commands.sweep.typed_values import fixed_options, varied_options

from palpate.commands.sweep.config import SweepConfig
from palpate.commands.sweep.plan import MOST_RUNS, simulated_durations, sweep_plan
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan as plan_exploration
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.regulate.config import RegulateConfig
from support.sweep_runs import SHORT, planned

typed_numbers = st.decimals(-1000, 1000, allow_nan=False, allow_infinity=False, places=3)


def values(word, kind=RegulateConfig):
    (found,) = varied_options([word], kind)
    return found.values


# --- ranges


@given(typed_numbers, typed_numbers, st.integers(2, 40))
def test_a_range_has_the_floats_nearest_to_the_true_numbers_ends_included(first, last, count):
    if first == last:
        return
    found = values(f"force={first}:{last}:{count}")
    true = [Fraction(first) + (Fraction(last) - Fraction(first)) * i / (count - 1) for i in range(count)]
    assert found == tuple(float(each) for each in true)
    assert (found[0], found[-1]) == (float(first), float(last))
    assert values(f"force={last}:{first}:{count}") == found[::-1]


def test_a_range_of_tenths_is_what_people_write():
    assert values("force=0.1:0.5:5") == (0.1, 0.2, 0.3, 0.4, 0.5)
    assert values("force=1e-3:3e-3:3") == (0.001, 0.002, 0.003)


def test_whole_numbers_stay_whole_where_an_option_is_one():
    found = values("repeats=1:5:5", FrictionConfig)
    assert found == (1, 2, 3, 4, 5)
    assert {type(each) for each in found} == {int}


# --- lists


@pytest.mark.parametrize(
    ("word", "kind", "expected"),
    [
        ("force=1, 2", RegulateConfig, (1.0, 2.0)),
        ("surface=still,sine", RegulateConfig, ("still", "sine")),
        ("identify=false,true", RegulateConfig, (False, True)),
        ("swing=null,0.5", RegulateConfig, (None, 0.5)),
        ("landing-speed=1e-3", RegulateConfig, (0.001,)),
        ("mu=0.2,0.3", RegulateConfig, (0.2, 0.3)),
        ("tip=0.006,0.008", ExploreConfig, ((0.006,), (0.008,))),
        ("tip=[0.008],[0.008,0.008,0.012]", ExploreConfig, ((0.008,), (0.008, 0.008, 0.012))),
    ],
)
def test_a_list_has_values_of_the_options_type(word, kind, expected):
    assert values(word, kind) == expected


def test_what_is_set_takes_several_numbers_as_one_value():
    assert fixed_options(["tip=0.008,0.008,0.012", "force=3"], ExploreConfig) == {
        "tip": (0.008, 0.008, 0.012),
        "force": 3.0,
    }


# --- places and seeds


def test_every_combination_has_every_seed_and_the_same_ones():
    plan = planned("force=1,2", "surface=still,soft,sine", seeds=3, fixed=(*SHORT, "seed=7"))
    found = [(run.case.config.force, run.case.config.surface, run.case.config.seed) for run in plan.runs]
    assert found == [(f, s, seed) for f in (1.0, 2.0) for s in ("still", "soft", "sine") for seed in (7, 8, 9)]
    assert [run.number for run in plan.runs] == [run.case.run for run in plan.runs] == list(range(18))


def test_what_a_run_is_does_not_depend_on_the_order_of_options_nor_on_what_else_is_varied():
    words = ("force=1,2", "friction=0.2,0.4", "surface=still,soft")
    common = {
        frozenset((run.case.config.force, run.case.config.seed, run.case.digest) for run in planned(*order).runs)
        for order in permutations(words)
    }
    assert len(common) == 1
    (alone,) = planned("force=2", fixed=(*SHORT, "friction=0.4", "surface=soft")).runs
    assert alone.case.digest in {digest for _, _, digest in next(iter(common))}


def test_runs_that_differ_in_anything_have_other_digests():
    plan = planned("force=1,2", "friction=0.2,0.4", seeds=3)
    other = planned("force=1,2", "friction=0.2,0.4", seeds=3, fixed=(*SHORT, "drift=2"))
    digests = [run.case.digest for run in (*plan.runs, *other.runs)]
    assert len(set(digests)) == len(digests)


def test_a_file_is_what_is_in_it_wherever_it_lies(tmp_path):
    def digest(folder, text):
        (tmp_path / folder).mkdir(exist_ok=True)
        file = tmp_path / folder / "motion.csv"
        file.write_text(text)
        (run,) = planned(fixed=(*SHORT, "motion=table", f"motion_file={file}")).runs
        return run.case.digest

    one = digest("a", "0,0,0,0\n1,0.001,0,0\n")
    assert digest("b", "0,0,0,0\n1,0.001,0,0\n") == one
    assert digest("a", "0,0,0,0\n1,0.002,0,0\n") != one


def test_an_experiment_file_goes_before_defaults_and_behind_what_is_typed(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("force: 3\nfriction: 0.6\ndrift: 2\n")
    (run,) = planned("friction=0.5", fixed=("drift=1.5",), config=file).runs
    assert (run.case.config.force, run.case.config.friction, run.case.config.drift) == (3.0, 0.5, 1.5)


def test_a_robot_brings_its_own_values_whether_set_or_varied():
    plan = planned("robot=stage,stage-nano17", experiment="explore", fixed=())
    perfect, honest = (plan_exploration(run.case.config).config for run in plan.runs)
    assert perfect.force_noise == 0.0
    assert honest.force_noise > 0.0
    (alone,) = planned(experiment="explore", fixed=("robot=stage-nano17",)).runs
    assert alone.case.digest == plan.runs[1].case.digest


# --- mistakes


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        (["forse=1,2"], ["no option forse", "did you mean force?"]),
        (["speed_mm=1,2"], ["no option speed_mm", "landing_speed"]),
        (["zzz=1"], ["no option zzz", "there are object, surface"]),
        (["force"], ["--vary force", "NAME=VALUE"]),
        (["force="], ["NAME=VALUE"]),
        (["force=1,2,1"], ["1 stands there twice", "--seeds"]),
        (["force=1", "force=2"], ["force is varied twice"]),
        (["force=1:2"], ["force=1:2", "FIRST:LAST:COUNT"]),
        (["force=0.01:0.05:"], ["FIRST:LAST:COUNT"]),
        (["force=1:2,3"], ["force=1:2,3", "must be a number"]),
        (["force=1:2:x"], ["FIRST:LAST:COUNT"]),
        (["force=1:2:1"], ["a whole one from 2"]),
        (["force=1:2:2.5"], ["a whole one from 2"]),
        (["force=1,two"], ["force", "two", "must be a number"]),
        (["surface=still,wavy"], ["surface", "wavy", "known: still, sine"]),
        (["surface=still,sien"], ["did you mean sine?"]),
        (["seed=1,2"], ["--seeds"]),
        (["out=a,b"], ["--out"]),
        (["force=-1,2"], ["with force=-1", "above 0"]),
        (["force=1,14", "swing=0.5,1.5", "profile=ramp"], ["with force=14, swing=1.5", "at most 15 N"]),
        (["force=[1"], ["no valid YAML"]),
    ],
)
def test_a_mistake_is_named_with_what_would_be_right(vary, words):
    with pytest.raises(InvalidValueError) as refused:
        planned(*vary)
    for word in words:
        assert word in str(refused.value)


def test_an_option_is_varied_or_set():
    with pytest.raises(InvalidValueError, match="friction is varied and set"):
        planned("friction=0.2,0.3", fixed=("mu=0.3",))


def test_far_too_many_runs_are_refused_before_they_are_made():
    with pytest.raises(InvalidValueError, match=f"at most {MOST_RUNS}"):
        planned("force=1:2:1000", "friction=0.1:0.9:1000")


@pytest.mark.parametrize(("name", "value"), [("seeds", 0), ("jobs", 0), ("ray", " ")])
def test_counts_begin_with_one(name, value):
    with pytest.raises(InvalidValueError, match=name):
        SweepConfig("regulate", **{name: value})


def test_what_only_the_world_can_tell_is_found_out_before_anything_runs():
    plan = planned("friction=0.3,0.005", experiment="explore", fixed=())
    with pytest.raises(InvalidValueError, match=r"with friction=0\.005: friction = 0\.005"):
        simulated_durations(plan)


@pytest.mark.parametrize("robot", ["ur5e-netft", "emulated-ur5e"])
def test_no_sweep_moves_a_robot_that_is_real_or_seems_so(robot):
    plan = planned("force=1,2", fixed=(f"robot={robot}",))
    with pytest.raises(InvalidValueError, match="simulated robots only"):
        simulated_durations(plan)


@pytest.mark.parametrize("experiment", ["explore", "regulate", "friction", "grasp"])
def test_every_experiment_can_be_foretold(experiment):
    durations = simulated_durations(planned(experiment=experiment, fixed=()))
    assert len(durations) == 1
    assert 1.0 < durations[0] < 3600.0
    assert math.isfinite(sum(durations))


def test_a_plan_needs_no_more_than_what_is_typed():
    assert len(sweep_plan(SweepConfig("grasp")).runs) == 1
