"""Force/torque sensors that are dead or weak, whatever they still report."""

from dataclasses import replace

import numpy as np

from palpate.runtime.wrapped_backend import WrappedBackend

NOISE, RATIO = 3e-3, 5e-3
"""Of force [N], and of moments to that [m]."""


def _noise(given, last, rng):
    return tuple(rng.normal(0.0, [NOISE] * 3 + [NOISE * RATIO] * 3).tolist())


FAULTS = {
    "none": lambda given, last, rng: given,
    "constant": lambda given, last, rng: last,
    "zeros": lambda given, last, rng: (0.0,) * 6,
    "noise only": _noise,
    "one axis": lambda given, last, rng: (*given[:2], last[2], *given[3:]),
    "a tenth": lambda given, last, rng: tuple(0.1 * x for x in given),
}


class DeadSensor(WrappedBackend):
    """Reports something else than it feels, from a time on [s]."""

    def __init__(self, backend, fault, since):
        super().__init__(backend)
        self.fault, self.since, self.last = FAULTS[fault], since, None
        self.rng = np.random.default_rng(0)

    def start(self):
        return self.reported(super().start())

    def step(self, command):
        return self.reported(super().step(command))

    def reported(self, sample):
        (given,) = sample.wrenches
        if self.last is None or sample.time < self.since:
            self.last = given.wrench
        shown = given.wrench if sample.time < self.since else self.fault(given.wrench, self.last, self.rng)
        return replace(sample, wrenches=(replace(given, wrench=shown),))
