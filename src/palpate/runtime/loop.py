"""The loop: read, sense, control, supervise, once per period."""

import gc
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from palpate.errors import FloatArray, positive
from palpate.runtime.data import Command, Observation, Phase, Sample
from palpate.runtime.protocols import Backend, Controller
from palpate.runtime.supervisor import Supervisor, Trip
from palpate.runtime.touch import Touch
from palpate.spatial import ZERO, norm

Observer = Callable[[Sample, Observation, Command], None]
"""Sees every period after the supervisor: recorders, progress bars."""

REST_SPEED = 1e-3
"""A tip slower than this [m/s] counts as stopped."""

REST_TIME = 0.02
"""for this long [s]: a turning point is not rest."""

LONGEST_STOP = 0.5
"""How long the robot is given to come to rest [s]."""


class Ending(StrEnum):
    """How a run ended."""

    DONE = "done"
    """The controller finished."""
    LOST = "contact lost"
    """The controller lost contact and could not find it again."""
    TRIPPED = "stopped by the supervisor"
    TIME_UP = "time is up"


@dataclass(frozen=True, slots=True, eq=False)
class RunResult:
    """How a run went.

    Attributes:
        ending: How it ended.
        trip: What the supervisor objected to, if it did.
        stopped: Whether the tip came to rest at the end.
        duration: On the back end's clock [s].
        wall_time: On the wall clock [s].
        compute_time: Sensing, control, supervision and observers, per period, shape (n,) [s].
        period: Control period [s].
    """

    ending: Ending
    trip: Trip | None
    stopped: bool
    duration: float
    wall_time: float
    compute_time: FloatArray
    period: float

    @property
    def real_time_factor(self) -> float:
        """Time on the back end's clock per wall time."""
        return self.duration / self.wall_time

    @property
    def overruns(self) -> int:
        """Number of periods whose computation alone took longer than the period."""
        return int(np.count_nonzero(self.compute_time > self.period))


def run(
    backend: Backend,
    touch: Touch,
    controller: Controller,
    supervisor: Supervisor | None = None,
    *,
    duration: float,
    observers: Sequence[Observer] = (),
) -> RunResult:
    """Run a controller until it is done, the supervisor objects, or the time is up.

    However it ends, by an exception too, the robot is brought to rest and the back end closed.

    Args:
        backend: The robot.
        touch: Its fingers.
        controller: What it is to do.
        supervisor: Its limits; safe defaults if not given.
        duration: Longest time on the back end's clock [s].
        observers: Called once per period with sample, observation and command.
    """
    positive("duration", duration, "s")
    supervisor = supervisor or Supervisor()
    compute_time: list[float] = []
    ending = Ending.TIME_UP
    clock = time.perf_counter
    with backend, _no_garbage_collection():
        sample = backend.start()
        first_time = sample.time
        touch.start()
        supervisor.start()
        controller.start(touch.sense(sample))
        started = clock()
        try:
            for _ in range(round(duration / backend.period)):
                before = clock()
                observation = touch.sense(sample)
                command = supervisor.check(observation, controller.step(observation))
                for observer in observers:
                    observer(sample, observation, command)
                compute_time.append(clock() - before)
                if supervisor.trip is not None:
                    ending = Ending.TRIPPED
                    break
                if command.phase.is_final:
                    ending = Ending.DONE if command.phase is Phase.DONE else Ending.LOST
                    break
                sample = backend.step(command)
            wall_time = clock() - started
            end_time = sample.time
            if supervisor.trip is not None:
                _give_way(backend, touch, supervisor, sample)
            stopped = _bring_to_rest(backend)
        except BaseException:
            # close() stops the robot in any case; a failure to brake must not hide why the run ended
            with suppress(Exception):
                _bring_to_rest(backend)
            raise
    return RunResult(
        ending,
        supervisor.trip,
        stopped,
        end_time - first_time,
        wall_time,
        np.array(compute_time),
        backend.period,
    )


def _give_way(backend: Backend, touch: Touch, supervisor: Supervisor, sample: Sample) -> None:
    """Standing still is not enough where the robot presses too hard: its servos would press on."""
    for _ in range(round(LONGEST_STOP / backend.period)):
        command = supervisor.give_way(touch.sense(sample))
        if command.velocity_base_tip == ZERO:
            return
        sample = backend.step(command)


def _bring_to_rest(backend: Backend) -> bool:
    slow = 0
    wanted = max(1, round(REST_TIME / backend.period))
    for _ in range(max(wanted, round(LONGEST_STOP / backend.period))):
        sample = backend.step(Command())
        slow = slow + 1 if norm(sample.arm.velocity_base_tip) < REST_SPEED else 0
        if slow >= wanted:
            return True
    return False


@contextmanager
def _no_garbage_collection() -> Iterator[None]:
    """Keep the cyclic collector off: a full collection takes tens of milliseconds, and periods make no cycles."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
