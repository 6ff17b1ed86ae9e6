"""Emulated force/torque sensors on pseudo-terminals: Bota, Resense HEX."""

from palpate.hw.emulators.serial_ft.bota import BotaServer
from palpate.hw.emulators.serial_ft.resense import ResenseServer
from palpate.hw.emulators.serial_ft.terminal_server import SerialFault, TerminalServer

__all__ = ["BotaServer", "ResenseServer", "SerialFault", "TerminalServer"]
