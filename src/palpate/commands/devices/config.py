"""Options of the commands over devices; imports nothing heavy, so that `palpate --help` is quick."""

import ipaddress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from palpate.errors import InvalidValueError
from palpate.experiments.kit.options import check_options, option

RobotName = Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="ROBOT")]

_ControlPort = Annotated[int, tyro.conf.arg(metavar="PORT")]
_Faults = Annotated[tuple[tuple[str, float], ...], tyro.conf.arg(metavar="[NAME VALUE ...]")]

_TIME_SCALES = (0.01, 10.0)
_MIN_PORT = 1024
"""Lowest port; below, only the system's own services may listen."""


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
    """Print the sensor file of this finger instead; the first is 0. A simulated sensor without a file is printed
    as far as it is known: a start for your own."""

    def __post_init__(self) -> None:
        if self.sensor is not None and self.sensor < 0:
            raise InvalidValueError(f"sensor = {self.sensor}: must be the number of a finger, 0 or above")


@dataclass(frozen=True, slots=True)
class RobotCheckConfig:
    """Show how palpate reads a robot file, every value with its unit; or the place and the reason of an error.

    Values that the file leaves out are marked as defaults. Exit code 2 if something is wrong.

    Example: palpate robot check mine.yaml
    """

    robot: RobotName
    """A robot file, or a robot that comes with palpate."""


@dataclass(frozen=True, slots=True)
class DoctorConfig:
    """Connect to the devices of a robot file, measure their condition, and report what to fix. Moves nothing.

    Sensors: rate, age, jitter, noise, readings at rest. Arm: version, state, rate, age. Hand: temperatures,
    voltages, firmware, time of an exchange. This computer: lateness of its wake-ups, and the real-time priority
    that it grants. Nothing may be touched meanwhile. The torque of a hand is switched on where its fingers stand,
    and off again unless the hand was found holding something.

    Exit code 0 if everything is fit, 1 if something is to be fixed, 2 if the robot file is wrong.

    Example: palpate doctor mine.yaml

    Example: palpate doctor emulated-hand
    """

    robot: RobotName
    """A robot file of kind `rig`, or a robot that comes with palpate. Emulated ones run meanwhile."""
    duration: float = option(2.0, "s", within=(0.2, 600.0))
    """Time for which each device is measured [s]."""

    def __post_init__(self) -> None:
        check_options(self)


@dataclass(frozen=True, slots=True)
class RecoverConfig:
    """Connect to a robot's devices after a stop, report the state of each, and bring stopped ones back.

    Arm: motion, protective, emergency and safeguard stop, power and brakes. Hand: hardware errors, torque and
    watchdog of each servo. Sensors: whether their readings are good. Devices that are well stay as they are. The
    command asks before it unlocks a protective stop, powers an arm or restarts a servo; make sure that the cause
    is gone and the path clear. An emergency stop has to be released by hand first.

    Exit code 0 if every device is fit now, 1 if one is not, or if an action was declined, 2 if the robot file is
    wrong.

    Example: palpate recover cell.yaml

    Example: palpate recover cell.yaml --yes --json
    """

    robot: RobotName
    """A robot file of kind `rig`, or a robot that comes with palpate. Emulated ones run meanwhile."""
    yes: bool = False
    """Do not ask: for scripts. Otherwise, without a terminal to ask on, nothing is unlocked or restarted."""


def _check_address(name: str, address: str) -> None:
    try:
        ipaddress.IPv4Address(address)
    except ValueError:
        raise InvalidValueError(f"{name} = {address!r}: must be an IPv4 address, such as 127.0.0.2") from None


def _check_control_port(name: str, port: int) -> None:
    if port and not _MIN_PORT <= port < 65536:
        raise InvalidValueError(f"{name} = {port}: must be from {_MIN_PORT} to 65535, or 0 for a free one")


def version_numbers(version: str) -> tuple[int, int, int, int]:
    """Return the four numbers of a controller's version; numbers left out are 0.

    Raises:
        InvalidValueError: If there is no controller of this version.
    """
    parts = version.split(".")
    if not all(part.isascii() and part.isdigit() for part in parts) or len(parts) > 4:
        raise InvalidValueError(f"version = {version!r}: must be numbers with dots between, as 5.14.0.1")
    major, minor, bugfix, build = (*map(int, parts), 0, 0, 0)[:4]
    if major not in (3, 5, 10):
        raise InvalidValueError(
            f"version = {version!r}: must begin with 3 (CB3), 5 (e-Series) or 10 (PolyScope X)"
        )
    return major, minor, bugfix, build


@dataclass(frozen=True, slots=True, kw_only=True)
class _Emulation:
    control_port: _ControlPort = option(0, check=_check_control_port)
    """Port on which faults are switched, of this computer alone; once it listens, the device does. 0: any free
    one, printed at the beginning, and with --json at the end. The token that it takes is printed, too, or chosen
    by PALPATE_CONTROL_TOKEN in the environment."""

    def __post_init__(self) -> None:
        check_options(self)


@dataclass(frozen=True, slots=True)
class _DeviceEmulation(_Emulation):
    fault: _Faults = ()
    """Faults from the beginning, with their values. More can be switched while it runs: palpate emulate fault."""


@dataclass(frozen=True, slots=True)
class EmulateUrConfig(_DeviceEmulation):
    """Emulate a controller of Universal Robots: RTDE, script port and dashboard, for any client.

    The UR5e moves as commanded, and may touch an elastic plane. It has no dynamics: for dynamics, `palpate explore
    --robot emulated-ur5e`. Runs until Ctrl-C.

    Example: palpate emulate ur, then in Python: rtde_receive.RTDEReceiveInterface("127.0.0.2").getActualTCPPose()

    Example, one that is stopped from the beginning: palpate emulate ur --fault protective_stop 1
    """

    address: str = option("127.0.0.2", check=_check_address)
    """Address at which it listens; its ports are fixed, so each controller needs an address of its own. All of
    127.x.y.z is this computer alone; at another address, others can drive the emulated arm."""
    version: str = option("5.14.0.1", check=lambda name, version: version_numbers(version))
    """Version of its software: 3 (CB3, 125 Hz), 5 (e-Series) or 10 (PolyScope X, no dashboard), and so on."""
    plane: float | None = option(None, "m")
    """Height of the elastic plane under the tool, in the arm's base frame [m]. Left out: there is none."""
    stiffness: float = option(2000.0, "N/m", bound="positive")
    """Stiffness of the plane [N/m]."""
    time_scale: float = option(1.0, within=_TIME_SCALES)
    """Seconds of the robot per second of wall time."""


@dataclass(frozen=True, slots=True)
class EmulateDynamixelConfig(_DeviceEmulation):
    """Emulate a bus of Dynamixel servos (protocol 2.0) on a terminal of this computer. Runs until Ctrl-C.

    Example: palpate emulate dynamixel --servos 4 --link /tmp/dynamixel, then open /tmp/dynamixel at 1000000 baud
    """

    servos: int = option(2, within=(1, 16))
    """Number of servos, with ids from 1 on."""
    model: Literal["XL330-M288", "XM430-W210"] = "XL330-M288"
    """Model of all servos."""
    link: Annotated[Path | None, tyro.conf.arg(metavar="PATH")] = None
    """Link to the terminal, whose own name changes from time to time. Left out: none."""
    wall: float | None = option(None, "rad")
    """Angle at which an elastic wall stops the shafts [rad from the middle of their turn]. Left out: none."""
    baud_rate: int = 1_000_000
    """Rate of the servos' bus [1/s]."""
    time_scale: float = option(1.0, within=_TIME_SCALES)
    """Seconds of the servos' motion per second of wall time."""
    seed: int = 0
    """Seed of random faults."""


@dataclass(frozen=True, slots=True)
class EmulateNetftConfig(_DeviceEmulation):
    """Emulate an ATI Net F/T box, or an OnRobot HEX: records by UDP, the calibration by TCP. Runs until Ctrl-C.

    The box shows a steady load. Example: palpate emulate netft --load 0 0 -5 0 0 0 --rate 7000
    """

    address: str = option("127.0.0.1", check=_check_address)
    """Address at which it listens: UDP port 49152, and for the calibration TCP port 49151. All of 127.x.y.z is
    this computer alone; others can read it at any other address."""
    make: Literal["ati", "onrobot"] = "ati"
    """Make of the box: units, commands and calibration differ."""
    rate: float = option(1000.0, "1/s", bound="positive")
    """Records per second, up to 7000. An OnRobot's client sets it."""
    load: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Load that it shows: three forces [N] and three moments [N m]."""


@dataclass(frozen=True, slots=True)
class EmulateRobotConfig(_Emulation):
    """Emulate the devices of a robot file of kind rig where the file says that they are. Runs until Ctrl-C.

    The tip stands over an elastic plane that all sensors feel. The file works from another terminal as on the
    real robot: `palpate doctor`, `palpate regulate --robot`, `palpate recover`. Devices that palpate does not know
    need an emulator of theirs: `emulator` of their kind.

    Example: palpate emulate robot mine.yaml
    """

    robot: RobotName
    """A robot file, or a robot that comes with palpate."""
    above: float = option(0.003, "m", bound="positive")
    """Height of the middle of the tip above the elastic plane at the beginning [m]; the tip pushes the plane. The
    default is the height at which experiments begin above their object."""
    stiffness: float = option(2000.0, "N/m", bound="positive")
    """Stiffness of the plane [N/m]."""
    time_scale: float = option(1.0, within=_TIME_SCALES)
    """Seconds of the robot per second of wall time."""


@dataclass(frozen=True, slots=True)
class EmulateFaultConfig:
    """Switch a fault of an emulated device; a wrong name lists those that exist.

    Example: palpate emulate fault '41234?token=TOKEN' ur drop_rst
    """

    address: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="PORT?token=TOKEN")]
    """Address of the emulator's control, as it printed it; a port alone if PALPATE_CONTROL_TOKEN is set."""
    device: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="DEVICE")]
    """Name of the device, as the emulator printed it."""
    fault: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="FAULT")]
    """Name of the fault."""
    value: Annotated[float, tyro.conf.Positional, tyro.conf.arg(metavar="VALUE")] = 1.0
    """Value of the fault; 0 ends most."""

    def __post_init__(self) -> None:
        check_options(self)
        port = self.address.partition("?")[0]
        if not (port.isdecimal() and len(port) < 6 and 0 < int(port) < 65536):
            raise InvalidValueError(f"port = {port}: must be from 1 to 65535, as the emulator printed it")


EmulateConfig = EmulateUrConfig | EmulateDynamixelConfig | EmulateNetftConfig | EmulateRobotConfig
