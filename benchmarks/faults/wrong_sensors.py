"""Force/torque sensors that say something else than what presses on them, with stamps that are in order."""

import random
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from faults.fault_rig import Injection, Rig, Samples
from palpate.runtime.data import Sample

Read = Callable[[Sequence[float]], Sequence[float]]
NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)
"""Of a Nano17 [N, N m]."""


def showing(shown: Read) -> Injection:
    """The first finger's sensor shows this of its true reading."""
    return Samples(lambda now, before: _with(now, shown(now.wrenches[0].wrench)))


def scaled(factor: float) -> Injection:
    """A wrong gain of all channels."""
    return showing(lambda wrench: [factor * each for each in wrench])


def dead(channel: int) -> Injection:
    """One channel shows 0."""
    return showing(lambda wrench: [0.0 if i == channel else each for i, each in enumerate(wrench)])


def off(force: Sequence[float]) -> Injection:
    """The zero of the forces is off [N]."""
    return showing(lambda wrench: [a + b for a, b in zip(wrench, (*force, 0.0, 0.0, 0.0), strict=True)])


@dataclass(frozen=True, slots=True)
class Stateful:
    """Something that must begin anew with each run.

    Attributes:
        made: Makes what maps a reading to what is shown.
    """

    made: Callable[[], Read]

    def into(self, rig: Rig, at: int) -> None:
        """See `Injection`."""
        showing(self.made()).into(rig, at)


def frozen() -> Read:
    """Shows its first reading for ever."""
    kept: list[Sequence[float]] = []

    def shown(wrench: Sequence[float]) -> Sequence[float]:
        kept.append(wrench)
        del kept[1:]
        return kept[0]

    return shown


def frozen_but_noisy() -> Read:
    """Shows its first reading for ever, and noise."""
    first = frozen()
    return lambda wrench: _noisy(first(wrench))


def late(periods: int) -> Callable[[], Read]:
    """Shows what was true some periods ago."""

    def made() -> Read:
        kept: deque[Sequence[float]] = deque(maxlen=periods + 1)

        def shown(wrench: Sequence[float]) -> Sequence[float]:
            kept.append(wrench)
            return kept[0]

        return shown

    return made


def drifting(per_period: float) -> Callable[[], Read]:
    """Its zero drifts along z."""

    def made() -> Read:
        gone = [0.0]

        def shown(wrench: Sequence[float]) -> Sequence[float]:
            gone[0] += per_period
            return [*wrench[:2], wrench[2] + gone[0], *wrench[3:]]

        return shown

    return made


def _noisy(wrench: Sequence[float]) -> Sequence[float]:
    return [each + random.gauss(0.0, sigma) for each, sigma in zip(wrench, NOISE, strict=True)]


def _spiked(wrench: Sequence[float]) -> Sequence[float]:
    return [random.choice((-1.0, 1.0)) * 15.0 + each for each in wrench] if random.random() < 0.02 else wrench


def _clipped(wrench: Sequence[float]) -> Sequence[float]:
    return [max(-1.0, min(1.0, each)) for each in wrench]


def _with(sample: Sample, wrench: Sequence[float]) -> Sample:
    first, *others = sample.wrenches
    return replace(sample, wrenches=(replace(first, wrench=tuple(wrench)), *others))


SENSORS: dict[str, Injection] = {
    "frozen": Stateful(frozen),
    "frozen, and noisy": Stateful(frozen_but_noisy),
    "all zeros": showing(lambda wrench: [0.0] * 6),
    "noise only": showing(lambda wrench: _noisy([0.0] * 6)),
    "constant 1 N": showing(lambda wrench: [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
    "random within its range": showing(lambda wrench: [random.uniform(-10.0, 10.0) for _ in wrench]),
    "spikes of 15 N": showing(_spiked),
    "clipped at 1 N": showing(_clipped),
    "steps of 0.5 N": showing(lambda wrench: [round(2.0 * each) / 2.0 for each in wrench]),
    **{f"gain {factor:g}": scaled(factor) for factor in (-1.0, 0.01, 0.1, 0.5, 2.0, 10.0, 1e3)},
    **{f"channel {i + 1} dead": dead(i) for i in range(6)},
    **{
        f"zero off by {force} N along {axis}": off([force * (axis == each) for each in "xyz"])
        for force in (-3.0, 3.0)
        for axis in "xyz"
    },
    **{f"late by {1e3 * periods / 1e3:g} ms": Stateful(late(periods)) for periods in (20, 100, 400)},
    **{f"drifts by {slope:g} N/s": Stateful(drifting(slope / 1e3)) for slope in (-5.0, -0.5, 0.5, 5.0)},
    "forces and moments swapped": showing(lambda wrench: [*wrench[3:], *wrench[:3]]),
}
"""By what is wrong."""
