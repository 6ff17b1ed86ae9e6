"""What describes a real force/torque sensor in a robot file: `fingers[].sensor_device`."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from palpate.robots.device_kind import DeviceKind
from palpate.sensing.compensation import SensorPayload
from palpate.spatial import Wrench

if TYPE_CHECKING:  # a robot file is read without any driver
    from palpate.hw.devices import ArmDevice, SensorDevice


@dataclass(frozen=True, slots=True)
class SensorPlace:
    """What a robot file says of a sensor besides its device.

    Attributes:
        noise: Standard deviation of a reading at rest [N, N m].
        payload: What it carries.
        calibrated: Whether a sensor file calibrates it: the device is to give raw channels.
        arm: That it is mounted on; None: it stands.
    """

    noise: Wrench
    payload: SensorPayload
    calibrated: bool
    arm: "ArmDevice | None"


class SensorKind(DeviceKind):
    """Settings of a device on a wire, and how it is made of them."""

    __slots__ = ()
    GROUP = "palpate.sensors"
    METHODS = ("device",)

    @property
    def in_arm(self) -> bool:
        """Whether it is a part of the arm, and starts after it."""
        return False

    def device(self, finger: SensorPlace) -> "SensorDevice":
        """Return the device; nothing is opened.

        Raises:
            InvalidValueError: It cannot be as the file specifies.
        """
        raise NotImplementedError
