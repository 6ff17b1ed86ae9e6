"""`palpate emulate robot`: the devices of a robot file, emulated where the file says that they are."""

from contextlib import ExitStack
from typing import cast

from rich.console import Console

from palpate.commands.command_result import CommandResult
from palpate.commands.emulate.config import EmulateRobotConfig
from palpate.commands.emulate.serving import chosen_token, how_to_switch, served
from palpate.errors import InvalidValueError
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.server import ArmServer, Server, ServoServer
from palpate.hw.emulators.simple_plant import ElasticPlane, SimplePlant, SimpleServo, SimpleTip
from palpate.kinematics.pose import Pose
from palpate.open_kinds import name_of_kind
from palpate.robots.finger_load import noise_of_finger
from palpate.robots.rig import RigEntry
from palpate.robots.robot import Robot
from palpate.robots.values import load_named_robot

PLACE = (-0.1333, 0.4919, 0.4879)
"""[m] Where the tip stands at the beginning, the arm's own base frame: over the work place of a UR5e."""


def run_emulate_robot(config: EmulateRobotConfig) -> CommandResult:
    """Emulate the devices of a robot until Ctrl-C or another signal that ends a process; returns what they were.

    Raises:
        InvalidValueError: There is no such robot, it is of another kind, a device has no emulator, or its address
            is not free.
    """
    robot = load_named_robot(config.robot)
    rig = robot.file.backend
    if not isinstance(rig, RigEntry):
        raise InvalidValueError(
            f"robot = {config.robot}: backend.kind = {name_of_kind(rig)} has no devices to emulate; give a robot "
            "file of kind rig"
        )
    plane = ElasticPlane(PLACE[2] - config.above, config.stiffness)
    servos = () if rig.hand is None else tuple(SimpleServo() for _ in range(rig.hand.fingers))
    noise = [noise_of_finger(robot, i) for i in range(len(robot.file.fingers))]
    plant = SimplePlant(SimpleTip(Pose(PLACE), plane), servos, noise=noise)
    with ExitStack() as opened:
        arm, hand, servers = _servers(robot, rig, opened)
        host = Host(
            plant,
            servers,
            arm=arm,
            hand=hand,
            scale=config.scale,
            control_port=config.control_port,
            control_token=chosen_token(),
        )
        opened.pop_all()  # the host closes them
    lines = [f"{name} at {address}" for name, address in host.addresses.items()]
    lines.append(
        how_to_switch(f"'{host.control_address}' DEVICE NAME VALUE; a wrong NAME lists those that there are")
    )
    facts = {"devices": host.addresses, "control_port": host.control_port}
    return served(Console(), host, lines, facts)


def _servers(
    robot: Robot, rig: RigEntry, opened: ExitStack
) -> tuple[ArmServer | None, ServoServer | None, list[Server]]:
    """Return the arm, the hand and all devices, which listen; `opened` closes them."""

    def listening(kept: Server) -> Server:
        opened.callback(kept.close)
        return kept

    # what an arm's or a hand's kind returns is one that moves the plant
    arm = None if rig.arm is None else cast("ArmServer", listening(rig.arm.emulator()))
    hand = None if rig.hand is None else cast("ServoServer", listening(rig.hand.emulator()))
    devices = [finger.sensor_device for finger in robot.file.fingers]
    sensors = [
        listening(each.emulator(i)) for i, each in enumerate(devices) if each is not None and not each.in_arm
    ]
    return arm, hand, [*(each for each in (arm, hand) if each is not None), *sensors]
