"""`palpate emulate`: emulated devices in the foreground until Ctrl-C; one device, or those of a robot file."""

import os
from collections.abc import Sequence
from types import FrameType
from typing import assert_never

from rich.console import Console

from palpate.commands.command_result import CommandResult
from palpate.commands.devices.config import (
    EmulateConfig,
    EmulateDynamixelConfig,
    EmulateFaultConfig,
    EmulateNetftConfig,
    EmulateRobotConfig,
    EmulateUrConfig,
    version_numbers,
)
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
from palpate.runtime.progress import say

_TOKEN_VARIABLE = "PALPATE_CONTROL_TOKEN"
"""Environment variable with the token, for a program that chooses it, as it chooses the port."""

_MIN_TOKEN_LENGTH = 16
"""Least length of a token [characters]: 64 bits, if they are random hexadecimal digits."""

_START_POSITION = (-0.1333, 0.4919, 0.4879)
"""Position of the tip at the beginning, the arm's own base frame [m]: over the work place of a UR5e."""


def run_emulate(config: EmulateConfig) -> CommandResult:
    """Emulate devices until Ctrl-C or another signal that ends a process; return their description.

    Raises:
        InvalidValueError: If the device is impossible, an address is not free, there is no such fault or robot, or
            a device of the robot has no emulator.
    """
    console, servers = Console(), list[Server]()
    try:
        plant, about, faults = _opened(config, servers)
        for name, value in () if isinstance(config, EmulateRobotConfig) else config.fault:
            say(console, f"fault: {servers[0].inject(name, value)}")
        scale = 1.0 if isinstance(config, EmulateNetftConfig) else config.time_scale
        host = Host(plant, servers, scale, config.control_port, _chosen_token())
    except BaseException:
        for server in servers:
            server.close()
        raise
    about = about or [f"{name} at {address}" for name, address in host.addresses.items()]
    usage = ["DEVICE NAME VALUE; a wrong NAME lists those that exist"]
    if faults:
        usage = [f"{servers[0].name!r} NAME VALUE", f"  NAME: {', '.join(faults)}"]
    usage[0] = f"Faults: palpate emulate fault '{host.control_address}' {usage[0]}"
    facts = {"devices": host.addresses, "about": about, "control_port": host.control_port, "faults": faults}

    def stop(number: int, frame: FrameType | None) -> None:
        note(number)
        host.stop()

    with handling(stop):
        for line in (*about, *usage, "Runs until Ctrl-C."):
            say(console, line)
        host.run()
    return CommandResult(outcome="Ended.", facts=facts, shown=("Ended.",))


def run_fault(config: EmulateFaultConfig) -> CommandResult:
    """Switch a fault of an emulated device, and print and return the confirmation.

    Raises:
        InvalidValueError: If there is no emulator, or no such token, device or fault.
    """
    port, mark, token = config.address.partition(TOKEN_FOLLOWS)
    try:
        control = EmulatorControl(f"{port}{TOKEN_FOLLOWS}{token if mark else _chosen_token() or ''}")
    except OSError as error:
        raise InvalidValueError(
            f"port = {port}: no emulator is there ({error.strerror}); it prints its port when it begins"
        ) from None
    try:
        done = control.fault(config.device, config.fault, config.value)
    finally:
        control.close()
    facts = {"device": config.device, "fault": config.fault, "value": config.value}
    return CommandResult(outcome=done, facts=facts, shown=(done,))


def _opened(config: EmulateConfig, servers: list[Server]) -> tuple[Plant, list[str], Sequence[str]]:
    """Add the devices of a configuration, which listen, to `servers`.

    Returns:
        Mechanics that an arm and a hand among the devices move; how to connect to a device, empty for a robot;
        names of its faults.
    """
    match config:
        case EmulateUrConfig():
            version = ControllerVersion(*version_numbers(config.version))
            servers.append(UrServer(config.address, version))
            plane = None if config.plane is None else ElasticPlane(config.plane, config.stiffness)
            ports = "RTDE 30004, script 30003, dashboard 29999"
            about = f"UR controller {version} at {servers[0].address} ({ports}): connect to this address."
            return SimplePlant(SimpleTip(plane=plane)), [about], tuple(ControllerFault)
        case EmulateDynamixelConfig():
            if config.baud_rate not in BAUD_RATES:
                rates = ", ".join(map(str, BAUD_RATES))
                raise InvalidValueError(f"baud_rate = {config.baud_rate}: must be one of {rates}")
            kind = next(kind for kind in KINDS.values() if kind.servo.name == config.model)
            bus = [EmulatedServo(kind, i + 1, config.baud_rate) for i in range(config.servos)]
            servers.append(DynamixelBus(bus, link=config.link, seed=config.seed))
            ids = "id 1" if config.servos == 1 else f"ids 1 to {config.servos}"
            place = f"{config.model}, {ids}, at {servers[0].address}"
            wall = None if config.wall is None else ElasticWall(config.wall)
            plant = SimplePlant(servos=tuple(SimpleServo(wall=wall) for _ in bus))
            return plant, [f"{place}: open this terminal at {config.baud_rate} baud."], tuple(BusFault)
        case EmulateNetftConfig():
            about = _open_box(config, servers)
            return steady_plant(config.load), [about], [repr(fault.value) for fault in NetFtFault]
        case EmulateRobotConfig():
            return _open_robot(config, servers), [], ()
        case _:
            assert_never(config)


def _open_box(config: EmulateNetftConfig, servers: list[Server]) -> str:
    try:
        if config.make == "onrobot":
            servers.append(OnRobotServer(onrobot_box(config.address)))
            return f"OnRobot HEX at {config.address}, UDP port {RDT_PORT}."
        servers.append(NetFtServer(BoxSettings(config.address, rate=config.rate)))
    except OSError as error:
        raise InvalidValueError(
            f"address = {config.address!r}: cannot listen there ({error.strerror}); end what else listens, or "
            "take another address of 127.0.0.0/8"
        ) from None
    ports = f"UDP port {RDT_PORT}, calibration TCP port {CALIBRATION_PORT}"
    return f"ATI Net F/T box at {config.address}, {ports}: {config.rate:g} records per second."


def _open_robot(config: EmulateRobotConfig, servers: list[Server]) -> Plant:
    # only a robot file needs them: other devices listen sooner
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
    servers.extend(kind.emulator() for kind in (rig.arm, rig.hand) if kind is not None)
    for i, finger in enumerate(fingers):
        if finger.sensor_device is not None and not finger.sensor_device.in_arm:
            servers.append(finger.sensor_device.emulator(i))
    tip = SimpleTip(Pose(_START_POSITION), ElasticPlane(_START_POSITION[2] - config.above, config.stiffness))
    servos = () if rig.hand is None else tuple(SimpleServo() for _ in range(rig.hand.fingers))
    return SimplePlant(tip, servos, noise=[noise_of_finger(robot, i) for i in range(len(fingers))])


def _chosen_token() -> str | None:
    """Return the token of the environment, which other users cannot read, unlike options.

    Raises:
        InvalidValueError: If it is short enough to be guessed.
    """
    token = os.environ.get(_TOKEN_VARIABLE)
    if token is not None and len(token) < _MIN_TOKEN_LENGTH:
        raise InvalidValueError(
            f"{_TOKEN_VARIABLE}: {len(token)} characters can be guessed; take {_MIN_TOKEN_LENGTH} or more, or "
            "unset it"
        )
    return token
