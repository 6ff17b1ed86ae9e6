"""Force/torque sensors that are dead or weak, whatever they still report, on arms that measure force or do not."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from palpate.runtime.data import Command, Sample
from palpate.runtime.protocols import Backend
from palpate.runtime.wrapped_backend import WrappedBackend

NOISE, RATIO = 3e-3, 5e-3
"""Of force [N], and of moments to that [m]."""

Reading = tuple[float, ...]


def _noise(given: Reading, last: Reading, rng: np.random.Generator) -> Reading:
    return tuple(rng.normal(0.0, [NOISE] * 3 + [NOISE * RATIO] * 3).tolist())


FAULTS: dict[str, Callable[[Reading, Reading, np.random.Generator], Reading]] = {
    "none": lambda given, last, rng: given,
    "constant": lambda given, last, rng: last,
    "zeros": lambda given, last, rng: (0.0,) * 6,
    "noise only": _noise,
    "one axis": lambda given, last, rng: (*given[:2], last[2], *given[3:]),
    "a tenth": lambda given, last, rng: tuple(0.1 * x for x in given),
}
"""What is shown, by its name: from the true reading and the last one before the fault."""


class DeadSensor(WrappedBackend[Backend]):
    """Reports something else than it feels, from a time on [s]."""

    def __init__(self, backend: Backend, fault: str, since: float) -> None:
        """Take the robot, and one of `FAULTS`."""
        super().__init__(backend)
        self.fault, self.since = FAULTS[fault], since
        self.last: Reading | None = None
        self.rng = np.random.default_rng(0)

    def start(self) -> Sample:
        """See `Backend`."""
        return self.reported(super().start())

    def step(self, command: Command) -> Sample:
        """See `Backend`."""
        return self.reported(super().step(command))

    def reported(self, sample: Sample) -> Sample:
        """Return the sample as the sensor shows it."""
        (given,) = sample.wrenches
        if self.last is None or sample.time < self.since:
            self.last = given.wrench
        shown = given.wrench if sample.time < self.since else self.fault(given.wrench, self.last, self.rng)
        return replace(sample, wrenches=(replace(given, wrench=shown),))


class WithoutTipForce(WrappedBackend[Backend]):
    """An arm that does not measure the force on its tip."""

    def start(self) -> Sample:
        """See `Backend`."""
        return _without(super().start())

    def step(self, command: Command) -> Sample:
        """See `Backend`."""
        return _without(super().step(command))


def _without(sample: Sample) -> Sample:
    return replace(sample, arm=replace(sample.arm, tip_force_base=None))
