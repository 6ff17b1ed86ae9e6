"""Simulated sensors remember all they must and nothing else: seeds, restarts, snapshots, neighbours, odd times."""

import math
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.sim.sensor import kernel
from palpate.sim.sensor.draws import BLOCK
from palpate.sim.sensor.model import SensorModel, noisy_sensor
from palpate.sim.sensor.presets import PresetSensor, nano17, sensor_preset
from palpate.sim.sensor.simulation import ImperfectSensor, simulated_sensor
from palpate.sim.sensor.stages import Dropouts, FirstOrderLag, RandomWalk, SampleClock, SecondOrderLag, alike

DT = 1e-3
EVERYTHING = replace(
    nano17(3),
    bandwidth=SecondOrderLag(200.0),
    bias=(0.1, 0.2, 0.3, 1e-3, 2e-3, 3e-3),
    random_walk=RandomWalk(alike(0.01, 1e-4)),
    clock=SampleClock(760.0, 0.3e-3),
    latency=2.3e-3,
    dropouts=Dropouts(0.2),
)
MODELS = [SensorModel(), noisy_sensor(0.01, 1e-4), EVERYTHING, *(sensor_preset(p) for p in PresetSensor)]


def load(k):
    wrench = tuple((1.0 if i < 3 else 0.1) * math.sin(0.03 * k + i) for i in range(6))
    return wrench, (math.sin(0.07 * k), math.cos(0.11 * k), 9.81 + math.sin(0.05 * k))


def run(sensor, first, last):
    return [sensor.step(DT * k, *load(k)) for k in range(first, last)]


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_the_same_seed_gives_the_same_samples_bit_for_bit_also_after_a_restart(model):
    sensor = simulated_sensor(model, DT, 7)
    fresh, first = sensor.state(), run(sensor, 0, 700)
    shown = repr(first)
    assert run(simulated_sensor(model, DT, 7), 0, 700) == first
    sensor.restart(7)
    assert run(sensor, 0, 700) == first
    sensor.set_state(fresh)
    assert run(sensor, 0, 700) == first
    sensor.restart(8)
    other = run(sensor, 0, 700)
    if model.noise is not None:
        # rounded, some are the same by chance
        assert np.mean([a.wrench != b.wrench for a, b in zip(first, other, strict=True)]) > 0.9
    assert repr(first) == shown  # samples are values


@settings(max_examples=30, deadline=None)
@given(
    st.sampled_from(MODELS),
    st.integers(1, 3 * BLOCK),
    st.integers(0, 2 * BLOCK),
)
def test_a_snapshot_in_mid_run_goes_on_bit_for_bit_here_and_elsewhere(model, before, after):
    sensor = simulated_sensor(model, DT, 7)
    run(sensor, 0, before)
    state = sensor.state()
    rest = run(sensor, before, before + 300)
    for other in (sensor, simulated_sensor(model, DT, 99)):
        run(other, before + 300, before + 300 + after)
        other.set_state(state)
        assert run(other, before, before + 300) == rest
    copied = pickle.loads(pickle.dumps(state))
    sensor.set_state(copied)
    assert run(sensor, before, before + 300) == rest


def test_sensors_do_not_disturb_one_another():
    alone = run(ImperfectSensor(EVERYTHING, DT, 7), 0, 600)
    one, other = ImperfectSensor(EVERYTHING, DT, 7), ImperfectSensor(EVERYTHING, DT, 8)
    together = []
    for k in range(600):
        other.step(DT * k, *load(5 * k))
        together.append(one.step(DT * k, *load(k)))
    assert together == alone


def test_a_stage_more_leaves_the_noise_as_it_was():
    plain = noisy_sensor(0.01, 1e-4)
    wandering = replace(plain, random_walk=RandomWalk(alike(0.01, 1e-4)))
    sensors = [ImperfectSensor(model, DT, 5) for model in (plain, replace(wandering, noise=None), wandering)]
    zero = (0.0,) * 6, (0.0, 0.0, 9.81)
    noise, walk, both = (np.array([sensor.step(DT * k, *zero).wrench for k in range(600)]) for sensor in sensors)
    assert np.allclose(noise + walk, both, atol=1e-15)
    # nor do the two stages share their draws
    shared = [np.corrcoef(noise[1:, i], np.diff(walk[:, i]))[0, 1] for i in range(6)]
    assert np.abs(shared).max() < 5.0 / math.sqrt(len(noise))


@pytest.mark.parametrize("time", [0.004, 0.003, -1.0, math.nan, math.inf])
def test_a_time_that_is_not_later_is_refused_and_changes_nothing(time):
    sensor, untouched = ImperfectSensor(EVERYTHING, DT, 7), ImperfectSensor(EVERYTHING, DT, 7)
    assert run(sensor, 0, 5) == run(untouched, 0, 5)
    with pytest.raises(InvalidValueError, match="later"):
        sensor.step(time, *load(9))
    assert run(sensor, 5, 300) == run(untouched, 5, 300)


def test_steps_too_close_together_for_the_latency_are_refused_not_forgotten():
    sensor = ImperfectSensor(SensorModel(latency=0.01), 1e-3)

    def hurry():
        for k in range(100):
            sensor.step(1e-5 * k, *load(k))

    with pytest.raises(InvalidValueError, match="closer together than the period"):
        hurry()


@settings(max_examples=40, deadline=None)
@given(
    st.floats(0.0, 0.02),
    st.one_of(st.none(), st.floats(20.0, 10_000.0)),
    st.floats(0.0, 0.95),
    st.lists(st.floats(1e-3, 0.02), min_size=150, max_size=150),
)
def test_steps_as_far_apart_as_the_period_or_farther_always_have_room(latency, rate, losses, pauses):
    clock = None if rate is None else SampleClock(rate)
    model = SensorModel(latency=latency, clock=clock, dropouts=Dropouts(losses), bandwidth=FirstOrderLag(100.0))
    sensor, time = ImperfectSensor(model, 1e-3), 0.0
    for pause in pauses:
        time += pause
        sensor.step(time, *load(0))


def test_other_kinds_of_numbers_are_taken_without_starting_a_compiler():
    sensor, other = ImperfectSensor(EVERYTHING, DT, 7), ImperfectSensor(EVERYTHING, DT, 7)
    dispatcher: Any = kernel.advance
    compiled = list(dispatcher.signatures)
    assert len(compiled) == 1
    for k in range(20):
        a = sensor.step(np.float64(k), np.array([1, 2, 3, 0, 0, 0], dtype=np.float32), (0, 0, 9))
        assert a == other.step(float(k), (1.0, 2.0, 3.0, 0.0, 0.0, 0.0), (0.0, 0.0, 9.0))
    assert list(dispatcher.signatures) == compiled
