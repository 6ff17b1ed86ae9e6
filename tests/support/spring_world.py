"""A tip that moves as commanded on a solid given by its signed distance, which pushes back like a spring."""

import numpy as np

from palpate.runtime.data import ArmSample, Sample, WrenchSample
from palpate.runtime.touch import Finger, Touch
from palpate.spatial import IDENTITY, ZERO, norm, rotate_back
from palpate.surfaces import Sphere

PERIOD, RADIUS, STIFFNESS = 2e-3, 0.004, 20e3


class SpringWorld:
    """Where {distance <= 0} is solid; `hold` may keep the tip from moving as it is told."""

    def __init__(self, distance, start, frame=IDENTITY, hold=lambda position, move: move, period=PERIOD):
        """Take the distance of a point in the frame of the solid [m], and where the tip is there."""
        self.distance, self.frame, self.hold, self.period = distance, np.array(frame), hold, period
        self.position = np.array(start, float)
        self.time = 0.0

    def force(self):
        """In the frame of the solid."""
        d = self.distance(self.position)
        if d >= RADIUS:
            return np.zeros(3)
        h = 1e-7
        steps = h * np.eye(3)
        out = np.array([self.distance(self.position + s) - self.distance(self.position - s) for s in steps])
        return STIFFNESS * (RADIUS - d) * out / np.linalg.norm(out)

    def sample(self):
        f, p = (tuple((self.frame @ x).tolist()) for x in (self.force(), self.position))
        wrench = WrenchSample(self.time, (*f, 0.0, 0.0, 0.0), ZERO)
        return Sample(self.time, ArmSample(self.time, p, IDENTITY, ZERO), (wrench,))

    def move(self, velocity):
        self.position = self.position + self.hold(self.position, self.period * self.frame.T @ np.array(velocity))
        self.time += self.period


class Script:
    """Asks for given legs one after the other, and remembers how they ended and what was felt."""

    def __init__(self, plane, *legs, until=lambda felt: False):
        self.plane, self.wanted, self.until = plane, legs, until
        self.marks = ()

    def start(self):
        self.left, self.ends, self.felt = list(self.wanted), [], []

    def feel(self, felt):
        self.felt.append(felt)
        return self.until(felt)

    def next(self, ended):
        if ended is not None:
            self.ends.append(ended)
        return self.left.pop(0) if self.left else None

    @property
    def how(self):
        return [ended.how for ended in self.ends]


class Explored:
    """What a controller did in a world, row by row, in the frame of the solid."""

    def __init__(self, controller, world, seconds=20.0):
        touch, self.controller = Touch(Finger(Sphere(RADIUS))), controller
        controller.start(touch.sense(world.sample()))
        phases, velocities, positions, forces, touching = [], [], [], [], []
        while world.time < seconds:
            now = touch.sense(world.sample())
            command = controller.step(now)
            phases.append(command.phase)
            velocities.append(rotate_back(tuple(map(tuple, world.frame.tolist())), command.velocity_base_tip))
            positions.append(world.position)
            forces.append(norm(now.fingers[0].wrench[:3]))
            touching.append(now.fingers[0].touching)
            if command.phase.is_final:
                break
            world.move(command.velocity_base_tip)
        self.names = phases
        self.velocity, self.position = np.array(velocities), np.array(positions)
        self.force, self.touching = np.array(forces), np.array(touching)

    @property
    def phases(self):
        return [p for i, p in enumerate(self.names) if i == 0 or p is not self.names[i - 1]]

    def at(self, phase):
        return np.array([name is phase for name in self.names])
