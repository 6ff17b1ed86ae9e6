"""Nothing presses much harder than the force limit: hostile commands, moving surfaces, wrong or dead sensors."""

import math
import random
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, cast

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from wire.dead_sensors import CHANNELS, Case, pressed

from faults.dead_sensor import FAULTS, NOISE, RATIO, DeadSensor, WithoutTipForce
from faults.mountings import LIMIT, PERIOD, PLATE, ROTATIONS, TIP, K, Slide, TurnedSensor, moved, plunged
from palpate.controllers import LandingModel, series_stiffness, tracking_delay
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.robots.impact_force import ImpactForce
from palpate.robots.in_scene import impact_force, over_a_plate
from palpate.robots.robot import load_robot, shipped_robots
from palpate.runtime import Finger, Limits, Supervisor, Touch, run
from palpate.runtime.data import Command, Phase
from palpate.runtime.following import CommandedMotion
from palpate.runtime.replay import ReplayBackend
from palpate.runtime.result import Ending, RunResult
from palpate.runtime.servo_following import ServoFollowing
from palpate.runtime.supervision.limits import LARGEST_SHARE
from palpate.sensing.compensation import SensorPayload
from palpate.sim import (
    ArmCarrier,
    ContactLaw,
    Fidelity,
    MujocoBackend,
    Stage,
    Tip,
    TurningStage,
    build_scene,
    white_noise,
)
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget
from palpate.spatial import ZERO, norm, toward
from palpate.surfaces import Sphere
from support.emulated_file import unhurried_file
from support.explore_runs import plan_of
from support.regulate_runs import planned

STEP = 0.2
"""[s] A hostile controller keeps to a whim so long."""


class Stateless:
    """A controller that commands by the observation alone."""

    def __init__(self, step):
        self.step = step

    def start(self, first):
        pass


class Plunge(Stateless):
    """Goes down with a speed, as fast as it may gather it."""

    def __init__(self, speed, limits, period):
        self.speed, self.change, self.velocity = speed, 0.999 * limits.acceleration * period, ZERO

    def step(self, now):
        self.velocity = toward(self.velocity, (0.0, 0.0, -self.speed), self.change)
        return Command(self.velocity, Phase.SCAN)


class Hostile(Stateless):
    """Moves at random just within what the supervisor passes: plunges, flees, slides, rams, shakes."""

    def __init__(self, seed, limits, period):
        self.rng, self.limits = random.Random(seed), limits
        self.change, self.velocity, self.wanted, self.since = (
            0.999 * limits.acceleration * period,
            ZERO,
            ZERO,
            -1.0,
        )

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
    ("name", "speed", "stiffness"),
    [
        ("stage", 0.0, 2e3),
        ("stage-nano17", 0.0, 20e3),
        ("ur5e-sim", 0.0, 20e3),
        ("ur5e-nano17", 0.0, 2e3),
        ("emulated-ur5e", 0.0, 20e3),
        ("stage", 0.05, 20e3),
        ("ur5e-sim", 0.1, 20e3),
        ("stage", 0.1, 100e3),
        ("ur5e-sim", 0.1, 100e3),
    ],
)
def test_the_fastest_plunge_that_a_plan_allows_presses_no_harder_than_the_model_says(robot_file, speed, stiffness):
    robot = load_robot(robot_file)
    limits, landing = robot.file.limits.allowing(speed), over_a_plate(robot, stiffness).landing_model(stiffness)
    result, force, *_ = driven(robot_file, partial(Plunge, limits.commanded_speed), limits, stiffness)
    assert result.ending is Ending.TRIPPED
    assert 0.99 * limits.force < force.max() <= landing.largest_force(limits.commanded_speed, limits.force)
    assert speed or force.max() <= allowed(limits, stiffness, robot.file.period)


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
        shares = {
            "force": force.max() / allowed(limits, 20e3, period),
            "speed": np.linalg.norm(velocity, axis=1).max() / (1.02 * limits.speed),
            "commanded speed": np.linalg.norm(command, axis=1).max() / (limits.speed * (1.0 + 1e-9)),
            "acceleration": np.linalg.norm(np.diff(velocity, axis=0), axis=1).max()
            / (period * 1.02 * limits.acceleration),
            # 1.02 times the metre of the default workspace
            "workspace": (np.abs(position[:, :2]).max() - 0.01) / 0.02,
        }
        assert max(shares.values()) <= 1.0, (seed, shares)
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
    allowing = [limits, *(limits.allowing(speed) for speed in (0.001, 0.05, 0.5)), Limits(speed=0.005)]
    assert [each.commanded_speed for each in allowing] == pytest.approx([0.02, 0.02, 0.05, 0.1, 0.005])
    with pytest.raises(InvalidValueError, match="contact_speed_m_per_s"):
        Limits(speed=0.1, contact_speed=0.2)


DELAY = tracking_delay(PERIOD, 0.02)
"""[s] From a force to the tip's motion: of both robots, servos of 100 rad/s."""


@dataclass(frozen=True, slots=True)
class Advance:
    """Comes at a rate [m/s] until it has come so far [m], and stays there. A `Motion`."""

    rate: float
    way: float

    def at(self, time):
        moving = self.rate * time < self.way
        return (self.rate * time, self.rate, 0.0) if moving else (self.way, 0.0, 0.0)


@dataclass
class Pressed:
    """What came of it: the result, true forces after the trip [N] the tip's heights [m], a landing's model."""

    result: RunResult
    forces: np.ndarray
    heights: np.ndarray
    model: LandingModel


def pressed_by(motion, arm, limits=None):
    """Let a plate come up to a tip that stands still."""
    target = MovingTarget(PLATE, [DrivenJoint(JointKind.SLIDE, (0.0, 0.0, 1.0), motion)])
    carrier = ArmCarrier() if arm else Stage()
    start = (0.0, 0.0, PLATE.top + TIP + 0.001)
    scene = build_scene(Tip(Sphere(TIP)), target, ContactLaw(stiffness=K), start, carrier, Fidelity(0.5e-3))
    backend = MujocoBackend(scene, PERIOD, white_noise(3.1e-3, 1.6e-5, seed=1))
    supervisor, forces, heights = Supervisor(limits or Limits(force=LIMIT)), [], []

    def watch(sample, now, command):
        if supervisor.trip is not None:
            forces.append(float(np.linalg.norm(backend.truth().force)))
            heights.append(sample.arm.position_base_tip[2])

    finger = Finger(Sphere(TIP), SensorPayload(scene.tip.mass))
    control = Stateless(lambda now: Command(phase=Phase.HOLD))
    result = run(backend, Touch(finger), control, supervisor, duration=1.0, observers=(watch,))
    if isinstance(carrier, ArmCarrier):
        servo = (
            carrier.arm.push(carrier.joint_start(start), (0.0, 0.0, -1.0))
            / carrier.arm.following_error_limit.distance
        )
        mass = 7.0
    else:
        servo, mass = carrier.stiffness(scene.tip.mass), carrier.mass + scene.tip.mass
    model = LandingModel(series_stiffness(K, servo), DELAY, K, mass)
    return Pressed(result, np.array(forces), np.array(heights), model)


@pytest.mark.slow
@pytest.mark.parametrize("arm", [False, True], ids=["stage", "ur5e"])
@pytest.mark.parametrize("speed", [0.02, 0.05])
def test_a_surface_that_keeps_coming_presses_no_harder_than_the_delay_explains(speed, arm):
    """Then it stops 40 mm farther, and the run ends clear of it. Before, the tip was crushed with 40 to 126 N."""
    came = pressed_by(Advance(speed, 0.04), arm)
    assert came.result.ending is Ending.TRIPPED
    assert came.result.at_rest
    overshoot = came.model.peak(speed)
    assert came.forces.max() <= LIMIT + overshoot
    # ten millimetres on, the first knock is over
    after = came.forces[came.heights > came.heights[0] + 0.01]
    assert len(after) > 100
    assert after.max() <= max(LIMIT, 2.0 + overshoot)
    assert came.forces[-100:].max() == 0.0
    assert came.heights[-1] - TIP > PLATE.top + 0.04 + 0.003
    assert came.result.trip.aftermath.startswith("backed off 4")


def test_at_the_end_of_its_workspace_the_tip_stands_still_and_says_so():
    top = PLATE.top + TIP + 0.02
    came = pressed_by(Advance(0.02, 0.017), arm=False, limits=Limits(force=LIMIT, workspace_upper=(1.0, 1.0, top)))
    assert came.heights.max() <= top
    assert came.result.at_rest
    assert "ended because tip position after a stop" in came.result.trip.aftermath


FOUND = [matrix for matrix in ROTATIONS if matrix[2, 2] < 0.5]
"""Those that turn the axis of touch: about that axis itself a straight push shows nothing."""

ABOUT_TOUCH = [matrix for matrix in ROTATIONS if matrix[2, 2] > 0.5]
"""The others, the right one among them: friction shows them."""


@pytest.mark.slow
@pytest.mark.parametrize("arm", [False, True], ids=["stage", "ur5e"])
def test_a_wrong_mounting_is_named_at_the_first_touch(arm):
    _, touch = plunged(np.eye(3), Phase.APPROACH, arm, stops=True)
    for rotation in FOUND:
        result, force = plunged(rotation, Phase.APPROACH, arm)
        assert result.ending is Ending.TRIPPED
        assert result.at_rest
        assert "angle between approach and first contact force of finger 1 was" in result.why
        assert force < 1.2 * touch


class Tared(TurnedSensor):
    """Shows what it should before the tip moves; the axes are turned all the same."""

    def start(self):
        sample = self.backend.start()
        self.offset = np.subtract(sample.wrenches[0].wrench, self.shown(sample).wrenches[0].wrench)
        return self.tared(sample)

    def step(self, command):
        return self.tared(self.backend.step(command))

    def tared(self, sample):
        wrong = self.shown(sample).wrenches[0].wrench + self.offset
        return replace(sample, wrenches=(replace(sample.wrenches[0], wrench=tuple(wrong.tolist())),))


def turn_in_the_air(now):
    """Turn about x, then about y, far from everything."""
    x = now.time < 2.0
    if now.time > 4.0:
        return Command(phase=Phase.DONE)
    return Command(phase=Phase.APPROACH, angular_velocity_base_tip=(0.15 * x, 0.15 * (not x), 0.0))


@pytest.mark.slow
def test_weight_must_turn_with_the_arm_whatever_was_tared():
    """A sensor that is tared shows no weight, and the wrong one as soon as the tip turns."""
    for rotation in ROTATIONS:
        tip = Tip(Sphere(TIP), 0.3)
        scene = build_scene(
            tip, PLATE, ContactLaw(stiffness=20e3), (0.0, 0.0, 0.5), TurningStage(), Fidelity(0.5e-3)
        )
        backend = Tared(MujocoBackend(scene, 1e-3, white_noise(3.1e-3, 1.6e-5, seed=1)), rotation)
        finger = Finger(tip.surface, SensorPayload(tip.mass, tip.center_of_mass))
        control = Stateless(turn_in_the_air)
        result = run(backend, Touch(finger), control, Supervisor(Limits(force=LIMIT)), duration=5.0)
        right = np.allclose(rotation, np.eye(3))
        assert result.ending is (Ending.DONE if right else Ending.TRIPPED), rotation
        assert right or "while the tip turned in the air" in result.why


@pytest.mark.slow
@pytest.mark.parametrize("arm", [False, True], ids=["stage", "ur5e"])
def test_no_retreat_presses_harder_whatever_the_mounting(arm):
    """Without an approach that could have shown it. Before, the tip was driven in with 249 N."""
    for rotation in ROTATIONS:
        result, force = plunged(rotation, Phase.SCAN, arm)
        assert result.ending is Ending.TRIPPED
        assert result.at_rest
        assert force < 1.5 * LIMIT


@pytest.mark.slow
@pytest.mark.parametrize("arm", [False, True], ids=["stage", "ur5e"])
def test_a_turn_about_the_axis_of_touch_is_named_within_the_first_millimetres_of_sliding(arm):
    right, force = moved(Slide(), np.eye(3), arm)
    assert right.ending is Ending.DONE
    for rotation in ABOUT_TOUCH:
        if rotation.trace() < 2.9:
            result, wrong = moved(Slide(), rotation, arm)
            assert "angle between sliding and friction was" in result.why
            assert wrong < 1.2 * force


LOW_LIMIT = 10.0


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["stage", "ur5e-sim"])
@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize("noisy", [False, True])
def test_a_dead_sensor_cannot_press_harder_than_the_limit_allows(robot, channel, noisy):
    for fault in FAULTS:
        for since in (0.0, 0.5, 1.2):
            force, allowed, why = pressed(Case(robot, LOW_LIMIT, channel, noisy), fault, since)
            assert force <= allowed, (fault, since)
            if fault == "none":
                assert why == ""
            elif fault == "noise only":
                assert "difference" in why or "itself measures" in why or "its sensor does not feel" in why
            elif noisy and fault != "a tenth":
                assert "not changed" in why or "no channel has changed" in why


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["stage", "ur5e-nano17"])
def test_an_honest_sensor_goes_on_without_a_second_channel(robot):
    fields = {"robot": robot, "force": 6.0, "speed": 0.05}
    scan = plan_of(ExploreConfig(**fields, object="ellipsoid", friction=0.8, width=0.02, depth=0.004))
    for plan in (scan, planned(robot=robot, force=6.0, duration=1.0), planned(robot=robot, surface="sine")):
        assert RecordedRun(plan, WithoutTipForce(plan.backend())).run().ending is Ending.DONE


def test_only_an_arm_that_measures_no_force_is_compared_with_its_servo():
    plan = planned(robot="stage")
    measures, measures_none = cast("Any", plan.backend()), WithoutTipForce(plan.backend())
    compared = [type(plan.following(plan.period, each.start().arm)) for each in (measures, measures_none)]
    assert compared == [CommandedMotion, ServoFollowing]


def test_a_replay_trips_over_the_same():
    samples = []
    plan = planned(robot="stage", duration=1.0, force_noise=NOISE, moment_noise=RATIO * NOISE)

    def carried_out(backend, *observers):
        touch, supervisor = Touch(*plan.fingers), Supervisor(plan.limits)
        duration = plan.longest_duration
        return run(backend, touch, plan.controller(), supervisor, duration=duration, observers=observers)

    first = carried_out(DeadSensor(plan.backend(), "noise only", 1.0), lambda sample, *_: samples.append(sample))
    again = carried_out(ReplayBackend(samples, plan.period))
    assert "difference between the contact force" in first.why
    assert again.trip == first.trip
