"""A live contact plot from a Net F/T.

Shows where a fingertip on an ATI Net F/T box is touched, as it happens, and how hard. Without an address the
script emulates a box whose fingertip a ball rolls round. At the end the plot is written to a file.

    python examples/live_netft.py --address 192.168.0.20
    python examples/live_netft.py --seconds 3
"""

import math
from contextlib import closing
from threading import Thread
from time import monotonic

import matplotlib.pyplot as plt
import tyro

import palpate as pp
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.netft import BoxSettings, NetFtServer
from palpate.hw.emulators.simple_plant import LoadPlant
from palpate.spatial import Wrench, cross

TIP = pp.Sphere(0.008, center=(0.0, 0.0, 0.012))  # radius, and middle in the sensor frame [m]
NOISE = (0.01, 0.01, 0.01, 1e-4, 1e-4, 1e-4)  # of a reading at rest [N, N m]


def rolling(time: float) -> Wrench:
    """Return the wrench [N, N m] of a ball that presses with 2 N and goes round once a second."""
    force = (-1.2 * math.cos(2.0 * math.pi * time), -1.2 * math.sin(2.0 * math.pi * time), -1.6)
    return (*force, *cross((0.0, 0.0, 0.012), force))


def main(address: str = "", seconds: float = math.inf, picture: str = "live_netft.png") -> None:
    """Show contacts as they happen, until the window is closed or the time is over [s]."""
    if not address:
        box = Host(LoadPlant(rolling), [NetFtServer(BoxSettings("127.0.0.77"))])
        Thread(target=box.run, daemon=True).start()
    figure, axes = plt.subplots(subplot_kw={"xlim": (-8, 8), "ylim": (-8, 8), "aspect": 1, "xlabel": "mm"})
    (trace,), places = axes.plot([], [], "o", alpha=0.4), []
    with closing(pp.NetFt(address or "127.0.0.77", pp.NetFtSettings(pp.StreamSettings(NOISE)))) as sensor:
        sensor.start()
        if address:
            sensor.tare()  # nothing may touch it yet
        end = monotonic() + seconds
        while monotonic() < end and plt.fignum_exists(figure.number):
            contact = pp.contact_from_wrench(TIP, sensor.read().wrench)
            places = [*places[-50:], 1e3 * contact.centroid[:2]]
            trace.set_data(*zip(*places, strict=True))
            axes.set_title(f"{contact.status.name}: {contact.normal_force:.2f} N")
            plt.pause(0.02)  # draws, and waits
    figure.savefig(picture)
    print(f"{sensor.counts.records} records, {sensor.counts.lost} lost; last {axes.get_title()}; {picture}")


if __name__ == "__main__":
    tyro.cli(main)
