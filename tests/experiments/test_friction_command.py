"""`palpate friction`: what is found of simulated surfaces, what is kept of it, and how it is asked for."""

import json
import math
import shutil
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.cli import main
from palpate.commands.replay.run import replay_log
from palpate.commands.run import run_experiment
from palpate.errors import InvalidValueError
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.friction.library import library_path
from palpate.experiments.friction.pooled import growth_of, pooled
from palpate.experiments.friction.strokes import FreeAir
from palpate.experiments.friction.words import rubs_by
from palpate.experiments.kit.checks import MIN_TOUCH_FORCE
from palpate.experiments.kit.config_file import config_text, read_config
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.metric import metrics_of
from palpate.friction import LimitSurface
from palpate.friction.friction_file import (
    How,
    friction_file_text,
    load_friction_file,
    read_friction_file,
)
from palpate.friction.materials.library import simulated_materials
from palpate.friction.materials.recognition import RecognitionOutcome
from palpate.friction.rubbing.estimate import Estimate
from palpate.friction.rubbing.sliding import FrictionBound
from palpate.runtime.log import log_in, read_log
from support.found_friction import finding, found_friction
from support.friction_runs import FRICTION, check_measured, planned, rubbed, texts_of
from support.refusals import check_refusals

NOISY = {"force_noise": 0.01, "moment_noise": 1e-4}
QUICK = {"quick": True, "loads": (1.0, 3.0), **NOISY}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Of a quick run by the command itself."""
    out = tmp_path_factory.mktemp("friction")
    config = FrictionConfig(**QUICK, friction=0.7, spin_length=0.002, out=out, library=Path("simulated"))
    assert run_experiment(FRICTION, config).exit_code == 0
    return out


@pytest.fixture(scope="module")
def evaluated(folder):
    """What its log tells."""
    return LoggedRun.of(read_log(log_in(folder))).evaluate()


@pytest.fixture(scope="module")
def sticking():
    """A run on a skin that gives way for longer than the finger may rub."""
    return rubbed(quick=True, loads=(4.0,), skin_stiffness=40.0, most_travel=0.012)


@pytest.fixture(scope="module")
def recognised_run():
    """A run on what the library calls polished steel."""
    steel = {"friction": 0.33, "spin_length": 0.0024, "load_exponent": 0.15, "norm_exponent": 1.8}
    return rubbed(**QUICK, **steel, library=Path("simulated"))


# --- what is found ---


@pytest.mark.slow
def test_mu_and_e_lie_within_their_intervals_which_are_narrow(folder):
    file = load_friction_file(folder / "friction.yaml")
    check_measured(file.friction, 0.7, 0.03)
    check_measured(file.spin_length, 0.002, 0.05)
    assert file.load_exponent.lower <= 0.0 <= file.load_exponent.upper < 0.1
    assert [file.load_exponent.how, file.norm_exponent.how] == [How.MEASURED, How.ASSUMED]
    assert [at.normal_force for at in file.loads] == pytest.approx([1.0, 3.0], rel=0.05)


@pytest.mark.slow
def test_what_is_kept_reads_back_to_the_same_and_is_a_limit_surface(folder):
    path = folder / "friction.yaml"
    file = load_friction_file(path)
    assert read_friction_file(friction_file_text(file)) == file
    assert friction_file_text(file) == path.read_text(encoding="utf-8")
    found = [file.friction, file.spin_length, file.load_exponent, file.norm_exponent]
    assert file.limit_surface() == LimitSurface(*(estimate.value for estimate in found))


@pytest.mark.slow
def test_its_log_tells_the_very_same_again(folder, evaluated):
    """Friction, its intervals, and which material it is."""
    kept = load_friction_file(folder / "friction.yaml")
    assert msgspec.structs.replace(evaluated.file, provenance="") == msgspec.structs.replace(kept, provenance="")
    assert evaluated.recognised.material in kept.provenance
    metrics = metrics_of(FRICTION, evaluated)
    assert metrics["mu_inside"]
    assert metrics["mu_error"] == kept.friction.value - 0.7
    assert metrics["norm_exponent_found"] is None  # assumed


def test_a_log_keeps_its_library_which_may_be_gone_by_then(tmp_path):
    path = tmp_path / "mine.yaml"
    shutil.copy(library_path(FrictionConfig(library=Path("simulated"))), path)
    plan = planned(quick=True, library=path)
    path.unlink()
    assert FRICTION.plan(plan.config, plan.robot, plan.attachments()).library == simulated_materials()


@pytest.mark.slow
def test_the_report_shows_how_often_the_librarys_materials_are_confused_and_which_it_may_be(folder):
    page = (folder / "report.html").read_text(encoding="utf-8")
    part = page.partition("<h2>Which surface it may be")[2].partition("</section>")[0]
    for text in (
        "Materials recognised by touch",
        "data-picture",
        "drawn 50 times for each material",
        "are recognised correctly",
    ):
        assert text in part
    for name in simulated_materials().names:
        assert name in part
    assert part.count("ln likelihood") == len(simulated_materials().names)
    assert part.count("ln likelihood the largest") == 1


@pytest.mark.slow
def test_what_a_library_says_adds_up_and_the_likeliest_stands_first(recognised_run):
    known = recognised_run.recognised
    assert known.recognition.posterior.sum() == pytest.approx(1.0)
    assert "No further touch is needed" in known.words
    assert known.confusion.counts.sum(axis=1).tolist() == [50] * 10
    assert known.confusion.right > 0.9
    rows = [row for row in texts_of(recognised_run, "Which surface it may be").splitlines() if " | " in row]
    posterior = dict(zip(known.recognition.library.names, known.recognition.posterior.tolist(), strict=True))
    shown = [posterior[row.partition(" | ")[0]] for row in rows]
    assert shown == sorted(posterior.values(), reverse=True)
    assert rows[0].startswith("polished steel")
    assert "ln likelihood the largest" in rows[0]


@pytest.mark.slow
def test_without_twists_steel_and_tile_are_confused():
    """Both have the same mu by the library: strokes alone cannot tell them apart, and say so."""
    run = rubbed(friction=0.33, quick=True, loads=(2.0,), robot="stage", library=Path("simulated"))
    known = run.recognised
    assert known.recognition.outcome is RecognitionOutcome.UNDECIDED
    steel, tile = (known.confusion.truths.index(name) for name in ("polished steel", "glazed tile"))
    shares = known.confusion.shares
    assert shares[steel, tile] + shares[tile, steel] > 0.5
    slip = known.advice.slip
    assert slip is None or slip.spin == 0.0  # what this robot cannot do, it is not advised to


@pytest.mark.slow
def test_a_replay_can_change_what_control_goes_by_but_not_the_surface(folder):
    check_refusals(
        (
            "friction: a replay cannot change it: the samples are as recorded",
            lambda: replay_log(folder, {"friction": 0.5}),
        ),
        ("calibration: a replay cannot change it", lambda: replay_log(folder, {"calibration": 0.01})),
    )
    assert not replay_log(folder, {"loads": [2.0, 3.0]}).identical


@pytest.mark.slow
def test_what_never_slipped_gives_bounds_below_the_truth_and_says_so(sticking):
    assert all(isinstance(at.friction, FrictionBound) for at in sticking.found.loads)
    file = sticking.file
    assert file.friction.how is How.BOUND
    assert 0.0 < file.friction.value <= 0.5
    assert math.isinf(file.friction.upper)
    assert file.spin_length is None or file.spin_length.how is How.BOUND
    report = FRICTION.report(sticking)
    assert "It never slipped along the surface: mu is at least" in report.outcome
    assert report.metrics[0].text.startswith("at least")
    assert read_friction_file(friction_file_text(file)) == file
    longest = max(pair.rub.travel for pair in sticking.pairs)
    assert longest == pytest.approx(sticking.plan.wanted.most_travel)


@pytest.mark.parametrize("robot", ["turning-stage", "turning-stage-nano17", "ur5e-sim"])
def test_the_noise_that_was_typed_is_no_touch_whatever_the_robots_sensor(robot):
    """A Nano17's threshold, 0.05 N, is below 6 standard deviations of 10 mN; a perfect sensor has none."""
    for drift in ({}, {"drift": 0.06}):
        plan = planned(quick=True, robot=robot, **NOISY, **drift)
        assert plan.ready.touch_force >= 0.06
    if robot != "turning-stage-nano17":  # of which nothing is known, and which nobody tares
        assert plan.ready.touch_force == MIN_TOUCH_FORCE


@settings(deadline=None, max_examples=50)
@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(0.0, 1.0))
def test_a_zero_that_moves_evenly_is_known_at_all_times(first, last, share):
    air = FreeAir(np.array([1.0, 21.0]), np.outer([first, last], np.ones(6)), np.ones(6))
    wanted = first + share * (last - first)
    assert air.at(np.array([1.0 + 20.0 * share]))[0] == pytest.approx([wanted] * 6, abs=1e-12)


# --- putting estimates together ---


@settings(deadline=None, max_examples=50)
@given(st.floats(0.0, 1.0 / 3.0), st.floats(1e-3, 8e-3), st.lists(st.floats(0.5, 8.0), min_size=2, max_size=5))
def test_growth_is_exact_on_a_power_law(gamma, c, loads):
    if max(loads) < 1.5 * min(loads):
        return
    growth = growth_of(loads, [Estimate(c * f**gamma, 1e-3 * c, 1e-3 * c) for f in loads])
    assert growth.spin_length == pytest.approx(c, rel=1e-6)
    assert growth.load_exponent == pytest.approx(gamma, abs=1e-6)
    shared = growth_of(
        loads, [Estimate(c * f**gamma, 1e-3 * c * f**gamma, 9e-3 * c * f**gamma) for f in loads], 9e-3
    )
    assert shared.spin_length_sd > 9e-3 * c  # what is wrong at all loads alike
    assert shared.load_exponent_sd < 3e-3 / np.ptp(np.log(loads))  # does not grow with them


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(0.1, 1.2), min_size=1, max_size=5), st.floats(1e-4, 1e-2), st.floats(0.0, 1e-2))
def test_a_mean_is_in_between_and_never_surer_than_the_model_nor_than_it_scatters(values, noise, model):
    mean = pooled([Estimate(value, noise, model) for value in values])
    assert min(values) - 1e-12 <= mean.value <= max(values) + 1e-12
    assert mean.model == pytest.approx(model)
    if len(values) > 1:
        scatter = math.sqrt(np.mean((np.array(values) - mean.value) ** 2) / (len(values) - 1))
        assert mean.noise >= 0.999 * max(scatter, noise / math.sqrt(len(values)))


# --- the file ---


KEPT = found_friction(0.5, 0.003, 0.2, 1.5)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("speed_m_per_s", "speed_mm_per_s", "speed_mm_per_s"),
        ("palpate_friction: 1", "palpate_friction: 2", "reads version 1"),
        ("value: 0.003", "value: 3.0", "within its interval"),
        ("how: measured", "how: guessed", "guessed"),
        ("value: 1.5", "value: words", "norm_exponent"),
    ],
)
def test_a_file_with_a_mistake_is_refused_by_name(old, new, message):
    text = friction_file_text(KEPT)
    assert old in text
    with pytest.raises(InvalidValueError, match=message):
        read_friction_file(text.replace(old, new, 1))


# --- asking for it ---


def test_a_configuration_survives_its_log():
    config = FrictionConfig(norm_exponent=1.5, loads=(1.0, 5.0), fit_exponents=True, library=Path("x.yaml"))
    assert read_config(config_text("friction", config), FrictionConfig) == config


def test_what_it_rubs_by_is_told_whole():
    """Also what was left out."""
    law = {"static_friction": 0.7, "load_exponent": 0.2, "viscous_friction": 2.0, "skin_stiffness": 5e3}
    told = rubs_by(planned(**law))
    for word in ("mu 0.5", "0.7 at rest", "10 mm/s", "2 per m/s", "3 mm", "gamma 0.2", "p 2", "5 kN/m"):
        assert word in told
    assert "at rest" not in rubs_by(planned(norm_exponent=1.5))
    assert "MuJoCo" in rubs_by(planned())


def test_strokes_that_are_too_long_for_a_sphere_are_left_out_and_named():
    plan = planned(object="sphere")
    assert plan.left_out == (0.02, 0.04)
    assert plan.wanted.speeds == (0.0025, 0.005)
    assert any("at 20, 40 mm/s" in note for note in plan.dry_run().notes)


@pytest.mark.slow
def test_what_was_recorded_is_named_although_it_tells_of_no_friction(tmp_path, monkeypatch, capsys):
    """A robot that was held fast, say: what it felt is not lost, and nothing that was typed was wrong."""

    def found_by(*_):
        raise InvalidValueError("the finger does not move in this stroke")

    monkeypatch.setattr("palpate.experiments.friction.result.found_by", found_by)
    code = main(["friction", "--quick", "--loads", "1", "--out", str(tmp_path / "run"), "--json"])
    told = json.loads(capsys.readouterr().out)
    assert (code, told["exit_code"], told["status"]) == (1, 1, "unfinished")
    (log,) = told["files"]
    assert "does not move" in told["error"]
    assert log in told["error"]
    assert told["ending"] == "done"
    assert read_log(Path(log)).heading.period > 0.0


# --- larger runs ---


@pytest.mark.slow
def test_intervals_hold_the_truth_over_many_surfaces():
    rng = np.random.default_rng(20)
    held, close = [], []
    for seed in range(10):
        mu, e = math.exp(rng.uniform(*np.log((0.1, 1.2)))), math.exp(rng.uniform(*np.log((1e-3, 8e-3))))
        load = max(1.0, 0.3e-3 / (mu * e))
        if load > 5.0:
            continue
        file = rubbed(
            quick=True, friction=mu, spin_length=e, loads=(load,), object="plate", seed=seed, **NOISY
        ).file
        for found, true, within in ((file.friction, mu, 0.03), (file.spin_length, e, 0.05)):
            held.append(found.lower <= true <= found.upper)
            close.append(abs(found.value / true - 1.0) <= within)
    assert np.mean(held) >= 0.93
    assert np.mean(close) >= 0.95


def test_a_length_in_millimetres_is_refused():
    with pytest.raises(InvalidValueError, match="metres are meant"):
        msgspec.structs.replace(KEPT, spin_length=finding(3.0))
