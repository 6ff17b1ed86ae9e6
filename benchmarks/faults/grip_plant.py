"""Object held by friction between two fingers of a hand on an arm, and a rig that lifts it."""

import math

from faults.fault_rig import FaultyBackend, Rig
from palpate.runtime.data import ArmSample, Command, HandSample, Phase, Sample, WrenchSample
from palpate.runtime.pacing import SimulatedTime
from palpate.runtime.supervision import Limits
from palpate.runtime.touch import Finger, Touch
from palpate.spatial import IDENTITY, Vector, cross
from palpate.surfaces import Sphere

GRAVITY = 9.80665
TIP_RADIUS = 0.01
"""Of both fingertips, spheres about the origins of their sensor frames [m]."""


class GripPlant:
    """Two fingers squeeze an object along x; Coulomb friction carries it.

    The grip follows what was commanded last, and the arm its velocity, with first-order lags. The object sticks to
    the fingers while the friction that its weight and acceleration ask for is below 2 mu F, and slides down
    between them otherwise. A hand whose process went silent keeps its last grip: so do those that people build.

    Attributes:
        fallen: How far the object has slid down between the fingers [m].
        grip: Of each finger [N].
    """

    mass = 0.25  # kg
    friction = 0.5
    grip_lag = 0.02  # s
    arm_lag = 0.02  # s
    period = 1e-3
    substeps = 4

    def __init__(self, grip: float) -> None:
        """The object is held already, with a grip [N]."""
        self.pacer = SimulatedTime()
        self.commands: list[Command] = []
        self.grip = self._wanted = grip
        self.fallen = self._sliding = 0.0
        self._height = self._speed = self._acceleration = 0.0
        self._carried = self.mass * GRAVITY

    @property
    def least_grip(self) -> float:
        """With which the object just stays [N]."""
        return self.mass * GRAVITY / (2.0 * self.friction)

    def start(self) -> Sample:
        return self._sample()

    def step(self, command: Command) -> Sample:
        self.commands.append(command)
        if command.grip_force is not None:
            self._wanted = min(command.grip_force)
        self._move(command.velocity_base_tip[2])
        return self._sample()

    def coast(self, duration: float) -> None:
        """Go on without commands: the arm stands still, the hand keeps its last grip."""
        for _ in range(round(duration / self.period)):
            self._move(0.0)

    def close(self) -> None:
        """The arm stops by itself: see `coast`."""

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        self.close()

    def _move(self, velocity: float) -> None:
        dt = self.period / self.substeps
        for _ in range(self.substeps):
            self.grip += (self._wanted - self.grip) * dt / self.grip_lag
            self._acceleration = (velocity - self._speed) / self.arm_lag
            self._speed += self._acceleration * dt
            self._height += self._speed * dt
            self._slide(dt)

    def _slide(self, dt: float) -> None:
        needed = self.mass * (GRAVITY + self._acceleration)  # to be carried along by the fingers
        most = 2.0 * self.friction * self.grip
        if self._sliding == 0.0 and abs(needed) <= most:
            self._carried = needed
            return
        direction = math.copysign(1.0, self._sliding if self._sliding else needed)
        self._carried = most * direction
        before = self._sliding
        self._sliding += (needed - self._carried) / self.mass * dt
        if before * self._sliding < 0.0:  # Coulomb friction brings it to rest, not back
            self._sliding = 0.0
        self.fallen += self._sliding * dt

    def _sample(self) -> Sample:
        time = len(self.commands) * self.period
        position: Vector = (0.0, 0.0, self._height)
        velocity: Vector = (0.0, 0.0, self._speed)
        arm = ArmSample(time, position, IDENTITY, velocity, (0.0, 0.0))
        shear = -0.5 * self._carried
        fingers = []
        for side in (1.0, -1.0):
            force: Vector = (-side * self.grip, 0.0, shear)
            moment = cross((side * TIP_RADIUS, 0.0, 0.0), force)
            fingers.append(WrenchSample(time, (*force, *moment), (0.0, 0.0, GRAVITY)))
        return Sample(time, arm, tuple(fingers), HandSample(time, (0.01,)))


GRIP = 3.0
"""Grip of each finger [N]: a fifth more than the object needs."""
LIFTING = Command((0.0, 0.0, 0.01), Phase.HOLD, (GRIP, GRIP))


class Lift:
    """Controller that holds and lifts."""

    def start(self, first):
        pass

    def step(self, now):
        return LIFTING


def holding_rig() -> Rig:
    touch = Touch(*[Finger(Sphere(TIP_RADIUS))] * 2)
    return Rig(FaultyBackend(GripPlant(GRIP)), touch, Lift(), Limits(), duration=0.4)
