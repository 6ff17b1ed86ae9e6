"""What describes a real arm in a robot file: `backend.arm` of a rig."""

from typing import TYPE_CHECKING, ClassVar

from palpate.robots.device_kind import DeviceKind

if TYPE_CHECKING:  # a robot file is read without any driver
    from palpate.hw.devices import ArmDevice
    from palpate.robots.device_settings import PoseEntry
    from palpate.runtime import Limits


class ArmKind(DeviceKind):
    """Settings of an arm that follows velocities of its tip, and how it is made of them.

    Attributes:
        MEASURES_FORCE: Whether its samples have the force at the tip (`ArmSample.tip_force_base`).
        robot_base: Where its own base frame is in the base frame that experiments speak of. None: a run begins
            where it is to begin, the tip close above the middle of the object, and that tells the position.
        acceleration: With which the tip follows velocities [m/s^2], and its turning [rad/s^2].
        stiffness: With which it holds its tip [N/m]. Default: of the order of arms of 1 m reach; pressing finds
            what it really is (--identify).
        response: Delay that stands for its controller in force control [s].
        lag: How far it runs behind a ramp [s].
    """

    __slots__ = ()
    GROUP = "palpate.arms"
    METHODS = ("device",)

    MEASURES_FORCE: ClassVar[bool] = False

    robot_base: "PoseEntry | None" = None
    acceleration: float = 5.0
    stiffness: float = 3e4
    response: float = 0.02
    lag: float = 0.02

    def check_driver(self) -> None:
        """Check that this computer has its client library.

        Raises:
            MissingLibraryError: It has not.
        """

    def device(self, limits: "Limits") -> "ArmDevice":
        """Return the arm, which keeps the speeds of these limits by itself; nothing is opened.

        Raises:
            InvalidValueError: It cannot be as the file specifies, or a limit is beyond what it accepts.
        """
        raise NotImplementedError
