"""Options of `palpate emulate`; it imports nothing heavy, so that `palpate --help` is quick."""

import ipaddress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from palpate.errors import InvalidValueError
from palpate.experiments.kit.options import check_options, option

FastFaults = Annotated[tuple[tuple[str, float], ...], tyro.conf.arg(metavar="[NAME VALUE ...]")]

MIN_SCALE, MAX_SCALE = 0.01, 10.0
"""Seconds of the device per second of wall time."""

ControlPort = Annotated[int, tyro.conf.arg(metavar="PORT")]

MIN_PORT = 1024
"""Lowest port; below, only the system's own services may listen."""

MAX_SERVOS = 16
"""Servos on one bus; hands have fewer."""


@dataclass(frozen=True, slots=True)
class EmulateUrConfig:
    """Emulate a controller of Universal Robots: RTDE, script port and dashboard, for any client.

    Its UR5e moves as commanded, and may touch an elastic plane. It has no dynamics: for those, `palpate explore
    --robot emulated-ur5e`. Runs until Ctrl-C.

    Example: palpate emulate ur, then in Python: rtde_receive.RTDEReceiveInterface("127.0.0.2").getActualTCPPose()

    Example, one that is stopped from the beginning: palpate emulate ur --fault protective_stop 1
    """

    address: str = "127.0.0.2"
    """Address at which it listens; its ports are fixed, so each controller needs an address of its own. All of
    127.x.y.z is this computer alone; at another address, others can drive the emulated arm."""
    version: str = "5.14.0.1"
    """Version of its software: 3 (CB3, 125 Hz), 5 (e-Series) or 10 (PolyScope X, no dashboard), and so on."""
    plane: float | None = option(None, "m")
    """Height of the elastic plane under the tool, in the arm's base frame [m]. Left out: there is none."""
    stiffness: float = option(2000.0, "N/m", bound="positive")
    """Stiffness of the plane [N/m]."""
    scale: Annotated[float, tyro.conf.arg(name="time-scale", aliases=("--scale",))] = 1.0
    """Seconds of the robot per second of wall time."""
    fault: FastFaults = ()
    """Faults from the beginning, with their values. More can be switched while it runs: palpate emulate fault."""
    control_port: ControlPort = 0
    """On which faults are switched, of this computer alone; once it listens, the device does. 0: any free one,
    printed at the beginning, and with --json at the end. The token that it takes is printed, too, or chosen by
    PALPATE_CONTROL_TOKEN in the environment."""

    def __post_init__(self) -> None:
        _check(self, address=self.address, control_port=self.control_port, scale=self.scale)
        version_numbers(self.version)


@dataclass(frozen=True, slots=True)
class EmulateDynamixelConfig:
    """Emulate a bus of Dynamixel servos (protocol 2.0) on a terminal of this computer. Runs until Ctrl-C.

    Example: palpate emulate dynamixel --servos 4 --link /tmp/dynamixel, then open /tmp/dynamixel at 1000000 baud
    """

    servos: int = option(2, within=(1, MAX_SERVOS))
    """Number of servos, with ids from 1 on."""
    model: Literal["XL330-M288", "XM430-W210"] = "XL330-M288"
    """Model of all servos."""
    link: Annotated[Path | None, tyro.conf.arg(metavar="PATH")] = None
    """Link to the terminal, whose own name changes from time to time. Left out: none."""
    wall: float | None = option(None, "rad")
    """Angle at which an elastic wall stops the shafts [rad from the middle of their turn]. Left out: none."""
    baud_rate: int = 1_000_000
    """Rate of the servos' bus [1/s]."""
    scale: Annotated[float, tyro.conf.arg(name="time-scale", aliases=("--scale",))] = 1.0
    """Seconds of the servos' motion per second of wall time."""
    seed: int = 0
    """Seed of faults that are drawn."""
    fault: FastFaults = ()
    """Faults from the beginning, with their values."""
    control_port: ControlPort = 0
    """On which faults are switched, of this computer alone; once it listens, the device does. 0: any free one,
    printed at the beginning, and with --json at the end. The token that it takes is printed, too, or chosen by
    PALPATE_CONTROL_TOKEN in the environment."""

    def __post_init__(self) -> None:
        _check(self, control_port=self.control_port, scale=self.scale)


@dataclass(frozen=True, slots=True)
class EmulateNetftConfig:
    """Emulate an ATI Net F/T box, or an OnRobot HEX: records by UDP, the calibration by TCP. Runs until Ctrl-C.

    It shows a steady load. Example: palpate emulate netft --load 0 0 -5 0 0 0 --rate 7000
    """

    address: str = "127.0.0.1"
    """Address at which it listens: UDP port 49152, and for the calibration TCP port 49151. All of 127.x.y.z is
    this computer alone; others can read it at any other address."""
    make: Literal["ati", "onrobot"] = "ati"
    """Make of the box: units, commands and calibration differ."""
    rate: float = option(1000.0, "1/s", bound="positive")
    """Records per second, up to 7000. An OnRobot's client sets it."""
    load: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Load that it shows: three forces [N] and three moments [N m]."""
    fault: FastFaults = ()
    """Faults from the beginning, with their values."""
    control_port: ControlPort = 0
    """On which faults are switched, of this computer alone; once it listens, the device does. 0: any free one,
    printed at the beginning, and with --json at the end. The token that it takes is printed, too, or chosen by
    PALPATE_CONTROL_TOKEN in the environment."""

    def __post_init__(self) -> None:
        _check(self, address=self.address, control_port=self.control_port)


@dataclass(frozen=True, slots=True)
class EmulateRobotConfig:
    """Emulate the devices of a robot file of kind rig where the file says that they are. Runs until Ctrl-C.

    The tip stands over an elastic plane that all sensors feel. The file works from another terminal as on the
    real robot: `palpate doctor`, `palpate regulate --robot`, `palpate recover`. Devices that palpate does not know
    need an emulator of theirs: `emulator` of their kind.

    Example: palpate emulate robot mine.yaml
    """

    robot: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="ROBOT")]
    """A robot file, or a robot that comes with palpate."""
    above: float = option(0.003, "m", bound="positive")
    """How far the elastic plane is below the middle of the tip at the beginning [m], which it pushes: as far as
    experiments begin above their object."""
    stiffness: float = option(2000.0, "N/m", bound="positive")
    """Stiffness of the plane [N/m]."""
    scale: Annotated[float, tyro.conf.arg(name="time-scale", aliases=("--scale",))] = 1.0
    """Seconds of the robot per second of wall time."""
    control_port: ControlPort = 0
    """Port on which faults are switched, of this computer alone. 0: any free one."""

    def __post_init__(self) -> None:
        _check(self, control_port=self.control_port, scale=self.scale)


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


EmulateConfig = EmulateUrConfig | EmulateDynamixelConfig | EmulateNetftConfig


def _check(
    config: "EmulateConfig | EmulateRobotConfig", *, address: str = "", control_port: int = 0, scale: float = 1.0
) -> None:
    """Check the options that emulators share.

    Raises:
        InvalidValueError: If one is impossible.
    """
    check_options(config)
    try:
        ipaddress.IPv4Address(address or "127.0.0.1")
    except ValueError:
        raise InvalidValueError(f"address = {address!r}: must be an IPv4 address, such as 127.0.0.2") from None
    if control_port and not MIN_PORT <= control_port < 65536:
        raise InvalidValueError(
            f"control_port = {control_port}: must be from {MIN_PORT} to 65535, or 0 for a free one"
        )
    if not MIN_SCALE <= scale <= MAX_SCALE:
        raise InvalidValueError(f"time_scale = {scale:g}: must be from {MIN_SCALE:g} to {MAX_SCALE:g}")


def version_numbers(version: str) -> tuple[int, int, int, int]:
    """Return the four numbers of a version, 0 for those left out.

    Raises:
        InvalidValueError: If it is none of a controller.
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
