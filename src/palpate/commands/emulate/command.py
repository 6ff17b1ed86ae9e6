"""`palpate emulate`: one emulated device in the foreground, until Ctrl-C."""

from rich.console import Console

from palpate.commands.command_result import CommandResult
from palpate.commands.emulate.config import (
    EmulateConfig,
    EmulateDynamixelConfig,
    EmulateFaultConfig,
    EmulateNetftConfig,
    EmulateUrConfig,
    version_numbers,
)
from palpate.commands.emulate.serving import chosen_token, how_to_switch, served
from palpate.commands.say import say
from palpate.errors import InvalidValueError
from palpate.hw.dynamixel.registers import BAUD_RATES, KINDS
from palpate.hw.emulators.control import TOKEN_FOLLOWS, EmulatorControl
from palpate.hw.emulators.dynamixel.bus import DynamixelBus
from palpate.hw.emulators.dynamixel.faults import BusFault
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.netft import BoxSettings, NetFtFault, NetFtServer, OnRobotServer, onrobot_box
from palpate.hw.emulators.server import Server
from palpate.hw.emulators.simple_plant import (
    ElasticPlane,
    ElasticWall,
    LoadPlant,
    SimplePlant,
    SimpleServo,
    SimpleTip,
    steady_plant,
)
from palpate.hw.emulators.ur.faults import ControllerFault
from palpate.hw.emulators.ur.server import UrServer
from palpate.hw.emulators.ur.version import ControllerVersion
from palpate.hw.netft.rdt import CALIBRATION_PORT, RDT_PORT

PORTS = "RTDE 30004, script 30003, dashboard 29999"


def run_emulate(config: EmulateConfig) -> CommandResult:
    """Emulate a device until Ctrl-C or another signal that ends a process; returns what it was.

    Raises:
        InvalidValueError: It cannot be, its address is not free, or there is no such fault.
    """
    console = Console()
    server, instructions, faults = _device(config)
    plant, scale = _plant(config), 1.0 if isinstance(config, EmulateNetftConfig) else config.scale
    try:
        for name, value in config.fault:
            say(console, f"fault: {server.inject(name, value)}")
        host = Host(
            plant,
            [server],
            arm=server if isinstance(server, UrServer) else None,
            hand=server if isinstance(server, DynamixelBus) else None,
            scale=scale,
            control_port=config.control_port,
            control_token=chosen_token(),
        )
    except BaseException:
        server.close()
        raise
    facts = {"device": server.name, "about": instructions, "control_port": host.control_port, "faults": faults}
    how = f"'{host.control_address}' {server.name!r} NAME VALUE"
    return served(console, host, (instructions, how_to_switch(how), f"  NAME: {', '.join(faults)}"), facts)


def run_fault(config: EmulateFaultConfig) -> CommandResult:
    """Switch a fault of a device that is being emulated, and print and return what was done.

    Raises:
        InvalidValueError: Nobody emulates anything there, or there is no such token, device or fault.
    """
    port, mark, token = config.address.partition(TOKEN_FOLLOWS)
    try:
        controls = EmulatorControl(f"{port}{TOKEN_FOLLOWS}{token if mark else chosen_token() or ''}")
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


def _device(config: EmulateConfig) -> tuple[Server, str, tuple[str, ...]]:
    """Return the device, how to connect to it, and its faults."""
    match config:
        case EmulateUrConfig():
            version = ControllerVersion(*version_numbers(config.version))
            arm = UrServer(config.address, version)
            instructions = f"UR controller {version} at {arm.address} ({PORTS}): connect to this address."
            return arm, instructions, tuple(ControllerFault)
        case EmulateDynamixelConfig():
            if config.baud_rate not in BAUD_RATES:
                rates = ", ".join(map(str, BAUD_RATES))
                raise InvalidValueError(f"baud_rate = {config.baud_rate}: must be one of {rates}")
            kind = next(its for its in KINDS.values() if its.servo.name == config.model)
            servos = [EmulatedServo(kind, i + 1, config.baud_rate) for i in range(config.servos)]
            bus = DynamixelBus(servos, link=config.link, seed=config.seed)
            ids = "id 1" if config.servos == 1 else f"ids 1 to {config.servos}"
            instructions = (
                f"{config.model}, {ids}, at {bus.address}: open this terminal at {config.baud_rate} baud."
            )
            return bus, instructions, tuple(BusFault)
        case EmulateNetftConfig():
            return _box(config)


def _box(config: EmulateNetftConfig) -> tuple[Server, str, tuple[str, ...]]:
    faults = tuple(repr(fault.value) for fault in NetFtFault)
    try:
        if config.make == "onrobot":
            hex_box = OnRobotServer(onrobot_box(config.address))
            return hex_box, f"OnRobot HEX at {config.address}, UDP port {RDT_PORT}.", faults
        box = NetFtServer(BoxSettings(config.address, rate=config.rate))
    except OSError as error:
        raise InvalidValueError(
            f"address = {config.address!r}: cannot listen there ({error.strerror}); end what else listens, or "
            "take another address of 127.0.0.0/8"
        ) from None
    ports = f"UDP port {RDT_PORT}, calibration TCP port {CALIBRATION_PORT}"
    return box, f"ATI Net F/T box at {config.address}, {ports}: {config.rate:g} records per second.", faults


def _plant(config: EmulateConfig) -> SimplePlant | LoadPlant:
    match config:
        case EmulateUrConfig():
            plane = None if config.plane is None else ElasticPlane(config.plane, config.stiffness)
            return SimplePlant(SimpleTip(plane=plane))
        case EmulateDynamixelConfig():
            wall = None if config.wall is None else ElasticWall(config.wall)
            return SimplePlant(servos=tuple(SimpleServo(wall=wall) for _ in range(config.servos)))
        case EmulateNetftConfig():
            return steady_plant(config.load)
