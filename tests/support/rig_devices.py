"""Devices that are nothing but what a test says of them, and a diary of what was done to them."""

from time import monotonic

from palpate.hw.devices import DeviceError, SensorReading
from palpate.hw.rig.rig import UP
from palpate.kinematics.pose import Pose
from palpate.runtime.data import ArmSample, HandSample
from palpate.spatial import ZERO, rotate_back


class MadeUp:
    def __init__(self, name, diary, age=0.0):
        self.name, self.diary, self.age = name, diary, age
        self.faults, self.reported = {}, []

    def did(self, what, *values):
        self.diary.append((self.name, what, *values))
        if what in self.faults:
            raise self.faults[what]

    def start(self):
        self.did("start")

    def close(self):
        self.did("close")

    def time(self):
        self.reported.append(monotonic() - self.age)
        return self.reported[-1]

    def lose(self, *calls):
        for call in calls:
            self.faults[call] = DeviceError(self.name, "it is lost", "find it")


class MadeUpArm(MadeUp):
    def __init__(self, diary, pose=None, **given):
        super().__init__("arm", diary, **given)
        self.pose, self.twist = pose or Pose(), (ZERO, ZERO)

    def read(self):
        if "read" in self.faults:
            raise self.faults["read"]
        return ArmSample(self.time(), self.pose.position, self.pose.rotation, self.twist[0], (), self.twist[1])

    def move(self, velocity, angular):
        self.did("move", velocity, angular)
        self.twist = velocity, angular


class MadeUpHand(MadeUp):
    def __init__(self, diary, joints=(0.0, 0.0), **given):
        super().__init__("hand", diary, **given)
        self.joints = joints

    def read(self):
        if "read" in self.faults:
            raise self.faults["read"]
        return HandSample(self.time(), self.joints)

    def press(self, grip_force):
        self.did("press", grip_force)


class MadeUpSensor(MadeUp):
    """Shows its offset, the weight of what it carries in the arm's pose, and a load that a test sets."""

    def __init__(self, diary, arm=None, payload=None, offset=(0.0,) * 6, name="sensor", **given):
        super().__init__(name, diary, **given)
        self.arm, self.payload, self.offset = arm, payload, offset
        self.load, self.zero, self.healthy = (0.0,) * 6, (0.0,) * 6, True

    def wrench(self):
        weight = (0.0,) * 6
        if self.payload is not None:
            x, y, z = rotate_back(self.arm.pose.rotation, UP)
            (cx, cy, cz), m = self.payload.center_of_mass, self.payload.mass
            f = (-m * x, -m * y, -m * z)
            weight = (*f, cy * f[2] - cz * f[1], cz * f[0] - cx * f[2], cx * f[1] - cy * f[0])
        return tuple(o + w + v for o, w, v in zip(self.offset, weight, self.load, strict=True))

    def read(self):
        if "read" in self.faults:
            raise self.faults["read"]
        shown = tuple(w - z for w, z in zip(self.wrench(), self.zero, strict=True))
        return SensorReading(self.time(), shown, self.healthy, 0)

    def tare(self):
        self.did("tare")
        self.zero = self.wrench()
