"""An exploration on the simulated stage through the public pieces: scene, touch, controller, supervisor, log."""

from dataclasses import dataclass
from unittest import mock

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
from palpate.runtime.result import Ending, RunResult
from palpate.sensing.compensation import SensorPayload
from palpate.sim import ContactLaw, MujocoBackend, Stage, Tip, build_scene
from palpate.surfaces import Sphere

PERIOD, FORCE, RADIUS = 1e-3, 2.0, 0.004
LAW, STAGE = ContactLaw(), Stage()


@dataclass(frozen=True, eq=False)
class Explored:
    """What came of it."""

    result: RunResult
    strategy: Strategy
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

    def force_rms(self):
        """True normal force against the set one, while sweeping."""
        force = -np.sum(self.truth * self.record.normal, axis=1)[self.scan]
        return float(np.sqrt(np.mean((force - FORCE) ** 2)))

    def check_ended(self, ending=Ending.DONE):
        """Check how it ended: at rest, and never above the force limit."""
        assert self.result.ending is ending
        assert self.most_force < Limits().force
        assert np.linalg.norm(self.record.velocity[-1]) < 1e-3


def explored(target, strategy, start, *, law=LAW, speed=0.02, seconds=60.0, limits=None, **given):
    """Explore from a place of the tip's centre."""
    tip = Tip(Sphere(RADIUS))
    backend = MujocoBackend(build_scene(tip, target, law, start, STAGE), PERIOD)
    delay = tracking_delay(PERIOD, STAGE.lag)
    gain = force_gain(series_stiffness(LAW.stiffness, STAGE.stiffness(tip.mass)), delay)
    parameters = ExploreParameters(force=FORCE, speed=speed, gain=gain, lead=delay, **given)
    finger = Finger(Sphere(RADIUS - FORCE / (2 * LAW.stiffness)), SensorPayload(tip.mass))
    memory, truth = MemoryLog(), []
    with mock.patch.object(strategy, "next", wraps=strategy.next) as legs:
        result = run(
            backend,
            Touch(finger),
            ExploreController(parameters, strategy, PERIOD),
            Supervisor((limits or Limits()).allowing(speed + 0.02)),
            duration=seconds,
            recorder=Recorder(memory),
            observers=(lambda *_: truth.append(backend.truth().force),),
        )
    ends = [ended.how for (ended,), _ in legs.call_args_list if ended is not None]
    return Explored(result, strategy, ends, memory.record(), np.array(truth))
