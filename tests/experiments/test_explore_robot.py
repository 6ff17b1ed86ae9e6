"""Explorations from files: default < robot file < experiment file < command line, and again from a log's texts."""

from dataclasses import replace
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.commands.typed_options import read_experiment
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import FROM_FILE, OBJECT_SIZES, ExploreConfig
from palpate.experiments.kit.config_file import config_text, experiment_in, load_overlay, read_config
from palpate.robots.in_scene import check
from palpate.robots.known_truth import known_scene
from palpate.robots.robot import ROBOT_TEXT, load_robot
from palpate.robots.simulated_stage import StageEntry
from palpate.robots.values import on_robot, values_of
from palpate.runtime import Ending
from palpate.sim import Stage
from support.emulated_file import changed_robot
from support.explore_runs import carried_out, felt_while_lowered, plan_of, planned_again
from support.refusals import check_refusals
from support.run_bounds import below, check_bounds
from support.typed_mistakes import answer_to

SMALL = {"width": 0.01, "depth": 0.004, "speed": 0.05}
NANO17 = load_robot("stage-nano17")
STAGE = load_robot("stage")


def typed(*words):
    return read_experiment(ExploreConfig, "explore", "palpate explore", words, ())[0]


# --- one source of defaults ---


def test_the_shipped_stage_says_what_holds_without_a_file():
    default = plan_of(ExploreConfig()).config
    assert values_of(STAGE) == {name: getattr(default, name) for name in values_of(STAGE)}
    assert default.robot == "stage"
    entry = STAGE.file.backend
    assert isinstance(entry, StageEntry)
    assert Stage(entry.mass, entry.bandwidth, entry.following_error_limit) == Stage()
    assert felt_while_lowered(plan_of(default)) == felt_while_lowered(plan_of(default, STAGE))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["stage-nano17", "turning-stage", "ur5e-sim", "FILE"])
def test_a_script_that_names_a_robot_gets_what_its_file_says(name, tmp_path):
    if name == "FILE":
        text = STAGE.texts[ROBOT_TEXT].replace("period_s: 0.001", "period_s: 0.002")
        (tmp_path / "mine.yaml").write_text(text.replace("radius_m: 0.008", "radius_m: 0.011"))
        name = str(tmp_path / "mine.yaml")
    asked, said = ExploreConfig(robot=name, **SMALL), values_of(load_robot(name))
    planned = plan_of(asked)
    assert {field: getattr(planned.config, field) for field in said} == said
    assert planned.backend().period == planned.period == said["period"]
    own = plan_of(replace(asked, force_noise=0.004, tip=(0.009,))).config
    assert (own.force_noise, own.tip) == (0.004, (0.009,)), "what is given goes before"


# --- precedence ---

LAYERS = {
    "force_noise": (0.003125, 0.004, 0.005),
    "period": (0.001, 0.002, 0.004),
    "moment_noise": (1.5625e-5, 1e-4, 2e-4),
}


@pytest.mark.parametrize("field", LAYERS)
def test_each_source_beats_those_before_it(field, tmp_path):
    robot, experiment, own = LAYERS[field]
    file = tmp_path / "e.yaml"
    file.write_text(f"{field}: {experiment!r}\n")

    def settled(*words):
        config = typed(*words)
        assert type(config) is ExploreConfig
        return getattr(on_robot(config, load_robot(config.robot)), field)

    named, filed = ["--robot", "stage-nano17"], ["--config", str(file)]
    assert settled() == values_of(STAGE)[field]
    assert settled(*named) == robot
    assert settled(*named, *filed) == experiment
    assert settled(*named, f"--config={file}") == experiment
    assert settled(*named, *filed, f"--{field.replace('_', '-')}", repr(own)) == own


def test_an_experiment_file_may_name_the_robot_next_to_it(tmp_path):
    (tmp_path / "mine.yaml").write_text(STAGE.texts[ROBOT_TEXT].replace("radius_m: 0.008", "radius_m: 0.011"))
    (tmp_path / "e.yaml").write_text("robot: mine.yaml\nforce: 3\n")
    config = typed("--config", str(tmp_path / "e.yaml"))
    assert config.force == 3.0
    assert config.robot == str(tmp_path / "mine.yaml")
    assert plan_of(config).config.tip == (0.011,)
    assert plan_of(replace(config, robot="stage")).config.tip == (0.008,)


def test_values_that_only_fit_together_with_what_is_typed_are_not_refused_too_early(tmp_path, capsys):
    """0.5 N is too little for this noise: unless the noise is typed away."""
    (tmp_path / "e.yaml").write_text("force: 0.5\nforce_noise: 0.1\n")
    assert typed("--config", str(tmp_path / "e.yaml"), "--force-noise", "0").force == 0.5
    assert "force = 0.5 N" in answer_to(["explore", "--config", str(tmp_path / "e.yaml")], capsys)


# --- experiment files ---

OVERLAY_MISTAKES = [
    ("forc: 3", ["forc: unknown key", "did you mean force?", "line 1, column 1"]),
    ("force: 3\nspeeed: 0.02", ["speeed: unknown key", "did you mean speed?", "line 2, column 1"]),
    ("force_N: 3", ["force_N: unknown key", "write force, in SI units", "carry no unit"]),
    ("speed_mm_s: 20", ["speed_mm_s: unknown key", "write speed, in SI units"]),
    ("force-noise: 0.01", ["force-noise", "did you mean force_noise?"]),
    ("Force: 3", ["Force", "did you mean force?"]),
    ("force: 3 N", ["force = '3 N': must be a number", "plain number in SI units"]),
    ("force: three", ["force = 'three': must be a number"]),
    ("force: true", ["force = true: must be a number"]),
    ("force:", ["force: no value: must be a number"]),
    ("force: [3]", ["force = [3]: must be a number"]),
    ("seed: 1.5", ["seed = 1.5: must be a whole number"]),
    ("tip: 0.008", ["tip = 0.008: must be a list, as in [0.008]"]),
    ("tip: [0.008, x]", ["tip[1] = 'x': must be a number", "line 1"]),
    (
        "object: cube",
        ["object = 'cube'", f"known: {', '.join(OBJECT_SIZES)}"],
    ),
    ("object: elipsoid", ["object = 'elipsoid'", "did you mean ellipsoid?"]),
    ("object: 3", ["object = 3: known: ", "ellipsoid"]),
    ("out: ''", ["out = '': must be the path of a file"]),
    ("robot: 5", ["robot = 5: must be text", "put it in quotes"]),
    ("force: 3\nforce: 4", ["'force' appears a second time", "line 2"]),
    ("experiment: grasp\nforce: 3", ["experiment = 'grasp'", "must be explore"]),
    ("- force: 3", ["`key: value`"]),
    ("force 3", ["`key: value`"]),
    ("palpate_robot: 1\nname: x", ["this is a robot file: give it with --robot"]),
    ("force: &a 3\nspeed: *a", ["an alias", "line 1, column 8"]),
    ("force: 3\n\tspeed: 1", ["line 2"]),
]


@pytest.mark.parametrize(("text", "words"), OVERLAY_MISTAKES)
def test_mistakes_in_an_experiment_file_are_named_with_their_place(text, words, tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    with pytest.raises(InvalidValueError) as found:
        load_overlay(file, "explore", ExploreConfig)
    message = str(found.value)
    assert message.startswith(str(file))
    for word in words:
        assert word in message


# --- every value, exactly ---

positive = st.floats(1e-3, 0.1)
places = st.one_of(st.just(0.0), st.floats(1e-9, 1.0), st.floats(-1.0, -1e-9))
words = st.text(min_size=1, max_size=20).filter(lambda s: s.isprintable() and s.strip() and "\0" not in s)


@pytest.mark.slow
@given(
    force=st.floats(0.3, 15.0), speed=st.floats(1e-6, 0.1), width=positive,
    noise=st.one_of(st.just(0.0), st.floats(1e-9, 0.01)),
    tip=st.one_of(st.tuples(positive), st.tuples(positive, positive, positive)),
    seed=st.integers(0, 2**63 - 1), name=st.sampled_from(list(OBJECT_SIZES)),
    text=words, center=st.one_of(st.just(()), st.tuples(places, places)), scale=positive,
)  # fmt: skip
def test_a_configuration_reads_back_to_the_same_bits(
    force, speed, width, noise, tip, seed, name, text, center, scale
):
    if name in FROM_FILE:
        described = {"file": Path(text), "size": (scale, width) if name == "height-field" else ()}
        described |= {"touch": text} if name == "scene" else {"scale": scale}
    else:
        described = {}
    config = ExploreConfig(
        object=name, force=force, speed=speed, width=width, force_noise=noise, tip=tip, seed=seed, robot=text,
        out=Path(text), center=center, **described,
    )  # fmt: skip
    text = config_text("explore", config)
    again = read_config(text, ExploreConfig)
    assert again == config
    assert config_text("explore", again) == text


def test_a_configuration_names_its_experiment_and_is_refused_without():
    assert experiment_in(config_text("explore", ExploreConfig())) == "explore"
    check_refusals(
        ("no line `experiment", lambda: experiment_in("force: 3")),
        (r"force = 100\.0 N|force = 100 N", lambda: read_config("experiment: explore\nforce: 100", ExploreConfig)),
    )


@pytest.mark.parametrize(
    "robot",
    [*(changed_robot(each, ("mass_kg: 5.0", "mass_kg: 5.1")) for each in (STAGE, NANO17)), load_robot("ur5e-sim")],
    ids=["stage", "nano17", "ur5e"],
)
def test_the_texts_of_a_log_give_the_very_same_exploration(robot):
    planned = plan_of(ExploreConfig(robot="gone.yaml", **SMALL, seed=5), robot)
    again = planned_again(planned)
    same = attrgetter("config", "robot", "parameters", "limits")
    assert same(again) == same(planned)
    assert felt_while_lowered(again) == felt_while_lowered(planned)
    assert repr(again.fingers[0]) == repr(planned.fingers[0])


# --- what the robot file decides ---


def test_what_the_robot_file_says_an_exploration_need_not_be_told():
    other = changed_robot(
        STAGE,
        ("kind: sphere", "kind: ellipsoid"),
        ("radius_m: 0.008", "semi_axes_m: [0.01, 0.008, 0.012]"),
        ("force_N: 0\n", "force_N: 0.01\n"),
        ("moment_Nm: 0\n", "moment_Nm: 1e-4\n"),
        ("period_s: 0.001", "period_s: 0.002"),
    )
    said = {"tip": (0.01, 0.008, 0.012), "force_noise": 0.01, "moment_noise": 1e-4, "period": 0.002}
    assert values_of(other) == said


def test_the_robot_file_makes_the_stage():
    heavy = plan_of(
        ExploreConfig(),
        changed_robot(
            STAGE,
            ("mass_kg: 5.0", "mass_kg: 8"),
            ("rad_per_s: 100.0", "rad_per_s: 50"),
            ("following_error_m: 0.0025", "following_error_m: 0.003"),
        ),
    )
    light = plan_of(ExploreConfig(), STAGE)
    assert heavy.parameters.lead - light.parameters.lead == pytest.approx(2.0 / 50 - 2.0 / 100)
    assert known_scene(heavy.backend()).carrier == Stage(8.0, 50.0, 0.003)
    assert heavy.parameters.gain.gain < light.parameters.gain.gain


def test_limits_of_the_robot_hold_and_only_its_workspace_is_narrowed():
    limits = plan_of(ExploreConfig(robot="stage-nano17"), NANO17).limits
    assert limits.force == 10.0
    assert limits.spin_torque == 0.1
    for axis in range(3):
        assert -1.0 <= limits.workspace_lower[axis] < limits.workspace_upper[axis] <= 1.0
    narrow = changed_robot(STAGE, ("workspace_upper_m: [1, 1, 1]", "workspace_upper_m: [0.03, 1, 1]"))
    assert plan_of(ExploreConfig(), narrow).limits.workspace_upper[0] == 0.03


@pytest.mark.slow
@pytest.mark.parametrize("center", ["0.003, -0.002, -0.02", "-0.05, 0.0, 0.03"])
def test_where_the_sensor_sits_makes_no_difference_to_what_is_found(center):
    """The tip's centre takes the same path, whatever lever the sensor feels it through."""
    moved = changed_robot(
        STAGE,
        ("center_m: [0, 0, 0]", f"center_m: [{center}]"),
        ("center_of_mass_m: [0, 0, 0]", f"center_of_mass_m: [{center}]"),
    )
    config = ExploreConfig(**SMALL)
    one, other = carried_out(plan_of(config, STAGE)), carried_out(plan_of(config, moved))
    check_bounds(other, below(point_rms=1.2 * one.point_rms), run__ending=Ending.DONE)
    assert abs(len(other.cloud) - len(one.cloud)) <= 2
    corners, others = ([each.cloud.position.min(axis=0), each.cloud.position.max(axis=0)] for each in (one, other))
    assert np.array(others) == pytest.approx(np.array(corners), abs=2e-5)


@pytest.mark.parametrize(
    ("config", "robot", "words"),
    [
        ({"force": 8.0}, NANO17, ["force = 8 N", "at most 7.5 N", "limit of 10 N", "limits.force_N"]),
        ({"force_noise": 0.0}, NANO17, ["dead sensor", "force_N: 0.003125"]),
        ({"period": 2e-3}, NANO17, ["sample_rate_Hz = 1000", "write 500"]),
        ({"strategy": "contour", "tip": (1.5e-4,), "speed": 0.045}, STAGE,
         ["speed = 0.045 m/s", "acceleration = 27 m/s^2", "25 m/s^2", "acceleration_m_per_s2", "go more slowly"]),
        ({"speed": 0.05}, changed_robot(STAGE, ("speed_m_per_s: 0.25", "speed_m_per_s: 0.04")), ["0.04 m/s"]),
        (
            {},
            changed_robot(STAGE, ("following_error_m: 0.0025", "following_error_m: 1e-5")),
            ["force = 2 N", "at most 0.5 N", "following_error_m"],
        ),
        ({}, changed_robot(STAGE, ("rad_per_s: 100.0", "rad_per_s: 5")), ["0.31 N", "bandwidth_rad_per_s"]),
        ({}, changed_robot(STAGE, ("_upper_m: [1, 1, 1]", "_upper_m: [0.001, 1, 1]")), ["along x", "0.001 m"]),
        ({}, changed_robot(STAGE, ("_upper_m: [1, 1, 1]", "_upper_m: [1, 1, 0.01]")), ["along z", "workspace"]),
        ({}, changed_robot(STAGE, ("time_step_s: 0.0005", "time_step_s: 0.0007")), ["whole number of time steps"]),
        ({}, changed_robot(STAGE, ("mass_kg: 0.03", "mass_kg: 0")), ["payload", "weighs something"]),
        ({}, changed_robot(NANO17, ("bias_force_N: [0.0", "bias_force_N: [0.1"), file="sensor-0.yaml"), ["bias"]),
        ({}, changed_robot(NANO17, ("delay_s: 0.0", "delay_s: 0.1"), file="sensor-0.yaml"), ["device_delay_s"]),
        ({"force": 0.4}, changed_robot(NANO17, ("force_N: 0.05", "force_N: 0.4"), file="sensor-0.yaml"),
         ["at least 0.6 N", "touch_force_N"]),
    ],
)  # fmt: skip
def test_what_robot_and_experiment_cannot_do_together_is_refused(config, robot, words):
    base = {} if robot.sensors[0] is None else {"force_noise": 0.003125, "moment_noise": 1.5625e-5}
    with pytest.raises(InvalidValueError) as found:
        plan_of(ExploreConfig(**{**base, **config}), robot)
    for word in words:
        assert word in str(found.value)


def test_check_refuses_what_no_experiment_could_do():
    for name in ("stage", "stage-nano17", "turning-stage", "emulated-hand"):
        check(load_robot(name))
    check_refusals(
        ("whole number", lambda: check(changed_robot(STAGE, ("time_step_s: 0.0005", "time_step_s: 0.0007")))),
        ("dead sensor", lambda: check(changed_robot(NANO17, ("force_N: 0.003125", "force_N: 0")))),
        ("sample_rate_Hz", lambda: check(changed_robot(NANO17, ("period_s: 0.001", "period_s: 0.002")))),
    )


SUPERELLIPSOID = "kind: superellipsoid, semi_axes_m: [0.009, 0.009, 0.008], exponent: 2.5"


@pytest.mark.parametrize(
    "surface",
    [
        "{kind: capsule, radius_m: 0.008, length_m: 0.02, rotvec_rad: [3.141592653589793, 0, 0]}",
        pytest.param(f"{{kind: compliant, tip: {{{SUPERELLIPSOID}}}, stiffness_N_per_m: 40000}}",
                     marks=pytest.mark.slow),
        pytest.param("{kind: rounded_box, half_lengths_m: [0.009, 0.009, 0.008], radius_m: 0.006}",
                     marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_any_fingertip_explores_as_a_sphere_does(surface):
    sphere = "surface:                   # sphere"
    at = STAGE.texts[ROBOT_TEXT].index(sphere)
    before = STAGE.texts[ROBOT_TEXT][at : STAGE.texts[ROBOT_TEXT].index("    payload:", at)]
    found = carried_out(
        plan_of(ExploreConfig(object="sphere", **SMALL), changed_robot(STAGE, (before, f"surface: {surface}\n")))
    )
    reference = carried_out(plan_of(ExploreConfig(object="sphere", **SMALL), STAGE))
    assert found.run.ending is Ending.DONE
    assert found.claimed_map.rms <= 1.3 * reference.claimed_map.rms


def test_an_empty_experiment_file_changes_nothing(tmp_path):
    (tmp_path / "e.yaml").write_text("# nothing yet\n")
    assert load_overlay(tmp_path / "e.yaml", "explore", ExploreConfig) == {}
