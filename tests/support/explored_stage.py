"""An exploration on the simulated stage through the public pieces: scene, touch, controller, supervisor, log."""

from dataclasses import dataclass, field

import numpy as np

from palpate.controllers import (
    ExploreController,
    ExploreParameters,
    force_gain,
    series_stiffness,
    tracking_delay,
)
from palpate.controllers.paths import Strategy
from palpate.runtime import Finger, Limits, Phase, Supervisor, Touch, run
from palpate.runtime.log import MemoryLog, Record, Recorder
from palpate.runtime.result import RunResult
from palpate.sensing.compensation import SensorPayload
from palpate.sim import ContactLaw, MujocoBackend, Stage, Tip, build_scene
from palpate.surfaces import Sphere

PERIOD, FORCE, RADIUS = 1e-3, 2.0, 0.004
LAW, STAGE = ContactLaw(), Stage()


@dataclass(eq=False)
class Legs:
    """Passes on to a strategy and remembers what it asked for and what came of it."""

    strategy: Strategy
    legs: list = field(default_factory=list)
    ends: list = field(default_factory=list)

    @property
    def plane(self):
        return self.strategy.plane

    @property
    def marks(self):
        return self.strategy.marks

    def start(self):
        self.strategy.start()
        self.legs, self.ends = [], []

    def feel(self, felt):
        return self.strategy.feel(felt)

    def next(self, ended):
        leg = self.strategy.next(ended)
        if ended is not None:
            self.ends.append(ended.how)
        if leg is not None:
            self.legs.append(leg)
        return leg


@dataclass(frozen=True, eq=False)
class Explored:
    """What came of it."""

    result: RunResult
    strategy: Strategy
    legs: list
    ends: list
    record: Record
    truth: np.ndarray

    @property
    def phases(self):
        names = self.record.phase.tolist()
        return [name for k, name in enumerate(names) if k == 0 or name != names[k - 1]]

    @property
    def scan(self):
        return self.record.phase == Phase.SCAN.value

    @property
    def tip(self):
        return self.record.position[self.scan]

    @property
    def points(self):
        """What a map would be made of: the felt contacts of scans."""
        record, kept = self.record, self.scan & self.record.touching
        return record.centroid[kept] - record.normal[kept] * record.normal_force[kept, None] / (2 * LAW.stiffness)

    @property
    def most_force(self):
        return float(np.linalg.norm(self.truth, axis=1).max())

    def force_rms(self, skip=0):
        """True normal force against the set one, while sweeping."""
        force = -np.sum(self.truth * self.record.normal, axis=1)[self.scan][skip:]
        return float(np.sqrt(np.mean((force - FORCE) ** 2)))


def explored(target, strategy, start, *, law=LAW, speed=0.02, seconds=60.0, limits=None, noise=None, **given):
    """Explore from a place of the tip's centre."""
    tip = Tip(Sphere(RADIUS))
    scene = build_scene(tip, target, law, start, STAGE)
    backend = MujocoBackend(scene, PERIOD) if noise is None else MujocoBackend(scene, PERIOD, noise)
    delay = tracking_delay(PERIOD, STAGE.lag)
    gain = force_gain(series_stiffness(LAW.stiffness, STAGE.stiffness(tip.mass)), delay)
    parameters = ExploreParameters(force=FORCE, speed=speed, gain=gain, lead=delay, **given)
    finger = Finger(Sphere(RADIUS - FORCE / (2 * LAW.stiffness)), SensorPayload(tip.mass))
    memory, truth, watched = MemoryLog(), [], Legs(strategy)
    result = run(
        backend,
        Touch(finger),
        ExploreController(parameters, watched, PERIOD),
        Supervisor((limits or Limits()).allowing(speed + 0.02)),
        duration=seconds,
        recorder=Recorder(memory),
        observers=(lambda *_: truth.append(backend.truth().force),),
    )
    return Explored(result, strategy, watched.legs, watched.ends, memory.record(), np.array(truth))
