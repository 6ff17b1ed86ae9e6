"""Sweeps before and between their runs: values, places, seeds and the folder that keeps what is finished."""

import itertools
import os
import signal
import time
from dataclasses import dataclass
from fractions import Fraction
from itertools import permutations
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.commands.sweep import SweepConfig
from palpate.commands.sweep.plan import MOST_RUNS, expected_durations, sweep_plan
from palpate.commands.sweep.store import RunRecord, RunStatus, SweepFolder, read_record, record_text
from palpate.commands.typed_values import set_options, varied_options
from palpate.errors import InvalidValueError
from palpate.experiments.kit.config_file import read_config
from palpate.experiments.kit.options import option
from palpate.experiments.kit.registry import experiment_names
from support.sweep_runs import SHORT, config_of, planned
from support.waiting import until

typed_numbers = st.decimals(-1000, 1000, allow_nan=False, allow_infinity=False, places=3)


@dataclass(frozen=True)
class Kinds:
    """Options of every kind."""

    force: float = 2.0
    swing: float | None = None
    landing_speed: float = 0.01
    repeats: int = 1
    surface: Literal["still", "sine"] = "still"
    identify: bool = False
    tip: tuple[float, ...] = ()
    friction: float = option(0.5, symbol="mu")


def values(word):
    (found,) = varied_options([word], Kinds, {})
    return found.values


# --- ranges


@pytest.mark.slow
@given(typed_numbers, typed_numbers, st.integers(2, 40))
def test_a_range_has_the_floats_nearest_to_the_true_numbers_ends_included(first, last, count):
    if first == last:
        return
    found = values(f"force={first}:{last}:{count}")
    true = [Fraction(first) + (Fraction(last) - Fraction(first)) * i / (count - 1) for i in range(count)]
    assert found == tuple(float(each) for each in true)
    assert (found[0], found[-1]) == (float(first), float(last))
    assert values(f"force={last}:{first}:{count}") == found[::-1]


# --- lists


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("force=0.1:0.5:5", (0.1, 0.2, 0.3, 0.4, 0.5)),
        ("repeats=1:5:5", (1, 2, 3, 4, 5)),
        ("force=1, 2", (1.0, 2.0)),
        ("surface=still,sine", ("still", "sine")),
        ("identify=false,true", (False, True)),
        ("swing=null,0.5", (None, 0.5)),
        ("landing-speed=1e-3", (0.001,)),
        ("mu=0.2,0.3", (0.2, 0.3)),
        ("tip=0.006,0.008", ((0.006,), (0.008,))),
        ("tip=[0.008],[0.008,0.008,0.012]", ((0.008,), (0.008, 0.008, 0.012))),
    ],
)
def test_a_list_has_values_of_the_options_type(word, expected):
    assert values(word) == expected


# --- places and seeds


def test_every_combination_has_every_seed_and_the_same_ones():
    plan = planned("force=1,2", "surface=hard,soft", seeds=3, fixed=(*SHORT, "seed=7"))
    asked = [(read_config(run.case.config, plan.experiment.Config), run.case.seed) for run in plan.runs]
    found = [(config.force, config.surface, seed) for config, seed in asked]
    assert found == [(f, s, seed) for f in (1.0, 2.0) for s in ("hard", "soft") for seed in (7, 8, 9)]
    assert [run.number for run in plan.runs] == [run.case.run for run in plan.runs] == list(range(12))


def test_what_a_run_is_does_not_depend_on_the_order_of_options_nor_on_what_else_is_varied():
    words = ("force=1,2", "speed=0.01,0.02", "surface=hard,soft")
    common = {
        frozenset((config_of(run).force, run.case.seed, run.case.digest) for run in planned(*order).runs)
        for order in permutations(words)
    }
    assert len(common) == 1
    (alone,) = planned("force=2", fixed=(*SHORT, "speed=0.02", "surface=soft")).runs
    assert alone.case.digest in {digest for _, _, digest in next(iter(common))}


def test_runs_that_differ_in_anything_have_other_digests():
    varied = ("force=1,2", "speed=0.01,0.02")
    plans = planned(*varied, seeds=3), planned(*varied, seeds=3, fixed=(*SHORT, "reach=0.02"))
    assert len({run.case.digest for plan in plans for run in plan.runs}) == 24


def test_a_file_is_what_is_in_it_wherever_it_lies(tmp_path):
    def digest(folder, text):
        (tmp_path / folder).mkdir(exist_ok=True)
        file = tmp_path / folder / "motion.csv"
        file.write_text(text)
        (run,) = planned(experiment="regulate", fixed=("motion=table", f"motion_file={file}")).runs
        return run.case.digest

    one = digest("a", "0,0,0,0\n1,0.001,0,0\n")
    assert digest("b", "0,0,0,0\n1,0.001,0,0\n") == one
    assert digest("a", "0,0,0,0\n1,0.002,0,0\n") != one


def test_an_experiment_file_goes_before_defaults_and_behind_what_is_typed(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("force: 3\nspeed: 0.03\nreach: 0.02\n")
    (run,) = planned("speed=0.02", fixed=("reach=0.015",), config=file).runs
    assert (config_of(run).force, config_of(run).speed, config_of(run).reach) == (3.0, 0.02, 0.015)


# --- mistakes


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        (["forse=1,2"], ["no option forse", "did you mean force?"]),
        (["speed_mm=1,2"], ["no option speed_mm", "did you mean speed?"]),
        (["zzz=1"], ["no option zzz", "there are force, speed"]),
        (["mu=0.1,0.2"], ["no option mu", "there are force, speed"]),
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
        (["surface=soft,wavy"], ["surface", "wavy", "known: hard, soft"]),
        (["surface=hard,sotf"], ["did you mean soft?"]),
        (["seed=1,2"], ["--seeds"]),
        (["out=a,b"], ["--out"]),
        (["force=1,2", "speed=0.01,-0.01"], ["with force=1, speed=-0.01", "above 0"]),
        (["force=[1"], ["no valid YAML"]),
        (["time=1,2"], ["time is varied and set"]),
        (["force=1:2:1000", "speed=0.01:0.02:1000"], [f"at most {MOST_RUNS}"]),
    ],
)
def test_a_mistake_is_named_with_what_would_be_right(vary, words):
    with pytest.raises(InvalidValueError) as refused:
        planned(*vary)
    assert all(word in str(refused.value) for word in words), str(refused.value)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["force=1", "force=2"], "--set force=2: force is set twice"),
        (["force"], "--set force: write NAME=VALUE, as force=3, without spaces"),
        (["force=two"], "--set force=two: force"),
        (["out=a"], "--set out=a: not here"),
        (["force=[1"], "no valid YAML"),
    ],
)
def test_what_cannot_be_set_is_refused(words, told):
    with pytest.raises(InvalidValueError) as refused:
        set_options(words, Kinds, {"out": "not here"})
    assert told in str(refused.value)


@pytest.mark.parametrize("robot", ["ur5e-netft", "emulated-ur5e"])
def test_no_sweep_moves_a_robot_that_is_real_or_seems_so(robot):
    plan = planned("force=1,2", fixed=(f"robot={robot}",))
    with pytest.raises(InvalidValueError, match="simulated robots only"):
        expected_durations(plan)


@pytest.mark.parametrize("experiment", experiment_names())
def test_every_experiment_tells_how_long_it_takes_and_needs_no_options(experiment):
    (duration,) = expected_durations(sweep_plan(SweepConfig(experiment)))
    assert 1.0 < duration < 3600.0


# --- The folder of a sweep: whatever kills its writer, what is finished is there, whole, and nothing else is ---


LARGE = 1_000_000
"""Letters that take long to write."""

figure_values = (
    st.none()
    | st.booleans()
    | st.integers(-(2**53), 2**53)
    | st.text()
    | st.floats(allow_nan=False, allow_infinity=False)
)


def record_for(plan, number, **more):
    case = plan.runs[number].case
    fields = {"status": RunStatus.DONE, "metrics": {"x": 0.1 + number}, "duration": 1.0}
    return RunRecord(run=number, digest=case.digest, seed=case.seed, **(fields | more))


@given(st.dictionaries(st.text(), figure_values), st.text(), st.sampled_from(RunStatus))
def test_a_record_reads_back_to_the_last_bit(metrics, message, status):
    record = RunRecord(run=3, digest="a", seed=2**62, status=status, message=message, metrics=metrics)
    back = read_record(record_text(record))
    assert back == record
    assert [type(value) for value in back.metrics.values()] == [type(value) for value in metrics.values()]


def test_finished_runs_are_there_again_and_what_cannot_be_read_is_run_again(tmp_path):
    plan, folder = planned("force=1:4:4"), SweepFolder(tmp_path)
    assert folder.begin(plan) == {}
    kept = [record_for(plan, number) for number in (0, 2, 3)]
    for record in kept:
        folder.keep(record)
    (tmp_path / "runs" / "000003.json").write_bytes(b"")  # as after a loss of power
    (tmp_path / "runs" / ".000001.json.0123abcd.part").write_bytes(b"{")  # as after a kill
    assert folder.begin(plan) == {0: kept[0], 2: kept[1]}
    assert not list((tmp_path / "runs").glob(".*"))


def test_a_record_of_another_run_is_not_taken_for_this_one(tmp_path):
    plan, other, folder = planned("force=1,2"), planned("force=3,4"), SweepFolder(tmp_path)
    folder.begin(plan)
    folder.keep(record_for(other, 1))
    folder.keep(record_for(plan, 0))
    (tmp_path / "runs" / "000000.json").rename(tmp_path / "runs" / "000001.json")
    assert folder.finished(plan) == {}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"vary": ("force=1,2,3",)}, ["force 1,2 there, 1,2,3 now"]),
        ({"vary": ("speed=0.02",)}, ["force 1,2 there, not varied now", "speed not varied there, 0.02 now"]),
        ({"seeds": 5}, ["seeds 1 there, 5 now"]),
        ({"fixed": (*SHORT, "seed=4")}, ["first seed 0 there, 4 now", "seed not set there, 4 now"]),
        ({"fixed": ("time=0.03", "noise=0.01")}, ["time 0.02 there, 0.03 now"]),
    ],
)
def test_another_sweep_is_refused_and_told_what_differs(tmp_path, change, words):
    SweepFolder(tmp_path).begin(planned("force=1,2"))
    now = {"vary": ("force=1,2",), **change}
    with pytest.raises(InvalidValueError, match="holds another sweep") as refused:
        SweepFolder(tmp_path).begin(planned(*now.pop("vary"), **now))
    assert all(word in str(refused.value) for word in (*words, "--out")), str(refused.value)


def test_a_file_that_a_sweep_reads_must_be_the_same(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("speed: 0.02\n")
    folder = SweepFolder(tmp_path / "out")
    folder.begin(planned("force=1,2", config=file))
    folder.begin(planned("force=1,2", config=file))
    file.write_text("speed: 0.03\n")
    with pytest.raises(InvalidValueError, match="typed alike, but not the same"):
        folder.begin(planned("force=1,2", config=file))


def test_two_at_once_in_a_folder_are_one_too_many(tmp_path):
    first, second = SweepFolder(tmp_path), SweepFolder(tmp_path)
    with first.alone(), pytest.raises(InvalidValueError, match="at work there"), second.alone():
        pass
    with second.alone():
        pass


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_writer_that_is_killed_at_whatever_instant_leaves_whole_records_and_no_lock(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "O_TMPFILE", 0, raising=False)  # with it, nothing shows that a kill came in time
    plan, folder = planned("force=1:4:4"), SweepFolder(tmp_path)
    torn = 0
    for kill in range(300):
        if torn == 3:
            return
        with folder.alone():
            folder.begin(plan)
            assert not list(folder.runs.glob("*.part")), "what the one before was writing is cleared away"
        writer = os.fork()
        if writer == 0:
            write_for_ever(plan, folder)
        until(lambda: len(list(folder.runs.glob("*.json"))) >= 4)
        time.sleep(0.0007 * (kill % 10))
        os.kill(writer, signal.SIGKILL)
        os.waitpid(writer, 0)
        torn += len(list(folder.runs.glob(".*.part")))
        for file in folder.runs.glob("*.json"):
            record = read_record(file.read_bytes())
            assert record.digest == plan.runs[record.run].case.digest
    pytest.fail("hardly a kill came while something was being written: that shows nothing")


def write_for_ever(plan, folder):
    """Overwrite four large records, with the folder locked."""
    try:
        with folder.alone():
            for turn in itertools.count():
                folder.keep(record_for(plan, turn % 4, message=str(turn % 10) * LARGE))
    finally:
        os._exit(1)


@given(st.binary(max_size=200))
def test_what_is_no_record_is_none(text):
    assert read_record(text) is None
