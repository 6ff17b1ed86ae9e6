"""The commands of a controller: what is within all limits for certain passes in one compiled step."""

import struct
from collections.abc import Sequence
from functools import partial
from math import hypot

import numpy as np
import numpy.typing as npt
from numba.extending import register_jitable

from palpate.compiling import machine_code, njit
from palpate.errors import FloatArray
from palpate.runtime.data import Command, Phase
from palpate.runtime.stopping import Stopping, stopping_time
from palpate.runtime.supervision.bounds import BoundChecks, first_broken
from palpate.runtime.supervision.command_conditions import (
    GRIP,
    CommandCondition,
    finger_speed_fault,
    form_fault,
)
from palpate.runtime.supervision.finding import Violation
from palpate.runtime.supervision.limits import Limits
from palpate.runtime.supervision.observed_row import ARM_TIME, POSITION, TIME, VELOCITY

register_jitable(stopping_time)

_MOST, _DELAY, _DECELERATION, _LOWER, _UPPER = 0, 1, 2, 3, 6
"""Where the numbers of the room that a command needs stand: the speed with which anything may be touched [m/s],
how a tip comes to rest (see `Stopping`), and the workspace."""


@njit(error_model="numpy", cache=True)
def passes(
    places: npt.NDArray[np.int16], limits: FloatArray, command: FloatArray, observed: FloatArray, room: FloatArray
) -> bool:
    """Return whether a command is within all limits for certain; then it becomes the one before.

    Near the edge of the workspace, and above the speed that nothing touched limits, there is more to be said.

    Args:
        places: See `palpate.runtime.supervision.bounds.first_broken`,
        limits: likewise.
        command: Its row, with the one before.
        observed: What was sensed, see `palpate.runtime.supervision.observed_row`.
        room: Laid out as the constants above say.
    """
    if first_broken(places, limits, command, True, 0, len(places)) >= 0:
        return False
    speed = hypot(hypot(command[0], command[1]), command[2])
    u, v, w = observed[VELOCITY], observed[VELOCITY + 1], observed[VELOCITY + 2]
    fastest = hypot(speed, hypot(hypot(u, v), w))
    age = observed[TIME] - observed[ARM_TIME]
    way = fastest * (age + stopping_time(fastest, room[_DELAY], room[_DECELERATION]))
    if not speed <= room[_MOST]:
        return False
    for i in range(3):
        if not room[_LOWER + i] + way <= observed[POSITION + i] <= room[_UPPER + i] - way:
            return False
    size = len(command) // 2
    command[size:] = command[:size]
    return True


class CommandWatch:
    """Takes the commands of a run.

    Attributes:
        last: The last command that was taken.
        grip: Of the last that said something of it; None: none did.
        velocities: Of the last one, of the tip and of its turning, shape (6,) or longer.
    """

    def __init__(
        self, conditions: Sequence[CommandCondition], most: float, limits: Limits, stopping: Stopping
    ) -> None:
        """Begin at rest.

        Args:
            conditions: In order.
            most: Commanded speed up to which all is well, whatever is touched [m/s].
            limits: Of the workspace, and of the speed of fingers.
            stopping: How the tip comes to rest.
        """
        self.last = Command()
        self.grip: tuple[float, ...] | None = None
        self._conditions, self._speed = tuple(conditions), limits.speed
        numbers = (most, stopping.delay, stopping.deceleration, *limits.workspace_lower, *limits.workspace_upper)
        self._room = np.array(numbers)
        self._lay_out((), np.zeros(GRIP))

    def _lay_out(self, grip: tuple[float, ...], velocities: FloatArray) -> None:
        """Make room for as many forces as a grip has."""
        self._bounds = BoundChecks([condition.bounds(len(grip)) for condition in self._conditions])
        size = GRIP + len(grip)
        self._buffer, self._pack, self._held = bytearray(16 * size), struct.Struct(f"{size}d").pack_into, grip
        self._row: FloatArray = np.frombuffer(self._buffer)
        self.velocities = self._row[size:]
        self.velocities[:GRIP] = velocities[:GRIP]
        given = (self._bounds.places, self._bounds.limits, self._row)
        self._passes = partial(machine_code(passes, *given, self._room, self._room), *given)

    def passes(self, command: object, observed: FloatArray) -> bool:
        """Return whether something is a command that is within all limits for certain; then it is taken.

        Args:
            command: Whatever a controller returned.
            observed: See `passes` of this module.
        """
        if type(command) is not Command or type(command.phase) is not Phase:
            return False
        velocity, turn, grip = command.velocity_base_tip, command.angular_velocity_base_tip, command.grip_force
        plain = type(velocity) is tuple and type(turn) is tuple
        if not plain or command.phase is Phase.STOP or command.finger_velocity is not None:
            return False
        if grip is not None and (type(grip) is not tuple or not grip):
            return False
        try:
            x, y, z = velocity
            u, v, w = turn
            self._pack(self._buffer, 0, x, y, z, u, v, w, *(self._held if grip is None else grip))
        except (TypeError, ValueError, OverflowError, struct.error):
            return False
        if not self._passes(observed, self._room):
            return False
        self.last = command
        if grip is not None:
            self.grip = self._held = grip
        return True

    def fault(self, command: Command) -> Violation | None:
        """Return what is wrong with whatever a controller returned, by its form and its bounds, if anything."""
        finding = form_fault(command, self.grip)
        if finding is not None:
            return finding
        grip = self._held if command.grip_force is None else command.grip_force
        if len(grip) != len(self._held):
            self._lay_out(grip, self.velocities)
        self._pack(self._buffer, 0, *command.velocity_base_tip, *command.angular_velocity_base_tip, *grip)
        for i in range(len(self._conditions)):
            finding = self._bounds.broken(i, self._row, command, self.last, True)
            if finding is not None:
                return finding
        return finger_speed_fault(command, self._speed)

    def take(self, command: Command) -> None:
        """Take the command that was looked at last, however it was found to be right."""
        self.velocities[:] = self._row[: len(self.velocities)]
        self.last = command
        if command.grip_force is not None:
            self.grip = self._held = command.grip_force
