"""Stability margins of a sampled loop, from its open-loop response on the unit circle.

The models here are those of `palpate.controllers.gains`, sampled: a velocity that is commanded acts a whole number
of periods later, is held for one, and presses into a spring.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import InvalidValueError, positive

ComplexArray = npt.NDArray[np.complex128]

FREQUENCIES = 4000
"""Of the grid, spread by ratio over four decades below the Nyquist frequency: neighbours are 0.23 % apart."""


@dataclass(frozen=True, slots=True)
class LoopMargins:
    """How far a stable loop is from oscillating.

    Attributes:
        gain_margin: By which factor the loop's gain may grow; infinite if it never oscillates.
        phase_margin_deg: By how much its phase may fall at the gain's crossover [degrees]; the least of several.
        modulus_margin: Least distance of the open loop from -1: 1 / it bounds the sensitivity.
    """

    gain_margin: float
    phase_margin_deg: float
    modulus_margin: float


def whole_delays(delay: float, period: float) -> int:
    """Return how many whole periods a command takes, when holding it for one is half a period of `delay` [s].

    Raises:
        InvalidValueError: The delay is shorter than a period and a half: no sampled loop is as fast.
    """
    steps = round(positive("delay", delay, "s") / positive("period", period, "s") - 0.5)
    if steps < 1:
        raise InvalidValueError(
            f"delay = {delay:g} s: must be at least one and a half periods of {period:g} s, which sampling and "
            "holding take"
        )
    return steps


def on_unit_circle() -> ComplexArray:
    """Return z = exp(i w) for w up to the Nyquist frequency, shape (FREQUENCIES,)."""
    z: ComplexArray = np.exp(1j * np.geomspace(1e-4 * math.pi, math.pi, FREQUENCIES))
    return z


def velocity_to_displacement(z: ComplexArray, steps: int, period: float) -> ComplexArray:
    """Return the response from a commanded velocity to where the tip is [s]: delay, hold and integration."""
    response: ComplexArray = period * z ** (-float(steps)) / (z - 1.0)
    return response


def loop_margins(open_loop: Callable[[ComplexArray], ComplexArray]) -> LoopMargins:
    """Return the margins of a loop that is stable when closed.

    Args:
        open_loop: Response L(z) for z on the unit circle, without unstable poles; the loop closes by -1.
    """
    L = open_loop(on_unit_circle())
    phase, size = np.unwrap(np.angle(L)), np.abs(L)
    # at half a turn, and every whole turn from there, L lies on the negative real axis
    turns = np.floor((phase - math.pi) / (2.0 * math.pi))
    crossings = np.flatnonzero(np.diff(turns) != 0.0)
    largest = max((float(max(size[i], size[i + 1])) for i in crossings), default=0.0)
    largest = max(largest, -float(L[-1].real))  # at the Nyquist frequency L is real
    falls = np.flatnonzero((size[:-1] >= 1.0) & (size[1:] < 1.0))
    margins = [abs(math.remainder(float(phase[i]) - math.pi, 2.0 * math.pi)) for i in falls]
    return LoopMargins(
        1.0 / largest if largest > 0.0 else math.inf,
        math.degrees(min(margins, default=math.pi)),
        float(np.abs(1.0 + L).min()),
    )
