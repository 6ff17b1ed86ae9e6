"""One reading of an imperfect force/torque sensor, compiled.

The load is known at the times of the calls and straight in between. The bandwidth has been followed up to the time
`FOLLOWED`; what came later waits in a queue, for as long as latency and clock want. A call follows it on to the
time of the newest sample that is ready, and makes a reading of what is there.

A straight piece of load from u to v in a time h leads a first-order lag of rate w, with x = w h, E = exp(-x) and
p = (1 - E)/x, from y to E y + (p - E) u + (1 - p) v. One of second order follows a ramp of slope s at the distance
2 z s/w behind; what it is off that decays freely.
"""

import math
from collections.abc import Callable
from typing import TypeVar, cast

import numpy as np

from palpate.compiling import njit
from palpate.errors import FloatArray

_Function = TypeVar("_Function", bound=Callable[..., object])

CHANNELS = 9
"""A wrench and an acceleration."""

# constants of the sensor: the position of each in `fixed`
LAG = 0  # order of the bandwidth
RATE = 1  # w [rad/s]
DAMPING = 2  # z
LATENCY = 3
CLOCK_RATE = 4  # 0: samples when it is read
CLOCK_OFFSET = 5
LOG_LOSS = 6  # log of the probability of a loss; 0: none is lost
RANDOM = 7  # whether it takes draws at all
QUANTISED = 8
MIXED = 9
TEMPERATURE = 10  # 0: none, 1: warm-up, 2: profile
WARM_RISE = 11
WARM_TIME = 12
BIAS = 13
PER_KELVIN = 19
SD = 25
WALK_RATE = 31
STEP = 37
LIMIT = 43
MATRIX = 49
PROFILE = 85  # number of points, then times, then rises

# memory: the position of each in `memory`
STARTED = 0
FOLLOWED = 1  # up to when the bandwidth was followed
WAITING = 2  # number of loads in the queue
OLDEST = 3  # where its oldest one is
LAST_TIME = 4  # of a call
LAST_TICK = 5  # of the clock, that was dealt with
NEXT_DRAW = 6
WALKED = 7  # up to when the bias has wandered
HELD = 8  # the load at FOLLOWED
VALUE = 17  # what the bandwidth lets through then
SPEED = 26  # and its rate of change
WALK = 35
READING = 41  # stamp, wrench, acceleration
QUEUE = 51  # rows of time and load

READING_WIDTH = 1 + CHANNELS
QUEUE_WIDTH = 1 + CHANNELS
DRAWS = 13
"""Per sample: six of noise and six of the random walk (standard normal), one for its loss (above 0, at most 1)."""

LOSS_DRAW = 12

REPEATED, FRESH, OUT_OF_DRAWS, NOT_LATER, TOO_DENSE = range(5)
"""What a call finds: the reading of before; a fresh one; that draws, a later time or a longer queue is missing."""

_SAME_TICK = 1e-6
"""Of a clock's period, that rounding may put a time before its tick."""


def _compiled(function: _Function) -> _Function:
    """Compile a function of the inner loop; it keeps its type."""
    return cast(_Function, njit(error_model="numpy")(function))


def _compiled_once(function: _Function) -> _Function:
    """Compile a function that Python calls, and what it calls, and keep the result on disk."""
    return cast(_Function, njit(error_model="numpy", cache=True)(function))


@_compiled
def _first_order(h: float, end: FloatArray, fixed: FloatArray, memory: FloatArray) -> None:
    x = fixed[RATE] * h
    E = math.exp(-x)
    p = -math.expm1(-x) / x
    for i in range(CHANNELS):
        u, v = memory[HELD + i], end[i]
        memory[VALUE + i] = E * memory[VALUE + i] + (p - E) * u + (1.0 - p) * v


@_compiled
def _second_order(h: float, end: FloatArray, fixed: FloatArray, memory: FloatArray) -> None:
    w, z = fixed[RATE], fixed[DAMPING]
    turn = w * math.sqrt(1.0 - z * z)
    fading = math.exp(-z * w * h)
    b = fading * (math.sin(turn * h) / turn if turn * h > 1e-8 else h)
    c = fading * math.cos(turn * h)
    for i in range(CHANNELS):
        u, v = memory[HELD + i], end[i]
        slope = (v - u) / h
        behind = 2.0 * z * slope / w
        off, off_speed = memory[VALUE + i] - u + behind, memory[SPEED + i] - slope
        memory[VALUE + i] = v - behind + (c + z * w * b) * off + b * off_speed
        memory[SPEED + i] = slope - w * w * b * off + (c - z * w * b) * off_speed


@_compiled
def _follow(time: float, end: FloatArray, fixed: FloatArray, memory: FloatArray) -> None:
    """Follow the bandwidth to `time`, along a straight piece to the load `end`, shape (9,)."""
    h = time - memory[FOLLOWED]
    if fixed[LAG] == 1.0:
        _first_order(h, end, fixed, memory)
    elif fixed[LAG] == 2.0:
        _second_order(h, end, fixed, memory)
    for i in range(CHANNELS):
        memory[HELD + i] = end[i]
        if fixed[LAG] == 0.0:
            memory[VALUE + i] = end[i]
    memory[FOLLOWED] = time


@_compiled
def _follow_to(time: float, fixed: FloatArray, memory: FloatArray, end: FloatArray) -> None:
    """Follow the bandwidth through the queue to `time`; `end` is room for 9 numbers."""
    room = (len(memory) - QUEUE) // QUEUE_WIDTH
    while memory[WAITING] > 0.0:
        row = QUEUE + QUEUE_WIDTH * int(memory[OLDEST])
        if not memory[row] <= time:
            break
        _follow(memory[row], memory[row + 1 : row + QUEUE_WIDTH], fixed, memory)
        memory[OLDEST] = (memory[OLDEST] + 1.0) % room
        memory[WAITING] -= 1.0
    if memory[WAITING] > 0.0 and time > memory[FOLLOWED]:
        row = QUEUE + QUEUE_WIDTH * int(memory[OLDEST])
        share = (time - memory[FOLLOWED]) / (memory[row] - memory[FOLLOWED])
        for i in range(CHANNELS):
            end[i] = memory[HELD + i] + share * (memory[row + 1 + i] - memory[HELD + i])
        _follow(time, end, fixed, memory)


@_compiled
def _warmth(time: float, fixed: FloatArray) -> float:
    """Return how much warmer it is than when the bias was found [K]."""
    if fixed[TEMPERATURE] == 0.0:
        return 0.0
    if fixed[TEMPERATURE] == 1.0:
        return float(fixed[WARM_RISE] * -math.expm1(-max(time, 0.0) / fixed[WARM_TIME]))
    count = int(fixed[PROFILE])
    times, rises = PROFILE + 1, PROFILE + 1 + count
    if time <= fixed[times]:
        return float(fixed[rises])
    low, high = 0, count
    while high - low > 1:
        middle = (low + high) // 2
        if fixed[times + middle] <= time:
            low = middle
        else:
            high = middle
    if low == count - 1:
        return float(fixed[rises + low])
    share = (time - fixed[times + low]) / (fixed[times + low + 1] - fixed[times + low])
    return float(fixed[rises + low] + share * (fixed[rises + low + 1] - fixed[rises + low]))


@_compiled
def _read(stamp: float, fixed: FloatArray, memory: FloatArray, draw: FloatArray) -> None:
    """Make a reading, stamped `stamp`, of what the bandwidth lets through."""
    warmth = _warmth(stamp, fixed)
    wandering = math.sqrt(max(stamp - memory[WALKED], 0.0))
    memory[WALKED] = stamp
    memory[READING] = stamp
    for i in range(6):
        x = memory[VALUE + i]
        if fixed[MIXED] > 0.0:
            x = 0.0
            for j in range(6):
                x += fixed[MATRIX + 6 * i + j] * memory[VALUE + j]
        x += fixed[BIAS + i] + fixed[PER_KELVIN + i] * warmth
        if fixed[RANDOM] > 0.0:
            memory[WALK + i] += fixed[WALK_RATE + i] * wandering * draw[6 + i]
            x += memory[WALK + i] + fixed[SD + i] * draw[i]
        if fixed[QUANTISED] > 0.0 and fixed[STEP + i] > 0.0:
            x = fixed[STEP + i] * np.rint(x / fixed[STEP + i])
        limit = fixed[LIMIT + i]
        if x > limit:
            x = limit
        elif x < -limit:
            x = -limit
        memory[READING + 1 + i] = x
    for i in range(6, CHANNELS):
        memory[READING + 1 + i] = memory[VALUE + i]


@_compiled
def _newest(time: float, fixed: FloatArray, memory: FloatArray, loss_draw: float) -> tuple[float, float]:
    """Return the time of the newest sample that has arrived, and up to when the load is done with.

    The first is not a number if nothing has arrived since the last call.
    """
    now = time - fixed[LATENCY]
    first = memory[STARTED] == 0.0
    lost = 0.0 if first or fixed[LOG_LOSS] == 0.0 else math.floor(math.log(loss_draw) / fixed[LOG_LOSS])
    rate, offset = fixed[CLOCK_RATE], fixed[CLOCK_OFFSET]
    if rate == 0.0:
        return (now if lost == 0.0 else math.nan), now
    tick = math.floor((now - offset) * rate + _SAME_TICK)
    if not first and tick <= memory[LAST_TICK]:
        return math.nan, memory[FOLLOWED]
    # the newest ones are lost, as many in a row as a geometric law says; one before may still have arrived
    arrived = first or tick - lost > memory[LAST_TICK]
    memory[LAST_TICK] = tick
    newest = min(offset + tick / rate, now)
    return (min(offset + (tick - lost) / rate, now), newest) if arrived else (math.nan, newest)


@_compiled_once
def advance(
    time: float,
    fx: float,
    fy: float,
    fz: float,
    mx: float,
    my: float,
    mz: float,
    ax: float,
    ay: float,
    az: float,
    fixed: FloatArray,
    memory: FloatArray,
    draws: FloatArray,
    end: FloatArray,
) -> int:
    """Take the load at `time`, and make the reading that is the newest then; returns what it found.

    Unless that is REPEATED or FRESH, nothing has changed.

    Args:
        time: [s], later than at the last call.
        fx: With fy to az, the load [N, N m] and the acceleration [m/s^2].
        fy: See fx.
        fz: See fx.
        mx: See fx.
        my: See fx.
        mz: See fx.
        ax: See fx.
        ay: See fx.
        az: See fx.
        fixed: Constants of the sensor.
        memory: All that it remembers, its reading included.
        draws: Random numbers, shape (n, 13).
        end: Room for 9 numbers.
    """
    first = memory[STARTED] == 0.0
    if not (math.isfinite(time) and (first or time > memory[LAST_TIME])):
        return NOT_LATER
    room = (len(memory) - QUEUE) // QUEUE_WIDTH
    if memory[WAITING] >= room:
        return TOO_DENSE
    if fixed[RANDOM] > 0.0 and memory[NEXT_DRAW] >= len(draws):
        return OUT_OF_DRAWS
    memory[LAST_TIME] = time
    load = (fx, fy, fz, mx, my, mz, ax, ay, az)
    if first:
        # what is there at first has been there for ever
        memory[FOLLOWED] = time
        for i in range(CHANNELS):
            memory[HELD + i] = memory[VALUE + i] = load[i]
    else:
        row = QUEUE + QUEUE_WIDTH * ((int(memory[OLDEST]) + int(memory[WAITING])) % room)
        memory[row] = time
        for i in range(CHANNELS):
            memory[row + 1 + i] = load[i]
        memory[WAITING] += 1.0
    draw = draws[int(memory[NEXT_DRAW]) if fixed[RANDOM] > 0.0 else 0]
    tick_before = memory[LAST_TICK]
    stamp, done = _newest(time, fixed, memory, draw[LOSS_DRAW])
    if fixed[CLOCK_RATE] > 0.0 and not first and memory[LAST_TICK] == tick_before:
        return REPEATED
    if fixed[RANDOM] > 0.0:
        memory[NEXT_DRAW] += 1.0
    if first:
        memory[WALKED] = stamp
    memory[STARTED] = 1.0
    if math.isnan(stamp):
        # or the queue would grow while samples are lost
        _follow_to(done, fixed, memory, end)
        return REPEATED
    _follow_to(stamp, fixed, memory, end)
    _read(stamp, fixed, memory, draw)
    return FRESH
