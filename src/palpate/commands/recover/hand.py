"""A hand of Dynamixel servos after a stop."""

from palpate.commands.recover.condition import DeviceCondition
from palpate.hw.dynamixel.care import ServoCondition
from palpate.hw.dynamixel.hand import DynamixelHand


class RecoverableHand:
    """A `Recoverable` hand."""

    def __init__(self, hand: DynamixelHand) -> None:
        """Take a hand that is not started."""
        self._hand = hand
        self._failed: tuple[int, ...] = ()

    @property
    def name(self) -> str:
        """See `Recoverable`."""
        return self._hand.name

    def condition(self) -> DeviceCondition:
        """See `Recoverable`.

        Raises:
            DeviceError: It cannot be reached.
        """
        servos = self._hand.examine()
        self._failed = tuple(servo.servo_id for servo in servos if servo.error)
        action = ""
        if self._failed:
            which = " and ".join(map(str, self._failed))
            action = f"restart servo {which}, which lets go of what it holds"
        return DeviceCondition(self.name, "; ".join(map(_words, servos)), not self._failed, action)

    def recover(self) -> None:
        """See `Recoverable`.

        Raises:
            DeviceError: A servo does not come back, or its error does.
        """
        for servo_id in self._failed:
            self._hand.reboot(servo_id)

    def close(self) -> None:
        """See `Recoverable`: nothing is left open between two requests."""


def _words(servo: ServoCondition) -> str:
    error = f"shut down by {servo.error.words}" if servo.error else "no hardware error"
    stopped = ", stopped by its bus watchdog" if servo.expired else ""
    return f"servo {servo.servo_id} {error}, torque {'on' if servo.torque_on else 'off'}{stopped}"
