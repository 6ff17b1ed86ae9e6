"""Devices that conform and have no wire: what is broken in one of them is broken on purpose."""

import math
import random
from time import monotonic

from palpate.errors import InvalidValueError
from palpate.hw.devices import DeviceError, SensorReading
from palpate.kinematics.pose import rotation_from_rotvec
from palpate.runtime.data import ArmSample, HandSample
from palpate.spatial import ZERO

NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)
LOAD = (1.5, -2.0, 0.25, 0.01, -0.02, 0.03)
RATE = 500.0
"""Samples per second."""


class MadeUpDevice:
    name, up = "made-up device", False

    def start(self):
        self.up = True

    def close(self):
        self.up = False

    def sampled(self):
        """Number of the newest record, and when it was sampled."""
        if not self.up:
            raise DeviceError(self.name, "is not started", "call start() first")
        count = math.floor(monotonic() * RATE)
        return count, count / RATE


class LoadedSensor(MadeUpDevice):
    zero = (0.0,) * 6

    def read(self):
        count, time = self.sampled()
        return SensorReading(
            time, tuple(w - z for w, z in zip(self.wrench(count), self.zero, strict=True)), True, 0
        )

    def wrench(self, count):
        chance = random.Random(count)
        return tuple(mean + chance.gauss(0.0, sigma) for mean, sigma in zip(LOAD, NOISE, strict=True))

    def tare(self):
        self.zero = LOAD


class IdealArm(MadeUpDevice):
    position = angle = 0.0, 0.0, 0.0
    velocity = rate = ZERO
    turn = rotation_from_rotvec((0.0, 0.5 * math.pi, 0.0))  # of the tip against the base

    def start(self):
        super().start()
        self.since = self.sampled()[1]

    def close(self):
        self.velocity = self.rate = ZERO
        super().close()

    def move(self, velocity, rate):
        if len(velocity) != 3 or not all(map(math.isfinite, (*velocity, *rate))):
            raise InvalidValueError(f"velocity = {velocity}: must be three finite numbers [m/s]")
        self.read()
        self.velocity, self.rate = velocity, rate

    def read(self):
        now = self.sampled()[1]
        passed, self.since = now - self.since, now
        self.position = tuple(p + passed * v for p, v in zip(self.position, self.velocity, strict=True))
        self.angle = tuple(a + passed * w for a, w in zip(self.angle, self.rate, strict=True))
        return ArmSample(now, self.position, rotation_from_rotvec(self.angle), self.velocity, (), self.rate)


class IdealHand(MadeUpDevice):
    """Two fingers that close by 10 mm/s while they press, and take velocities."""

    fingers = 2

    def start(self):
        super().start()
        self.since, self.closed, self.forces = self.sampled()[1], [0.0] * self.fingers, (0.0,) * self.fingers

    def press(self, forces):
        if len(forces) != self.fingers or not all(0.0 <= force < math.inf for force in forces):
            raise InvalidValueError(f"grip_force = {forces}: must be {self.fingers} finite forces [N]")
        self.read()
        self.forces = forces

    def move(self, velocities):
        given = velocities or ()
        if len(given) not in (0, self.fingers) or not all(math.isfinite(sum(each)) for each in given):
            raise InvalidValueError(f"finger_velocity = {velocities}: must be {self.fingers} finite ones [m/s]")

    def read(self):
        now = self.sampled()[1]
        passed, self.since = now - self.since, now
        for i, force in enumerate(self.forces):
            self.closed[i] = self.closed[i] + 0.01 * passed if force > 0.0 else max(self.closed[i] - passed, 0.0)
        return HandSample(now, tuple(self.closed))
