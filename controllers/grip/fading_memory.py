"""A filter of noisy samples of a force and a torque, which knows their rates and extrapolates them."""

import math
from functools import cache
from typing import Any

import numpy as np

from palpate.compiling import machine_code, njit
from palpate.errors import FloatArray, positive

FORCE = 3
"""So many of the values, the first ones, are a force [N]; the others are torques [N m]."""

KNOWN, ODD = 0, 1
"""Where in the last row of its state it says whether there was a sample, and whether the last was odd."""


class FadingMemory:
    """A fading-memory filter of first order (Morrison 1969; a critically damped alpha-beta filter).

    It follows a ramp without lag. Of white noise sd it leaves sd sqrt(5 dt / 4 T) in the value and
    sd sqrt(dt / 4 T^3) in the rate, T the smoothing time. A sample that is much farther from its prediction than
    usual is taken if the next one is, too: one period late, but a single glitch, with the rate that it seems to
    tell, would raise a grip many times over.

    Attributes:
        state: Values, their rates, and what is known of them: shape (3, size).
    """

    def __init__(self, smoothing: float, period: float, odd_force: float, odd_torque: float, size: int) -> None:
        """Take how it forgets, and what is odd.

        Args:
            smoothing: Time constant of the memory [s].
            period: Of the samples [s].
            odd_force: A force that is farther off than this [N],
            odd_torque: or torques that are farther off than this [N m], are odd.
            size: How many values there are.
        """
        keep = math.exp(-positive("period", period, "s") / positive("smoothing", smoothing, "s"))
        self._constants = (
            *(period, 1.0 - keep * keep, (1.0 - keep) ** 2 / period),
            *(odd_force * odd_force, odd_torque * odd_torque),
        )
        self.state = np.zeros((3, size))
        _kernel(size)  # compiled before the first period

    def restart(self) -> None:
        """Forget all samples: the next one initialises the filter at rest."""
        self.state[:] = 0.0

    def step(self, values: tuple[float, ...]) -> None:
        """Take a sample of this period."""
        _kernel(self.state.shape[1])(self.state, self._constants, values)

    def ahead(self, time: float) -> FloatArray:
        """Return the values so long after the last sample [s]; zeros before the first."""
        values: FloatArray = self.state[0] + time * self.state[1]
        return values


@njit(cache=True)
def _take(state: Any, constants: Any, values: Any) -> None:
    dt, to_value, to_rate, odd_force, odd_torque = constants
    value, rate, flags = state[0], state[1], state[2]
    if flags[KNOWN] == 0.0:
        flags[KNOWN] = 1.0
        for i in range(len(value)):
            value[i] = values[i]
        return
    force = torque = 0.0
    for i in range(len(value)):
        off = values[i] - (value[i] + dt * rate[i])
        if i < FORCE:
            force += off * off
        else:
            torque += off * off
    far = force > odd_force or torque > odd_torque
    odd = far and flags[ODD] == 0.0
    flags[ODD] = 1.0 if far else 0.0
    for i in range(len(value)):
        predicted = value[i] + dt * rate[i]
        off = values[i] - predicted
        value[i] = predicted
        if not odd:
            value[i] += to_value * off
            rate[i] += to_rate * off


@cache
def _kernel(size: int) -> Any:
    return machine_code(_take, np.zeros((3, size)), (0.0,) * 5, (0.0,) * size)
