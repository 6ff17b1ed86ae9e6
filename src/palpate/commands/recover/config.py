"""Options of `palpate recover`; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass

from palpate.commands.robot.config import RobotName


@dataclass(frozen=True, slots=True)
class RecoverConfig:
    """Connect to a robot's devices after a stop, report the state of each, and bring back what was stopped.

    Of an arm: whether it stands, protective, emergency and safeguard stop, power and brakes. Of a hand: hardware
    errors, torque and watchdog of each servo. Of a sensor: whether it sends good readings. What is well stays as
    it is. Before a protective stop is unlocked, an arm powered or a servo restarted, it asks; make sure that the
    cause is gone and the path clear. An emergency stop has to be released by hand first.

    Exit code 0 if every device is fit now, 1 if one is not, or if an action was declined, 2 if the robot file is
    wrong.

    Example: palpate recover cell.yaml

    Example: palpate recover cell.yaml --yes --json
    """

    robot: RobotName
    """A robot file of kind `rig`, or a robot that comes with palpate. Emulated ones run meanwhile."""
    yes: bool = False
    """Do not ask: for scripts. Otherwise, without a terminal to ask on, nothing is unlocked or restarted."""
