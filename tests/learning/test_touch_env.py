"""A fingertip to learn with: the same seed gives the same episodes, and no action gets past the supervisor."""

import math
import subprocess
import sys
import threading
import warnings
from itertools import pairwise
from pathlib import Path

import gymnasium
import numpy as np
import psutil
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.worlds import ExploredWorlds
from palpate.learning import GuardedRobot, HoldWhileSliding, TouchEnv, World
from palpate.learning.guarded_robot import SLEW
from palpate.runtime import (
    ArmSample,
    Command,
    Finger,
    Limits,
    Phase,
    Sample,
    SimulatedTime,
    Supervisor,
    Touch,
    WrenchSample,
)
from palpate.runtime.closing import Closing
from palpate.sim.render.gl import NoRendererError
from palpate.spatial import IDENTITY, ZERO, add_scaled, norm, subtract
from palpate.surfaces import Sphere
from support.emulated_file import unhurried_file

RADIUS = 0.008
PERIOD = 1e-3


class SpringFloor(Closing):
    """A tip that goes where it is told, over a floor at z = 0 that pushes back: all that it was told is kept."""

    period = PERIOD

    def __init__(self, stiffness=5e3, breaks=math.inf):
        self.pacer = SimulatedTime()
        self.commands, self.stiffness, self.breaks = [], stiffness, breaks
        self.starts = self.closed = 0

    def start(self):
        self.starts += 1
        self.time, self.position, self.velocity = 0.0, (0.0, 0.0, RADIUS + 0.001), ZERO
        return self._sample()

    def step(self, command):
        self.commands.append(command)
        if len(self.commands) > self.breaks:
            raise OSError("the cable is out")
        self.time += PERIOD
        self.velocity = command.velocity_base_tip
        self.position = add_scaled(self.position, PERIOD, self.velocity)
        return self._sample()

    def close(self):
        self.closed += 1

    def _sample(self):
        up = max(0.0, self.stiffness * (RADIUS - self.position[2]))
        arm = ArmSample(self.time, self.position, IDENTITY, self.velocity)
        return Sample(self.time, arm, (WrenchSample(self.time, (0.0, 0.0, up, 0.0, 0.0, 0.0), ZERO),))


LIMITS = Limits(force=10.0, contact_speed=0.18, workspace_lower=(-0.05,) * 3, workspace_upper=(0.05,) * 3)


def floor_env(backend, **options):
    def world(rng):
        return World(backend, Finger(Sphere(RADIUS)), LIMITS, (0.0, 0.0, -0.005), 0.005)

    return TouchEnv(world, **options)


def episode(env, policy, seed=None):
    """Return what was seen, rewards, and the last info."""
    state, info = env.reset(seed=seed)
    states, rewards, ended = [state], [], False
    while not ended:
        state, reward, terminated, truncated, info = env.step(policy(state))
        states.append(state)
        rewards.append(reward)
        ended = terminated or truncated
    return states, rewards, info


class Proportional:
    """Presses in proportion to the missing force, and slides to and fro along x."""

    def __init__(self):
        self.way = 1.0

    def __call__(self, state):
        if not state["touching"][0]:
            return np.array([0.0, 0.0, -0.005])
        if abs(state["position"][0]) > 0.008:
            self.way = -np.sign(state["position"][0])
        normal = state["normal"].astype(float)
        along = np.cross(normal, [0.0, 1.0, 0.0])
        return 0.02 * self.way * along + 8e-4 * (2.0 - float(state["normal_force"][0])) * normal


class Random:
    def __init__(self, seed, space):
        self.rng, self.space = np.random.default_rng(seed), space

    def __call__(self, state):
        return self.rng.uniform(self.space.low, self.space.high)


@pytest.fixture(scope="module")
def stage():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = TouchEnv(duration=2.0)
        yield env
        env.close()


@pytest.mark.slow
def test_gymnasiums_own_checker_finds_nothing():
    """Warnings are errors here."""
    env = gymnasium.make("palpate.learning:palpate/Touch-v0", duration=0.2)
    check_env(env.unwrapped)
    env.close()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 12345])
def test_a_seed_gives_the_same_episodes_again_bit_for_bit(seed):
    runs = []
    for _ in range(2):
        env = TouchEnv(duration=0.2)
        first = episode(env, Proportional(), seed)
        second = episode(env, Proportional())  # goes on from the first one's generator
        runs.append((first, second))
        env.close()
    (a, b), (c, d) = runs
    for one, other in ((a, c), (b, d)):
        assert one[1] == other[1]
        for left, right in zip(one[0], other[0], strict=True):
            assert all(np.array_equal(left[name], right[name]) for name in left)
    assert a[1] != b[1]  # and they are different ones


@pytest.mark.slow
def test_a_sensible_policy_earns_what_a_random_one_does_not(stage):
    rewards = [sum(episode(stage, Proportional(), seed)[1]) for seed in range(3)]
    random = [sum(episode(stage, Random(seed, stage.action_space), seed)[1]) for seed in range(3)]
    assert min(rewards) > 60.0  # of at most 100 actions
    assert max(random) < 10.0


def test_an_episode_begins_in_touch_and_at_rest(stage):
    state, info = stage.reset(seed=3)
    assert state["touching"][0] == 1.0
    assert state["normal_force"][0] > 0.0
    assert np.linalg.norm(state["normal"]) == pytest.approx(1.0, abs=1e-6)
    assert state["normal"][2] < -0.9  # into the object, which is below
    assert not state["position"].any()
    assert info["trip"] == ""
    assert stage.observation_space.contains(state)


wild = st.lists(st.one_of(st.floats(-1e3, 1e3), st.just(math.inf), st.just(-math.inf)), min_size=3, max_size=3)


@pytest.mark.slow
@settings(max_examples=25)
@given(st.lists(wild, min_size=1, max_size=12))
def test_no_action_gets_past_bounds_slew_and_supervisor(actions):
    backend = SpringFloor()
    env = floor_env(backend, speed=0.1)
    env.reset(seed=0)
    smooth = 0  # commands before the last action; in that, the supervisor may have stopped the tip at once
    for action in actions:
        state, _, terminated, truncated, _ = env.step(np.array(action))
        assert env.observation_space.contains(state)
        if terminated or truncated:
            break
        smooth = len(backend.commands)
    env.close()
    velocities = [command.velocity_base_tip for command in backend.commands]
    assert max(abs(component) for velocity in velocities for component in velocity) <= 0.1 + 1e-9
    assert max(map(norm, velocities)) <= LIMITS.speed
    changes = [norm(subtract(b, a)) for a, b in pairwise(velocities[:smooth])]
    assert max(changes, default=0.0) <= SLEW * PERIOD * (1.0 + 1e-9)
    assert norm(backend.commands[-1].velocity_base_tip) == 0.0
    # as deep as one period at full speed beyond the limit, no deeper
    assert backend.position[2] > RADIUS - LIMITS.force / 5e3 - 0.1 * 3**0.5 * PERIOD


def test_pressing_too_hard_terminates_and_says_why():
    backend = SpringFloor()
    env = floor_env(backend)
    _, rewards, info = episode(env, lambda state: np.array([0.0, 0.0, -0.05]))
    assert info["trip"].startswith("contact force was")
    assert rewards[-1] < -9.0
    assert backend.commands[-1].velocity_base_tip == ZERO
    assert backend.position[2] > RADIUS  # it was drawn back, off the floor
    with pytest.raises(InvalidValueError, match="call reset"):
        env.step(np.zeros(3))


def test_what_is_no_number_terminates():
    env = floor_env(SpringFloor())
    env.reset(seed=0)
    *_, terminated, truncated, info = env.step(np.array([math.nan, 0.0, 0.0]))
    assert terminated
    assert not truncated
    assert "finite" in info["trip"] or "nan" in info["trip"]


def test_a_lost_device_terminates_and_does_not_raise():
    env = floor_env(SpringFloor(breaks=400))
    _, _, info = episode(env, lambda state: np.zeros(3))
    assert "the cable is out" in info["trip"]
    env.close()


def test_time_that_is_up_truncates_and_the_tip_rests():
    backend = SpringFloor()
    env = floor_env(backend, duration=0.1)
    _, rewards, info = episode(env, lambda state: np.array([0.05, 0.0, 0.0]))
    assert len(rewards) == 5
    assert info["trip"] == ""
    assert backend.commands[-1].velocity_base_tip == ZERO


def test_the_same_back_end_is_started_again_and_closed_once_at_the_end():
    backend = SpringFloor()
    env = floor_env(backend, duration=0.1)
    begun = backend.closed  # one world was made to know its limits
    for _ in range(3):
        episode(env, lambda state: np.zeros(3))
    assert backend.starts == 3
    assert backend.closed == begun
    env.close()
    env.close()
    assert backend.closed == begun + 1


def test_a_reset_amid_an_episode_brings_the_tip_to_rest_before_it_starts_again():
    backend = SpringFloor()
    env = floor_env(backend)
    env.reset(seed=0)
    env.step(np.array([0.05, 0.0, 0.0]))
    last = len(backend.commands)
    assert norm(backend.commands[-1].velocity_base_tip) > 0.04
    env.reset()
    velocities = [command.velocity_base_tip for command in backend.commands[last - 1 :]]
    assert ZERO in velocities[:10]
    env.close()


def test_a_robot_that_cannot_be_started_again_can_still_be_closed():
    backend = SpringFloor()
    env = floor_env(backend)
    env.reset(seed=0)
    backend.start = refuse
    with pytest.raises(OSError, match="not there"):
        env.reset()
    with pytest.raises(InvalidValueError, match="call reset"):
        env.step(np.zeros(3))
    env.close()
    assert backend.closed == 2


def refuse():
    raise OSError("not there")


def test_what_trips_on_the_way_down_ends_the_episode_at_its_first_step():
    env = floor_env(SpringFloor(breaks=10))
    _, info = env.reset(seed=0)
    assert "the cable is out" in info["trip"]
    *_, terminated, _, info = env.step(np.zeros(3))
    assert terminated
    env.close()


def test_without_gymnasium_it_says_what_to_install():
    program = "import sys; sys.modules['gymnasium'] = None; import palpate.learning"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 1
    assert "MissingLibraryError: palpate.learning needs gymnasium" in done.stderr
    assert 'pip install "palpate[learn]"' in done.stderr


def test_another_back_end_is_closed_before_the_next_episode():
    made = []

    def world(rng):
        made.append(SpringFloor())
        return World(made[-1], Finger(Sphere(RADIUS)), LIMITS)

    env = TouchEnv(world, duration=0.1)
    env.reset(seed=0)
    env.reset()
    env.close()
    assert [backend.closed for backend in made] == [1, 1, 1]


def test_the_tip_is_brought_to_the_surface_or_as_far_as_it_may_go():
    backend = SpringFloor()
    backend.stiffness = 0.0  # nothing there
    env = floor_env(backend)
    state, _ = env.reset(seed=0)
    assert state["touching"][0] == 0.0
    assert not state["normal"].any()
    assert backend.position[2] == pytest.approx(RADIUS + 0.001 - 0.005, abs=1e-4)
    env.close()


@given(force=st.floats(0.1, 5.9), speed=st.floats(0.0, 0.1))
def test_the_reward_is_between_nothing_and_one_and_best_at_what_is_wanted(force, speed):
    reward = HoldWhileSliding(force=2.0, speed=0.02)
    earned = reward.step(observed(force, (speed, 0.0, 0.0)))
    assert 0.0 <= earned <= 1.0
    assert earned <= reward.step(observed(2.0, (0.02, 0.0, 0.0))) == pytest.approx(1.0)
    if force >= 4.0 or speed == 0.0:
        assert earned == 0.0
    # motion into the surface is no sliding
    assert reward.step(observed(force, (speed, 0.0, -0.1))) == pytest.approx(earned)


def observed(force, velocity):
    arm = ArmSample(0.0, ZERO, IDENTITY, velocity)
    return Touch(Finger(Sphere(RADIUS), touch_force=0.05, release_force=0.02)).sense(
        Sample(0.0, arm, (WrenchSample(0.0, (0.0, 0.0, force, 0.0, 0.0, 0.0), ZERO),))
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"speed": 0.2}, "the supervisor stops at"),
        ({"speed": -1.0}, "speed = -1.0 m/s"),
        ({"action_time": 0.0005}, "whole number of control periods"),
        ({"duration": 0.013}, "whole number of actions"),
        ({"render_mode": "human"}, "must be 'rgb_array'"),
    ],
)
def test_what_cannot_be_is_refused_by_name(options, words):
    with pytest.raises(InvalidValueError, match=words):
        floor_env(SpringFloor(), **options)


def test_an_action_of_another_shape_is_refused():
    env = floor_env(SpringFloor())
    env.reset(seed=0)
    with pytest.raises(InvalidValueError, match=r"action has shape \(2,\)"):
        env.step(np.zeros(2))


def test_pictures_show_the_scene():
    env = TouchEnv(render_mode="rgb_array", duration=0.2)
    env.reset(seed=0)
    try:
        picture = env.render()
    except NoRendererError:
        pytest.skip("this machine cannot draw off screen")
    assert picture.dtype == np.uint8
    assert picture.ndim == 3
    assert picture.std() > 10.0  # there is something
    env.close()


def test_a_real_robot_has_no_picture():
    env = floor_env(SpringFloor(), render_mode="rgb_array")
    env.reset(seed=0)
    with pytest.raises(InvalidValueError, match="no scene to draw"):
        env.render()


def test_worlds_of_explorations_differ_in_noise_and_place():
    rng = np.random.default_rng(1)
    first, second = (ExploredWorlds()(rng) for _ in range(2))
    positions = [world.backend.start().arm.position_base_tip for world in (first, second)]
    assert norm(subtract(*positions)) > 1e-5
    assert max(abs(p[i]) for p in positions for i in range(2)) <= 0.005


@pytest.mark.slow
@given(st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3))
def test_a_robot_that_is_guarded_never_hears_of_a_speed_beyond_the_limit(velocity):
    backend = SpringFloor(stiffness=0.0)
    robot = GuardedRobot(backend, Touch(Finger(Sphere(RADIUS))), Supervisor(Limits()))
    robot.start()
    for _ in range(300):  # as long as the slew limit takes to 3 m/s
        robot.step(tuple(velocity))
    told = max(norm(command.velocity_base_tip) for command in backend.commands)
    assert told <= Limits().speed * (1.0 + 1e-9)
    if norm(tuple(velocity)) > Limits().speed * (1.0 + 1e-9):
        assert robot.trip.measure in ("commanded speed", "commanded speed where something may be touched")
        assert backend.commands[-1] == Command(ZERO, Phase.STOP)


def test_a_robot_that_is_guarded_stands_still_after_a_trip_until_it_is_started_again():
    backend = SpringFloor()
    robot = GuardedRobot(backend, Touch(Finger(Sphere(RADIUS))), Supervisor(LIMITS))
    robot.start()
    while robot.trip is None:
        robot.step((0.0, 0.0, -0.1))
    assert robot.stop()
    robot.step((0.1, 0.0, 0.0))
    assert backend.commands[-1] == Command(ZERO, Phase.STOP)
    robot.start()
    robot.step((0.1, 0.0, 0.0))
    assert backend.commands[-1].velocity_base_tip[0] > 0.0


@pytest.mark.slow
@pytest.mark.xdist_group("wire")
def test_an_emulated_robot_is_learnt_with_as_well_and_nothing_is_left_running(tmp_path):
    config = ExploreConfig(
        robot=unhurried_file(tmp_path, "127.0.0.80"), object="sphere", strategy="spiral", radius=0.01
    )
    env = TouchEnv(ExploredWorlds(config, spread=0.0), duration=1.0)
    before = set(psutil.Process().children(recursive=True))
    states, rewards, info = episode(env, Proportional(), seed=0)
    assert info["trip"] == ""
    assert len(rewards) == 50
    assert sum(rewards) > 10.0
    assert all(env.observation_space.contains(state) for state in states)
    env.close()
    gone = set(psutil.Process().children(recursive=True)) - before
    assert not {child for child in gone if "spawn_main" in " ".join(child.cmdline())}
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("reads ")]


def test_several_environments_at_once_are_those_of_their_seeds():
    together = gymnasium.make_vec("palpate/Touch-v0", num_envs=2, vectorization_mode="sync", duration=0.1)
    seen, _ = together.reset(seed=5)
    alone = TouchEnv(duration=0.1)
    for i in range(2):
        state, _ = alone.reset(seed=5 + i)
        assert all(np.array_equal(seen[name][i], state[name]) for name in state)
    together.close()
    alone.close()


@pytest.mark.slow
def test_what_it_costs_is_measured_to_the_end():
    """Ratios depend on what else the machine does: they are shown, not judged."""
    costs = [sys.executable, str(Path(__file__).parents[2] / "benchmarks" / "costs"), "learning", "--quick"]
    done = subprocess.run(costs, capture_output=True, text=True, check=True)
    for way in ("back end alone", "GuardedRobot", "TouchEnv", "a reset"):
        assert way in done.stdout
