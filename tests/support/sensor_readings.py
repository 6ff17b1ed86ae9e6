"""What simulated sensors show of a load, for tests."""

import numpy as np

from palpate.sim.sensor.simulation import simulated_sensor

DT, REST, NOTHING = 1e-3, (0.0, 0.0, 9.81), (0.0,) * 6


def sampled(sensor, count, load=NOTHING, period=DT):
    """Return so many samples of a steady load [N, N m]."""
    return [sensor.step(period * k, load, REST) for k in range(count)]


def readings(model, count, load=NOTHING, seed=1, period=DT):
    """Return the wrenches that a sensor of a model shows of a steady load, shape (count, 6)."""
    return np.array(
        [sample.wrench for sample in sampled(simulated_sensor(model, period, seed), count, load, period)]
    )
