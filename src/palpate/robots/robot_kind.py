"""What carries the fingers, in robot files: `backend`."""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, ClassVar

from palpate.errors import InvalidValueError
from palpate.open_kinds import OpenKind, name_of_kind

if TYPE_CHECKING:  # a robot file is read before there is a robot
    from palpate.controllers import LandingModel
    from palpate.robots.hand_description import HandDescription
    from palpate.robots.hand_task import HandTask
    from palpate.robots.robot import Robot
    from palpate.robots.task import RobotInScene, Task
    from palpate.runtime import Backend


class RobotKind(OpenKind):
    """Settings of a back end, and how a robot is made of them.

    A simulated one inherits from `palpate.robots.simulated_kind.SimulatedKind`, which leaves one method to write.

    Attributes:
        REAL: Whether fingers have real sensors, and what they touch is known by them alone.
        UNATTENDED: Whether many may run at a time with nobody beside them: simulated ones, without wires.
        TURNS: Whether it can turn its tip.
    """

    __slots__ = ()
    GROUP = "palpate.robots"
    METHODS: ClassVar[tuple[str, ...]] = ("check", "build")

    REAL: ClassVar[bool] = False
    UNATTENDED: ClassVar[bool] = False
    TURNS: ClassVar[bool] = True

    @property
    def measures_force(self) -> bool:
        """Whether the force at the tip is measured without the fingertip's sensor, too."""
        return True

    @property
    def files(self) -> Mapping[str, str]:
        """Paths of text files that it names, relative to the robot file, by their names in a log.

        `Robot.texts` has them; under such a name with `.path` behind it, where they were.
        """
        return {}

    @property
    def holding(self) -> int:
        """How many fingers hold what the first one explores; 0: there is nothing of that kind."""
        return 0

    def check_drivers(self) -> None:
        """Check that this computer has the client libraries of its devices.

        Raises:
            MissingLibraryError: It has not.
        """

    def check(self, robot: "Robot") -> None:
        """Check that a robot with this back end can be built at all.

        Raises:
            InvalidValueError: It cannot; the message names what to change.
        """
        raise NotImplementedError

    def build(self, robot: "Robot", task: "Task") -> "RobotInScene":
        """Return the robot ready for a task with one finger; nothing is opened before its back end starts.

        Raises:
            InvalidValueError: It cannot be built as its file specifies, or cannot do the task.
        """
        raise NotImplementedError

    def remarks(self, robot: "Robot") -> tuple[str, ...]:
        """Return in sentences what of it is not as its files say, or was assumed where they say nothing.

        Raises:
            InvalidValueError: It cannot be built as its file specifies.
        """
        return ()

    def landing_model(self, robot: "Robot") -> "LandingModel | None":
        """Return how hard it presses on what it runs into; None if nothing moves a finger into anything.

        Raises:
            InvalidValueError: It cannot be built as its file specifies.
        """
        return None

    def has_hand(self, robot: "Robot") -> bool:
        """Return whether it has fingers that close on an object."""
        return False

    def described_hand(self, robot: "Robot") -> "HandDescription":
        """Return its hand, where it has one.

        Raises:
            InvalidValueError: Nothing can be held with it as its file specifies.
        """
        raise self._without("hand")

    def hand_backend(self, hand: "HandDescription", task: "HandTask") -> "Backend":
        """Return what carries out a task of a hand; nothing is opened before it starts.

        Raises:
            InvalidValueError: It cannot.
        """
        raise self._without("hand")

    def devices(self, robot: "Robot") -> AbstractContextManager["Robot"]:
        """Return the rig that a robot's devices are; those that are emulated run within the context.

        Raises:
            InvalidValueError: It has none.
            DeviceError: Emulators do not come up.
        """
        raise self._without(
            "devices to connect to; give a robot file of kind rig (`palpate robot check` is for robots without)"
        )

    def shown(self, robot: "Robot") -> "Robot":
        """Return the robot whose simulation shows what this one looks like."""
        return robot

    def _without(self, what: str) -> InvalidValueError:
        return InvalidValueError(f"backend.kind = {name_of_kind(self)} has no {what}")
