"""Whatever a controller commands, nothing is pressed much harder than the force limit of its robot."""

import math
import random
from functools import partial
from typing import Any, cast

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.controllers import LandingModel
from palpate.errors import InvalidValueError
from palpate.robots.impact_force import ImpactForce
from palpate.robots.in_scene import impact_force, over_a_plate
from palpate.robots.robot import load_robot, shipped_robots
from palpate.runtime import Limits, Supervisor, Touch, run
from palpate.runtime.data import Command, Phase
from palpate.runtime.result import Ending
from palpate.runtime.supervision.limits import LARGEST_SHARE
from palpate.spatial import ZERO, norm, toward
from support.emulated_file import unhurried_file

STEP = 0.2
"""[s] A hostile controller keeps to a whim so long."""


class Plunge:
    """Goes down with a speed, as fast as it may gather it."""

    def __init__(self, speed, limits, period):
        self.speed, self.change, self.velocity = speed, 0.999 * limits.acceleration * period, ZERO

    def start(self, first):
        pass

    def step(self, now):
        self.velocity = toward(self.velocity, (0.0, 0.0, -self.speed), self.change)
        return Command(self.velocity, Phase.SCAN)


class Hostile:
    """Moves at random just within what the supervisor passes: plunges, flees, slides, rams, shakes."""

    def __init__(self, seed, limits, period):
        self.rng, self.limits = random.Random(seed), limits
        self.change, self.velocity, self.wanted, self.since = (
            0.999 * limits.acceleration * period,
            ZERO,
            ZERO,
            -1.0,
        )

    def start(self, first):
        pass

    def whim(self, touching):
        rng, near = self.rng, self.limits.commanded_speed
        kind = rng.random()
        if kind < 0.4:
            return (0.0, 0.0, -near)
        if kind < 0.55 and touching:  # backing off is free
            return (0.0, 0.0, self.limits.speed)
        x, y, z = (rng.gauss(0.0, 1.0) for _ in range(3))
        share = near * rng.uniform(0.5, 1.0) / math.hypot(x, y, z)
        return (share * x, share * y, -share * abs(z))

    def step(self, now):
        touching = now.fingers[0].touching
        if now.time - self.since > STEP * self.rng.random():
            self.wanted, self.since = self.whim(touching), now.time
        if not touching and norm(self.wanted) > self.limits.commanded_speed:
            self.wanted = ZERO
        velocity = toward(self.velocity, self.wanted, self.change)
        if norm(velocity) > self.limits.commanded_speed and not touching:
            velocity = toward(self.velocity, ZERO, self.change)
        self.velocity = velocity
        return Command(velocity, Phase.SCAN)


def driven(name, control, limits=None, stiffness=20e3, duration=2.0):
    """Return the result of a run over a plate; true forces, velocities and positions of the tip, and commands."""
    robot = load_robot(name)
    ready = over_a_plate(robot, stiffness)
    limits = limits or robot.file.limits
    backend, seen = cast("Any", ready.backend), []

    def watch(sample, now, command):
        truth = backend.truth()
        force = float(np.linalg.norm(truth.force)) if truth.touching else 0.0
        seen.append((force, sample.arm.velocity_base_tip, sample.arm.position_base_tip, command.velocity_base_tip))

    supervisor, touch = Supervisor(limits), Touch(ready.finger)
    result = run(
        backend, touch, control(limits, backend.period), supervisor, duration=duration, observers=(watch,)
    )
    return result, *(np.array(each) for each in zip(*seen, strict=True))


def allowed(limits: Limits, stiffness: float, period: float) -> float:
    """The largest force [N] that the limits must keep."""
    return LARGEST_SHARE * limits.force + stiffness * limits.commanded_speed * period


@pytest.fixture
def robot_file(name, tmp_path):
    """A robot by its name; where time matters, one that is in no hurry."""
    return unhurried_file(tmp_path, "127.0.57.2", scale=0.1) if name == "emulated-ur5e" else name


ROBOTS = ["stage", "stage-nano17", "ur5e-sim", "ur5e-nano17"]


@pytest.mark.slow
@pytest.mark.parametrize("name", [*ROBOTS, "emulated-ur5e"])
def test_a_plunge_at_a_quarter_of_a_metre_per_second_is_stopped_by_name_before_it_lands(robot_file):
    """Before, it pressed with 175 N at a limit of 20 N."""
    result, force, *_ = driven(robot_file, partial(Plunge, 0.25))
    assert result.ending is Ending.TRIPPED
    assert result.trip.measure == "commanded speed where something may be touched"
    assert result.at_rest
    assert force.max() == 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "stiffness"),
    [("stage", 2e3), ("stage-nano17", 20e3), ("ur5e-sim", 20e3), ("ur5e-nano17", 2e3), ("emulated-ur5e", 20e3)],
)
def test_the_fastest_plunge_presses_no_harder_than_the_model_allows(robot_file, stiffness):
    result, force, *_ = driven(
        robot_file, lambda limits, period: Plunge(limits.commanded_speed, limits, period), None, stiffness
    )
    robot = load_robot(robot_file)
    limits, landing = robot.file.limits, over_a_plate(robot, stiffness).landing_model(stiffness)
    assert result.ending is Ending.TRIPPED
    assert 0.99 * limits.force < force.max() <= landing.largest_force(limits.commanded_speed, limits.force)
    assert force.max() <= allowed(limits, stiffness, robot.file.period)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["stage", "ur5e-sim"])
def test_a_plan_that_may_go_faster_presses_no_harder_than_its_dry_run_says(name):
    for speed, stiffness in ((0.05, 20e3), (0.1, 20e3), (0.1, 100e3)):
        limits = load_robot(name).file.limits.allowing(speed)
        landing = over_a_plate(load_robot(name), stiffness).landing_model(stiffness)
        _, force, *_ = driven(name, partial(Plunge, speed), limits, stiffness)
        assert limits.force < force.max() <= landing.largest_force(speed, limits.force)


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_no_hostile_controller_exceeds_force_speed_acceleration_and_workspace(name):
    """A random search; the true motion and force, not what sensors say."""
    robot = load_robot(name)
    period = robot.file.period
    limits = msgspec.structs.replace(
        robot.file.limits, workspace_lower=(-0.01, -0.01, -1.0), workspace_upper=(0.01, 0.01, 1.0)
    )
    for seed in range(10):
        result, force, velocity, position, command = driven(name, partial(Hostile, seed), limits, duration=1.5)
        assert force.max() <= allowed(limits, 20e3, period), seed
        speed = np.linalg.norm(velocity, axis=1)
        assert speed.max() <= 1.02 * limits.speed, seed
        commanded = np.linalg.norm(command, axis=1)
        assert commanded.max() <= limits.speed * (1.0 + 1e-9), seed
        assert np.linalg.norm(np.diff(velocity, axis=0), axis=1).max() / period <= 1.02 * limits.acceleration, seed
        beyond = np.abs(position[:, :2]).max() - 0.01
        assert beyond <= 0.02, seed  # 1.02 times the metre of the default workspace
        assert result.error is None, seed


positive = st.floats(1e2, 1e6)


@given(positive, st.floats(1e-3, 0.1), positive, st.floats(0.0, 50.0), st.floats(1.0, 100.0), st.floats(1.01, 3.0))
def test_the_fastest_speed_gives_the_largest_force(stiffness, delay, contact, mass, limit, share):
    model = LandingModel(stiffness, delay, contact, mass)
    speed = model.fastest(limit, share * limit)
    assert model.largest_force(speed, limit) == pytest.approx(share * limit, rel=1e-6)
    assert model.largest_force(0.5 * speed, limit) <= share * limit


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped_robots())
def test_every_robot_that_comes_with_palpate_keeps_its_own_force_limit(name):
    pressed = impact_force(load_robot(name))
    assert pressed is None or pressed.force <= LARGEST_SHARE * pressed.limits.force


@pytest.mark.parametrize("speed", [0.05, 0.25])
def test_limits_that_break_their_own_force_limit_are_refused_with_a_speed_that_would_do(speed):
    landing = LandingModel(14e3, 0.0215, 20e3, 5.0)
    with pytest.raises(
        InvalidValueError, match=r"limits\.contact_speed_m_per_s = .*write at most 0\.033"
    ) as found:
        ImpactForce(Limits(contact_speed=speed), landing).check()
    assert f"{landing.largest_force(speed, 20.0):.3g} N" in str(found.value)
    ImpactForce(Limits(contact_speed=0.033), landing).check()
    ImpactForce(Limits(), landing).check()


def test_a_plan_may_allow_more_but_no_more_than_the_robot():
    limits = Limits(speed=0.1)
    assert limits.commanded_speed == pytest.approx(0.02)
    assert limits.allowing(0.05).commanded_speed == 0.05
    assert limits.allowing(0.5).commanded_speed == 0.1
    assert limits.allowing(0.001).commanded_speed == pytest.approx(0.02)
    assert Limits(speed=0.005).commanded_speed == 0.005
    with pytest.raises(InvalidValueError, match="contact_speed_m_per_s"):
        Limits(speed=0.1, contact_speed=0.2)
