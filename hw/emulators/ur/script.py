"""What the commands of ur_rtde's control script share."""

from dataclasses import dataclass

from palpate.hw.emulators.ur.registers import Registers
from palpate.hw.emulators.ur.robot import EmulatedController, Program


@dataclass(frozen=True, slots=True)
class PathStep:
    """One waypoint of a path.

    Attributes:
        joint_space: Whether the joints move together (movej), or the TCP straight.
        is_pose: Whether the target is a pose of the TCP, or joint angles.
        target: x, y, z [m] and a rotation vector [rad], or angles [rad].
        speed: [m/s, or rad/s of the leading axis].
        acceleration: [m/s^2, or rad/s^2].
        progress: The value reported when it begins.
    """

    joint_space: bool
    is_pose: bool
    target: tuple[float, ...]
    speed: float
    acceleration: float
    progress: int


@dataclass(slots=True, eq=False)
class Script:
    """What the commands share while a control script runs.

    Attributes:
        robot: The controller.
        registers: Of the script.
        path: What `movePath` follows, injected when the script was uploaded.
        scaling: Of force mode's gain.
        operation: What an asynchronous command has left running; None for nothing.
        detecting: The direction in which contacts are looked for; None: not at all.
    """

    robot: EmulatedController
    registers: Registers
    path: tuple[PathStep, ...] = ()
    scaling: float = 1.0
    operation: Program | None = None
    detecting: tuple[float, ...] | None = None

    def begin_operation(self, work: Program) -> None:
        """Leave some work running while the next commands come."""
        self.registers.begin_operation()
        self.operation = work

    def end_operation(self) -> None:
        """Leave nothing running."""
        if self.operation is not None:
            self.operation = None
            self.registers.finish_operation()

    def go_on(self) -> None:
        """Do one cycle of what was left running."""
        if self.operation is not None:
            try:
                next(self.operation)
            except StopIteration:
                self.end_operation()
