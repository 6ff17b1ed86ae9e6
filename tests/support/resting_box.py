"""A Net F/T box that shows a steady load: in a file of its own, for the process that emulates it imports it."""

from palpate.hw.emulators.host import Host
from palpate.hw.emulators.netft import BoxSettings, NetFtServer
from palpate.hw.emulators.simple_plant import steady_plant

BOX = "127.0.0.78"


def box_at_rest() -> Host:
    return Host(steady_plant((0.5, 0.0, -1.0, 0.0, 0.01, 0.0)), [NetFtServer(BoxSettings(BOX))])
