"""What real arms, hands and sensors in robot files have in common: each may have an emulator."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from palpate.errors import InvalidValueError
from palpate.open_kinds import OpenKind, name_of_kind

if TYPE_CHECKING:  # a robot file is read without any driver
    from palpate.hw.emulators.server import Server


class DeviceKind(OpenKind):
    """Settings of a real device."""

    __slots__ = ()

    @property
    def files(self) -> Mapping[str, str]:
        """Paths of text files that it names: see `RobotKind.files`."""
        return {}

    def emulator(self, number: int = 0) -> "Server":
        """Return the same device, emulated, where its settings say that it is: see `palpate emulate robot`.

        An arm's is an `ArmServer`, a hand's a `ServoServer`.

        Args:
            number: Of a sensor: whose wrench of the plant it shows.

        Raises:
            InvalidValueError: It has no emulator, or its place is not free.
        """
        raise InvalidValueError(f"kind = {name_of_kind(self)}: it has no emulator; see DeviceKind.emulator")
