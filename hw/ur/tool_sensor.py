"""The force/torque sensor in the arm's flange, as a sensor of its own; it needs no connection but the arm's."""

import math
from time import monotonic, sleep

from palpate.hw.devices import DeviceError, SensorReading
from palpate.hw.ur.arm import UrArm
from palpate.hw.ur.exchange import UrState
from palpate.kinematics.pose import rotation_from_rotvec
from palpate.spatial import rotate_back

_AVERAGED = 50
"""Records whose mean is taken for the present load: a tenth of a second at 500 Hz."""

_AVERAGED_WITHIN = 2.0
"""[s]."""


class UrToolSensor:
    """Load on the tool about the TCP, tip frame, without the payload's weight (actual_TCP_force).

    The controller gives it with the axes of its base; here it is turned into those of the tip frame. A
    `SensorDevice`.
    """

    def __init__(self, arm: UrArm) -> None:
        """Take the arm, which is started and closed by whoever made it."""
        self._arm = arm

    @property
    def name(self) -> str:
        """For messages."""
        return f"tool sensor of the {self._arm.name}"

    def start(self) -> None:
        """See that the arm is there.

        Raises:
            DeviceError: It is not started, or see `UrArm.state`.
        """
        self._arm.state()

    def read(self) -> SensorReading:
        """Return the newest load.

        Raises:
            DeviceError: See `UrArm.state`.
        """
        s = self._arm.state()
        fx, fy, fz, mx, my, mz = s.tool_wrench
        rx, ry, rz = s.tool_pose[3:]
        rotation_base_tip = rotation_from_rotvec((rx, ry, rz))
        force, moment = rotate_back(rotation_base_tip, (fx, fy, fz)), rotate_back(rotation_base_tip, (mx, my, mz))
        return SensorReading(s.time, force + moment, healthy=_finite(s.tool_wrench), lost=s.lost)

    def tare(self) -> None:
        """Let the controller take the present load for zero; the arm comes to rest before.

        Raises:
            DeviceError: It refused.
        """
        self._arm.tare()

    def close(self) -> None:
        """Nothing to let go of."""


class UrRawToolSensor:
    """Load on the sensor in the flange as it measures it, its own frame, weight and all (ft_raw_wrench).

    A `SensorDevice`; the controller's zero does not touch it, so `tare` takes the load off here.
    """

    def __init__(self, arm: UrArm) -> None:
        """Take the arm, which is started and closed by whoever made it."""
        self._arm = arm
        self._zero: tuple[float, ...] = (0.0,) * 6

    @property
    def name(self) -> str:
        """For messages."""
        return f"raw tool sensor of the {self._arm.name}"

    def start(self) -> None:
        """See that the arm is there, and that its controller has such a sensor.

        Raises:
            DeviceError: It is not started, has none, or see `UrArm.state`.
        """
        if not _finite(self._arm.state().raw_wrench):
            raise DeviceError(
                self.name, "this controller does not give the raw wrench", "use UrToolSensor, or update PolyScope"
            )

    def read(self) -> SensorReading:
        """Return the newest load.

        Raises:
            DeviceError: See `UrArm.state`.
        """
        s = self._arm.state()
        wrench = tuple(w - z for w, z in zip(s.raw_wrench, self._zero, strict=True))
        return SensorReading(s.time, wrench, healthy=_finite(wrench), lost=s.lost)

    def tare(self) -> None:
        """Take the mean of the next records for zero; the arm must be at rest.

        Raises:
            DeviceError: Not enough records came.
        """
        taken: list[UrState] = [self._arm.state()]
        deadline = monotonic() + _AVERAGED_WITHIN
        while len(taken) < _AVERAGED:
            state = self._arm.state()
            if state.time > taken[-1].time:
                taken.append(state)
            elif monotonic() > deadline:
                raise DeviceError(self.name, "too few records to tare", "see what else runs here")
            else:
                sleep(5e-4)
        self._zero = tuple(
            math.fsum(column) / _AVERAGED for column in zip(*(s.raw_wrench for s in taken), strict=True)
        )

    def close(self) -> None:
        """Nothing to let go of."""


def _finite(wrench: tuple[float, ...]) -> bool:
    return all(map(math.isfinite, wrench))
