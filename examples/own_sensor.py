"""A force/torque sensor of one's own, named in a robot file.

The sensor sends a line of text per reading: forces [N] and moments [N mm]. The script plays it on a
pseudo-terminal, writes a robot file that names the class `TextSensor`, and reads that as every command does.

    python examples/own_sensor.py
    palpate robot check own_sensor.yaml
"""

import os
import tty
from contextlib import closing
from pathlib import Path
from threading import Thread
from time import sleep

import tyro

import palpate as pp
from palpate.hw.ft_stream.link import StreamReading
from palpate.hw.ft_stream.sample_clock import StreamClock
from palpate.hw.serial_ft.serial_sensor import SerialSensor
from palpate.robots.device_settings import DeviceSettings
from palpate.robots.rig import parts_of
from palpate.robots.robot import load_robot
from palpate.robots.sensor_kind import SensorKind, SensorPlace


class TextLines:
    """What it says on its line: see `palpate.hw.serial_ft.line.Make`."""

    title, baud = "text sensor", 115_200

    def begin(self, line, counts):
        self.rest, self.counts, self.count, self.clock = b"", counts, 0, StreamClock()

    def records(self, data, arrival):
        *lines, self.rest = (self.rest + data).split(b"\n")
        readings = []
        for line in lines:
            try:
                fx, fy, fz, mx, my, mz = map(float, line.split(b","))
            except ValueError:  # cut off, or garbled
                self.counts.refused += 1
                continue
            wrench = (fx, fy, fz, 1e-3 * mx, 1e-3 * my, 1e-3 * mz)
            self.count += 1  # it sends no time
            readings.append(StreamReading(arrival, self.clock.stamp(self.count, arrival), wrench, 0))
        self.counts.records += len(readings)
        return readings

    def problem(self, status):
        return ""


class TextSensor(SensorKind, DeviceSettings, frozen=True, kw_only=True):
    """Its settings: the path of its terminal."""

    path: str

    def device(self, finger: SensorPlace) -> SerialSensor:
        return SerialSensor(self.path, TextLines(), pp.StreamSettings(finger.noise, silent_after=0.5))


ROBOT = """palpate_robot: 1
name: a bench with a sensor of my own
backend: {{kind: rig, tare_at_start: false}}
period_s: 0.002
pace: {{kind: real_time}}
fingers:
  - surface: {{kind: sphere, radius_m: 0.008}}
    payload: {{mass_kg: 0}}
    noise: {{force_N: 0.01, moment_Nm: 0.0001}}
    sensor_device: {{kind: "{file}:TextSensor", path: {terminal}}}
"""


def stream(wire: int, line: bytes) -> None:
    for _ in range(1500):
        os.write(wire, line)
        sleep(2e-3)


def main(force: float = 2.0, out: Path = Path("own_sensor.yaml")) -> None:
    """Press on the tip from the side with a force [N]; the robot file is kept."""
    wire, terminal = os.openpty()
    tty.setraw(terminal)
    Thread(
        target=lambda: [os.write(wire, b"%g,0,0,0,0,0\n" % -force) for _ in range(1500) if not sleep(2e-3)]
    ).start()
    out.write_text(ROBOT.format(file=Path(__file__).resolve(), terminal=os.ttyname(terminal)), encoding="utf-8")
    robot = load_robot(str(out))
    with closing(parts_of(robot).sensors[0].device) as sensor:
        sensor.start()
        contact = pp.contact_from_wrench(robot.file.fingers[0].surface.surface(), sensor.read().wrench)
    print(f"{contact.status.name}: {contact.normal_force:.2f} N at x = {1e3 * contact.centroid[0]:.1f} mm")


if __name__ == "__main__":
    tyro.cli(main)
