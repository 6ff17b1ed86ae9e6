"""Controllers one after another."""

import pytest

from palpate.controllers.grip.controller_sequence import ControllerSequence
from palpate.errors import InvalidValueError
from palpate.runtime.data import ArmSample, Command, Observation, Phase
from palpate.spatial import IDENTITY, ZERO

FIRST = Observation(0.0, ArmSample(0.0, ZERO, IDENTITY, ZERO), ())


class Says:
    """Ends with a phase after some steps."""

    def __init__(self, phase, after):
        self.phase, self.after, self.started = phase, after, 0

    def start(self, first):
        self.started, self.count = self.started + 1, 0

    def step(self, now):
        self.count += 1
        return Command(phase=self.phase if self.count >= self.after else Phase.HOLD)


def test_each_begins_where_the_one_before_was_done_and_a_loss_ends_all():
    first, second, third = Says(Phase.DONE, 2), Says(Phase.LOST, 2), Says(Phase.DONE, 1)
    both = ControllerSequence(first, second, third)
    both.start(FIRST)
    phases = [both.step(FIRST).phase for _ in range(4)]
    assert phases == [Phase.HOLD, Phase.HOLD, Phase.LOST, Phase.LOST]
    assert (first.started, second.started, third.started) == (1, 1, 0)
    with pytest.raises(InvalidValueError, match="at least one"):
        ControllerSequence()
