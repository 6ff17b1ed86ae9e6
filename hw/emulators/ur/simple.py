"""A whole emulated robot on the built-in plant, ready to be run in a process of its own."""

from dataclasses import dataclass, field

from palpate.hw.emulators.host import Host
from palpate.hw.emulators.simple_plant import SimplePlant
from palpate.hw.emulators.simple_tip import ElasticPlane, SimpleTip
from palpate.hw.emulators.ur.server import UrServer
from palpate.hw.emulators.ur.version import ControllerVersion


@dataclass(frozen=True, slots=True)
class SimpleUr:
    """What `EmulatorProcess` takes: called, it listens.

    Attributes:
        address: See `UrServer`.
        version: Of its software.
        plane: That the tip may touch; None for nothing.
        scale: Seconds of the robot per second of wall time.
        unlock_delay: See `UrServer`.
    """

    address: str = "127.0.0.2"
    version: ControllerVersion = field(default_factory=ControllerVersion)
    plane: ElasticPlane | None = None
    scale: float = 1.0
    unlock_delay: float = 5.0

    def __call__(self) -> Host:
        """Return a host that is ready to run."""
        server = UrServer(self.address, self.version, unlock_delay=self.unlock_delay)
        return Host(SimplePlant(SimpleTip(plane=self.plane)), [server], arm=server, scale=self.scale)
