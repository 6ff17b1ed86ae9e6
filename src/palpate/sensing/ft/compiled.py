"""The arithmetic of a sensor's sample, compiled: from the reading to the filtered contact wrench.

What is shared with plain Python is one source for both, rounded alike. Lengths that decide are compared squared,
and only where rounding cannot matter: by more than `NEARLY`. Nearer, the caller decides, and says in words what is
wrong.
"""

import numpy as np
from numba.extending import register_jitable

from palpate.compiling import njit
from palpate.sensing.compensation import take_off
from palpate.sensing.ft.calibration_map import calibrated
from palpate.spatial import cross, scale

for _shared in (scale, cross, take_off, calibrated):
    register_jitable(_shared)

NEARLY = 1.0 - 1e-9
"""Of a limit squared: squares, sums and roots of six numbers are rounded a million times finer."""

BIAS, PAYLOAD, LIMITS, RAW, LARGEST, CALIBRATION = 0, 6, 10, 16, 18, 20
"""Where the numbers of a sensor stand in their array: bias, mass and its centre, limits of the axes, lowest and
highest reading, largest load and contact wrench relative to the limits, each squared; then offset and matrix, row
by row."""


@njit(error_model="numpy", cache=True)
def filtered(sections, states, wrench):
    """Return the filtered wrench: transposed direct form II (few roundings), sections (s, 5), states (s, 2, 6)."""
    now = np.empty(6)
    for i in range(6):
        x = wrench[i]
        for n in range(len(sections)):
            b0, b1, b2, a1, a2 = sections[n, 0], sections[n, 1], sections[n, 2], sections[n, 3], sections[n, 4]
            y = b0 * x + states[n, 0, i]
            states[n, 0, i] = b1 * x - a1 * y + states[n, 1, i]
            states[n, 1, i] = b2 * x - a2 * y
            x = y
        now[i] = x
    return (now[0], now[1], now[2], now[3], now[4], now[5])


@njit(error_model="numpy", cache=True)
def sample_wrench(sensor, products, sections, states, started, reading, acceleration):
    """Return what a reading says.

    Args:
        sensor: Laid out as the constants above say; without a calibration it ends before it.
        products: Of the calibration, shape (m, 2).
        sections: See `filtered`; so are the states, which are written.
        states: See there.
        started: Whether the filter has begun; if not, it is left alone.
        reading: Raw channels, or the wrench.
        acceleration: See `palpate.sensing.compensation.contact_wrench`.

    Returns:
        Whether the reading is within all limits for certain, the load, the contact wrench, and whether that is
        filtered, which it is if it is possible for certain.
    """
    k = len(reading)
    if len(sensor) > CALIBRATION:
        matrix = sensor[CALIBRATION + k :].reshape((6, k + len(products)))
        load = calibrated(matrix, sensor[CALIBRATION : CALIBRATION + k], products, reading)
    else:
        load = (reading[0], reading[1], reading[2], reading[3], reading[4], reading[5])
    a, b, c, d, e, f = load
    load = (a - sensor[0], b - sensor[1], c - sensor[2], d - sensor[3], e - sensor[4], f - sensor[5])
    center = (sensor[PAYLOAD + 1], sensor[PAYLOAD + 2], sensor[PAYLOAD + 3])
    wrench = take_off(load, acceleration, sensor[PAYLOAD], center)

    total, sound = 0.0, True
    for i in range(k):
        total += reading[i]
        sound = sound and sensor[RAW] < reading[i] < sensor[RAW + 1]
    loaded = felt = 0.0
    for i in range(6):
        loaded += (load[i] / sensor[LIMITS + i]) ** 2
        felt += (wrench[i] / sensor[LIMITS + i]) ** 2
    sound = sound and total - total == 0.0 and loaded < sensor[LARGEST]
    possible = felt < sensor[LARGEST + 1]
    if started and possible:
        return sound, load, filtered(sections, states, wrench), True
    return sound, load, wrench, False
