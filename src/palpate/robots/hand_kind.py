"""What describes a hand in a robot file: `backend.hand`."""

from typing import TYPE_CHECKING

from palpate.errors import InvalidValueError
from palpate.open_kinds import name_of_kind
from palpate.robots.device_kind import DeviceKind

if TYPE_CHECKING:  # a robot file is read without any driver
    from palpate.hw.devices import HandDevice
    from palpate.robots.robot import Robot
    from palpate.sim.hand.hand_model import HandModel


class HandKind(DeviceKind):
    """Settings of a hand whose fingers press, and how it is made of them.

    Attributes:
        fingers: How many it has.
        poll: From exchange to exchange with it [s].
    """

    __slots__ = ()
    GROUP = "palpate.hands"
    METHODS = ("geometry", "fingers")

    poll: float = 0.004

    @property
    def fingers(self) -> int:
        """How many it has."""
        raise NotImplementedError

    def check_fingers(self, robot: "Robot") -> None:
        """Check that each finger is described once, in the order of the hand.

        Raises:
            InvalidValueError: There are more or fewer.
        """
        described = len(robot.file.fingers)
        if self.fingers != described:
            raise InvalidValueError(
                f"backend.hand: it has {self.fingers} fingers, and there are {described} under fingers; describe "
                "each once, in the same order"
            )

    def device(self, robot: "Robot") -> "HandDevice":
        """Return the hand; nothing is opened.

        Raises:
            InvalidValueError: It cannot be as the file specifies, or is simulated only.
        """
        raise InvalidValueError(
            f"backend.hand.kind = {name_of_kind(self)}: it is simulated only; it has no driver"
        )

    def geometry(self, robot: "Robot") -> "HandModel":
        """Return where its sensors and tips are in the hand frame, and how it is simulated.

        Raises:
            InvalidValueError: It cannot be so.
        """
        raise NotImplementedError
