"""Controllers that no robot should have: what they return, when, and what they raise."""

import math
import random
import time
from collections.abc import Callable
from dataclasses import replace

from faults.fault_rig import Commands, Injection, raising
from palpate.runtime.data import Command, Phase

NAN, INF = math.nan, math.inf
ALLOWED = 0.24
"""[m/s]: a little below the default limit."""
LATE = 0.002
"""[s] that a slow controller takes for every period."""


def commanding(**fields: object) -> Injection:
    """Commands with these fields."""
    return Commands(lambda command: replace(command, **fields))  # type: ignore[arg-type]


def moving(velocity: Callable[[], tuple[float, ...]]) -> Injection:
    """Another velocity each period."""
    return Commands(lambda command: replace(command, velocity_base_tip=velocity()))


class Growing:
    """A velocity that grows by as much per period as the default acceleration allows."""

    def __init__(self, direction: tuple[float, float, float], most: float) -> None:
        self._direction, self._most, self._steps = direction, most, 0

    def __call__(self) -> tuple[float, ...]:
        self._steps += 1
        return tuple(min(self._most, 0.024 * self._steps) * each for each in self._direction)


def _alternating() -> Callable[[], tuple[float, ...]]:
    signs = iter(lambda: True, False)
    state = [0]

    def velocity() -> tuple[float, ...]:
        next(signs)
        state[0] += 1
        return (0.012 * (-1) ** state[0], 0.0, 0.0)

    return velocity


def _late(command: Command) -> Command:
    time.sleep(LATE)
    return command


CONTROLLERS: dict[str, Injection] = {
    "drives straight down at 20 mm/s": moving(Growing((0.0, 0.0, -1.0), 0.02)),
    "drives straight down as fast as is allowed": moving(Growing((0.0, 0.0, -1.0), ALLOWED)),
    "drives sideways as fast as is allowed": moving(Growing((0.0, 1.0, 0.0), ALLOWED)),
    "goes away as fast as is allowed, for ever": moving(Growing((0.0, 0.0, 1.0), ALLOWED)),
    "turns round the force that it should hold": Commands(
        lambda c: replace(c, velocity_base_tip=tuple(-x for x in c.velocity_base_tip))
    ),
    "shakes at half of the sampling rate": moving(_alternating()),
    "commands at random": moving(lambda: tuple(random.uniform(-0.3, 0.3) for _ in range(3))),
    "commands 1e308 m/s": commanding(velocity_base_tip=(0.0, 0.0, -1e308)),
    "commands infinity": commanding(velocity_base_tip=(0.0, 0.0, -INF)),
    "commands denormal numbers": commanding(velocity_base_tip=(5e-324, 0.0, -5e-324)),
    "commands integers beyond any float": commanding(velocity_base_tip=(0, 0, -(10**400))),
    "commands text": commanding(velocity_base_tip=("0", "0", "0")),
    "commands None": commanding(velocity_base_tip=None),
    "turns by NaN": commanding(angular_velocity_base_tip=(NAN, 0.0, 0.0)),
    "turns too fast": commanding(angular_velocity_base_tip=(0.0, 0.0, 50.0)),
    "returns a list": Commands(lambda command: [command]),
    "returns an exception": Commands(lambda command: ValueError("no")),
    "has a phase that is none": commanding(phase="PANIC"),
    "says that it is done while it presses": commanding(phase=Phase.DONE),
    "is slow": Commands(_late),
    "ends the program": Commands(raising(lambda: SystemExit(3))),
    "runs out of memory": Commands(raising(MemoryError)),
    "recurs without end": Commands(raising(RecursionError)),
    "raises what is no Exception": Commands(raising(lambda: GeneratorExit("no"))),
}
"""By what they do."""
