"""Gains and set points that may be changed while a controller runs: bounded, and ramped so that nothing jumps.

Any thread asks for a change with `LiveParameters.request`. Only the loop makes it, in `LiveParameters.step`, once
per period before the controller: it takes what was asked for since, moves every value towards its target no faster
than its rate, and returns what it took, for the log. Values depend only on the times of the periods and those
changes, so that a log of both gives the same values again, bit for bit.
"""

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from palpate.errors import InvalidValueError, positive
from palpate.nearest_name import nearest

LONGEST_ELAPSED = 0.01
"""Longest time that one step ramps over [s], a little more than the slowest control period in use (8 ms): after a
gap in the samples the ramp goes on from where it was."""


@dataclass(frozen=True, slots=True)
class LiveParameter:
    """A quantity that may be changed while a controller runs.

    Attributes:
        name: How it is asked for.
        value: What it is when a run starts [`unit`].
        lower: Its smallest value [`unit`].
        upper: Its largest value [`unit`].
        rate: How fast it may change [`unit`/s].
        unit: Its unit ("N", "m/s", "" for a ratio).
        description: What it is, one line for people.
    """

    name: str
    value: float
    lower: float
    upper: float
    rate: float
    unit: str
    description: str

    def __post_init__(self) -> None:
        positive(f"rate of {self.name}", self.rate, f"{self.unit}/s")
        if not -math.inf < self.lower <= self.upper < math.inf:
            raise InvalidValueError(
                f"{self.name} between {self.lower:g} and {self.upper:g} {self.unit}".rstrip()
                + ": the bounds must be finite, the lower one first"
            )
        self.checked(self.value)

    def checked(self, value: float) -> float:
        """Return `value` as a float if this parameter may take it.

        Raises:
            InvalidValueError: Not a number, not finite, or out of bounds.
        """
        try:
            wanted = float(value)
        except (TypeError, ValueError):
            wanted = math.nan
        if self.lower <= wanted <= self.upper:  # false for NaN
            return wanted
        raise InvalidValueError(
            f"{self.name} = {value if math.isnan(wanted) else format(wanted, 'g')} {self.unit}".rstrip()
            + f": must lie between {self.lower:g} and {self.upper:g} {self.unit}".rstrip()
        )


@dataclass(frozen=True, slots=True)
class Change:
    """One change of a live parameter.

    Attributes:
        time: Of the first period that it acts in, on the back end's clock [s]. If scheduled: when it is
            due, counted from the first period.
        name: Of the parameter.
        value: What it is to become; it gets there at the parameter's rate.
    """

    time: float
    name: str
    value: float


class LiveParameters:
    """The live parameters of one controller.

    `restart` and `step` belong to the loop's thread; all else may be called from any. No lock can hold the loop:
    each parameter has room for one request, and a newer one replaces one that the loop has not seen yet, so that
    neither work nor memory grows with the number of requests.
    """

    def __init__(self, *parameters: LiveParameter) -> None:
        """Take the parameters, each at its value for the start of a run.

        Raises:
            InvalidValueError: Two have the same name.
        """
        self.parameters: Mapping[str, LiveParameter] = {given.name: given for given in parameters}
        if len(self.parameters) < len(parameters):
            raise InvalidValueError(
                f"live parameters {', '.join(given.name for given in parameters)}: each name once only"
            )
        self._requests: dict[str, deque[float]] = {name: deque(maxlen=1) for name in self.parameters}
        self.restart()

    def restart(self) -> None:
        """Go back to the values at the start, and forget all requests: a new run begins."""
        for request in self._requests.values():
            request.clear()
        self._values = {name: given.value for name, given in self.parameters.items()}
        self._targets = dict(self._values)
        self._time = math.inf  # no time has passed at the first step
        self._asked = False
        self._moving = False

    def check(self, name: str, value: float) -> float:
        """Return `value` as a float if it may be requested.

        Raises:
            InvalidValueError: There is no parameter `name`, or it cannot take this value.
        """
        if name not in self.parameters:
            near = nearest(name, tuple(self.parameters))
            known = ", ".join(self.parameters) or "none: this controller has no live parameters"
            advice = f"did you mean {near}?" if near else f"known are {known}"
            raise InvalidValueError(f"no live parameter is called {name!r}; {advice}")
        return self.parameters[name].checked(value)

    def request(self, name: str, value: float) -> None:
        """Ask for a change; it begins with the next period.

        Raises:
            InvalidValueError: As in `check`; nothing changes.
        """
        value = self.check(name, value)
        self._requests[name].append(value)
        self._asked = True

    def step(self, time: float) -> tuple[Change, ...]:
        """Move all values towards their targets.

        Args:
            time: Of this period, on the back end's clock [s].

        Returns:
            The changes that were asked for since the last period, and act from now on.
        """
        elapsed = min(LONGEST_ELAPSED, max(0.0, time - self._time))  # 0 for NaN
        self._time = time
        changes = self._take(time) if self._asked else ()
        if self._moving:
            self._ramp(elapsed)
        return changes

    def value(self, name: str) -> float:
        """Return the present value of a parameter.

        Raises:
            KeyError: There is none of this name.
        """
        return self._values[name]

    @property
    def values(self) -> dict[str, float]:
        """The present values, by name."""
        return dict(self._values)

    @property
    def targets(self) -> dict[str, float]:
        """What the values are moving to, by name."""
        return dict(self._targets)

    def _take(self, time: float) -> tuple[Change, ...]:
        self._asked = False  # before looking: what comes in meanwhile is found now or in the next period
        changes = []
        for name, request in self._requests.items():
            if request:
                self._targets[name] = value = request.popleft()
                changes.append(Change(time, name, value))
        self._moving = True
        return tuple(changes)

    def _ramp(self, elapsed: float) -> None:
        moving = False
        for name, target in self._targets.items():
            value = self._values[name]
            if value != target:
                most = self.parameters[name].rate * elapsed
                # min and max: rounding must not carry a value past its target, which may be a bound
                value = min(value + most, target) if value < target else max(value - most, target)
                self._values[name] = value
                moving = moving or value != target
        self._moving = moving


@runtime_checkable
class Tunable(Protocol):
    """A controller with live parameters, which its `start` restarts. Those without need nothing."""

    @property
    def live(self) -> LiveParameters:
        """Its live parameters."""
        ...


def live_parameters_of(controller: object) -> LiveParameters:
    """Return a controller's live parameters: none, if it has none."""
    return controller.live if isinstance(controller, Tunable) else LiveParameters()


class ScheduledChanges:
    """Live parameters that are asked for changes at given times of one run, as a script knows them beforehand.

    The loop takes it in place of the live parameters. Other threads may ask for more meanwhile.
    """

    def __init__(self, live: LiveParameters, changes: Iterable[Change]) -> None:
        """Take the parameters, and what is to be asked of them, in any order; times count from the first period.

        Raises:
            InvalidValueError: A change that could not be requested, or at no finite time.
        """
        due = []
        for change in changes:
            live.check(change.name, change.value)
            if not math.isfinite(change.time):
                raise InvalidValueError(f"change of {change.name} at {change.time} s: must be at a finite time")
            due.append(change)
        self._live = live
        self._start: float | None = None
        self._due = deque(sorted(due, key=lambda change: change.time))

    def step(self, time: float) -> tuple[Change, ...]:
        """Request what is due; else as `LiveParameters.step`."""
        if self._start is None:
            self._start = time
        while self._due and self._due[0].time <= time - self._start:
            change = self._due.popleft()
            self._live.request(change.name, change.value)
        return self._live.step(time)
