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
from palpate.sensing.ft.compiled_state import drifting_axis, longest_rest, touches
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


SOUND, BROKEN, RESTING, PENDING = 0, 1, 2, 4
"""What `sample` returns of a reading: within all limits for certain; not; and besides, that channels rest for
long; that the wrench is as it was measured, as the filter has not begun or it may be impossible."""


@njit(error_model="numpy", cache=True)
def sample(
    sensor,
    products,
    sections,
    states,
    last,
    unchanged,
    frozen,
    load,
    detector,
    contact,
    limits,
    drift,
    started,
    reading,
    acceleration,
):
    """Return what a reading says.

    Args:
        sensor: Laid out as the constants above say; without a calibration it ends before it.
        products: Of the calibration, shape (m, 2).
        sections: See `filtered`; so are the states, which are written.
        states: See there.
        last: See `longest_rest`,
        unchanged: likewise,
        frozen: and the count from which there is something to say.
        load: Written, shape (6,).
        detector: See `touched`; so is the rest.
        contact: See there.
        limits: See there.
        drift: See there.
        started: Whether the filter has begun; if not, it is left alone.
        reading: Raw channels, or the wrench.
        acceleration: See `palpate.sensing.compensation.contact_wrench`.

    Returns:
        Bits of `BROKEN`, `RESTING` and `PENDING`, the contact wrench, filtered if it is not pending, and what
        `touched` returns then.
    """
    k = len(reading)
    if len(sensor) > CALIBRATION:
        matrix = sensor[CALIBRATION + k :].reshape((6, k + len(products)))
        found = calibrated(matrix, sensor[CALIBRATION : CALIBRATION + k], products, reading)
    else:
        found = (reading[0], reading[1], reading[2], reading[3], reading[4], reading[5])
    a, b, c, d, e, f = found
    found = (a - sensor[0], b - sensor[1], c - sensor[2], d - sensor[3], e - sensor[4], f - sensor[5])
    center = (sensor[PAYLOAD + 1], sensor[PAYLOAD + 2], sensor[PAYLOAD + 3])
    wrench = take_off(found, acceleration, sensor[PAYLOAD], center)

    total, finite, sound = 0.0, True, True
    for i in range(k):
        total += reading[i]
        finite = finite and reading[i] - reading[i] == 0.0
        sound = sound and sensor[RAW] < reading[i] < sensor[RAW + 1]
    loaded = felt = 0.0
    for i in range(6):
        load[i] = found[i]
        loaded += (found[i] / sensor[LIMITS + i]) ** 2
        felt += (wrench[i] / sensor[LIMITS + i]) ** 2
    sound = sound and total - total == 0.0 and loaded < sensor[LARGEST]
    what = SOUND if sound else BROKEN
    if finite and longest_rest(last, unchanged, reading) >= frozen:
        what |= RESTING
    if not (started and felt < sensor[LARGEST + 1]):
        return what | PENDING, wrench, False, -1
    wrench = filtered(sections, states, wrench)
    touching, axis = touched(detector, contact, limits, drift, wrench)
    return what, wrench, touching, axis


@njit(error_model="numpy", cache=True)
def touched(detector, contact, limits, drift, wrench):
    """Return whether a contact wrench is a touch, and the axis that drifts, or -1.

    Args:
        detector: See `touches`,
        contact: likewise.
        limits: See `drifting_axis`,
        drift: likewise.
        wrench: Six numbers [N, N m].
    """
    if touches(detector, contact, wrench[0], wrench[1], wrench[2]):
        return True, -1
    return False, drifting_axis(limits, drift, wrench)
