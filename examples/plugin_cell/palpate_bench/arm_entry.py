"""The arm in a robot file."""

import msgspec

from palpate.robots.arm_kind import ArmKind
from palpate.robots.device_settings import DeviceSettings, PoseEntry
from palpate.runtime import Limits
from palpate_bench.arm import BenchArm
from palpate_bench.arm_emulator import BenchArmServer
from palpate_bench.arm_lines import PORT


class BenchArmEntry(ArmKind, DeviceSettings, frozen=True, kw_only=True):
    """The arm of the bench.

    Attributes:
        address: Of the arm.
        port: TCP.
        watchdog: Time without commands after which it stops by itself [s].
        robot_base: Where its own base frame is; None: a run begins where the tip is.
        stiffness: With which it holds its tip [N/m].
    """

    RANGES = (
        ("port", 1, 65535, ""),
        ("watchdog_s", 0.01, 1.0, "s"),
        ("stiffness_N_per_m", 100.0, 1e7, "N/m"),
    )

    address: str
    port: int = PORT
    watchdog: float = msgspec.field(name="watchdog_s", default=0.1)
    robot_base: PoseEntry | None = None
    stiffness: float = msgspec.field(name="stiffness_N_per_m", default=3e4)

    def device(self, limits: Limits) -> BenchArm:
        """See `ArmKind`."""
        return BenchArm(self.address, self.port, self.watchdog, limits.sample_age)

    def emulator(self, number: int = 0) -> BenchArmServer:
        """See `DeviceKind`."""
        return BenchArmServer(self.address, self.port, self.watchdog)
