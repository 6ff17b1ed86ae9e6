"""Options of `palpate doctor`; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from palpate.commands.robot.config import RobotName
from palpate.errors import InvalidValueError
from palpate.experiments.kit.options import check_options, option

SHORTEST, LONGEST = 0.2, 600.0
"""[s] to measure each device: shorter, there is too little for a 99th percentile; longer, it is another unit."""


@dataclass(frozen=True, slots=True)
class DoctorConfig:
    """Connect to the devices of a robot file, measure their condition, and report what to fix. Moves nothing.

    Of every sensor: rate, age, jitter, noise, what it shows at rest. Of an arm: version, state, rate, age. Of a
    hand: temperatures, voltages, firmware, time of an exchange. Of this computer: how late it wakes up, and what
    it grants of real time. Nothing may be touched meanwhile. The torque of a hand is switched on where its fingers
    stand, and off again unless it was found holding something.

    Exit code 0 if all of it is fit, 1 if something is to be fixed, 2 if the robot file is wrong.

    Example: palpate doctor mine.yaml

    Example: palpate doctor emulated-hand
    """

    robot: RobotName
    """A robot file of kind `rig`, or a robot that comes with palpate. Emulated ones run meanwhile."""
    seconds: Annotated[float, tyro.conf.arg(name="duration", aliases=("--seconds",))] = option(2.0, "s")
    """How long each device is measured [s]."""

    def __post_init__(self) -> None:
        check_options(self)
        if not SHORTEST <= self.seconds <= LONGEST:
            raise InvalidValueError(
                f"duration = {self.seconds:g} s: must be from {SHORTEST:g} to {LONGEST:g} seconds"
            )
