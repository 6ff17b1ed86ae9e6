"""A robot with something wrong: back end, touch, controller, and what is done to them from some period on."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import msgspec

from palpate.runtime.data import Command, Observation, Sample
from palpate.runtime.log import Event, Level, MemoryLog, Recorder, Sink
from palpate.runtime.loop import Observer, run
from palpate.runtime.protocols import Backend, Controller
from palpate.runtime.result import RunResult, result_until
from palpate.runtime.supervision import Limits, Supervisor
from palpate.runtime.touch import Touch

ChangedSample = Callable[[Sample, Sample], Sample]
"""Maps the device's sample, and its last one before the fault, to what arrives."""


class FaultyBackend:
    """A back end between the loop and a sound one; remembers every command that came through.

    Attributes:
        commands: Those that reached `step`, in order: the one of index k was made from the sample of index k.
        samples: What it gave, in order; the first is that of `start`.
        changes: What is done to samples, by the index of the first one.
        errors: What `step` raises instead of giving the sample of that index.
        truly: What the sound one gave.
        closed_after: How many commands there were when it was closed; None: it was not.
        watch: Called after each step of the sound one.
    """

    def __init__(self, sound: Backend) -> None:
        self.sound: Any = sound  # each test knows which
        self.commands: list[Command] = []
        self.samples: list[Sample] = []
        self.changes: list[tuple[int, ChangedSample]] = []
        self.errors: dict[int, Exception] = {}
        self.closed_after: int | None = None
        self.truly: list[Sample] = []
        self.watch: Callable[[], object] = lambda: None

    @property
    def period(self):
        return self.sound.period

    @property
    def pacer(self):
        return self.sound.pacer

    def start(self):
        return self._arrived(self.sound.start())

    def step(self, command):
        assert self.closed_after is None, "moved after it was closed"
        self.commands.append(command)
        if len(self.commands) in self.errors:
            self.truly.append(self.sound.step(command))  # it did arrive; the reply did not
            self.watch()
            self.samples.append(self.samples[-1])
            raise self.errors[len(self.commands)]
        return self._arrived(self.sound.step(command))

    def _arrived(self, sample):
        index = len(self.truly)
        self.truly.append(sample)
        self.watch()
        for first, change in self.changes:
            if index >= first:
                sample = change(sample, self.truly[max(first - 1, 0)])
        self.samples.append(sample)
        return sample

    def close(self):
        if self.closed_after is None:
            self.closed_after = len(self.commands)
        self.sound.close()

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        self.close()


class NoLive:
    """Live parameters that nobody changes."""

    def step(self, time: float) -> Sequence:
        return ()


@dataclass
class Rig:
    """Everything that a run needs; injections replace parts of it."""

    backend: FaultyBackend
    touch: Touch
    controller: Controller
    limits: Limits
    duration: float
    live: object = field(default_factory=NoLive)
    observers: tuple[Observer, ...] = ()
    expected: float = 0.0
    """Of the run [s]; 0: all of `duration`."""
    stiffness: float = 0.0
    """Of contact and robot [N/m]."""

    @property
    def busy_periods(self) -> int:
        """Periods in which it has something to do."""
        return round((self.expected or self.duration) / self.backend.period)


class Injection(Protocol):
    """Something that goes wrong."""

    def into(self, rig: Rig, at: int) -> None:
        """Make it happen from the sample, or at the period, of index `at`."""
        ...


@dataclass(frozen=True)
class Samples:
    """What the devices say is wrong from now on."""

    change: ChangedSample

    def into(self, rig: Rig, at: int) -> None:
        rig.backend.changes.append((at, self.change))


@dataclass(frozen=True)
class LostDevice:
    """`step` raises so many times in a row."""

    times: int
    error: Callable[[], Exception] = lambda: OSError("no reply")

    def into(self, rig: Rig, at: int) -> None:
        # the exception comes with the command of index `at`, instead of the sample after it
        rig.backend.errors.update({at + 1 + i: self.error() for i in range(self.times)})


class Counting:
    """A controller that calls another one, and knows the index of the period."""

    def __init__(self, sound: Controller, at: int, act: Callable[[Command], object]) -> None:
        self._sound, self._at, self._act, self._index = sound, at, act, 0

    def start(self, first: Observation) -> None:
        self._sound.start(first)

    def step(self, now: Observation) -> Any:
        command = self._sound.step(now)
        self._index += 1
        return self._act(command) if self._index > self._at else command


@dataclass(frozen=True)
class Commands:
    """The controller returns something else, or raises; or something happens meanwhile, like a signal."""

    act: Callable[[Command], object]

    def into(self, rig: Rig, at: int) -> None:
        rig.controller = Counting(rig.controller, at, self.act)


def raising(error: Callable[[], BaseException]) -> Callable[..., object]:
    """Something that raises, whatever it is called with."""

    def act(*_: object) -> object:
        raise error()

    return act


class _From:
    """Calls something from its call of index `at` on."""

    def __init__(self, at: int, act: Callable[[], object]) -> None:
        self._left, self._act = at, act

    def __call__(self) -> None:
        self._left -= 1
        if self._left < 0:
            self._act()


@dataclass(frozen=True)
class Observing:
    """An observer raises."""

    act: Callable[[], object]

    def into(self, rig: Rig, at: int) -> None:
        later = _From(at, self.act)
        rig.observers = (*rig.observers, lambda sample, now, command: later())


@dataclass(frozen=True)
class Live:
    """The live parameters raise."""

    act: Callable[[], object]

    def into(self, rig: Rig, at: int) -> None:
        later = _From(at, self.act)

        class Raising(NoLive):
            def step(self, time):
                later()
                return ()

        rig.live = Raising()


@dataclass(frozen=True)
class Limited:
    """The limits are narrower, so that what the robot does is too much; `other` happens too."""

    limits: dict[str, object]
    other: Injection | None = None

    def into(self, rig: Rig, at: int) -> None:
        rig.limits = msgspec.structs.replace(rig.limits, **self.limits)
        if self.other is not None:
            self.other.into(rig, at)


@dataclass(frozen=True, eq=False)
class Outcome:
    """How a run went, and all that can be checked about it."""

    rig: Rig
    result: RunResult
    supervisor: Supervisor
    log: MemoryLog
    events: tuple[Event, ...]

    @property
    def commands(self) -> list[Command]:
        return self.rig.backend.commands

    def tripped_at(self, at: int) -> int:
        """Index of the period in which it tripped: that of the sample with the trip's time, `at` or later."""
        times = [sample.time for sample in self.rig.backend.samples]
        trip = self.result.trip
        if trip is None or not math.isfinite(trip.time):
            return at
        later = [i for i, time in enumerate(times) if i >= at and time == trip.time]
        return later[0] if later else at

    def errors(self) -> list[str]:
        return [event.text for event in self.events if event.level >= Level.ERROR]


def carry_out(rig: Rig, supervisor: Supervisor | None = None, file: Sink | None = None) -> Outcome:
    """Run it, recorded in memory and maybe in a file; an interruption is an outcome like others."""
    log = MemoryLog()
    recorder = Recorder(log) if file is None else Recorder(log, file)
    supervisor = supervisor or Supervisor(rig.limits)
    try:
        result = run(
            rig.backend,
            rig.touch,
            rig.controller,
            supervisor,
            duration=rig.duration,
            recorder=recorder,
            live=rig.live,
            observers=rig.observers,
        )
    except KeyboardInterrupt as interruption:
        found = result_until(interruption)
        if found is None:
            raise
        result = found
    return Outcome(rig, result, supervisor, log, tuple(log.events))
