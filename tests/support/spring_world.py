"""A tip that moves as commanded on a solid given by its signed distance, which pushes back like a spring."""

import math
from dataclasses import replace

import numpy as np

from palpate.runtime.data import ArmSample, Sample, WrenchSample
from palpate.runtime.live import ScheduledChanges
from palpate.runtime.touch import Finger, Touch
from palpate.spatial import IDENTITY, ZERO, norm
from palpate.surfaces import Sphere

PERIOD, RADIUS, STIFFNESS = 2e-3, 0.004, 20e3


class SpringWorld:
    """Where {distance <= 0} is solid; `hold` may keep the tip from moving as commanded."""

    def __init__(self, distance, start, frame=IDENTITY, hold=lambda position, move: move, period=PERIOD, delays=0):
        """Take the solid and the start of the tip, both in the frame of the solid.

        Args:
            distance: Function of a point to its signed distance [m].
            start: Position of the tip [m].
            frame: Rotation from the solid to the base.
            hold: Function of position and wanted motion to the motion [m].
            period: Of control [s].
            delays: Number of periods after which a command acts.
        """
        self.distance, self.frame, self.hold, self.period = distance, np.array(frame), hold, period
        self.position, self.time, self.underway = np.array(start, float), 0.0, [ZERO] * delays

    def force(self):
        """Force on the tip in the frame of the solid [N]."""
        d = self.distance(self.position)
        if d >= RADIUS:
            return np.zeros(3)
        steps = 1e-7 * np.eye(3)
        out = np.array([self.distance(self.position + s) - self.distance(self.position - s) for s in steps])
        return STIFFNESS * (RADIUS - d) * out / np.linalg.norm(out)

    def sample(self):
        f, p = (tuple((self.frame @ x).tolist()) for x in (self.force(), self.position))
        wrench = WrenchSample(self.time, (*f, 0.0, 0.0, 0.0), ZERO)
        return Sample(self.time, ArmSample(self.time, p, IDENTITY, ZERO), (wrench,))

    def move(self, velocity):
        self.underway.append(velocity)
        way = self.period * self.frame.T @ np.array(self.underway.pop(0))
        self.position = self.position + self.hold(self.position, way)
        self.time += self.period


class Plane(SpringWorld):
    """A plane through the origin, tilted about y, under a tip that starts at (x, y), a gap above it.

    It vanishes at the times `gone`; `change` maps time and force to the force that is sensed.
    """

    def __init__(self, tilt, corner, gap=0.001, gone=lambda time: False, change=lambda time, force: force, **more):
        self.out, self.change, (x, y) = np.array([math.sin(tilt), 0.0, math.cos(tilt)]), change, corner
        start = (x, y, (RADIUS + gap - x * self.out[0]) / self.out[2])
        super().__init__(lambda p: p @ self.out + 1.0 * gone(self.time), start, **more)

    def sample(self):
        sample = super().sample()
        force = tuple(np.array(self.change(self.time, np.array(sample.wrenches[0].wrench[:3]))).tolist())
        return replace(sample, wrenches=(WrenchSample(self.time, (*force, 0.0, 0.0, 0.0), ZERO),))


class Script:
    """A strategy of given legs that remembers how they ended and all contacts."""

    def __init__(self, plane, *legs, until=lambda felt: False):
        self.plane, self.wanted, self.until, self.marks = plane, legs, until, ()

    def start(self):
        self.left, self.ends, self.felt = list(self.wanted), [], []

    def feel(self, felt):
        self.felt.append(felt)
        return self.until(felt)

    def next(self, ended):
        self.ends += [] if ended is None else [ended]
        return self.left.pop(0) if self.left else None

    @property
    def how(self):
        return [ended.how for ended in self.ends]


class Explored:
    """A run of an `ExploreController` in a world, row by row, in the frame of the solid.

    In every run the commanded velocity changes no faster than the slew limit, and a final phase is at rest.
    """

    def __init__(self, controller, world, seconds=20.0, changes=()):
        touch, self.controller = Touch(Finger(Sphere(RADIUS))), controller
        scheduled = ScheduledChanges(controller.live, changes)
        self.observations, self.commands, self.changes, self.values, positions = [], [], [], [], []
        controller.start(touch.sense(world.sample()))
        for _ in range(round(seconds / world.period)):
            now = touch.sense(world.sample())
            self.changes += scheduled.step(now.time)
            self.observations.append(now)
            self.commands.append(controller.step(now))
            self.values.append(controller.live.values)
            positions.append(world.position)
            if self.commands[-1].phase.is_final:
                break
            world.move(self.commands[-1].velocity_base_tip)
        self.names = [command.phase for command in self.commands]
        self.position = np.array(positions)
        self.velocity = np.array([command.velocity_base_tip for command in self.commands]) @ world.frame
        self.force = np.array([norm(now.fingers[0].wrench[:3]) for now in self.observations])
        self.touching = np.array([now.fingers[0].touching for now in self.observations])
        self.jumps = np.linalg.norm(np.diff(self.velocity, axis=0, prepend=np.zeros((1, 3))), axis=1)
        assert self.jumps.max() <= controller._parameters.slew * world.period * (1 + 1e-9)
        assert not self.names[-1].is_final or not self.velocity[-1].any()

    @property
    def phases(self):
        return [p for i, p in enumerate(self.names) if i == 0 or p is not self.names[i - 1]]

    def at(self, phase):
        return np.array([name is phase for name in self.names])
