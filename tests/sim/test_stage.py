"""The stage, its noise, and the back end: lag, push, determinism, time."""

import itertools
import math

import numpy as np
import pytest

from palpate.runtime.data import Command
from palpate.sim import (
    Box,
    ContactLaw,
    MujocoBackend,
    SphereObject,
    Stage,
    Tip,
    build_scene,
    white_noise,
)
from palpate.surfaces import Sphere

TIP = Tip(Sphere(0.008))
FREE = (0.0, 0.0, 0.2)


def scene(stage=None, start=FREE, target=None, law=None):
    return build_scene(TIP, target or SphereObject(), law or ContactLaw(), start, stage)


def drive(backend, periods=300):
    """A run with contact, from start; all samples."""
    samples = [backend.start()]
    for i in range(periods):
        v = (0.01 * math.sin(0.05 * i), 0.005, -0.01)
        samples.append(backend.step(Command(v)))
    return samples


@pytest.mark.parametrize("bandwidth", [50.0, 100.0, 200.0])
@pytest.mark.parametrize("mass", [2.0, 5.0])
def test_a_ramp_is_followed_with_the_lag_of_a_critically_damped_servo(bandwidth, mass):
    stage = Stage(mass=mass, bandwidth=bandwidth)
    speed = 0.03
    backend = MujocoBackend(scene(stage))
    backend.start()
    for _ in range(600):
        sample = backend.step(Command((speed, 0.0, -speed)))
    # the sample belongs to the state before its last time step; the reference starts at the first step
    reference = speed * (sample.time + backend.scene.fidelity.time_step)
    behind = reference - sample.arm.position_base_tip[0]
    assert stage.lag == 2.0 / bandwidth
    assert behind / speed == pytest.approx(stage.lag, abs=1.5 * backend.scene.fidelity.time_step)
    assert sample.arm.velocity_base_tip == pytest.approx((speed, 0.0, -speed), abs=1e-9)


def test_the_stage_floats_where_it_is_left():
    """Stage and tip are balanced: no command, no motion."""
    backend = MujocoBackend(scene())
    first = backend.start()
    for _ in range(500):
        last = backend.step(Command())
    assert last.arm.position_base_tip == pytest.approx(first.arm.position_base_tip, abs=1e-12)


@pytest.mark.parametrize("following_error_limit", [0.0005, 0.0025])
def test_the_leash_bounds_the_push_against_an_obstacle(following_error_limit):
    stage = Stage(following_error_limit=following_error_limit)
    backend = MujocoBackend(scene(stage, (0.0, 0.0, 0.0282), Box(), ContactLaw(stiffness=100e3)))
    backend.start()
    largest = stage.stiffness(TIP.mass) * following_error_limit
    for _ in range(1500):
        backend.step(Command((0.0, 0.0, -0.004)))
    assert backend.truth().force[2] == pytest.approx(largest, rel=0.01)
    for _ in range(
        200
    ):  # no wind-up: backing off frees the tip after the following-error limit and the depth are taken back
        backend.step(Command((0.0, 0.0, 0.03)))
    assert not backend.truth().touching


def test_another_seed_gives_other_wrenches_and_the_same_motion():
    start = (0.0, 0.0, 0.0485)
    a, b = (drive(MujocoBackend(scene(start=start), sensor=white_noise(0.05, 1e-3, s))) for s in (1, 2))
    assert [s.arm for s in a] == [s.arm for s in b]
    assert all(s.wrenches[0].wrench != t.wrenches[0].wrench for s, t in zip(a, b, strict=True))


def test_noise_has_the_standard_deviation_asked_for_and_is_white():
    clean = MujocoBackend(scene()).start().wrenches[0].wrench
    backend = MujocoBackend(scene(), sensor=white_noise(0.05, 2e-3, seed=5))
    backend.start()
    n = 4000
    noise = np.array([backend.step(Command()).wrenches[0].wrench for _ in range(n)]) - clean
    wanted = np.array([0.05] * 3 + [2e-3] * 3)
    assert np.allclose(noise.std(axis=0) / wanted, 1.0, atol=5 / math.sqrt(2 * n))
    assert np.all(np.abs(noise.mean(axis=0)) < 5 * wanted / math.sqrt(n))
    correlation = np.corrcoef(noise.T) - np.eye(6)
    assert np.abs(correlation).max() < 5 / math.sqrt(n)
    lagged = [np.corrcoef(noise[1:, i], noise[:-1, i])[0, 1] for i in range(6)]
    assert np.abs(lagged).max() < 5 / math.sqrt(n)


@pytest.mark.parametrize("periods", [1, 2, 5, 20])
def test_samples_are_one_period_apart(periods):
    backend = MujocoBackend(scene(), periods * 0.5e-3)
    times = [backend.start().time] + [backend.step(Command()).time for _ in range(50)]
    gaps = [b - a for a, b in itertools.pairwise(times)]
    assert gaps[1:] == pytest.approx([backend.period] * 49)
    assert gaps[0] >= 0.0


@pytest.mark.parametrize("blow", [1e12, float("nan")])
def test_a_simulation_that_diverges_says_so(blow, tmp_path, monkeypatch):
    """MuJoCo would reset itself to the start without a word; MUJOCO_LOG.TXT goes to the working directory."""
    monkeypatch.chdir(tmp_path)
    backend = MujocoBackend(scene())
    backend.start()
    backend.step(Command())
    backend._data.qvel[0] = blow
    with pytest.raises(FloatingPointError, match="diverged"):
        backend.step(Command())
