"""A UR arm after a stop."""

import math
from collections.abc import Mapping

from palpate.commands.recover.condition import DeviceCondition
from palpate.hw.ur import UrArm
from palpate.hw.ur.problems import RUNNING, WORDS, Problem, safety_problem
from palpate.runtime.standstill_check import REST_SPEED

ACTIONS: Mapping[Problem, str] = {
    Problem.PROTECTIVE_STOP: "unlock its protective stop and load the control program; the arm may give a little",
    Problem.NOT_POWERED: "power it and release its brakes; the arm may sag by millimetres",
}
"""What can be undone from here."""


class RecoverableArm:
    """A `Recoverable` arm."""

    def __init__(self, arm: UrArm) -> None:
        """Take an arm that is not started."""
        self._arm = arm

    @property
    def name(self) -> str:
        """See `Recoverable`."""
        return self._arm.name

    def condition(self) -> DeviceCondition:
        """See `Recoverable`.

        Raises:
            DeviceError: It cannot be reached.
            MissingLibraryError: There is no ur_rtde for this computer.
        """
        state = self._arm.examine()
        speed = math.hypot(*state.tool_velocity[:3])
        stands = f"it moves at {1e3 * speed:.3g} mm/s" if speed >= REST_SPEED else "it stands still"
        power = "powered, brakes released" if state.robot_mode == RUNNING else f"robot mode {state.robot_mode}"
        problem = safety_problem(state.robot_mode, state.safety_bits)
        if problem is Problem.NONE:
            fit = speed < REST_SPEED
            remedy = "" if fit else "another program or somebody's hand moves it: end that first"
            return DeviceCondition(self.name, f"{stands}, {power}, no safety stop", fit, remedy=remedy)
        words, remedy = WORDS[problem]
        action = ACTIONS.get(problem, "")
        return DeviceCondition(self.name, f"{stands}, {power}; {words}", False, action, "" if action else remedy)

    def recover(self) -> None:
        """See `Recoverable`.

        Raises:
            DeviceError: It could not be done.
        """
        self._arm.recover()

    def close(self) -> None:
        """See `Recoverable`."""
        self._arm.close()
