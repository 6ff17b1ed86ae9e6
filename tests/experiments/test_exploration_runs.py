"""Exploration runs and the bounds that they keep: every object, strategy, robot and sensor against the truth."""

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.exploration import missed_marks
from palpate.mapping import PrimitiveKind
from palpate.open_kinds import as_written
from palpate.robots.finger_sensor import model_of_finger
from palpate.robots.robot import load_robot
from palpate.robots.robot_file import read_robot_file
from palpate.robots.simulated_stage import TurningStageEntry
from palpate.runtime import Ending
from palpate.sim import TurningStage
from palpate.sim.sensor.presets import nano17
from palpate.yaml_text import yaml_text
from support.explore_runs import carried_out, check_held, plan_of
from support.run_bounds import above, below, check_bounds

ROWS = {"spacing": 0.008}
NOISE = {"force_noise": 0.010, "moment_noise": 1e-4}
SMALL = {"width": 0.02, "depth": 0.004, "spacing": 0.004}
ARM = {"robot": "ur5e-sim", "speed": 0.02, "spacing": 0.02}
TURNING = {"robot": "turning-stage", "speed": 0.02, "spacing": 0.02, "width": 0.04}
NANO17 = {"robot": "stage-nano17", "width": 0.01, "depth": 0.004, "speed": 0.05}

FAST = {
    "sphere": ({**ROWS, "speed": 0.02}, below(force_rms=0.06, point_rms=1e-5)),
    "ellipsoid, fast": ({**ROWS, "object": "ellipsoid", "speed": 0.05}, below(force_rms=0.12)),
}
SLOW = {
    "sphere, fast": ({**ROWS, "speed": 0.05}, below(force_rms=0.12)),
    "ellipsoid": ({**ROWS, "object": "ellipsoid", "speed": 0.02}, below(force_rms=0.06, point_rms=1e-5)),
    "cylinder": ({**ROWS, "object": "cylinder"}, below(point_rms=1e-5)),
    "box": ({**ROWS, "object": "box"}, below(point_rms=1e-5)),
    "ellipsoidal tip": ({**ROWS, "tip": (0.010, 0.008, 0.012)}, below(point_rms=1e-5)),
    "little friction": ({**ROWS, "friction": 0.05}, below(force_rms=0.15)),
    "much friction": ({**ROWS, "friction": 1.0}, below(force_rms=0.15)),
    "arm, sphere": (ARM, below(force_rms=0.06, point_rms=1e-5)),
    "arm, ellipsoid": ({**ARM, "object": "ellipsoid"}, below(force_rms=0.06, point_rms=1e-5)),
    "turning stage": (TURNING, below(force_rms=0.05, point_rms=1e-5)),
    "Nano17": (NANO17, below(force_rms=0.15, point_rms=2e-5)),
    "arm, Nano17": ({"robot": "ur5e-nano17", **SMALL}, below(force_rms=0.2, point_rms=5e-5)),
    "bumps": ({"object": "bumps", **SMALL}, below(force_rms=0.2, point_rms=1e-6)),
    "torus": ({"object": "torus", **SMALL}, below(force_rms=0.2, point_rms=1e-6)),
    "arm, bumps": ({**ARM, "object": "bumps", "spacing": 0.01}, below(force_rms=0.2, point_rms=1e-5)),
    "arm, torus": ({**ARM, "object": "torus", "spacing": 0.01}, below(force_rms=0.2, point_rms=1e-5)),
}


def rows(fast, slow):
    marked = [pytest.param(*row, id=name, marks=pytest.mark.slow) for name, row in slow.items()]
    return [*(pytest.param(*row, id=name) for name, row in fast.items()), *marked]


@pytest.mark.slow
@pytest.mark.parametrize(("fields", "bounds"), rows(FAST, SLOW))
def test_an_exploration_stays_on_the_surface_and_keeps_its_bounds(fields, bounds):
    check_held(carried_out(plan_of(ExploreConfig(**fields))), bounds)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_the_radius_is_found_through_noise(seed):
    found = carried_out(plan_of(ExploreConfig(**ROWS, **NOISE, seed=seed)))
    check_held(found, {"sphere.radius": (0.04 - 3e-5, 0.04 + 3e-5)})


def test_the_shipped_nano17_is_the_preset():
    assert model_of_finger(load_robot("stage-nano17").file.fingers[0]) == nano17(0)


STRATEGIES = {
    "raster": {"width": 0.006, "depth": 0.004},
    "spiral": {"radius": 0.004},
    "taps": {"width": 0.005, "depth": 0.005},
    "contour": {},
    "active": {"width": 0.008, "depth": 0.006},
}
OBJECTS = {
    "sphere": {"size": (0.015,)},
    "ellipsoid": {"size": (0.02, 0.015, 0.012)},
    "box": {"size": (0.03, 0.02, 0.015)},
    "cylinder": {"size": (0.01, 0.04)},
    "torus": {"size": (0.02, 0.008)},
    "bumps": {},
}
PAIRS = [(strategy, name) for strategy in STRATEGIES for name in OBJECTS]


@pytest.mark.slow
@pytest.mark.parametrize(("strategy", "name"), PAIRS)
def test_every_strategy_on_every_object_by_stage_and_arm_in_turn(strategy, name):
    robot = ("stage", "ur5e-sim")[(PAIRS.index((strategy, name)) + list(STRATEGIES).index(strategy)) % 2]
    fields = {"object": name, **OBJECTS[name], **STRATEGIES[strategy]}
    found = carried_out(plan_of(ExploreConfig(**fields, strategy=strategy, robot=robot)))
    check_bounds(found, below(point_rms=1e-5), run__ending=Ending.DONE, run__at_rest=True)
    assert not missed_marks(found.marks)
    assert np.nanmax(found.true_normal_force) < 5.0
    assert not found.map.claimed.any() or found.map.covered > 0.95


@pytest.mark.slow
@pytest.mark.parametrize(
    ("strategy", "name"),
    [
        ("raster", "torus"),
        ("raster", "bumps"),
        ("spiral", "ellipsoid"),
        ("spiral", "bumps"),
        ("taps", "box"),
        ("taps", "sphere"),
        ("contour", "cylinder"),
        ("contour", "box"),
        ("active", "sphere"),
    ],
)
def test_defaults_of_every_strategy_observe_the_object(strategy, name):
    found = carried_out(plan_of(ExploreConfig(object=name, strategy=strategy, speed=0.05)))
    check_bounds(found, above(map__observed_share=0.95), run__ending=Ending.DONE)
    assert not missed_marks(found.marks)


# --- maps ---

MAP_BOUNDS = below(map__rms=5e-6) | {"map.covered": (0.95, 1.0), "map.observed_share": (0.95, 1.0)}
MAPPED = {
    "sphere": ({}, PrimitiveKind.SPHERE),
    "bumps": ({"object": "bumps"}, None),
    "ellipsoid, noisy": ({"object": "ellipsoid", "seed": 1, **NOISE}, PrimitiveKind.ELLIPSOID),
    "torus, noisy": ({"object": "torus", "seed": 2, **NOISE}, PrimitiveKind.TORUS),
    "sphere, Nano17": ({"robot": "stage-nano17", "seed": 3}, PrimitiveKind.SPHERE),
    "torus, Nano17": ({"object": "torus", "robot": "stage-nano17", "seed": 4}, PrimitiveKind.TORUS),
    "ellipsoid, arm, Nano17": (
        {"object": "ellipsoid", "robot": "ur5e-nano17"},
        PrimitiveKind.ELLIPSOID,
    ),
    "bumps, arm, Nano17": (
        {"object": "bumps", "robot": "ur5e-nano17", "seed": 1, "width": 0.02, "depth": 0.02},
        None,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize(("fields", "kind"), MAPPED.values(), ids=list(MAPPED))
def test_the_errors_of_a_map_stay_inside_its_claim_and_its_shape_is_named(fields, kind):
    found = carried_out(plan_of(ExploreConfig(**fields)))
    check_bounds(found, MAP_BOUNDS)
    assert found.map.shape.kind is kind


@pytest.mark.slow
@pytest.mark.parametrize(("robot", "name"), [("stage", "sphere"), ("stage-nano17", "bumps"), ("ur5e-sim", "box")])
def test_stiffness_is_found_by_both_robots_and_with_a_real_sensor(robot, name):
    layer = carried_out(
        plan_of(ExploreConfig(robot=robot, object=name, depth=0.012, force_swing=0.5))
    ).map.stiffness
    known = np.isfinite(layer.mean)
    off = np.abs(layer.mean - 2.0 * ExploreConfig().stiffness)[known] / layer.sd[known]
    assert not known.any() or np.median(off) < 2.5
    assert robot == "stage-nano17" or known.mean() > 0.5


# --- Explorations against the simulation's truth: force held, surface found, contact kept ---


@pytest.mark.slow
def test_force_and_speed_follow_changes_while_it_runs_and_points_stay_on_the_surface():
    """The tip is compressed more by a larger force: the map must not show it."""
    found = explore(ExploreConfig(width=0.03, depth=0.004, change=((1.0, "force", 4.0), (1.5, "speed", 0.03))))
    assert found.run.ending is Ending.DONE
    late = found.scanning & (found.record.time > 2.0)
    assert np.all(found.set_force[late] == 4.0)
    assert np.median(found.true_normal_force[late]) == pytest.approx(4.0, abs=0.1)
    assert np.median(np.linalg.norm(found.record.velocity[late], axis=1)) == pytest.approx(0.03, rel=0.05)
    assert found.point_rms < 0.005e-3


# --- The same exploration by a UR5e: one word is changed ---


# --- The same exploration by a stage that can also turn: one word is changed ---


def test_what_its_file_leaves_out_is_what_the_stage_is_by_itself():
    entry, stage = TurningStageEntry(), TurningStage()
    assert (entry.mass, entry.inertia, entry.bandwidth) == (stage.mass, stage.inertia, stage.bandwidth)
    assert (entry.following_error_limit, entry.angular_following_error) == (
        stage.following_error_limit.distance,
        stage.following_error_limit.angle,
    )


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("inertia_kg_m2", "0"),
        ("inertia_kg_m2", "1e3"),
        ("angular_following_error_rad", "3.4"),
        ("angular_following_error_rad", "-1"),
    ],
)
def test_what_cannot_be_is_refused_with_its_key(key, value):
    text = yaml_text(as_written(load_robot("turning-stage").file))
    line = next(line for line in text.splitlines() if line.strip().startswith(key))
    with pytest.raises(InvalidValueError, match=rf"{key} = .*must be from"):
        read_robot_file(text.replace(line, f"{line.split(':')[0]}: {value}"))
