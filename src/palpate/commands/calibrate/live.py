"""Readings at rest from a back end, to tare a sensor with."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from palpate.commands.calibrate.config import TareConfig
from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime import Backend, Command, Pacer, Sample, WrenchSample
from palpate.runtime.wrapped_backend import WrappedBackend
from palpate.sensing.ft import SensorFile
from palpate.spatial import Vector, Wrench

LEAST_TIP_MASS = 1e-6
"""[kg] of a simulated tip when the sensor file names no payload; a simulated body needs some. It weighs 10 uN."""


STAGE_PERIOD = 1e-3
"""Control period of the simulated stage [s]."""


SETTLE_TIME = 0.2
"""[s] that a back end stands still before readings count: 20 time constants of the stage's servos."""


STANDING = Command()
"""No velocity."""


def take_readings(backend: Backend, duration: float) -> tuple[FloatArray, Vector]:
    """Return what the first sensor of a back end shows while standing still; the back end is closed at the end.

    Args:
        backend: Simulated or real.
        duration: How long [s], after `SETTLE_TIME`.

    Returns:
        Wrenches as the device gives them, shape (n, 6) [N, N m], and the mean specific force [m/s^2], both in the
        sensor frame. A sample that the device had not renewed since the period before counts once.

    Raises:
        InvalidValueError: The back end has no sensor, or no new reading.
    """
    taken: list[WrenchSample] = []
    with backend, _started(backend.pacer):
        sample = backend.start()
        if not sample.wrenches:
            raise InvalidValueError("the back end has no force/torque sensor")
        for _ in range(math.ceil(SETTLE_TIME / backend.period)):
            sample = backend.step(STANDING)
        before = sample.wrenches[0].time
        for _ in range(math.ceil(duration / backend.period)):
            reading = backend.step(STANDING).wrenches[0]
            if reading.time != before:
                taken.append(reading)
            before = reading.time
    if not taken:
        raise InvalidValueError(f"the sensor gave no new reading in {duration:g} s")
    x, y, z = np.mean([reading.acceleration for reading in taken], axis=0).tolist()
    return np.array([reading.wrench for reading in taken]), (x, y, z)


@contextmanager
def _started(pacer: Pacer) -> Iterator[None]:
    pacer.start()
    try:
        yield
    finally:
        pacer.stop()


class BiasedBackend(WrappedBackend[Backend]):
    """A back end whose first sensor shows a bias: to try out whether a tare finds it."""

    def __init__(self, backend: Backend, bias: Wrench) -> None:
        """Take a back end and what to add to the first sensor's wrench [N, N m]."""
        super().__init__(backend)
        self._bias = bias

    def start(self) -> Sample:
        """Start, and return the first sample."""
        return self._biased(super().start())

    def step(self, command: Command) -> Sample:
        """Apply `command` for one period."""
        return self._biased(super().step(command))

    def _biased(self, sample: Sample) -> Sample:
        first, *others = sample.wrenches
        a, b, c, d, e, f = (x + y for x, y in zip(first.wrench, self._bias, strict=True))
        shown = WrenchSample(first.time, (a, b, c, d, e, f), first.acceleration)
        return Sample(sample.time, sample.arm, (shown, *others))


@contextmanager
def robot_backend(name: str) -> Iterator[Backend]:
    """Give the devices of a robot, as they are, nothing tared; an emulated one's emulators run meanwhile.

    Args:
        name: Of a robot with real or emulated devices.

    Raises:
        InvalidValueError: There is no such robot, it has no devices, or its first sensor gives raw channels.
        DeviceError: Emulators do not come up.
    """
    # imported here: clients of devices take a second that the other tasks need not wait for
    from palpate.robots.rig import assembled
    from palpate.robots.values import named_devices

    with named_devices(name) as robot:
        rig = assembled(robot, robot.file.period)
        if not rig.fingers[0].gives_wrenches:
            raise InvalidValueError(
                f"robot = {name}: its sensor file calibrates raw channels, which are not tared here; give "
                "--readings, with columns raw_0, raw_1, ..."
            )
        yield rig


def stage_backend(config: TareConfig, sensor: SensorFile) -> Backend:
    """Return the simulated stage, above an object, with the payload and the noise of the sensor file.

    Raises:
        InvalidValueError: The stage cannot carry that payload.
    """
    # imported here: the simulator takes a second that the other tasks need not wait for
    from palpate.sim import ContactLaw, MujocoBackend, SphereObject, Tip, build_scene, white_noise
    from palpate.surfaces import Sphere

    radius, clearance = 0.008, 0.01
    center = sensor.payload.center_of_mass
    tip = Tip(Sphere(radius, center=np.array(center)), max(sensor.payload.mass, LEAST_TIP_MASS))
    target = SphereObject(0.04)
    height = target.top + radius + clearance + abs(center[2])
    law = ContactLaw(stiffness=20e3, friction=0.3, spin_length=0.004, smallest_force=0.2)
    force = max(sensor.noise_force) if config.force_noise is None else config.force_noise
    moment = max(sensor.noise_moment) if config.moment_noise is None else config.moment_noise
    scene = build_scene(tip, target, law, (0.0, 0.0, height))
    backend = MujocoBackend(scene, STAGE_PERIOD, white_noise(force, moment, config.seed))
    return BiasedBackend(backend, config.unknown_bias) if config.unknown_bias else backend
