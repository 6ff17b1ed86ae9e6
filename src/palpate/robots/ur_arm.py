"""Arms of Universal Robots in robot files: `backend.arm` of a rig."""

import msgspec

from palpate.hw.emulators.ur import UrServer
from palpate.hw.emulators.ur.arm import ArmMounting
from palpate.hw.ur import FlangePayload, UrArm, UrSettings
from palpate.hw.ur.library import refuse_unsupported
from palpate.robots.arm_kind import ArmKind
from palpate.robots.device_settings import DeviceSettings, PoseEntry
from palpate.runtime import Limits
from palpate.sensing.ft.sensor_file import PayloadEntry


class UrEntry(ArmKind, DeviceSettings, frozen=True, kw_only=True):
    """An arm of Universal Robots: see `palpate.hw.ur.UrSettings`. Its speed limits are the robot's `limits`.

    Attributes:
        address: Of its controller: host name or IP address.
        tcp: The tip frame on the flange; its axes are those of the fingertip's sensor.
        payload: What the flange carries; None: as set on the pendant.
        robot_base: Where its own base frame is in the base frame that experiments speak of. None: a run begins
            where it is to begin, the tip close above the middle of the object, and that tells the position.
        acceleration: With which the tip follows velocities [m/s^2], and its turning [rad/s^2]: the controller has
            one number for both.
        watchdog: Time without commands after which it stops [s].
        speed_slider: To set the pendant's slider to, (0, 1]; None: as it is.
        stiffness: With which it holds its tip [N/m]. Default: of the order of arms of this size; pressing finds
            what it really is (--identify).
        response: Delay that stands for its controller in force control [s]. Default: ten of its cycles; likewise.
        lag: How far it runs behind a ramp [s]; likewise.
    """

    MEASURES_FORCE = True
    RANGES = (
        ("acceleration_m_per_s2", 0.01, 150.0, "m/s^2"),
        ("watchdog_s", 0.02, 2.5, "s"),
        ("speed_slider", 0.01, 1.0, ""),
        ("stiffness_N_per_m", 100.0, 1e7, "N/m"),
        ("response_s", 1e-4, 1.0, "s"),
        ("lag_s", 0.0, 1.0, "s"),
    )

    address: str
    tcp: PoseEntry = PoseEntry()
    payload: PayloadEntry | None = None
    robot_base: PoseEntry | None = None
    acceleration: float = msgspec.field(name="acceleration_m_per_s2", default=5.0)
    watchdog: float = msgspec.field(name="watchdog_s", default=0.1)
    speed_slider: float | None = None
    stiffness: float = msgspec.field(name="stiffness_N_per_m", default=3e4)
    response: float = msgspec.field(name="response_s", default=0.02)
    lag: float = msgspec.field(name="lag_s", default=0.02)

    def check_driver(self) -> None:
        """See `ArmKind`."""
        refuse_unsupported()

    def device(self, limits: Limits) -> UrArm:
        """See `ArmKind`."""
        payload = self.payload
        settings = UrSettings(
            pose_flange_tip=self.tcp.pose,
            payload=None if payload is None else FlangePayload(payload.mass, payload.center_of_mass),
            speed=limits.speed,
            angular_speed=limits.angular_speed,
            acceleration=self.acceleration,
            watchdog=self.watchdog,
            stale_after=limits.sample_age,
            speed_slider=self.speed_slider,
        )
        return UrArm(self.address, settings)

    def emulator(self, number: int = 0) -> UrServer:
        """See `DeviceKind`."""
        return UrServer(self.address, mounting=ArmMounting(pose_flange_tip=self.tcp.pose))
