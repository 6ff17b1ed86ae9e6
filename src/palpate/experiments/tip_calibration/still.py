"""A run in which nothing moves and nothing is connected to: touches of a file are evaluated, or planned."""

from palpate.controllers.touch_sequence import TouchOutcome
from palpate.runtime import Command, Observation, Phase, Sample
from palpate.runtime.closing import Closing
from palpate.runtime.data import ArmSample, WrenchSample
from palpate.runtime.pacing import Pacer, SimulatedTime
from palpate.spatial import IDENTITY, ZERO

PERIOD = 1e-3
"""[s]"""


class NothingMoves(Closing):
    """A `Backend` of nothing: one finger that feels nothing."""

    def __init__(self) -> None:
        """Begin at time 0."""
        self._time = 0.0
        self._pacer = SimulatedTime()

    @property
    def period(self) -> float:
        """See `Backend`."""
        return PERIOD

    @property
    def pacer(self) -> Pacer:
        """See `Backend`."""
        return self._pacer

    def start(self) -> Sample:
        """See `Backend`."""
        self._time = 0.0
        return self._sample()

    def step(self, command: Command) -> Sample:
        """See `Backend`."""
        self._time += PERIOD
        self._pacer.wait()
        return self._sample()

    def close(self) -> None:
        """See `Backend`."""

    def _sample(self) -> Sample:
        arm = ArmSample(self._time, ZERO, IDENTITY, ZERO)
        return Sample(self._time, arm, (WrenchSample(self._time, (0.0,) * 6, ZERO),))


class NothingToDo:
    """A `Controller` that is done at once.

    Attributes:
        outcomes: Of touches: none are made.
    """

    outcomes: tuple[TouchOutcome, ...] = ()

    def start(self, first: Observation) -> None:
        """See `Controller`."""

    def step(self, now: Observation) -> Command:
        """See `Controller`."""
        return Command(phase=Phase.DONE)
