"""What `palpate robot` is to do; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from palpate.errors import InvalidValueError

RobotName = Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="ROBOT")]


@dataclass(frozen=True, slots=True)
class RobotListConfig:
    """List the robots that come with palpate. Their names go to --robot of every experiment.

    Example: palpate robot list
    """


@dataclass(frozen=True, slots=True)
class RobotShowConfig:
    """Print a robot file, with its comments: a start for your own.

    Example: palpate robot show stage > mine.yaml
    """

    robot: RobotName = "stage"
    """A robot that comes with palpate, or a robot file."""
    sensor: Annotated[int | None, tyro.conf.arg(metavar="FINGER")] = None
    """Print the sensor file of this finger instead; the first is 0. Without one, what is known of a simulated
    sensor: a start for your own."""

    def __post_init__(self) -> None:
        if self.sensor is not None and self.sensor < 0:
            raise InvalidValueError(f"sensor = {self.sensor}: must be the number of a finger, 0 or above")


@dataclass(frozen=True, slots=True)
class RobotCheckConfig:
    """Show how palpate reads a robot file, every value with its unit; or what is wrong with it, and where.

    Values that the file leaves out are marked: they are the defaults. Exit code 2 if something is wrong.

    Example: palpate robot check mine.yaml
    """

    robot: RobotName
    """A robot file, or a robot that comes with palpate."""
