"""The newest state, for whoever waits for what it will say."""

from collections.abc import Callable
from time import monotonic, sleep

from palpate.hw.ur.exchange import UrState
from palpate.hw.ur.problems import Problem, refusal, safety_problem

_LOOK_EVERY = 2e-3
"""[s]: a cycle."""


class Latest:
    """The controller's latest state."""

    def __init__(self, newest: Callable[[], UrState | None]) -> None:
        """Take where it comes from."""
        self._newest = newest

    def state(self) -> UrState:
        """Return it.

        Raises:
            Refusal: There never was one.
        """
        state = self._newest()
        if state is None:
            raise refusal(Problem.SILENT)
        return state

    def problem(self) -> Problem:
        """Return what the controller's safety says now."""
        state = self.state()
        return safety_problem(state.robot_mode, state.safety_bits)

    def refuse_unsafe(self) -> None:
        """See that nothing is wrong.

        Raises:
            Refusal: Something is.
        """
        problem = self.problem()
        if problem is not Problem.NONE:
            raise refusal(problem)

    def wait_for(self, met: Callable[[UrState], bool], within: float, otherwise: Problem) -> None:
        """Wait until a state is as it should be.

        Args:
            met: Whether it is.
            within: [s].
            otherwise: What is wrong if it is not by then.

        Raises:
            Refusal: It is not.
        """
        deadline = monotonic() + within
        while not met(self.state()):
            if monotonic() > deadline:
                raise refusal(otherwise)
            sleep(_LOOK_EVERY)
