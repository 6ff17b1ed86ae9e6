"""How a controller says what it is up to: the numbers of the RTDE guide."""

from enum import IntEnum


class RuntimeState(IntEnum):
    """Of the program; ur_rtde takes PLAYING for running and STOPPED for stopped, nothing else."""

    STOPPED = 1
    PLAYING = 2
    PAUSED = 4


class RobotMode(IntEnum):
    """Of the arm's power."""

    POWER_OFF = 3
    IDLE = 5
    RUNNING = 7


class SafetyMode(IntEnum):
    """Of the safety system, as far as emulated."""

    NORMAL = 1
    PROTECTIVE_STOP = 3
    ROBOT_EMERGENCY_STOP = 7

    @property
    def bits(self) -> int:
        """What `safety_status_bits` says of it."""
        return _BITS[self]


POWER_ON, PROGRAM_RUNNING = 1 << 0, 1 << 1
"""In `robot_status_bits`."""

JOINT_RUNNING = 253
"""A `joint_mode`; the others are not emulated."""

_NORMAL, _PROTECTIVE, _ROBOT_E_STOP, _E_STOP, _STOPPED = (1 << bit for bit in (0, 2, 6, 7, 10))
_BITS = {
    SafetyMode.NORMAL: _NORMAL,
    SafetyMode.PROTECTIVE_STOP: _PROTECTIVE | _STOPPED,
    SafetyMode.ROBOT_EMERGENCY_STOP: _ROBOT_E_STOP | _E_STOP | _STOPPED,
}
