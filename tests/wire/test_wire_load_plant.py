"""A load over time is applied when it is due, and begins anew with every start."""

import math

from hypothesis import given
from hypothesis import strategies as st

from palpate.hw.emulators.simple_plant import LoadPlant
from palpate.spatial import ZERO


@given(period=st.floats(1e-4, 0.1), steps=st.integers(0, 50))
def test_the_load_is_that_of_its_time(period, steps):
    plant = LoadPlant(lambda time: (time, 0.0, -1.0, 0.0, math.sin(time), 0.0), period)
    for _ in range(2):  # a second start is as the first
        state = plant.start()
        for _ in range(steps):
            state = plant.step(ZERO, ZERO, ())
        assert state.time == steps * period
        (sample,) = state.wrenches
        assert sample.time == state.time
        assert sample.wrench == (state.time, 0.0, -1.0, 0.0, math.sin(state.time), 0.0)
    assert state.arm.velocity_base_tip == ZERO
    plant.close()
