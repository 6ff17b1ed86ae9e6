"""Dead or weak force/torque sensors, on arms with and without a force measurement of their own."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from palpate.runtime.data import Command, Sample
from palpate.runtime.protocols import Backend
from palpate.runtime.wrapped_backend import WrappedBackend

NOISE, RATIO = 3e-3, 5e-3
"""Noise of the force [N], and ratio of the noise of moments to it [m]."""

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
"""Reading shown, by name of the fault: from the true reading and the last one before the fault."""


class Distorted(WrappedBackend[Backend]):
    """Robot whose samples are reported differently from the truth."""

    def start(self) -> Sample:
        """See `Backend`."""
        return self.shown(super().start())

    def step(self, command: Command) -> Sample:
        """See `Backend`."""
        return self.shown(super().step(command))

    def shown(self, sample: Sample) -> Sample:
        """Return the sample as it is reported."""
        raise NotImplementedError


class DeadSensor(Distorted):
    """Force sensor that shows one of `FAULTS` from a time on [s]."""

    def __init__(self, backend: Backend, fault: str, since: float) -> None:
        """Take the robot and the name of the fault."""
        super().__init__(backend)
        self.fault, self.since = FAULTS[fault], since
        self.last: Reading | None = None
        self.rng = np.random.default_rng(0)

    def shown(self, sample: Sample) -> Sample:
        """Return the sample as the sensor shows it."""
        (given,) = sample.wrenches
        if self.last is None or sample.time < self.since:
            self.last = given.wrench
        wrench = given.wrench if sample.time < self.since else self.fault(given.wrench, self.last, self.rng)
        return replace(sample, wrenches=(replace(given, wrench=wrench),))


class WithoutTipForce(Distorted):
    """Arm that does not measure the force on its tip."""

    def shown(self, sample: Sample) -> Sample:
        """Return the sample without that force."""
        return replace(sample, arm=replace(sample.arm, tip_force_base=None))
