"""A made-up plane that pushes back like a spring and rubs in closed form, for tests of what rubs on it."""

import math

import numpy as np

from palpate.controllers import force_gain
from palpate.controllers.rubbing_parameters import RubbingParameters
from palpate.runtime.data import ArmSample, Sample, WrenchSample
from palpate.runtime.touch import Finger, Touch
from palpate.surfaces import Sphere

PERIOD, RADIUS, STIFFNESS, GAP = 1e-3, 0.008, 4e3, 0.002
GAIN = force_gain(STIFFNESS, 0.0215)
WANTED = RubbingParameters(GAIN, 0.0015, tare_time=0.05, settle_time=0.2, force_rate=10.0)


class RubbedPlane:
    """A sphere that moves as commanded over a plane through the origin, tilted about y.

    It hangs together with the plane by springs, of `skin` [N/m] along it and `skin` e^2 about the normal, until
    these reach the limits mu f_n and mu e f_n.
    """

    def __init__(self, friction=0.5, spin_length=0.003, skin=20e3, tilt=0.0, center=(0.0, 0.0, 0.0)):
        self.friction, self.spin_length, self.skin = friction, spin_length, skin
        self.out = np.array([math.sin(tilt), 0.0, math.cos(tilt)])
        self.center = np.array(center)
        self.position = (RADIUS + GAP) * self.out - self.center
        self.rotation = np.eye(3)
        self.velocity = self.turn = np.zeros(3)
        self.stretch, self.twist = np.zeros(3), 0.0
        self.there, self.time = True, 0.0

    @property
    def force(self):
        depth = RADIUS - (self.position + self.rotation @ self.center) @ self.out
        return STIFFNESS * max(depth, 0.0) if self.there else 0.0

    @property
    def lever(self):
        """From the tip frame's origin to the contact."""
        return self.rotation @ self.center - RADIUS * self.out

    def sample(self):
        n, fn = -self.out, self.force
        f = fn * self.out - self.skin * self.stretch
        q = -self.skin * self.spin_length**2 * self.twist
        m = np.cross(self.lever, f) + q * n
        wrench = (*(self.rotation.T @ f).tolist(), *(self.rotation.T @ m).tolist())
        arm = ArmSample(
            self.time,
            tuple(self.position.tolist()),
            tuple(tuple(row) for row in self.rotation.tolist()),
            tuple(self.velocity.tolist()),
            angular_velocity_base_tip=tuple(self.turn.tolist()),
        )
        return Sample(self.time, arm, (WrenchSample(self.time, wrench, (0.0, 0.0, 0.0)),))

    def move(self, command):
        self.velocity = np.array(command.velocity_base_tip)
        self.turn = np.array(command.angular_velocity_base_tip)
        self.position = self.position + PERIOD * self.velocity
        angle = PERIOD * np.linalg.norm(self.turn)
        if angle > 0.0:
            x, y, z = self.turn / np.linalg.norm(self.turn)
            cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            about = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
            self.rotation = about @ self.rotation
        n = -self.out
        slide = self.velocity + np.cross(self.turn, self.lever)
        self.stretch = self.stretch + PERIOD * (slide - (slide @ n) * n)
        self.twist += PERIOD * float(self.turn @ n)
        most, e = self.friction * self.force, self.spin_length
        size = math.hypot(self.skin * np.linalg.norm(self.stretch), self.skin * e * self.twist)
        if size > most:
            self.stretch, self.twist = self.stretch * most / size, self.twist * most / size
        self.time += PERIOD


class Rows:
    """A run, period by period: phases, commands, normal forces and levers; velocities of the commands."""

    def __init__(self):
        self.phase, self.command, self.force, self.lever = [], [], [], []

    @property
    def phases(self):
        return [p for i, p in enumerate(self.phase) if i == 0 or p != self.phase[i - 1]]

    @property
    def velocity(self):
        return np.array([command.velocity_base_tip for command in self.command])

    @property
    def turn(self):
        return np.array([command.angular_velocity_base_tip for command in self.command])


def rub(plane, controller, seconds=60.0, vanish=None, back=math.inf, observers=()):
    """Run a controller until it is done; the plane vanishes and comes back at given times."""
    touch, rows = Touch(Finger(Sphere(RADIUS, center=plane.center))), Rows()
    controller.start(touch.sense(plane.sample()))
    while plane.time < seconds and not (rows.phase and rows.phase[-1].is_final):
        plane.there = vanish is None or plane.time < vanish or plane.time > back
        sample = plane.sample()
        now = touch.sense(sample)
        command = controller.step(now)
        for observer in observers:
            observer(sample, now, command)
        rows.phase.append(command.phase)
        rows.command.append(command)
        rows.force.append(plane.force)
        rows.lever.append(plane.lever)
        if not command.phase.is_final:
            plane.move(command)
    return rows
