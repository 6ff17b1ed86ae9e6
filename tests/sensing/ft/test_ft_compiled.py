"""The compiled sample is bit for bit what plain Python makes of it."""

import msgspec
import numpy as np
import pytest

from palpate.sensing.compensation import contact_wrench
from palpate.sensing.ft import FTPipeline
from palpate.sensing.ft.compiled import filtered, sample
from sensing.ft.sensor_examples import fingertip


def in_python(sections, states, wrench):
    """Transposed direct form II, section after section."""
    for (b0, b1, b2, a1, a2), (first, second) in zip(sections, states, strict=True):
        out = []
        for i, x in enumerate(wrench):
            y = b0 * x + first[i]
            first[i], second[i] = b1 * x - a1 * y + second[i], b2 * x - a2 * y
            out.append(y)
        wrench = tuple(out)
    return wrench


@pytest.mark.parametrize("channels", [6, 8])
def test_bit_for_bit(channels):
    sensor = fingertip(channels)
    pipeline = FTPipeline(sensor)
    sections = pipeline._filter.sections
    rng = np.random.default_rng(1)
    for k in range(200):
        reading = tuple(rng.normal(size=channels).tolist())
        acceleration = tuple(rng.normal(scale=9.81, size=3).tolist())
        load = np.subtract(sensor.calibration.map.step(reading), sensor.bias).tolist()
        wrench = contact_wrench(load, acceleration, sensor.payload.payload)
        if k == 0:
            states = [([(1.0 - s.b0) * x for x in wrench], [(s.b2 - s.a2) * x for x in wrench]) for s in sections]
        assert pipeline.step(reading, acceleration).wrench == in_python(sections, states, wrench)


def test_it_compiles_nothing_after_it_was_built():
    pipeline = FTPipeline(fingertip())
    before = [list(kernel.signatures) for kernel in (filtered, sample)]
    for reading in ((0.1,) * 6, [0.1] * 6, np.full(6, 0.1), (0, 0, 0, 0, 0, 1), (np.nan,) * 6, (1e200,) * 6):
        pipeline.step(reading, (0, 0, 9.81))
    assert [list(kernel.signatures) for kernel in (filtered, sample)] == before


@pytest.mark.parametrize("channel", range(6))
def test_a_load_about_a_limit_is_judged_as_in_words(channel):
    """The compiled comparison stays clear of the limit, and leaves what is near to the words."""
    sensor = msgspec.structs.replace(fingertip(), calibration=None, bias_force=(0.0,) * 3, bias_moment=(0.0,) * 3)
    limit = sensor.axis_limits[channel]
    for factor, ok in ((1.0 - 1e-15, True), (1.0 - 1e-8, True), (1.0, True), (1.0 + 1e-15, False), (1.1, False)):
        reading = [0.0] * 6
        reading[channel] = factor * limit
        assert FTPipeline(sensor).step(reading, (0.0, 0.0, 9.81)).health.ok is ok
