"""An arm commanded in another base frame than its own."""

from palpate.hw.devices import ArmDevice, read_stopped
from palpate.kinematics.pose import Pose, checked_pose, times
from palpate.runtime.data import ArmSample
from palpate.runtime.watchdog import DeviceWatchdog, watchdogs_of
from palpate.spatial import Vector, add, rotate, rotate_back


class FramedArm:
    """An `ArmDevice` whose base frame is where the work is: z up, wherever the arm stands and hangs."""

    def __init__(self, arm: ArmDevice, pose_base_robot: Pose) -> None:
        """Take an arm.

        Args:
            arm: Which tells its own base frame, that of its robot base.
            pose_base_robot: Where its robot base is in the base frame.

        Raises:
            InvalidValueError: That is no pose.
        """
        self._arm = arm
        self._pose = checked_pose("pose_base_robot", pose_base_robot)

    @property
    def name(self) -> str:
        """See `Device`."""
        return self._arm.name

    def watchdogs(self) -> tuple[DeviceWatchdog, ...]:
        """See `WatchdogSource`."""
        return watchdogs_of(self._arm)

    def start(self) -> None:
        """See `Device`."""
        self._arm.start()

    def close(self) -> None:
        """See `Device`."""
        self._arm.close()

    def read(self) -> ArmSample:
        """See `ArmDevice`."""
        return self._framed(self._arm.read())

    def read_stopped(self) -> ArmSample:
        """See `StoppedArm`."""
        return self._framed(read_stopped(self._arm))

    def _framed(self, own: ArmSample) -> ArmSample:
        pose, force = self._pose, own.tip_force_base
        return ArmSample(
            time=own.time,
            position_base_tip=add(pose.position, rotate(pose.rotation, own.position_base_tip)),
            rotation_base_tip=times(pose.rotation, own.rotation_base_tip),
            velocity_base_tip=rotate(pose.rotation, own.velocity_base_tip),
            joint_position=own.joint_position,
            angular_velocity_base_tip=rotate(pose.rotation, own.angular_velocity_base_tip),
            tip_force_base=None if force is None else rotate(pose.rotation, force),
        )

    def move(self, velocity_base_tip: Vector, angular_velocity_base_tip: Vector) -> None:
        """See `ArmDevice`."""
        rotation = self._pose.rotation
        self._arm.move(rotate_back(rotation, velocity_base_tip), rotate_back(rotation, angular_velocity_base_tip))
