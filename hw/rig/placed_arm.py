"""Arms whose tip is where a run begins: because it was led there, or because that is where the run begins."""

import math
from dataclasses import dataclass

from palpate.hw.devices import ArmDevice, DeviceError
from palpate.hw.rig.framed_arm import FramedArm
from palpate.kinematics.pose import Pose, rotvec_from_rotation
from palpate.runtime.data import ArmSample
from palpate.spatial import Vector, norm, subtract


@dataclass(frozen=True, slots=True)
class Beginning:
    """Where the tip is to be when a run begins.

    Attributes:
        position_base_tip: [m].
        near: By how much it may be elsewhere [m].
        most_turned: By how much its axes may be turned against the base's [rad]; pi: they may be as they like.
    """

    position_base_tip: Vector
    near: float
    most_turned: float = math.pi

    def check(self, device: str, arm: ArmSample) -> None:
        """Refuse an arm that is elsewhere: nothing moves it there.

        Raises:
            DeviceError: It is.
        """
        there, wanted = arm.position_base_tip, self.position_base_tip
        if math.dist(there, wanted) > self.near:
            raise DeviceError(
                device,
                f"its tip is at {_shown(there)} m and must be within {1e3 * self.near:g} mm of {_shown(wanted)} m",
                "lead it there by hand",
            )
        turned = norm(rotvec_from_rotation(arm.rotation_base_tip))
        # half a turn is all there is, but for rounding
        if turned > self.most_turned and self.most_turned < math.pi:
            raise DeviceError(
                device,
                f"the axes of its tip are turned by {math.degrees(turned):.0f} degrees against the base's; for "
                f"this fingertip {math.degrees(self.most_turned):.0f} are the limit",
                "turn the tip, or say how it is mounted (backend.arm.tcp.rotvec_rad in the robot file)",
            )


class ArmAtPlace(FramedArm):
    """It refuses to start elsewhere than where the run begins."""

    def __init__(self, arm: ArmDevice, pose_base_robot: Pose, beginning: Beginning) -> None:
        """Take an arm; see `FramedArm`, and where it must be.

        Raises:
            InvalidValueError: That is no pose.
        """
        super().__init__(arm, pose_base_robot)
        self._beginning = beginning

    def start(self) -> None:
        """See `Device`.

        Raises:
            DeviceError: It is elsewhere.
        """
        super().start()
        try:
            self._beginning.check(self.name, self.read())
        except BaseException:
            self.close()
            raise


class ArmFromHere(ArmAtPlace):
    """Its base frame is such that it is where the run begins: nobody has to know where the object is.

    The axes of the base frame are those of its robot base.
    """

    def __init__(self, arm: ArmDevice, beginning: Beginning) -> None:
        """Take an arm."""
        super().__init__(arm, Pose(), beginning)

    def start(self) -> None:
        """See `Device`.

        Raises:
            DeviceError: Its tip is turned.
        """
        self._arm.start()
        try:
            here = self._arm.read().position_base_tip
            self._pose = Pose(subtract(self._beginning.position_base_tip, here))
            self._beginning.check(self.name, self.read())
        except BaseException:
            self.close()
            raise


def _shown(place: Vector) -> str:
    return "(" + ", ".join(f"{x:.4f}" for x in place) + ")"
