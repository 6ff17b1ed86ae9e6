"""Whether friction opposes sliding: on a sensor that is turned about the axis of touch it seems not to.

A straight push does not show such a turn (see `direction_check`); friction does, as it takes energy from whatever
slides and has no part across the motion. Without friction nothing shows it.
"""

from math import expm1, hypot, nan

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.runtime.supervision.direction_check import LARGEST_COSINE
from palpate.runtime.supervision.observed_row import (
    ARM_TIME,
    EXPLAINED,
    FAULTY,
    FINGERS,
    HAND_JOINTS,
    NORMAL,
    NORMAL_FORCE,
    OVERLOADED,
    ROTATION,
    TANGENTIAL,
    TOUCHING,
    TURN,
    VELOCITY,
)
from palpate.runtime.supervision.turned import turned_by

PATH = 3e-3
"""Over which friction is averaged [m]: six times the 0.5 mm that tip and arm give way before they slide."""

STRAIGHT = 0.95
"""Length of the mean direction over the last `PATH` from which on a path counts: 18 degrees on a circle of 9 mm.
On a narrower one friction lags behind the direction, by what gives way and, in MuJoCo, by acceleration across."""

SLOWEST = 1e-3
"""Speed along the surface [m/s] below which a tip may stick or creep."""

SLOWEST_TURN = 1e-2
"""Angular speed [rad/s] above which the contact moves otherwise than the tip: 0.1 mm/s on a tip of 10 mm."""

LEAST_SHARE, LEAST_FORCE = 0.1, 0.3
"""Of the normal force, and [N]: a tangential force up to their sum may be error of the zero; 0.3 N is the drift
from pose to pose of the largest sensor that palpate describes (preset `axia80`)."""


MEMORY_SIZE = 9
"""Numbers that it remembers: whether they have agreed, the arm's last time stamp, the path [m], sums over it of
friction along and across the motion and of the normal force [N m], and the mean direction (three)."""

_AGREED, _TIME, _PATH, _ALONG, _ACROSS, _PRESSING, _HEADING = 0, 1, 2, 3, 4, 5, 6


@njit(error_model="numpy", cache=True)
def sliding_cosine(row: FloatArray, finger: int, memory: FloatArray) -> float:
    """Compare friction with the tip's motion over the first `PATH` of straight sliding; then rest.

    Args:
        row: See `palpate.runtime.supervision.observed_row`.
        finger: Where the first finger stands.
        memory: Written, shape (`MEMORY_SIZE`,); at first zeros, and the time stamp no number.

    Returns:
        Cosine of the angle between sliding and friction, if that is wrong; else -1.
    """
    if memory[_AGREED] != 0.0 or row[FINGERS] != 1.0 or row[HAND_JOINTS] >= 0.0:
        return -1.0
    before, memory[_TIME] = memory[_TIME], row[ARM_TIME]
    believed = row[finger + TOUCHING] != 0.0 and row[finger + EXPLAINED] != 0.0
    believed = believed and row[finger + FAULTY] == 0.0 and row[finger + OVERLOADED] == 0.0
    turn = hypot(hypot(row[TURN], row[TURN + 1]), row[TURN + 2])
    if not believed or turn > SLOWEST_TURN:
        return -1.0
    r = row[ROTATION : ROTATION + 9]
    n0, n1, n2 = turned_by(r, row[finger + NORMAL], row[finger + NORMAL + 1], row[finger + NORMAL + 2])
    v0, v1, v2 = row[VELOCITY], row[VELOCITY + 1], row[VELOCITY + 2]
    c0, c1, c2 = n1 * v2 - n2 * v1, n2 * v0 - n0 * v2, n0 * v1 - n1 * v0
    speed = hypot(hypot(c0, c1), c2)
    step = speed * (memory[_TIME] - before)
    if not (speed >= SLOWEST and step > 0.0):
        return -1.0
    h = memory[_HEADING : _HEADING + 3]
    share = 1.0 if h[0] == 0.0 and h[1] == 0.0 and h[2] == 0.0 else -expm1(-step / PATH)
    h[0] += share * (c0 / speed - h[0])
    h[1] += share * (c1 / speed - h[1])
    h[2] += share * (c2 / speed - h[2])
    if hypot(hypot(h[0], h[1]), h[2]) < STRAIGHT:
        return -1.0
    tangential = finger + TANGENTIAL
    f0, f1, f2 = turned_by(r, row[tangential], row[tangential + 1], row[tangential + 2])
    memory[_PATH] += step
    memory[_PRESSING] += step * row[finger + NORMAL_FORCE]
    memory[_ALONG] += step * (f0 * v0 + f1 * v1 + f2 * v2) / speed
    memory[_ACROSS] += step * (f0 * c0 + f1 * c1 + f2 * c2) / speed
    if memory[_PATH] < PATH:
        return -1.0
    force = hypot(memory[_ALONG], memory[_ACROSS])
    shows = force > LEAST_SHARE * memory[_PRESSING] + LEAST_FORCE * memory[_PATH]
    cosine = memory[_ALONG] / force if shows else nan
    if cosine <= LARGEST_COSINE:
        memory[_AGREED] = 1.0
    memory[_PATH : _PRESSING + 1] = 0.0
    return cosine if shows and memory[_AGREED] == 0.0 else -1.0
