"""What is said of an arm after a stop is what its states prove at that time."""

from palpate.runtime.data import ArmSample
from palpate.runtime.rest import RestState
from palpate.runtime.standstill_check import StandstillCheck
from palpate.spatial import IDENTITY

PERIOD, SPEED = 2e-3, 0.02


def moving(time):
    return ArmSample(time, (SPEED * time, 0.0, 0.0), IDENTITY, (SPEED, 0.0, 0.0))


def test_an_arm_that_was_seen_moving_is_called_moving_only_for_a_while():
    """Its connection was closed: it had long stopped, and was reported as moving."""
    check = StandstillCheck(moving(0.0), PERIOD, oldest=1.0)
    for i in range(1, 50):
        check.add(i * PERIOD, moving(i * PERIOD))
    assert check.rest(()).state is RestState.MOVING
    for i in range(50, 150):
        check.add(i * PERIOD, moving(49 * PERIOD))
    assert check.rest(()).state is RestState.NOT_KNOWN
