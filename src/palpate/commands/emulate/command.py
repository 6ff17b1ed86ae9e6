"""`palpate emulate`: emulated devices in the foreground until Ctrl-C; one device, or those of a robot file."""

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from types import FrameType

from rich.console import Console

from palpate.commands.command_result import CommandResult
from palpate.commands.emulate.config import (
    EmulateConfig,
    EmulateDynamixelConfig,
    EmulateFaultConfig,
    EmulateNetftConfig,
    EmulateRobotConfig,
    EmulateUrConfig,
    version_numbers,
)
from palpate.commands.say import say
from palpate.errors import InvalidValueError
from palpate.hw.dynamixel.registers import BAUD_RATES, KINDS
from palpate.hw.emulators.control import TOKEN_FOLLOWS, EmulatorControl
from palpate.hw.emulators.dynamixel.bus import BusFault, DynamixelBus
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.netft import BoxSettings, NetFtFault, NetFtServer, OnRobotServer, onrobot_box
from palpate.hw.emulators.server import Plant, Server
from palpate.hw.emulators.simple_plant import (
    ElasticPlane,
    ElasticWall,
    SimplePlant,
    SimpleServo,
    SimpleTip,
    steady_plant,
)
from palpate.hw.emulators.ur import ControllerFault, ControllerVersion, UrServer
from palpate.hw.netft.rdt import CALIBRATION_PORT, RDT_PORT
from palpate.interruption import handling, note
from palpate.kinematics.pose import Pose
from palpate.open_kinds import name_of_kind

TOKEN_VARIABLE = "PALPATE_CONTROL_TOKEN"
"""Environment variable with the token, for a program that chooses it, as it chooses the port."""

MIN_TOKEN_LENGTH = 16
"""Characters: 64 bits, if they are random hexadecimal digits."""

START = (-0.1333, 0.4919, 0.4879)
"""Position of the tip at the beginning, the arm's own base frame [m]: over the work place of a UR5e."""

PORTS = "RTDE 30004, script 30003, dashboard 29999"


def run_emulate(config: EmulateConfig) -> CommandResult:
    """Emulate a device until Ctrl-C or another signal that ends a process; return its description.

    Raises:
        InvalidValueError: If the device is impossible, its address is not free, or there is no such fault.
    """
    with ExitStack() as opened:
        server, plant, about, faults = _device(config)
        opened.callback(server.close)
        for name, value in config.fault:
            say(Console(), f"fault: {server.inject(name, value)}")
        host = _host(config, plant, [server])
        opened.pop_all()  # the host closes the device
    facts = {"device": server.name, "about": about, "control_port": host.control_port, "faults": faults}
    usage = f"{server.name!r} NAME VALUE"
    return _served(host, facts, [about], usage, f"  NAME: {', '.join(faults)}")


def run_emulate_robot(config: EmulateRobotConfig) -> CommandResult:
    """Emulate the devices of a robot until Ctrl-C or another signal that ends a process; return their addresses.

    Raises:
        InvalidValueError: If there is no such robot, it is of another kind, a device has no emulator, or its
            address is not free.
    """
    from palpate.robots.finger_load import noise_of_finger
    from palpate.robots.rig import RigEntry
    from palpate.robots.values import load_named_robot

    robot = load_named_robot(config.robot)
    rig, fingers = robot.file.backend, robot.file.fingers
    if not isinstance(rig, RigEntry):
        raise InvalidValueError(
            f"robot = {config.robot}: backend.kind = {name_of_kind(rig)} has no devices to emulate; give a robot "
            "file of kind rig"
        )
    plane = ElasticPlane(START[2] - config.above, config.stiffness)
    servos = () if rig.hand is None else tuple(SimpleServo() for _ in range(rig.hand.fingers))
    noise = [noise_of_finger(robot, i) for i in range(len(fingers))]
    sensors = [finger.sensor_device for finger in fingers]
    emulators: list[Callable[[], Server]] = [kind.emulator for kind in (rig.arm, rig.hand) if kind is not None]
    separate = [(i, kind) for i, kind in enumerate(sensors) if kind is not None and not kind.in_arm]
    emulators += [partial(kind.emulator, i) for i, kind in separate]
    with ExitStack() as opened:
        servers = []
        for emulator in emulators:
            servers.append(emulator())
            opened.callback(servers[-1].close)
        host = _host(config, SimplePlant(SimpleTip(Pose(START), plane), servos, noise=noise), servers)
        opened.pop_all()  # the host closes the devices
    facts = {"devices": host.addresses, "control_port": host.control_port}
    places = [f"{name} at {address}" for name, address in host.addresses.items()]
    return _served(host, facts, places, "DEVICE NAME VALUE; a wrong NAME lists those that there are")


def run_fault(config: EmulateFaultConfig) -> CommandResult:
    """Switch a fault of an emulated device, and print and return the confirmation.

    Raises:
        InvalidValueError: If there is no emulator, or no such token, device or fault.
    """
    port, mark, token = config.address.partition(TOKEN_FOLLOWS)
    try:
        controls = EmulatorControl(f"{port}{TOKEN_FOLLOWS}{token if mark else _chosen_token() or ''}")
    except OSError as error:
        raise InvalidValueError(
            f"port = {port}: no emulator is there ({error.strerror}); it prints its port when it begins"
        ) from None
    try:
        done = controls.fault(config.device, config.fault, config.value)
    finally:
        controls.close()
    Console(soft_wrap=True, highlight=False).print(done)
    return CommandResult(
        outcome=done, facts={"device": config.device, "fault": config.fault, "value": config.value}
    )


def _device(config: EmulateConfig) -> tuple[Server, Plant, str, tuple[str, ...]]:
    """Return the device, its plant, how to connect to it, and its faults."""
    match config:
        case EmulateUrConfig():
            version = ControllerVersion(*version_numbers(config.version))
            arm = UrServer(config.address, version)
            plane = None if config.plane is None else ElasticPlane(config.plane, config.stiffness)
            about = f"UR controller {version} at {arm.address} ({PORTS}): connect to this address."
            return arm, SimplePlant(SimpleTip(plane=plane)), about, tuple(ControllerFault)
        case EmulateDynamixelConfig():
            if config.baud_rate not in BAUD_RATES:
                rates = ", ".join(map(str, BAUD_RATES))
                raise InvalidValueError(f"baud_rate = {config.baud_rate}: must be one of {rates}")
            kind = next(its for its in KINDS.values() if its.servo.name == config.model)
            servos = [EmulatedServo(kind, i + 1, config.baud_rate) for i in range(config.servos)]
            bus = DynamixelBus(servos, link=config.link, seed=config.seed)
            wall = None if config.wall is None else ElasticWall(config.wall)
            ids = "id 1" if config.servos == 1 else f"ids 1 to {config.servos}"
            about = f"{config.model}, {ids}, at {bus.address}: open this terminal at {config.baud_rate} baud."
            plant = SimplePlant(servos=tuple(SimpleServo(wall=wall) for _ in range(config.servos)))
            return bus, plant, about, tuple(BusFault)
        case EmulateNetftConfig():
            box, about = _box(config)
            return box, steady_plant(config.load), about, tuple(repr(fault.value) for fault in NetFtFault)


def _box(config: EmulateNetftConfig) -> tuple[NetFtServer, str]:
    try:
        if config.make == "onrobot":
            hex_box = OnRobotServer(onrobot_box(config.address))
            return hex_box, f"OnRobot HEX at {config.address}, UDP port {RDT_PORT}."
        box = NetFtServer(BoxSettings(config.address, rate=config.rate))
    except OSError as error:
        raise InvalidValueError(
            f"address = {config.address!r}: cannot listen there ({error.strerror}); end what else listens, or "
            "take another address of 127.0.0.0/8"
        ) from None
    ports = f"UDP port {RDT_PORT}, calibration TCP port {CALIBRATION_PORT}"
    return box, f"ATI Net F/T box at {config.address}, {ports}: {config.rate:g} records per second."


def _host(config: EmulateConfig | EmulateRobotConfig, plant: Plant, servers: Sequence[Server]) -> Host:
    """Return the host of devices that listen: an arm and a hand among them move the plant."""
    return Host(
        plant,
        servers,
        scale=1.0 if isinstance(config, EmulateNetftConfig) else config.scale,
        control_port=config.control_port,
        control_token=_chosen_token(),
    )


def _served(
    host: Host, facts: Mapping[str, object], places: Sequence[str], usage: str, *more: str
) -> CommandResult:
    """Print how to use the devices, and serve them until a signal that ends a process."""
    console = Console()

    def stop(number: int, frame: FrameType | None) -> None:
        note(number)
        host.stop()

    with handling(stop):
        faults = f"Faults: palpate emulate fault '{host.control_address}' {usage}"
        for line in (*places, faults, *more, "Runs until Ctrl-C."):
            say(console, line)
        host.run()
    say(console, "Ended.")
    return CommandResult(outcome="Ended.", facts=facts)


def _chosen_token() -> str | None:
    """Return the token of the environment, which other users cannot read, unlike options.

    Raises:
        InvalidValueError: If it is short enough to be guessed.
    """
    token = os.environ.get(TOKEN_VARIABLE)
    if token is not None and len(token) < MIN_TOKEN_LENGTH:
        raise InvalidValueError(
            f"{TOKEN_VARIABLE}: {len(token)} characters can be guessed; take {MIN_TOKEN_LENGTH} or more, or "
            "unset it"
        )
    return token
