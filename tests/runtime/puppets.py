"""A back end and controllers that do what a test tells them, and remember what was asked of them."""

import math

from palpate.runtime.data import ArmSample, Command, Phase, Sample, WrenchSample
from palpate.runtime.pacing import SimulatedTime
from palpate.runtime.touch import Finger, Touch
from palpate.spatial import IDENTITY
from palpate.surfaces import Sphere

PERIOD = 1e-3
PUSH = (0.1, 0.0, 2.0, 0.0, 0.0, 0.0)
"""2 N from below, on a sphere about the origin."""
REST = (0.0, 0.0, 0.0)


def sample(time=0.0, wrench=PUSH, position=REST, velocity=REST, rotation=IDENTITY, wrenches=None):
    arm = ArmSample(time, position, rotation, velocity)
    given = (wrench,) if wrenches is None else wrenches
    return Sample(time, arm, tuple(WrenchSample(time, w, (0.0, 0.0, 9.81)) for w in given))


def touch(count=1):
    return Touch(*[Finger(Sphere(0.01))] * count)


class PuppetBackend:
    """An ideal integrator: it moves as commanded, and takes `slow_down` periods to stop.

    `script` maps a step number to keyword arguments of `sample`, or to an exception to raise then.
    """

    def __init__(self, script=None, slow_down=3):
        self.period = PERIOD
        self.pacer = SimulatedTime()
        self.script = script or {}
        self.commands = []
        self.closed = 0
        self.closed_after = None
        self._slow_down = slow_down
        self._position, self._velocity = REST, REST
        self._resting = 0

    def start(self):
        return self._now(0)

    def step(self, command):
        self.commands.append(command)
        v = command.velocity_base_tip
        if v == REST:
            self._resting += 1
            if self._resting >= self._slow_down:
                self._velocity = REST
        else:
            self._resting, self._velocity = 0, v
        self._position = tuple(x + PERIOD * u for x, u in zip(self._position, self._velocity, strict=True))
        return self._now(len(self.commands))

    def _now(self, step):
        scripted = self.script.get(step, {})
        if isinstance(scripted, BaseException):
            raise scripted
        return sample(**{"time": step * PERIOD, "position": self._position, "velocity": self._velocity} | scripted)

    def close(self):
        self.closed += 1
        self.closed_after = len(self.commands)

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        self.close()

    @property
    def at_rest(self):
        """Whether its last command before closing was to stand still, and it does."""
        stands = self._velocity == REST
        return bool(self.commands) and self.commands[-1].velocity_base_tip == REST and stands

    @property
    def moved_by_finite_commands(self):
        return all(math.isfinite(sum(c.velocity_base_tip)) for c in self.commands)


class PuppetController:
    """Moves with a constant velocity; `script` maps a step number to a command or an exception."""

    def __init__(self, script=None, velocity=(0.01, 0.0, 0.0)):
        self.script = script or {}
        self.velocity = velocity
        self.started = []
        self.seen = []

    def start(self, first):
        self.started.append(first)

    def step(self, now):
        self.seen.append(now)
        scripted = self.script.get(len(self.seen) - 1, Command(self.velocity, Phase.SCAN))
        if isinstance(scripted, BaseException):
            raise scripted
        return scripted
