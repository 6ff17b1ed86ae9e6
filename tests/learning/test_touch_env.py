"""A fingertip to learn with: the same seed gives the same episodes, and no action gets past the supervisor."""

import contextlib
import math
import re
import subprocess
import sys
import threading
from itertools import pairwise

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
    Supervisor,
    Touch,
    WrenchSample,
)
from palpate.sim.render.gl import NoRendererError
from palpate.spatial import IDENTITY, ZERO, norm, subtract
from palpate.surfaces import Sphere
from palpate.testing.spring_plane import RADIUS, START_HEIGHT, SpringPlane
from support.emulated_file import unhurried_file


class Floor(SpringPlane):
    """A plane that keeps all commands, counts starts and ends, and may break."""

    def __init__(self, breaks=math.inf):
        super().__init__()
        self.commands, self.breaks, self.starts, self.closed = [], breaks, 0, 0

    @property
    def height(self):
        return self._position[2]

    def start(self):
        self.starts += 1
        return super().start()

    def step(self, command):
        self.commands.append(command)
        if len(self.commands) > self.breaks:
            raise OSError("the cable is out")
        return super().step(command)

    def close(self):
        self.closed += 1
        super().close()


LIMITS = Limits(force=10.0, contact_speed=0.18, workspace_lower=(-0.05,) * 3, workspace_upper=(0.05,) * 3)


def floor_env(backend, reach=0.005, **options):
    world = World(backend, Finger(Sphere(RADIUS)), LIMITS, (0.0, 0.0, -0.005), reach)
    return TouchEnv(lambda rng: world, **options)


def begun(backend, **options):
    env = floor_env(backend, **options)
    env.reset(seed=0)
    return env


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


@pytest.fixture(scope="module")
def stage():
    with contextlib.closing(TouchEnv(duration=2.0)) as env:
        yield env


@pytest.mark.slow
def test_gymnasiums_own_checker_finds_nothing():
    """Warnings are errors here."""
    env = gymnasium.make("palpate.learning:palpate/Touch-v0", duration=0.2)
    check_env(env.unwrapped)
    env.close()


@pytest.mark.slow
def test_a_seed_gives_the_same_episodes_in_another_environment_bit_for_bit():
    """The second episode continues with the generator of the first; both environments are open at once."""
    environments = [TouchEnv(duration=0.2) for _ in range(2)]
    runs = [(episode(env, Proportional(), 12345), episode(env, Proportional())) for env in environments]
    for one, other in zip(*runs, strict=True):
        assert one[1] == other[1]
        for left, right in zip(one[0], other[0], strict=True):
            assert all(np.array_equal(left[name], right[name]) for name in left)
    assert runs[0][0][1] != runs[0][1][1]
    for env in environments:
        env.close()


@pytest.mark.slow
def test_a_sensible_policy_earns_more_than_a_random_one(stage):
    low, high = stage.action_space.low, stage.action_space.high
    for seed in range(3):
        rng = np.random.default_rng(seed)
        # 60 of 100 actions in full, at the speed along one axis that the limits leave of the rewarded 20 mm/s
        assert sum(episode(stage, Proportional(), seed)[1]) > 60.0 * high[0] / HoldWhileSliding().speed
        assert sum(episode(stage, lambda _, rng=rng: rng.uniform(low, high), seed)[1]) < 10.0


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
    backend = Floor()
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
    assert max(changes, default=0.0) <= SLEW * backend.period * (1.0 + 1e-9)
    assert norm(backend.commands[-1].velocity_base_tip) == 0.0
    # as deep as one period at full speed beyond the limit, no deeper
    assert backend.height > RADIUS - LIMITS.force / 5e3 - 0.1 * 3**0.5 * backend.period


@pytest.mark.parametrize(
    ("breaks", "action", "why"),
    [
        (math.inf, (0.0, 0.0, -0.05), "^contact force was"),
        (math.inf, (math.nan, 0.0, 0.0), "finite|nan"),
        (400, (0.0, 0.0, 0.0), "the cable is out"),
        (10, (0.0, 0.0, 0.0), "the cable is out"),  # on the way down, before the first action
    ],
)
def test_an_episode_that_trips_terminates_says_why_and_leaves_the_robot_at_rest(breaks, action, why):
    backend = Floor(breaks)
    env = floor_env(backend)
    _, rewards, info = episode(env, lambda _: np.array(action))
    assert re.search(why, info["trip"])
    assert rewards[-1] < -9.0
    if breaks == math.inf:
        assert backend.commands[-1].velocity_base_tip == ZERO
        assert backend.height > RADIUS or math.isnan(action[0])  # it was drawn back, off the floor
    with pytest.raises(InvalidValueError, match="call reset"):
        env.step(np.zeros(3))
    env.close()


def test_an_episode_ends_in_time_at_rest_and_one_back_end_serves_all_until_it_is_closed():
    backend = Floor()
    env = floor_env(backend, duration=0.1)
    begun = backend.closed  # one world was made to know its limits
    for _ in range(3):
        _, rewards, info = episode(env, lambda _: np.array([0.05, 0.0, 0.0]))
        assert (len(rewards), info["trip"]) == (5, "")
        assert backend.commands[-1].velocity_base_tip == ZERO
    assert (backend.starts, backend.closed) == (3, begun)
    env.close()
    env.close()
    assert backend.closed == begun + 1


def test_a_reset_amid_an_episode_brings_the_tip_to_rest_before_it_starts_again():
    backend = Floor()
    env = begun(backend)
    env.step(np.array([0.05, 0.0, 0.0]))
    last = len(backend.commands)
    assert norm(backend.commands[-1].velocity_base_tip) > 0.04
    env.reset()
    velocities = [command.velocity_base_tip for command in backend.commands[last - 1 :]]
    assert ZERO in velocities[:10]
    env.close()


def test_a_robot_that_cannot_be_started_again_can_still_be_closed():
    def absent():
        raise OSError("not there")

    backend = Floor()
    env = begun(backend)
    backend.start = absent
    with pytest.raises(OSError, match="not there"):
        env.reset()
    with pytest.raises(InvalidValueError, match="call reset"):
        env.step(np.zeros(3))
    env.close()
    assert backend.closed == 2


def test_without_gymnasium_the_error_names_the_package_to_install():
    program = "import sys; sys.modules['gymnasium'] = None; import palpate.learning"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 1
    assert "MissingLibraryError: palpate.learning needs gymnasium" in done.stderr
    assert 'pip install "palpate[learn]"' in done.stderr


def test_another_back_end_is_closed_before_the_next_episode():
    made = []

    def world(rng):
        made.append(Floor())
        return World(made[-1], Finger(Sphere(RADIUS)), LIMITS)

    with contextlib.closing(TouchEnv(world, duration=0.1)) as env:
        env.reset(seed=0)
        env.reset()
    assert [backend.closed for backend in made] == [1, 1, 1]


def test_the_tip_is_brought_to_the_surface_or_as_far_as_it_may_go():
    backend = Floor()
    state, _ = floor_env(backend, reach=4e-4).reset(seed=0)
    assert state["touching"][0] == 0.0
    assert not state["normal"].any()
    assert backend.height == pytest.approx(RADIUS + START_HEIGHT - 4e-4, abs=1e-4)


@given(force=st.floats(0.1, 5.9), speed=st.floats(0.0, 0.1))
def test_the_reward_is_between_zero_and_one_and_best_at_the_target(force, speed):
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
    ("call", "words"),
    [
        (lambda: floor_env(Floor(), speed=0.2), "the supervisor stops at"),
        (lambda: floor_env(Floor(), speed=-1.0), "speed = -1.0 m/s"),
        (lambda: floor_env(Floor(), action_time=0.0005), "whole number of control periods"),
        (lambda: floor_env(Floor(), duration=0.013), "whole number of actions"),
        (lambda: floor_env(Floor(), render_mode="human"), "must be 'rgb_array'"),
        (lambda: begun(Floor()).step(np.zeros(2)), r"action has shape \(2,\)"),
        (lambda: begun(Floor(), render_mode="rgb_array").render(), "no scene to draw"),
    ],
)
def test_bad_inputs_are_refused_by_name(call, words):
    with pytest.raises(InvalidValueError, match=words):
        call()


def test_pictures_show_the_scene():
    with contextlib.closing(TouchEnv(render_mode="rgb_array", duration=0.2)) as env:
        env.reset(seed=0)
        try:
            picture = env.render()
        except NoRendererError:
            pytest.skip("this machine cannot draw off screen")
    assert (picture.dtype, picture.ndim) == (np.uint8, 3)
    assert picture.std() > 10.0  # not a plain background


def test_worlds_of_explorations_differ_in_noise_and_place():
    rng = np.random.default_rng(1)
    first, second = (ExploredWorlds()(rng) for _ in range(2))
    positions = [world.backend.start().arm.position_base_tip for world in (first, second)]
    assert norm(subtract(*positions)) > 1e-5
    assert max(abs(p[i]) for p in positions for i in range(2)) <= 0.005


@pytest.mark.slow
@given(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(0.0, 2.0)))
def test_a_guarded_robot_is_never_commanded_a_speed_beyond_the_limit(velocity):
    """After a trip it stands still until it is started again."""
    backend = Floor()
    robot = GuardedRobot(backend, Touch(Finger(Sphere(RADIUS))), Supervisor(Limits()))
    robot.start()
    for _ in range(300):  # as long as the slew limit takes to 3 m/s
        robot.step(velocity)
    limit = Limits().speed * (1.0 + 1e-9)
    assert max(norm(command.velocity_base_tip) for command in backend.commands) <= limit
    if norm(velocity) > limit:
        assert robot.trip.measure in ("commanded speed", "commanded speed where something may be touched")
        assert robot.stop()
        robot.step((0.001, 0.0, 0.0))
        assert backend.commands[-1] == Command(ZERO, Phase.STOP)
        robot.start()
        robot.step((0.001, 0.0, 0.0))
        assert backend.commands[-1].velocity_base_tip[0] > 0.0


@pytest.mark.slow
@pytest.mark.wire
def test_an_episode_on_an_emulated_robot_leaves_nothing_running(tmp_path):
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
