"""Whole explorations in simulation: force, contact, safety at edges and without an object, replay."""

import math

import numpy as np
import pytest

from palpate.controllers import (
    ExploreController,
    ExploreParameters,
    Raster,
    force_gain,
    series_stiffness,
    tracking_delay,
)
from palpate.controllers.paths import Follow
from palpate.runtime.data import Command, Phase
from palpate.runtime.log import MemoryLog, Recorder
from palpate.runtime.loop import Ending, run
from palpate.runtime.replay import replay
from palpate.runtime.supervision import Limits, Supervisor
from palpate.runtime.touch import Finger, SensorFinger, Touch
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.ft import read_sensor
from palpate.sim import (
    Box,
    ContactLaw,
    CylinderObject,
    MujocoBackend,
    SphereObject,
    Stage,
    Tip,
    build_scene,
    white_noise,
)
from palpate.surfaces import Sphere

RADIUS, FORCE, PERIOD = 0.008, 2.0, 1e-3
SMALL = Raster(0.02, 0.008, 0.004)


class Exploration:
    """One run and all that was seen."""

    def __init__(
        self,
        target,
        raster=SMALL,
        law=None,
        noise=None,
        start=None,
        duration=12.0,
        force_limit=20.0,
        finger=None,
        **given,
    ):
        law, tip, stage = law or ContactLaw(), Tip(Sphere(RADIUS)), Stage()
        start = start or (*raster.corners()[0], target.top + RADIUS + 0.001)
        self.backend = MujocoBackend(build_scene(tip, target, law, start, stage), PERIOD, noise)
        self.finger = finger or Finger(Sphere(RADIUS - FORCE / (2 * law.stiffness)), SensorPayload(tip.mass))
        delay = tracking_delay(PERIOD, stage.lag, Touch(self.finger).delay)
        gain = force_gain(series_stiffness(law.stiffness, stage.stiffness(tip.mass)), delay)
        self.parameters = ExploreParameters(force=FORCE, speed=0.02, gain=gain, lead=delay, **given)
        self.raster = raster
        memory, self.samples, self.commands, truth = MemoryLog(), [], [], []

        def watch(sample, _, command):
            self.samples.append(sample)
            self.commands.append(command)
            true = self.backend.truth()
            truth.append((true.touching, *true.force))

        self.result = run(
            self.backend,
            Touch(self.finger),
            self.controller(),
            Supervisor(Limits(force=force_limit, contact_speed=0.05)),
            duration=duration,
            recorder=Recorder(memory),
            observers=(watch,),
        )
        self.record = memory.record()
        rows = np.array(truth)
        self.touching, self.force = rows[:, 0] > 0, np.linalg.norm(rows[:, 1:], axis=1)
        self.scan = self.record.phase == Phase.SCAN.value

    def controller(self):
        return ExploreController(self.parameters, Follow(self.raster), PERIOD)

    @property
    def normal_force_error_rms(self):
        error = self.record.normal_force[self.scan] - FORCE
        return math.sqrt(np.mean(error**2))


@pytest.mark.slow
@pytest.mark.parametrize(
    "target", [SphereObject(), Box(), CylinderObject()], ids=["sphere", "box", "lying cylinder"]
)
def test_a_surface_is_swept_with_a_steady_force_and_felt_where_it_is(target):
    done = Exploration(target)
    assert done.result.ending is Ending.DONE
    assert done.result.at_rest
    assert done.touching[done.scan].all()
    assert done.normal_force_error_rms < 0.06
    points = done.record.centroid[done.scan]
    # the centroid lies half the depth inside: F / 2K is 0.05 mm
    assert np.abs(target.signed_distance(points)).max() < 0.15e-3
    reach = np.abs(points[:, :2]).max(axis=0)
    assert reach == pytest.approx([0.01, 0.004], rel=0.25)
    landing = done.force[~done.scan].max()
    assert landing < 3.0
    assert not done.backend.truth().touching  # it lifted off


def test_with_friction_1_contact_is_kept_too():
    done = Exploration(SphereObject(), law=ContactLaw(friction=1.0))
    assert done.result.ending is Ending.DONE
    assert done.touching[done.scan].all()
    assert done.normal_force_error_rms < 0.1
    sliding = done.scan & (np.linalg.norm(done.record.velocity, axis=1) > 0.01)
    ratio = np.linalg.norm(done.record.tangential_force[sliding], axis=1) / done.record.normal_force[sliding]
    assert np.median(ratio) == pytest.approx(1.0, rel=0.03)


def test_without_an_object_the_run_ends_lost_untouched_and_stopped():
    lost = Exploration(SphereObject(0.02), Raster(0.02, 0.008, 0.004, center=(0.3, 0.0)))
    assert lost.result.ending is Ending.LOST
    assert lost.result.at_rest
    assert lost.force.max() == 0.0
    assert not lost.record.touching.any()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("target", "raster"),
    [
        (Box((0.04, 0.04, 0.02)), Raster(0.04, 0.008, 0.008, center=(0.015, 0.0))),
        (Box((0.02, 0.02, 0.02)), Raster(0.012, 0.04, 0.04, center=(0.0, 0.012))),
        (SphereObject(0.02), Raster(0.06, 0.008, 0.008, center=(0.025, 0.0))),
    ],
    ids=["off a box along x", "off a box along y", "off a sphere"],
)
def test_a_raster_that_leaves_the_object_ends_safely(target, raster):
    """However it ends, the force stays far below the limit, and no command had to be refused."""
    start = (*raster.corners()[0], target.top + RADIUS + 0.001)
    # looking deeper takes its time wherever there is nothing
    left = Exploration(target, raster, start=start, duration=40.0, approach_distance=0.01)
    assert left.force.max() < 6.0
    assert left.result.at_rest
    assert left.result.ending in (Ending.LOST, Ending.DONE), left.result.trip


def test_a_start_beside_the_raster_is_no_reason_for_haste():
    """The way to the first line is taken no faster than the sweep."""
    late = Exploration(Box((0.3, 0.3, 0.04)), start=(0.05, 0.05, 0.029), duration=3.0)
    assert late.result.trip is None
    assert np.linalg.norm(late.record.command, axis=1).max() < 0.03


def test_over_the_force_limit_the_stage_stops_and_does_not_push_on():
    tripped = Exploration(SphereObject(), force_limit=1.5)
    assert tripped.result.ending is Ending.TRIPPED
    assert tripped.result.trip.measure == "contact force"
    assert tripped.result.at_rest
    # what the servo's lag still brings: landing speed x lag x stiffness
    assert np.linalg.norm(tripped.backend.truth().force) < 1.5 + 0.005 * 0.02 * 20e3
    assert np.linalg.norm(tripped.record.command[-1]) == 0.0


class Ram:
    """A controller that drives straight down whatever it feels."""

    def __init__(self, speed):
        self.command = Command((0.0, 0.0, -speed), Phase.APPROACH)

    def start(self, first):
        pass

    def step(self, now):
        return self.command


@pytest.mark.parametrize("speed", [0.05, 0.1])
def test_after_a_collision_the_robot_does_not_go_on_pressing_above_the_limit(speed):
    """The stage has a reference ahead of it when it is stopped: standing still must not mean pushing on."""
    tip = Tip(Sphere(RADIUS))
    scene = build_scene(tip, Box(), ContactLaw(stiffness=100e3), (0.0, 0.0, 0.0285))
    backend = MujocoBackend(scene, PERIOD)
    touch = Touch(Finger(Sphere(RADIUS), SensorPayload(tip.mass)))
    result = run(backend, touch, Ram(speed), Supervisor(Limits(contact_speed=speed)), duration=1.0)
    assert result.ending is Ending.TRIPPED
    assert result.at_rest
    assert np.linalg.norm(backend.truth().force) < 20.0


@pytest.mark.parametrize("noise", [None, white_noise(0.01, 1e-4, seed=2)], ids=["clean", "noisy"])
def test_a_replay_of_the_samples_gives_the_same_commands_bit_for_bit(noise):
    original = Exploration(SphereObject(), Raster(0.006, 0.002, 0.002), noise=noise)
    limits = Limits(contact_speed=0.05)
    done = replay(original.samples, PERIOD, Touch(original.finger), original.controller(), Supervisor(limits))
    assert len(done.commands) > 1000
    assert list(done.commands) == original.commands


SENSOR = """
palpate_sensor: 1
model: simulated
serial_number: "1"
date: 2026-01-01
provenance: made for this test
sample_rate_Hz: 1000
force_range_N: [17, 17, 17]
moment_range_Nm: [0.12, 0.12, 0.12]
noise_force_N: [0.003, 0.003, 0.003]
noise_moment_Nm: [1.6e-05, 1.6e-05, 1.6e-05]
filters: [{kind: critically_damped, cutoff_Hz: 60}]
payload: {mass_kg: 0.03, center_of_mass_m: [0, 0, 0]}
contact: {touch_force_N: 0.2, release_force_N: 0.1}
"""


@pytest.fixture(scope="module")
def sensor():
    return read_sensor(SENSOR)


def test_the_delay_of_the_filter_of_a_sensor_file_reaches_the_controllers(sensor):
    finger = SensorFinger(Sphere(RADIUS), sensor)
    # two equal poles; 3 dB of both together at 60 Hz puts each at 60 Hz / sqrt(sqrt(2) - 1)
    pole = 60.0 / np.sqrt(np.sqrt(2.0) - 1.0)
    assert Touch(finger).delay == pytest.approx(2.0 / (2 * np.pi * pole), rel=0.02)
    assert Touch(finger, SensorFinger(Sphere(RADIUS), sensor)).delay == Touch(finger).delay


def test_an_exploration_through_a_filtered_sensor_holds_its_force(sensor):
    """A fingertip on a sensor as its file describes it: noisy and filtered."""
    finger, noise = SensorFinger(Sphere(RADIUS - FORCE / (2 * 20e3)), sensor), white_noise(0.003, 1.6e-5)
    done = Exploration(SphereObject(), Raster(0.02, 0.004, 0.004), noise=noise, duration=20.0, finger=finger)
    assert done.result.ending is Ending.DONE, done.result.trip
    normal = done.force[done.scan] / np.sqrt(1.0 + 0.3**2)
    assert np.sqrt(np.mean(np.square(normal - FORCE))) < 0.06
