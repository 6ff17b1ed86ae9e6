"""At which period a run is controlled: as was asked for, or as the robot file says."""

from typing import Protocol

from palpate.runtime.robot import Robot


class WithPeriod(Protocol):
    """A configuration that may say a control period."""

    @property
    def period(self) -> float | None:
        """Of control [s]; None leaves it to the robot file."""
        ...


def period_of(config: WithPeriod, robot: Robot) -> float:
    """Return the control period of a run [s]."""
    return robot.file.period if config.period is None else config.period
